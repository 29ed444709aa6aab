"""The leading matrix W of equation (2), factorized once."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg.lapack import dgecon, dgetrf, dgetrs, dlange

from halfdof_ctrl.arrays import FloatArray
from halfdof_ctrl.scaling import equilibrating_factors

PLAINLY_REGULAR = 1e-6  #: W with this reciprocal condition number is nonsingular in any units
SINGULAR = float(np.finfo(float).eps)  #: times n: W is singular below this reciprocal condition number


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LeadingMatrix:
    """W of equation (2), factorized; equilibrated by powers of two where its condition asks for it."""

    factors: FloatArray  #: (n, n) L and U
    pivots: npt.NDArray[np.int32]
    rows: FloatArray | None  #: (n,) powers of two, None where W was taken as it is
    columns: FloatArray | None  #: (n,) likewise
    equilibrated: FloatArray | None  #: (n, n) what was factorized, kept where solutions are to be refined
    rcond: float  #: reciprocal 1-norm condition number of the matrix that was factorized; 0 if exactly singular

    @classmethod
    def factorized(cls, W: FloatArray) -> "LeadingMatrix":
        """Factorize and estimate the condition; equilibrate first where that might matter.

        The equilibrated matrix is conditioned at least about as well (A. van der Sluis, 1969), so a W that is well
        conditioned as it stands needs no second look.
        """
        factors, pivots, rcond = _lu_and_rcond(W)
        if rcond >= PLAINLY_REGULAR:
            return cls(factors=factors, pivots=pivots, rows=None, columns=None, equilibrated=None, rcond=rcond)
        rows, columns = equilibrating_factors(W)
        matrix = W * rows[:, None] * columns
        factors, pivots, rcond = _lu_and_rcond(matrix)
        return cls(factors=factors, pivots=pivots, rows=rows, columns=columns, equilibrated=matrix, rcond=rcond)

    @property
    def is_singular(self) -> bool:
        """Whether W is singular to working precision: rcond below n eps."""
        return self.rcond < len(self.factors) * SINGULAR

    def singular_values(self) -> FloatArray:
        """Give the singular values of the matrix that was factorized."""
        L, U = np.tril(self.factors, -1) + np.eye(len(self.factors)), np.triu(self.factors)
        return np.asarray(scipy.linalg.svdvals(L @ U))

    def elimination_size(self) -> FloatArray:
        """Give ``|L| |U|`` in the rows and units of W: what rounding errors of the elimination are relative to."""
        L, U = np.tril(np.abs(self.factors), -1) + np.eye(len(self.factors)), np.triu(np.abs(self.factors))
        order = np.arange(len(self.factors))
        for i, j in enumerate(self.pivots.tolist()):
            order[[i, j]] = order[[j, i]]
        size = np.empty_like(L)
        size[order] = L @ U
        if self.rows is not None and self.columns is not None:
            size = size / self.rows[:, None] / self.columns
        return size

    def solve(self, right: FloatArray) -> FloatArray:
        """Give ``W^-1 right`` for an (n, k) array, refined once where W was equilibrated."""
        if self.rows is None or self.columns is None or self.equilibrated is None:
            return np.asarray(dgetrs(self.factors, self.pivots, right)[0])
        right = right * self.rows[:, None]
        solution = dgetrs(self.factors, self.pivots, right)[0]
        solution += dgetrs(self.factors, self.pivots, right - self.equilibrated @ solution)[0]
        return np.asarray(solution * self.columns[:, None])


def _lu_and_rcond(matrix: FloatArray) -> tuple[FloatArray, npt.NDArray[np.int32], float]:
    """Factorize and estimate the reciprocal 1-norm condition number, 0 where a pivot vanishes."""
    norm = dlange("1", matrix)  # type: ignore[call-arg]  # the stubs lack its first argument
    factors, pivots, exact_zero = dgetrf(matrix)
    return factors, pivots, 0.0 if exact_zero else float(dgecon(factors, norm)[0])
