"""What a linear system does within a step of time, in about twice the working precision.

    x(h) = e^Z x(0) + h phi_1(Z) B u(0) + h phi_2(Z) B (u(h) - u(0)),    Z = A h,    for u linear in between
    phi_1(Z) = (e^Z - 1) / Z,    phi_2(Z) = (phi_1(Z) - 1) / Z

A solver in doubles leaves u |Z| in e^Z. In a response that lasts for many periods of its slowest mode, while others are
a million times faster, these errors add up to the seventh digit. Here 2^-95 |Z| is left: Taylor's series for Z / 2^s,
and s times

    F <- 2 F + F^2,    phi_1 B <- phi_1 B + F phi_1 B / 2,    phi_2 B <- (2 phi_2 B + F phi_2 B + phi_1 B) / 4

for F = e^Z - 1, which keeps slow modes beside the one.
"""

import math
from fractions import Fraction

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.double_double import Double2, added, matrix_product, two_product, two_sum

TAYLOR_SIZE = 0.5  #: norm of Z up to which Taylor's series is summed ...
TAYLOR_TERMS = 24  #: ... of so many terms: the next is below 2^-110
TAYLOR_POWERS = 5  #: of Z that are formed, higher ones as products (M. S. Paterson and L. J. Stockmeyer, 1973)


def exact_step(A: FloatArray, B: FloatArray, h: float) -> tuple[Double2, Double2, Double2]:
    """Return ``e^(A h) - 1``, ``h phi_1(A h) B`` and ``h phi_2(A h) B``, each as high + low.

    Parameters
    ----------
    A, B : (n, n), (n, m) ndarrays
        A is balanced first by the caller: errors are relative to the largest entries of its powers.
    h : float

    Returns
    -------
    tuple of Double2
        (n, n), (n, m) and (n, m); not finite where the motion grows beyond the largest number.

    Examples
    --------
    A rate of 2^-40 changes a state by 2^-40 + 2^-81 of it in a unit of time:

    >>> (high, low), _, _ = exact_step(np.array([[2.0**-40]]), np.ones((1, 1)), 1.0)
    >>> float(high[0, 0] - 2.0**-40) == 2.0**-81
    True
    """
    n, m = B.shape
    size = float(np.abs(A).sum(axis=0).max(initial=0.0)) * abs(h)
    if not math.isfinite(size):
        return tuple((np.full(shape, np.nan), np.zeros(shape)) for shape in ((n, n), (n, m), (n, m)))  # type: ignore[return-value]
    doublings = max(0, math.frexp(size / TAYLOR_SIZE)[1])
    X = two_product(np.ldexp(A, -doublings), np.full_like(A, h))
    second = _series(X)
    first = added(_product(X, second), (np.eye(n), np.zeros((n, n))))
    F, driven = _product(X, first), two_product(B, np.full_like(B, h))
    first, second = _product(first, driven), _product(second, driven)
    for _ in range(doublings):
        further = _product(F, _beside(F, first, second))
        of_F, of_first, of_second = (
            _columns(further, part) for part in (slice(n), slice(n, n + m), slice(n + m, None))
        )
        F = added(_scaled(F, 2.0), of_F)
        second = _scaled(added(added(_scaled(second, 2.0), of_second), first), 0.25)
        first = added(first, _scaled(of_first, 0.5))
    return F, first, second


def _series(X: Double2) -> Double2:
    """Sum Taylor's series of phi_2(X)."""
    n = len(X[0])
    powers: list[Double2] = [(np.eye(n), np.zeros((n, n))), X]
    while len(powers) <= TAYLOR_POWERS:
        powers.append(_product(powers[-1], X))
    total: Double2 = np.zeros((n, n)), np.zeros((n, n))
    for start in range(TAYLOR_TERMS - TAYLOR_TERMS % TAYLOR_POWERS, -1, -TAYLOR_POWERS):
        if total[0].any():
            total = _product(total, powers[TAYLOR_POWERS])
        for k in range(start, min(start + TAYLOR_POWERS, TAYLOR_TERMS + 1)):
            total = added(total, _times(powers[k - start], Fraction(1, math.factorial(k + 2))))
    return total


def _product(x: Double2, y: Double2) -> Double2:
    high, low = matrix_product(x[0], y[0])
    return two_sum(high, low + (x[0] @ y[1] + x[1] @ y[0]))


def _times(x: Double2, factor: Fraction) -> Double2:
    high = float(factor)
    value, rest = two_product(x[0], np.full_like(x[0], high))
    return two_sum(value, rest + (x[0] * float(factor - Fraction(high)) + x[1] * high))


def _scaled(x: Double2, power_of_two: float) -> Double2:
    return x[0] * power_of_two, x[1] * power_of_two


def _beside(*parts: Double2) -> Double2:
    return np.hstack([part[0] for part in parts]), np.hstack([part[1] for part in parts])


def _columns(x: Double2, part: slice) -> Double2:
    return x[0][:, part], x[1][:, part]
