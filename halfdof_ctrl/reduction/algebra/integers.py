"""Exact arithmetic on floating-point numbers, which are integers times powers of two.

Arrays of Python integers (numpy dtype object) carry a denominator beside them where they need one. The solve is
fraction-free elimination: every number in it is a minor of the matrix, so it stays as short as the answer is
(E. H. Bareiss, Sylvester's identity and multistep integer-preserving Gaussian elimination, 1968).

Ranks are those of remainders by a prime. Since numbers are few digits times powers of two, as units are that round
nothing, these must not be alike: 2 is a primitive root of the prime. By 2^31 - 1 the remainder of 2^31 is 1.
"""

import math
from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray

IntegerArray: TypeAlias = npt.NDArray[np.object_]

PRIME = 1_915_823_501  #: so that products of remainders fit in 64 bits; all smaller powers of two differ, see above
ANY_POINT = 1_322_336_119  #: a remainder at which nothing happens but by chance
UNROUNDED_BITS = 51  #: of a number that was not rounded, at most: the last two of a double are zero
PENCIL_REMAINDERS = (1_234_567_891, 987_654_321, 19_937)  #: at which a companion pencil is inverted, the first that can
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


def least_rank(values: FloatArray) -> int:
    """Return a rank that floating-point numbers have at least, and mostly have: that of their remainders by a prime.

    Examples
    --------
    >>> least_rank(np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-50]])), least_rank(np.ones((2, 2)))
    (2, 1)
    """
    work = np.asarray(as_integers(values)[0] % PRIME, dtype=np.int64)
    return _reduced(work, work.shape[1])[1]


def independent_of(matrix: IntegerArray, order: Iterable[int], most: int | None = None) -> list[int]:
    """Return rows that are independent of those before them in an order, by remainders of a prime.

    They are so for certain; one chance in 10^8 or so has it that another one is missed.

    Parameters
    ----------
    matrix : (n, k) ndarray of int
    order : iterable of int
        Of its rows.
    most : int, optional
        How many are enough; by default all.

    Examples
    --------
    >>> independent_of(np.array([[1, 2], [2, 4], [0, 3]], dtype=object), [1, 0, 2])
    [1, 2]
    """
    work = np.asarray(matrix % PRIME, dtype=np.int64)
    found: list[int] = []
    pivots: list[tuple[int, npt.NDArray[np.int64]]] = []
    for row in order:
        rest = work[row].copy()
        for column, pivot in pivots:
            rest = (rest - int(rest[column]) * pivot % PRIME) % PRIME
        places = np.flatnonzero(rest)
        if places.size:
            column = int(places[0])
            pivots.append((column, rest * pow(int(rest[column]), -1, PRIME) % PRIME))
            found.append(row)
            if len(found) in {most, work.shape[1]}:
                break
    return found


def is_regular(coefficients: FloatArray) -> bool:
    """Return whether ``det(P_0 + P_1 s + P_2 s^2)`` of floating-point numbers does not vanish identically.

    By remainders at one point: what is called regular is, for certain; one chance in 10^6 or so has it that another is.

    Examples
    --------
    >>> small = np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-50]])
    >>> is_regular(np.stack([small, 0 * small, 0 * small])), is_regular(np.ones((3, 2, 2)))
    (True, False)
    """
    remainders = np.asarray(as_integers(coefficients)[0] % PRIME, dtype=np.int64)
    value = np.zeros_like(remainders[0])
    for part in remainders[::-1]:
        value = (value * ANY_POINT + part) % PRIME
    return _reduced(value, len(value))[1] == len(value)


def degree_of_determinant(coefficients: FloatArray) -> int:
    """Return the degree of ``det(P_0 + P_1 s + P_2 s^2)``, -1 if that vanishes at every s.

    By remainders: as many as the eigenvalues besides 0 that ``(sigma E - A)^-1 E`` of the companion pencil has, which
    is the rank of its powers once that falls no more. The degree is so large for certain; one chance in 10^6 or so has
    it that a higher one is missed.

    Parameters
    ----------
    coefficients : (3, n, n) ndarray

    Examples
    --------
    >>> degree_of_determinant(np.array([[[1.0, 1.0], [1.0, 1.0]], np.zeros((2, 2)), [[0.0, 0.0], [0.0, 2.0**-60]]]))
    2
    """
    K, C, M = np.asarray(as_integers(coefficients)[0] % PRIME, dtype=np.int64)
    n = len(K)
    unit, none = np.eye(n, dtype=np.int64), np.zeros((n, n), dtype=np.int64)
    E = np.block([[unit, none], [none, M]])
    for shift in PENCIL_REMAINDERS:
        shifted = np.block([[shift * unit, -unit], [K, (shift * M + C) % PRIME]]) % PRIME
        reduced, rank = _reduced(np.hstack([shifted, E]), 2 * n)
        if rank == 2 * n:
            break
    else:  # a regular pencil is singular at one point in a hundred million
        return -1
    power, rank = reduced[:, 2 * n :], 2 * n
    while (left := _reduced(power.copy(), 2 * n)[1]) < rank:
        power, rank = _product(power, power), left
    return rank


def _reduced(work: npt.NDArray[np.int64], columns: int) -> tuple[npt.NDArray[np.int64], int]:
    """Bring the first columns of remainders, which are overwritten, to reduced echelon form, and give their rank."""
    rank = 0
    for column in range(columns):
        found = np.flatnonzero(work[rank:, column])
        if found.size == 0:
            continue
        work[[rank, rank + found[0]]] = work[[rank + found[0], rank]]
        pivot = work[rank] * pow(int(work[rank, column]), -1, PRIME) % PRIME
        factors = work[:, column].copy()
        changed = np.flatnonzero(factors)
        work[changed, column:] = (work[changed, column:] - factors[changed, None] * pivot[column:] % PRIME) % PRIME
        work[rank] = pivot
        rank += 1
        if rank == len(work):
            break
    return work, rank


def _product(one: npt.NDArray[np.int64], other: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Multiply remainders."""
    total = np.zeros((len(one), other.shape[1]), dtype=np.int64)
    for column, row in zip(one.T, other, strict=True):
        total = (total + column[:, None] * row % PRIME) % PRIME
    return total


def has_short_entries(values: FloatArray, bits: int = UNROUNDED_BITS) -> bool:
    """Return whether no entry has more than some bits, by default so many that nearly all that were rounded have more.

    Examples
    --------
    >>> has_short_entries(np.array([[3.0, 1.0 + 2.0**-45]])), has_short_entries(np.array([[0.1, 3.0]]))
    (True, False)
    """
    return not np.any(np.ldexp(np.frexp(values)[0], bits) % 1.0)


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
