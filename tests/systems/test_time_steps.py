"""Time responses beside poles that are many decades faster, against ball arithmetic."""

import flint
import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, forced_response, initial_response, mechss, step_response
from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.errors import LostDigitsWarning
from halfdof_ctrl.systems.time_steps import STEPS_MOST_STATES, time_steps

PRECISION = 800  #: bits
DIGITS = 1e-11  #: of the largest value: some thousand steps, rounded each
MASS, SPRING, BRANCHES = 3.0, 40.0, ((2.0, 1e-9), (700.0, 5.0), (11.0, 300.0))  # kg, N/m, (N/m, N s/m)


def mount() -> SecondOrderModel:
    """Give a mass on a spring and Maxwell branches, one of which has lost all force within a nanosecond."""
    n = 1 + len(BRANCHES)
    M, C, K = np.zeros((3, n, n))
    M[0, 0], K[0, 0] = MASS, SPRING + sum(k for k, _ in BRANCHES)
    for j, (k, c) in enumerate(BRANCHES, start=1):
        K[j, j], K[0, j], K[j, 0], C[j, j] = k, -k, -k, c
    return mechss(M, C, K, dofs=["y", "m1", "m2", "m3"]).select("F_y", "y")


def exact_motion(times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give y after a step of force, and after y = 1 with the other states at zero."""
    before, flint.ctx.prec = flint.ctx.prec, PRECISION
    try:
        n = 2 + len(BRANCHES)
        A = flint.arb_mat(n + 1, n + 1)  # y, m1, m2, m3, y', force
        A[0, n - 1] = 1
        A[n - 1, 0] = -(flint.arb(SPRING) + sum(k for k, _ in BRANCHES)) / MASS
        A[n - 1, n] = 1 / flint.arb(MASS)
        for j, (k, c) in enumerate(BRANCHES, start=1):
            A[j, 0], A[j, j] = flint.arb(k) / c, -flint.arb(k) / c
            A[n - 1, j] = flint.arb(k) / MASS
        motions = [(A * flint.arb(t)).exp() for t in times.tolist()]
        return tuple(np.array([float(E[0, j].mid()) for E in motions]) for j in (n, 0))  # type: ignore[return-value]
    finally:
        flint.ctx.prec = before


def test_slow_motion_keeps_its_digits_beside_a_branch_that_relaxes_in_a_nanosecond() -> None:
    """Poles of 2e9 and 0.04 rad/s: 30 s of a step, of a ramp's end and of a free motion, from M, C, K in 800 bits."""
    model, times = mount(), np.linspace(0.0, 30.0, 501)
    some = np.array([1, 20, 133, 500])
    stepped, let_go = exact_motion(times[some])
    for found, expected in (
        (step_response(model, times), stepped),
        (forced_response(model, times, 1.0), stepped),
        (initial_response(model, times, displacement={"y": 1.0}), let_go),
    ):
        outputs = np.asarray(found.outputs).ravel()
        assert np.abs(outputs[some] - expected).max() <= DIGITS * np.abs(outputs).max()


def test_inputs_are_linear_between_times() -> None:
    """A lag x' = r (u - x) follows a ramp of u, whatever its step, as t - (1 - e^(-r t)) / r."""
    rate = 1e9
    times = np.linspace(0.0, 10.0, 11)
    A, B = np.diag([-rate, -0.5]), np.array([[rate], [0.5]])
    steps = time_steps(A, B, times)
    assert steps is not None
    found = steps.states(times[None, None])[:, 0]
    for row, r in zip(found, (rate, 0.5), strict=True):
        assert np.abs(row - (times - (1.0 - np.exp(-r * times)) / r)).max() <= DIGITS * 10.0


def test_traces_are_followed_side_by_side() -> None:
    """Two inputs, one after the other, give what each gives alone."""
    times = np.linspace(0.0, 1.0, 6)
    A, B = np.array([[-1e9, 1e9], [0.0, -1.0]]), np.eye(2)
    steps = time_steps(A, B, times)
    assert steps is not None
    inputs = np.broadcast_to(np.eye(2)[:, :, None], (2, 2, 6))
    together = steps.states(inputs)
    for j in range(2):
        np.testing.assert_array_equal(together[:, [j]], steps.states(inputs[:, [j]]))


@pytest.mark.parametrize(
    ("rate", "size"), [(1.0, 2), (1e9, STEPS_MOST_STATES + 1), (1e-300, 0)], ids=["slow", "many states", "none"]
)
def test_python_control_steps_where_that_loses_nothing_or_takes_less(rate: float, size: int) -> None:
    """Poles as slow as the response need no other steps; beyond 500 states these would take too long."""
    assert time_steps(-rate * np.eye(size), np.ones((size, 1)), np.linspace(0.0, 10.0, 11)) is None


def test_growth_beyond_all_numbers_is_left_to_python_control() -> None:
    """Which gives infinity, and the response is refused with the time."""
    with np.errstate(all="ignore"):
        assert time_steps(np.array([[1e9]]), np.ones((1, 1)), np.linspace(0.0, 10.0, 11)) is None


def test_steps_that_lose_digits_of_many_states_are_told_of() -> None:
    """A damper that follows within 1e-12 s, among more than 500 states: steps in doubles lose up to a thousandth."""
    with pytest.warns(LostDigitsWarning, match=r"lose up to 1e-03 of the motion in 10 s: some poles are far faster"):
        assert time_steps(-1e12 * np.eye(STEPS_MOST_STATES + 1), np.ones((501, 1)), np.linspace(0.0, 10.0, 11)) is None
