"""Claims that whatever needs no state space falls back to the descriptor form in the same cases."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import (
    SecondOrderModel,
    bode_plot,
    descriptor_response,
    frequency_response,
    mech2ss,
    mechss,
    pencil_structure,
    pole_map_plot,
    sweep,
)
from halfdof_ctrl.errors import NoStateSpaceError
from halfdof_ctrl.reduction.deflation import method
from halfdof_ctrl.reduction.deflation.row_system import Caution
from support.figures import legend_texts

ABSURD = Caution(1e30, 1e30)  # takes everything for rounding, so that no order can be told
OMEGA = np.array([0.5, 3.0])  # [rad/s]
SAME = 1e-12  # the same equations, solved again


def undecided() -> SecondOrderModel:
    """Return two masses that a rigid link joins, for which deflation is needed."""
    return mechss(np.diag([1, 1, 0]), None, [[1, 0, 1], [0, 2, -1], [1, -1, 0]]).select("F_q0", "q0")


@pytest.mark.parametrize(
    ("model", "why"),
    [
        (undecided(), "order uncertain"),
        (mechss([[1]], None, [[4 + 1j]]), "model is complex"),
        (mechss([[0]], None, [[4]]).select(outputs="q0_dot"), "improper"),
    ],
    ids=["uncertain", "complex", "improper"],
)
def test_all_fall_back_in_the_same_cases(model: SecondOrderModel, why: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Response, Bode diagram, pole map and sweeps are those of M, C, K, and the diagram says why."""
    monkeypatch.setattr(method, "CAUTIONS", (ABSURD,))
    monkeypatch.setattr(method, "AS_GIVEN", ABSURD)
    with pytest.raises(NoStateSpaceError) as refusal:
        mech2ss(model)
    assert refusal.value.why == why
    desired = descriptor_response(model, OMEGA).frdata
    assert_allclose(frequency_response(model, OMEGA).frdata, desired, rtol=SAME)
    assert legend_texts(bode_plot(model, OMEGA)) == [f"descriptor form (no state space: {why})"]
    pole_map_plot(model)
    eigenvalues = pencil_structure(model).finite_eigenvalues
    assert_allclose(np.asarray(sweep(model, compute="poles").poles), eigenvalues, rtol=SAME)
