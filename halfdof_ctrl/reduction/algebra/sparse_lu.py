"""One sparse factorization of a real matrix, for solutions with the matrix and with its transpose.

The matrix is scaled by powers of two. Where its pattern is nearly symmetric, SuperLU (X. S. Li, 2005) orders it
by minimum degree of ``W + W^T`` and takes its pivots from the diagonal, which leaves the fewest entries in the
factors; that is as stable as elimination without pivoting is for the matrix at hand, for a stiffness very. What a test
solution loses tells: where it is more than rounding, solutions are corrected once, and where it is much, pivots
are chosen more strictly, in the end by columns with partial pivoting. They are corrected too where W is so ill
conditioned, as that of a slender structure is, that digits of the result are at stake: the residual is summed in
extended precision, which brings back what the condition takes (N. J. Higham, 2002, chapter 12).

What is factorized is the transpose, because the reduction solves with it, and SuperLU works many right-hand sides
side by side for the matrix that it was given, but not for the transpose of that. Its small dense blocks gain nothing
from several threads and may lose all by waiting for them: call it within ``threads.limited_threads(1)``.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import LinearOperator, onenormest

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.base.sparse_arrays import SparseMatrix
from halfdof_ctrl.base.sparse_factors import PIVOTINGS, SYMMETRIC_SHARE, sparse_lu
from halfdof_ctrl.base.sparse_products import exact_residual, times
from halfdof_ctrl.reduction.algebra.leading_matrix import LeadingMatrix
from halfdof_ctrl.reduction.algebra.scaling import ROUGHLY_SETTLED, Scaling, log_scaling, max_scaling

REFINED = 2.0**-46  #: componentwise backward error of the test solution above which solutions are corrected once
ILL_CONDITIONED = 2.0**-24  #: reciprocal condition number below which solutions are corrected once
UNSAFE = 1e-8  #: componentwise backward error of the test solution that calls for partial pivoting
SINGULAR_SPARSE_RCOND = 16 * EPS  #: reciprocal condition number of a singular W; n eps for n below 16
NUDGE = 2.0**-40  #: times the scaled matrix: what is added to find a null vector
DOUBTFUL_RCOND = 1e-6  #: reciprocal condition number below which another scaling is tried ...
FEW_ROWS = 200  #: ... of a matrix of up to so many rows
NULL_STEPS = 3  #: of inverse iteration for a null vector


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SparseLU:
    """A real n x n matrix W, scaled and factorized.

    Solutions are those of ``diag(rows) W``: who scales the equations by `rows` need not scale them back.
    """

    scaled: SparseMatrix  #: diag(rows) W diag(columns)
    rows: FloatArray  #: (n,) powers of two
    columns: FloatArray  #: (n,) likewise
    factors: Any  #: SuperLU of the transpose of `scaled`; None where a pivot vanished
    corrected: bool  #: whether solutions are corrected once
    rcond: float  #: reciprocal 1-norm condition number of `scaled`, estimated; 0 if a pivot vanished

    @classmethod
    def factorized(cls, matrix: SparseMatrix) -> "SparseLU":
        """Scale, factorize and estimate the condition.

        Even maxima may leave a matrix badly scaled still: one that looks singular is scaled by the means of the
        logarithms of its entries, which does not depend on units, and judged again; a small one that looks ill
        conditioned is scaled as the dense leading matrix is.
        """
        first = cls._scaled(matrix, max_scaling(matrix))
        if matrix.shape[0] <= FEW_ROWS and first.rcond < DOUBTFUL_RCOND:
            best = LeadingMatrix.factorized(matrix.toarray())
            if best.rows is not None and best.columns is not None:
                return _better(first, cls._scaled(matrix, Scaling(best.rows, best.columns)))
        if not first.is_singular:
            return first
        return _better(first, cls._scaled(matrix, log_scaling(matrix, ROUGHLY_SETTLED, powers_of_two=True)))

    @classmethod
    def _scaled(cls, matrix: SparseMatrix, scaling: Scaling) -> "SparseLU":
        scaled = scaling.of_sparse(matrix)
        factors, corrected = _factorized(csc_array(scaled.T))
        rcond = 0.0 if factors is None else _reciprocal_condition(scaled, factors)
        corrected = corrected or 0.0 < rcond < ILL_CONDITIONED
        rows, columns = scaling
        return cls(scaled=scaled, rows=rows, columns=columns, factors=factors, corrected=corrected, rcond=rcond)

    @property
    def is_singular(self) -> bool:
        """Whether W is singular to working precision."""
        return self.rcond < min(self.rows.size * EPS, SINGULAR_SPARSE_RCOND)

    def solve(self, right: FloatArray) -> FloatArray:
        """Return ``W^-1 diag(rows)^-1 right`` for an (n, k) array, k small."""
        solution = self._solved(right, "T")
        solution *= self.columns[:, None]
        return solution

    def solve_transposed(self, right: FloatArray) -> FloatArray:
        """Return ``diag(rows)^-1 W^-T right`` for an (n, k) array, k small, which is overwritten.

        Where solutions are corrected, in extended precision: products in which terms cancel keep their digits.
        """
        right *= self.columns[:, None]
        return self._solved(right, "N")

    def column_sizes(self, solution: FloatArray) -> FloatArray:
        """Return the largest entry of each column of what `solve` gave, in the units in which W is even."""
        return largest_of_columns(solution / self.columns[:, None])

    def null_vector(self) -> FloatArray:
        """Return a vector that the scaled matrix, if it is singular, makes zero, its largest entry one.

        By inverse iteration on the matrix with a diagonal of some 1e-12 added, which is singular in no case.
        """
        generator = np.random.default_rng(0)
        nudge = diags_array(NUDGE * generator.uniform(1.0, 2.0, self.rows.size))
        factors = sparse_lu(csc_array(self.scaled.T + nudge), *PIVOTINGS[-1])
        vector = generator.standard_normal(self.rows.size)
        for _ in range(NULL_STEPS):
            vector = factors.solve(vector)
            vector = factors.solve(vector / np.abs(vector).max(), trans="T")
            vector = vector / np.abs(vector).max()
        return np.asarray(vector)

    def _solved(self, right: FloatArray, transposed: str) -> FloatArray:
        solution = self.factors.solve(right, trans=transposed)
        if not self.corrected:
            return np.asarray(solution)
        rest = exact_residual(self.scaled, right, solution, transposed=transposed == "N")
        correction = self.factors.solve(rest, trans=transposed)
        return np.asarray(solution + correction.astype(np.longdouble if transposed == "N" else float))


def _better(one: SparseLU, other: SparseLU) -> SparseLU:
    return other if other.rcond > one.rcond else one


def largest_of_columns(matrix: FloatArray) -> FloatArray:
    """Return the size of the largest entry of each column."""
    return np.asarray(np.maximum(matrix.max(axis=0, initial=0.0), -matrix.min(axis=0, initial=0.0)))


def is_nearly_symmetric(matrix: SparseMatrix) -> bool:
    """Return whether most entries have a partner across the diagonal."""
    pattern = csc_array((np.ones(matrix.nnz, dtype=np.int8), matrix.indices, matrix.indptr), shape=matrix.shape)
    return bool(pattern.multiply(pattern.T).nnz >= SYMMETRIC_SHARE * pattern.nnz)


def _factorized(matrix: SparseMatrix) -> tuple[Any, bool]:
    """Factorize in the first way whose test solution is good, and tell whether solutions need a correction."""
    test = np.random.default_rng(0).uniform(1.0, 2.0, matrix.shape[0])
    size = csc_array((np.abs(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
    for ordering, threshold in PIVOTINGS if is_nearly_symmetric(matrix) else PIVOTINGS[-1:]:
        try:
            factors = sparse_lu(matrix, ordering, threshold)
        except RuntimeError:  # a column vanishes
            return None, False
        solution = factors.solve(test)
        bound = times(size, np.abs(solution)) + test
        error = float((np.abs(test - times(matrix, solution)) / bound).max())
        if error <= UNSAFE:
            return factors, error > REFINED
    return factors, True


def _reciprocal_condition(scaled: SparseMatrix, factors: Any) -> float:  # noqa: ANN401  # SuperLU has no public type
    """Estimate the reciprocal 1-norm condition number.

    By the iteration of N. J. Higham and F. Tisseur (2000) with one column, and, as LAPACK does, by a vector of rising
    size and alternating sign: what is nearly singular by cancellation may be invisible to the constant vector with
    which the iteration begins.
    """
    n = scaled.shape[0]
    inverse = LinearOperator(
        scaled.shape,
        matvec=lambda vector: factors.solve(vector.ravel(), trans="T"),
        rmatvec=lambda vector: factors.solve(vector.ravel()),
        dtype=np.float64,
    )
    alternating = (-1.0) ** np.arange(n) * (1.0 + np.arange(n) / max(n - 1, 1))
    with np.errstate(all="ignore"):
        second = 2.0 * float(np.abs(factors.solve(alternating, trans="T")).sum()) / (3.0 * n)
        largest = float(abs(scaled).sum(axis=0).max()) * max(float(onenormest(inverse, t=1)), second)
    return 1.0 / largest if np.isfinite(largest) and largest > 0.0 else 0.0
