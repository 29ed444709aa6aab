"""The model: what `mechss` makes of its arguments, names and their refusals, evaluation, selection."""

import control
import numpy as np
import numpy.typing as npt
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import MatrixError, ModelSizeError, SignalNameError
from halfdof_ctrl.model.second_order import LETTERS
from support import exact
from support.structures import Structure, structures

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


def test_sparse_matrices_stay_sparse() -> None:
    """One of M, C, K is enough; as_dense gives the dense model, with the same names."""
    M, K = np.diag([1.0, 0.0]), np.array([[2.0, -1.0], [-1.0, 1.0]])
    model, dense = mechss(scipy.sparse.csr_array(M), None, K), mechss(M, None, K)
    assert model.is_sparse
    assert not dense.is_sparse
    for letter in LETTERS:
        matrix, expected = getattr(model, letter), getattr(dense, letter)
        assert isinstance(matrix, scipy.sparse.csc_array)
        assert_array_equal(matrix.toarray(), expected)
        assert_array_equal(getattr(model.as_dense(), letter), expected)
        with pytest.raises(ValueError, match="read-only"):
            matrix.indptr[0] = 1
    assert repr(model) == repr(dense)
    assert dense.as_dense() is dense
    assert not mechss(M, None, K, scipy.sparse.csc_array([[1.0], [0.0]])).is_sparse


def test_names_and_selection_of_a_sparse_model_are_those_of_the_dense_one() -> None:
    """Unit columns and rows are recognized, physical names guarded, any DOF and derivative selected."""
    M, K, B = np.diag([1.0, 0.0, 2.0]), 2.0 * np.eye(3), np.array([[1.0, 0], [0, 0], [0, 2.0]])
    F, G, D = np.array([[0.0, 1, 0], [0, 0, 0]]), np.array([[0.0, 0, 0], [0, 0, 1]]), np.array([[0.0, 0], [0, 5.0]])
    dense = mechss(M, None, K, B, F, G, D=D, dofs=["a", "b", "c"])
    sparse = mechss(scipy.sparse.csc_array(M), None, K, B, scipy.sparse.csr_array(F), G, D=D, dofs=["a", "b", "c"])
    assert (sparse.inputs, sparse.outputs) == (dense.inputs, dense.outputs) == (("F_a", "u[1]"), ("b", "y[1]"))
    chosen = {"inputs": ["F_b", "u[1]"], "outputs": ["c_ddot", "y[1]", "b_dot", "a"]}
    for letter in LETTERS:
        expected = getattr(dense.select(**chosen), letter)
        assert_array_equal(getattr(sparse.select(**chosen), letter).toarray(), expected)
    for options, words in (
        ({"inputs": ["F_b", "x"]}, "F_b is the name of"),
        ({"outputs": ["b", "a"]}, "a is the name"),
    ):
        with pytest.raises(SignalNameError, match=words):
            mechss(scipy.sparse.csc_array(M), None, K, B, F, G, dofs=["a", "b", "c"], **options)  # type: ignore[arg-type]
    with pytest.raises(SignalNameError, match="no input 'F_z'"):
        sparse.select("F_z")


def test_the_motion_of_a_sparse_model_is_prescribed_as_that_of_a_dense_one() -> None:
    """Base excitation by displacement and by acceleration."""
    M, K = np.diag([2.0, 0.0, 1.0]), np.array([[8.0, -8, 0], [-8, 9, -1], [0, -1, 1]])
    for kind in ("displacement", "acceleration"):
        sparse, dense = (
            mechss(form(M), None, K).prescribe_motion("q1", kind) for form in (scipy.sparse.csr_array, np.array)
        )
        assert sparse.is_sparse
        for letter in LETTERS:
            assert_array_equal(getattr(sparse, letter).toarray(), getattr(dense, letter))
            assert isinstance(getattr(sparse, letter), scipy.sparse.csc_array)


def test_half_a_million_dofs_take_a_moment() -> None:
    """Names, checks, selection and repr are linear in the size: no n x n matrix, no table of all names."""
    n = 500_000
    diagonal = scipy.sparse.dia_array(scipy.sparse.eye_array(n))
    model = mechss(None, diagonal, diagonal, name="many")
    assert model.inputs[-1] == "F_q499999"
    assert repr(model).startswith("SecondOrderModel 'many': 500000 DOFs: 0 inertial, 500000 half, 0 static")
    small = model.select(["F_q7", "F_q499999"], ["q7", "q8_dot"])
    assert (small.B.shape, small.G.shape, small.D.shape) == ((n, 2), (2, n), (2, 2))
    with pytest.raises(ModelSizeError, match=r"Dense matrices of 500000 DOFs, 2 inputs and 2 outputs .* 2e\+03 GB"):
        small.as_dense()


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
