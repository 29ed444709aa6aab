"""The damped stiffness K'' as directions: ``K'' = L diag(d) L^T``, one column of L for each of its rank.

Worked component by component of its pattern, by Cholesky elimination with pivots, so that a spring between two nodes
gives ``(1, -1)`` and nothing else: what the damping does not touch keeps its zeros.
"""

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import FloatArray, powers_of_two
from halfdof_ctrl.base.errors import MatrixError, ModelSizeError, ParameterError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.sparse_arrays import SparseMatrix

BLOCK_ROUNDING = 16 * float(np.finfo(float).eps)  #: times the size: eigenvalues of a scaled block below are zero
UNSYMMETRIC_STIFFNESS = 1e-12  #: relative difference between a matrix and its transpose that is no rounding
LARGEST_BLOCK = 1500  #: DOFs that damping ties together
NAMED_SHARE = 0.3  #: of the largest entry of a direction: DOFs above are named


def directions(loss: SparseMatrix, dofs: tuple[str, ...], *, sparse: bool) -> tuple[SparseMatrix, FloatArray]:
    """Split a symmetric positive semidefinite matrix into directions.

    Parameters
    ----------
    loss : (n, n) csc_array
        K'' [N/m].
    dofs : tuple of n str
    sparse : bool
        Whether the model is sparse: then half its size in directions is refused, since each brings half DOFs.

    Returns
    -------
    L : (n, r) csc_array
        Every column has an entry 1.
    d : (r,) ndarray
        [N/m], positive.

    Raises
    ------
    MatrixError
        K'' is not symmetric.
    ParameterError
        K'' is zero, or negative in some direction.
    ModelSizeError
        Too many directions for a sparse model.
    """
    require_symmetric(loss, "K''")
    count, labels = connected_components(abs(loss), directed=False)
    touched = np.zeros(len(dofs), dtype=bool)
    touched[loss.indices] = True
    n = len(dofs)
    columns: list[tuple[npt.NDArray[np.signedinteger], FloatArray, float]] = []  # places, entries, size
    order = np.argsort(labels, kind="stable")
    borders = np.searchsorted(labels[order], np.arange(count + 1))
    for label in range(count):
        places = order[borders[label] : borders[label + 1]]
        places = places[touched[places]]
        if places.size == 0:
            continue
        if places.size > LARGEST_BLOCK:
            raise _too_many(places.size, n)
        block = loss[:, places][places].toarray()
        names = tuple([dofs[place] for place in places.tolist()])
        columns += [(places, entries, size) for entries, size in _of_block(block, names)]
    if not columns:
        msg = "The damped stiffness K'' is zero: there is nothing to damp. Give a loss factor, or a complex K."
        raise ParameterError(msg, parameter="loss_factor", value=0.0)
    if sparse and len(columns) > n // 2:
        raise _too_many(len(columns), n)
    rows = np.concatenate([places for places, _, _ in columns])
    values = np.concatenate([entries for _, entries, _ in columns])
    which = np.repeat(np.arange(len(columns)), [places.size for places, _, _ in columns])
    L = csc_array(coo_array((values, (rows, which)), shape=(n, len(columns))))
    L.eliminate_zeros()
    return L, np.array([size for _, _, size in columns])


def require_symmetric(matrix: SparseMatrix, letter: str) -> None:
    """Refuse a matrix that is not symmetric.

    Raises
    ------
    MatrixError
        It is not.
    """
    difference = np.abs(csc_array(matrix - matrix.T).data).max(initial=0.0)
    if difference > UNSYMMETRIC_STIFFNESS * np.abs(matrix.data).max(initial=0.0):
        msg = f"{letter} is not symmetric (by {difference:.1e}), so that it is no passive stiffness. Complete it first."
        raise MatrixError(msg, matrix=letter)


def _of_block(block: FloatArray, names: tuple[str, ...]) -> list[tuple[FloatArray, float]]:
    """Give entries and size of the directions of one component."""
    scale = np.sqrt(powers_of_two(np.abs(np.diagonal(block)) + (np.diagonal(block) == 0.0)))
    scale = powers_of_two(1.0 / scale)  # exact
    scaled = block * scale * scale[:, None]
    scaled = (scaled + scaled.T) / 2.0
    values, vectors = scipy.linalg.eigh(scaled)
    bound = BLOCK_ROUNDING * len(scaled) * max(float(values[-1]), float(np.abs(values).max()))
    if values[0] < -bound:
        part = np.abs(vectors[:, 0])
        found = tuple([names[i] for i in np.flatnonzero(part > NAMED_SHARE * part.max()).tolist()])
        msg = (
            f"The damped stiffness K'' is negative in a motion of {listed(found)} (eigenvalue {values[0]:.2e} of "
            f"{values[-1]:.2e} in scaled units): that part would drive instead of damp. Look at the sign of its loss."
        )
        raise ParameterError(msg, parameter="loss_factor", value=found)
    factor, pivots, rank, _ = scipy.linalg.lapack.dpstrf(scaled, tol=bound, lower=1)
    lower = np.tril(factor)[:, :rank]
    L = np.empty_like(lower)
    L[pivots - 1] = lower
    L = L / scale[:, None]
    heads = L[pivots[:rank] - 1, np.arange(rank)]
    return [(L[:, j] / heads[j], float(heads[j] ** 2)) for j in range(rank)]


def _too_many(count: int, n: int) -> ModelSizeError:
    msg = (
        f"The damping acts in {count} or more directions of a sparse model of {n} DOFs: every one would bring half "
        "DOFs of its own. Make the small model first, truncate_modes(model, ...), which takes a complex K, and damp "
        "that; or damp parts of low rank alone, such as mounts and joints."
    )
    return ModelSizeError(msg, size=count, limit=n // 2)
