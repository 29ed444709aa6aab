"""Sparse matrices at the door: any format in, sorted read-only columns without zeros out."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.base import sparse_arrays
from halfdof_ctrl.base.errors import MatrixError
from halfdof_ctrl.base.sparse_arrays import (
    as_sparse,
    checked_sparse_matrix,
    checked_sparse_squares,
    filled_rows,
    joined_sparse,
    largest_by_row_and_column,
    picked_below,
    picked_beside,
    unit_columns,
)

FULL = np.array([[1.0, 0.0, -2.0], [0.0, 0.0, 3.0], [4.0, 0.0, 0.0]])
FORMATS = ("csc", "csr", "coo", "lil", "dok", "dia", "bsr")


def dense(matrix: Any) -> npt.NDArray[Any]:  # noqa: ANN401  # a sparse matrix typed as the models' are
    """Expand."""
    return np.asarray(as_sparse(matrix).toarray())


@pytest.mark.parametrize("kind", ["array", "matrix"])
@pytest.mark.parametrize("form", FORMATS)
def test_any_format_gives_sorted_read_only_columns(form: str, kind: str) -> None:
    """Arrays and the older matrices of scipy in all seven formats."""
    given_matrix = getattr(scipy.sparse, f"{form}_{kind}")(FULL)
    matrix: Any = checked_sparse_matrix(given_matrix, "K")
    assert isinstance(matrix, scipy.sparse.csc_array)
    assert_array_equal(dense(matrix), FULL)
    assert matrix.nnz == 4
    assert matrix.has_sorted_indices
    for part in (matrix.data, matrix.indices, matrix.indptr):
        with pytest.raises(ValueError, match="read-only"):
            part[0] = 1


@pytest.mark.parametrize("kind", [np.bool_, np.int8, np.uint64, np.float32, np.float64, np.complex128])
def test_every_kind_of_number_becomes_real(kind: type) -> None:
    """Complex numbers without imaginary parts too."""
    matrix = checked_sparse_matrix(scipy.sparse.csr_array(np.abs(FULL).astype(kind)), "K")
    assert matrix.dtype == np.float64
    assert_array_equal(dense(matrix), np.abs(FULL).astype(kind).real)


def test_imaginary_parts_are_kept() -> None:
    """Structural damping."""
    assert checked_sparse_matrix(scipy.sparse.csr_array(FULL * 1j), "K").dtype == np.complex128


def test_duplicates_are_added_up_and_stored_zeros_dropped() -> None:
    """As finite-element assembly leaves them: a column that sums to zero is null."""
    entries = [1.0, 2.0, 5.0, -5.0], ([0, 0, 1, 1], [0, 0, 1, 1])
    matrix: Any = checked_sparse_matrix(scipy.sparse.coo_array(entries, shape=(2, 2)), "K")
    assert_array_equal(dense(matrix), [[3.0, 0.0], [0.0, 0.0]])
    assert np.diff(matrix.indptr).tolist() == [1, 0]


def test_the_users_matrix_is_copied() -> None:
    """Later changes do not reach the model."""
    K = scipy.sparse.csc_array(FULL)
    matrix = checked_sparse_matrix(K, "K")
    K.data[0] = 99.0
    assert_array_equal(dense(matrix), FULL)


@pytest.mark.parametrize("vector", [np.array([1.0, 0.0, 2.0]), scipy.sparse.coo_array([1.0, 0.0, 2.0])])
def test_a_vector_is_a_column_where_one_is_wanted(vector: Any) -> None:  # noqa: ANN401
    """Of dense numbers, and scipy's one-dimensional sparse arrays."""
    assert_array_equal(dense(checked_sparse_matrix(vector, "B", (3, 1))), [[1.0], [0.0], [2.0]])


@pytest.mark.parametrize(
    ("value", "shape", "words"),
    [
        (scipy.sparse.csr_array(FULL[:2]), None, "K must be square, but it is 2 x 3"),
        (scipy.sparse.csr_array(FULL), (4, 4), "K must be 4 x 4, but it is 3 x 3"),
        (scipy.sparse.coo_array([1.0, 2.0]), None, "K must be square, but it is 2"),
        (scipy.sparse.csr_array((0, 0)), None, "K is empty"),
        (scipy.sparse.coo_array(([np.nan], ([1], [2])), shape=(3, 3)), None, r"K\[1, 2\] is nan"),
        (scipy.sparse.coo_array(([np.inf], ([2], [0])), shape=(3, 3)), None, r"K\[2, 0\] is inf"),
        (scipy.sparse.coo_array(([1j * np.nan], ([2], [0])), shape=(3, 3)), None, r"K\[2, 0\] is \(nan"),
        ("text", (3, 3), "K holds entries of type"),
    ],
)
def test_what_is_no_matrix_of_the_model_is_refused(value: Any, shape: tuple[int, int] | None, words: str) -> None:  # noqa: ANN401
    """By letter and, for an entry, by place."""
    with pytest.raises(MatrixError, match=words):
        checked_sparse_matrix(value, "K", shape)


def test_entries_that_are_no_numbers_are_refused() -> None:
    """Sparse arrays of objects exist."""
    objects = scipy.sparse.csr_array(FULL)
    objects.data = np.array(["a"] * objects.nnz, dtype=object)
    with pytest.raises(MatrixError, match="K holds entries of type object"):
        checked_sparse_matrix(objects, "K")


def test_indices_outside_the_matrix_are_refused() -> None:
    """They would crash the compiled routines."""
    broken = scipy.sparse.csr_array(FULL)
    broken.indices = np.array([0, 2, 2, 7], dtype=broken.indices.dtype)
    with pytest.raises(MatrixError, match="K is no sound sparse matrix"):
        checked_sparse_matrix(broken, "K")


def test_more_entries_than_can_be_factorized_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """SuperLU counts in 32 bits."""
    monkeypatch.setattr(sparse_arrays, "MOST_STORED", 3)
    with pytest.raises(MatrixError, match="K stores 4 entries, and at most 3"):
        checked_sparse_matrix(scipy.sparse.csr_array(FULL), "K")


def test_dense_matrices_beside_a_sparse_one_become_sparse() -> None:
    """The size is that of the sparse one, and None is zeros."""
    M, C, K = checked_sparse_squares((np.diag([1.0, 0.0, 0.0]), None, scipy.sparse.csr_array(FULL)), "MCK")
    assert [as_sparse(part).nnz for part in (M, C, K)] == [1, 0, 4]
    with pytest.raises(MatrixError, match="M must be 3 x 3, but it is 2 x 2"):
        checked_sparse_squares((np.eye(2), None, scipy.sparse.csr_array(FULL)), "MCK")


@given(seed=st.integers(0, 2**32 - 1))
def test_joining_and_picking_equal_numpy(seed: int) -> None:
    """Blocks, columns of what stands side by side, rows of what stands below each other."""
    generator = np.random.default_rng(seed)
    a, b, c, d = (
        generator.integers(-1, 2, shape).astype(float)
        for shape in ((2, 3), (2, int(generator.integers(0, 3))), (3, 3), (3, 0))
    )
    d = np.zeros((3, b.shape[1]))
    whole = np.block([[a, b], [c, d]])
    blocks: Any = [[scipy.sparse.csr_array(a), b], [c, d]]
    assert_array_equal(dense(joined_sparse(blocks)), whole)
    picked = generator.integers(0, 3, 4).tolist()
    beside, below = ([scipy.sparse.csc_array(part) for part in parts] for parts in ((a, a), (c, a)))
    assert_array_equal(dense(picked_beside(beside, picked)), np.hstack([a, a])[:, picked])
    assert_array_equal(dense(picked_below(below, picked)), np.vstack([c, a])[picked])
    by_row, by_column = largest_by_row_and_column(scipy.sparse.csc_array(a))
    assert_array_equal(by_row, np.abs(a).max(axis=1))
    assert_array_equal(by_column, np.abs(a).max(axis=0))


def test_unit_columns_are_found_among_several_matrices() -> None:
    """A column counts if it has one entry in all of them together, and that is 1."""
    first = checked_sparse_matrix(scipy.sparse.csc_array([[1.0, 0, 0, 1], [0, 2.0, 0, 0]]), "F", (2, 4))
    second = checked_sparse_matrix(scipy.sparse.csc_array([[0.0, 0, 0, 1], [0, 0, 1.0, 0]]), "G", (2, 4))
    assert unit_columns([first, second]) == [(0, 0), None, (1, 1), None]
    assert filled_rows([first, second]) == [True, True]
    assert filled_rows([checked_sparse_matrix(scipy.sparse.csc_array((2, 2)), "D")]) == [False, False]
