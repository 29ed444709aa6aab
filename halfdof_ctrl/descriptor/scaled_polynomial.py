"""A matrix polynomial in units in which its eigenvalues and entries are near one, for the oracle.

The unit of time is the geometric mean of the tropical eigenvalues: with the size of the largest product of entries that
takes one of each row and column, ``det P(s)`` for small s is about ``c_l |s|^l`` and for large s about ``c_h |s|^h``,
so ``(c_l / c_h)^(1 / (h - l))`` is the mean size of its h - l roots. Both products are assignment problems. Unlike
scales by norms this one does not depend on the units of rows and columns (S. Gaubert and M. Sharify, 2009).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.descriptor.balancing import scaling_powers

FAR_SCALE = 1e5  #: binary logarithm of frequencies at which the lowest and the highest terms of each entry stand alone
ABSENT_WEIGHT = 1e9  #: of a place without entry, in the logarithm
POLYNOMIAL_ENTRIES = 2**20  #: complex entries of P(s) held at a time (16 MB)
SWEEPS = 3  #: of scaling P(s) at a point, rows and columns in turns


@dataclass(frozen=True, slots=True, eq=False)
class ScaledPolynomial:
    """``R_0 + R_1 s + R_2 s^2`` in balanced rows and columns and in its own unit of time."""

    coefficients: tuple[DenseMatrix, DenseMatrix, DenseMatrix]  #: (n, n) of 1, s, s^2
    unit: float  #: eigenvalues times this are in rad/s, a power of two

    @classmethod
    def of(cls, coefficients: Sequence[DenseMatrix]) -> "ScaledPolynomial":
        """Scale by powers of two, which rounds nothing."""
        R0, R1, R2 = coefficients
        return cls((R0, R1, R2), 1.0).in_unit(mean_frequency(coefficients))

    def in_unit(self, unit: float) -> "ScaledPolynomial":
        """Take another unit of time, relative to this one, and balance rows and columns in it."""
        R0, R1, R2 = self.coefficients
        R1, R2 = R1 * unit, R2 * unit * unit  # unit^2 may overflow
        rows, columns = scaling_powers(np.maximum(np.maximum(np.abs(R0), np.abs(R1)), np.abs(R2)))
        scale = rows[:, None] * columns
        return ScaledPolynomial((R0 * scale, R1 * scale, R2 * scale), self.unit * unit)

    @property
    def is_real(self) -> bool:
        """Whether eigenvalues come in conjugate pairs."""
        return not any(np.iscomplexobj(part) for part in self.coefficients)

    def at(self, points: ComplexArray) -> ComplexArray:
        """Return P(s) at every point, (k, n, n)."""
        R0, R1, R2 = self.coefficients
        s = points[:, None, None]
        return np.asarray(R0 + s * (R1 + s * R2), dtype=np.complex128)

    def derivative_at(self, points: ComplexArray) -> ComplexArray:
        """Return P'(s) at every point, (k, n, n)."""
        _, R1, R2 = self.coefficients
        return np.asarray(R1 + 2.0 * points[:, None, None] * R2, dtype=np.complex128)

    def sizes_at(self, s: complex) -> FloatArray:
        """Return ``|R_0| + |s| |R_1| + |s|^2 |R_2|``."""
        R0, R1, R2 = (np.abs(part) for part in self.coefficients)
        return np.asarray(R0 + abs(s) * (R1 + abs(s) * R2))

    def logarithmic_derivative(self, points: ComplexArray) -> ComplexArray:
        """Return ``p'/p = tr P(s)^-1 P'(s)`` of p = det P at every point, nan where P(s) is exactly singular."""
        found = np.full(points.shape, np.nan, dtype=np.complex128)
        batch = max(1, POLYNOMIAL_ENTRIES // max(1, self.coefficients[0].size))
        for start in range(0, points.size, batch):
            part = points[start : start + batch]
            P, slope = self.at(part), self.derivative_at(part)
            scale = _even(P)
            found[start : start + batch] = _traces(P * scale, slope * scale)
        return found


def mean_frequency(coefficients: Sequence[DenseMatrix]) -> float:
    """Return the geometric mean of the tropical eigenvalues as a power of two, one where there are none.

    Examples
    --------
    Springs of 1 and 16 N/m under masses of 1 kg swing at 1 and 4 rad/s, in whatever units of the rows:

    >>> rows = np.array([[1e-7], [1e9]])
    >>> mean_frequency([rows * np.diag([1.0, 16.0]), np.zeros((2, 2)), rows * np.eye(2)])
    2.0
    """
    return mean_frequency_between(coefficients, -FAR_SCALE, FAR_SCALE)


def mean_frequency_between(coefficients: Sequence[DenseMatrix], low: float, high: float) -> float:
    """Return the geometric mean of the tropical eigenvalues between two binary logarithms, one where there are none."""
    sizes = np.abs(np.stack(list(coefficients)))
    logs = np.where(sizes > 0.0, np.log2(np.where(sizes > 0.0, sizes, 1.0)), -ABSENT_WEIGHT)
    first, last = (_largest_product(logs, at) for at in (low, high))
    roots = last[0] - first[0]
    return float(2.0 ** np.round((first[1] - last[1]) / roots)) if roots > 0 else 1.0


def _largest_product(logs: FloatArray, at: float) -> tuple[int, float]:
    """Return degree and logarithm of the coefficient of the largest product of entries at ``|s| = 2^at``."""
    terms = logs + at * np.arange(len(logs))[:, None, None]
    power = terms.argmax(axis=0)
    rows, columns = scipy.optimize.linear_sum_assignment(terms.max(axis=0), maximize=True)
    chosen = power[rows, columns]
    return int(chosen.sum()), float(logs[chosen, rows, columns].sum())


def _even(P: ComplexArray) -> FloatArray:
    """Return products of powers of two that bring the largest entries of rows and columns of P(s) near one."""
    size = np.abs(P)
    scale = np.ones(P.shape)
    for _ in range(SWEEPS):
        for axis in (2, 1):
            largest = (size * scale).max(axis=axis, keepdims=True, initial=0.0)
            scale = scale / np.exp2(np.round(np.log2(np.where(largest > 0.0, largest, 1.0))))
    return scale


def _traces(P: ComplexArray, slope: ComplexArray) -> ComplexArray:
    try:
        return np.asarray(np.trace(np.linalg.solve(P, slope), axis1=1, axis2=2))
    except np.linalg.LinAlgError:  # one of the stack is exactly singular
        if len(P) == 1:
            return np.array([np.nan + 0j])
        half = len(P) // 2
        return np.concatenate([_traces(P[:half], slope[:half]), _traces(P[half:], slope[half:])])
