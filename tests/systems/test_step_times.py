"""The times of a step response follow the modes that are seen in it."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose

from halfdof_ctrl import mech2ss, mechss
from halfdof_ctrl.systems.step_times import MOST_TIME_STEPS, relevant_poles, step_times

ROUNDING = 1e-12  #: curve and markers come by different routes; both are exact to a few digits less than that


@pytest.mark.parametrize(
    ("poles", "horizon"),
    [
        ([-2.0], 2.5),
        ([-1e5, -0.5], 10.0),
        ([2j, -2j], 20 * np.pi),
        ([-0.01 + 2j, -0.01 - 2j], 20 * np.pi),
        ([0.0, 0.0], 1.0),
        ([], 1.0),
        ([0.0, -2.0], 2.5),
        ([0.5, -0.001], 10.0),
    ],
    ids=["lag", "stiff", "undamped", "lightly damped", "free mass", "static", "motor", "unstable"],
)
def test_horizon_follows_from_the_slowest_mode(poles: list[complex], horizon: float) -> None:
    """Five time constants, twenty periods, growth by exp(5), or one second where there is no scale."""
    time = step_times(poles)
    assert_allclose(time[-1], horizon, rtol=ROUNDING)
    assert_allclose(np.diff(time), time[1], rtol=1e-9)


def test_oscillation_that_lasts_is_resolved_beside_a_slow_mode() -> None:
    """An undamped mode beside a slow one gets 31 points a period while the cap allows, never below 6."""
    time = step_times([-1.0, 200j, -200j])
    assert time[1] * 200.0 <= 0.2 + 1e-12
    time = step_times([-1.0, 1e5j, -1e5j])
    assert time.size == MOST_TIME_STEPS + 1
    assert time[1] * 1e5 <= 1.0 + 1e-12


def test_rounded_poles_of_a_free_body_count_as_integrators() -> None:
    """Two masses on a spring, floating free: the double pole at the origin is exact, the horizon 20 periods."""
    sys = mech2ss(mechss(np.diag([1.0, 3.0]), None, [[7, -7], [-7, 7]]))
    poles = relevant_poles(sys.A, sys.B, sys.C, sys.D)
    assert np.count_nonzero(poles == 0.0) == 2
    assert_allclose(step_times(poles)[-1], 20 * 2 * np.pi / np.sqrt(7.0 * 4.0 / 3.0), rtol=1e-9)


@given(
    st.lists(
        st.complex_numbers(min_magnitude=1e-6, max_magnitude=1e6, allow_nan=False, allow_infinity=False), max_size=6
    )
)
def test_times_are_always_finite_and_few(poles: list[complex]) -> None:
    """Any poles give 500 to 10000 equal steps of positive length."""
    time = step_times(poles)
    assert 501 <= time.size <= MOST_TIME_STEPS + 1
    assert np.isfinite(time).all()
    assert time[1] > 0.0
