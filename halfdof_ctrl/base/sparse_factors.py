"""How sparse matrices are factorized by SuperLU: orders and pivots, from the fastest way to the safest; one door.

SuperLU is not given a matrix whose pattern alone makes it singular. It runs out of rows then, prints errors of BLAS on
the stdout of the process, and now and then writes beyond its memory. If the pattern holds a permutation, each step of
the elimination leaves one that does, and an exact zero among the pivots is reported as it should be.
"""

from typing import Any, Literal, TypeAlias

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

from halfdof_ctrl.base.arrays import EPS

Ordering: TypeAlias = Literal["MMD_AT_PLUS_A", "COLAMD", "NATURAL"]
Pivoting: TypeAlias = tuple[Ordering, float]  #: order, least pivot over the column's largest

PIVOTINGS: tuple[Pivoting, ...] = (("MMD_AT_PLUS_A", 0.0), ("MMD_AT_PLUS_A", 0.1), ("COLAMD", 1.0))
SYMMETRIC_SHARE = 0.5  #: of the entries that have a partner across the diagonal where the order is a symmetric one
COLUMNS_AT_A_TIME = 8  #: right-hand sides worked at a time
CORRECTED_ABOVE = 64 * EPS  #: componentwise backward error above which a solution is corrected once


def sparse_lu(matrix: csc_array, ordering: Ordering = "COLAMD", threshold: float = 1.0) -> Any:  # noqa: ANN401  # SuperLU has no public type
    """Factorize a square sparse matrix.

    Parameters
    ----------
    matrix : (n, n) csc_array
    ordering : {'COLAMD', 'MMD_AT_PLUS_A', 'NATURAL'}
    threshold : float
        Least pivot over the largest entry of its column; below one, pivots on the diagonal are preferred.

    Raises
    ------
    RuntimeError
        The matrix is exactly singular.

    Examples
    --------
    >>> sparse_lu(csc_array([[2.0, 1.0], [1.0, 2.0]])).solve(np.array([3.0, 3.0])).round(12).tolist()
    [1.0, 1.0]
    """
    if not has_permutation(matrix):
        msg = "the matrix is exactly singular by its pattern"
        raise RuntimeError(msg)
    options = {"SymmetricMode": True} if threshold < 1.0 else {}
    return splu(matrix, permc_spec=ordering, diag_pivot_thresh=threshold, options=options)


def has_permutation(matrix: csc_array) -> bool:
    """Return whether rows can be ordered so that each diagonal entry is stored: structural nonsingularity.

    Examples
    --------
    >>> has_permutation(csc_array([[0, 1], [1, 0]])), has_permutation(csc_array([[1, 1], [0, 0]]))
    (True, False)
    """
    n = matrix.shape[0]
    if np.count_nonzero(matrix.diagonal()) == n:
        return True
    if (np.diff(matrix.indptr) == 0).any() or np.unique(matrix.indices).size < n:
        return False
    from scipy.sparse.csgraph import maximum_bipartite_matching  # noqa: PLC0415  # rarely needed

    return bool((maximum_bipartite_matching(_pattern(matrix)) >= 0).all())


def structural_rank(matrix: csc_array) -> int:
    """Return the largest rank that a matrix of this pattern may have.

    Examples
    --------
    >>> structural_rank(csc_array([[1.0, 1.0], [0.0, 0.0]]))
    1
    """
    from scipy.sparse.csgraph import structural_rank as rank_of  # noqa: PLC0415  # rarely needed

    return int(rank_of(_pattern(matrix)))


def _pattern(matrix: csc_array) -> csr_array:
    """Return where entries are stored, with 32-bit indices: matching in older SciPy takes no others."""
    rows = csr_array(matrix)
    ones = np.ones(rows.indices.size)
    return csr_array((ones, rows.indices.astype(np.int32), rows.indptr.astype(np.int32)), shape=rows.shape)
