"""Warnings of responses that the entries of a model do not determine."""

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose

from halfdof_ctrl import (
    SecondOrderModel,
    descriptor_response,
    dynamic_stiffness_response,
    forced_response,
    frequency_response,
    initial_response,
    mechss,
    step_response,
)
from halfdof_ctrl.base.errors import DataLimitWarning
from halfdof_ctrl.systems.eigenvalue_table import eigenvalue_table
from halfdof_ctrl.systems.state_space import system_of_model
from support.slender_beam import slender_beam, tip_receptance
from support.structures import Structure, damped_structures

OMEGA = np.array([0.5, 1.0, 5.0, 10.0])  # rad/s, away from the resonances at 2.6 and 16.4
DISCRETIZED = 1e-6  # relative: 3000 elements
FEW = 1e-4  # relative: 250 elements


def test_beam_of_thousands_of_elements_is_refined_and_announced() -> None:
    """Without refinement its error is some percent; (DATA) says so, and names the frequency."""
    with pytest.warns(DataLimitWarning, match=r"determine the response of q5998 to F_q5998 at 1 rad/s.*upper bound"):
        found = descriptor_response(slender_beam(3000, is_sparse=True), OMEGA).complex
    assert_allclose(found, [tip_receptance(omega) for omega in OMEGA.tolist()], rtol=DISCRETIZED)


@pytest.mark.filterwarnings("ignore:Entries of M, C, K known:halfdof_ctrl.errors.DataLimitWarning")
def test_beam_of_five_thousand_elements_is_right() -> None:
    """Its mass is lost beside the spacing of the diagonal of K, and found again, just below the first resonance."""
    found = descriptor_response(slender_beam(5000, is_sparse=True), [2.0]).complex
    assert_allclose(found, tip_receptance(2.0), rtol=DISCRETIZED)


def test_a_response_by_states_says_what_entries_determine() -> None:
    """A mass on a link of 1e12 N/m, whose node stands on 1 N/m: the static node hides from A what is lost."""
    model = mechss([[0, 0], [0, 1]], None, [[1e12 + 1, -1e12], [-1e12, 1e12]]).select("F_q1", "q1")
    with pytest.warns(
        DataLimitWarning, match=r"determine the response of q1 to F_q1 at 0\.7 rad/s to .*e-03 of its value"
    ):
        found = frequency_response(model, [0.1, 0.7]).complex
    soft = 1.0 / (1.0 + 1e-12)
    assert_allclose(found, [1.0 / (soft - 0.01), 1.0 / (soft - 0.49)], rtol=1e-11)


def test_dense_and_sparse_beams_have_one_response_and_one_limit() -> None:
    """250 elements, by either method, to the last digits; both warn."""
    responses = []
    for is_sparse in (False, True):
        with pytest.warns(DataLimitWarning, match="Small masses or springs were lost beside stiff ones"):
            responses.append(descriptor_response(slender_beam(250, is_sparse=is_sparse), OMEGA).complex)
    assert_allclose(responses[0], responses[1], rtol=1e-13)
    assert_allclose(responses[0], [tip_receptance(omega) for omega in OMEGA.tolist()], rtol=FEW)


@pytest.mark.parametrize("is_sparse", [False, True])
def test_short_beam_is_left_alone(*, is_sparse: bool) -> None:
    """20 elements lose no more than 1e-9: no warning, on the resonance of the undamped beam neither."""
    omega = np.array([1.0, 2.6218453147])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        descriptor_response(slender_beam(20, is_sparse=is_sparse), omega)


def test_undamped_resonance_is_no_loss() -> None:
    """At 2 rad/s and a millionth beside it: a change of the frequency in its last digits makes the difference."""
    oscillators = mechss(np.eye(2), None, [[5.0, -1.0], [-1.0, 5.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        descriptor_response(oscillators, [2.0 * (1.0 + 1e-12), 2.0 * (1.0 + 1e-6)])


@given(structure=damped_structures())
def test_ordinary_structures_raise_no_warning(structure: Structure) -> None:
    """Small integers with all kinds of DOFs."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        descriptor_response(structure.model(), np.geomspace(1e-2, 1e2, 20))


@pytest.mark.parametrize("is_sparse", [False, True])
def test_the_digits_of_a_file_count(*, is_sparse: bool) -> None:
    """30 elements lose nothing in double precision, and some of ten digits: (DATA) is larger by their ratio."""
    beam = slender_beam(30, is_sparse=is_sparse)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        descriptor_response(beam, OMEGA)
    with pytest.warns(DataLimitWarning, match=r"known to the digits of the file \(10 digits, 5e-10\) determine"):
        descriptor_response(replace(beam, known_to=5e-10), OMEGA)


def test_a_response_by_states_is_warned_of_as_well() -> None:
    """By the same bound; a model of a few stiff springs loses no more than the digits themselves."""
    with pytest.warns(DataLimitWarning, match="digits of the file"):
        frequency_response(replace(slender_beam(30, is_sparse=False), known_to=5e-10), OMEGA)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        frequency_response(replace(mechss(np.eye(2), 0.1 * np.eye(2), [[5, -1], [-1, 5]]), known_to=5e-10), OMEGA)


def on_link(stiffness: float) -> SecondOrderModel:
    """Put a mass of 1 kg on a link, whose node stands on 1 N/m."""
    K = [[stiffness + 1.0, -stiffness], [-stiffness, stiffness]]
    return mechss(np.diag([0.0, 1.0]), np.diag([0.1, 0.0]), K).select("F_q1", "q1")


@pytest.mark.parametrize(
    "show",
    [
        lambda model: step_response(model, np.linspace(0.0, 10.0, 50)),
        lambda model: initial_response(model, np.linspace(0.0, 10.0, 50), displacement={"q1": 1.0}),
        lambda model: forced_response(model, np.linspace(0.0, 10.0, 50), 1.0),
        lambda model: dynamic_stiffness_response(model, "q1", [0.1, 0.7]),
        lambda model: eigenvalue_table(model, system_of_model(model)),
    ],
    ids=["step", "initial", "forced", "stiffness", "eigenvalues"],
)
def test_whatever_shows_digits_says_what_entries_determine(show: Callable[[SecondOrderModel], object]) -> None:
    """A link of 1e12 N/m makes everything slow known to 1e-3; one of 1e4 N/m to 1e-11."""
    with pytest.warns(DataLimitWarning, match="determine the response of (q1 to F_q1|R_q1 to q1)"):
        show(on_link(1e12))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        show(on_link(1e4))
