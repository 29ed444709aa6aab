"""The one door for matrices: what it takes, what it refuses and with which words."""

import gc
import weakref
from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.testing import assert_array_equal

from halfdof_ctrl.base.arrays import (
    DENSE_ROW_LIMIT,
    as_dense,
    checked_matrix,
    is_complex,
    is_unit,
    is_zero,
    read_only,
    unit_matrix,
    zero_matrix,
)
from halfdof_ctrl.base.errors import MatrixError

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(array=hnp.arrays(np.float64, st.integers(1, 6).map(lambda n: (n, n)), elements=FINITE))
def test_finite_square_matrix_is_copied_as_it_is(array: np.ndarray) -> None:
    """Every finite float comes through to the last bit, in an array of our own that is locked."""
    checked = checked_matrix(array, "K")
    assert_array_equal(checked, array)
    assert checked.dtype == np.float64
    assert not np.shares_memory(checked, array)
    assert not checked.flags.writeable


@pytest.mark.parametrize(
    "value",
    [
        [[1, 2], [3, 4]],
        [[True, False], [False, True]],
        np.array([[1, 2], [3, 4]], dtype=np.uint8),
        np.array([[1, 2], [3, 4]], dtype=np.float32),
        np.array([[1, 2], [3, 4]], dtype=object),
        np.array([[1, 2], [3, 4]], dtype=complex),
        scipy.sparse.csr_array([[1.0, 2.0], [3.0, 4.0]]),
        scipy.sparse.coo_matrix([[1.0, 2.0], [3.0, 4.0]]),
        np.ma.masked_array([[1.0, 2.0], [3.0, 4.0]], mask=False),
    ],
    ids=["int", "bool", "uint8", "float32", "object", "complex without imaginary part", "csr", "coo", "unmasked"],
)
def test_matrices_of_numbers_become_float64(value: object) -> None:
    """Whole numbers, truth values, sparse and unmasked matrices are numbers."""
    checked = checked_matrix(value, "K")
    assert checked.dtype == np.float64
    assert type(checked) is np.ndarray
    assert checked.shape == (2, 2)


def test_imaginary_parts_are_kept() -> None:
    """Structural damping stays complex."""
    checked = checked_matrix([[1 + 0.1j]], "K")
    assert is_complex(checked)
    assert checked[0, 0] == 1 + 0.1j


@pytest.mark.parametrize(
    ("value", "shape", "words"),
    [
        ([[1, 2]], None, "K must be square, but it is 1 x 2"),
        ([1, 2], None, "K must be square, but it is 2"),
        (3.0, None, "K must be square, but it is a single number"),
        (None, (1, 1), "K is not a matrix of numbers|K must be 1 x 1"),
        ([[1, 2], [3, 4]], (3, 3), "K must be 3 x 3, but it is 2 x 2"),
        ([1, 2, 3], (2, 1), "K must be 2 x 1, but it is 3"),
        ([1, 2, 3, 4], (2, 2), "K must be 2 x 2, but it is 4"),
        (np.zeros((2, 2, 2)), None, "K must be square, but it is 2 x 2 x 2"),
        (np.zeros((0, 0)), None, "K is empty"),
        ([], None, "K must be square, but it is 0"),
    ],
)
def test_wrong_shape_is_refused(value: object, shape: tuple[int, int] | None, words: str) -> None:
    """The message says what was expected and what was found."""
    with pytest.raises(MatrixError, match=words) as refusal:
        checked_matrix(value, "K", shape)
    assert refusal.value.matrix == "K"


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ([[1, 2], [3]], "K is not a matrix of numbers: .*inhomogeneous"),
        ([["a", "b"], ["c", "d"]], "K holds entries of type <U1"),
        ("text", "K holds entries of type <U4"),
        (b"bytes", "K holds entries of type"),
        ([[object(), 1], [1, 1]], "K is not a matrix of numbers"),
        ([[None, 1], [1, 1]], r"K is not a matrix of numbers|K\[0, 0\] is nan"),
        ([[10**400, 1], [1, 1]], "K is not a matrix of numbers"),
        (np.array([["2020-01-01"]], dtype="datetime64[D]"), "K holds entries of type datetime64"),
        ({"a": 1}, "K is not a matrix of numbers"),
        (np.array([[1 + 1j, "x"]], dtype=object), "K is not a matrix of numbers"),
    ],
    ids=["ragged", "text", "one text", "bytes", "objects", "None inside", "huge", "dates", "mapping", "mixed"],
)
def test_things_that_are_no_numbers_are_refused(value: object, words: str) -> None:
    """Text is never parsed as a number."""
    with pytest.raises(MatrixError, match=words):
        checked_matrix(value, "K")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, complex(0, np.nan), complex(np.inf, 1)])
def test_entries_that_are_not_finite_are_refused_with_their_place(bad: complex) -> None:
    """Row and column stand in the message."""
    array = np.eye(3, dtype=type(bad))
    array[1, 2] = bad
    with pytest.raises(MatrixError, match=r"M\[1, 2\] is .*: every entry must be a finite number"):
        checked_matrix(array, "M")


def test_masked_entries_are_refused() -> None:
    """A masked entry has no value."""
    with pytest.raises(MatrixError, match="C has masked entries"):
        checked_matrix(np.ma.masked_array(np.eye(2), mask=np.eye(2, dtype=bool)), "C")


def test_huge_sparse_matrix_is_refused_before_it_is_expanded() -> None:
    """More rows than can be held dense."""
    rows = DENSE_ROW_LIMIT + 1
    with pytest.raises(MatrixError, match=f"K is sparse with {rows} rows"):
        checked_matrix(scipy.sparse.eye_array(rows, format="csr"), "K")


@pytest.mark.parametrize("shape", [(1, 3), (3, 1)])
def test_list_becomes_the_row_or_column_that_is_meant(shape: tuple[int, int]) -> None:
    """A one-dimensional B or F is a single column or row."""
    assert_array_equal(checked_matrix([1, 2, 3], "B", shape), np.array([1.0, 2.0, 3.0]).reshape(shape))


@pytest.mark.parametrize("value", [[[1, "2"], [3, 4]], np.array([["1", 2], [3, 4]], dtype=object), [["1"]], [[b"1"]]])
def test_digits_in_text_are_not_numbers(value: object) -> None:
    """A column read as text from a file is refused, not parsed."""
    with pytest.raises(MatrixError, match=r"K holds entries of type|K is not a matrix of numbers"):
        checked_matrix(value, "K")


@pytest.mark.parametrize("size", [2, 40])
def test_constant_matrices_are_read_only(size: int) -> None:
    """Zeros and unit matrices, shared or not, cannot be changed."""
    for array in (zero_matrix(size, size), unit_matrix(size)):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 5.0
    assert_array_equal(unit_matrix(size), np.eye(size))
    assert_array_equal(zero_matrix(size, 2), np.zeros((size, 2)))


@pytest.mark.parametrize("size", [2, 40])
def test_constant_matrices_are_shared_and_known_at_once(size: int) -> None:
    """Who asks for the same zeros or units gets the same array; others of equal entries are looked at."""
    zeros, unit = zero_matrix(size, size), unit_matrix(size)
    assert zero_matrix(size, size) is zeros
    assert unit_matrix(size) is unit
    assert is_unit(unit)
    assert not is_unit(np.eye(size))
    assert is_zero(zeros, np.zeros((size, 3)))
    assert not is_zero(unit)
    assert not is_unit(np.ones((size, size + 1)))


@pytest.mark.parametrize("make", [unit_matrix, lambda size: zero_matrix(size, size + 1)])
def test_large_constant_matrices_are_kept_as_long_as_they_are_used(make: Callable[[int], np.ndarray]) -> None:
    """Sharing holds no memory that nobody needs."""
    watched = weakref.ref(make(211))
    gc.collect()
    assert watched() is None


def test_locked_array_is_the_same_array() -> None:
    """`read_only` does not copy."""
    array = np.zeros(3)
    assert read_only(array) is array
    assert not array.flags.writeable


def test_matrix_of_either_kind_is_given_as_an_array() -> None:
    """An array as it is, without a copy; compressed columns with the zeros that they do not store."""
    array = np.array([[0.0, 2.0], [0.0, -1.0]])
    assert as_dense(array) is array
    assert_array_equal(as_dense(scipy.sparse.csc_array(array)), array)
