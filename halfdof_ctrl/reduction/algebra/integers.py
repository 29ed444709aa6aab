"""Exact arithmetic on floating-point numbers, which are integers times powers of two.

Arrays of Python integers (numpy dtype object) carry a denominator beside them where they need one. The solve is
fraction-free elimination: every number in it is a minor of the matrix, so it stays as short as the answer is
(E. H. Bareiss, Sylvester's identity and multistep integer-preserving Gaussian elimination, 1968).
"""

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray

IntegerArray: TypeAlias = npt.NDArray[np.object_]

LARGEST_EXACT = 60  #: equations up to which row operations and determinants are exact


def as_integers(values: FloatArray) -> tuple[IntegerArray, int]:
    """Return integers and the power of two that they have been multiplied by.

    Examples
    --------
    >>> as_integers(np.array([0.75, -2.0]))
    (array([3, -8], dtype=object), 2)
    """
    ratios = [value.as_integer_ratio() for value in values.ravel().tolist()]
    power = max((denominator.bit_length() - 1 for _, denominator in ratios), default=0)
    integers = np.empty(len(ratios), dtype=object)
    integers[:] = [numerator << (power + 1 - denominator.bit_length()) for numerator, denominator in ratios]
    return integers.reshape(values.shape), power


def as_floats(numerators: IntegerArray, denominator: int) -> FloatArray:
    """Return the nearest floating-point numbers."""
    values = [numerator / denominator for numerator in numerators.ravel().tolist()]
    return np.array(values, dtype=float).reshape(numerators.shape)


def without_common_factor(numerators: IntegerArray, denominator: int) -> tuple[IntegerArray, int]:
    """Divide numerators and denominator by what they share."""
    factor = math.gcd(denominator, *numerators.ravel().tolist())
    return (numerators // factor, denominator // factor) if factor > 1 else (numerators, denominator)


def solved_exactly(matrix: IntegerArray, right: IntegerArray) -> tuple[IntegerArray, int]:
    """Give X and d with ``matrix X = d right``, all of them integers.

    Parameters
    ----------
    matrix : (n, n) ndarray of int
    right : (n, k) ndarray of int

    Raises
    ------
    LinAlgError
        The matrix is singular.

    Examples
    --------
    >>> solved_exactly(np.array([[2, 0], [1, 3]], dtype=object), np.array([[1], [1]], dtype=object))
    (array([[3],
           [1]], dtype=object), 6)
    """
    n = len(matrix)
    work = np.hstack([matrix, right])
    divisor = _eliminate(work, n)
    if divisor == 0:
        msg = "The matrix is singular."
        raise np.linalg.LinAlgError(msg)
    return without_common_factor(work[:, n:], divisor)


def log_determinant(matrix: IntegerArray) -> float:
    """Return the natural logarithm of the size of a determinant of integers, -inf for a singular matrix.

    Examples
    --------
    >>> log_determinant(np.array([[0, 2**2000], [1, 5]], dtype=object)) / math.log(2.0)
    2000.0...
    """
    size = abs(_eliminate(matrix.copy(), len(matrix)))
    return math.log(size) if size else -math.inf


def _eliminate(work: IntegerArray, n: int) -> int:
    """Turn the first n columns into a multiple of the unit matrix, in place: that factor, or zero if singular."""
    previous = 1
    for k in range(n):
        found = np.flatnonzero(work[k:, k] != 0)
        if found.size == 0:
            return 0
        row = k + int(found[0])
        work[[k, row]] = work[[row, k]]
        pivot = int(work[k, k])
        others = np.delete(np.arange(n), k)
        rest = work[others, k + 1 :] * pivot - np.outer(work[others, k], work[k, k + 1 :])
        work[others, k + 1 :] = rest // previous
        previous = pivot
    return previous
