"""Which modes default grids and horizons are made for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.sparse import csc_array, eye_array

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
from halfdof_ctrl.systems.default_grid import DEFAULT_GRID_MOST_POINTS, default_frequencies
from halfdof_ctrl.systems.frequency import model_frequencies
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.seen_modes import seen_by_vectors, seen_modes

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
    A, B, C, D = (np.asarray(part) for part in (sys.A, sys.B, sys.C, sys.D))
    modes = seen_modes(A, B, C, D)
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
    assert grid.size <= DEFAULT_GRID_MOST_POINTS
    assert (np.diff(grid) > 0.0).all()
    for pole in poles[np.abs(poles.real) < 0.05 * poles.imag]:
        assert np.abs(grid - pole.imag).min() == 0.0


def chain_with_weak_damper(masses: int) -> SecondOrderModel:
    """Give a held chain of masses of 1 kg on springs of 1 N/m, with a node without mass on a damper of 1e-9 N s/m."""
    K = np.zeros((masses + 1, masses + 1))
    K[:-1, :-1] = 2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    K[3, 3] += 1.0
    K[-1, -1], K[3, -1], K[-1, 3] = 1.0, -1.0, -1.0
    C = np.zeros_like(K)
    C[-1, -1] = 1e-9
    return mechss(np.diag([1.0] * masses + [0.0]), C, K).select("F_q0", "q0")


@pytest.mark.parametrize("masses", [20, 110])
def test_a_fast_pole_does_not_stretch_the_grid_of_a_long_chain(masses: int) -> None:
    """A pole at -1e9 rad/s beside modes up to 2 rad/s, few states and many: the grid ends ten times above these."""
    model = chain_with_weak_damper(masses)
    omega = np.asarray(frequency_response(model, None).omega)
    assert omega[-1] == pytest.approx(20.0, rel=0.2)
    assert omega.size <= DEFAULT_GRID_MOST_POINTS
    assert np.abs(omega - 2.0 * np.sin(np.pi / (2.0 * masses + 2.0))).min() < 1e-3 * omega[0] * 10.0


@given(st.integers(0, 2**32 - 1))
def test_eigenvectors_see_nearly_what_circles_see(seed: int) -> None:
    """Two ways to the residues of poles that are far apart; the half that is not reached is in neither."""
    generator = np.random.default_rng(seed)
    size = generator.uniform(0.0, 4.0, 6)
    A = np.kron(np.diag(10.0**size), np.array([[-0.05, 1.0], [-1.0, -0.05]]))
    B, C = np.zeros((12, 1)), np.zeros((1, 12))
    B[:6:2], C[0, 1::2] = 1.0, 1.0
    poles = bounded_poles(A)
    first, second = seen_modes(A, B, C, np.zeros((1, 1)), poles), seen_by_vectors(A, B, C, np.zeros((1, 1)), poles)
    reached = np.abs(np.abs(poles.values)[:, None] - np.abs(np.linalg.eigvals(A[:6, :6]))).min(axis=1) < 1e-6
    assert not second.in_frequency[~reached].any()
    assert first.in_frequency.tolist() == second.in_frequency.tolist()


def test_large_sparse_models_choose_by_what_their_channels_show() -> None:
    """The middle of a held chain of 1101 masses stands still in every second mode: points are at the others."""
    n = 1101
    K = csc_array(2.0 * eye_array(n) - eye_array(n, k=1) - eye_array(n, k=-1))
    middle = f"q{n // 2}"
    omega = model_frequencies(mechss(csc_array(eye_array(n)), csc_array(1e-3 * K), K).select(f"F_{middle}", middle))
    modes = 2.0 * np.sin(np.pi * np.arange(1, 26) / (2.0 * n + 2.0))
    assert omega.size <= 200
    assert omega[-1] > modes[10]
    near = np.abs(omega[:, None] / modes - 1.0).min(axis=0)
    assert (near[0:11:2] < 2e-4).all()
    assert (near[1:11:2] > 2e-4).any()
