"""What is unusual about M, C, K, told cheaply: negative or indefinite where energy is stored, unsymmetric matrices.

None of it is wrong: follower forces, gyroscopic terms, multipliers and friction make such models. But a sign that was
typed wrong makes them too.
"""

from typing import Any

import numpy as np
from scipy.sparse import csc_array, triu

from halfdof_ctrl.base.arrays import EPS, ModelMatrix
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.sparse_arrays import as_sparse

ODDITIES_UNSYMMETRIC = (
    64 * EPS
)  #: of the larger of two entries across the diagonal, or what the digits of a file leave unknown
DENSE_EIGENVALUES = 150  #: DOFs up to which all eigenvalues are asked for their sign
NEGATIVE = 1e-12  #: of the matrix with unit diagonal, an eigenvalue that is not rounding
MOST_ENTRIES = 500_000  #: above which the diagonal alone is looked at
ODDITIES_FEW = 4  #: DOFs that are named


def oddities(matrices: dict[str, ModelMatrix], dofs: tuple[str, ...], known_to: float = EPS) -> list[str]:
    """Say of real matrices which are unsymmetric, indefinite or have negative diagonal entries, each in a few words.

    Parameters
    ----------
    matrices : dict from letter to (n, n) array
    dofs : tuple of str
    known_to : float
        Relative rounding of the entries.

    Examples
    --------
    >>> oddities({"M": np.diag([1.0, -2.0]), "K": np.array([[1.0, 0.5], [-0.5, 1.0]])}, ("a", "b"))
    ['M is negative on the diagonal at b', 'K is unsymmetric between a and b']
    """
    found = []
    for letter, matrix in matrices.items():
        words = _of_matrix(csc_array(as_sparse(matrix).real), dofs, known_to)
        if words is not None:
            found.append(f"{letter} is {words}")
    return found


def _of_matrix(matrix: csc_array, dofs: tuple[str, ...], known_to: float) -> str | None:
    """Return the first thing that is unusual about a real matrix."""
    diagonal = matrix.diagonal()
    negative = np.flatnonzero(diagonal < 0.0)
    if negative.size:
        return f"negative on the diagonal at {listed([dofs[k] for k in negative.tolist()], ODDITIES_FEW)}"
    if matrix.nnz > MOST_ENTRIES:
        return None
    upper, lower = triu(matrix, 1, format="csc"), triu(matrix.T, 1, format="csc")
    difference: Any = abs(upper - lower).tocoo()
    size: Any = abs(upper).maximum(abs(lower))
    excess = (difference - max(ODDITIES_UNSYMMETRIC, 2.0 * known_to) * size).tocoo()
    wrong = np.flatnonzero(excess.data > 0.0)
    if wrong.size:
        first = wrong[np.argmax(excess.data[wrong])]
        return f"unsymmetric between {dofs[excess.row[first]]} and {dofs[excess.col[first]]}"
    entries: Any = upper.tocoo()
    bound = np.sqrt(diagonal[entries.row]) * np.sqrt(diagonal[entries.col])
    tight = np.flatnonzero(np.abs(entries.data) > bound * (1.0 + max(NEGATIVE, 4.0 * known_to)))
    if tight.size:
        row, column = int(entries.row[tight[0]]), int(entries.col[tight[0]])
        return f"indefinite: its entry between {dofs[row]} and {dofs[column]} exceeds both their own"
    return _by_eigenvalues(matrix, diagonal, dofs, known_to)


def _by_eigenvalues(matrix: csc_array, diagonal: np.ndarray, dofs: tuple[str, ...], known_to: float) -> str | None:
    """Look for a negative eigenvalue of a small symmetric matrix."""
    there = np.flatnonzero(diagonal > 0.0)
    if not 0 < there.size <= DENSE_EIGENVALUES:
        return None
    scale = 1.0 / np.sqrt(diagonal[there])
    scaled = matrix[there][:, there].toarray() * scale[:, None] * scale
    values, vectors = np.linalg.eigh((scaled + scaled.T) / 2.0)
    if values[0] >= -max(NEGATIVE, 2.0 * known_to * np.abs(scaled).sum(axis=0).max()):
        return None
    most = there[np.argsort(-np.abs(vectors[:, 0]), kind="stable")[:ODDITIES_FEW]]
    return f"indefinite in a motion of {listed([dofs[k] for k in sorted(most.tolist())], ODDITIES_FEW)}"
