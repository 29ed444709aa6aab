"""Frequency responses of sparse models: direct solves, a progress bar, and what is done kept on Ctrl-C."""

from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import block_diag, csc_array, diags_array
from scipy.sparse.linalg import splu

from halfdof_ctrl import SecondOrderModel, bode_plot, descriptor_response, frequency_response, mech2ss, mechss
from halfdof_ctrl.base.errors import (
    InterruptedResponseWarning,
    ModelSizeError,
    ParameterError,
    SingularPencilError,
)
from halfdof_ctrl.descriptor import sparse_response
from halfdof_ctrl.descriptor.sparse_response import coarse_to_fine
from halfdof_ctrl.model import sparse_evaluation
from halfdof_ctrl.model.sparse_evaluation import SparseTransfer
from halfdof_ctrl.systems import frequency
from halfdof_ctrl.systems.frequency import has_many_states, model_frequencies
from support.fe_models import space_frame, spring_grid

DIGITS = 1e-8  # of responses of frames and grids against factorizations by scipy as it stands
OMEGA = np.geomspace(0.5, 500.0, 9)  # [rad/s]


def framed(**options: Any) -> SecondOrderModel:  # noqa: ANN401  # those of mechss
    """Make a small frame with masses, dampers and selected signals."""
    model = space_frame(3, 3, 3, 4, parts=2, dampers=3).model(**options)
    return model.select(["F_q0", "F_q61"], ["q0", "q61_dot", "q100"])


def everywhere() -> SecondOrderModel:
    """Make a net with mass and damping at every node: 1200 states."""
    structure = spring_grid(30, 20, 600)
    return mechss(structure.M, csc_array(1e-4 * structure.K), structure.K).select("F_q3", "q17")


def test_responses_agree_with_factorizations_by_scipy() -> None:
    """``F(s) P(s)^-1 B(s)`` at each frequency, entry by entry."""
    model = framed()
    data = descriptor_response(model, OMEGA)
    assert_array_equal(data.omega, OMEGA)
    assert (data.input_labels, data.output_labels) == (["F_q0", "F_q61"], ["q0", "q61_dot", "q100"])
    K, C, M, B, F, G = (getattr(model, letter) for letter in "KCMBFG")
    for k, s in enumerate(1j * OMEGA):
        desired = (F + s * G) @ splu(csc_array(K + s * C + s**2 * M)).solve(B.toarray().astype(complex))
        assert_allclose(data.frdata[:, :, k], desired, rtol=0.0, atol=DIGITS * np.abs(desired).max())


def test_state_space_and_descriptor_form_agree() -> None:
    """frequency_response goes by the state space where there are few states."""
    model = framed()
    assert not has_many_states(model)
    exact = descriptor_response(model, OMEGA).frdata
    assert_allclose(frequency_response(model, OMEGA).frdata, exact, rtol=0.0, atol=DIGITS * np.abs(exact).max())


@pytest.mark.parametrize("count", [1, 2, 3, 7, 8, 100])
def test_any_beginning_of_the_order_is_spread_over_the_range(count: int) -> None:
    """Every position once; after j of them no gap is wider than about twice the mean."""
    order = coarse_to_fine(count)
    assert sorted(order) == list(range(count))
    for j in range(2, count):
        gaps = np.diff(np.sort(order[:j]))
        assert gaps.max() <= 4 * count / j


def interrupted(monkeypatch: pytest.MonkeyPatch, after: int) -> None:
    """Let the user press Ctrl-C after some frequencies."""
    at, calls = SparseTransfer.at, []

    def evaluate(transfer: SparseTransfer, s: complex) -> Any:  # noqa: ANN401
        calls.append(s)
        if len(calls) > after:
            raise KeyboardInterrupt
        return at(transfer, s)

    monkeypatch.setattr(SparseTransfer, "at", evaluate)


def test_what_is_done_is_kept_on_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four of nine frequencies, both ends among them, in order and right."""
    model = framed()
    whole = descriptor_response(model, OMEGA)
    interrupted(monkeypatch, after=4)
    with pytest.warns(InterruptedResponseWarning, match="Interrupted after 4 of 9 frequencies"):
        part = descriptor_response(model, OMEGA)
    assert_array_equal(part.omega, np.sort(OMEGA[coarse_to_fine(9)[:4]]))
    assert_array_equal(part.frdata, whole.frdata[:, :, np.sort(coarse_to_fine(9)[:4])])
    assert np.isfinite(part.frdata).all()


def test_an_interrupt_before_anything_is_done_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is nothing to keep; and model(s), whose points have no order to be kept in, is all or nothing."""
    model = framed()
    interrupted(monkeypatch, after=0)
    with pytest.raises(KeyboardInterrupt):
        descriptor_response(model, OMEGA)
    with pytest.raises(KeyboardInterrupt):
        model(1j * OMEGA)


def test_progress_is_shown_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar over the frequencies, by the one place that draws bars."""
    shown: list[tuple[int, str]] = []

    def noted(steps: list[int], what: str) -> list[int]:
        shown.append((len(steps), what))
        return steps

    monkeypatch.setattr(sparse_response, "progress", noted)
    monkeypatch.setattr(sparse_evaluation, "progress", noted)
    model = framed()
    descriptor_response(model, OMEGA)
    model(1j * OMEGA[:3])
    assert shown == [(9, "frequencies"), (3, "frequencies")]


def test_singular_pencils_are_refused_at_the_first_frequency() -> None:
    """A net that nothing holds beside one that is held; a pole at the first frequency is no reason."""
    held = spring_grid(8, 8, 2)
    loose = csc_array(held.K - diags_array(np.asarray(held.K.sum(axis=1))))
    none = csc_array(loose.shape)
    M, K = block_diag([held.M, none], format="csc"), block_diag([held.K, loose], format="csc")
    with pytest.raises(SingularPencilError, match="det P"):
        descriptor_response(mechss(M, None, K).select("F_q0", "q0"), OMEGA)
    free = mechss(csc_array(np.eye(3)), None, csc_array((3, 3))).select("F_q0", "q0")
    assert np.isinf(descriptor_response(free, [0.0, 1.0]).frdata[0, 0, 0].real)
    assert descriptor_response(free, [0.0, 1.0]).frdata[0, 0, 1] == -1.0


def test_too_large_responses_are_refused() -> None:
    """All forces and displacements of 20 000 DOFs."""
    n = 20_000
    diagonal = csc_array(diags_array(np.ones(n)))
    with pytest.raises(ModelSizeError, match=r"20000 outputs to 20000 inputs at 2 points would take 12\.8 GB"):
        descriptor_response(mechss(diagonal, None, diagonal), [1.0, 2.0])


def test_default_frequencies_of_few_states_show_their_modes() -> None:
    """Those of the dense model, whose poles are the same."""
    model = space_frame(2, 2, 2, 3, parts=2, dampers=3).model().select(["F_q0", "F_q31"], ["q0", "q31_dot", "q50"])
    found, dense = model_frequencies(model), model_frequencies(model.as_dense())
    assert_allclose(found[[0, -1]], dense[[0, -1]], rtol=1e-6)


def test_default_frequencies_of_many_states_reach_the_twelfth_mode() -> None:
    """200 of them, from a tenth of the lowest."""
    model = everywhere()
    assert has_many_states(model)
    omega = model_frequencies(model)
    size = np.sort(np.abs(np.linalg.eigvals(mech2ss(model).A)))[::2]
    assert omega.size == frequency.FEW_POINTS
    assert omega[0] == pytest.approx(size[0] / 10.0, rel=1e-3)
    assert omega[-1] == pytest.approx(1.2 * size[11], rel=1e-3)


def test_default_frequencies_need_real_modes() -> None:
    """With structural damping they are to be given, and then the response is there."""
    structure = spring_grid(8, 8, 20)
    model = mechss(structure.M, None, structure.K * (1.0 + 0.05j)).select("F_q0", "q0")
    with pytest.raises(ParameterError, match="Give omega"):
        descriptor_response(model)
    data = descriptor_response(model, [3.0])
    assert data.frdata[0, 0, 0].imag < 0.0
    loose = csc_array(structure.K - diags_array(np.asarray(structure.K.sum(axis=1))))
    with pytest.raises(SingularPencilError, match="det P"):
        descriptor_response(mechss(None, None, loose).select("F_q0", "q0"))


def test_bode_plot_of_many_states_is_the_descriptor_form() -> None:
    """No state space is made, and the legend says so."""
    model = everywhere()
    omega = np.geomspace(1.0, 100.0, 15)
    plot = bode_plot(model, omega)
    assert isinstance(plot, control.ControlPlot)
    (line,) = plot.lines[0, 0]
    assert line.get_label() == "descriptor form"
    assert_allclose(line.get_ydata(), descriptor_response(model, omega).magnitude)
    plt.close(plot.figure)


def test_bode_plot_marks_small_sparse_models_and_not_large_ones() -> None:
    """Markers of a large one take a factorization each, and are drawn where they are asked for."""
    small, large = framed().select("F_q0", "q0"), spring_grid(50, 45, 3).model().select("F_q0", "q0")
    for model, reference, curves in ((small, None, 2), (large, None, 1), (large, large, 2)):
        plot = bode_plot(model, np.geomspace(1.0, 10.0, 5), reference=reference)
        assert len(plot.lines[0, 0]) == curves
        plt.close(plot.figure)
