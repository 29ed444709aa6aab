"""Responses in hundreds of bits, where sums of twice the working precision do not tell what is lost.

Refinement fails where a matrix is nearly singular at a point, and its sums are noise where terms cancel by more than
what two doubles hold. So elimination is done once more, in integers that stand for fixed-point numbers: the numbers
that were given are exact in them, and what rounding does in 400 bits more is nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, Matrix, as_dense
from halfdof_ctrl.reduction.algebra.integers import IntegerArray, as_floats, as_integers
from halfdof_ctrl.reduction.method.refined_answers import Equations

MORE_BITS = 400  #: after the last one of the numbers that were given
LONGEST_ELIMINATION = 4e5  #: products of long numbers, a fifth of a second


@dataclass(frozen=True, slots=True, eq=False)
class _AtPoint:
    """Real and imaginary part of a matrix polynomial at a point, times a power of two."""

    real: IntegerArray
    imag: IntegerArray
    power: int

    @classmethod
    def of(cls, coefficients: Sequence[Matrix], omega: float) -> "_AtPoint":
        numerator, denominator = omega.as_integer_ratio()
        by = denominator.bit_length() - 1
        parts = [as_integers(np.asarray(as_dense(part))) for part in coefficients]
        power = max(own + k * by for k, (_, own) in enumerate(parts))
        real, imag = np.zeros_like(parts[0][0]), np.zeros_like(parts[0][0])
        for k, (integers, own) in enumerate(parts):
            term = (integers * numerator**k) << (power - own - k * by)
            term = -term if k % 4 > 1 else term  # powers of i
            real, imag = (real, imag + term) if k % 2 else (real + term, imag)
        return cls(real, imag, power)

    def doubled(self) -> IntegerArray:
        """Return the real matrix that acts on real and imaginary parts."""
        return np.block([[self.real, -self.imag], [self.imag, self.real]])


def long_responses(equations: Equations, omegas: Sequence[float]) -> list[ComplexArray | None]:
    """Return ``C(s) R(s)^-1 B(s) + D(s)`` at each ``s = i omega``, real and imaginary parts rounded once.

    None where it would take too long, where s is an eigenvalue, and beyond the range of doubles.

    Parameters
    ----------
    equations : Equations
    omegas : sequence of float
        [rad/s] of few bits, those that matter most first.

    Examples
    --------
    What ``1 / s`` and ``-1 / s`` leave of each other beside ``2^-80 s``, at s = i:

    >>> one, none = np.ones((1, 1)), np.zeros((1, 1))
    >>> R, B = np.eye(2), np.array([[1.0], [-1.0]])
    >>> long_responses(Equations(R=[0 * R, R], B=[B], C=[np.ones((1, 2))], D=[none, 2.0**-80 * one]), [1.0])
    [array([[0.+8.27180613e-25j]])]
    """
    n, m = equations.B[0].shape
    affordable = int(LONGEST_ELIMINATION / max(1.0, 4.0 * n**2 * (n + m)))
    return [
        _response(*(_AtPoint.of(part, omega) for part in (equations.R, equations.B, equations.C, equations.D)))
        if k < affordable
        else None
        for k, omega in enumerate(omegas)
    ]


def _response(R: _AtPoint, B: _AtPoint, C: _AtPoint, D: _AtPoint) -> ComplexArray | None:
    n, unit = len(R.real), R.power + MORE_BITS
    try:
        x = _solved(R.doubled() << MORE_BITS, np.vstack([B.real, B.imag]) << unit, unit)
        seen = (C.real @ x[:n] - C.imag @ x[n:], C.imag @ x[:n] + C.real @ x[n:])
        power = C.power + B.power + unit  # C R^-1 B = seen / 2^power, D = direct / 2^D.power
        most = max(power, D.power)
        real, imag = (
            as_floats((part << (most - power)) + (direct << (most - D.power)), 1 << most)
            for part, direct in zip(seen, (D.real, D.imag), strict=True)
        )
    except (ZeroDivisionError, OverflowError):
        return None
    return np.asarray(real + 1j * imag)


def _solved(matrix: IntegerArray, right: IntegerArray, unit: int) -> IntegerArray:
    """Solve ``matrix x = right``, numbers times 2^unit, by elimination with partial pivoting.

    Raises
    ------
    ZeroDivisionError
        The matrix is singular.
    """
    n = len(matrix)
    work = np.hstack([matrix, right])
    for k in range(n):
        row = k + int(np.abs(work[k:, k]).argmax())
        work[[k, row]] = work[[row, k]]
        factors = (work[k + 1 :, k] << unit) // work[k, k]
        work[k + 1 :, k + 1 :] -= np.outer(factors, work[k, k + 1 :]) >> unit
    x = work[:, n:]
    for k in reversed(range(n)):
        x[k] = ((x[k] - ((work[k, k + 1 : n] @ x[k + 1 :]) >> unit)) << unit) // work[k, k]
    return x
