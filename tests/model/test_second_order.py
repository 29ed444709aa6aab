"""The model: selection of signals, evaluation of equation (1), complex models, printing."""

import control
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csc_array

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import SignalNameError
from support import exact
from support.structures import Structure, structures

ROUNDOFF = 1e-12  # direct solves of small matrices with small integer entries
EXACT = 1e-10  # the same with n <= 12 and conditions up to 1e6
POINTS = np.array([0.3j, 1.1j, 4.7j, 0.6 + 0.2j])
SIZES = st.integers(1, 4)


# --- selection -------------------------------------------------------------------------------------------------


def test_any_force_and_motion_can_be_selected_by_name() -> None:
    """Displacement, velocity and acceleration of any DOF, in the order asked for."""
    model = hydromount().select(inputs=["F_y2", "F_y"], outputs=["y_ddot", "y1", "y2_dot"])
    assert_array_equal(model.B, np.eye(3)[:, [2, 0]])
    assert_array_equal(model.H[0], [1, 0, 0])
    assert_array_equal(model.F[1], [0, 1, 0])
    assert_array_equal(model.G[2], [0, 0, 1])
    assert (model.inputs, model.outputs) == (("F_y2", "F_y"), ("y_ddot", "y1", "y2_dot"))


def test_own_signals_are_selected_with_their_direct_terms() -> None:
    """An input's column and an output's row move in every matrix."""
    generator = np.random.default_rng(0)
    B, Bv, Ba = generator.standard_normal((3, 2, 2))
    F, G, H = generator.standard_normal((3, 3, 2))
    D, Dv, Da = generator.standard_normal((3, 3, 2))
    model = mechss(np.eye(2), np.eye(2), np.eye(2), B, F, G, H=H, D=D, Bv=Bv, Ba=Ba, Dv=Dv, Da=Da)
    picked = model.select(inputs="u[1]", outputs=["y[2]", "y[0]"])
    assert_allclose(picked(POINTS, squeeze=False), model(POINTS)[[2, 0]][:, [1]], rtol=ROUNDOFF)


def test_model_goes_through_selection_unchanged() -> None:
    """Without arguments nothing changes, and the original stays as it is."""
    model = hydromount()
    assert model.select() is model
    model.select(inputs="F_y")
    assert model.inputs == ("F_y", "F_y1", "F_y2")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"inputs": "F_z"}, r"The model has no input 'F_z'. Known: F_y, F_y1, F_y2"),
        ({"outputs": ["y", "z_dot"]}, r"The model has no output 'z_dot'. Known: y, y1, y2, y_dot"),
        ({"outputs": ["y", "y"]}, "Names of outputs must differ, but y stands more than once"),
        ({"inputs": []}, "No input is selected"),
        ({"outputs": ()}, "No output is selected"),
        ({"outputs": ""}, "No output is selected|must be non-empty"),
        ({"inputs": ["y"]}, "The model has no input 'y'"),
        ({"inputs": [0]}, "The model has no input '0'"),
        ({"inputs": [0.5]}, "Names must be non-empty text .*, not a float"),
    ],
)
def test_selection_of_unknown_names_is_refused(options: dict[str, object], words: str) -> None:
    """The message lists what there is."""
    with pytest.raises(SignalNameError, match=words):
        hydromount().select(**options)  # type: ignore[arg-type]


# --- evaluation ------------------------------------------------------------------------------------------------


@given(structure=structures())
def test_evaluation_equals_exact_rational_arithmetic(structure: Structure) -> None:
    """Equation (1) by a direct solve, each channel relative to its largest value; index above one included."""
    model = structure.model()
    if exact.order(*structure.matrices) < 0:
        return
    desired = exact.transfer(model, POINTS)
    size = np.abs(desired).max(axis=2, keepdims=True)
    size = np.where(size > 0.0, size, np.abs(desired).max())
    assert_allclose(model(POINTS, squeeze=False) / size, desired / size, rtol=0.0, atol=EXACT)


@given(seed=st.integers(0, 2**32 - 1), n=SIZES, m=SIZES, p=SIZES, damping=st.booleans())
def test_all_twelve_matrices_enter_the_transfer_function(seed: int, n: int, m: int, p: int, *, damping: bool) -> None:
    """Random integer matrices, structural damping too, against exact arithmetic."""
    generator = np.random.default_rng(seed)
    M, C, K = (generator.integers(-3, 4, (n, n)) + 9 * np.eye(n) for _ in range(3))
    B, Bv, Ba = (generator.integers(-3, 4, (n, m)) for _ in range(3))
    F, G, H = (generator.integers(-3, 4, (p, n)) for _ in range(3))
    D, Dv, Da = (generator.integers(-3, 4, (p, m)) for _ in range(3))
    stiffness = K * (1 + 0.25j) if damping else K
    model = mechss(M, C, stiffness, B, F, G, H=H, D=D, Bv=Bv, Ba=Ba, Dv=Dv, Da=Da)
    assert model.is_complex == damping
    desired = exact.transfer(model, POINTS)
    assert_allclose(model(POINTS, squeeze=False), desired, rtol=0.0, atol=EXACT * np.abs(desired).max())


@pytest.mark.parametrize(("m", "p"), [(1, 1), (1, 2), (2, 1), (2, 2)])
@pytest.mark.parametrize("squeeze", [None, True, False])
@pytest.mark.parametrize("s", [1j, 0, [1j], [1j, 2j], np.array([1.0, 2.0, 3.0])])
def test_shapes_are_those_of_python_control(m: int, p: int, squeeze: bool | None, s: npt.ArrayLike) -> None:  # noqa: FBT001
    """``model(s, squeeze)`` has the shape and the values of ``sys(s, squeeze)``."""
    model = hydromount().select(inputs=["F_y", "F_y1"][:m], outputs=["y", "y2"][:p])
    points: object = s if np.ndim(s) == 0 else np.asarray(s)
    desired = np.asarray(mech2ss(model)(points, squeeze=squeeze))
    actual = np.asarray(model(s, squeeze=squeeze))
    assert actual.shape == desired.shape
    assert_allclose(actual, desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max())


def test_undamped_pole_is_infinite() -> None:
    """``inf + nan j`` where P(s) is exactly singular, as in python-control, and only there."""
    model = mechss([[1]], [[0]], [[4]])
    values = model([1j, 2j, 3j])
    assert np.isinf(values[1].real)
    assert np.isnan(values[1].imag)
    assert_allclose(values[[0, 2]], [1 / 3, -1 / 5], rtol=ROUNDOFF)
    assert np.isinf(np.asarray(model(2j)).real)


def test_points_in_two_dimensions_are_refused() -> None:
    """A number or a list of numbers."""
    with pytest.raises(ValueError, match="s must be a number or a 1D array, but it has 2 dimensions"):
        hydromount()([[1j]])


def test_no_points_give_no_values() -> None:
    """An empty list is not an error."""
    assert hydromount()(np.zeros(0)).shape == (3, 3, 0)


@given(powers=st.lists(st.integers(-60, 60), min_size=6, max_size=6))
def test_units_far_apart_lose_no_digits(powers: list[int]) -> None:
    """DOFs and equations in units of 10^k, k up to 60: the same mount."""
    mount = hydromount()
    S, R = np.diag(10.0 ** np.array(powers[:3])), np.diag(10.0 ** np.array(powers[3:]))
    scaled = mechss(R @ mount.M @ S, R @ mount.C @ S, R @ mount.K @ S, R, S)
    assert_allclose(scaled(POINTS), mount(POINTS), rtol=ROUNDOFF)


# --- complex models and printing -------------------------------------------------------------------------------


def test_structural_damping_shows_its_loss_factor() -> None:
    """``K (1 + i eta)`` at rest: the receptance has the loss angle ``-atan eta``."""
    model = mechss([[1]], None, [[100 * (1 + 0.2j)]])
    assert model.complex_matrices == ("K",)
    assert_allclose(np.angle(np.asarray(model(0))), -np.arctan(0.2), rtol=ROUNDOFF)


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (hydromount(), "SecondOrderModel 'hydromount': 3 DOFs: 1 inertial, 2 half, 0 static; 4 states"),
        (mechss(None, None, [[1]]), "1 DOFs: 0 inertial, 0 half, 1 static; 0 states"),
        (mechss(None, [[1, -1], [-1, 1]], np.eye(2)), "by null columns, which do not suffice here"),
        (mechss([[1]], [[1j]], [[1]]), "complex: C"),
        (mechss([[1, 0], [0, 0]], None, [[1, 0], [0, 0]]), "which do not suffice here"),
    ],
)
def test_repr_shows_the_split(model: SecondOrderModel, words: str) -> None:
    """How many DOFs of each kind, and the states that follow."""
    assert words in repr(model)


def test_repr_of_a_large_sparse_model_knows_that_a_constraint_takes_states() -> None:
    """600 masses tied by one rod have 1198 states, not 1200, and repr does not say otherwise."""
    n = 600
    stiffness = 2.0 * np.eye(n + 1) - np.eye(n + 1, k=1) - np.eye(n + 1, k=-1)
    stiffness[n] = stiffness[:, n] = 0.0
    free = mechss(csc_array(np.diag([1.0] * n + [0.0])), None, csc_array(stiffness + np.diag([0.0] * n + [3.0])))
    assert "600 inertial, 0 half, 1 static; 1200 states" in repr(free)
    stiffness[n, [10, 200]] = stiffness[[10, 200], n] = 1.0, -1.0
    tied = mechss(csc_array(np.diag([1.0] * n + [0.0])), None, csc_array(stiffness))
    assert "600 inertial, 0 half, 1 static by null columns, which do not suffice here" in repr(tied)


@pytest.mark.parametrize("loss", [1.0, 1.0 + 0.1j])
def test_repr_of_a_large_sparse_model_knows_that_a_damper_between_two_nodes_is_one_state(loss: complex) -> None:
    """The pattern of W is that of a regular matrix, its numbers are not: 600 nodes in a row, two of them damped."""
    n = 600
    stiffness = csc_array(loss * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)))
    damping = np.zeros((n, n))
    damping[np.ix_([4, 5], [4, 5])] = [[0.3, -0.3], [-0.3, 0.3]]
    between = mechss(None, csc_array(damping), stiffness)
    assert "0 inertial, 2 half, 598 static by null columns, which do not suffice here" in repr(between)
    damping[4, 4] = 0.7
    assert "0 inertial, 2 half, 598 static; 2 states" in repr(mechss(None, csc_array(damping), stiffness))


def test_models_are_compared_by_identity() -> None:
    """A generated comparison of arrays would raise; two models are never silently equal."""
    assert hydromount() != hydromount()


def test_transfer_function_agrees_with_python_control() -> None:
    """A plain mass, damper and spring: 1 / (m s^2 + c s + k)."""
    model = mechss([[2]], [[3]], [[5]])
    assert_allclose(model(POINTS), control.tf([1], [2, 3, 5])(POINTS), rtol=ROUNDOFF)
