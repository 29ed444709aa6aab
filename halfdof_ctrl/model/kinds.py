"""Which DOFs are inertial, half and static, told from the null columns of M and C, and said in words."""

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, diags_array, hstack

from halfdof_ctrl.base.arrays import ModelMatrix, as_dense
from halfdof_ctrl.base.sparse_arrays import as_sparse, is_sparse
from halfdof_ctrl.base.sparse_factors import sparse_lu, structural_rank

LARGEST_RANKED_REPR = 500  #: above so many DOFs `repr` ranks no numbers of W, but factorizes a sparse one, ...
LARGEST_FACTORIZED_REPR = 20_000  #: ... and above so many it looks at its pattern alone
SINGULAR_GROWTH_REPR = 1e14  #: of a random solution, above which W, scaled, is singular


def null_column_kinds(M: ModelMatrix, C: ModelMatrix) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return which columns of M are not null, and which of the others have a column in C that is not."""
    if is_sparse(M):
        inertial, damped = (np.diff(as_sparse(X).indptr) > 0 for X in (M, C))
    else:
        inertial, damped = np.logical_or.reduce(M, axis=0), np.logical_or.reduce(C, axis=0)
    return np.asarray(inertial), np.asarray(damped > inertial)


def split_in_words(M: ModelMatrix, C: ModelMatrix, K: ModelMatrix) -> str:
    """Say how many DOFs are inertial, half and static, and the states that follow."""
    inertial, half = null_column_kinds(M, C)
    insufficient = "by null columns, which do not suffice here (see exact_reduction)"
    n, n_inertial, n_half = M.shape[0], int(inertial.sum()), int(half.sum())
    kinds = f"{n_inertial} inertial, {n_half} half, {n - n_inertial - n_half} static"
    if n <= LARGEST_RANKED_REPR:
        M, C, K = (as_dense(X) for X in (M, C, K))
        leading = np.where(inertial, M, np.where(half, C, K))
        size = np.abs(leading).max(axis=0)
        if not size.all() or np.linalg.matrix_rank(leading / size) < n:
            return f"{kinds} {insufficient}"
    elif is_sparse(K) and _is_singular(_leading_columns(M, C, K, inertial, half)):
        return f"{kinds} {insufficient}"
    return f"{kinds}; {2 * n_inertial + n_half} states"


def _is_singular(leading: csc_array) -> bool:
    """Tell whether W is singular: by its pattern, and where that takes no time by what its factors make of a vector."""
    n = leading.shape[0]
    if structural_rank(leading) < n or n > LARGEST_FACTORIZED_REPR:
        return structural_rank(leading) < n
    for axis in (0, 1):
        size = abs(leading).max(axis=axis).toarray().ravel()
        scale = diags_array(1.0 / np.where(size > 0.0, size, 1.0))
        leading = csc_array(leading @ scale if axis == 0 else scale @ leading)
    try:
        solution = sparse_lu(leading).solve(np.random.default_rng(0).uniform(1.0, 2.0, n).astype(leading.dtype))
    except RuntimeError:  # exactly singular
        return True
    return not float(np.abs(solution).max(initial=0.0)) < SINGULAR_GROWTH_REPR


def _leading_columns(
    M: ModelMatrix, C: ModelMatrix, K: ModelMatrix, inertial: npt.NDArray[np.bool_], half: npt.NDArray[np.bool_]
) -> csc_array:
    """Return W of a sparse model, its columns taken from M, C and K in the order of the DOFs' kinds."""
    parts = zip((M, C, K), (inertial, half, ~(inertial | half)), strict=True)
    return csc_array(hstack([as_sparse(matrix)[:, np.flatnonzero(kind)] for matrix, kind in parts], format="csc"))
