"""Exact rational transfer functions: numerators and denominator as integer polynomials, by python-flint.

A determinant of a polynomial matrix with integer coefficients is found at one point: at ``s = 2^bits``, beyond
twice the largest coefficient that it can have, its value shows all coefficients as digits (L. Kronecker's
substitution). So orders, growth at infinity, polynomial parts, eigenvalues and the index of every model whose
entries are floats follow without rounding.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, TypeAlias

import flint
import numpy as np
import numpy.typing as npt

from halfdof_ctrl import SecondOrderModel
from support.exact import NOTHING

ComplexArray = npt.NDArray[np.complex128]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Polynomial: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]
Integers: TypeAlias = list[list[list[int]]]  # coefficients of 1, s, s^2

DIGITS = 40  #: decimal digits that values have before they are rounded to floats


@dataclass(frozen=True, eq=False)
class RationalTransfer:
    """``H(s) = numerators / denominator``, p outputs and m inputs, over the integers."""

    numerators: list[list[flint.fmpz_poly]]  #: (p, m)
    denominator: flint.fmpz_poly  #: det P(s) up to a power of two, zero for a singular pencil

    @property
    def order(self) -> int:
        """Number of finite eigenvalues, -1 for a singular pencil."""
        return int(self.denominator.degree())

    @property
    def growth(self) -> IntArray:
        """(p, m) degree of the numerator minus that of the denominator, `NOTHING` for a zero channel."""
        return np.array(
            [[NOTHING if top.is_zero() else top.degree() - self.order for top in row] for row in self.numerators],
            dtype=np.int64,
        )

    def polynomial_part(self) -> tuple[FloatArray, ...]:
        """Give D_1, D_2, ..., the (p, m) coefficients of s, s^2, ... of H(s), without zeros at the end."""
        most = max(int(self.growth.max()), 0)
        parts = np.zeros((most + 1, *self.growth.shape))
        bottom = flint.fmpq_poly(self.denominator)
        for i, row in enumerate(self.numerators):
            for j, top in enumerate(row):
                for power, value in enumerate((flint.fmpq_poly(top) // bottom).coeffs()):
                    parts[power, i, j] = float(Fraction(int(value.p), int(value.q)))
        return tuple(parts[1:])

    def at(self, points: npt.ArrayLike) -> ComplexArray:
        """Evaluate H(s) at complex floats, rounded once: (p, m, k)."""
        return np.stack([self._at(complex(s)) for s in np.atleast_1d(np.asarray(points))], axis=2)

    def eigenvalues(self) -> tuple[ComplexArray, IntArray]:
        """Give the distinct finite eigenvalues, certified to the last digit, and how often each occurs."""
        roots: Any = self.denominator.complex_roots() if self.order > 0 else []
        values = np.array([complex(root) for root, _ in roots], dtype=np.complex128)
        multiplicities = np.array([count for _, count in roots], dtype=np.int64)
        return values, multiplicities

    def characteristic(self, points: npt.ArrayLike) -> tuple[ComplexArray, FloatArray]:
        """Give sign and logarithm of the monic polynomial of the finite eigenvalues, as `numpy.linalg.slogdet`."""
        signs, logs = [], []
        for s in np.atleast_1d(np.asarray(points)):
            value = _value(self.denominator, complex(s)) / flint.acb(self.denominator.leading_coefficient())
            size = abs(value)
            sign = value / flint.acb(size)
            signs.append(complex(float(sign.real), float(sign.imag)))
            logs.append(float(size.log()))
        return np.array(signs), np.array(logs)

    def _at(self, s: complex) -> ComplexArray:
        bottom = _value(self.denominator, s)
        value = np.zeros(self.growth.shape, dtype=np.complex128)
        for i, row in enumerate(self.numerators):
            for j, top in enumerate(row):
                ratio = _value(top, s) / bottom
                value[i, j] = complex(float(ratio.real), float(ratio.imag))
        return value


def rational_transfer(model: SecondOrderModel) -> RationalTransfer:
    """Find equation (1) as polynomials; for a singular pencil the denominator is zero and no numerators are given."""
    P, B = _integers(model.quadratics.P, model.quadratics.B)
    outputs = model.quadratics.F, model.quadratics.D
    found = _transfer(P, B, *_integers(*outputs))
    return RationalTransfer(found.numerators, found.denominator * (1 << _exponent(outputs)))


def pencil_index(M: npt.ArrayLike, C: npt.ArrayLike, K: npt.ArrayLike) -> int:
    """Find the index of the first-order pencil in q and w, M = U V and w = V q': one more than its resolvent grows.

    With q from ``P q = f + s U g`` and ``w = s V q - g`` the resolvent is a transfer function of second order. Here
    the rows of V, and with them w and g, are multiplied by integers that make V an integer matrix.
    """
    (P,) = _integers((K, C, M))
    n = len(P[0])
    U, V, factors = _rank_factors(P[2])
    r = len(factors)
    unit, nothing = _diagonal([1] * n), [[0] * n for _ in range(n)]
    B = [[*row, *[0] * r] for row in unit], [[*row, *right] for row, right in zip(nothing, U, strict=True)]
    F = [*unit, *[[0] * n for _ in range(r)]], [*nothing, *V]
    corner = _diagonal([0] * n + [-factor for factor in factors])
    no_B, no_F, no_D = (
        [[0] * columns for _ in range(rows)] for rows, columns in ((n, n + r), (n + r, n), (n + r, n + r))
    )
    resolvent = _transfer(P, [*B, no_B], [*F, no_F], [corner, no_D, no_D])
    return max(int(resolvent.growth.max()) + 1, 0)


def _transfer(P: Integers, B: Integers, F: Integers, D: Integers) -> RationalTransfer:
    """Find ``F P^-1 B + D`` for quadratic matrix polynomials with integer coefficients."""
    bits = _bits([*_rows(P, B), *_rows(F, D)])
    point = 1 << bits
    matrix = _evaluated(P, point)
    determinant = matrix.det()
    if determinant == 0:
        return RationalTransfer([], flint.fmpz_poly([]))
    motion: Any = matrix.solve(_evaluated(B, point))
    response: flint.fmpq_mat = flint.fmpq_mat(_evaluated(F, point)) * motion + flint.fmpq_mat(_evaluated(D, point))
    tops = response * flint.fmpq(determinant)  # integers, by Cramer's rule
    return RationalTransfer(
        [[_digits(int(tops[i, j].p), bits) for j in range(tops.ncols())] for i in range(tops.nrows())],
        _digits(int(determinant), bits),
    )


def _rank_factors(M: list[list[int]]) -> tuple[list[list[int]], list[list[int]], list[int]]:
    """Factor M = U diag(factors)^-1 V exactly over the integers, U some columns of M."""
    n = len(M)
    reduced, rank = flint.fmpq_mat(flint.fmpz_mat(M)).rref()
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    factors = [math.lcm(*[int(reduced[i, j].q) for j in range(n)]) for i in range(rank)]
    V = [[int((reduced[i, j] * factors[i]).p) for j in range(n)] for i in range(rank)]
    return [[row[pivot] for pivot in pivots] for row in M], V, factors


def _diagonal(values: list[int]) -> list[list[int]]:
    return [[value if i == j else 0 for j in range(len(values))] for i, value in enumerate(values)]


def free_dofs(M: npt.ArrayLike, C: npt.ArrayLike, K: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Tell which DOFs take part in motions ``P(s) q(s) = 0`` at every s."""
    (P,) = _integers((K, C, M))
    matrix = flint.fmpq_mat(_evaluated(P, 1 << _bits(_rows(P))))
    reduced, rank = matrix.rref()
    n = matrix.ncols()
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    others = [j for j in range(n) if j not in pivots]
    involved = np.zeros(n, dtype=np.bool_)
    involved[others] = True
    for i, pivot in enumerate(pivots):
        involved[pivot] = any(reduced[i, j] != 0 for j in others)
    return involved


def _exponent(polynomials: tuple[Polynomial, ...]) -> int:
    """Give the power of two that turns all entries into integers."""
    entries = np.concatenate([np.asarray(matrix, dtype=float).ravel() for parts in polynomials for matrix in parts])
    denominators = [Fraction(value).denominator for value in entries[entries % 1.0 != 0.0].tolist()]
    return max((denominator.bit_length() - 1 for denominator in denominators), default=0)


def _integers(*polynomials: Polynomial) -> list[Integers]:
    """Multiply matrix polynomials by a common power of two that makes all entries integers."""
    factor = 1 << _exponent(polynomials)
    return [
        [
            [[int(Fraction(x) * factor) for x in row] for row in np.asarray(matrix, dtype=float).tolist()]
            for matrix in parts
        ]
        for parts in polynomials
    ]


def _rows(*polynomials: Integers) -> list[int]:
    """Give for each row, polynomials side by side, the sum of the sizes of all coefficients."""
    sums = [[sum(map(abs, row)) for row in matrix] for parts in polynomials for matrix in parts]
    return [max(sum(values), 1) for values in zip(*sums, strict=True)]


def _bits(row_sums: list[int]) -> int:
    """Bound every minor: no coefficient is larger than the product of the row sums."""
    return math.prod(row_sums).bit_length() + 2


def _evaluated(parts: Integers, point: int) -> flint.fmpz_mat:
    """Evaluate a matrix polynomial at an integer."""
    constant, linear, quadratic = parts
    return flint.fmpz_mat(
        [
            [k + point * (c + point * m) for k, c, m in zip(*rows, strict=True)]
            for rows in zip(constant, linear, quadratic, strict=True)
        ]
    )


def _digits(value: int, bits: int) -> flint.fmpz_poly:
    """Read the coefficients of a polynomial with integer coefficients from its value at 2^bits."""
    negative, value = value < 0, abs(value)
    half, mask = 1 << (bits - 1), (1 << bits) - 1
    coefficients = []
    while value:
        digit = value & mask
        value >>= bits
        if digit >= half:
            digit -= 1 << bits
            value += 1
        coefficients.append(-digit if negative else digit)
    return flint.fmpz_poly(coefficients)


def _value(polynomial: flint.fmpz_poly, s: complex) -> flint.acb:
    """Evaluate at a complex float, with as many digits as cancellation asks for."""
    precision = 256
    while True:
        with flint.ctx.workprec(precision):
            value = flint.acb_poly(polynomial)(flint.acb(s.real, s.imag))
            if polynomial.is_zero() or (abs(value).rel_accuracy_bits() > math.log2(10.0) * DIGITS):
                return value
        if precision > 1 << 20:
            return flint.acb(0)  # zero to a million bits
        precision *= 2
