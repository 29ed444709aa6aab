"""Matrix products and sums in about twice the working precision, on every platform the same.

A factor is cut into slices of so few bits that the products of slices, sums included, are exact in double precision
(K. Ozaki, T. Ogita, S. Oishi and S. M. Rump, Error-free transformations of matrix multiplication, 2012). A value is
an unevaluated sum of two doubles, high + low; `longdouble` is no more than a double on Windows and Apple silicon.
"""

from typing import TypeAlias

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray

Double2: TypeAlias = tuple[FloatArray, FloatArray]  #: high + low

BITS = 53  #: of a double
SPLITTER = 2.0**27 + 1.0  #: cuts a double into two halves (G. W. Veltkamp, 1968)


def two_sum(a: FloatArray, b: FloatArray) -> Double2:
    """Return the rounded sum and its rounding error (D. E. Knuth, 1969).

    >>> [float(part) for part in two_sum(np.float64(1.0), np.float64(2.0**-60))] == [1.0, 2.0**-60]
    True
    """
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: FloatArray, b: FloatArray) -> Double2:
    """Return the rounded product, entry by entry, and its rounding error (T. J. Dekker, 1971)."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


def added(x: Double2, y: Double2) -> Double2:
    """Add two values of high and low parts."""
    high, low = two_sum(x[0], y[0])
    return two_sum(high, low + (x[1] + y[1]))


def matrix_product(A: FloatArray, B: FloatArray) -> Double2:
    """Multiply two real matrices to about twice the working precision.

    Parameters
    ----------
    A, B : (m, n), (n, p) ndarrays

    Returns
    -------
    high, low : (m, p) ndarrays
        Their sum is known to about 2^-95 of the largest entry in a row of A times the largest in a column of B.

    Examples
    --------
    >>> high, low = matrix_product(np.array([[1.0, 1.0, -1.0]]), np.array([[1.0], [2.0**-70], [1.0]]))
    >>> float(high[0, 0] + low[0, 0]) == 2.0**-70
    True
    """
    width = (BITS - 2 - int(np.ceil(np.log2(max(A.shape[1], 2))))) // 2
    A1, A2, A3 = _slices(A, width, axis=1)
    B1, B2, B3 = _slices(B, width, axis=0)
    total = two_sum(A1 @ B1, A1 @ B2)
    for part in (A2 @ B1, A2 @ B2):
        high, low = two_sum(total[0], part)
        total = high, low + total[1]
    rest = (A1 + A2) @ B3 + A3 @ B
    return two_sum(total[0], total[1] + rest)


def _slices(matrix: FloatArray, width: int, axis: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut a matrix into two slices of `width` bits below the largest entry of each row or column, and a rest."""
    largest = np.abs(matrix).max(axis=axis, keepdims=True, initial=0.0)
    top = np.ldexp(1.0, np.frexp(largest)[1] + BITS - width)
    first = (matrix + top) - top
    rest = matrix - first
    top = np.ldexp(top, -width)
    second = (rest + top) - top
    return first, second, rest - second


def _halves(a: FloatArray) -> Double2:
    scaled = SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high
