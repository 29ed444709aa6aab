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
