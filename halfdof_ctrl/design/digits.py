"""Matrices of decimal numbers of as many digits as one asks for, for problems of few states.

Python's `decimal` has them on every platform, without a further dependency; a product costs about a microsecond, so
that matrices of some twenty rows take milliseconds. Their use is inside `many_digits`.
"""

import decimal
import math
from contextlib import AbstractContextManager
from decimal import Decimal
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray

Decimals: TypeAlias = npt.NDArray[Any]  #: of `decimal.Decimal`

DIGITS_MOST_STEPS = 300  #: of a sign iteration; one on the imaginary axis never settles
DIGITS_SETTLED = Decimal("1e-20")  #: an entry that changes by less settles with the next step, to twice the digits
DIGITS_NEAR = 1e-2  #: changes from which on the iteration converges quadratically, and is not to be scaled any more


def many_digits(digits: int) -> AbstractContextManager[decimal.Context]:
    """Compute with so many digits inside a `with`, whatever the context of the caller is."""
    return decimal.localcontext(decimal.Context(prec=digits, rounding=decimal.ROUND_HALF_EVEN))


def decimals(matrix: FloatArray) -> Decimals:
    """Turn doubles into decimals, to all digits that the context has."""
    convert = decimal.getcontext().create_decimal_from_float
    found = np.empty(matrix.shape, dtype=object)
    found.ravel()[:] = [convert(value) for value in np.asarray(matrix, dtype=float).ravel().tolist()]
    return found


def doubles(matrix: Decimals) -> FloatArray:
    """Round decimals to doubles."""
    return np.array([float(value) for value in matrix.ravel().tolist()]).reshape(matrix.shape)


def inverse(matrix: Decimals) -> tuple[Decimals, float]:
    """Invert a matrix by Gauss's and Jordan's elimination; return it and log10 of its determinant's size.

    Raises
    ------
    ZeroDivisionError
        The matrix is singular.
    """
    n, size = len(matrix), 0.0
    work = np.concatenate([matrix, decimals(np.eye(n))], axis=1)
    for k in range(n):
        largest = np.abs(work[k:, k:n]).max(axis=1)
        part = [abs(value) / most if most else Decimal(0) for value, most in zip(work[k:, k], largest, strict=True)]
        pivot = k + part.index(max(part))
        if work[pivot, k] == 0:
            msg = "a singular matrix has no inverse"
            raise ZeroDivisionError(msg)
        work[[k, pivot]] = work[[pivot, k]]
        size += _log10(work[k, k])
        work[k] = work[k] / work[k, k]
        others = np.arange(n) != k
        work[others] = work[others] - np.multiply.outer(work[others, k], work[k])
    return work[:, n:], size


def _log10(value: Decimal) -> float:
    exponent = value.adjusted()
    return exponent + math.log10(abs(float(value.scaleb(-exponent))))


def matrix_sign(Z: Decimals) -> Decimals | None:
    """Return sign(Z) by Newton's iteration, scaled by determinants (J. D. Roberts, 1971; R. Byers, 1987).

    None where an eigenvalue is on the imaginary axis, or Z singular.
    """
    quadratic = False
    for _ in range(DIGITS_MOST_STEPS):
        try:
            inverted, size = inverse(Z)
        except ZeroDivisionError:
            return None
        factor = Decimal(1) if quadratic else _power(-size / len(Z))
        new = (Z * factor + inverted / factor) / 2
        change = _change(Z * factor, new)
        quadratic = quadratic or change < DIGITS_NEAR
        Z = new
        if change < DIGITS_SETTLED:
            return Z
    return None


def lyapunov(F: Decimals, sides: list[Decimals]) -> list[Decimals] | None:
    """Solve ``F^T Y + Y F = -S`` for several S by the sign of F; None where F is not stable."""
    quadratic = False
    for _ in range(DIGITS_MOST_STEPS):
        try:
            inverted, size = inverse(F)
        except ZeroDivisionError:
            return None
        factor = Decimal(1) if quadratic else _power(-size / len(F))
        new = (F * factor + inverted / factor) / 2
        sides = [(S * factor + inverted.T.dot(S).dot(inverted) / factor) / 2 for S in sides]
        change = _change(F * factor, new)
        quadratic = quadratic or change < DIGITS_NEAR
        F = new
        if change < DIGITS_SETTLED:
            stable = all(abs(value + 1) < DIGITS_NEAR for value in np.diagonal(F).tolist())
            return [S / 2 for S in sides] if stable else None
    return None


def _power(exponent: float) -> Decimal:
    """Return about ten to a power, however large."""
    whole = math.floor(exponent)
    return Decimal(10.0 ** (exponent - whole)).scaleb(whole)


def _change(old: Decimals, new: Decimals) -> Decimal:
    """Return the largest change of an entry against its size, or against the least that counts."""
    floor = np.abs(new).max() * Decimal(10) ** (-decimal.getcontext().prec // 2)
    changes = np.abs(new - old) / (np.abs(new) + floor) if floor else np.abs(new - old)
    return Decimal(changes.max())
