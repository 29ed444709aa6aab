"""Row operations (17) without rounding: floating-point numbers are integers times powers of two.

A dense block that needs several steps can lose all digits to the errors of the multipliers x_i, however small the
singular values by which it was judged. Here the rows are integers, and the x_i are fractions: after (17) a coefficient
is zero or it is not. What remains uncertain are the numbers that were given. Every row is a combination of them,

    [P B](s) = L(s) [P B]_given(s),                                                        (21)

so that with entries known to eps each coefficient is known to

    eps (|L|^2 |[P B]_given|^2)^(1/2)                                                      (22)

and what is smaller may be zero just as well: with numbers like 0.1, coefficients that cancel leave that much. Where it
happens integers grow from step to step without being any truer, so very long ones are rounded.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray
from halfdof_ctrl.reduction.algebra.integers import (
    IntegerArray,
    as_floats,
    as_integers,
    has_short_entries,
    independent_of,
    solved_exactly,
)
from halfdof_ctrl.reduction.deflation.offsets import Offsets
from halfdof_ctrl.reduction.deflation.row_system import (
    Caution,
    Elimination,
    RowSystem,
    level_scaled,
    shifts_of,
    tight_places,
)

SHORT_BITS = 24  #: bits of numbers that can be meant to the last one: 3 and 0.625, but not 0.1
LONGEST_INTEGER = 320  #: bits of integers that are kept as they are: exact numbers of small models are shorter
KEPT_BITS = 160  #: bits of those that are rounded: three times as many as the numbers that were given have


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ExactRows(RowSystem):
    """``P(s) q = B(s) u`` in integers; the coefficients are their rounded image, by which decisions are taken."""

    integers: IntegerArray  #: (k, n, n + m) the rows, each times a power of two
    powers: tuple[int, ...]  #: (n,) these powers: coefficients = integers / 2^powers
    operations: FloatArray  #: (l, n, n) L of (21)
    given: FloatArray  #: (3, n, n + m) coefficients before any operation
    exact: bool  #: whether the numbers given are short, all that counted as zero was zero, and nothing was rounded

    @classmethod
    def of(cls, system: RowSystem) -> "ExactRows":
        """Take a system as it is, before any row operation."""
        found = [as_integers(system.coefficients[:, i]) for i in range(system.size)]
        return cls(
            coefficients=system.coefficients,
            variance=system.variance,
            row_logs=system.row_logs,
            column_logs=system.column_logs,
            time_log=system.time_log,
            integers=np.stack([integers for integers, _ in found], axis=1),
            powers=tuple([power for _, power in found]),
            operations=np.eye(system.size)[None],
            given=system.coefficients,
            exact=has_short_entries(system.coefficients, SHORT_BITS),
        )

    def replaced(self, offsets: Offsets, eliminations: list[Elimination], caution: Caution) -> "ExactRows":
        """Apply (17) to the dependent rows, with multipliers that solve (16) exactly."""
        longest = max(int(shift.max(initial=0)) for shift in shifts_of(offsets, eliminations))
        draft = _Draft.of(self, longest)
        groups: dict[bytes, list[Elimination]] = {}
        for item in eliminations:
            groups.setdefault(item.sources.tobytes(), []).append(item)
        for group in groups.values():
            multipliers, denominator = self._multipliers(offsets, group)
            for k, item in enumerate(group):
                shift = offsets.equations[item.sources] - offsets.equations[item.row]
                draft.replace(self, offsets, item, shift, multipliers[:, k], denominator, caution)
        return draft.system(self)

    def _multipliers(self, offsets: Offsets, group: list[Elimination]) -> tuple[IntegerArray, int]:
        """Solve (16) for all rows with the same sources: numerators (sources, rows) and the denominator."""
        sources, columns = group[0].sources, group[0].columns
        if sources.size == 0:
            return np.zeros((0, len(group)), dtype=object), 1
        part = level_scaled(self, offsets, offsets.tight(self.matrix), sources, columns)
        _, _, order = scipy.linalg.qr(part.matrix, mode="economic", pivoting=True)
        whole = self.tight_integers(offsets, sources, columns)
        chosen = columns[np.sort(independent_of(whole.T, order.tolist(), sources.size))]
        dependent = np.array([item.row for item in group], dtype=np.intp)
        J = self.tight_integers(offsets, np.concatenate([sources, dependent]), chosen)
        return solved_exactly(J[: sources.size].T, J[sources.size :].T)

    def tight_integers(self, offsets: Offsets, rows: IndexArray, columns: IndexArray) -> IntegerArray:
        """Pick a part of J, each row times a power of two of its own."""
        power = offsets.unknowns[columns] - offsets.equations[rows][:, None]
        inside = (power >= 0) & (power < len(self.integers))
        picked = self.integers[np.where(inside, power, 0), rows[:, None], columns]
        return np.where(inside, picked, 0)


@dataclass(frozen=True, slots=True, eq=False)
class _Draft:
    """The parts of an `ExactRows` in the making."""

    integers: IntegerArray
    coefficients: FloatArray
    variance: FloatArray
    operations: FloatArray
    row_logs: FloatArray
    powers: list[int]
    exact: list[bool]

    @classmethod
    def of(cls, system: ExactRows, longest: int) -> "_Draft":
        """Copy a system, with room for rows that become longer by so many powers of s."""
        room = ((0, longest), (0, 0), (0, 0))
        integers = np.full((len(system.integers) + longest, *system.integers.shape[1:]), 0, dtype=object)
        integers[: len(system.integers)] = system.integers
        return cls(
            integers,
            np.pad(system.coefficients, room),
            np.pad(system.variance, room),
            np.pad(system.operations, room),
            system.row_logs.copy(),
            list(system.powers),
            [system.exact],
        )

    def replace(
        self,
        old: ExactRows,
        offsets: Offsets,
        item: Elimination,
        shift: IndexArray,
        numerators: IntegerArray,
        denominator: int,
        caution: Caution,
    ) -> None:
        """Put ``denominator row_h - sum_i numerators_i s^shift_i row_i`` in the place of a row."""
        h, k, l = item.row, len(old.integers), len(old.operations)  # noqa: E741
        weights = [
            (h, 0, denominator),
            *zip(item.sources.tolist(), shift.tolist(), (-numerators).tolist(), strict=True),
        ]
        row = np.full_like(self.integers[:, h], 0)
        for i, by, weight in weights:
            row[by : by + k] += weight * old.integers[:, i]
        tight = tight_places(offsets, item, len(row))
        self.exact.append(not row[tight].any())
        row[tight] = 0
        common = math.gcd(*row.ravel().tolist()) or 1
        power = max(_bits(weight, old.powers[i]) for i, _, weight in weights) - common.bit_length()
        operation = np.zeros_like(self.operations[:, h])
        for i, by, weight in weights:
            operation[by : by + l] += _quotient(weight, common, old.powers[i] - power) * old.operations[:, i]
        row //= common
        image, noise = as_floats(row << max(-power, 0), 1 << max(power, 0)), _noise(operation, old.given, len(row))
        nothing = np.abs(image) <= caution.entry * noise
        self.exact.append(not row[nothing].any())
        row[nothing] = image[nothing] = noise[nothing] = 0
        length = max([int(value).bit_length() for value in row.ravel()])
        self.exact.append(length <= LONGEST_INTEGER)
        if length > LONGEST_INTEGER:
            row, power = (row + (1 << (length - KEPT_BITS - 1))) >> (length - KEPT_BITS), power - (length - KEPT_BITS)
        lift, self.row_logs[h] = old.normalization(image)
        self.coefficients[:, h], self.operations[:, h] = np.ldexp(image, lift), np.ldexp(operation, lift)
        self.variance[:, h] = np.ldexp(noise, lift) ** 2 + (EPS * self.coefficients[:, h]) ** 2
        self.integers[:, h], self.powers[h] = row, power - lift

    def system(self, old: ExactRows) -> ExactRows:
        """Finish, without powers of s that nothing is left of."""
        length = int(np.flatnonzero((self.integers != 0).any(axis=(1, 2))).max(initial=0)) + 1
        rows = int(np.flatnonzero(self.operations.any(axis=(1, 2))).max(initial=0)) + 1
        return ExactRows(
            coefficients=self.coefficients[:length],
            variance=self.variance[:length],
            row_logs=self.row_logs,
            column_logs=old.column_logs,
            time_log=old.time_log,
            integers=self.integers[:length],
            powers=tuple(self.powers),
            operations=self.operations[:rows],
            given=old.given,
            exact=all(self.exact),
        )


def _bits(weight: int, power: int) -> int:
    """Tell about how large a row of size one is after it was multiplied, as a power of two."""
    return abs(weight).bit_length() + power if weight else -(10**9)


def _quotient(weight: int, divisor: int, power: int) -> float:
    """Return ``weight 2^power / divisor``."""
    return (weight << max(power, 0)) / (divisor << max(-power, 0))


def _noise(operation: FloatArray, given: FloatArray, length: int) -> FloatArray:
    """Give (22) for one row (length, n + m): what it is known to."""
    square = np.zeros((max(length, len(operation) + len(given) - 1), given.shape[2]))
    for k, weights in enumerate(operation):
        square[k : k + len(given)] += np.tensordot(weights**2, given**2, axes=(0, 1))
    return np.asarray(EPS * np.sqrt(square[:length]))
