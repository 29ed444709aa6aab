"""Which modes default grids and horizons are made for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import (
    SecondOrderModel,
    dynamic_stiffness_response,
    frequency_response,
    hydromount,
    mech2ss,
    mechss,
    step_response,
    transmissibility_response,
)
from halfdof_ctrl.systems.default_grid import MOST_POINTS, default_frequencies
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.seen_modes import seen_modes

RESONANCE = 16.569  # [rad/s] of the mount without its damper C_rs, to the digits that do not depend on it
WEAK = [1e-12, 1e-8, 1e-4]


def mount(damper: float) -> SecondOrderModel:
    """Give the mount with a weak damper at its massless node: a pole 1e6 to 1e14 times faster than its mode."""
    return hydromount(C_rs=damper).select("F_y", "y")


@pytest.mark.parametrize("damper", WEAK)
def test_a_weak_damper_does_not_move_grids_and_horizons(damper: float) -> None:
    """The response ends ten times above the resonance; a step lasts 7.58 s, twenty periods."""
    omega = np.asarray(frequency_response(mount(damper)).omega)
    assert np.abs(omega - RESONANCE).min() < 0.01
    assert omega[-1] == pytest.approx(10.0 * RESONANCE, rel=1e-2)
    assert step_response(mount(damper)).time[-1] == pytest.approx(7.58, rel=1e-2)
    for data in (dynamic_stiffness_response(hydromount(C_rs=damper), "y"),):
        assert np.abs(np.asarray(data.omega) - RESONANCE).min() < 0.2
    across = np.asarray(transmissibility_response(hydromount(C_rs=damper), "y", "y2").omega)
    assert across[0] < 3.0 < across[-1]


@given(st.floats(-9.0, 9.0), st.integers(0, 3))
def test_the_unit_of_time_changes_nothing(power: float, place: int) -> None:
    """With time in another unit the same poles are seen."""
    sys = mech2ss(hydromount().select("F_y", ["y", "y1", "y2", "y_dot"][place]))
    unit = 10.0**power
    A, B, C, D = (np.asarray(part) for part in (sys.A, sys.B, sys.C, sys.D))
    first, second = seen_modes(A, B, C, D), seen_modes(A * unit, B * unit, C, D)
    order, other = (
        np.lexsort((first.poles.imag, np.abs(first.poles))),
        np.lexsort((second.poles.imag, np.abs(second.poles))),
    )
    assert first.in_frequency[order].tolist() == second.in_frequency[other].tolist()
    assert first.in_step[order].tolist() == second.in_step[other].tolist()


def test_undamped_poles_that_reach_the_output_are_seen_others_not() -> None:
    """The middle of three equal masses stands still in the second mode."""
    K = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    sys = mech2ss(mechss(np.eye(3), None, K).select("F_q1", "q1"))
    modes = seen_modes(*(np.asarray(part) for part in (sys.A, sys.B, sys.C, sys.D)))
    seen = np.sort(modes.moving.imag[modes.moving.imag > 0.0])
    assert_allclose(seen, np.sqrt([2.0 - np.sqrt(2.0), 2.0 + np.sqrt(2.0)]), rtol=1e-12)


def test_poles_of_free_bodies_are_exactly_zero_and_set_no_scale() -> None:
    """Springs of 100 and 200 N/m in series between 2 and 1 kg: one resonance at 10 rad/s."""
    model = mechss(np.diag([2.0, 0, 1]), None, [[100, -100, 0], [-100, 300, -200], [0, -200, 200]])
    omega = np.asarray(frequency_response(model.select("F_q0", "q2")).omega)
    assert_allclose(omega[[0, -1]], [1.0, 100.0], rtol=1e-9)


def test_small_poles_beside_large_ones_keep_their_digits() -> None:
    """-1e12 and the pair -1e-3 +- 2j in one matrix of mixed states."""
    A = np.array([[-1e12, 1.0, 0.0], [0.0, -1e-3, 2.0], [0.0, -2.0, -1e-3]])
    poles = bounded_poles(A)
    pair = poles.values[np.abs(poles.values) < 10.0]
    assert_allclose(np.sort_complex(pair), [-1e-3 - 2j, -1e-3 + 2j], rtol=1e-14)


@given(
    st.lists(
        st.tuples(st.floats(-6.0, 6.0), st.floats(-9.0, 0.0)),
        max_size=300,
    )
)
def test_grids_are_small_and_meet_every_peak(roots: list[tuple[float, float]]) -> None:
    """At most 2000 rising points, one at the tip of every lightly damped peak."""
    poles = np.array([10.0**size * complex(-(10.0**zeta), 1.0) for size, zeta in roots])
    grid = default_frequencies(poles)
    assert grid.size <= MOST_POINTS
    assert (np.diff(grid) > 0.0).all()
    for pole in poles[np.abs(poles.real) < 0.05 * poles.imag]:
        assert np.abs(grid - pole.imag).min() == 0.0
