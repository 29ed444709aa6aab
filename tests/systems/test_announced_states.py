"""State spaces that hold the poles of free motions as rounding say so."""

import control
import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, frequency_response, mech2ss, mechss
from halfdof_ctrl.base.errors import LostDigitsWarning
from support.beams import beam_matrices


def floating(kind: str) -> SecondOrderModel:
    """Give a free body whose condensed stiffness is rounded, or a free beam of 80 elements."""
    if kind == "beam":
        M, K = beam_matrices(80, clamped=False)
        return mechss(M, None, K).select("F_q0", "q0")
    K = np.array([[100.0, -100, 0], [-100, 300, -200], [0, -200, 200]])
    return mechss(np.diag([2.0, 0, 1]), None, K).select("F_q0", "q2")


@pytest.mark.parametrize("kind", ["body", "beam"])
def test_free_motions_in_dof_states_are_announced_and_energy_states_keep_them(kind: str) -> None:
    """The static gain is infinite: of the model, and for python-control in energy and modal states."""
    model = floating(kind)
    for states in ("dofs", "scaled"):
        with pytest.warns(LostDigitsWarning, match=r"free motions?: \d poles at exactly 0.*states='energy'"):
            mech2ss(model, states=states)
    for states in ("energy", "modal"):
        assert np.isinf(control.dcgain(mech2ss(model, states=states)))
    assert np.isinf(frequency_response(model, [0.0]).complex.real).all()


def test_exact_zeros_need_no_word() -> None:
    """A free mass has a pole twice at 0 in any states; what is tied to the ground has none."""
    assert not np.isfinite(control.dcgain(mech2ss(mechss([[3.0]], None, None))))
    mech2ss(mechss(np.eye(2), None, [[4.0, -4.0], [-4.0, 4.001]]))
