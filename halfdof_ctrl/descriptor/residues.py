"""Linear algebra modulo a prime, for the oracle: what doubles say exactly, in the time of a few matrix products.

A double is an integer times a power of two, and both have a residue modulo any odd prime p. Sums and products of
residues are residues of sums and products; so a rank modulo p is at most the exact rank, and lower only if p divides
every minor of that order, which for a prime of 31 bits chosen without regard to the numbers happens once in 10^6 for a
thousand unknowns. With p = 1 modulo 4 there is a square root of -1, so complex matrices have residues as well.

Products are exact in floating point: the factors are cut in halves of 16 bits, of which a matrix product sums up to
2^19 without rounding, in whatever order.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import DenseMatrix

Residues: TypeAlias = npt.NDArray[np.int64]  #: entries from 0 to p - 1
Places: TypeAlias = npt.NDArray[np.intp]

PRIMES = (2147483629, 2147483549)  #: the largest below 2^31 that are 1 modulo 4
MANTISSA = 53  #: bits of a double
HALF_POINTS = 16  #: bits of the lower half of a residue
PANEL = 48  #: columns that are searched for pivots at a time


def residues(matrix: DenseMatrix, p: int) -> Residues:
    """Return the residues of the doubles of a real or complex matrix.

    Examples
    --------
    One half is the inverse of two:

    >>> int(residues(np.array([[0.5]]), 2147483629)[0, 0]) * 2 % 2147483629
    1
    """
    if np.iscomplexobj(matrix):
        return np.asarray((residues(matrix.real, p) + residues(matrix.imag, p) * _root_of_minus_one(p)) % p)
    mantissa, exponent = np.frexp(np.asarray(matrix, dtype=float))
    integers = np.ldexp(mantissa, MANTISSA).astype(np.int64) % p
    exponents, places = np.unique(exponent, return_inverse=True)
    powers = np.array([pow(2, int(power) - MANTISSA, p) for power in exponents], dtype=np.int64)
    return np.asarray(integers * powers[places].reshape(matrix.shape) % p)


def product(left: Residues, right: Residues, p: int) -> Residues:
    """Return the product of two matrices of residues."""
    if 0 in (left.shape[0], *right.shape):
        return np.zeros((left.shape[0], right.shape[1]), dtype=np.int64)
    mask = (1 << HALF_POINTS) - 1
    high, low = (left >> HALF_POINTS).astype(float), (left & mask).astype(float)
    top, bottom = (right >> HALF_POINTS).astype(float), (right & mask).astype(float)
    first, last = high @ top, low @ bottom
    middle = (high + low) @ (top + bottom) - first - last
    shift = 1 << HALF_POINTS
    upper = (first.astype(np.int64) % p * shift + middle.astype(np.int64)) % p
    return np.asarray((upper * shift + last.astype(np.int64)) % p)


def reduced(matrix: Residues, p: int, columns: int | None = None) -> tuple[Residues, Places]:
    """Return the reduced row echelon form without its zero rows, and its pivot columns.

    Parameters
    ----------
    matrix : (k, l) int64 ndarray
    p : int
        Prime.
    columns : int, optional
        Pivots are looked for in so many of the first columns; the rest goes along.

    Returns
    -------
    (r, l) int64 ndarray
        One in pivot column i of row i, zeros elsewhere in pivot columns.
    (r,) intp ndarray
        Pivot columns in rising order.
    """
    work = matrix.copy()
    last = work.shape[1] if columns is None else columns
    is_free = np.ones(work.shape[0], dtype=bool)
    pivot_rows: list[int] = []
    pivot_columns: list[int] = []
    for start in range(0, last, PANEL):
        free = np.flatnonzero(is_free)
        if not free.size:
            break
        rows, places = _pivots(work[free, start : min(start + PANEL, last)], p)
        if not rows:
            continue
        chosen, among = free[rows], np.array(places, dtype=np.intp) + start
        inverse = _small_inverse(work[np.ix_(chosen, among)], p)
        turned = product(inverse, work[chosen], p)
        factors = work[:, among].copy()
        factors[chosen] = 0
        touched = np.flatnonzero(factors.any(axis=1))
        if touched.size:
            work[touched] = (work[touched] - product(factors[touched], turned, p)) % p
        work[chosen] = turned
        is_free[chosen] = False
        pivot_rows += chosen.tolist()
        pivot_columns += among.tolist()
    order = np.argsort(np.array(pivot_columns, dtype=np.intp))
    return work[np.array(pivot_rows, dtype=np.intp)[order]], np.array(pivot_columns, dtype=np.intp)[order]


def rank(matrix: Residues, p: int) -> int:
    """Return the rank modulo p, which is at most the exact one."""
    return int(reduced(matrix, p)[1].size)


def characteristic(matrix: Residues, p: int) -> Residues:
    """Return the coefficients of ``det(x I - N)``, the highest first, through a Hessenberg form."""
    H = _hessenberg(matrix, p)
    n = len(H)
    polynomials = np.zeros((n + 1, n + 1), dtype=np.int64)  # of the leading blocks, the lowest coefficient first
    polynomials[0, 0] = 1
    for k in range(n):
        shifted = np.roll(polynomials[k], 1)
        factors = np.zeros(k + 1, dtype=np.int64)
        chain = 1
        for i in range(k, -1, -1):
            factors[i] = H[i, k] * chain % p
            if i:
                chain = chain * int(H[i, i - 1]) % p
            if chain == 0:
                break
        polynomials[k + 1] = (shifted - product(factors[None], polynomials[: k + 1], p)[0]) % p
    return np.asarray(polynomials[n][::-1])


def common_divisor(first: Residues, second: Residues, p: int) -> Residues:
    """Return the monic greatest common divisor of two polynomials, the highest coefficient first."""
    first, second = _monic(first, p), _monic(second, p)
    while second.size:
        while first.size >= second.size:
            first = first.copy()
            first[: second.size] = (first[: second.size] - first[0] * second) % p
            first = np.asarray(np.trim_zeros(first, "f"))
        first, second = second, _monic(first, p)
    return first


def multiplicity(polynomial: Residues, root: int, p: int) -> int:
    """Return how often a polynomial, the highest coefficient first, has a root."""
    count, coefficients = 0, [int(coefficient) for coefficient in polynomial]
    while len(coefficients) > 1:
        quotient = [0]
        for coefficient in coefficients:
            quotient.append((quotient[-1] * root + coefficient) % p)
        if quotient.pop():
            break
        count, coefficients = count + 1, quotient[1:]
    return count


def _monic(polynomial: Residues, p: int) -> Residues:
    trimmed: Residues = np.asarray(np.trim_zeros(polynomial, "f"))
    return np.asarray(trimmed * pow(int(trimmed[0]), -1, p) % p) if trimmed.size else trimmed


def _pivots(panel: Residues, p: int) -> tuple[list[int], list[int]]:
    """Return rows and columns of a largest nonsingular part of a panel, column by column."""
    rows: list[int] = []
    places: list[int] = []
    is_free = np.ones(len(panel), dtype=bool)
    for place in range(panel.shape[1]):
        candidates = np.flatnonzero((panel[:, place] != 0) & is_free)
        if not candidates.size:
            continue
        row = int(candidates[0])
        is_free[row] = False
        rows.append(row)
        places.append(place)
        others = candidates[1:]
        if others.size:
            factors = panel[others, place] * pow(int(panel[row, place]), -1, p) % p
            rest = slice(place, None)
            panel[others, rest] = (panel[others, rest] - factors[:, None] * panel[row, rest] % p) % p
    return rows, places


def _small_inverse(matrix: Residues, p: int) -> Residues:
    """Invert a nonsingular matrix of at most `PANEL` rows by elimination."""
    n = len(matrix)
    work = np.hstack([matrix, np.eye(n, dtype=np.int64)])
    for k in range(n):
        row = k + int(np.flatnonzero(work[k:, k])[0])
        if row != k:
            work[[k, row]] = work[[row, k]]
        work[k] = work[k] * pow(int(work[k, k]), -1, p) % p
        factors = work[:, k].copy()
        factors[k] = 0
        work = (work - factors[:, None] * work[k] % p) % p
    return work[:, n:]


def _hessenberg(matrix: Residues, p: int) -> Residues:
    """Bring a matrix to upper Hessenberg form by similarities."""
    H = matrix.copy()
    for k in range(len(H) - 2):
        below = np.flatnonzero(H[k + 1 :, k])
        if not below.size:
            continue
        row = k + 1 + int(below[0])
        if row != k + 1:
            H[[k + 1, row]] = H[[row, k + 1]]
            H[:, [k + 1, row]] = H[:, [row, k + 1]]
        factors = H[k + 2 :, k] * pow(int(H[k + 1, k]), -1, p) % p
        touched = np.flatnonzero(factors)
        if touched.size:
            rows, factors = touched + k + 2, factors[touched]
            H[rows, k:] = (H[rows, k:] - factors[:, None] * H[k + 1, k:] % p) % p
            H[:, k + 1] = (H[:, k + 1] + product(H[:, rows], factors[:, None], p)[:, 0]) % p
    return H


def _root_of_minus_one(p: int) -> int:
    """Return a square root of -1 modulo a prime that is 1 modulo 4."""
    base = 2
    while pow(base, (p - 1) // 2, p) == 1:
        base += 1
    return pow(base, (p - 1) // 4, p)
