"""Degrees of a polynomial matrix: how often each equation must be differentiated.

For a matrix of polynomials with degrees deg_ij, offsets c_i >= 0 and d_j >= 0 with

    deg_ij <= d_j - c_i,    equality along a perfect matching,                            (15)

bound the degree of its determinant, ``deg det <= sum d_j - sum c_i``; the bound is met if and only if the
tight coefficients, J_ij the coefficient of ``s^(d_j - c_i)``, form a nonsingular matrix (K. Murota, Matrices and
Matroids for Systems Analysis, 2000, section 7.1). Read as equations of motion, equation i is to be
differentiated c_i times, and d_j derivatives of unknown j appear (J. D. Pryce, A simple structural analysis method
for DAEs, 2001). Only patterns are looked at here.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import scipy.optimize
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import FloatArray, IndexArray

BoolArray: TypeAlias = npt.NDArray[np.bool_]
ABSENT = -(10**6)  #: degree of a zero entry: far below every difference of offsets


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Offsets:
    """The smallest offsets (15) of an (n, n) polynomial matrix."""

    equations: IndexArray  #: (n,) c_i, how often equation i is differentiated
    unknowns: IndexArray  #: (n,) d_j, the derivative of unknown j that the differentiated equations contain
    matching: IndexArray  #: (n,) the unknown matched to each equation

    @property
    def degree_bound(self) -> int:
        """Bound of the degree of the determinant."""
        return int(self.unknowns.sum() - self.equations.sum())

    def tight(self, coefficients: FloatArray) -> FloatArray:
        """Pick the coefficients (k, n, n) of the powers d_j - c_i: the matrix J."""
        power = self.unknowns[None, :] - self.equations[:, None]
        i, j = np.nonzero((power >= 0) & (power < len(coefficients)))
        J = np.zeros(power.shape)
        J[i, j] = coefficients[power[i, j], i, j]
        return J


def structural_offsets(present: BoolArray) -> Offsets | None:
    """Find the smallest offsets, or None if no perfect matching exists: the matrix is singular then.

    Parameters
    ----------
    present : (k, n, n) bool ndarray
        Which coefficients of ``s^0, s^1, ...`` are not zero.

    Examples
    --------
    A mass on a rigid rod, ``q'' + lam = f, q = u``: the second equation is to be differentiated twice.

    >>> found = structural_offsets(np.array([[[0, 1], [1, 0]], [[0, 0], [0, 0]], [[1, 0], [0, 0]]], dtype=bool))
    >>> found.equations.tolist(), found.unknowns.tolist(), found.degree_bound
    ([0, 2], [2, 0], 0)
    """
    n = present.shape[1]
    degree = np.where(present.any(axis=0), len(present) - 1 - present[::-1].argmax(axis=0), ABSENT)
    forbidden = -4.0 * n * (len(present) + 1)
    rows, matching = scipy.optimize.linear_sum_assignment(np.where(degree >= 0, degree, forbidden), maximize=True)
    if (degree[rows, matching] < 0).any():
        return None
    equations = np.zeros(n, dtype=np.intp)
    while True:
        unknowns = (degree + equations[:, None]).max(axis=0)
        following = unknowns[matching] - degree[rows, matching]
        if (following == equations).all():
            return Offsets(equations=equations, unknowns=unknowns, matching=matching)
        equations = following


def irreducible_blocks(pattern: BoolArray, matching: IndexArray) -> list[IndexArray]:
    """Return the row sets of the diagonal blocks of the block triangular form (Dulmage and Mendelsohn)."""
    count, label = connected_components(
        csr_array(pattern[:, matching].astype(np.int8)), directed=True, connection="strong"
    )
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1])
