"""The lowest modes of a symmetric pair K, M of sparse matrices, M possibly singular.

    K phi = omega^2 M phi,    phi^T M phi = 1

By shift-and-invert Lanczos (R. B. Lehoucq, D. C. Sorensen and C. Yang, ARPACK, 1998) with one factorization of K, or of
``K - sigma M`` with sigma < 0 where K is singular. Where few DOFs have mass, the flexibility at these gives the modes
at once: ``M^(1/2) K^-1 M^(1/2)`` restricted to them has the eigenvalues 1 / omega^2.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csc_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.progress import progress
from halfdof_ctrl.base.sparse_arrays import IndexArray, SparseMatrix
from halfdof_ctrl.base.sparse_factors import COLUMNS_AT_A_TIME, PIVOTINGS, sparse_lu
from halfdof_ctrl.base.sparse_products import times
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU
from halfdof_ctrl.reduction.modal.slices import MODES_IN_SLICE, modes_by_slices

FEW_MASSES = 400  #: DOFs with mass up to which all modes are found from the flexibility at them
SOFT = 1e-3  #: of the smallest K_jj / M_jj: the shift where K is singular ...
SOFTER = (1e-12, 1e-10, 1e-8, 1e-6, 1e-3)  #: ... or is not told from singular with that one either
UNSYMMETRIC = 1e-9  #: relative difference between a matrix and its transpose that is no rounding
JUST_ABOVE = 1e-9  #: relative: where modes are counted if one lies at the very frequency
MASSLESS_DIRECTION = 1e-13  #: of the largest eigenvalue of the mass at a few DOFs: directions below have none


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShiftedStiffness:
    """``K - sigma M`` of n DOFs, factorized."""

    K: SparseMatrix
    M: SparseMatrix
    sigma: float  #: 0 where K is regular, else negative [rad^2/s^2]
    factors: SparseLU

    @classmethod
    def factorized(cls, K: SparseMatrix, M: SparseMatrix) -> "ShiftedStiffness | None":
        """Factorize K, or K with some mass where it is singular; None where both are singular."""
        factors = SparseLU.factorized(K)
        if not factors.is_singular:
            return cls(K=K, M=M, sigma=0.0, factors=factors)
        stiffness, mass = np.abs(K.diagonal()), M.diagonal()
        speeds = stiffness[mass > 0.0] / mass[mass > 0.0]
        speeds = speeds[speeds > 0.0]
        slowest = float(speeds.min()) if speeds.size else 1.0
        shifts = [-SOFT * min(slowest, 1.0), *[-part * slowest for part in SOFTER]]
        for sigma in shifts:  # as little mass as makes it regular: much of it would hide the lowest modes from Lanczos
            factors = SparseLU.factorized(csc_array(K - sigma * M))
            if not factors.is_singular:
                return cls(K=K, M=M, sigma=sigma, factors=factors)
        return None

    def solve(self, right: FloatArray) -> FloatArray:
        """Return ``(K - sigma M)^-1 right`` for an (n, k) array; the matrix is symmetric."""
        solution = np.empty_like(right, order="F")
        for start in range(0, right.shape[1], COLUMNS_AT_A_TIME):
            span = slice(start, start + COLUMNS_AT_A_TIME)
            part = np.array(right[:, span], order="F")
            solution[:, span] = self.factors.solve_transposed(part) * self.factors.rows[:, None]
        return solution

    def solve_sparse(self, right: SparseMatrix, what: str) -> FloatArray:
        """Return ``(K - sigma M)^-1 right`` for the columns of a sparse matrix."""
        solution = np.empty(right.shape, order="F")
        for start in progress(range(0, right.shape[1], COLUMNS_AT_A_TIME), what):
            span = slice(start, start + COLUMNS_AT_A_TIME)
            solution[:, span] = self.solve(right[:, span].toarray())
        return solution


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """The k lowest modes, omega rising."""

    omega: FloatArray  #: (k,) [rad/s], 0 for rigid ones
    shapes: FloatArray  #: (n, k) phi, phi^T M phi = 1


def is_unsymmetric(matrix: SparseMatrix) -> float:
    """Return how far a matrix is from its transpose, relative to its largest entry; 0 where that is rounding."""
    difference = csc_array(abs(matrix - matrix.T))
    largest = float(np.abs(matrix.data).max(initial=0.0))
    asymmetry = float(difference.data.max(initial=0.0)) / (largest or 1.0)
    return asymmetry if asymmetry > UNSYMMETRIC else 0.0


def count_below(stiffness: ShiftedStiffness, omega: float) -> int:
    """Count the modes below a frequency [rad/s].

    ``K - omega^2 M = L D L^T`` has as many negative entries in D as there are modes below (J. J. Sylvester, 1852).
    Elimination with pivots on the diagonal gives D without L having to be symmetric.
    """
    for nudge in (0.0, JUST_ABOVE):
        shifted = csc_array(stiffness.K - (omega * (1.0 + nudge)) ** 2 * stiffness.M)
        try:
            factors = sparse_lu(shifted, *PIVOTINGS[0])
        except RuntimeError:  # a mode to the last bit
            if nudge:
                raise
        else:
            break
    return int(np.count_nonzero(factors.U.diagonal() < 0.0))


def lowest_modes(stiffness: ShiftedStiffness, count: int) -> Modes:
    """Find the lowest modes, as many as there are and at most `count`.

    Raises
    ------
    ParameterError
        Neither one Lanczos iteration nor slices of the spectrum give them, as where M or K are not semidefinite.
    """
    massive = np.flatnonzero(np.diff(stiffness.M.indptr))
    if massive.size == 0 or count == 0:
        return Modes(np.zeros(0), np.zeros((stiffness.K.shape[0], 0)))
    if massive.size <= max(FEW_MASSES, 3 * count):
        return _all_modes(stiffness, massive, count)
    if count > MODES_IN_SLICE:
        return _sorted(*modes_by_slices(stiffness.K, stiffness.M, count))
    n = stiffness.K.shape[0]
    inverse = LinearOperator((n, n), matvec=lambda v: stiffness.solve(v.reshape(n, 1))[:, 0], dtype=np.float64)
    start = stiffness.solve(times(stiffness.M, np.random.default_rng(0).standard_normal((n, 1))))[:, 0]
    try:
        found = eigsh(stiffness.K, k=count, M=stiffness.M, sigma=stiffness.sigma, OPinv=inverse, v0=start)
    except ArpackError:  # clustered modes, which one shift does not tell apart
        found = modes_by_slices(stiffness.K, stiffness.M, count)
    return _sorted(*found)


def _all_modes(stiffness: ShiftedStiffness, massive: IndexArray, count: int) -> Modes:
    """Find the modes from the flexibility at the DOFs with mass."""
    mass = stiffness.M[massive][:, massive].toarray()
    sizes, vectors = scipy.linalg.eigh((mass + mass.T) / 2.0)
    kept = sizes > MASSLESS_DIRECTION * sizes.max(initial=0.0)
    root = vectors[:, kept] * np.sqrt(sizes[kept])  # mass = root root^T
    flexibility = np.empty((root.shape[1], root.shape[1]))
    for start in progress(range(0, root.shape[1], COLUMNS_AT_A_TIME), "flexibilities"):
        span = slice(start, start + COLUMNS_AT_A_TIME)
        flexibility[:, span] = root.T @ stiffness.solve(_spread(root[:, span], massive, stiffness))[massive]
    inverse, turn = scipy.linalg.eigh((flexibility + flexibility.T) / 2.0)
    first = np.argsort(-inverse)[:count]
    shapes = stiffness.solve(_spread(root @ (turn[:, first] / inverse[first]), massive, stiffness))
    return _sorted(1.0 / inverse[first] + stiffness.sigma, shapes)


def _spread(values: FloatArray, places: IndexArray, stiffness: ShiftedStiffness) -> FloatArray:
    """Put rows in their places among all DOFs, zeros elsewhere."""
    whole = np.zeros((stiffness.K.shape[0], values.shape[1]), order="F")
    whole[places] = values
    return whole


def _sorted(squares: FloatArray, shapes: FloatArray) -> Modes:
    order = np.argsort(squares)
    return Modes(np.sqrt(np.maximum(squares[order], 0.0)), shapes[:, order])
