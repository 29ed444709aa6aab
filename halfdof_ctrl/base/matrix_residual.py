"""Products and residuals of real matrices in about twice the working precision, the same on every platform."""

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, csr_array

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.double_double import two_sum
from halfdof_ctrl.base.exact_products import SlicedMatrix
from halfdof_ctrl.base.sparse_arrays import is_sparse

COLUMNS_TOGETHER = 32  #: of a right-hand side that a sparse matrix multiplies: their sums stay near the processor
FEW_ENTRIES = 0.05  #: a matrix with a smaller share of entries that are not zero is multiplied as a sparse one


def sliced(matrix: FloatArray) -> SlicedMatrix:
    """Cut a dense matrix for `exact_residual` and `exact_product`, as a sparse one where few entries are not zero."""
    return SlicedMatrix.of(by_columns(matrix) if has_few_entries(matrix) else matrix)


def by_columns(matrix: FloatArray) -> csc_array:
    """Return the sparse copy of a dense matrix, reading it in the order in which it lies in memory."""
    return csr_array(matrix.T).T if matrix.flags.f_contiguous else csc_array(matrix)


def has_few_entries(matrix: npt.NDArray[np.generic]) -> bool:
    """Return whether a dense matrix has so few entries that it is multiplied faster as a sparse one."""
    return bool(np.count_nonzero(matrix) <= FEW_ENTRIES * matrix.size)


def exact_residual(target: FloatArray, left: FloatArray | SlicedMatrix, right: FloatArray) -> FloatArray:
    """Return ``target - left @ right``, rounded once where the terms do not cancel beyond twice the precision.

    Parameters
    ----------
    target : (n, m) ndarray
    left : (n, k) ndarray or SlicedMatrix
    right : (k, m) ndarray

    Returns
    -------
    (n, m) ndarray
        With an error of about k 2^-97 of the product of the largest entries of the row of `left` and the column of
        `right`, and one rounding.

    Examples
    --------
    >>> third = np.array([[1.0 / 3.0]])
    >>> float(exact_residual(np.array([[1.0]]), third, np.array([[3.0]]))[0, 0]) == 2.0**-54
    True
    """
    cut = left if isinstance(left, SlicedMatrix) else sliced(left)
    if not is_sparse(cut.first) or target.shape[1] <= COLUMNS_TOGETHER:
        return _residual(target, cut, right)
    rest = np.empty_like(target, dtype=np.float64)
    for start in range(0, target.shape[1], COLUMNS_TOGETHER):
        columns = slice(start, start + COLUMNS_TOGETHER)
        rest[:, columns] = _residual(target[:, columns], cut, right[:, columns])
    return rest


def _residual(target: FloatArray, left: SlicedMatrix, right: FloatArray) -> FloatArray:
    total, error = np.array(target, dtype=float), np.zeros(target.shape)
    for part in left.times(right):
        total, lost = two_sum(total, -part)
        error += lost
    return np.asarray(total + error)


def exact_product(left: FloatArray | SlicedMatrix, right: FloatArray) -> FloatArray:
    """Return ``left @ right`` for (n, k) and (k, m), summed in twice the precision and rounded once.

    Examples
    --------
    >>> exact_product(np.array([[1.0, 2.0**70, -(2.0**70)]]), np.ones((3, 1))).tolist()
    [[1.0]]
    """
    rows = (left.first if isinstance(left, SlicedMatrix) else left).shape[0]
    return -exact_residual(np.zeros((rows, right.shape[1])), left, right)
