"""R of ``M_ii = R^T R``, applied as the triangle or the diagonal that it is, and sums of few DOFs as sparse ones."""

import numpy as np
from scipy.sparse import csr_array

from halfdof_ctrl.base.arrays import FloatArray, is_zero
from halfdof_ctrl.base.matrix_residual import has_few_entries
from halfdof_ctrl.reduction.energy.cholesky import inverse, is_diagonal, solved


class MassFactor:
    """An upper triangular R, (n, n)."""

    def __init__(self, R: FloatArray) -> None:
        self.R = R
        self.diagonal: FloatArray | None = np.diagonal(R)[:, None] if is_diagonal(R) else None

    def over(self, rows: FloatArray) -> FloatArray:
        """Return ``rows R^-1``."""
        if self.diagonal is not None:
            return np.asarray(rows / self.diagonal.T)
        return solved(self.R, rows.T, transposed=True).T

    def under(self, columns: FloatArray) -> FloatArray:
        """Return ``R^-T columns``."""
        return solved(self.R, columns, transposed=True) if self.diagonal is None else columns / self.diagonal

    def inverse(self) -> FloatArray:
        """Return ``R^-1``."""
        return inverse(self.R) if self.diagonal is None else np.diag(1.0 / self.diagonal[:, 0])


def product(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Return ``matrix @ right``, at the cost of the entries that are not zero where these are few.

    Examples
    --------
    >>> product(np.eye(2), np.array([[3.0], [4.0]])).tolist()
    [[3.0], [4.0]]
    """
    if is_zero(matrix):
        return np.zeros((matrix.shape[0], right.shape[1]))
    if has_few_entries(matrix):
        return np.asarray(csr_array(matrix) @ right)
    return np.asarray(matrix @ right)
