"""Row operations that bring hidden constraints to light: combinatorial relaxation of ``P(s) q = B(s) u``.

With the offsets (15), the tight coefficients J of P(s) decide: if J is nonsingular, the equations determine the
highest derivatives, and ``deg det P = sum d_j - sum c_i``. If some rows of J are dependent,

    J_h = sum_i x_i J_i,    c_i >= c_h,                                                    (16)
    row_h <- row_h - sum_i x_i s^(c_i - c_h) row_i                                         (17)

replaces one equation by what it says beyond the others: the tight terms vanish, the determinant stays, and the
bound falls (K. Murota, Combinatorial relaxation algorithm, 1995). A few such steps end with a nonsingular J, or
with an equation of which nothing is left: the pencil is singular then.

Only rows that are dependent are touched, so every unknown keeps its name and every other equation its exact zeros.
Decisions are taken in the irreducible blocks of J, scaled to be the same in any units.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray
from halfdof_ctrl.reduction.algebra.blocks import ENTRY_NOISE, RANK_TOLERANCE
from halfdof_ctrl.reduction.algebra.integers import IntegerArray, independent_of
from halfdof_ctrl.reduction.algebra.scaling import gap_threshold
from halfdof_ctrl.reduction.deflation.offsets import Offsets, irreducible_blocks, structural_offsets
from halfdof_ctrl.reduction.deflation.row_system import Caution, Elimination, RowSystem, level_scaled

ROW_PIVOT_SHARE = 0.9  #: of the largest pivot, from which on an earlier row is taken
UNCLEAR_TIGHT_RANK = 100.0  #: singular values above the bound and below this times it may be either
LARGEST_DEVIATION = 6.0  #: root mean square errors that a singular value may be off by rounding
SHORTER_MULTIPLIER = 4.0  #: root mean square errors within which a shorter multiplier is as good
FINEST_DYADIC = 10  #: multipliers within rounding of a multiple of 2^-10 are taken as that


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BlockDecision:
    """The singular values by which one irreducible block of J was judged."""

    unknowns: IndexArray
    singular_values: FloatArray
    rank: int
    bound: float  #: singular values up to this one counted as zero
    noise: float  #: those up to this one may be what rounding of the entries makes of a zero


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Relaxed:
    """A row system whose tight coefficients are nonsingular, or what is left of a singular one."""

    system: RowSystem
    offsets: Offsets | None  #: None for a singular pencil
    decisions: tuple[BlockDecision, ...]


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
    blocks: dict[bytes, _Block] = {}  # one whose rows stay as they are comes again
    while True:
        offsets = structural_offsets(system.matrix != 0.0)
        found = [] if offsets is None else _blocks(system, offsets, caution, tol, blocks)
        dependent = [item for block in found if block.decision.rank < block.rows.size for item in block.eliminations()]
        if offsets is None or not dependent:
            decisions = tuple([block.decision for block in blocks.values()])
            return Relaxed(system=system, offsets=offsets, decisions=decisions)
        system = system.replaced(offsets, dependent, caution)


def _blocks(
    system: RowSystem, offsets: Offsets, caution: Caution, tol: float | None, known: "dict[bytes, _Block]"
) -> "list[_Block]":
    """Return the irreducible blocks of J with more than one row, and add those that are new to the known ones."""
    J = offsets.tight(system.matrix)
    found = []
    for rows in irreducible_blocks(J != 0.0, offsets.matching):
        if rows.size > 1:
            columns = np.sort(offsets.matching[rows])
            parts = rows, J[np.ix_(rows, columns)], offsets.equations[rows], offsets.unknowns[columns]
            key = b"".join([part.tobytes() for part in parts])
            if key not in known:
                known[key] = _Block.of(system, offsets, J, rows, columns, caution, tol)
            found.append(known[key])
    return found


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
    integers: IntegerArray | None  #: the block without rounding, if that decides

    @classmethod
    def of(
        cls,
        system: RowSystem,
        offsets: Offsets,
        J: FloatArray,
        rows: IndexArray,
        columns: IndexArray,
        caution: Caution,
        tol: float | None,
    ) -> "_Block":
        place = np.ix_(rows, columns)
        scaled = level_scaled(system, offsets, J, rows, columns)
        factors = scaled.rows[:, None] * scaled.columns
        variance = offsets.tight(system.variance[:, :, : system.size])[place] * factors**2
        matrix, row_factors = scaled.matrix, scaled.rows
        values = scipy.linalg.svdvals(matrix)
        bound = float(values[0]) * (RANK_TOLERANCE * rows.size if tol is None else tol)
        noise = caution.rank * np.sqrt(rows.size * variance.sum(axis=1))
        if noise.max() > bound:  # no row may be known to less than the bound
            weights = bound / np.maximum(noise, bound)
            matrix, row_factors = matrix * weights[:, None], row_factors * weights
            variance = variance * weights[:, None] ** 2
            values = scipy.linalg.svdvals(matrix)
        if tol is None:
            bound = gap_threshold(values, bound, bound * UNCLEAR_TIGHT_RANK)
        rank, integers = int(np.count_nonzero(values > bound)), None
        if caution.is_none and tol is None:
            integers = system.tight_integers(offsets, rows, columns)
        if integers is not None:
            rank = len(independent_of(integers, range(rows.size)))
            bound = float(values[rank]) if rank < rows.size else 0.0
        decision = BlockDecision(
            unknowns=columns,
            singular_values=values,
            rank=rank,
            bound=bound,
            noise=max(
                ENTRY_NOISE * rows.size * float(values[0]),
                LARGEST_DEVIATION * float(np.sqrt(rows.size * variance.sum(axis=1)).max()),
            ),
        )
        return cls(
            rows=rows,
            columns=columns,
            times=offsets.equations[rows],
            matrix=matrix,
            variance=variance,
            row_factors=row_factors,
            decision=decision,
            integers=integers,
        )

    def eliminations(self) -> list[Elimination]:
        """Express the dependent rows by independent ones that are differentiated at least as often."""
        taken: list[int] = []
        found: list[Elimination] = []
        for times in np.unique(self.times)[::-1].tolist():
            group = np.flatnonzero(self.times == times)
            if self.integers is not None:
                before = len(taken)
                taken = independent_of(self.integers, [*taken, *group.tolist()])
                sources = np.array(taken, dtype=np.intp)
                found.extend(self._exactly_expressed(np.setdiff1d(group, sources[before:]), sources))
                continue
            values = scipy.linalg.svdvals(self.matrix[self.times >= times])
            rank = int(np.count_nonzero(values > self.decision.bound))
            picked = independent_rows(self.matrix[group], self.matrix[taken], rank - len(taken), ROW_PIVOT_SHARE)
            taken.extend(group[picked].tolist())
            found.extend(self._expressed(np.setdiff1d(group, group[picked]), np.array(taken, dtype=np.intp)))
        return found

    def _exactly_expressed(self, dependent: IndexArray, sources: IndexArray) -> "list[Elimination]":
        """Leave the multipliers to the rows themselves."""
        none = np.zeros(sources.size)
        return [
            Elimination(row=row, columns=self.columns, sources=self.rows[sources], multipliers=none, errors=none)
            for row in self.rows[dependent].tolist()
        ]

    def _expressed(self, dependent: IndexArray, sources: IndexArray) -> "list[Elimination]":
        if dependent.size == 0:
            return []
        x: FloatArray = np.zeros((sources.size, dependent.size))
        error = x
        if sources.size:
            Q, R = scipy.linalg.qr(self.matrix[sources].T, mode="economic")
            x = scipy.linalg.solve_triangular(R, Q.T @ self.matrix[dependent].T)
            sensitivity = np.linalg.norm(scipy.linalg.solve_triangular(R, np.eye(sources.size)), axis=1, keepdims=True)
            noise = self.variance[dependent].sum(axis=1) + self.variance[sources].sum(axis=1) @ x**2
            error = np.maximum(EPS * np.abs(x), sensitivity * np.sqrt(noise))
        ratio = self.row_factors[sources][:, None] / self.row_factors[dependent]
        multipliers, errors = _shortest_dyadic(x * ratio, SHORTER_MULTIPLIER * error * ratio), error * ratio
        return [
            Elimination(
                row=row,
                columns=self.columns,
                sources=self.rows[sources],
                multipliers=multipliers[:, k],
                errors=errors[:, k],
            )
            for k, row in enumerate(self.rows[dependent].tolist())
        ]


def independent_rows(matrix: FloatArray, given: FloatArray, count: int, share: float) -> IndexArray:
    """Pick rows that are independent of the given ones and of each other, early ones first where they do.

    Parameters
    ----------
    matrix : (k, n) ndarray
    given : (l, n) ndarray
        Independent rows.
    count : int
        How many to pick.
    share : float
        Of the largest pivot, from which on an earlier row is taken.
    """
    basis = scipy.linalg.qr(given.T, mode="economic")[0] if len(given) else np.zeros((matrix.shape[1], 0))
    rest = matrix.copy()
    for _ in range(2):
        rest -= (rest @ basis) @ basis.T
    picked: list[int] = []
    for _ in range(count):
        length = np.linalg.norm(rest, axis=1)
        length[picked] = 0.0
        row = int(np.argmax(length > share * length.max()))
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
