"""Checked, read-only dense matrices: the one place where shapes and entries are tested (sparse: `sparse_arrays`)."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, TypeAlias
from weakref import WeakValueDictionary

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, issparse

from halfdof_ctrl.base.errors import MatrixError

EPS = float(np.finfo(float).eps)  #: spacing of floating-point numbers at one
UNIT_ROUNDOFF = EPS / 2.0  #: relative error of rounding to the nearest number
IndexArray: TypeAlias = npt.NDArray[np.intp]
FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
DenseMatrix: TypeAlias = npt.NDArray[Any]  #: float64 or complex128, as checked_matrix gives it
Matrix: TypeAlias = DenseMatrix | csc_array  #: either kind; `as_dense`, `as_sparse` and `is_sparse` tell which
#: What a model holds: arrays, or csc_array in a sparse model. `Any` stands for the latter, so that who knows the model
#: to be dense, users above all, need not narrow each matrix; a function that takes either kind says `Matrix`.
ModelMatrix: TypeAlias = DenseMatrix | Any
DENSE_ROW_LIMIT = 5000  #: larger sparse matrices are refused rather than expanded (200 MB each)
LARGEST_DENSE_COPY = 2000  #: DOFs up to which a sparse model is copied dense for what works on dense matrices alone
MATRIX_DIMENSIONS = 2
REAL = np.dtype(np.float64)
PLAIN_TYPES = frozenset({list, tuple, np.ndarray})  #: types that np.array copies without losing a mask or a pattern
FEW_NUMBERS = 64  #: of matrices, up to which they are looked at as plain numbers
SMALLEST_SIZE = 1e-152  #: of the largest entry of a column, so that the product of two has no underflow
LARGEST_SIZE = 1e154  #: of an entry, so that the product of two does not overflow
SIGNAL_SIZES = (1e-200, 1e200)  #: the same of B, F and D, which enter a product but once
SMALLEST_NORMAL = float(np.finfo(float).tiny)  #: below it numbers have fewer digits
EVEN_ENTRIES = 1e5  #: ratio of the largest to the smallest entry of a matrix up to which they are of similar sizes
FEW_COMPARED = 400  #: of a matrix, up to which they are compared as plain numbers, which takes a microsecond
LARGEST_EXPONENT = 1023  #: of a power of two
SHARED_SIZE = 1024  #: constant matrices up to this many entries are made once, larger ones as long as one is in use


def checked_matrix(value: object, letter: str, shape: tuple[int, int] | None = None) -> DenseMatrix:
    """Copy a value into a read-only matrix of finite numbers.

    Parameters
    ----------
    value : array_like or scipy sparse array
        Two-dimensional, or one-dimensional where `shape` shows a single row or column, or a number where it shows one.
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
    if shape is not None and array.ndim < MATRIX_DIMENSIONS:
        array = _as_row_or_column(array, shape)
    require_shape(array.shape, letter, shape)
    if not np.logical_and.reduce(np.isfinite(array), axis=None):
        row, column = (int(index) for index in np.argwhere(~np.isfinite(array))[0])
        msg = f"{letter}[{row}, {column}] is {array[row, column]}: every entry must be a finite number."
        raise MatrixError(msg, matrix=letter)
    return read_only(array)


def require_shape(found: tuple[int, ...], letter: str, shape: tuple[int, int] | None) -> None:
    """Refuse a matrix that is not square, or not of the given shape, or empty.

    Raises
    ------
    MatrixError
        It is one of these.
    """
    if len(found) != MATRIX_DIMENSIONS or (found != shape if shape is not None else found[0] != found[1]):
        expected = "square" if shape is None else f"{shape[0]} x {shape[1]}"
        size = " x ".join(map(str, found)) or "a single number"
        msg = f"{letter} must be {expected}, but it is {size}. Check its rows and columns against the DOFs and signals."
        raise MatrixError(msg, matrix=letter)
    if 0 in found:
        msg = f"{letter} is empty: a model needs at least one DOF, one input and one output."
        raise MatrixError(msg, matrix=letter)


def checked_square_matrices(values: Sequence[object], letters: str, rows: str = "DOFs") -> list[DenseMatrix]:
    """Copy square matrices of one size into read-only ones, as `checked_matrix` does; None becomes zeros.

    A vector is a diagonal matrix, the number 0 a matrix of zeros, and any number a matrix where there is but one row.

    Raises
    ------
    MatrixError
        As in `checked_matrix`, or all are None.
    """
    if PLAIN_TYPES.issuperset(map(type, values)):
        together = _stacked(values)
        if together is not None:
            return together
    size: tuple[int, int] | None = None
    checked: list[DenseMatrix | None] = []
    for letter, value in zip(letters, without_short_forms(values, letters, rows=rows), strict=True):
        checked.append(None if value is None else checked_matrix(full_square(value), letter, size))
        if size is None and checked[-1] is not None:
            size = (checked[-1].shape[0], checked[-1].shape[1])
        if checked[-1] is not None:
            sizes = np.abs(checked[-1])
            require_range(letter, sizes.max(axis=0), sizes)
    size = size or (1, 1)  # nothing but the number 0
    return [zero_matrix(*size) if matrix is None else matrix for matrix in checked]


def require_range(
    letter: str,
    largest: FloatArray,
    sizes: FloatArray,
    line: str = "column",
    limits: tuple[float, float] = (SMALLEST_SIZE, LARGEST_SIZE),
) -> None:
    """Refuse numbers of which products overflow or vanish.

    Parameters
    ----------
    letter : str
        Of the matrix.
    largest : (k,) ndarray
        Size of the largest entry of each column, or row. Entries that are small beside it do no harm, unless they are
        subnormal.
    sizes : ndarray
        Sizes of all entries, of any shape.
    line : str
        What it is of.
    limits : (float, float)
        The smallest and the largest size.

    Raises
    ------
    MatrixError
        One is above the largest size, or below the smallest but not zero; or an entry is subnormal.
    """
    least, most = limits
    subnormal = sizes[(sizes > 0.0) & (sizes < SMALLEST_NORMAL)]
    if subnormal.size:
        msg = (
            f"{letter} has an entry of the size {subnormal[0]:.1e}, which is subnormal: it has lost digits, and its "
            "reciprocal overflows. Write what is nothing as 0."
        )
        raise MatrixError(msg, matrix=letter)
    wrong = np.flatnonzero((largest > most) | ((largest < least) & (largest > 0.0)))
    if wrong.size:
        place = int(wrong[0])
        msg = (
            f"The largest entry of {line} {place} of {letter} is {largest[place]:.1e} in size, and products of such "
            f"numbers {'overflow' if largest[place] > 1.0 else 'vanish'}: sizes from {least:.0e} to "
            f"{most:.0e} can be computed with. Choose other units, or write what is nothing as 0."
        )
        raise MatrixError(msg, matrix=letter)


def without_short_forms(
    values: Sequence[object], letters: Sequence[str], size: int | None = None, rows: str = "DOFs"
) -> list[object]:
    """Write numbers and vectors in place of square matrices as the matrices that they stand for.

    Parameters
    ----------
    values : sequence of objects
        Matrices, vectors for diagonal ones, numbers (0 for a matrix of zeros, any where there is one row), None.
    letters : sequence of str
    size : int, optional
        Rows of the matrices; by default those of the first matrix, else of the first vector.
    rows : str
        What the rows are, for the message.

    Returns
    -------
    list
        Matrices as they were given, 1D arrays for diagonal ones, None for None and 0.

    Raises
    ------
    MatrixError
        All are None, a vector of another length, or a number that is not 0 where there are several rows.

    Examples
    --------
    >>> without_short_forms([[2, 0], 0, [[1, 0], [0, 1]]], "MCK")
    [array([2., 0.]), None, [[1, 0], [0, 1]]]
    >>> without_short_forms([2, None, 8], "MCK")
    [array([2.]), None, array([8.])]
    """
    if all([value is None for value in values]):  # noqa: C419  # a list is faster for three
        msg = f"{', '.join(letters)} are all None: a model needs at least one of them."
        raise MatrixError(msg, matrix=letters[-1])
    shapes = [shape_of(value) for value in values]
    sizes = [*(shape[0] for shape in shapes if len(shape) > 1), *(shape[0] for shape in shapes if len(shape) == 1)]
    n = size or next(iter(sizes), 1)
    return [
        value if len(shape) > 1 else _diagonal(value, letter, n, rows)
        for letter, value, shape in zip(letters, values, shapes, strict=True)
    ]


def is_zero_number(value: object) -> bool:
    """Return whether a value is the number 0, of any type; a matrix of zeros is none."""
    if isinstance(value, np.ndarray):
        return value.ndim == 0 and bool(value == 0)
    try:
        return np.isscalar(value) and bool(value == 0)
    except Exception:  # noqa: BLE001  # such as a signalling NaN of `decimal`, which compares with nothing
        return False


def full_square(value: object) -> object:
    """Make the matrix that a vector of `without_short_forms` stands for."""
    return np.diag(value) if isinstance(value, np.ndarray) and value.ndim == 1 else value


def _diagonal(value: object, letter: str, size: int, rows: str) -> object:
    """Read a vector or a number as the diagonal matrix that it stands for; None for None and 0."""
    diagonal = np.zeros(()) if value is None else _numbers(value, letter)
    if diagonal.ndim > 1:  # of an object that tells its shape but as an array
        return value
    if diagonal.ndim == 0 and diagonal == 0:
        return None
    if diagonal.size != size:
        what = "a single number" if diagonal.ndim == 0 else f"a vector of {diagonal.size} numbers"
        msg = (
            f"{letter} is {what}, and there are {size} {rows}. Give a square matrix, or for a diagonal one a vector "
            "with a number for each."
        )
        raise MatrixError(msg, matrix=letter)
    return diagonal.reshape(-1)


def shape_of(value: Any) -> tuple[int, ...]:  # noqa: ANN401  # whatever the user gave
    """Return the shape of what may be a matrix, and that of a matrix without entries for what has none."""
    try:
        shape = np.shape(value)
    except Exception:  # noqa: BLE001  # the object is the user's; that it is no matrix is told by `checked_matrix`
        return (0, 0)
    return shape if isinstance(shape, tuple) else (0, 0)


def zero_matrix(rows: int, columns: int) -> FloatArray:
    """Return a read-only matrix of zeros; those of one shape are shared."""
    if rows * columns <= SHARED_SIZE:
        return _small_zeros(rows, columns)
    shape = rows, columns
    found = _large_zeros.get(shape)
    return _large_zeros.setdefault(shape, read_only(np.zeros(shape))) if found is None else found


def unit_matrix(size: int) -> FloatArray:
    """Return a read-only identity matrix; those of one size are shared."""
    if size * size <= SHARED_SIZE:
        return _small_unit(size)
    found = _large_units.get(size)
    return _large_units.setdefault(size, read_only(np.eye(size))) if found is None else found


def is_unit(matrix: Matrix) -> bool:
    """Return whether a matrix is an identity matrix that `unit_matrix` shares, without looking at its entries."""
    n = matrix.shape[0]
    return matrix is (_small_unit(n) if n * n <= SHARED_SIZE else _large_units.get(n))


def powers_of_two(size: FloatArray) -> FloatArray:
    """Powers of two that bring sizes to between 1/2 and 1, and 1 for a zero."""
    return np.asarray(np.ldexp(1.0, np.minimum(-np.frexp(size)[1], LARGEST_EXPONENT)))


def has_even_entries(matrix: FloatArray) -> bool:
    """Return whether no entry of a matrix but zeros is tiny beside the largest.

    Examples
    --------
    >>> [has_even_entries(np.array([[0.0, 1.0], [entry, -2.0]])) for entry in (-400.0, -1e12)]
    [True, False]
    """
    if matrix.size <= FEW_COMPARED:
        sizes = [abs(entry) for entry in matrix.ravel("K").tolist() if entry]
        return not sizes or max(sizes) <= EVEN_ENTRIES * min(sizes)
    entries = np.abs(matrix[matrix != 0.0])
    return not entries.size or bool(entries.max() <= EVEN_ENTRIES * entries.min())


def is_complex(matrix: Matrix) -> bool:
    """Return whether a checked matrix has imaginary parts."""
    return matrix.dtype is not REAL and matrix.dtype != REAL  # the first at once, for all but loaded arrays


def is_zero(matrix: Matrix, *others: Matrix) -> bool:
    """Return whether all entries are zero, at once for the zeros that `zero_matrix` shares and for sparse matrices.

    Models share zeros of one shape, so that of several matrices few have to be looked at.
    """
    for other in others:
        if other is not matrix and not is_zero(other):
            return False
    if type(matrix) is not np.ndarray and issparse(matrix):
        return bool(matrix.size == 0)  # of stored entries, none of which is zero
    shared = _small_zeros(*matrix.shape) if matrix.size <= SHARED_SIZE else _large_zeros.get(matrix.shape)
    return matrix is shared or not matrix.any()


def _numbers(value: object, letter: str) -> DenseMatrix:
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        msg = f"{letter} has masked entries, which have no value. Fill them first."
        raise MatrixError(msg, matrix=letter)
    try:
        if hasattr(value, "toarray") and hasattr(value, "nnz"):
            value = _dense(value, letter)
        array = np.array(value)
        if array.dtype == REAL:
            return array
        if array.dtype.kind == "O" and any(entry is None or isinstance(entry, str | bytes) for entry in array.flat):
            msg = "it holds text or None"
            raise TypeError(msg)  # noqa: TRY301  # told like the other conversions that fail
        if array.dtype.kind in "biufO":
            return array.astype(np.float64)
        if array.dtype.kind == "c":
            return array.astype(np.complex128) if array.imag.any() else array.real.astype(np.float64)
    except MatrixError:
        raise
    except Exception as cause:
        msg = f"{letter} is not a matrix of numbers: {str(cause).rstrip('.')}."
        raise MatrixError(msg, matrix=letter) from cause
    msg = f"{letter} holds entries of type {array.dtype} where numbers are needed. Convert them first."
    raise MatrixError(msg, matrix=letter)


def _stacked(values: Sequence[object]) -> list[DenseMatrix] | None:
    """Copy real matrices in one piece, which is faster; None if anything about them wants a closer look."""
    try:
        stack = np.array(values)
    except ValueError:  # of different shapes, to be told apart by checked_matrix
        return None
    if stack.dtype != REAL or stack.ndim != 1 + MATRIX_DIMENSIONS or stack.shape[1] != stack.shape[2] or not stack.size:
        return None
    if stack.size <= FEW_NUMBERS:  # plain numbers take a third of the time
        sizes = [abs(entry) for entry in stack.ravel().tolist() if entry]
        fits = not sizes or (min(sizes) >= SMALLEST_SIZE and sum(sizes) <= LARGEST_SIZE)  # a sum with NaN is not
    else:
        size = np.abs(stack)  # whose comparisons with NaN are false
        fits = np.logical_and.reduce((size <= LARGEST_SIZE) & (size >= SMALLEST_SIZE) | (size == 0.0), axis=None)
    if not fits:
        return None
    stack.setflags(write=False)
    return list(stack)


def _dense(value: object, letter: str) -> object:
    rows = value.shape[0]  # type: ignore[attr-defined]
    if rows > DENSE_ROW_LIMIT:
        msg = (
            f"{letter} is sparse with {rows} rows; models are held dense here, up to {DENSE_ROW_LIMIT} rows. "
            "Reduce the model first."
        )
        raise MatrixError(msg, matrix=letter)
    return value.toarray()  # type: ignore[attr-defined]


def _as_row_or_column(array: DenseMatrix, shape: tuple[int, int]) -> DenseMatrix:
    if 1 in shape and array.size == shape[0] * shape[1]:
        return array.reshape(shape)
    return array


def as_dense(matrix: Matrix) -> DenseMatrix:
    """Return a matrix of a model as an array, which those of a dense model are."""
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def read_only(array: DenseMatrix) -> DenseMatrix:
    """Lock an array of our own against writing and give it back."""
    array.setflags(write=False)
    return array


_large_zeros: WeakValueDictionary[tuple[int, int], FloatArray] = WeakValueDictionary()
_large_units: WeakValueDictionary[int, FloatArray] = WeakValueDictionary()


@lru_cache(maxsize=256)
def _small_zeros(rows: int, columns: int) -> FloatArray:
    return read_only(np.zeros((rows, columns)))


@lru_cache(maxsize=64)
def _small_unit(size: int) -> FloatArray:
    return read_only(np.eye(size))
