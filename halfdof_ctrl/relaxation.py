"""Row operations that bring hidden constraints to light: combinatorial relaxation of ``P(s) q = B(s) u``.

With the offsets (15), the tight coefficients J of P(s) decide: if J is nonsingular, the equations determine the
highest derivatives, and ``deg det P = sum d_j - sum c_i``. If some rows of J are dependent,

    J_h = sum_i x_i J_i,    c_i >= c_h,                                                    (16)
    row_h <- row_h - sum_i x_i s^(c_i - c_h) row_i                                         (17)

replaces one equation by what it says beyond the others: the tight terms vanish, the determinant stays, and the
bound falls (K. Murota, Combinatorial relaxation algorithm, 1995). A few such steps end with a nonsingular J, or
with an equation of which nothing is left: the pencil is singular then.

Only rows that are dependent are touched, so every unknown keeps its name and every other equation its exact zeros.
Decisions are taken in the irreducible blocks of J, scaled to be the same in any units. Each coefficient carries
the mean square of its rounding error; what lies within it is zero.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.arrays import FloatArray, powers_of_two
from halfdof_ctrl.offsets import BoolArray, IndexArray, Offsets, irreducible_blocks, structural_offsets
from halfdof_ctrl.scaling import gap_threshold, levelling_factors, logarithmic_scaling

EPS = float(np.finfo(float).eps)
RANK_TOLERANCE = 16 * EPS  #: times a block's size: singular values below this part of the largest are zero
PIVOT_SHARE = 0.3  #: of the largest pivot, from which on an earlier row or column is taken
DOUBTFUL = 1e5  #: entries above the caution and below this times it may be either
UNCLEAR = 100.0  #: singular values above the bound and below this times it may be either
SNAP = 4.0  #: root mean square errors within which a shorter multiplier is as good
FINEST_DYADIC = 10  #: multipliers within rounding of a multiple of 2^-10 are taken as that


@dataclass(frozen=True, slots=True)
class Caution:
    """How many mean rounding errors count as nothing: for single coefficients and for singular values."""

    entry: float
    rank: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RowSystem:
    """``P(s) q = B(s) u`` in scaled units: n equations and unknowns, m inputs, powers of s up to k - 1."""

    coefficients: FloatArray  #: (k, n, n + m) of [P B]
    variance: FloatArray  #: (k, n, n + m) mean squares of their rounding errors
    row_logs: FloatArray  #: (n,) what rows still lack, as powers of two, to be the same in any units
    column_logs: FloatArray  #: (n,) the same for unknowns
    time_log: float  #: the same for each power of s

    @property
    def size(self) -> int:
        """Number of equations."""
        return int(self.coefficients.shape[1])

    @property
    def matrix(self) -> FloatArray:
        """Coefficients of P, (k, n, n)."""
        return self.coefficients[:, :, : self.size]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Units:
    """Powers of two between the model's units and those of a `RowSystem`.

    ``q = diag(columns) q~, u = diag(inputs) u~, s = time s~``
    """

    columns: FloatArray  #: (n,)
    inputs: FloatArray  #: (m,)
    time: float

    def by_time(self, values: FloatArray, power: npt.ArrayLike) -> FloatArray:
        """Give ``values time^power`` for integer powers, also where the factor alone is beyond all floats."""
        exponent = math.frexp(self.time)[1] - 1
        return np.asarray(np.ldexp(values, np.asarray(power, dtype=np.intc) * exponent))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BlockDecision:
    """The singular values by which one irreducible block of J was judged."""

    unknowns: IndexArray
    singular_values: FloatArray
    rank: int
    bound: float  #: singular values up to this one counted as zero


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Relaxed:
    """A row system whose tight coefficients are nonsingular, or what is left of a singular one."""

    system: RowSystem
    offsets: Offsets | None  #: None for a singular pencil
    decisions: tuple[BlockDecision, ...]


def scaled_rows(P: FloatArray, B: FloatArray) -> tuple[RowSystem, Units]:
    """Scale coefficients (3, n, n) and (3, n, m) by powers of two: P near the unit-free scaling, inputs near one."""
    row_logs, column_logs, time_log = logarithmic_scaling(P)
    row_powers, column_powers, time_power = np.round(row_logs), np.round(column_logs), np.round(time_log)
    speed = np.exp2(time_power * np.arange(len(P)))[:, None, None]
    rows = np.exp2(row_powers)[:, None]
    first = powers_of_two(np.abs(B).max(axis=(0, 1), initial=0.0))
    driven = B * first * rows * speed
    second = powers_of_two(np.abs(driven).max(axis=(0, 1), initial=0.0))
    scaled = np.concatenate([P * np.exp2(column_powers) * rows * speed, driven * second], axis=2)
    system = RowSystem(
        coefficients=scaled,
        variance=(EPS * scaled) ** 2,
        row_logs=row_logs - row_powers,
        column_logs=column_logs - column_powers,
        time_log=float(time_log - time_power),
    )
    return system, Units(columns=np.exp2(column_powers), inputs=first * second, time=float(np.exp2(time_power)))


def relaxed(system: RowSystem, caution: Caution, tol: float | None = None) -> Relaxed:
    """Apply (17) until the tight coefficients are nonsingular or no perfect matching is left.

    Parameters
    ----------
    system : RowSystem
    caution : Caution
        How many mean rounding errors count as zero.
    tol : float, optional
        Singular values of a scaled block at most `tol` times its largest count as zero; by default 16 eps times the
        block's size, or what its rounding errors amount to.
    """
    decisions: dict[bytes, BlockDecision] = {}
    while True:
        offsets = structural_offsets(system.matrix != 0.0)
        if offsets is None:
            return Relaxed(system=system, offsets=None, decisions=tuple(decisions.values()))
        J = offsets.tight(system.matrix)
        dependent: list[_Elimination] = []
        for rows in irreducible_blocks(J != 0.0, offsets.matching):
            if rows.size > 1:
                block = _Block.of(system, offsets, J, rows, caution, tol)
                decisions.setdefault(block.key, block.decision)
                if block.decision.rank < rows.size:
                    dependent.extend(block.eliminations())
        if not dependent:
            return Relaxed(system=system, offsets=offsets, decisions=tuple(decisions.values()))
        system = _with_rows_replaced(system, offsets, dependent, caution)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Elimination:
    """Equation (16) for one row."""

    row: int
    columns: IndexArray  #: where its tight coefficients vanish
    sources: IndexArray
    multipliers: FloatArray  #: x_i
    errors: FloatArray  #: root mean square errors of x_i


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Block:
    """An irreducible block of J, scaled for decisions."""

    rows: IndexArray
    columns: IndexArray
    times: IndexArray  #: c_i of its rows
    matrix: FloatArray  #: the block, scaled
    variance: FloatArray  #: mean squares of its errors
    row_factors: FloatArray
    decision: BlockDecision
    key: bytes

    @classmethod
    def of(
        cls, system: RowSystem, offsets: Offsets, J: FloatArray, rows: IndexArray, caution: Caution, tol: float | None
    ) -> "_Block":
        columns = np.sort(offsets.matching[rows])
        place = np.ix_(rows, columns)
        scaled = levelled(system, offsets, J, rows, columns)
        factors = scaled.rows[:, None] * scaled.columns
        variance = offsets.tight(system.variance[:, :, : system.size])[place] * factors**2
        values = scipy.linalg.svdvals(scaled.matrix)
        bound = values[0] * (RANK_TOLERANCE * rows.size if tol is None else tol)
        bound = max(float(bound), caution.rank * float(np.sqrt(variance.sum())))
        bound = gap_threshold(values, bound, bound * UNCLEAR)
        decision = BlockDecision(
            unknowns=columns,
            singular_values=values,
            rank=int(np.count_nonzero(values > bound)),
            bound=bound,
        )
        return cls(
            rows=rows,
            columns=columns,
            times=offsets.equations[rows],
            matrix=scaled.matrix,
            variance=variance,
            row_factors=scaled.rows,
            decision=decision,
            key=rows.tobytes() + J[place].tobytes(),
        )

    def eliminations(self) -> list[_Elimination]:
        """Express the dependent rows by independent ones that are differentiated at least as often."""
        taken: list[int] = []
        dependent: list[tuple[int, int]] = []
        for times in np.unique(self.times)[::-1].tolist():
            group = np.flatnonzero(self.times == times)
            values = scipy.linalg.svdvals(self.matrix[self.times >= times])
            rank = int(np.count_nonzero(values > self.decision.bound))
            picked = independent_rows(self.matrix[group], self.matrix[taken], rank - len(taken))
            taken.extend(group[picked].tolist())
            dependent.extend((row, len(taken)) for row in np.setdiff1d(group, group[picked]).tolist())
        return [self._expressed(row, np.array(taken[:count], dtype=np.intp)) for row, count in dependent]

    def _expressed(self, row: int, sources: IndexArray) -> _Elimination:
        if sources.size == 0:
            x = error = np.zeros(0)
        else:
            Q, R = scipy.linalg.qr(self.matrix[sources].T, mode="economic")
            x = scipy.linalg.solve_triangular(R, Q.T @ self.matrix[row])
            sensitivity = np.linalg.norm(scipy.linalg.solve_triangular(R, np.eye(sources.size)), axis=1)
            noise = self.variance[row].sum() + x**2 @ self.variance[sources].sum(axis=1)
            error = np.maximum(EPS * np.abs(x), sensitivity * np.sqrt(noise))
        ratio = self.row_factors[sources] / self.row_factors[row]
        return _Elimination(
            row=int(self.rows[row]),
            columns=self.columns,
            sources=self.rows[sources],
            multipliers=_shortest_dyadic(x * ratio, SNAP * error * ratio),
            errors=error * ratio,
        )


def levelled(system: RowSystem, offsets: Offsets, J: FloatArray, rows: IndexArray, columns: IndexArray) -> "_Levelled":
    """Scale a part of J so that it is the same in any units and its rows and columns are near one."""
    r = np.exp2(system.row_logs[rows] - offsets.equations[rows] * system.time_log)
    c = np.exp2(system.column_logs[columns] + offsets.unknowns[columns] * system.time_log)
    part = J[np.ix_(rows, columns)]
    more_r, more_c = levelling_factors(part * r[:, None] * c)
    r, c = r * more_r, c * more_c
    return _Levelled(part * r[:, None] * c, r, c)


@dataclass(frozen=True, slots=True, eq=False)
class _Levelled:
    matrix: FloatArray
    rows: FloatArray  #: factors of the rows
    columns: FloatArray


def independent_rows(matrix: FloatArray, given: FloatArray, count: int) -> IndexArray:
    """Pick rows that are independent of the given ones and of each other, early ones first where they do.

    Parameters
    ----------
    matrix : (k, n) ndarray
    given : (l, n) ndarray
        Independent rows.
    count : int
        How many to pick.
    """
    basis = scipy.linalg.qr(given.T, mode="economic")[0] if len(given) else np.zeros((matrix.shape[1], 0))
    rest = matrix.copy()
    for _ in range(2):
        rest -= (rest @ basis) @ basis.T
    picked: list[int] = []
    for _ in range(count):
        length = np.linalg.norm(rest, axis=1)
        length[picked] = 0.0
        row = int(np.argmax(length > PIVOT_SHARE * length.max()))
        direction = rest[row] / length[row]
        direction -= basis @ (basis.T @ direction)
        direction /= np.linalg.norm(direction)
        basis = np.column_stack([basis, direction])
        rest -= np.outer(rest @ direction, direction)
        picked.append(row)
    return np.array(picked, dtype=np.intp)


def _shortest_dyadic(x: FloatArray, error: FloatArray) -> FloatArray:
    """Take the shortest binary fraction within the error, which is as good and keeps sums exact."""
    result, open_ = x.copy(), np.ones(x.shape, dtype=bool)
    for power in range(FINEST_DYADIC + 1):
        short = np.round(np.ldexp(x, power)) / 2.0**power
        hit = open_ & (np.abs(short - x) <= error)
        result[hit] = short[hit]
        open_ &= ~hit
    return result


def _with_rows_replaced(
    system: RowSystem, offsets: Offsets, eliminations: list[_Elimination], caution: Caution
) -> RowSystem:
    """Apply (17) to the dependent rows; their sources stay as they are."""
    shifts = [offsets.equations[item.sources] - offsets.equations[item.row] for item in eliminations]
    longest = max(int(shift.max(initial=0)) for shift in shifts)
    room = ((0, longest), (0, 0), (0, 0))
    values, squares = np.pad(system.coefficients, room), np.pad(system.variance, room)
    row_logs = system.row_logs.copy()
    k = len(system.coefficients)
    for item, shift in zip(eliminations, shifts, strict=True):
        h = item.row
        row, square = values[:, h].copy(), squares[:, h].copy()
        for source, x, error, by in zip(item.sources, item.multipliers, item.errors, shift, strict=True):
            if x == 0.0:
                continue
            term = x * system.coefficients[:, source]
            row[by : by + k] -= term
            uncertain = (error * system.coefficients[:, source]) ** 2 + (EPS * term) ** 2
            square[by : by + k] += x**2 * system.variance[:, source] + uncertain
        square += (EPS * row) ** 2
        power = offsets.unknowns[item.columns] - offsets.equations[h]
        tight = (power >= 0) & (power < len(row))
        row[power[tight], item.columns[tight]] = 0.0
        nothing = _is_rounding(row, square, caution)
        row[nothing] = square[nothing] = 0.0
        values[:, h], squares[:, h], row_logs[h] = _normalized(system, row, square)
    length = int(np.flatnonzero(values.any(axis=(1, 2))).max(initial=0)) + 1
    return replace(system, coefficients=values[:length], variance=squares[:length], row_logs=row_logs)


def _is_rounding(row: FloatArray, square: FloatArray, caution: Caution) -> BoolArray:
    """Tell which entries are rounding errors: those below the widest gap in their ratio to the mean error.

    Mean errors tell little more than a power of ten, but what is meant is far above them.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(row != 0.0, np.abs(row) / np.sqrt(square), 0.0)
    return np.asarray(ratio <= gap_threshold(ratio, caution.entry, caution.entry * DOUBTFUL))


def _normalized(system: RowSystem, row: FloatArray, square: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Scale a row of P to about one by a power of two, and give what it then lacks to be the same in any units."""
    speed = system.time_log * np.arange(len(row))[:, None]
    size = float((np.abs(row[:, : system.size]) * np.exp2(system.column_logs + speed)).max(initial=0.0))
    if size == 0.0:
        return row, square, 0.0
    power = -np.round(np.log2(size))
    return np.ldexp(row, int(power)), np.ldexp(square, 2 * int(power)), -float(np.log2(size)) - float(power)
