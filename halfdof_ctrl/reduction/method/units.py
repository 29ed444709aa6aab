"""Units in which the rows, the columns and the time of a model are scaled."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray, powers_of_two
from halfdof_ctrl.reduction.algebra.scaling import log_scaling_with_time


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Units:
    """Powers of two between the model's units and those of a `RowSystem`.

    ``q = diag(columns) q~, u = diag(inputs) u~, s = time s~``
    """

    columns: FloatArray  #: (n,)
    inputs: FloatArray  #: (m,)
    time: float

    def by_time(self, values: FloatArray, power: npt.ArrayLike) -> FloatArray:
        """Return ``values time^power`` for integer powers, also where the factor alone is beyond all floats."""
        exponent = math.frexp(self.time)[1] - 1
        return np.asarray(np.ldexp(values, np.asarray(power, dtype=np.intc) * exponent))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ScaledRows:
    """``P(s) q = B(s) u`` in scaled units: n equations and unknowns, m inputs."""

    coefficients: FloatArray  #: (k, n, n + m) of [P B]
    row_logs: FloatArray  #: (n,) what rows still lack, as powers of two, to be the same in any units
    column_logs: FloatArray  #: (n,) the same for unknowns
    time_log: float  #: the same for each power of s


def scaled_rows(P: FloatArray, B: FloatArray) -> tuple[ScaledRows, Units]:
    """Scale coefficients (3, n, n) and (3, n, m) by powers of two: P near the unit-free scaling, inputs near one."""
    row_logs, column_logs, time_log = log_scaling_with_time(P)
    row_powers, column_powers, time_power = np.round(row_logs), np.round(column_logs), np.round(time_log)
    speed = np.exp2(time_power * np.arange(len(P)))[:, None, None]
    rows = np.exp2(row_powers)[:, None]
    first = powers_of_two(np.abs(B).max(axis=(0, 1), initial=0.0))
    driven = B * first * rows * speed
    second = powers_of_two(np.abs(driven).max(axis=(0, 1), initial=0.0))
    scaled = np.concatenate([P * np.exp2(column_powers) * rows * speed, driven * second], axis=2)
    rows_in_units = ScaledRows(
        coefficients=scaled,
        row_logs=row_logs - row_powers,
        column_logs=column_logs - column_powers,
        time_log=float(time_log - time_power),
    )
    return rows_in_units, Units(columns=np.exp2(column_powers), inputs=first * second, time=float(np.exp2(time_power)))
