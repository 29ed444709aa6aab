"""The door: what `mechss` makes of its arguments, names and their refusals."""

import numpy as np
import pytest
import scipy.sparse
from numpy.testing import assert_array_equal

from halfdof_ctrl import hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import MatrixError, ModelSizeError, SignalNameError
from halfdof_ctrl.model.second_order import LETTERS

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
        ({"M": 3.0}, "M is a single number, and there are 2 DOFs"),
        ({"C": [1.0, 2.0, 3.0]}, "C is a vector of 3 numbers, and there are 2 DOFs"),
        ({"K": [[3.0, 1.0]]}, "K must be square, but it is 1 x 2|K must be 2 x 2"),
        ({"B": [[1.0, 2.0]]}, "B needs a row for each DOF; transpose it"),
        ({"B": np.ones((2, 1)), "Bv": np.ones((1, 2))}, "Bv needs a row for each DOF; transpose it"),
        ({"F": [[1.0], [2.0]]}, "F needs a column for each DOF; transpose it"),
        ({"B": np.ones((2, 1)), "D": np.ones((1, 2))}, "D needs a row for each output .*; transpose it"),
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
