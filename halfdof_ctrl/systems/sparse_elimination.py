"""Solve ``(s I - A) x = b`` for many s at once by elimination that keeps the zeros of A.

One sparse factorization in the middle of the points fixes the order of the pivots; the elimination then runs once,
row by row, with all points side by side. Where that order does not suit a point (its componentwise backward error
is more than rounding), and where the factors would fill up, the point is factorized by itself, and refined where
s I - A is nearly singular.
"""

from heapq import heapify, heappop, heappush
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.sparse_factors import CORRECTED_ABOVE, sparse_lu
from halfdof_ctrl.model.evaluation import quadratic_transfer

IndexArray: TypeAlias = npt.NDArray[np.signedinteger[Any]]
Row: TypeAlias = dict[int, complex | ComplexArray]  #: entries of a matrix row by column, one or all points

SPARSE_FACTORS = 20  #: entries per row of the factors up to which all points are worked side by side
SPARSE_STATES = 60  #: from which on factors of few entries are made as such where a point is factorized by itself


def sparse_response(A: FloatArray, b: FloatArray, c: FloatArray, points: ComplexArray) -> ComplexArray:
    """Evaluate ``c (s I - A)^-1 b`` with the digits that the zeros of A keep.

    Parameters
    ----------
    A, b, c : (N, N), (N,), (N,) ndarrays
    points : (k,) complex ndarray

    Returns
    -------
    (k,) complex ndarray
        ``inf + nan j`` at a pole.
    """
    present = csc_array((A != 0.0) | np.eye(A.shape[0], dtype=bool))
    columns = np.repeat(np.arange(A.shape[0]), np.diff(present.indptr))
    entries, diagonal = -A[present.indices, columns].astype(np.complex128), present.indices == columns
    values, is_sparse = np.full(points.size, complex(np.nan, np.nan)), False

    def shifted(s: complex) -> csc_array:
        return csc_array((entries + s * diagonal, present.indices, present.indptr), shape=A.shape)

    try:
        factors = sparse_lu(shifted(points[points.size // 2]))
        is_sparse = factors.nnz <= SPARSE_FACTORS * A.shape[0]
        if is_sparse:
            values = _side_by_side(A, b, c, points, (factors.perm_r, factors.perm_c))
    except RuntimeError:  # a pole: every point is looked at by itself
        pass
    left = np.isnan(values)
    if left.any():
        values[left] = _alone(A, b, c, points[left], is_sparse=is_sparse)
    return values


def _alone(A: FloatArray, b: FloatArray, c: FloatArray, points: ComplexArray, *, is_sparse: bool) -> ComplexArray:
    """Evaluate as a descriptor form is, which refines."""
    none, unit = np.zeros_like(A), np.eye(len(A))
    parts = ([-A, unit, none], [b[:, None]] + 2 * [none[:, :1]], [c[None]] + 2 * [none[:1]], 3 * [none[:1, :1]])
    kind = csc_array if is_sparse and len(A) > SPARSE_STATES else np.asarray
    P, B, F, D = ([kind(part) for part in each] for each in parts)
    return np.asarray(quadratic_transfer(P, B, F, D, points)[0, 0])


def _side_by_side(
    A: FloatArray, b: FloatArray, c: FloatArray, points: ComplexArray, order: tuple[IndexArray, IndexArray]
) -> ComplexArray:
    """Eliminate in the given order for all points; NaN where the result is not good."""
    rows, columns = (np.argsort(permutation).tolist() for permutation in order)
    place = {old: new for new, old in enumerate(columns)}
    matrix: list[Row] = [
        {place[j]: -A[i, j] + (points if i == j else 0.0) for j in {*np.flatnonzero(A[i]).tolist(), i}} for i in rows
    ]
    right: list[complex | ComplexArray] = [complex(b[i]) for i in rows]
    with np.errstate(all="ignore"):
        x = _back_substituted(*_eliminated(matrix, right))
        good = np.ones(points.size, dtype=bool)
        for i, row in zip(rows, matrix, strict=True):
            terms = [value * x[q] for q, value in row.items()]
            size = sum(np.abs(term) for term in terms) + abs(b[i])
            good &= np.abs(b[i] - sum(terms)) <= CORRECTED_ABOVE * size
        value = sum(c[old] * x[new] for old, new in place.items() if c[old] != 0.0)
    return np.where(good, value, complex(np.nan, np.nan))


def _eliminated(
    matrix: list[Row], right: list[complex | ComplexArray]
) -> tuple[list[Row], list[complex | ComplexArray]]:
    """Return the upper triangle and the right-hand side after elimination."""
    upper: list[Row] = []
    reduced: list[complex | ComplexArray] = []
    for p, given in enumerate(matrix):
        row, side = dict(given), right[p]
        waiting = [q for q in row if q < p]
        heapify(waiting)
        while waiting:
            q = heappop(waiting)
            factor = row.pop(q) / upper[q][q]
            side = side - factor * reduced[q]
            for t, value in upper[q].items():
                if t == q:
                    continue
                if t not in row and t < p:
                    heappush(waiting, t)
                row[t] = row.get(t, 0.0) - factor * value
        upper.append(row)
        reduced.append(side)
    return upper, reduced


def _back_substituted(upper: list[Row], right: list[complex | ComplexArray]) -> list[complex | ComplexArray]:
    x = list(right)
    for p in range(len(upper) - 1, -1, -1):
        row = upper[p]
        x[p] = (right[p] - sum(value * x[t] for t, value in row.items() if t != p)) / row[p]
    return x
