"""Static condensation of sparse models: exact, and refused where static DOFs float."""

import hypothesis.strategies as st
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount, mechss, pencil_structure
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.model.condensed import condensed
from halfdof_ctrl.model.dense_copy import dense_copy, small_dense
from support.nets import net

ROUNDING = 1e-11  #: of a net of some hundred springs
POINTS = np.array([0.0, 3.0j, 40.0j, 1.0 + 2.0j])


def chain(stiffness: list[float]) -> SecondOrderModel:
    """Give springs in series between a wall and a mass of 2 kg."""
    k = np.array(stiffness)
    n = k.size
    K = np.diag(k + np.append(k[1:], 0.0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    M = np.zeros((n, n))
    M[-1, -1] = 2.0
    return mechss(sp.csc_array(M), None, sp.csc_array(K)).select(f"F_q{n - 1}", f"q{n - 1}")


@given(stiffness=st.lists(st.floats(0.01, 100.0), min_size=2, max_size=8))
def test_springs_in_series_give_the_harmonic_sum(stiffness: list[float]) -> None:
    """``1 / K_c = sum 1 / k``, and the mass stays as it is."""
    small = condensed(chain(stiffness), most=1)
    assert small is not None
    assert_allclose(small.K, [[1.0 / np.sum(1.0 / np.array(stiffness))]], rtol=ROUNDING)
    assert_array_equal(small.M, [[2.0]])
    assert small.dofs == (f"q{len(stiffness) - 1}",)


def test_a_net_has_the_transfer_function_and_eigenvalues_of_the_whole() -> None:
    """By solves with the sparse P(s) at each point, and by the pencil of the dense whole."""
    whole = net(20).select(["F_q3", "F_q77"], ["q3", "q150_dot", "q399_ddot"])
    small = condensed(whole, most=50)
    assert small is not None
    assert_allclose(small(POINTS), whole(POINTS), rtol=ROUNDING, atol=0.0)
    assert {"q3", "q77", "q150", "q399"} <= set(small.dofs)
    assert_array_equal(small.K, np.asarray(small.K).T)
    found, exact = pencil_structure(small).finite_eigenvalues, pencil_structure(whole.as_dense()).finite_eigenvalues
    assert_allclose(np.sort_complex(found), np.sort_complex(exact), rtol=1e-9)


def test_dofs_that_are_named_stay() -> None:
    """For weights on their motion."""
    small = condensed(net(10).select("F_q3", "q3"), most=50, keep=["q41", "q42"])
    assert small is not None
    assert {"q41", "q42"} <= set(small.dofs)


def test_an_unsymmetric_stiffness_is_condensed_too() -> None:
    """A follower force on a static DOF: K_c = 3 + 2 * 5 / 4."""
    model = mechss(sp.diags_array([1.0, 0.0]), None, sp.csc_array([[3.0, -2.0], [5.0, 4.0]])).select("F_q0", "q0")
    small = condensed(model, most=1)
    assert small is not None
    assert_allclose(small.K, [[5.5]], rtol=ROUNDING)


@pytest.mark.parametrize(
    "K",
    [
        [[4.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]],  # a DOF without anything
        [[4.0, 0.0, 0.0], [0.0, 1.0, -1.0], [0.0, -1.0, 1.0]],  # two that float together
        [[4.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],  # a multiplier
    ],
)
def test_static_dofs_that_float_or_are_tied_are_left_to_others(K: list[list[float]]) -> None:
    """K_ss is singular."""
    assert (
        condensed(mechss(sp.diags_array([1.0, 0.0, 0.0]), None, sp.csc_array(K)).select("F_q0", "q0"), most=3) is None
    )


def test_large_models_are_condensed_for_what_is_dense() -> None:
    """And counted as the whole; a model of which too much is asked for is refused, with what to do."""
    model = net(47)
    assert len(model.dofs) > 2000
    asked = model.select("F_q3", "q3")
    assert len(dense_copy(asked, "A test", "").dofs) < 30
    structure = pencil_structure(asked)
    assert structure.finite_eigenvalues.size == 2 * 6 + 2
    assert structure.n_infinite == 2 * len(model.dofs) - 14
    assert len(structure.infinite_blocks) == len(model.dofs) + 6 - 14
    assert_allclose(pencil_structure(model).finite_eigenvalues, structure.finite_eigenvalues, rtol=1e-9)
    with pytest.raises(ModelSizeError, match="Select fewer of these"):
        dense_copy(model, "A test", "")


def test_dense_and_small_models_are_as_they_are() -> None:
    """There is nothing to condense."""
    model = hydromount()
    assert small_dense(model, 3) is model
    assert small_dense(model, 2) is None
    assert condensed(model, most=3) is None
    assert condensed(mechss(sp.eye_array(2), None, sp.eye_array(2)), most=2) is None
