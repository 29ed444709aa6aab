"""Products with sparse matrices, and residuals that keep the digits which cancel."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, csr_array

from halfdof_ctrl.base.arrays import DenseMatrix
from halfdof_ctrl.base.sparse_arrays import IndexArray, SparseMatrix

EXTENDED = 2**20  #: entries of a matrix that are copied in extended precision at a time


@dataclass(frozen=True, slots=True, eq=False)
class Transposed:
    """The transpose of a sparse matrix with few filled rows, ready to be multiplied."""

    rows: IndexArray | None  #: filled rows of the matrix, None for all
    part: csr_array  #: transpose of these

    @classmethod
    def of(cls, matrix: SparseMatrix) -> "Transposed":
        """Prepare the transpose of a matrix."""
        rows = np.unique(matrix.indices).astype(np.intp)
        if rows.size > matrix.shape[0] // 2:
            return cls(None, csr_array(matrix.T))
        return cls(rows, csr_array(matrix.T[:, rows]))

    def times(self, dense: DenseMatrix) -> DenseMatrix:
        """Multiply with a dense matrix."""
        return np.asarray(self.part @ (dense if self.rows is None else dense[self.rows]))


def times(matrix: SparseMatrix, dense: DenseMatrix) -> DenseMatrix:
    """Multiply a sparse and a dense matrix."""
    return np.asarray(matrix @ dense)


def exact_residual(
    matrix: SparseMatrix, right: DenseMatrix, solution: DenseMatrix, *, transposed: bool = False
) -> DenseMatrix:
    """Return ``right - matrix solution``, summed in extended precision and rounded once.

    Some columns of the matrix are worked at a time, so that it is not copied in that precision. Where a long double is
    a double (Windows, ARM), this is the plain residual.

    Examples
    --------
    >>> exact_residual(csc_array([[3.0]]), np.array([[1.0]]), np.array([[2.0]])).tolist()
    [[-5.0]]
    """
    rest = np.array(right, dtype=np.longdouble)
    wide = solution.astype(np.longdouble)
    start = 0
    while start < matrix.shape[1]:
        room = matrix.indptr[start] + EXTENDED
        stop = max(start + 1, int(np.searchsorted(matrix.indptr, room, side="right")) - 1)
        part = slice(matrix.indptr[start], matrix.indptr[stop])
        columns = csc_array(
            (
                matrix.data[part].astype(np.longdouble),
                matrix.indices[part],
                matrix.indptr[start : stop + 1] - matrix.indptr[start],
            ),
            shape=(matrix.shape[0], stop - start),
        )
        if transposed:
            rest[start:stop] -= np.asarray(columns.T @ wide)
        else:
            rest -= np.asarray(columns @ wide[start:stop])
        start = stop
    return rest.astype(float)
