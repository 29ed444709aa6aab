"""Matrix products and residuals in about twice the working precision, the same on every platform.

Each row of the left factor and each column of the right one is cut into two slices of so few bits that products of
slices are sums of integers below 2^53, hence exact in any order of summation, and a rest,

    L = L1 + L2 + L3,   R = R1 + R2 + R3,   L R = (L1 R1 + L1 R2 + L2 R1) + L2 R2 + (L1 + L2) R3 + L3 R,

of which only the last two round (K. Ozaki, T. Ogita, S. Oishi and S. M. Rump, Error-free transformations of matrix
multiplication, 2012). A long double is no help here: it is a double on Windows and on Apple's processors.
"""

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray

MANTISSA = 53  #: bits of a double


def two_sum(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rounded sum and its error, ``a + b = total + error`` exactly (D. E. Knuth).

    Examples
    --------
    >>> two_sum(np.array([1.0]), np.array([2.0**-60]))[1].tolist() == [2.0**-60]
    True
    """
    total = a + b
    added = total - a
    return total, (a - (total - added)) + (b - added)


def exact_residual(target: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return ``target - left @ right``, rounded once where the terms do not cancel beyond twice the precision.

    Parameters
    ----------
    target : (n, m) ndarray
    left : (n, k) ndarray
    right : (k, m) ndarray

    Returns
    -------
    (n, m) ndarray
        With an error of about k 2^-97 of the product of the largest entries of the row of `left` and the column of
        `right`, and one rounding.

    Examples
    --------
    >>> third = np.array([[1.0 / 3.0]])
    >>> float(exact_residual(np.array([[1.0]]), third, np.array([[3.0]]))[0, 0]) == 2.0**-54
    True
    """
    total, error = np.array(target, dtype=float), np.zeros(target.shape)
    for part in _partial_products(left, right):
        total, lost = two_sum(total, -part)
        error += lost
    return np.asarray(total + error)


def exact_product(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return ``left @ right`` for (n, k) and (k, m), summed in twice the precision and rounded once.

    Examples
    --------
    >>> exact_product(np.array([[1.0, 2.0**70, -(2.0**70)]]), np.ones((3, 1))).tolist()
    [[1.0]]
    """
    return -exact_residual(np.zeros((left.shape[0], right.shape[1])), left, right)


def _partial_products(left: FloatArray, right: FloatArray) -> list[FloatArray]:
    """Return products whose exact sum is ``left @ right``, all but the last exact themselves."""
    inner = max(left.shape[1], 1)
    bits = (MANTISSA - int(np.ceil(np.log2(inner)))) // 2
    first, second, rest = _slices(left, bits, axis=1)
    ahead, behind, remainder = _slices(right, bits, axis=0)
    return [
        first @ ahead,
        first @ behind,
        second @ ahead,
        second @ behind,
        (first + second) @ remainder + rest @ right,
    ]


def _slices(matrix: FloatArray, bits: int, axis: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut into two slices of so many bits below the largest entry along an axis, and the rest."""
    parts = []
    rest = matrix
    for _ in range(2):
        exponent = np.frexp(np.abs(rest).max(axis=axis, keepdims=True, initial=0.0))[1]
        anchor = np.ldexp(1.5, exponent + MANTISSA - bits)  # a number whose last bit is the last one to be kept
        part = (rest + anchor) - anchor
        parts.append(part)
        rest = rest - part
    return parts[0], parts[1], rest
