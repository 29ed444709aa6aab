"""Numbers, vectors and labels in place of matrices: what users naturally pass to `mechss`, `dss` and `lqr`."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import MatrixError, WeightError
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.model.second_order import LETTERS
from support.labelled_frames import Frame

K = np.array([[3.0, -1.0], [-1.0, 1.0]])
SIZES = st.floats(1e-9, 1e9)


def require_same(one: hd.SecondOrderModel, other: hd.SecondOrderModel) -> None:
    """Every matrix and every name."""
    for letter in LETTERS:
        assert_array_equal(getattr(one.as_dense(), letter), getattr(other, letter))
    assert (one.dofs, one.inputs, one.outputs) == (other.dofs, other.inputs, other.outputs)


@given(m=SIZES, c=SIZES, k=SIZES)
def test_numbers_make_a_model_of_one_dof(m: float, c: float, k: float) -> None:
    """``m q'' + c q' + k q = b u``, with all kinds of numbers."""
    expected = hd.mechss([[m]], [[c]], [[k]], [[2.0]], [[3.0]], D=[[0.5]], dofs="y", inputs="u", outputs="z")
    model = hd.mechss(m, np.float64(c), np.array(k), 2, 3, D=0.5, dofs="y", inputs="u", outputs="z")
    require_same(model, expected)
    require_same(hd.mechss(m, 0, k), hd.mechss([[m]], None, [[k]]))


@pytest.mark.parametrize("zero", [0, 0.0, np.float64(0.0), np.array(0.0), np.int64(0)])
def test_zero_is_a_matrix_of_zeros(zero: Any) -> None:  # noqa: ANN401
    """As None is; also in a sparse model, and for the direct term."""
    expected = hd.mechss(np.eye(2), None, K)
    require_same(hd.mechss(np.eye(2), zero, K, D=zero), hd.mechss(np.eye(2), None, K, D=np.zeros((2, 2))))
    require_same(hd.mechss(np.eye(2), zero, K), expected)
    require_same(hd.mechss(np.eye(2), zero, scipy.sparse.csr_array(K)), expected)


@given(masses=st.lists(SIZES, min_size=2, max_size=2))
def test_a_vector_is_a_diagonal_matrix(masses: list[float]) -> None:
    """Of mass, damping or stiffness, dense and sparse."""
    expected = hd.mechss(np.diag(masses), np.diag([0.0, 2.0]), K)
    require_same(hd.mechss(masses, [0, 2], K), expected)
    require_same(hd.mechss(np.array(masses), (0, 2), scipy.sparse.csr_array(K)), expected)
    require_same(hd.mechss(masses, None, [1, 2]), hd.mechss(np.diag(masses), None, np.diag([1.0, 2.0])))


def test_a_sparse_diagonal_stays_sparse() -> None:
    """A vector of 20 000 masses beside a sparse stiffness, which dense would take 3 GB."""
    model = hd.mechss(np.ones(20_000), 0, scipy.sparse.eye_array(20_000, format="csr"))
    assert model.is_sparse
    assert as_sparse(model.M).nnz == 20_000


def test_numbers_make_a_descriptor_system_of_one_variable() -> None:
    """``x' = -2 x + u``; E = 0 is no unit matrix."""
    assert hd.dss2ss(-2, 1, 1, 0, None).A.tolist() == [[-2.0]]
    assert hd.dss(-2, 1, 1, 0, 0).C.tolist() == [[0.0]]
    with pytest.raises(MatrixError, match="A is None"):
        hd.dss(None, 1, 1, 0, None)


def test_a_number_weighs_every_input_and_a_vector_each() -> None:
    """R = 1e-3 against 1e-3 times the unit matrix; Q as a vector against its diagonal matrix."""
    mount = hd.hydromount()
    Q, R = np.diag([1.0, 2.0, 3.0, 4.0]), 1e-3 * np.eye(3)
    expected = hd.lqr(mount, Q=Q, R=R).K
    assert_array_equal(hd.lqr(mount, Q=np.diagonal(Q), R=1e-3, N=0).K, expected)
    assert_array_equal(hd.lqr(mount, Q=Q, R=[1e-3, 1e-3, 1e-3]).K, expected)


def test_labelled_weights_are_aligned() -> None:
    """Q of the states in another order."""
    mount = hd.hydromount()
    states = hd.exact_reduction(mount).states
    Q = np.diag([1.0, 2.0, 3.0, 4.0])
    turned: Any = Frame(Q[::-1, ::-1], states[::-1], states[::-1])
    assert_array_equal(hd.lqr(mount, Q=turned, R=1.0).K, hd.lqr(mount, Q=Q, R=1.0).K)


def test_node_numbers_name_motions_and_weights() -> None:
    """Keys that are whole numbers are the names of the DOFs that were given so."""
    numbers: Any = [101, 102]
    model = hd.mechss(np.eye(2), [0.1, 0.1], K, dofs=numbers)
    by_number: Any = {102: 1.0}
    plain, named = (hd.initial_response(model, [0.0, 0.1], displacement=d).x for d in ({"102": 1.0}, by_number))
    assert_array_equal(plain, named)
    assert model.select(outputs=numbers).outputs == ("101", "102")


@pytest.mark.parametrize("value", [1e308, -1e200, 5e-324, 1e-310, 1e-200, 1e155])
@pytest.mark.parametrize("sparse", [False, True])
def test_numbers_whose_products_overflow_or_vanish_are_refused(value: float, sparse: bool) -> None:  # noqa: FBT001
    """At the door, before a factorization ends in NaN; dense and sparse."""
    M = np.diag([value, 1.0])
    with pytest.raises(MatrixError, match=r"overflow|vanish|subnormal"):
        hd.mechss(scipy.sparse.csr_array(M) if sparse else M, None, K)
    with pytest.raises((MatrixError, WeightError), match=r"overflow|vanish|subnormal"):
        hd.lqr(hd.mechss(np.eye(2), None, K), Q=np.eye(4), R=abs(value))


@pytest.mark.parametrize("value", [1e308, -1e201, 5e-324, 1e-310, 1e-201])
def test_signals_take_the_squares_of_such_numbers(value: float) -> None:
    """Inputs and outputs enter a product but once."""
    with pytest.raises(MatrixError, match=r"of B is|B has an entry"):
        hd.mechss(np.eye(2), None, K, [value, 0.0])
    with pytest.raises(MatrixError, match=r"of F is|F has an entry"):
        hd.mechss(np.eye(2), None, K, None, [value, 0.0])
    assert hd.mechss(np.eye(2), None, K, [1e150, 0.0]).B[0, 0] == 1e150


@pytest.mark.parametrize("value", [1e-150, 1e-30, 1e30])
def test_entries_that_are_small_beside_others_do_no_harm(value: float) -> None:
    """A coupling that is next to nothing stays what it is."""
    C = np.array([[1.0, value], [value, 1e30]])
    assert_array_equal(hd.mechss(np.eye(2), C, K).C, C)


def test_a_state_space_or_a_path_in_place_of_matrices_is_named() -> None:
    """With what to pass instead."""
    given: Any = hd.mech2ss(hd.hydromount())
    path: Any = "model.mat"
    with pytest.raises(hd.HalfdofError, match=r"a model of mechss, or matrices; this is a control\.State"):
        hd.mech2ss(given)
    with pytest.raises(hd.HalfdofError, match=r"mech2ss takes .*; this is the text 'model\.mat'.*hd\.load_model"):
        hd.mech2ss(path)
    with pytest.raises(hd.HalfdofError, match=r"dss2ss takes .*; this is a control\.StateSpace"):
        hd.dss2ss(given)
