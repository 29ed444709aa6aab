"""Scaling of rows and columns, for the reduction's rank decisions and factorizations.

A unit changes a row or a column of a matrix by a factor. Decisions are therefore taken on the scaled
matrix ``diag(r) X diag(c)``. Of four scalings,

- `max_scaling` brings the largest entry in every nonzero row and column near one, by powers of two, which round
  nothing, so the scaling is undone exactly (D. Ruiz, A scaling algorithm to equilibrate both rows and columns norms
  in matrices, 2001);
- `log_scaling` brings all entries nearest to one, which gives the same matrix whatever the units were;
- `level_scaling` brings the largest entries near one, not rounded, of a matrix that is the same in any units already;
- `unit_free_scaling` is the second and then the third.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array, csr_array

from halfdof_ctrl.base.arrays import DenseMatrix, FloatArray, Matrix
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, column_of_entries, largest_by_row_and_column

IndexArray: TypeAlias = npt.NDArray[np.intp]

MOST_PASSES = 12  #: each pass halves the spread's exponent; 12 take it from 2^2000 to below 2
EVEN = 2.0**10  #: rows and columns whose largest entries are between 1/1024 and 1024 are left as they are
OPEN_DIRECTION = 1e-12  #: of the largest singular value: directions in which the least squares leave the factors open
MOST_GRADIENT_STEPS = 2000  #: of conjugate gradients for the logarithmic factors of one matrix
FULLY_SETTLED = 1e-20  #: of the first residual, squared, at which they stop
ROUGHLY_SETTLED = 1e-8  #: the same where masses are compared, or a large matrix is scaled once more
SOLVED_AT_ONCE = 200  #: rows up to which the least squares with time are solved at once
DENSE_PATTERN_ROWS = 48  #: rows of a matrix whose pattern is multiplied as a dense matrix


class Scaling(NamedTuple):
    """Factors of the rows and columns of a matrix."""

    rows: FloatArray  #: (k,)
    columns: FloatArray  #: (l,)

    def then(self, second: "Scaling") -> "Scaling":
        """Return both scalings in one."""
        return Scaling(self.rows * second.rows, self.columns * second.columns)

    def of(self, matrix: DenseMatrix) -> DenseMatrix:
        """Return ``diag(rows) matrix diag(columns)`` for a dense matrix, real or complex."""
        return matrix * self.rows[:, None] * self.columns

    def of_sparse(self, matrix: SparseMatrix) -> SparseMatrix:
        """Return ``diag(rows) matrix diag(columns)`` for a sparse matrix."""
        data = matrix.data * self.rows[matrix.indices] * self.columns[column_of_entries(matrix)]
        return csc_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def max_scaling(matrix: Matrix, even: float = EVEN) -> Scaling:
    """Return powers of two r, c such that ``diag(r) matrix diag(c)`` has row and column maxima near one.

    Parameters
    ----------
    matrix : (k, l) ndarray or csc_array
        Any real matrix; zero rows and columns are left alone.
    even : float, optional
        Maxima between 1 / even and even are near enough to one.

    Returns
    -------
    Scaling
        All one where the maxima are near enough to one already.

    Examples
    --------
    >>> max_scaling(np.array([[65536.0, 0.0], [0.0, 0.5]]))
    Scaling(rows=array([0.00195312, 1.        ]), columns=array([0.00195312, 1.        ]))
    """
    return (
        _sparse_max_scaling(matrix, even) if isinstance(matrix, csc_array) else _dense_max_scaling(np.abs(matrix), even)
    )


def _dense_max_scaling(size: FloatArray, even: float) -> Scaling:
    """Scale sizes, which are overwritten."""
    rows, columns = np.ones(size.shape[0]), np.ones(size.shape[1])
    for _ in range(MOST_PASSES):
        by_row, by_column = np.maximum.reduce(size, axis=1, initial=0.0), np.maximum.reduce(size, axis=0, initial=0.0)
        if _is_even(by_row, even) and _is_even(by_column, even):
            break
        down, across = _inverse_roots(by_row), _inverse_roots(by_column)
        rows *= down
        columns *= across
        size *= down[:, None]
        size *= across
    return Scaling(rows, columns)


def _sparse_max_scaling(matrix: SparseMatrix, even: float) -> Scaling:
    """Return what the dense matrix would give, pass by pass."""
    size = csc_array((np.abs(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
    column = column_of_entries(size)
    rows, columns = np.ones(matrix.shape[0]), np.ones(matrix.shape[1])
    for _ in range(MOST_PASSES):
        by_row, by_column = largest_by_row_and_column(size)
        maxima = np.concatenate([by_row[by_row > 0.0], by_column[by_column > 0.0]])
        if maxima.size == 0 or (maxima.min() >= 1.0 / even and maxima.max() <= even):
            break
        down, across = _inverse_roots(by_row), _inverse_roots(by_column)
        rows *= down
        columns *= across
        size.data *= down[size.indices]
        size.data *= across[column]
    return Scaling(rows, columns)


def _is_even(maxima: FloatArray, even: float) -> bool:
    """Return whether all nonzero maxima lie between 1 / even and even."""
    return all([1.0 / even <= value <= even or value == 0.0 for value in maxima.tolist()])  # noqa: C419  # faster


def _inverse_roots(maxima: FloatArray) -> FloatArray:
    """Return the powers of two nearest to one over the square root, 1 for a zero."""
    exponents = np.frexp(maxima)[1]
    return np.asarray(np.ldexp(1.0, -((exponents + np.sign(exponents)) // 2)))


def log_scaling_with_time(coefficients: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the logarithms of the row, column and time factors that bring all coefficients nearest to one.

    Least squares of ``log2 |P_k,ij| + r_i + c_j + k t`` over all nonzero coefficients (A. R. Curtis and J. K. Reid,
    On the automatic scaling of matrices for Gaussian elimination, 1972, with time as one more unknown). The scaled
    coefficients are the residuals, which are unique, so they are the same whatever the units were.

    Parameters
    ----------
    coefficients : (k, n, n) ndarray
        Of ``s^0, s^1, ...``.

    Returns
    -------
    (n,) ndarray, (n,) ndarray, float
        r, c and t.
    """
    if coefficients.shape[1] > SOLVED_AT_ONCE:
        return _many_logs_with_time(coefficients)
    present = coefficients != 0.0
    power, i, j = np.nonzero(present)
    n = coefficients.shape[1]
    logs = np.log2(np.abs(coefficients[present]))
    count = present.sum(axis=0).astype(float)
    powers = np.einsum("kij,k->ij", present, np.arange(len(coefficients), dtype=float))
    time = np.concatenate([powers.sum(axis=1), powers.sum(axis=0)])
    square = np.block([[np.diag(count.sum(axis=1)), count], [count.T, np.diag(count.sum(axis=0))]])
    normal = np.block([[square, time[:, None]], [time[None, :], np.array([[float((power**2).sum())]])]])
    right = -np.concatenate([np.bincount(i, logs, n), np.bincount(j, logs, n), [float(power @ logs)]])
    solution = np.linalg.lstsq(normal, right, rcond=OPEN_DIRECTION)[0]
    return solution[:n], solution[n : 2 * n], float(solution[-1])


def _many_logs_with_time(coefficients: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Do so for many rows, time first, where the least squares at once would take longer than a reduction."""
    time = time_log(list(coefficients))
    power, i, j = np.nonzero(coefficients)
    logs = np.log2(np.abs(coefficients[power, i, j])) + time * power
    rows, columns = _scaling_logs(i, j, logs, coefficients.shape[1:], FULLY_SETTLED)
    return rows, columns, time


def log_scaling(matrix: Matrix, settled: float = FULLY_SETTLED, *, powers_of_two: bool = False) -> Scaling:
    """Return the row and column factors that bring all entries of one matrix nearest to one.

    As `log_scaling_with_time` without time, and quicker for large matrices.

    Parameters
    ----------
    matrix : (k, l) ndarray or csc_array
        Any real matrix; zero rows and columns are left alone.
    settled : float, optional
        Accuracy, by default nearly full: squared residual of the logarithms over the first one.
    powers_of_two : bool, optional
        Whether factors are rounded to powers of two.

    Returns
    -------
    Scaling
        Entries times both factors are unique, and so the same whatever the units were.

    Examples
    --------
    >>> log_scaling(np.array([[8.0, 0.0], [8.0, 1.0]]))
    Scaling(rows=array([0.25, 0.25]), columns=array([0.5, 4. ]))
    """
    i, j, size = _entries(matrix)
    logs = _scaling_logs(i, j, np.log2(size), matrix.shape, settled)
    return Scaling(*[np.exp2(np.round(log) if powers_of_two else log) for log in logs])


def unit_free_scaling(matrix: Matrix, settled: float = FULLY_SETTLED) -> Scaling:
    """Return row and column factors that make all entries of a matrix even, and then the largest ones near one.

    The scaled matrix is the same whatever the units were. `settled` as in `log_scaling`.
    """
    first = log_scaling(matrix, settled)
    return first.then(level_scaling(first.of_sparse(matrix) if isinstance(matrix, csc_array) else first.of(matrix)))


def time_log(coefficients: Sequence[Matrix], settled: float = FULLY_SETTLED) -> float:
    """Return the logarithm of the time factor of `log_scaling_with_time`, for dense or sparse coefficients.

    Examples
    --------
    A mass of 1/16 on a spring and a damper of one, alone: ``t = 2`` makes the least of 0, t and 2 t - 4:

    >>> round(time_log([np.eye(1), np.eye(1), np.eye(1) / 16.0]), 9)
    2.0
    """
    parts = [_entries(matrix) for matrix in coefficients]
    i, j, size = (np.concatenate(values) for values in zip(*parts, strict=True))
    logs, powers = np.log2(size), np.repeat(np.arange(float(len(parts))), [part[0].size for part in parts])
    uneven = []
    for values in (logs, powers):
        rows, columns = _scaling_logs(i, j, values, coefficients[0].shape, settled)
        uneven.append(values + rows[i] + columns[j])
    square = float(uneven[1] @ uneven[1])
    return -float(uneven[0] @ uneven[1]) / square if square > OPEN_DIRECTION * powers.size else 0.0


def _scaling_logs(
    i: IndexArray, j: IndexArray, logs: FloatArray, shape: tuple[int, int], settled: float
) -> tuple[FloatArray, FloatArray]:
    """Minimize the squares of ``logs + r_i + c_j`` by conjugate gradients on c (Curtis and Reid, 1972)."""
    times: Any
    if max(shape) <= DENSE_PATTERN_ROWS:
        times = np.bincount(i * shape[1] + j, minlength=shape[0] * shape[1]).reshape(shape).astype(np.float64)
    else:
        times = csr_array((np.ones(i.size), (i, j)), shape=shape)
    back = times.T
    in_row, in_column = (np.maximum(np.bincount(k, minlength=n), 1) for k, n in zip((i, j), shape, strict=True))
    by_row = -np.bincount(i, logs, shape[0])
    columns = np.zeros(shape[1])
    residual = -np.bincount(j, logs, shape[1]) - back @ (by_row / in_row)
    step = residual / in_column
    first = left = float(residual @ step)
    for _ in range(MOST_GRADIENT_STEPS):
        if left <= max(settled * first, FULLY_SETTLED):
            break
        moved = in_column * step - back @ ((times @ step) / in_row)
        length = left / float(step @ moved)
        columns += length * step
        residual -= length * moved
        eased = residual / in_column
        before, left = left, float(residual @ eased)
        step = eased + left / before * step
    return (by_row - times @ columns) / in_row, columns


def _entries(matrix: Matrix) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Return the rows, columns and sizes of the nonzero entries."""
    if isinstance(matrix, np.ndarray):
        places = np.nonzero(matrix)
        return places[0], places[1], np.abs(matrix[places])
    entries = coo_array(matrix)
    present = np.flatnonzero(entries.data)
    i, j = entries.coords
    return i[present].astype(np.intp), j[present].astype(np.intp), np.abs(entries.data[present])


def level_scaling(matrix: Matrix) -> Scaling:
    """Return r, c such that the largest entries of the rows and columns of ``diag(r) matrix diag(c)`` are near one.

    Like `max_scaling`, but not rounded to powers of two: for decisions that must come out the same in any
    units, on a matrix that `log_scaling_with_time` has brought to the same values in any units.
    """
    if isinstance(matrix, csc_array):
        return _sparse_level_scaling(matrix)
    rows, columns = np.ones(matrix.shape[0]), np.ones(matrix.shape[1])
    for _ in range(MOST_PASSES):
        size = np.abs(matrix) * rows[:, None] * columns
        rows = rows / _root_or_one(size.max(axis=1, initial=0.0))
        columns = columns / _root_or_one(size.max(axis=0, initial=0.0))
    return Scaling(rows, columns)


def _sparse_level_scaling(matrix: SparseMatrix) -> Scaling:
    size = csc_array((np.abs(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
    column = column_of_entries(size)
    rows, columns = np.ones(matrix.shape[0]), np.ones(matrix.shape[1])
    for _ in range(MOST_PASSES):
        down, across = [1.0 / _root_or_one(maxima) for maxima in largest_by_row_and_column(size)]
        rows *= down
        columns *= across
        size.data *= down[size.indices]
        size.data *= across[column]
    return Scaling(rows, columns)


def _root_or_one(maxima: FloatArray) -> FloatArray:
    """Return the square roots, 1 for a zero."""
    return np.sqrt(np.where(maxima > 0.0, maxima, 1.0))


def gap_threshold(values: FloatArray, low: float, high: float) -> float:
    """Return the middle of the widest gap between values from `low` to `high`; `low` itself if none lies there."""
    inside = np.sort(values[(values > low) & (values < high)])
    if inside.size == 0:
        return low
    edges = np.concatenate([[low], inside, [high]])
    widest = int(np.argmax(edges[1:] / edges[:-1]))
    return float(np.sqrt(edges[widest] * edges[widest + 1]))
