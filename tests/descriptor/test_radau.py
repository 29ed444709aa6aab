"""The direct time integration of descriptor equations: order nine, also at index one and two."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import hydromount, mechss
from halfdof_ctrl.descriptor.radau import (
    STAGES,
    RadauStep,
    Segment,
    descriptor_step_response,
    radau_matrix,
    radau_points,
    step_plan,
)

ROUNDOFF = 1e-12  # some hundred steps of well-conditioned solves
COEFFICIENTS = 1e-14  # five points on (0, 1]
ORDER = 0.6  # measured orders scatter this much before rounding is reached
RESPONSE = 1e-11  # at a resolution of 1/4 of the fastest mode


def integrated(
    E: np.ndarray, A: np.ndarray, b: np.ndarray, x: np.ndarray, step: tuple[float, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Take equal steps; give the last value and slope."""
    h, steps = step
    radau = RadauStep.factorized(E, A, h)
    slope = np.zeros_like(x)
    for _ in range(steps):
        x, slope = radau.advance(x, b)
    return x, slope


def test_coefficients_integrate_polynomials() -> None:
    """R integrates ``t^k`` exactly for k < 5 at all points, and for k < 9 over the whole step."""
    points = radau_points()
    R = radau_matrix(points)
    for k in range(STAGES):
        assert_allclose(R @ points**k, points ** (k + 1) / (k + 1), rtol=0.0, atol=COEFFICIENTS)
    for k in range(2 * STAGES - 1):
        assert_allclose(R[-1] @ points**k, 1.0 / (k + 1), rtol=COEFFICIENTS * 10)


def test_three_stages_are_those_of_the_book() -> None:
    """Hairer and Wanner, table IV.5.6: c = (4 -+ sqrt 6)/10, 1 and the last row of the matrix."""
    root = np.sqrt(6.0)
    points = radau_points(3)
    assert_allclose(points, [(4 - root) / 10, (4 + root) / 10, 1.0], rtol=COEFFICIENTS)
    assert_allclose(radau_matrix(points)[-1], [(16 - root) / 36, (16 + root) / 36, 1 / 9], rtol=COEFFICIENTS * 10)


def measured_order(errors: list[float]) -> float:
    """Give the exponent of h between two step lengths, the second half the first."""
    return float(np.log2(errors[0] / errors[1]))


def test_order_on_an_ordinary_equation_is_nine() -> None:
    """A damped oscillator against the matrix exponential."""
    A = np.array([[0.0, 1.0], [-4.0, -0.5]])
    x0, b = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    rest = -np.linalg.solve(A, b)
    desired = rest + scipy.linalg.expm(4.0 * A) @ (x0 - rest)
    errors = [float(np.abs(integrated(np.eye(2), A, b, x0, (4.0 / n, n))[0] - desired).max()) for n in (4, 8)]
    assert measured_order(errors) > 9.0 - ORDER


def test_order_on_an_index_one_equation_is_nine() -> None:
    """``x' = -x + z, 0 = x + 2 z - 1``: the algebraic unknown is as exact as the other."""
    E, A = np.diag([1.0, 0.0]), np.array([[-1.0, 1.0], [1.0, 2.0]])
    b = np.array([[0.0], [-1.0]])
    x = 1.0 / 3.0 - np.exp(-1.5 * 6.0) / 3.0
    desired = np.array([[x], [(1.0 - x) / 2.0]])
    errors = [float(np.abs(integrated(E, A, b, np.zeros((2, 1)), (6.0 / n, n))[0] - desired).max()) for n in (4, 8)]
    assert measured_order(errors) > 9.0 - ORDER


def test_order_on_an_index_two_equation_is_high() -> None:
    """``x' = -x + y + z, y' = -2 y + x - z, 0 = x + y - 1``: nine for x, y; at least STAGES for the multiplier."""
    E = np.diag([1.0, 1.0, 0.0])
    A = np.array([[-1.0, 1.0, 1.0], [1.0, -2.0, -2.0], [1.0, 1.0, 0.0]])
    b = np.array([[0.0], [0.0], [-1.0]])
    # x + y = 1 gives 0 = x' + y' = -y - z, so z = -y and x' = -x
    x = float(np.exp(-3.0))
    start = np.array([[1.0], [0.0], [0.0]])
    errors = []
    for n in (2, 4):
        found, _ = integrated(E, A, b, start, (3.0 / n, n))
        errors.append(float(np.abs(found[:2, 0] - [x, 1.0 - x]).max()))
        assert_allclose(found[0] + found[1], 1.0, rtol=ROUNDOFF)
        assert_allclose(found[2], -found[1], rtol=1e-3)
    assert measured_order(errors) > 9.0 - ORDER


@given(seed=st.integers(0, 2**32 - 1))
def test_polynomial_solutions_are_exact(seed: int) -> None:
    """A nilpotent chain under a constant force moves on a polynomial of degree four: one step suffices."""
    generator = np.random.default_rng(seed)
    A = np.diag([1.0, 1.0, 1.0], 1)
    x0, b = generator.standard_normal((2, 4, 1))
    h = float(generator.uniform(0.5, 3.0))
    desired = scipy.linalg.expm(h * np.block([[A, b], [np.zeros((1, 5))]]))[:4] @ np.vstack([x0, [[1.0]]])
    found, slope = integrated(np.eye(4), A, b, x0, (h, 1))
    assert_allclose(found, desired, rtol=0.0, atol=ROUNDOFF * max(1.0, np.abs(desired).max()))
    assert_allclose(slope, A @ desired + b, rtol=0.0, atol=ROUNDOFF * max(1.0, np.abs(desired).max()))


def test_initial_value_of_an_algebraic_unknown_does_not_matter() -> None:
    """The end of a step is a stage, so ``0 = 2 z - 1`` holds there from any start."""
    found, _ = integrated(np.zeros((1, 1)), np.array([[2.0]]), np.array([[-1.0]]), np.array([[17.0]]), (0.1, 1))
    assert_allclose(found, [[0.5]], rtol=ROUNDOFF)


def test_step_response_of_an_oscillator_is_the_closed_form() -> None:
    """``(1 - cos w t) / k`` for mass and spring, its velocity and acceleration too."""
    model = mechss([[2]], None, [[8]], F=[[1], [0], [0]], G=[[0], [1], [0]], H=[[0], [0], [1]])
    plan = step_plan(np.array([2j, -2j]))
    response = descriptor_step_response(model, plan)[:, 0]
    time = np.concatenate([segment.h * np.arange(1, segment.steps + 1) for segment in plan])
    desired = np.array([(1 - np.cos(2 * time)) / 8, np.sin(2 * time) / 4, np.cos(2 * time) / 2])
    assert_allclose(response, desired, rtol=0.0, atol=RESPONSE)


def test_step_response_of_half_and_static_dofs_is_the_closed_form() -> None:
    """A damper 5 against a spring 10 creeps as ``(1 - exp(-2 t)) / 10``; a spring alone jumps to F/k."""
    model = mechss(None, np.diag([5, 0]), np.diag([10, 4]))
    response = descriptor_step_response(model, (Segment(0.125, 16), Segment(0.25, 4)))
    time = np.concatenate([0.125 * np.arange(1, 17), 2.0 + 0.25 * np.arange(1, 5)])
    assert_allclose(response[0, 0], (1 - np.exp(-2 * time)) / 10, rtol=0.0, atol=RESPONSE)
    assert_allclose(response[1, 1], np.full(20, 0.25), rtol=ROUNDOFF)
    assert_allclose(response[0, 1], 0.0, rtol=0.0, atol=ROUNDOFF)


def test_step_response_with_a_constraint_holds_it() -> None:
    """Index three: two masses tied by a multiplier move as one of 3 kg."""
    M, K = np.diag([1.0, 2.0, 0.0]), np.array([[3.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, -1.0, 0.0]])
    model = mechss(M, None, K, [1, 0, 0])
    h = 0.0625
    response = descriptor_step_response(model, (Segment(h, 40),))[:, 0]
    time = h * np.arange(1, 41)
    desired = (1 - np.cos(time)) / 3
    assert_allclose(response[0], response[1], rtol=0.0, atol=ROUNDOFF)
    assert_allclose(response[0], desired, rtol=0.0, atol=1e-9)


def test_plan_resolves_every_mode_while_it_moves() -> None:
    """Poles 1e5 apart: short steps first, long ones after, up to a period of the slow mode."""
    plan = step_plan(np.array([-1e5, -1.0 + 2j, -1.0 - 2j]))
    assert plan[0].h * 1e5 <= 0.25
    assert plan[-1].h > 0.05
    horizon = sum(segment.h * segment.steps for segment in plan)
    assert horizon >= 2 * np.pi / np.sqrt(5)
    assert sum(segment.steps for segment in plan) <= 1500


def test_plan_ends_early_where_a_fast_mode_never_dies() -> None:
    """Undamped modes 1e6 apart cannot both be followed: the number of steps is kept."""
    plan = step_plan(np.array([1e6j, -1e6j, 1j, -1j]), most_steps=300)
    assert sum(segment.steps for segment in plan) == 300


@pytest.mark.parametrize("eigenvalues", [[], [0.0], [0.0, 0.0]])
def test_plan_without_moving_modes_takes_a_second(eigenvalues: list[float]) -> None:
    """No mode, or rigid bodies alone: twenty steps of 0.05 s."""
    assert step_plan(np.array(eigenvalues, dtype=complex)) == (Segment(0.05, 20),)


@pytest.mark.parametrize("power", [-12, 0, 12])
def test_units_of_force_do_not_disturb_the_integration(power: int) -> None:
    """M, C, K in units of 10^k: the mount's response, divided."""
    mount = hydromount()
    factor = 10.0**power
    scaled = mechss(mount.M * factor, mount.C * factor, mount.K * factor)
    plan = step_plan(np.array([-0.69 + 17.7j, -0.69 - 17.7j, -8.78, -3.17]))
    desired = descriptor_step_response(mount, plan)
    assert_allclose(
        descriptor_step_response(scaled, plan) * factor, desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max()
    )
