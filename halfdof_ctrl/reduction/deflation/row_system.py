"""Equations ``P(s) q = B(s) u`` as rows of coefficients, their scaling, and the row operation (17).

    row_h <- row_h - sum_i x_i s^(c_i - c_h) row_i                                         (17)

Each coefficient carries the mean square of its rounding error; what lies within it is zero.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray
from halfdof_ctrl.reduction.algebra.integers import IntegerArray
from halfdof_ctrl.reduction.algebra.scaling import gap_threshold, level_scaling
from halfdof_ctrl.reduction.deflation.offsets import BoolArray, Offsets
from halfdof_ctrl.reduction.method.units import ScaledRows

DOUBTFUL_ENTRY = 1e5  #: entries above the caution and below this times it may be either


@dataclass(frozen=True, slots=True)
class Caution:
    """How many mean rounding errors count as nothing: for single coefficients and for singular values."""

    entry: float
    rank: float

    @property
    def is_none(self) -> bool:
        """Whether numbers are what they are to the last digit."""
        return self.entry == 0.0 == self.rank


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Elimination:
    """Equation (16) for one row."""

    row: int
    columns: IndexArray  #: where its tight coefficients vanish
    sources: IndexArray
    multipliers: FloatArray  #: x_i
    errors: FloatArray  #: root mean square errors of x_i


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RowSystem:
    """``P(s) q = B(s) u`` in scaled units: n equations and unknowns, m inputs, powers of s up to k - 1."""

    coefficients: FloatArray  #: (k, n, n + m) of [P B]
    variance: FloatArray  #: (k, n, n + m) mean squares of their rounding errors
    row_logs: FloatArray  #: (n,) what rows still lack, as powers of two, to be the same in any units
    column_logs: FloatArray  #: (n,) the same for unknowns
    time_log: float  #: the same for each power of s

    @classmethod
    def scaled(cls, rows: ScaledRows) -> "RowSystem":
        """Take entries as known to half a unit in the last place."""
        return cls(
            coefficients=rows.coefficients,
            variance=(EPS * rows.coefficients) ** 2,
            row_logs=rows.row_logs,
            column_logs=rows.column_logs,
            time_log=rows.time_log,
        )

    @property
    def size(self) -> int:
        """Number of equations."""
        return int(self.coefficients.shape[1])

    @property
    def matrix(self) -> FloatArray:
        """Coefficients of P, (k, n, n)."""
        return self.coefficients[:, :, : self.size]

    def tight_integers(self, offsets: Offsets, rows: IndexArray, columns: IndexArray) -> IntegerArray | None:  # noqa: ARG002
        """Return a part of J without rounding, each row times a power of two; None where rows have been rounded."""
        return None

    def replaced(self, offsets: Offsets, eliminations: list[Elimination], caution: Caution) -> "RowSystem":
        """Apply (17) to the dependent rows; their sources stay as they are."""
        shifts = shifts_of(offsets, eliminations)
        room = ((0, max(int(shift.max(initial=0)) for shift in shifts)), (0, 0), (0, 0))
        values, squares = np.pad(self.coefficients, room), np.pad(self.variance, room)
        row_logs = self.row_logs.copy()
        k = len(self.coefficients)
        for item, shift in zip(eliminations, shifts, strict=True):
            h = item.row
            row, square = values[:, h].copy(), squares[:, h].copy()
            for by in np.unique(shift[item.multipliers != 0.0]).tolist():
                chosen = (item.multipliers != 0.0) & (shift == by)
                x, sources = item.multipliers[chosen], item.sources[chosen]
                terms, errors = self.coefficients[:, sources], item.errors[chosen]
                row[by : by + k] -= np.einsum("i,kij->kj", x, terms)
                square[by : by + k] += np.einsum("i,kij->kj", x**2, self.variance[:, sources])
                square[by : by + k] += np.einsum("i,kij->kj", errors**2 + (EPS * x) ** 2, terms**2)
            square += (EPS * row) ** 2
            row[tight_places(offsets, item, len(row))] = 0.0
            nothing = _is_rounding(row, square, caution)
            row[nothing] = square[nothing] = 0.0
            power, row_logs[h] = self.normalization(row)
            values[:, h], squares[:, h] = np.ldexp(row, power), np.ldexp(square, 2 * power)
        length = int(np.flatnonzero(values.any(axis=(1, 2))).max(initial=0)) + 1
        return replace(self, coefficients=values[:length], variance=squares[:length], row_logs=row_logs)

    def normalization(self, row: FloatArray) -> tuple[int, float]:
        """Return the power of two that scales a row of P to about one, and what it then lacks to be so in any units."""
        speed = self.time_log * np.arange(len(row))[:, None]
        size = float((np.abs(row[:, : self.size]) * np.exp2(self.column_logs + speed)).max(initial=0.0))
        if size == 0.0:
            return 0, 0.0
        power = -round(math.log2(size))
        return power, -math.log2(size) - power


@dataclass(frozen=True, slots=True, eq=False)
class ScaledPart:
    """A part of J in other units."""

    matrix: FloatArray
    rows: FloatArray  #: factors of the rows
    columns: FloatArray


def unit_free(system: RowSystem, offsets: Offsets, J: FloatArray, rows: IndexArray, columns: IndexArray) -> ScaledPart:
    """Scale a part of J so that it is the same in any units."""
    r = np.exp2(system.row_logs[rows] - offsets.equations[rows] * system.time_log)
    c = np.exp2(system.column_logs[columns] + offsets.unknowns[columns] * system.time_log)
    return ScaledPart(J[np.ix_(rows, columns)] * r[:, None] * c, r, c)


def level_scaled(
    system: RowSystem, offsets: Offsets, J: FloatArray, rows: IndexArray, columns: IndexArray
) -> ScaledPart:
    """Scale a part of J so that it is the same in any units and its rows and columns are near one."""
    part = unit_free(system, offsets, J, rows, columns)
    scaling = level_scaling(part.matrix)
    return ScaledPart(scaling.of(part.matrix), part.rows * scaling.rows, part.columns * scaling.columns)


def shifts_of(offsets: Offsets, eliminations: list[Elimination]) -> list[IndexArray]:
    """Return the powers ``c_i - c_h`` of s for the sources of each elimination."""
    return [offsets.equations[item.sources] - offsets.equations[item.row] for item in eliminations]


def tight_places(offsets: Offsets, item: Elimination, length: int) -> tuple[IndexArray, IndexArray]:
    """Return the powers of s and the columns at which (17) makes a row of so many powers vanish."""
    power = offsets.unknowns[item.columns] - offsets.equations[item.row]
    inside = (power >= 0) & (power < length)
    return power[inside], item.columns[inside]


def _is_rounding(row: FloatArray, square: FloatArray, caution: Caution) -> BoolArray:
    """Return which entries are rounding errors: those below the widest gap in their ratio to the mean error.

    Mean errors tell little more than a power of ten, but what is meant is far above them.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(row != 0.0, np.abs(row) / np.sqrt(square), 0.0)
    return np.asarray(ratio <= gap_threshold(ratio, caution.entry, caution.entry * DOUBTFUL_ENTRY))
