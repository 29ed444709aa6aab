"""State spaces that hold the poles of free motions as rounding say so."""

from itertools import product

import control
import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, frequency_response, mech2ss, mechss
from halfdof_ctrl.base.errors import LostDigitsWarning
from halfdof_ctrl.model.free_motions import FreeMotionCount
from halfdof_ctrl.systems.free_motion_warning import warn_of_free_motions
from halfdof_ctrl.systems.state_map import States
from support.beams import beam_matrices
from support.slycot_marks import HAS_SLYCOT


def floating(elements: int) -> SecondOrderModel:
    """Give a free beam, force and displacement at its end."""
    M, K = beam_matrices(elements, clamped=False)
    return mechss(M, None, K).select("F_q0", "q0")


def test_lost_free_motions_are_announced_and_energy_states_keep_them() -> None:
    """80 elements: poles at 1e-3 beside 22 rad/s, and a finite static gain; in energy states it is infinite."""
    model = floating(80)
    lost: tuple[States, ...] = ("dofs", "scaled")
    kept: tuple[States, ...] = ("energy", "modal")
    for states in lost:
        with pytest.warns(LostDigitsWarning, match=r"2 free motions: 4 poles at exactly 0.*states='energy'"):
            mech2ss(model, states=states)
    for states in kept:
        assert np.isinf(control.dcgain(mech2ss(model, states=states)))
    assert np.isinf(frequency_response(model, [0.0]).complex.real).all()


def test_a_body_without_other_poles_needs_no_word() -> None:
    """Nothing says whether 6e-9 rad/s is much, whichever kernel leaves a rounding error in A or none."""
    system = control.StateSpace([[0.0, 1.0], [3.3e-17, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    assert not warn_of_free_motions(system, FreeMotionCount(1, 2))


def test_exact_zeros_need_no_word() -> None:
    """A free mass has a pole twice at 0 in any states; of two joined ones it is known to the usual 1e-8."""
    assert not np.isfinite(control.dcgain(mech2ss(mechss([[3.0]], None, None))))
    mech2ss(mechss(np.eye(2), None, [[4.0, -4.0], [-4.0, 4.0]]))


@pytest.mark.parametrize("elements", [2, 10, 80])
def test_the_static_gain_of_a_free_beam_is_infinite_in_every_channel(elements: int) -> None:
    """Two free motions and one force, at the middle too, which turns nothing: with slycot never "no number"."""
    M, K = beam_matrices(elements, clamped=False)
    model = mechss(M, None, K)
    for force, output in product((0, elements, 2 * elements), (0, 1, 2 * elements)):
        static = control.dcgain(mech2ss(model.select(f"F_q{force}", f"q{output}"), states="energy"))
        assert np.isinf(static) or (np.isnan(static) and not HAS_SLYCOT)


def test_free_motions_of_bodies_apart_stay_apart() -> None:
    """Two beams that nothing joins: what pushes one gives the rigid momenta of the other exactly nothing."""
    M, K = beam_matrices(3, clamped=False)
    none = np.zeros_like(K)
    model = mechss(np.block([[M, none], [none, M]]), None, np.block([[K, none], [none, 2.0 * K]]))
    system = mech2ss(model.select("F_q0", "q8"), states="energy")
    momenta = np.asarray(system.B)[4:8, 0]
    assert np.count_nonzero(momenta) == 2
