"""Gains of few states against the same stored equations in ball arithmetic."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel, hydromount, lqr, mechss
from halfdof_ctrl.base.errors import InaccurateGainWarning, LostDigitsWarning, StabilizationError
from halfdof_ctrl.design.care_problem import CareProblem
from halfdof_ctrl.design.few_states import solved_with_digits
from halfdof_ctrl.design.starts import Solver
from halfdof_ctrl.reduction.energy.form import energy_form
from support.beams import beam_matrices
from support.riccati_truth import gain_by_sign, gain_of_structure

DIGITS = 1e-14  # the gain has every digit but the last of its doubles
SOLVERS: tuple[Solver, ...] = ("scipy", "slycot")
NAMES = ("m", "K_r", "K_rs", "K_v", "K_s", "C_rs", "C_h")
VALUES = (20.0, 5000.0, 1000.0, 500.0, 500.0, 100.0, 300.0)


def weak_mount(seed: int) -> tuple[SecondOrderModel, float, float]:
    """Give a mount with a damper of 1e-9 to 1 N s/m at the massless node that a cheap actuator drives."""
    generator = np.random.default_rng(seed)
    parameters = {name: value * 10 ** generator.uniform(-1, 1) for name, value in zip(NAMES, VALUES, strict=True)}
    parameters["C_rs"] = 10 ** generator.uniform(-9, 0)
    weight, effort = 10 ** generator.uniform(-3, 8), 10 ** generator.uniform(-22, 0)
    return hydromount(**parameters).select("F_y1", "y"), weight, effort


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("seed", range(12))
def test_cheap_actuator_at_a_weak_damper_has_the_gain_of_its_stored_equation(seed: int, method: Solver) -> None:
    """Poles over 15 and costs over 30 decades: A, B, Q, R as stored, solved with 300 digits, give the same gain."""
    model, weight, effort = weak_mount(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InaccurateGainWarning)
        warnings.simplefilter("ignore", LostDigitsWarning)  # stored numbers lose c w / K, which is not asked here
        feedback = lqr(model, displacement={"y": weight}, effort={"F_y1": effort}, method=method)
    cost, reduction = feedback.cost, feedback.reduction
    expected = gain_by_sign(reduction.A, reduction.B, cost.Q, cost.R, cost.N)
    assert_allclose(feedback.K, expected, rtol=DIGITS, atol=DIGITS * np.abs(expected).max())


def stepped_cantilever(lengths: tuple[float, ...]) -> SecondOrderModel:
    """Give a clamped beam of elements of these lengths with C = 0.2 M, driven at its tip."""
    n = 2 * len(lengths)
    M, K = np.zeros((2, n + 2, n + 2))
    for e, h in enumerate(lengths):
        mass, stiffness = beam_matrices(1, clamped=False)
        size, part = np.array([1.0, h, 1.0, h]), slice(2 * e, 2 * e + 4)
        M[part, part] += h * size[:, None] * mass * size
        K[part, part] += size[:, None] * stiffness * size / h**3
    return mechss(M[2:, 2:], 0.2 * M[2:, 2:], K[2:, 2:]).select(f"F_q{n - 2}", f"q{n - 2}")


@pytest.mark.parametrize("lengths", [(1.0, 0.03, 1.0, 0.03), (1.0, 0.01, 1.0, 1.0)])
def test_short_elements_of_a_beam_take_no_digits(lengths: tuple[float, ...]) -> None:
    """A of displacements and velocities has lost what M, C, K in ball arithmetic know; states of the energy keep it."""
    model = stepped_cantilever(lengths)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LostDigitsWarning)  # of the closed loop in displacements and velocities
        feedback = lqr(model, displacement={model.outputs[0]: 1.0}, effort={model.inputs[0]: 1.0})
    matrices = (model.M, model.C, model.K, model.B)
    expected = gain_of_structure(matrices, feedback.cost.Q, feedback.cost.R, feedback.S, energy_form(model).T)
    assert_allclose(feedback.K, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    assert feedback.gain_error < 1e-12


def test_rounding_of_a_barely_reached_mount_is_announced_and_too_much_of_it_refused() -> None:
    """A force at a damper of c reaches the mass by c w / K: of 1e-9 rounding leaves five digits, of 1e-14 none."""
    with (
        pytest.warns(InaccurateGainWarning, match="The gain is known to"),
        pytest.warns(LostDigitsWarning, match="of y from F_y1"),
    ):
        feedback = lqr(hydromount(C_rs=1e-9).select("F_y1", "y"), displacement={"y": 1e6}, effort={"F_y1": 1e-4})
    assert 1e-7 < feedback.gain_error < 1e-3
    with (
        pytest.warns(LostDigitsWarning, match="of y from F_y1"),
        pytest.raises(StabilizationError, match="rounding of the entries of A, B, Q and R moves it by"),
    ):
        lqr(hydromount(C_rs=1e-14).select("F_y1", "y"), displacement={"y": 1e6}, effort={"F_y1": 1e-4})


@given(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.floats(-6.0, 6.0))
def test_drag_behind_a_massless_node_is_never_refused(k: float, d: float, m: float, w: float, r: float) -> None:
    """For a mass with drag the gains are sqrt(w/r) and w/r m / (d + sqrt(d^2 + 2 m sqrt(w/r))) / sqrt(w/r)."""
    spring, drag, mass, weight, effort = (10.0**power for power in (k, d, m, w, r))
    model = mechss(
        np.diag([0.0, mass]), np.diag([0.0, drag]), [[spring, -spring], [-spring, spring]], dofs=["node", "mass"]
    )
    feedback = lqr(model.select("F_node", "mass"), displacement={"mass": weight}, effort={"F_node": effort})
    stiffness = np.sqrt(weight / effort)
    expected = [[stiffness, 2.0 * mass * stiffness / (drag + np.sqrt(drag**2 + 2.0 * mass * stiffness))]]
    allowed = max(1e-12, feedback.gain_error)
    assert_allclose(feedback.K, expected, rtol=allowed, atol=allowed * np.abs(expected).max())


def test_stiffness_that_cancels_in_a_row_of_springs_is_no_doubt_of_the_gain() -> None:
    """A free mass behind a spring a million times too stiff for its gain is known to all digits."""
    model = mechss(np.diag([0.0, 3.0]), np.diag([0.0, 0.7]), [[7e9, -7e9], [-7e9, 7e9]], dofs=["node", "mass"])
    feedback = lqr(model.select("F_node", "mass"), displacement={"mass": 1e-6}, effort={"F_node": 1.0})
    assert feedback.gain_error < DIGITS


def test_equation_is_solved_without_any_start() -> None:
    """The sign of the Hamiltonian matrix needs none: the double integrator has the gains 1 and sqrt(2)."""
    problem = CareProblem(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.diag([1.0, 0.0]), np.eye(1), np.zeros((2, 1))
    )
    found = solved_with_digits(problem, ())
    assert found is not None
    assert_allclose(found.K, [[1.0, np.sqrt(2.0)]], rtol=DIGITS)
    assert_allclose(found.X, [[np.sqrt(2.0), 1.0], [1.0, np.sqrt(2.0)]], rtol=DIGITS)


def test_start_that_does_not_stabilize_is_passed_over() -> None:
    """X = 0 leaves an oscillator on the axis; what follows finds the gain."""
    problem = CareProblem(
        np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([[0.0], [1.0]]), np.diag([3.0, 0.0]), np.eye(1), np.zeros((2, 1))
    )
    found = solved_with_digits(problem, (np.zeros((2, 2)), np.full((2, 2), np.nan)))
    assert found is not None
    assert_allclose(found.K, [[1.0, np.sqrt(2.0)]], rtol=DIGITS)


def test_equation_without_a_stabilizing_solution_has_none() -> None:
    """An oscillator that no input reaches keeps its eigenvalues, and those of the Hamiltonian matrix, on the axis."""
    problem = CareProblem(np.array([[0.0, 1.0], [-1.0, 0.0]]), np.zeros((2, 1)), np.eye(2), np.eye(1), np.zeros((2, 1)))
    assert solved_with_digits(problem, ()) is None


def test_input_to_which_nothing_is_fed_back_does_not_hide_the_others() -> None:
    """Of two masses apart only the first is weighted and needs a gain; the second, damped, gets exactly none."""
    model = mechss(np.diag([1.0, 2.0]), np.diag([0.0, 1.0]), np.diag([0.0, 4.0]), dofs=["a", "b"])
    feedback = lqr(model.select(["F_a", "F_b"], "a"), displacement={"a": 1.0}, effort={"F_a": 1.0, "F_b": 1e-20})
    expected = np.zeros((2, 4))
    expected[0, [feedback.states.index("a"), feedback.states.index("a_dot")]] = 1.0, np.sqrt(2.0)
    assert_allclose(feedback.K, expected, rtol=DIGITS, atol=1e-30)
    assert feedback.gain_error < 1e-12
