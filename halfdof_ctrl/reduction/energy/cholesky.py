"""Cholesky factors that keep what the entries of a matrix determine.

``K = U^T U`` by Cholesky's method errs by a few roundings of the largest entries, which is far more than the stored
entries leave open where the stiffness of a structure ranges over many decades. One Newton step with the residual in
twice the working precision repairs that:

    E = K - U^T U,    G = U^-T E U^-1,    U <- (I + striu(G) + diag(G) / 2) U                  (23)

It would fill exact zeros with roundings; above the first entry of a column of K the factor is zero, and is kept so.
"""

import numpy as np
import scipy.linalg
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dpocon, dpotrf, dsygst, dtrtri

from halfdof_ctrl.base.arrays import FloatArray, powers_of_two
from halfdof_ctrl.base.gram_residual import gram_residual
from halfdof_ctrl.base.matrix_residual import by_columns, has_few_entries

PLAIN_CONDITION = 256.0  #: of a matrix at unit diagonal, up to which rounding of its factor does no harm: 6e-14
CORRECTED_FACTOR = 1e-8  #: a correction of this size leaves errors of its square, which is below rounding
MOST_CORRECTIONS = 3  #: one does, but for matrices that are singular to twelve digits
DIVERGED_FACTOR = 0.5  #: a correction of this size does not come from rounding: the factor is of no use


def corrected_factor(K: FloatArray) -> FloatArray | None:
    """Factorize a symmetric matrix as ``U^T U``, better than its rounded factorization does.

    Parameters
    ----------
    K : (n, n) ndarray
        Symmetric.

    Returns
    -------
    (n, n) ndarray or None
        U, upper triangular, with a positive diagonal; None where K is not positive definite to working precision.

    Examples
    --------
    >>> corrected_factor(np.array([[4.0, 2.0], [2.0, 10.0]])).tolist()
    [[2.0, 1.0], [0.0, 3.0]]
    """
    diagonal = np.diagonal(K)
    if not (diagonal > 0.0).all():
        return None
    if is_diagonal(K):
        return np.diag(np.sqrt(diagonal))
    scale = powers_of_two(np.sqrt(diagonal))
    scaled = scale[:, None] * K * scale
    U, failed = dpotrf(scaled.T, lower=0, clean=1)
    if failed:
        return None
    norm = float(np.abs(scaled).sum(axis=0).max())
    if PLAIN_CONDITION * float(dpocon(U, norm)[0]) < 1.0:
        U = _corrected(scaled, U)
    return None if U is None else np.asarray(U / scale)


def _corrected(K: FloatArray, U: FloatArray) -> FloatArray | None:
    """Apply (23) until nothing is left to correct."""
    inside = _envelope(K)
    few = has_few_entries(inside)
    for _ in range(MOST_CORRECTIONS):
        G, _ = dsygst(gram_residual(K, U), U)  # of both only the upper triangles
        size = float(np.abs(np.triu(G)).max(initial=0.0))
        if not size < DIVERGED_FACTOR:
            return None
        np.einsum("ii->i", G)[:] /= 2.0
        change = (by_columns(U).T @ np.triu(G).T).T if few else dtrmm(1.0, G, U)
        U = U + np.where(inside, change, 0.0)
        if size <= CORRECTED_FACTOR:
            break
    return U


def is_diagonal(matrix: FloatArray) -> bool:
    """Tell whether all entries besides the diagonal are zero."""
    return bool(np.count_nonzero(matrix) == np.count_nonzero(np.diagonal(matrix)))


def solved(U: FloatArray, right: FloatArray, *, transposed: bool = False) -> FloatArray:
    """Return ``U^-1 right``, or ``U^-T right``, for an upper triangular U."""
    if U.size == 0:
        return np.array(right)
    return np.asarray(scipy.linalg.solve_triangular(U, right, trans="T" if transposed else "N", check_finite=False))


def inverse(U: FloatArray) -> FloatArray:
    """Return ``U^-1`` for an upper triangular U."""
    return np.asarray(dtrtri(U)[0]) if U.size else np.array(U)


def _envelope(K: FloatArray) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Mark the entries from the first nonzero one of each column down to the diagonal."""
    first = np.argmax(K != 0.0, axis=0)
    rows = np.arange(len(K))[:, None]
    return np.asarray((rows >= first) & (rows <= np.arange(len(K))))
