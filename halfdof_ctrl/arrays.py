"""Checked, read-only matrices: the one place where shapes and entries are tested."""

from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.errors import MatrixError

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
Matrix: TypeAlias = npt.NDArray[Any]  #: float64 or complex128, as checked_matrix gives it

DENSE_ROW_LIMIT = 5000  #: larger sparse matrices are refused rather than expanded (200 MB each)
MATRIX_DIMENSIONS = 2
REAL = np.dtype(np.float64)
SHARED_SIZE = 1024  #: constant matrices up to this many entries are made once


def checked_matrix(value: object, letter: str, shape: tuple[int, int] | None = None) -> Matrix:
    """Copy a value into a read-only matrix of finite numbers.

    Parameters
    ----------
    value : array_like or scipy sparse array
        Two-dimensional, or one-dimensional where `shape` shows a single row or column.
    letter : str
        The matrix's letter in ``M q'' + C q' + K q = B u`` and ``y = F q + G q' + H q'' + D u``.
    shape : (int, int), optional
        The shape that it must have; without it, it must be square.

    Returns
    -------
    ndarray
        float64, or complex128 where an imaginary part is nonzero; not writeable.

    Raises
    ------
    MatrixError
        Text or other things that are no numbers, ragged rows, wrong shape, empty, NaN or Inf, a
        sparse matrix too large to be held dense.
    """
    array = _numbers(value, letter)
    if shape is not None and array.ndim == 1:
        array = _as_row_or_column(array, shape)
    if array.ndim != MATRIX_DIMENSIONS or (
        array.shape != shape if shape is not None else array.shape[0] != array.shape[1]
    ):
        expected = "square" if shape is None else f"{shape[0]} x {shape[1]}"
        found = " x ".join(map(str, array.shape)) or "a single number"
        msg = (
            f"{letter} must be {expected}, but it is {found}. Check its rows and columns against the DOFs and signals."
        )
        raise MatrixError(msg, matrix=letter)
    if array.size == 0 and shape is None:
        msg = f"{letter} is empty (0 x 0): a model needs at least one DOF."
        raise MatrixError(msg, matrix=letter)
    if not np.logical_and.reduce(np.isfinite(array), axis=None):
        row, column = (int(index) for index in np.argwhere(~np.isfinite(array))[0])
        msg = f"{letter}[{row}, {column}] is {array[row, column]}: every entry must be a finite number."
        raise MatrixError(msg, matrix=letter)
    return read_only(array)


def zero_matrix(rows: int, columns: int) -> FloatArray:
    """Give a read-only matrix of zeros; small ones are shared."""
    return _small_zeros(rows, columns) if rows * columns <= SHARED_SIZE else read_only(np.zeros((rows, columns)))


def unit_matrix(size: int) -> FloatArray:
    """Give a read-only identity matrix; small ones are shared."""
    return _small_unit(size) if size * size <= SHARED_SIZE else read_only(np.eye(size))


def is_complex(matrix: Matrix) -> bool:
    """Tell whether a checked matrix has imaginary parts."""
    return matrix.dtype != REAL


def is_zero(matrix: Matrix) -> bool:
    """Tell whether all entries are zero, at once for the zeros that `zero_matrix` shares."""
    shared = matrix.size <= SHARED_SIZE and matrix is _small_zeros(*matrix.shape)
    return shared or not matrix.any()


def _numbers(value: object, letter: str) -> Matrix:
    if hasattr(value, "toarray") and hasattr(value, "nnz"):
        value = _dense(value, letter)
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        msg = f"{letter} has masked entries, which have no value. Fill them first."
        raise MatrixError(msg, matrix=letter)
    try:
        array = np.array(value)
        if array.dtype == REAL:
            return array
        if array.dtype.kind in "biufO":
            return array.astype(np.float64)
        if array.dtype.kind == "c":
            return array.astype(np.complex128) if array.imag.any() else array.real.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as cause:
        msg = f"{letter} is not a matrix of numbers: {cause}."
        raise MatrixError(msg, matrix=letter) from cause
    msg = f"{letter} holds entries of type {array.dtype} where numbers are needed. Convert them first."
    raise MatrixError(msg, matrix=letter)


def _dense(value: object, letter: str) -> object:
    rows = value.shape[0]  # type: ignore[attr-defined]
    if rows > DENSE_ROW_LIMIT:
        msg = (
            f"{letter} is sparse with {rows} rows; models are held dense here, up to {DENSE_ROW_LIMIT} rows. "
            "Reduce the model first."
        )
        raise MatrixError(msg, matrix=letter)
    return value.toarray()  # type: ignore[attr-defined]


def _as_row_or_column(array: Matrix, shape: tuple[int, int]) -> Matrix:
    if 1 in shape and array.size == shape[0] * shape[1]:
        return array.reshape(shape)
    return array


def read_only(array: Matrix) -> Matrix:
    """Lock an array of our own against writing and give it back."""
    array.setflags(write=False)
    return array


@lru_cache(maxsize=256)
def _small_zeros(rows: int, columns: int) -> FloatArray:
    return read_only(np.zeros((rows, columns)))


@lru_cache(maxsize=64)
def _small_unit(size: int) -> FloatArray:
    return read_only(np.eye(size))
