"""Regulators: closed forms, the closed loop as a second-order model, and refusals by name."""

from typing import Literal

import control
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import sparse

from halfdof_ctrl import (
    SecondOrderModel,
    StateFeedback,
    crosscheck,
    exact_reduction,
    hydromount,
    lqr,
    mech2ss,
    mechss,
    pencil_structure,
)
from halfdof_ctrl.base.errors import ModelSizeError, SignalNameError, StabilizationError, WeightError
from halfdof_ctrl.design import lqr as regulator
from halfdof_ctrl.design import optimal_gain

RICCATI = 1e-9  # two Riccati solvers agree to the square root of their condition, here far better
SOLVERS: tuple[Literal["scipy", "slycot"], ...] = ("scipy", "slycot")
POLES = 1e-9  # eigenvalues of two different matrices of moderate condition


def mount() -> SecondOrderModel:
    """Give the mount with an actuator on its mass and its displacement as output."""
    return hydromount().select("F_y", "y")


def two_masses(inputs: str | list[str]) -> SecondOrderModel:
    """Give two free masses joined by a spring, with a static node on a spring of its own."""
    model = mechss(
        np.diag([1.0, 1.0, 0.0]), None, [[1, -1, 0], [-1, 1, 0], [0, 0, 1]], dofs=["a", "b", "s"], name="two masses"
    )
    return model.select(inputs)


def sorted_poles(values: np.ndarray) -> np.ndarray:
    """Sort poles so that two lists of them can be compared."""
    return values[np.lexsort((values.imag.round(6), values.real.round(6)))]


def string(n: int, k: float, step: int) -> sparse.csc_array:
    """Give the stiffness of n nodes, each joined to those `step` before and after it, the outer ones to the ground."""
    unit = sparse.eye_array(n)
    beside = sparse.eye_array(n, k=step)
    return sparse.csc_array(k * (2.0 * unit - beside - beside.T))


def test_double_integrator_has_the_textbook_gain() -> None:
    """For 1/s^2 with weights q and r the gains are sqrt(q/r) and sqrt(2 sqrt(q/r))."""
    model = mechss([[1]], [[0]], [[0]], dofs="y")
    feedback = lqr(model, displacement={"y": 16.0}, effort={"F_y": 1.0})
    assert_allclose(feedback.K, [[4.0, np.sqrt(8.0)]], rtol=RICCATI)
    assert feedback.inputs == ("F_y",)
    assert feedback.states == ("y", "y_dot")


def test_physical_weights_equal_the_matrices_that_they_stand_for() -> None:
    """Weights on y, y_dot and the force are diagonal entries of Q and R on the mount's states."""
    physical = lqr(mount(), displacement={"y": 1e6, "y2": 1e3}, velocity={"y": 10.0}, effort={"F_y": 1e-4})
    matrices = lqr(mount(), np.diag([1e6, 0.0, 1e3, 10.0]), [[1e-4]])
    assert_allclose(physical.K, matrices.K, rtol=RICCATI)
    expected, _, _ = control.lqr(mech2ss(mount()), np.diag([1e6, 0.0, 1e3, 10.0]), [[1e-4]])
    assert_allclose(matrices.K, expected, rtol=RICCATI)


def test_velocity_of_a_half_dof_brings_its_cross_term() -> None:
    """The weight on y1_dot = (F_y1 + ...)/C_rs adds C'C, C'D and D'D where a force acts on y1."""
    model = hydromount().select(["F_y", "F_y1"], "y")
    feedback = lqr(model, velocity={"y1": 3.0}, displacement={"y": 1e4}, effort={"F_y": 1e-3, "F_y1": 1e-3})
    row, direct = np.array([[0.0, -10.0, 0.0, 1.0]]), np.array([[0.0, 0.01]])
    assert_allclose(feedback.cost.N, 3.0 * row.T @ direct, rtol=1e-13)
    assert_allclose(feedback.cost.R, np.diag([1e-3, 1e-3]) + 3.0 * direct.T @ direct, rtol=1e-13)
    assert_allclose(feedback.cost.Q, 3.0 * row.T @ row + np.diag([1e4, 0.0, 0.0, 0.0]), rtol=1e-13)


def test_static_dof_is_weighted_through_its_direct_term() -> None:
    """A static node on 4 N/m moves by F/4, so its weight w adds w/16 to R."""
    model = mechss([[1, 0], [0, 0]], [[1, 0], [0, 0]], [[1, 0], [0, 4]], dofs=["y", "s"])
    feedback = lqr(model, displacement={"y": 1.0, "s": 32.0}, effort={"F_y": 1.0, "F_s": 1.0})
    assert_allclose(feedback.cost.R, np.diag([1.0, 3.0]), rtol=1e-14)


def test_energy_weight_is_half_of_mass_and_stiffness() -> None:
    """The energy of a mass on a spring weighs its displacement by K/2 and its velocity by M/2."""
    feedback = lqr(mechss([[2]], [[1]], [[8]], dofs="y"), energy=3.0, effort={"F_y": 1.0})
    assert_allclose(feedback.cost.Q, np.diag([12.0, 3.0]), rtol=1e-14)


def test_energy_of_the_mount_is_what_its_springs_and_mass_hold() -> None:
    """The energy of the reduced state equals that of the recovered motion of all DOFs."""
    feedback = lqr(mount(), energy=2.0, effort={"F_y": 1.0})
    x = np.array([0.3, -0.2, 0.5, 1.5])
    q, v = feedback.reduction.motion(0).X @ x, feedback.reduction.motion(1).X @ x
    energy = 0.5 * v @ mount().M @ v + 0.5 * q @ mount().K @ q
    assert_allclose(x @ feedback.cost.Q @ x, 2.0 * energy, rtol=1e-13)


@given(
    st.floats(1.0, 1e8),
    st.floats(1e-6, 1e2),
    st.lists(st.floats(0.5, 2.0), min_size=7, max_size=7),
)
def test_closed_loop_as_second_order_model_has_the_closed_loop_poles(
    weight: float, effort: float, factors: list[float]
) -> None:
    """QZ on M, C', K' of equation (13) finds the eigenvalues of A - B K."""
    values = [20.0, 5000.0, 1000.0, 500.0, 500.0, 100.0, 300.0]
    names = ["m", "K_r", "K_rs", "K_v", "K_s", "C_rs", "C_h"]
    parameters = {name: value * factor for name, value, factor in zip(names, values, factors, strict=True)}
    model = hydromount(**parameters).select(["F_y", "F_y2"], ["y", "y1", "y_dot"])
    feedback = lqr(model, displacement={"y": weight, "y1": 1.0}, effort={"F_y": effort, "F_y2": effort})
    finite = pencil_structure(feedback.as_mechss()).finite_eigenvalues
    assert_allclose(sorted_poles(finite), sorted_poles(feedback.poles), rtol=1e-7)
    assert (feedback.poles.real < 0.0).all()


def test_closed_loop_passes_the_cross_check_of_its_second_order_model() -> None:
    """The closed-loop StateSpace is the state space of M, C', K' with outputs that have a direct term."""
    model = hydromount().select("F_y", ["y", "y_ddot", "y1"])
    feedback = lqr(model, displacement={"y": 1e6}, effort={"F_y": 1e-2})
    assert crosscheck(feedback.as_mechss().select(outputs=["y", "y1"]), feedback.closed_loop[[0, 2], :]).passed
    plant = mech2ss(model)
    assert_allclose(feedback.closed_loop.C, plant.C - plant.D @ feedback.K, rtol=1e-14)
    assert feedback.closed_loop.state_labels == plant.state_labels
    assert feedback.closed_loop.name == "hydromount_lqr"


def test_mixed_coordinates_of_a_rank_deficient_mass_feed_back_as_well() -> None:
    """With M = [[1, 1], [1, 1]] the state is a combination of DOFs, and (13) still holds."""
    model = mechss([[1, 1], [1, 1]], [[1, 0], [0, 0]], [[2, 0], [0, 3]], dofs=["a", "b"])
    feedback = lqr(model, displacement={"a": 10.0, "b": 1.0}, effort={"F_a": 1.0, "F_b": 1.0})
    finite = pencil_structure(feedback.as_mechss()).finite_eigenvalues
    assert_allclose(sorted_poles(finite), sorted_poles(feedback.poles), rtol=POLES)


def test_solvers_agree() -> None:
    """The gain by slycot, where there is one, and by scipy are the same."""
    pytest.importorskip("slycot", exc_type=ImportError)
    scipy_gain, slycot_gain = (
        lqr(mount(), displacement={"y": 1e6}, effort={"F_y": 1e-4}, method=method).K for method in SOLVERS
    )
    assert_allclose(slycot_gain, scipy_gain, rtol=RICCATI)


def test_repr_shows_gain_labels_and_poles() -> None:
    """The printed feedback names inputs, states and poles."""
    text = repr(lqr(mount(), displacement={"y": 1e6}, effort={"F_y": 1e-4}))
    for word in ("F_y", "y1", "y_dot", "closed-loop poles"):
        assert word in text


@pytest.mark.parametrize("method", SOLVERS)
def test_rigid_motion_without_weight_is_refused(method: Literal["scipy", "slycot"]) -> None:
    """Weights on a velocity alone leave the rigid displacement at an eigenvalue zero, whatever the solver says."""
    with pytest.raises(
        StabilizationError, match=r"the cost sees it by .* not told from nothing.*displacement of DOF [ab]"
    ) as caught:
        lqr(two_masses("F_a"), velocity={"a": 1.0}, effort={"F_a": 1.0}, method=method)
    assert caught.value.eigenvalue == 0.0
    assert caught.value.quantity in {"a", "b"}


def test_unreached_mode_is_refused_with_the_force_that_reaches_it() -> None:
    """A force on a static node apart moves none of the masses; a force on one of them would."""
    with pytest.raises(
        StabilizationError, match=r"the inputs reach it by .* not told from nothing.*input F_[ab]"
    ) as caught:
        lqr(two_masses("F_s"), displacement={"b": 1.0}, effort={"F_s": 1.0})
    assert caught.value.quantity in {"F_a", "F_b"}


def test_solver_that_fails_or_does_not_stabilize_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a start, or with a zero gain on an undamped system, K is (sqrt(2) - 1, sqrt(2 (sqrt(2) - 1))) as ever."""
    model = mechss([[1]], [[0]], [[1]], dofs="y")
    expected = [[np.sqrt(2.0) - 1.0, np.sqrt(2.0 * (np.sqrt(2.0) - 1.0))]]
    monkeypatch.setattr(control, "lqr", lambda A, B, *_, **__: (np.zeros(B.T.shape), np.zeros(A.shape), None))
    assert_allclose(lqr(model, displacement={"y": 1.0}, effort={"F_y": 1.0}).K, expected, rtol=RICCATI)

    def failing(*_: object, **__: object) -> None:
        raise scipy.linalg.LinAlgError

    monkeypatch.setattr(control, "lqr", failing)
    assert_allclose(lqr(model, displacement={"y": 1.0}, effort={"F_y": 1.0}).K, expected, rtol=RICCATI)


def test_equation_that_is_not_solved_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no gain is found, although one may exist, the pole that stays is named."""
    monkeypatch.setattr(optimal_gain, "solved_care", lambda *_, **__: None)
    with pytest.raises(StabilizationError, match="although nothing hides a mode from inputs and cost: a pole stays at"):
        lqr(mechss([[1]], [[0]], [[1]], dofs="y"), displacement={"y": 1.0}, effort={"F_y": 1.0})


def test_gain_that_rounding_does_not_tell_from_none_is_refused_as_uncertain() -> None:
    """An undamped mass of 1 kg at 1 N/m, cost of force r: its poles are to lie 1 / (2 sqrt(r)) left of the axis."""
    model = mechss([[1]], None, [[1]], dofs="y")
    feedback = lqr(model, displacement={"y": 1.0}, effort={"F_y": 1e24})
    assert_allclose(feedback.poles.real, -5e-13, rtol=1e-3)
    with pytest.raises(
        StabilizationError, match=r"uncertain whether a stabilizing gain exists.*may move it by .* rad/s"
    ):
        lqr(model, displacement={"y": 1.0}, effort={"F_y": 1e32})


def test_free_body_in_odd_stiffness_is_refused_whatever_its_rows_sum_to() -> None:
    """Springs of 27 kN/m and 6 mN/m in a row, whose entries are rounded: velocities alone do not see where they are."""
    a, b = 26971.1, 0.00553
    model = mechss(
        np.diag([0.1, 54.0, 0.95]), None, [[a, -a, 0.0], [-a, a + b + 3e-12, -b], [0.0, -b, b]], dofs=["a", "b", "c"]
    )
    with pytest.raises(StabilizationError, match=r"the cost sees it by .* not told from nothing"):
        lqr(model.select("F_a"), velocity={"a": 1.0, "b": 1.0, "c": 1.0}, effort={"F_a": 1.0})


def test_large_sparse_model_with_few_states_is_regulated() -> None:
    """A mass in the middle of a string of 2500 nodes is one on the springs in series on either side."""
    n, k = 2501, 1e4
    K = string(n, k, 1)
    mass, drag = np.zeros(n), np.zeros(n)
    mass[1250], drag[1250] = 2.0, 0.5
    model = mechss(sparse.diags_array(mass).tocsc(), sparse.diags_array(drag).tocsc(), K).select("F_q1250", "q1250")
    stiffness = 2.0 * k / 1251.0
    one = mechss([[2.0]], [[0.5]], [[stiffness]], dofs="q1250")
    feedback, expected = (
        lqr(each, displacement={"q1250": 3.0}, energy=2.0, effort={"F_q1250": 1e-2}) for each in (model, one)
    )
    assert_allclose(feedback.K, expected.K, rtol=RICCATI)
    closed = exact_reduction(feedback.as_mechss())
    assert_allclose(sorted_poles(np.linalg.eigvals(closed.A)), sorted_poles(feedback.poles), rtol=POLES)


def test_model_with_too_many_states_is_refused_with_the_way_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four states are too many where three are the limit."""
    monkeypatch.setattr(regulator, "MOST_STATES", 3)
    with pytest.raises(ModelSizeError, match=r"up to 3 states; this one has 4.*truncate_modes") as caught:
        lqr(mount(), displacement={"y": 1.0}, effort={"F_y": 1.0})
    assert (caught.value.size, caught.value.limit) == (4, 3)


def test_mode_of_a_large_sparse_model_that_no_input_reaches_is_refused_by_the_force_that_does() -> None:
    """A second mass apart from the string is moved by no force on it."""
    n = 2501
    K = string(n, 1.0, 2)
    mass = np.zeros(n)
    mass[[100, 101]] = 1.0
    model = mechss(sparse.diags_array(mass).tocsc(), None, K).select("F_q4", "q100")
    with pytest.raises(StabilizationError, match="input F_q101"):
        lqr(model, displacement={"q100": 1.0, "q101": 1.0}, effort={"F_q4": 1.0})


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf"), True, "1", 1j])
def test_weights_must_be_finite_and_not_negative(weight: float) -> None:
    """Anything but a finite number from zero on is refused by name."""
    with pytest.raises(WeightError, match=r"weight of y is .* must be a finite number"):
        lqr(mount(), displacement={"y": weight}, effort={"F_y": 1.0})


def test_input_without_effort_is_refused() -> None:
    """A free input would get an infinite gain."""
    with pytest.raises(WeightError, match="inputs F_y cost nothing"):
        lqr(mount(), displacement={"y": 1.0})
    with pytest.raises(WeightError, match="some combination of them costs nothing"):
        lqr(two_masses(["F_a", "F_b"]), np.eye(4), [[1.0, 1.0], [1.0, 1.0]])


def test_unknown_names_are_refused() -> None:
    """Weights go to DOFs and inputs that are there."""
    with pytest.raises(SignalNameError, match="no DOF 'z'"):
        lqr(mount(), displacement={"z": 1.0}, effort={"F_y": 1.0})
    with pytest.raises(SignalNameError, match="no input 'F_z'"):
        lqr(mount(), displacement={"y": 1.0}, effort={"F_z": 1.0})


def test_cost_without_motion_is_refused() -> None:
    """Effort alone is no regulator problem."""
    with pytest.raises(WeightError, match="The cost sees no motion"):
        lqr(mount(), effort={"F_y": 1.0})


def test_model_without_states_is_refused() -> None:
    """Springs alone leave nothing to regulate."""
    with pytest.raises(WeightError, match="has no states"):
        lqr(mechss(None, None, [[1]], dofs="y"), displacement={"y": 1.0}, effort={"F_y": 1.0})


def test_weight_on_a_derivative_of_an_input_is_refused() -> None:
    """The velocity of a static DOF under a force of its own has no finite square."""
    with pytest.raises(WeightError, match="s_dot follows the derivative of an input"):
        lqr(two_masses(["F_a", "F_s"]), velocity={"s": 1.0}, effort={"F_a": 1.0, "F_s": 1.0})


def test_energy_of_an_unsymmetric_model_is_refused() -> None:
    """Circulatory or negative springs store no energy of the usual form."""
    model = mechss(np.eye(2), np.eye(2), [[2, 1], [-1, 2]])
    with pytest.raises(WeightError, match="K is not symmetric positive semidefinite"):
        lqr(model, energy=1.0, effort={"F_q0": 1.0, "F_q1": 1.0})


def test_energy_and_second_order_form_are_refused_with_input_derivatives() -> None:
    """Where derivatives of the inputs act, the state is no function of q and q' alone."""
    model = mechss([[1]], [[1]], [[1]], [[1]], Bv=[[1]], dofs="y", inputs="motion")
    with pytest.raises(WeightError, match="derivatives of inputs act"):
        lqr(model, energy=1.0, effort={"motion": 1.0})
    feedback = lqr(model, displacement={"y": 1.0}, effort={"motion": 1.0})
    with pytest.raises(WeightError, match="whose derivatives act on it"):
        feedback.as_mechss()


def test_matrices_are_checked() -> None:
    """Q and R come together, real, symmetric, convex and not beside physical weights."""
    unit = np.eye(4)
    with pytest.raises(WeightError, match="Q and R are both needed"):
        lqr(mount(), unit)
    with pytest.raises(WeightError, match="Q must be real and symmetric"):
        lqr(mount(), np.triu(np.ones((4, 4))), [[1]])
    with pytest.raises(WeightError, match="N must be real"):
        lqr(mount(), unit, [[1]], 1j * np.ones((4, 1)))
    with pytest.raises(WeightError, match="not positive semidefinite: it can be made"):
        lqr(mount(), -unit, [[1]])
    with pytest.raises(WeightError, match="not both"):
        lqr(mount(), unit, [[1]], effort={"F_y": 1.0})


def test_cost_from_a_state_is_the_integral_of_the_cost() -> None:
    """The cost from x, x' S x, equals that of the simulated closed loop, by Lyapunov's equation."""
    feedback: StateFeedback = lqr(mount(), displacement={"y": 1e5}, effort={"F_y": 1e-3})
    A = np.asarray(feedback.closed_loop.A)
    rate = feedback.cost.Q + feedback.K.T @ feedback.cost.R @ feedback.K
    assert_allclose(scipy.linalg.solve_continuous_lyapunov(A.T, -rate), feedback.S, rtol=RICCATI)
