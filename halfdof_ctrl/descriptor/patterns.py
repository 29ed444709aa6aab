"""The block triangular form of a pattern of zeros (A. L. Dulmage and N. S. Mendelsohn, 1963).

Rows and columns of any matrix can be permuted so that it reads

    [ wide   *     *    ]
    [  0   square  *    ]
    [  0     0     tall ]

with more columns than rows in the first block, more rows than columns in the last, and a square block between
them that splits again into irreducible ones on its diagonal. Rows and columns that no value of the entries could
make independent are thus told apart from those that are.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

BoolArray: TypeAlias = npt.NDArray[np.bool_]
Places: TypeAlias = npt.NDArray[np.intp]


def diagonal_blocks(pattern: BoolArray) -> list[tuple[Places, Places]]:
    """Return rows and columns of the blocks on the diagonal of the block triangular form.

    Parameters
    ----------
    pattern : (k, l) bool ndarray
        Where entries are.

    Returns
    -------
    list of (rows, columns)
        The wide block and the tall one, where there are any, and the irreducible square ones. Together they hold every
        row and column once.

    Examples
    --------
    Two rows say something about one unknown, and one row about three others:

    >>> pattern = np.array([[1, 1, 1, 0], [0, 0, 0, 1], [0, 0, 0, 1]], dtype=bool)
    >>> [(rows.tolist(), columns.tolist()) for rows, columns in diagonal_blocks(pattern)]
    [([0], [0, 1, 2]), ([1, 2], [3])]
    """
    if pattern.shape in {(0, 0), (1, 1)} and pattern.all():  # as most are that deflation leaves
        return [(np.arange(1), np.arange(1))] if pattern.size else []
    matched = maximum_bipartite_matching(_graph(pattern), perm_type="column").astype(np.intp)
    tall = _reached(pattern, matched)
    wide = _reached(pattern.T, _inverse(matched, pattern.shape[1]))[::-1]
    rows = np.flatnonzero(~(tall[0] | wide[0]))
    partners = matched[rows]
    square = pattern[np.ix_(rows, partners)]
    count, labels = connected_components(_graph(square), directed=True, connection="strong")
    members = [np.flatnonzero(labels == label) for label in range(count)]
    corners = [
        (np.flatnonzero(block[0]), np.flatnonzero(block[1]))
        for block in (wide, tall)
        if block[0].any() or block[1].any()
    ]
    return corners + [(rows[part], partners[part]) for part in members]


def connected_parts(pattern: BoolArray) -> list[tuple[Places, Places]]:
    """Return rows and columns of the parts that share no row and no column, null rows and columns left out.

    Examples
    --------
    >>> pattern = np.array([[1, 0, 0], [0, 0, 1], [1, 0, 0]], dtype=bool)
    >>> [(rows.tolist(), columns.tolist()) for rows, columns in connected_parts(pattern)]
    [([0, 2], [0]), ([1], [2])]
    """
    k, size = pattern.shape[0], sum(pattern.shape)
    graph = np.zeros((size, size), dtype=bool)
    graph[:k, k:] = pattern
    count, labels = connected_components(_graph(graph), directed=False)
    parts = [(np.flatnonzero(labels[:k] == label), np.flatnonzero(labels[k:] == label)) for label in range(count)]
    return [part for part in parts if part[0].size and part[1].size]


def _graph(pattern: BoolArray) -> csr_array:
    """Return the graph of a pattern as the algorithms for graphs work with it, without the checks of a conversion."""
    columns, lengths = np.nonzero(pattern)[1], np.count_nonzero(pattern, axis=1)
    starts = np.concatenate([[0], np.cumsum(lengths)])
    return csr_array((np.ones(columns.size), columns.astype(np.int32), starts.astype(np.int32)), shape=pattern.shape)


def _reached(pattern: BoolArray, matched: Places) -> tuple[BoolArray, BoolArray]:
    """Follow alternating paths from the rows that have no partner; give the rows and columns on them."""
    rows, columns = matched < 0, np.zeros(pattern.shape[1], dtype=bool)
    partner = _inverse(matched, pattern.shape[1])
    newest = rows
    while newest.any():
        found = pattern[newest].any(axis=0) & ~columns
        columns |= found
        newest = np.zeros_like(rows)
        newest[partner[found]] = True
        rows = rows | newest
    return rows, columns


def _inverse(matched: Places, size: int) -> Places:
    """Return the row of each column, -1 for those without."""
    inverse = np.full(size, -1, dtype=np.intp)
    taken = np.flatnonzero(matched >= 0)
    inverse[matched[taken]] = taken
    return inverse
