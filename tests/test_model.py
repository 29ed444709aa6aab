"""The model: what `mechss` makes of its arguments, names and their refusals, evaluation, selection."""

import control
import exact
import numpy as np
import numpy.typing as npt
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from structures import Structure, structures

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.errors import MatrixError, SignalNameError

ROUNDOFF = 1e-12  # direct solves of small matrices with small integer entries
EXACT = 1e-10  # the same with n <= 12 and conditions up to 1e6
POINTS = np.array([0.3j, 1.1j, 4.7j, 0.6 + 0.2j])
SIZES = st.integers(1, 4)


# --- what comes in ---------------------------------------------------------------------------------------------


def test_forces_and_displacements_of_all_dofs_by_default() -> None:
    """Without B and F: a unit force on, and the displacement of, every DOF, named after it."""
    model = mechss(np.eye(2), None, np.eye(2), dofs=["a", "b"])
    assert_array_equal(model.B, np.eye(2))
    assert_array_equal(model.F, np.eye(2))
    assert (model.inputs, model.outputs) == (("F_a", "F_b"), ("a", "b"))


def test_missing_matrices_are_zero() -> None:
    """None stands for zeros, wherever the other matrices tell the size."""
    model = mechss(None, [[0, 1], [1, 0]], None)
    assert_array_equal(model.M, np.zeros((2, 2)))
    assert_array_equal(model.K, np.zeros((2, 2)))
    assert_array_equal(mechss(None, None, [[3]]).C, [[0.0]])
    assert model.dofs == ("q0", "q1")


def test_model_without_any_matrix_is_refused() -> None:
    """At least one of M, C, K."""
    with pytest.raises(MatrixError, match="M, C, K are all None"):
        mechss(None, None, None)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"M": np.eye(2), "C": np.eye(3), "K": np.eye(2)}, "C must be 2 x 2, but it is 3 x 3"),
        ({"M": None, "C": np.eye(2), "K": np.eye(3)}, "K must be 2 x 2, but it is 3 x 3"),
        ({"B": np.ones((3, 1))}, "B must be 2 x 1, but it is 3 x 1"),
        ({"B": [1, 2, 3]}, "B must be 2 x 1, but it is 3"),
        ({"F": np.ones((1, 3))}, "F must be 1 x 2, but it is 1 x 3"),
        ({"F": np.ones((1, 2)), "G": np.ones((2, 2))}, "G must be 1 x 2, but it is 2 x 2"),
        ({"B": np.ones((2, 1)), "Bv": np.ones((2, 2))}, "Bv must be 2 x 1, but it is 2 x 2"),
        ({"B": np.ones((2, 1)), "D": np.ones((2, 2))}, "D must be 2 x 1, but it is 2 x 2"),
        ({"D": 1.0}, "D must be 2 x 2, but it is a single number"),
        ({"Dv": np.ones((1, 1))}, "Dv must be 2 x 2"),
        ({"Da": [[np.nan, 0], [0, 0]]}, r"Da\[0, 0\] is nan"),
        ({"H": "text"}, "H holds entries of type"),
        ({"M": np.zeros((0, 0)), "C": None, "K": None}, "M is empty"),
        ({"M": 3.0, "C": None, "K": None}, "M must be square"),
        ({"B": np.zeros((2, 0))}, "B"),
        ({"F": np.zeros((0, 2))}, "F"),
    ],
)
def test_wrong_matrices_are_refused_by_letter(arguments: dict[str, object], words: str) -> None:
    """Every matrix is checked against M, B and F, at the door; a model has an input and an output."""
    given_arguments: dict[str, object] = {"M": np.eye(2), "C": np.eye(2), "K": np.eye(2)} | arguments
    with pytest.raises(MatrixError, match=words):
        mechss(**given_arguments)  # type: ignore[arg-type]


def test_sparse_matrices_are_taken() -> None:
    """Sparse arrays give the model of their dense form."""
    M, C, K = (scipy.sparse.csc_array(matrix) for matrix in (np.eye(2), np.eye(2), 2 * np.eye(2)))
    B = scipy.sparse.csr_array([[1.0], [0.0]])
    model = mechss(M, C, K, B)  # type: ignore[arg-type]  # npt.ArrayLike does not know sparse arrays
    assert_array_equal(model.K, 2 * np.eye(2))
    assert model.inputs == ("F_q0",)


def test_zero_may_stand_for_a_matrix_of_zeros() -> None:
    """As in control.ss, ``D=0``."""
    assert_array_equal(mechss([[1]], [[1]], [[1]], D=0).D, [[0.0]])


def test_user_arrays_are_copied() -> None:
    """Later changes of the user's arrays do not reach the model, and the model's are locked."""
    K = np.eye(2)
    model = mechss(np.eye(2), None, K)
    K[0, 0] = 7.0
    assert model.K[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        model.K[0, 0] = 7.0


def test_model_is_frozen() -> None:
    """No attribute can be set."""
    with pytest.raises(AttributeError):
        hydromount().K = np.eye(3)  # type: ignore[misc]


# --- names -----------------------------------------------------------------------------------------------------


def test_rows_and_columns_that_are_physical_get_physical_names() -> None:
    """A unit force is F_<dof>; rows of F, G, H that pick one motion are named after it."""
    model = mechss(np.eye(2), None, np.eye(2), [0, 1], [[1, 0], [0, 0]], [[0, 0], [0, 1]], dofs=["a", "b"])
    assert (model.inputs, model.outputs) == (("F_b",), ("a", "b_dot"))


def test_other_rows_and_columns_get_numbers() -> None:
    """Combinations are u[0], y[0], ... ; a motion with a direct term is no motion."""
    model = mechss(np.eye(2), None, np.eye(2), [[1, 0], [1, 1]], [[1, 0], [2, 0]], D=[[0, 1], [0, 0]])
    assert model.inputs == ("u[0]", "F_q1")
    assert model.outputs == ("y[0]", "y[1]")


def test_repeated_physical_signals_get_numbers() -> None:
    """The same force twice would give the same name twice."""
    model = mechss([[1]], None, [[1]], [[1, 1]])
    assert model.inputs == ("u[0]", "u[1]")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dofs": ["a"]}, "1 names were given for 2 DOFs"),
        ({"dofs": ["a", "a"]}, "Names of DOFs must differ, but a stands more than once"),
        ({"dofs": ["a", "a_dot"]}, "a_dot would name both a DOF's motion and a derivative"),
        ({"dofs": ["a", ""]}, "must be non-empty text"),
        ({"inputs": ["u"]}, "1 names were given for 2 inputs"),
        ({"inputs": ["u", "u"]}, "Names of inputs must differ"),
        ({"outputs": ["u", "u"]}, "Names of outputs must differ"),
        ({"dofs": ["a", "b"], "inputs": ["F_b", "F_a"]}, "F_b, F_a is the name of the unit force on a DOF, but B say"),
        ({"dofs": ["a", "b"], "outputs": ["b", "w"]}, "b is the name of a DOF's motion, but F, G, H say"),
        ({"dofs": ["a", "b"], "outputs": ["a", "a_ddot"]}, "a_ddot is the name of a DOF's motion"),
    ],
)
def test_names_that_clash_are_refused(options: dict[str, list[str]], words: str) -> None:
    """Wrong counts, duplicates, and physical names on other signals."""
    with pytest.raises(SignalNameError, match=words):
        mechss(np.eye(2), np.eye(2), np.eye(2), **options)  # type: ignore[arg-type]


def test_full_stops_in_names_reach_python_control_as_colons() -> None:
    """Finite-element labels such as 101.1 keep their name in the model."""
    model = mechss([[1]], [[1]], [[1]], dofs="101.1", name="frame.v2")
    sys = mech2ss(model)
    assert model.dofs == ("101.1",)
    assert (sys.state_labels, sys.input_labels, sys.output_labels) == (["101:1", "101:1_dot"], ["F_101:1"], ["101:1"])
    assert sys.name == "frame:v2"


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
        ({"inputs": [0]}, "must be non-empty text"),
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


def test_models_are_compared_by_identity() -> None:
    """A generated comparison of arrays would raise; two models are never silently equal."""
    assert hydromount() != hydromount()


def test_transfer_function_agrees_with_python_control() -> None:
    """A plain mass, damper and spring: 1 / (m s^2 + c s + k)."""
    model = mechss([[2]], [[3]], [[5]])
    assert_allclose(model(POINTS), control.tf([1], [2, 3, 5])(POINTS), rtol=ROUNDOFF)
