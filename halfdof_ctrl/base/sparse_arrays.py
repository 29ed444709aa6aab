"""Checked, read-only sparse matrices: compressed columns, sorted, without stored zeros.

A column is null exactly where it stores nothing, which the partition reads. Every matrix of a sparse model is of this
kind, its inputs and outputs included.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, cast

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, eye_array, issparse

from halfdof_ctrl.base.arrays import (
    MATRIX_DIMENSIONS,
    PLAIN_TYPES,
    REAL,
    FloatArray,
    Matrix,
    ModelMatrix,
    checked_matrix,
    read_only,
    require_range,
    require_shape,
    unit_matrix,
    without_short_forms,
    zero_matrix,
)
from halfdof_ctrl.base.errors import MatrixError

if TYPE_CHECKING:
    from typing_extensions import TypeIs  # for the type checker alone, which brings it; in typing from Python 3.13 on

SparseMatrix: TypeAlias = csc_array
IndexArray: TypeAlias = npt.NDArray[np.intp]


class SparseLike(Protocol):
    """A sparse array or matrix of scipy, in any format."""

    @property
    def shape(self) -> tuple[int, ...]: ...  # noqa: D102
    @property
    def nnz(self) -> int: ...  # noqa: D102
    def toarray(self) -> npt.NDArray[Any]: ...  # noqa: D102


MatrixLike: TypeAlias = npt.ArrayLike | SparseLike
MOST_STORED = 2**31 - 1  #: entries of a sparse matrix, which are counted in 32 bits by the factorization


def has_sparse(values: Sequence[object]) -> bool:
    """Return whether one of the values is a scipy sparse array or matrix."""
    return not PLAIN_TYPES.issuperset(map(type, values)) and any(issparse(value) for value in values)


def checked_sparse_matrix(value: object, letter: str, shape: tuple[int, int] | None = None) -> SparseMatrix:
    """Copy a value into read-only compressed columns of finite numbers.

    Parameters
    ----------
    value : scipy sparse array or matrix of any format, or array_like
        Two-dimensional, or one-dimensional where `shape` shows a single row or column. Stored duplicates are added up.
    letter : str
        The matrix's letter.
    shape : (int, int), optional
        The shape that it must have; without it, it must be square.

    Returns
    -------
    csc_array
        float64, or complex128 where an imaginary part is nonzero.

    Raises
    ------
    MatrixError
        As `arrays.checked_matrix`, or indices that lie outside the matrix.
    """
    if not issparse(value):
        return _locked(csc_array(checked_matrix(value, letter, shape)))
    given: Any = value
    if given.ndim != MATRIX_DIMENSIONS and shape is not None and 1 in shape and given.shape == (max(shape),):
        given = given.reshape(shape)
    require_shape(given.shape, letter, shape)
    if given.dtype.kind not in "biufc":
        msg = f"{letter} holds entries of type {given.dtype} where numbers are needed. Convert them first."
        raise MatrixError(msg, matrix=letter)
    if given.nnz > MOST_STORED:
        msg = f"{letter} stores {given.nnz} entries, and at most {MOST_STORED} can be factorized. Use a coarser mesh."
        raise MatrixError(msg, matrix=letter)
    try:
        if hasattr(given, "check_format"):
            given.check_format(full_check=True)
        matrix = csc_array(given, copy=True)
        matrix.sum_duplicates()
    except (ValueError, IndexError) as cause:
        msg = f"{letter} is no sound sparse matrix: {cause}. Assemble it anew."
        raise MatrixError(msg, matrix=letter) from cause
    if not np.isfinite(matrix.data).all():
        place = int(np.flatnonzero(~np.isfinite(matrix.data))[0])
        row, column = int(matrix.indices[place]), int(np.searchsorted(matrix.indptr, place, side="right")) - 1
        msg = f"{letter}[{row}, {column}] is {matrix.data[place]}: every entry must be a finite number."
        raise MatrixError(msg, matrix=letter)
    if matrix.dtype.kind == "c" and not matrix.data.imag.any():
        matrix = matrix.real
    return _locked(matrix.astype(np.complex128 if matrix.dtype.kind == "c" else REAL, copy=False))


def checked_sparse_squares(values: Sequence[object], letters: str, rows: str = "DOFs") -> list[SparseMatrix]:
    """Copy square matrices of one size, of which some are sparse, into sparse ones; None becomes zeros.

    Numbers and vectors stand for what they do in `arrays.without_short_forms`.

    Raises
    ------
    MatrixError
        As in `checked_sparse_matrix`.
    """
    shape = next(np.shape(cast("Any", value)) for value in values if issparse(value))
    require_shape(shape, next(letter for letter, value in zip(letters, values, strict=True) if issparse(value)), None)
    matrices = [
        sparse_zeros(*shape) if value is None else checked_sparse_matrix(_square(value), letter, (shape[0], shape[1]))
        for letter, value in zip(letters, without_short_forms(values, letters, rows=rows), strict=True)
    ]
    for letter, matrix in zip(letters, matrices, strict=True):
        require_range(letter, largest_by_row_and_column(matrix)[1], np.abs(matrix.data))
    return matrices


def _square(value: object) -> object:
    """Make the matrix that a vector of `without_short_forms` stands for."""
    return diags_array(value) if isinstance(value, np.ndarray) and value.ndim == 1 else value


def sparse_zeros(rows: int, columns: int) -> SparseMatrix:
    """Return a read-only sparse matrix without entries."""
    return _locked(csc_array((rows, columns)))


def sparse_unit(size: int) -> SparseMatrix:
    """Return a read-only sparse identity matrix."""
    return _locked(csc_array(eye_array(size, format="csc")))


def zeros_like(pattern: Matrix, rows: int, columns: int) -> ModelMatrix:
    """Return zeros, dense or sparse as `pattern` is."""
    return sparse_zeros(rows, columns) if is_sparse(pattern) else zero_matrix(rows, columns)


def unit_like(pattern: Matrix, size: int) -> ModelMatrix:
    """Return an identity matrix, dense or sparse as `pattern` is."""
    return sparse_unit(size) if is_sparse(pattern) else unit_matrix(size)


def is_sparse(matrix: object) -> "TypeIs[SparseMatrix]":
    """Return whether a matrix of a model is sparse."""
    return type(matrix) is not np.ndarray and isinstance(matrix, csc_array)  # the first at once


def as_sparse(matrix: Matrix) -> SparseMatrix:
    """Return a matrix of a model as compressed columns, which those of a sparse model are."""
    return matrix if is_sparse(matrix) else csc_array(matrix)


def picked_beside(parts: Sequence[ModelMatrix], picked: Sequence[int]) -> ModelMatrix:
    """Return the picked columns of matrices that stand side by side, all dense or all sparse."""
    if not is_sparse(parts[0]):
        return read_only(np.hstack(parts)[:, picked])
    return _locked(csc_array(as_sparse(joined_sparse([parts]))[:, list(picked)]))


def picked_below(parts: Sequence[ModelMatrix], picked: Sequence[int]) -> ModelMatrix:
    """Return the picked rows of matrices that stand one below the other, all dense or all sparse."""
    if not is_sparse(parts[0]):
        return read_only(np.vstack(parts)[picked])
    stack = csr_array(as_sparse(joined_sparse([[part] for part in parts])))
    return _locked(csc_array(stack[list(picked)]))


def joined_sparse(blocks: Sequence[Sequence[Matrix]]) -> SparseMatrix:
    """Join blocks, dense or sparse, to one sparse matrix, complex only where there are imaginary parts."""
    columns = [
        np.concatenate([[0], np.cumsum([block.shape[1] for block in row])]) for row in blocks
    ]  # empty blocks, which block_array does not take, add nothing but their size
    rows = np.concatenate([[0], np.cumsum([row[0].shape[0] for row in blocks])])
    entries = [
        (part.data, part.row + rows[i], part.col + columns[i][j])
        for i, row in enumerate(blocks)
        for j, part in enumerate([coo_array(block) for block in row])
    ]
    data, row, column = (np.concatenate([entry[k] for entry in entries]) for k in range(3))
    whole = csc_array(coo_array((data, (row, column)), shape=(int(rows[-1]), int(columns[0][-1]))))
    if whole.dtype.kind == "c" and not whole.data.imag.any():
        whole = whole.real
    return _locked(whole)


def unit_columns(matrices: Sequence[Matrix]) -> list[tuple[int, int] | None]:
    """Find for each column which of the matrices holds its only entry and in which row, if that is 1."""
    parts = [as_sparse(matrix) for matrix in matrices]
    lengths = np.array([np.diff(part.indptr) for part in parts])
    single = lengths.sum(axis=0) == 1
    found: list[tuple[int, int] | None] = [None] * single.size
    for which, part in enumerate(parts):
        for column in np.flatnonzero(single & (lengths[which] == 1)).tolist():
            place = part.indptr[column]
            if part.data[place] == 1.0:
                found[column] = which, int(part.indices[place])
    return found


def filled_rows(matrices: Sequence[Matrix]) -> list[bool]:
    """Return which rows have an entry in any of the matrices."""
    filled = np.zeros(matrices[0].shape[0], dtype=bool)
    for matrix in matrices:
        filled[as_sparse(matrix).indices] = True
    return filled.tolist()


def transposed(matrix: Matrix) -> SparseMatrix:
    """Return the transpose of a sparse matrix in compressed columns."""
    return csc_array(as_sparse(matrix).T)


def column_of_entries(matrix: SparseMatrix) -> IndexArray:
    """Return the column of each stored entry."""
    return np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))


def largest_by_row_and_column(matrix: SparseMatrix) -> tuple[FloatArray, FloatArray]:
    """Return the size of the largest entry of each row and of each column, zero where there is none."""
    size = np.abs(matrix.data)
    by_row, by_column = np.zeros(matrix.shape[0]), np.zeros(matrix.shape[1])
    np.maximum.at(by_row, matrix.indices, size)
    filled = np.flatnonzero(np.diff(matrix.indptr))
    if filled.size:
        by_column[filled] = np.maximum.reduceat(size, matrix.indptr[filled])
    return by_row, by_column


def locked(matrix: Matrix) -> ModelMatrix:
    """Lock a matrix of our own, dense or sparse, against writing."""
    return _locked(csc_array(matrix, copy=True)) if issparse(matrix) else read_only(matrix)


def _locked(matrix: SparseMatrix) -> SparseMatrix:
    """Bring into order, drop stored zeros, and lock against writing."""
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    for part in (matrix.data, matrix.indices, matrix.indptr):
        part.setflags(write=False)
    return matrix
