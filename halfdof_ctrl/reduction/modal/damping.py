"""What of a damping matrix is ``alpha M + beta K``, and what dampers there are besides."""

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.sparse_arrays import SparseMatrix
from halfdof_ctrl.model.sparse_evaluation import SparsePencil

SAMPLED_ENTRIES = 1001  #: pairs of entries from which alpha and beta are found
PROPORTIONAL_ROUNDING = 1e-9  #: entries of C that differ from alpha M + beta K by this part of their terms are zero


def lumped_damping(M: SparseMatrix, C: SparseMatrix, K: SparseMatrix) -> SparseMatrix:
    """Return ``C - alpha M - beta K`` with rounding cleaned away, if that leaves far fewer entries than C.

    Any two places of the matrices say what alpha and beta are, if no damper is there; the medians over many pairs are
    not disturbed by dampers at a few places.

    Parameters
    ----------
    M, C, K : (n, n) csc_array

    Returns
    -------
    (n, n) csc_array
        C itself where more than half of its entries would stay.

    Examples
    --------
    A damper of 8 N s/m between the second mass and the ground, beside proportional damping:

    >>> M, K = csc_array(np.diag([1.0, 2.0, 2.0])), csc_array([[3.0, -3, 0], [-3, 5, -2], [0, -2, 7]])
    >>> lumped_damping(M, csc_array(0.5 * M + 0.1 * K + np.diag([0, 8.0, 0])), K).toarray().round(9).tolist()
    [[0.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 0.0]]
    """
    if C.nnz == 0:
        return C
    pencil = SparsePencil.on_one_pattern([K, C, M])
    k, c, m = (np.zeros(pencil.indices.size) if part is None else part for part in pencil.values)
    alpha, beta = _proportions(m, c, k)
    rest = c - alpha * m - beta * k
    rest[np.abs(rest) <= PROPORTIONAL_ROUNDING * (np.abs(c) + np.abs(alpha * m) + np.abs(beta * k))] = 0.0
    lumps = csc_array((rest, pencil.indices, pencil.indptr), shape=C.shape)
    lumps.eliminate_zeros()
    return lumps if lumps.nnz <= C.nnz / 2 else C


def _proportions(m: FloatArray, c: FloatArray, k: FloatArray) -> tuple[float, float]:
    """Find alpha and beta with c = alpha m + beta k at most places."""
    generator = np.random.default_rng(0)
    massive, stiff = np.flatnonzero(m), np.flatnonzero(k)
    if massive.size == 0 or stiff.size == 0:
        of_mass = float(np.median(c[massive] / m[massive])) if massive.size else 0.0
        return of_mass, float(np.median(c[stiff] / k[stiff])) if stiff.size else 0.0
    i, j = generator.choice(massive, SAMPLED_ENTRIES), generator.choice(stiff, SAMPLED_ENTRIES)
    determinant = m[i] * k[j] - m[j] * k[i]
    sound = np.abs(determinant) > PROPORTIONAL_ROUNDING * (np.abs(m[i] * k[j]) + np.abs(m[j] * k[i]))
    if not sound.any():  # M and K are proportional: one of them says all
        return 0.0, float(np.median(c[stiff] / k[stiff]))
    i, j, determinant = i[sound], j[sound], determinant[sound]
    alpha = (c[i] * k[j] - c[j] * k[i]) / determinant
    beta = (m[i] * c[j] - m[j] * c[i]) / determinant
    return float(np.median(alpha)), float(np.median(beta))
