"""The Riccati equation: problems whose solution is known beforehand, in any units, and what counts as hidden."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel, StateFeedback, hydromount, lqr, mechss
from halfdof_ctrl.base.errors import StabilizationError
from halfdof_ctrl.design.care_problem import CareProblem
from halfdof_ctrl.design.riccati import solved_care
from halfdof_ctrl.design.starts import Solver

EXACT = 1e-13  # Newton's method on an extended residual leaves a few roundings
BETWEEN = 1e-9  # of the stored numbers, whatever the units are
SOLVERS: tuple[Solver, ...] = ("scipy", "slycot")


def problem_with_solution(seed: int) -> tuple[CareProblem, np.ndarray]:
    """Give integers A, B, N and X > 0 with A - B K stable, and the Q whose stabilizing solution is X exactly."""
    generator = np.random.default_rng(seed)
    root = np.triu(generator.integers(-3, 4, (4, 4)), 1) + np.diag(generator.integers(1, 4, 4))
    X = (root.T @ root).astype(float)
    B = generator.integers(-3, 4, (4, 2)).astype(float)
    N = generator.integers(-2, 3, (4, 2)).astype(float)
    K = B.T @ X + N.T
    stable = generator.integers(-3, 4, (4, 4)).astype(float)
    stable = stable - (np.ceil(np.abs(stable).sum(axis=1).max()) + 1.0) * np.eye(4)
    A = stable + B @ K
    Q = K.T @ K - A.T @ X - X @ A
    return CareProblem(A, B, Q, np.eye(2), N), K


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("seed", range(6))
def test_gain_of_an_integer_solution_is_found(seed: int, method: Solver) -> None:
    """With Q = K'K - A'X - XA for integers A, B, N, X the gain is B'X + N', whichever solver gives the start."""
    problem, K = problem_with_solution(seed)
    found = solved_care(problem, method)
    assert found is not None
    assert_allclose(found.K, K, rtol=EXACT, atol=EXACT * np.abs(K).max())
    assert found.error < BETWEEN


@given(
    st.lists(st.integers(-40, 40), min_size=4, max_size=4),
    st.integers(-40, 40),
    st.integers(-40, 40),
    st.integers(-30, 30),
)
def test_units_of_states_inputs_cost_and_time_change_nothing(
    states: list[int], force: int, cost: int, time: int
) -> None:
    """Powers of two in the units of states, inputs, cost and time give the gain in these units, bit for bit nearly."""
    problem, K = problem_with_solution(3)
    d, f, c, t = np.exp2(states), 2.0**force, 2.0**cost, 2.0**time
    scaled = CareProblem(
        t * problem.A * d / d[:, None],
        t * problem.B / d[:, None] * f,
        c * t * problem.Q * d * d[:, None],
        c * t * problem.R * f * f,
        c * t * problem.N * d[:, None] * f,
    )
    found = solved_care(scaled, "scipy")
    assert found is not None
    assert_allclose(found.K * f / d, K, rtol=BETWEEN, atol=BETWEEN * np.abs(K).max())


@pytest.mark.parametrize("effort", [1e-22, 1e-16, 1e-8, 1.0])
@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_double_integrator_keeps_its_gain_at_any_price(effort: float, unit: float) -> None:
    """For a mass m the gains are sqrt(q/r) and sqrt(2 m sqrt(q/r)), with forces in any unit."""
    mass = 3.0 / unit
    feedback = lqr(mechss([[mass]], [[0]], [[0]], dofs="y"), displacement={"y": 7.0}, effort={"F_y": effort * unit**2})
    stiffness = np.sqrt(7.0 / effort) / unit
    assert_allclose(feedback.K, [[stiffness, np.sqrt(2.0 * mass * stiffness)]], rtol=EXACT)
    assert feedback.gain_error < BETWEEN


def test_drag_behind_a_massless_spring_node_is_regulated() -> None:
    """A force on the node reaches 5 kg with drag 2.7 N s/m through 3.7 N/m: K = (sqrt(w/r), sqrt(d^2 + 2 m k) - d)."""
    k, d, m = 3.7, 2.7, 5.0
    model = mechss(np.diag([0.0, m]), np.diag([0.0, d]), [[k, -k], [-k, k]], dofs=["node", "mass"])
    feedback = lqr(model.select("F_node", "mass"), displacement={"mass": 4.0}, effort={"F_node": 1.0})
    assert feedback.states == ("mass", "mass_dot")
    assert_allclose(feedback.K, [[2.0, np.sqrt(d**2 + 2.0 * m * 2.0) - d]], rtol=1e-12)


@pytest.mark.parametrize("damper", [1e-12, 1e-6, 1e-3])
def test_weak_damper_at_a_massless_node_takes_no_digits(damper: float) -> None:
    """The regulator of the mount hardly knows of a pole 1e5 to 1e13 times faster than its modes."""
    gains = [
        lqr(hydromount(C_rs=c).select("F_y", "y"), displacement={"y": 1e6}, effort={"F_y": 1e-4})
        for c in (damper, damper / 2.0)
    ]
    states = [gains[0].states.index(name) for name in ("y", "y2", "y_dot")]
    assert_allclose(gains[0].K[:, states], gains[1].K[:, states], rtol=10.0 * damper + BETWEEN)


def test_gain_of_a_mode_that_is_hardly_reached_has_all_digits_until_it_is_not_told_from_hidden() -> None:
    """Oscillators equal up to d have the gain of both as one, and rounding leaves it alone."""
    both = _nearly_unreached(1e-12)
    one = lqr(mechss([[2.0]], None, [[2.0]], [[2.0]], inputs="F"), displacement={"q0": 2.0}, effort={"F": 1.0})
    assert_allclose(both.K[0, :2].sum(), one.K[0, 0], rtol=BETWEEN)
    assert_allclose(both.K[0, 2:].sum(), one.K[0, 1], rtol=BETWEEN)
    assert both.gain_error < BETWEEN
    with pytest.raises(StabilizationError, match="not told from nothing"):
        _nearly_unreached(4e-14)


def _nearly_unreached(difference: float) -> StateFeedback:
    """Design for two oscillators that are equal up to a small part, driven and weighted alike."""
    model = mechss(np.eye(2), None, np.diag([1.0, 1.0 + difference])).select("F_q0", "q0")
    both = mechss(model.M, None, model.K, [[1.0], [1.0]], inputs="F")
    return lqr(both, displacement={"q0": 1.0, "q1": 1.0}, effort={"F": 1.0})


def test_exactly_hidden_modes_stay_refused() -> None:
    """Two equal oscillators under one force swing against each other, whatever the feedback does."""
    with pytest.raises(StabilizationError, match=r"the inputs reach it by .* not told from nothing"):
        _nearly_unreached(0.0)


def cantilever(elements: int) -> SecondOrderModel:
    """Give a cantilever of unit length, mass and bending stiffness by Hermitian elements, driven at its tip."""
    h = 1.0 / elements
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / h**3
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) * h / 420
    turn = np.array([1.0, h, 1.0, h])
    M, K = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for first in range(0, 2 * elements, 2):
        span = slice(first, first + 4)
        K[span, span] += k * turn * turn[:, None]
        M[span, span] += m * turn * turn[:, None]
    M, K = M[2:, 2:], K[2:, 2:]
    return mechss(M, 0.2 * M, K).select(f"F_q{2 * elements - 2}", f"q{2 * elements - 2}")


def test_gain_of_a_beam_does_not_depend_on_the_states_it_was_found_in() -> None:
    """At 20 elements, where states of DOFs lose it, the slowest pole is that of 10, discretization apart."""
    slowest = []
    for elements in (10, 20):
        model = cantilever(elements)
        feedback = lqr(model, displacement={model.outputs[0]: 1.0}, effort={model.inputs[0]: 1.0})
        slowest.append(feedback.poles[np.abs(feedback.poles).argmin()])
        assert feedback.gain_error < BETWEEN
    assert_allclose(slowest[0].real, slowest[1].real, rtol=1e-5)
    assert_allclose(slowest[0].imag, slowest[1].imag, rtol=1e-5)


@pytest.mark.parametrize("damper", [1e-13, 1e-6, 1.0])
def test_undamped_modes_beside_a_weak_damper_are_reached(damper: float) -> None:
    """A damper at a massless node apart has a pole 1e16 times faster than the mode; the gain is that without it."""
    model = mechss(np.diag([2.0, 0.0]), np.diag([0.0, damper]), np.diag([8.0, 3e3]), dofs=["mass", "node"])
    feedback = lqr(model.select("F_mass", "mass"), displacement={"mass": 1.0}, effort={"F_mass": 1.0})
    alone = lqr(mechss([[2.0]], None, [[8.0]], dofs="mass"), displacement={"mass": 1.0}, effort={"F_mass": 1.0})
    columns = [feedback.states.index(name) for name in alone.states]
    assert_allclose(feedback.K[:, columns], alone.K, rtol=EXACT)


def test_mode_hidden_in_coordinates_of_its_own_stays_refused() -> None:
    """Of oscillators mixed by T one is not driven; the entries of T^T M T and T^T K T round, and hide it."""
    T = np.array([[3.0, 1.1, -2.3], [0.7, 4.1, 1.9], [-1.3, 0.9, 3.7]])
    M, C, K = np.diag([1.3, 2.7, 0.3]), np.diag([0.4, 0.0, 0.2]), np.diag([0.7, 31.1, 57.3])
    B = T.T @ np.array([[1.0], [0.0], [0.3]])
    model = mechss(T.T @ M @ T, T.T @ C @ T, T.T @ K @ T, B, inputs="u")
    with pytest.raises(StabilizationError, match="not told from nothing"):
        lqr(model, displacement=dict.fromkeys(model.dofs, 1.0), effort={"u": 1e-3})
