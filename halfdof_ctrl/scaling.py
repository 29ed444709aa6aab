"""Equilibration by powers of two, for the reduction's rank decisions and factorizations.

A unit changes a row or a column of a matrix by a factor. Decisions are therefore taken on the scaled
matrix ``diag(r) X diag(c)``, whose largest entry in every nonzero row and column is near one; r and c
are powers of two, which round nothing, so the scaling is undone exactly. (D. Ruiz, A scaling algorithm to
equilibrate both rows and columns norms in matrices, 2001.)
"""

import numpy as np

from halfdof_ctrl.arrays import FloatArray

MOST_PASSES = 12  #: each pass halves the spread's exponent; 12 take it from 2^2000 to below 2
EVEN = 2.0**10  #: rows and columns whose largest entries are between 1/1024 and 1024 are left as they are
FLAT = 1e-12  #: of the largest singular value: directions in which the least squares leave the factors open


def equilibrating_factors(matrix: FloatArray, even: float = EVEN) -> tuple[FloatArray, FloatArray]:
    """Give powers of two r, c such that ``diag(r) matrix diag(c)`` has row and column maxima near one.

    Parameters
    ----------
    matrix : (k, l) ndarray
        Any real matrix; zero rows and columns are left alone.
    even : float, optional
        Maxima between 1 / even and even are near enough to one.

    Returns
    -------
    (k,) and (l,) ndarrays
        Factors, all one where the maxima are near enough to one already.

    Examples
    --------
    >>> equilibrating_factors(np.array([[65536.0, 0.0], [0.0, 0.5]]))
    (array([0.00195312, 1.        ]), array([0.00195312, 1.        ]))
    """
    size = np.abs(matrix)
    rows, columns = np.ones(size.shape[0]), np.ones(size.shape[1])
    for _ in range(MOST_PASSES):
        by_row, by_column = np.maximum.reduce(size, axis=1, initial=0.0), np.maximum.reduce(size, axis=0, initial=0.0)
        if _is_even(by_row, even) and _is_even(by_column, even):
            break
        down, across = inverse_roots(by_row), inverse_roots(by_column)
        rows *= down
        columns *= across
        size *= down[:, None]
        size *= across
    return rows, columns


def _is_even(maxima: FloatArray, even: float) -> bool:
    """Tell whether all nonzero maxima lie between 1 / even and even."""
    return all([1.0 / even <= value <= even or value == 0.0 for value in maxima.tolist()])  # noqa: C419  # faster


def inverse_roots(maxima: FloatArray) -> FloatArray:
    """Give the powers of two nearest to one over the square root, 1 for a zero."""
    exponents = np.frexp(maxima)[1]
    return np.asarray(np.ldexp(1.0, -((exponents + np.sign(exponents)) // 2)))


def logarithmic_scaling(coefficients: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Give the logarithms of the row, column and time factors that bring all coefficients nearest to one.

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
    solution = np.linalg.lstsq(normal, right, rcond=FLAT)[0]
    return solution[:n], solution[n : 2 * n], float(solution[-1])


def levelling_factors(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give r, c such that the largest entries of the rows and columns of ``diag(r) matrix diag(c)`` are near one.

    Like `equilibrating_factors`, but not rounded to powers of two: for decisions that must come out the same in any
    units, on a matrix that `logarithmic_scaling` has brought to the same values in any units.
    """
    rows, columns = np.ones(matrix.shape[0]), np.ones(matrix.shape[1])
    for _ in range(MOST_PASSES):
        size = np.abs(matrix) * rows[:, None] * columns
        rows = rows / _root_or_one(size.max(axis=1, initial=0.0))
        columns = columns / _root_or_one(size.max(axis=0, initial=0.0))
    return rows, columns


def _root_or_one(maxima: FloatArray) -> FloatArray:
    return np.sqrt(np.where(maxima > 0.0, maxima, 1.0))


def gap_threshold(values: FloatArray, low: float, high: float) -> float:
    """Give the middle of the widest gap between values from `low` to `high`; `low` itself if none lies there."""
    inside = np.sort(values[(values > low) & (values < high)])
    if inside.size == 0:
        return low
    edges = np.concatenate([[low], inside, [high]])
    widest = int(np.argmax(edges[1:] / edges[:-1]))
    return float(np.sqrt(edges[widest] * edges[widest + 1]))
