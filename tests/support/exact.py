"""Exact rational arithmetic on second-order models, by python-flint: the oracle that rounds nothing.

A float is a rational number, so every model here has an exact determinant, order and transfer function.
"""

from collections.abc import Iterable
from fractions import Fraction

import flint
import numpy as np
import numpy.typing as npt

from halfdof_ctrl import SecondOrderModel

Rational = flint.fmpq_mat
NOTHING = -1000  # growth of a transfer function that is zero
HUGE = 120  # 2^120: beyond every coefficient that small integer matrices can have


def rational_matrix(array: npt.ArrayLike) -> Rational:
    """Turn a real matrix into rational numbers, exactly."""
    values = np.atleast_2d(np.asarray(array))
    if values.dtype.kind in "iu":
        return flint.fmpq_mat(flint.fmpz_mat(values.tolist()))
    ratios = [[float(value).as_integer_ratio() for value in row] for row in values]
    return flint.fmpq_mat([[flint.fmpq(*ratio) for ratio in row] for row in ratios])


def fraction(value: flint.fmpq) -> Fraction:
    """Turn a flint number into Python's."""
    return Fraction(int(value.p), int(value.q))


def determinant(M: npt.ArrayLike, C: npt.ArrayLike, K: npt.ArrayLike) -> flint.fmpq_poly:
    """Find ``det(K + C s + M s^2)``."""
    return polynomial_determinant([K, C, M])


def polynomial_determinant(coefficients: Iterable[npt.ArrayLike]) -> flint.fmpq_poly:
    """Find the determinant of a matrix polynomial by interpolation at as many integers as its degree needs."""
    parts = [rational_matrix(part) for part in coefficients]
    points = list(range((len(parts) - 1) * parts[0].nrows() + 1))
    return _interpolated(points, [_value(parts, s).det() for s in points])


def order(M: npt.ArrayLike, C: npt.ArrayLike, K: npt.ArrayLike) -> int:
    """Count the finite eigenvalues, the degree of the determinant; -1 for a singular pencil."""
    return int(determinant(M, C, K).degree())


def growth(model: SecondOrderModel) -> npt.NDArray[np.int64]:
    """Find the order of growth of each channel (p, m), from its exact values at two huge frequencies.

    `NOTHING` stands for channels that are zero.
    """
    near, far = (np.abs(_transfer_at(model, complex(2.0**power))) for power in (HUGE, HUGE + 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        powers = np.log2(far) - np.log2(near)
    return np.where(near == 0.0, NOTHING, np.round(np.where(near == 0.0, 0.0, powers))).astype(np.int64)


def transfer(model: SecondOrderModel, points: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """Evaluate equation (1) exactly at each point and round once: (p, m, k)."""
    values = [_transfer_at(model, complex(s)) for s in np.atleast_1d(np.asarray(points))]
    return np.stack(values, axis=2)


def leading_matrix_is_singular(M: npt.ArrayLike, C: npt.ArrayLike, K: npt.ArrayLike) -> bool:
    """Tell whether W of equation (2) is singular, with exact bases of the null spaces.

    Other bases of the same spaces multiply W by a nonsingular block diagonal matrix.
    """
    mass, damping, stiffness = rational_matrix(M), rational_matrix(C), rational_matrix(K)
    n = mass.nrows()
    massless = null_space(mass)
    static = massless * null_space(damping * massless) if massless.ncols() else massless
    half = _completed(static, massless)
    inertial = _completed(massless, rational_matrix(np.eye(n, dtype=int)))
    W = _beside([mass * inertial, damping * half, stiffness * static], n)
    return bool(W.det() == 0)


def null_space(matrix: Rational) -> Rational:
    """Give a basis of the null space, (columns, dimension)."""
    reduced, rank = matrix.rref()
    n = matrix.ncols()
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    free = [j for j in range(n) if j not in pivots]
    basis = flint.fmpq_mat(n, len(free))
    for k, j in enumerate(free):
        basis[j, k] = flint.fmpq(1)
        for i, pivot in enumerate(pivots):
            basis[pivot, k] = -reduced[i, j]
    return basis


def rank(*stacked: npt.ArrayLike) -> int:
    """Find the rank of matrices side by side."""
    return int(rational_matrix(np.hstack([np.asarray(matrix) for matrix in stacked])).rank())


def _completed(start: Rational, candidates: Rational) -> Rational:
    """Pick the columns of `candidates` that complete `start` to a basis of the span of both."""
    rows, taken = candidates.nrows(), start.ncols()
    reduced, rank_of_both = _beside([start, candidates], rows).rref()
    pivots = [next(j for j in range(reduced.ncols()) if reduced[i, j] != 0) for i in range(rank_of_both)]
    picked = [j - taken for j in pivots if j >= taken]
    columns = flint.fmpq_mat(rows, len(picked))
    for k, j in enumerate(picked):
        for i in range(rows):
            columns[i, k] = candidates[i, j]
    return columns


def _beside(blocks: list[Rational], rows: int) -> Rational:
    joined = flint.fmpq_mat(rows, sum(block.ncols() for block in blocks))
    first = 0
    for block in blocks:
        for i in range(rows):
            for j in range(block.ncols()):
                joined[i, first + j] = block[i, j]
        first += block.ncols()
    return joined


def _value(coefficients: list[Rational], s: int) -> Rational:
    value = coefficients[-1]
    for part in reversed(coefficients[:-1]):
        value = value * flint.fmpq(s) + part
    return value


def _interpolated(points: list[int], values: list[flint.fmpq]) -> flint.fmpq_poly:
    """Find the polynomial through the points by Newton's divided differences."""
    differences = list(values)
    for level in range(1, len(points)):
        for k in range(len(points) - 1, level - 1, -1):
            differences[k] = (differences[k] - differences[k - 1]) / (points[k] - points[k - level])
    polynomial = flint.fmpq_poly([0])
    for difference, point in zip(reversed(differences), reversed(points), strict=True):
        polynomial = polynomial * flint.fmpq_poly([-point, 1]) + flint.fmpq_poly([difference])
    return polynomial


def _transfer_at(model: SecondOrderModel, s: complex) -> npt.NDArray[np.complex128]:
    n, m, p = len(model.dofs), len(model.inputs), len(model.outputs)
    P = _polynomial((model.K, model.C, model.M), s)
    B = _polynomial((model.B, model.Bv, model.Ba), s)
    F = _polynomial((model.F, model.G, model.H), s)
    D = _polynomial((model.D, model.Dv, model.Da), s)
    first = flint.fmpq_mat(2 * n, m)
    for i in range(2 * n):
        for j in range(m):
            first[i, j] = B[i, j]
    motion = F * P.solve(first)
    value = np.empty((p, m), dtype=np.complex128)
    for i in range(p):
        for j in range(m):
            real, imaginary = motion[i, j] + D[i, j], motion[p + i, j] + D[p + i, j]
            value[i, j] = complex(float(fraction(real)), float(fraction(imaginary)))
    return value


def _polynomial(coefficients: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike], s: complex) -> Rational:
    """Evaluate a quadratic matrix polynomial, complex numbers written as [[re, -im], [im, re]]."""
    columns = np.asarray(coefficients[0]).shape[1]
    unit = np.eye(columns)
    times_s = rational_matrix(np.block([[s.real * unit, -s.imag * unit], [s.imag * unit, s.real * unit]]))
    constant, linear, quadratic = (_real_form(coefficient) for coefficient in coefficients)
    return constant + linear * times_s + quadratic * times_s * times_s


def _real_form(matrix: npt.ArrayLike) -> Rational:
    array = np.asarray(matrix)
    return rational_matrix(np.block([[array.real, -array.imag], [array.imag, array.real]]))
