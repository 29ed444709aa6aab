"""Equation (18) without rounding: A, B and the way back to q as fractions, rounded once at the end.

The choice of states is that of `deflation`, from the rounded rows. With the states given, everything else is one
exact answer, however ill conditioned J is, and sums that cancel leave zeros.
"""

from dataclasses import dataclass, replace

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, IndexArray
from halfdof_ctrl.reduction.algebra.integers import IntegerArray, as_floats, solved_exactly, without_common_factor
from halfdof_ctrl.reduction.deflation.exact_rows import ExactRows
from halfdof_ctrl.reduction.deflation.realization import Realization, levels
from halfdof_ctrl.reduction.method.signals import Signal, StateEquations, trimmed

LARGEST_EFFORT = 5e8  #: operations on bits, about a second
LONGEST_DENOMINATOR = 320  #: bits of denominators that are kept as they are
KEPT_DENOMINATOR = 200  #: bits of those that are rounded


@dataclass(frozen=True, slots=True, eq=False)
class _Fractions:
    """Numerators over one denominator."""

    numerators: IntegerArray
    denominator: int

    def plus(self, other: "_Fractions") -> "_Fractions":
        numerators = self.numerators * other.denominator + other.numerators * self.denominator
        return _Fractions(*without_common_factor(numerators, self.denominator * other.denominator))

    def times(self, other: "_Fractions") -> "_Fractions":
        numerators = self.numerators @ other.numerators
        return _Fractions(*without_common_factor(numerators, self.denominator * other.denominator))

    def rounded(self) -> FloatArray:
        return as_floats(self.numerators, self.denominator)


def solved_without_rounding(realization: Realization, system: ExactRows) -> Realization:
    """Replace the state equations of a realization by the exact ones, each entry rounded once.

    A system that is too large for that, some thirty dense equations, keeps what floating point has given.

    Raises
    ------
    LinAlgError
        A square part of J that counted as regular is singular.
    """
    states = realization.states
    N, n = len(states), system.size
    m = system.integers.shape[2] - n
    length = max([int(value).bit_length() for value in system.integers.ravel()])
    if float(n) ** 3 * (N + m * len(system.integers)) * length > LARGEST_EFFORT:
        return realization
    found = _derivatives(realization, system)
    place = np.array(states, dtype=np.intp).reshape(N, 2)
    rate, motion = found.numerators[place[:, 1] + 1, place[:, 0]], found.numerators[0]
    A, X = _Fractions(rate[:, :N], found.denominator), _Fractions(motion[:, :N], found.denominator)
    starts = range(N, motion.shape[1], m)
    driven = [_Fractions(rate[:, k : k + m], found.denominator) for k in starts]
    U = [_Fractions(motion[:, k : k + m], found.denominator) for k in starts]
    shift: list[_Fractions] = []
    carried = driven[-1]
    for lower in reversed(driven[:-1]):  # equation (5)
        shift.insert(0, carried)
        carried = lower.plus(A.times(carried))
    for k, part in enumerate(shift):
        U[k] = U[k].plus(X.times(part))
    equations = StateEquations(
        A=A.rounded(),
        B=carried.rounded(),
        displacement=Signal(X.rounded(), trimmed(tuple([part.rounded() for part in U]))),
        shift=trimmed(tuple([part.rounded() for part in shift])),
    )
    return replace(realization, equations=equations)


def _derivatives(realization: Realization, system: ExactRows) -> _Fractions:
    """Return q^(0), q^(1), ... (orders, n, N + m L) as functions of the states and of L derivatives of u.

    Where the numbers given are not exact, what counts as zero in floating point does so here.
    """
    chain, states = realization.chain, realization.states
    c, d = chain.offsets.equations, chain.offsets.unknowns
    n, N = system.size, len(states)
    width = N + (system.integers.shape[2] - n) * (len(system.integers) + int(c.max()))
    numerators = np.full((int(d.max()) + 1, n, width), 0, dtype=object)
    for index, (j, order) in enumerate(states):
        numerators[order, j, index] = 1
    denominator = 1
    for level in reversed(range(levels(chain.offsets))):
        rows, columns = np.flatnonzero(c >= level), chain.determined[level]
        if rows.size:
            right = _right_side(system, c, rows, level, _Fractions(numerators, denominator), N)
            solution, divisor = solved_exactly(system.tight_integers(chain.offsets, rows, columns), right)
            numerators = numerators * divisor
            if not system.exact:
                solution[realization.nothing[d[columns] - level, columns]] = 0
            numerators[d[columns] - level, columns] = solution
            numerators, denominator = _of_bounded_length(*without_common_factor(numerators, denominator * divisor))
    return _Fractions(numerators, denominator)


def _of_bounded_length(numerators: IntegerArray, denominator: int) -> tuple[IntegerArray, int]:
    """Round fractions whose denominator is too long to that of a power of two."""
    if denominator.bit_length() <= LONGEST_DENOMINATOR:
        return numerators, denominator
    return (numerators << KEPT_DENOMINATOR) // denominator, 1 << KEPT_DENOMINATOR


def _right_side(
    system: ExactRows, c: IndexArray, rows: IndexArray, level: int, found: _Fractions, N: int
) -> IntegerArray:
    """Everything in (18) but the unknowns that are to be found, times the denominator of what is found."""
    T, n = system.integers, system.size
    m = T.shape[2] - n
    right = np.full((rows.size, found.numerators.shape[2]), 0, dtype=object)
    for times in np.unique(c[rows]).tolist():
        place = np.flatnonzero(c[rows] == times)
        chosen = rows[place]
        for k in range(len(T)):
            order = k + times - level
            if order < len(found.numerators) and (T[k, chosen, :n] != 0).any():
                right[place] -= T[k, chosen, :n] @ found.numerators[order]
            first = N + m * order
            right[place, first : first + m] += T[k, chosen, n:] * found.denominator
    return right
