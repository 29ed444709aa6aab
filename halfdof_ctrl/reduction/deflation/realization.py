"""State space of any regular pencil: the method for index above one.

`relaxation` turns ``P(s) q = B(s) u`` into equations whose tight coefficients J, of the powers d_j - c_i of the
offsets (15), are nonsingular. Equation i and its first c_i derivatives then hold. At level l = 0, 1, ...
take the (c_i - l)-th derivative of all equations with c_i >= l: the highest derivatives in them are q_j^(d_j - l),
with coefficients J. A nonsingular square part of these columns, nested from level to level,

    J[c >= l, S_l] q_S^(d - l) = derivatives of u - lower derivatives - J[c >= l, others] q_others^(d - l),       (18)

determines q_j^(d_j - l) for j in S_l (S_0 holds all j). All other q_j^(d_j - l) with l > 0 are the states:
``sum d_j - sum c_i`` of them, as many as finite eigenvalues (S. E. Mattsson and G. Soederlind, Index reduction
in differential-algebraic equations using dummy derivatives, 1993). So a state is always a displacement, a
velocity or, rarely, a higher derivative of a DOF. Derivatives of u in (18) that remain become the polynomial part.

With regular mass, or with W of equation (2) nonsingular for a selection of DOFs, all c_i are zero and (18) is (3).
Derivation: docs/explanation/deflation.md.
"""

from dataclasses import dataclass, replace

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray, read_only
from halfdof_ctrl.reduction.algebra.integers import independent_of
from halfdof_ctrl.reduction.algebra.leading_matrix import LeadingMatrix
from halfdof_ctrl.reduction.deflation.offsets import BoolArray, Offsets
from halfdof_ctrl.reduction.deflation.relaxation import independent_rows
from halfdof_ctrl.reduction.deflation.row_system import Caution, RowSystem, unit_free
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, StateEquations, absorbed, trimmed
from halfdof_ctrl.reduction.method.units import Units

STATE_PIVOT_SHARE = 0.3  #: of the largest pivot, from which on a later unknown is no state
CERTAIN_COEFFICIENT = 1e4  #: mean rounding errors beyond which a coefficient is not one


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Realization:
    """State equations, and what they rest on."""

    chain: "Chain"
    nothing: BoolArray  #: (orders, n, N + m L) which coefficients of q, q', ... count as zero
    states: tuple[tuple[int, int], ...]  #: (DOF, order of the derivative) of each state
    equations: StateEquations
    errors: tuple[FloatArray, ...]  #: (n, m) each, mean rounding errors of the displacements' U_0, U_1, ...
    rcond: float  #: smallest reciprocal condition number of the square systems (18)


@dataclass(frozen=True, slots=True, eq=False)
class _Uncertain:
    """Values and the mean squares of their rounding errors."""

    value: FloatArray
    square: FloatArray

    @classmethod
    def zeros(cls, *shape: int) -> "_Uncertain":
        return cls(np.zeros(shape), np.zeros(shape))

    def subtract_product(self, place: IndexArray, left: "_Uncertain", right: "_Uncertain") -> None:
        """Subtract ``left @ right`` from some rows."""
        self.value[place] -= left.value @ right.value
        sizes = left.value**2
        self.square[place] += sizes @ right.square + (left.square + EPS**2 * sizes) @ right.value**2

    def at(self, *place: object) -> "_Uncertain":
        """Return a part."""
        return _Uncertain(self.value[place], self.square[place])  # type: ignore[index]


def realized(system: RowSystem, offsets: Offsets, caution: Caution) -> Realization:
    """Choose the states, solve (18) from the lowest derivatives upwards, and give A, B and the way back to q.

    Parameters
    ----------
    system : RowSystem
        With nonsingular tight coefficients.
    offsets : Offsets
        Of the system.
    caution : Caution
        How many mean rounding errors count as zero.

    Returns
    -------
    Realization
        In the units of the system.
    """
    chain = Chain.of(system, offsets)
    states = chain.states()
    derivatives, rcond = chain.solved(states, caution)
    N, m = len(states), system.coefficients.shape[2] - system.size
    place = np.array(states, dtype=np.intp).reshape(N, 2)
    rate, motion = derivatives.at(place[:, 1] + 1, place[:, 0]), derivatives.at(0, np.arange(system.size))
    A, X = rate.value[:, :N] + 0.0, motion.value[:, :N]
    B, shift = absorbed(A, _column_parts(rate.value, N, m))
    U = [part.copy() for part in _column_parts(motion.value, N, m)]
    errors = _column_parts(np.sqrt(motion.square), N, m)
    for k, (part, error) in enumerate(zip(shift, _errors_of_shift(rate, shift), strict=True)):
        U[k] += X @ part
        errors[k] = errors[k] + np.abs(X) @ error + np.sqrt(motion.square[:, :N]) @ np.abs(part)
    displacement = Signal(X, trimmed(tuple(U)))
    equations = StateEquations(A=A, B=B + 0.0, displacement=displacement, shift=trimmed(shift))
    return Realization(
        chain=chain,
        nothing=derivatives.value == 0.0,
        states=states,
        equations=equations,
        errors=tuple(errors),
        rcond=rcond,
    )


def in_model_units(realization: Realization, units: Units) -> StateEquations:
    """Undo the scaling by powers of two, exactly."""
    equations, place = realization.equations, np.array(realization.states, dtype=np.intp).reshape(-1, 2)
    states = units.by_time(units.columns[place[:, 0]], place[:, 1])  # x = states x~
    down = states[:, None] / units.inputs
    return StateEquations(
        A=read_only(equations.A * (states[:, None] / states) * units.time),
        B=read_only(equations.B * down * units.time),
        displacement=_rescaled(equations.displacement, states, units),
        shift=tuple([units.by_time(part * down, -k) for k, part in enumerate(equations.shift)]),
    )


def rounding_in_model_units(realization: Realization, units: Units, columns: FloatArray, relative: float) -> Rounding:
    """Return what the equations in the model's units are known to.

    Parameters
    ----------
    realization : Realization
        In scaled units.
    units : Units
    columns : (m,) ndarray
        How large the response to each input is in scaled units: its coefficients are known to a part of that, or to
        a multiple of the errors that (18) has followed where that is less.
    relative : float
        That part.
    """
    scaled = realization.equations
    q = scaled.displacement
    known = [np.minimum(columns, CERTAIN_COEFFICIENT / relative * error) for error in realization.errors]
    sizes_of_inputs = tuple([np.maximum(np.abs(part), size) for part, size in zip(q.U, known, strict=False)])
    sizes = StateEquations(
        A=np.abs(scaled.A),
        B=np.maximum(np.abs(scaled.B), np.abs(scaled.B).max(axis=0, initial=0.0)),
        displacement=Signal(np.abs(q.X), sizes_of_inputs),
        shift=(),
    )
    result = in_model_units(replace(realization, equations=sizes), units)
    return Rounding(relative=relative, A=result.A, B=result.B, displacement=result.displacement)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Chain:
    """The levels of (18)."""

    system: RowSystem
    offsets: Offsets
    J: FloatArray
    determined: tuple[IndexArray, ...]  #: S_0, S_1, ...

    @classmethod
    def of(cls, system: RowSystem, offsets: Offsets) -> "Chain":
        """Choose S_l inside S_{l-1}, well conditioned and with the last DOFs first, so that the first stay states.

        A DOF that equations hardly contain, measured in unit-free scaling, must not follow from them.
        """
        J = offsets.tight(system.matrix)
        determined = [np.arange(system.size)]
        for level in range(1, levels(offsets)):
            rows = np.flatnonzero(offsets.equations >= level)
            columns = determined[-1][offsets.unknowns[determined[-1]] >= level]
            columns = columns[::-1]
            part = unit_free(system, offsets, J, rows, columns).matrix
            part = part / np.abs(part).max(axis=1, keepdims=True, initial=0.0)
            picked = independent_rows(part.T, np.zeros((0, rows.size)), rows.size, STATE_PIVOT_SHARE)
            exactly = system.tight_integers(offsets, rows, columns)
            if exactly is not None:
                others = np.setdiff1d(np.arange(columns.size), picked)
                order = [*picked.tolist(), *others.tolist()]
                picked = np.array(independent_of(exactly.T, order, rows.size), dtype=np.intp)
            determined.append(np.sort(columns[picked]))
        return cls(system=system, offsets=offsets, J=J, determined=tuple(determined))

    def states(self) -> tuple[tuple[int, int], ...]:
        """Give (unknown, derivative) of the states, displacements first."""
        found = [
            (int(d) - level, j)
            for level in range(1, levels(self.offsets))
            for j, d in enumerate(self.offsets.unknowns)
            if d >= level and j not in self.determined[level]
        ]
        return tuple([(j, order) for order, j in sorted(found)])

    def solved(self, states: tuple[tuple[int, int], ...], caution: Caution) -> tuple[_Uncertain, float]:
        """Return q^(0), q^(1), ... (orders, n, N + m L) as functions of the states and of L derivatives of u."""
        c, d = self.offsets.equations, self.offsets.unknowns
        n, N = self.system.size, len(states)
        width = N + (self.system.coefficients.shape[2] - n) * (len(self.system.coefficients) + int(c.max()))
        found = _Uncertain.zeros(int(d.max()) + 1, n, width)
        for index, (j, order) in enumerate(states):
            found.value[order, j, index] = 1.0
        rcond = 1.0
        for level in reversed(range(levels(self.offsets))):
            rows, columns = np.flatnonzero(c >= level), self.determined[level]
            if rows.size:
                right = self._right_side(rows, level, found, N)
                solution, condition = self._solution(rows, columns, right, caution)
                found.value[d[columns] - level, columns] = solution.value
                found.square[d[columns] - level, columns] = solution.square
                rcond = min(rcond, condition)
        return found, rcond

    def _right_side(self, rows: IndexArray, level: int, found: _Uncertain, N: int) -> _Uncertain:
        """Everything in (18) but the unknowns that are to be found, which `found` still holds as zeros."""
        T, V, n = self.system.coefficients, self.system.variance, self.system.size
        right = _Uncertain.zeros(rows.size, found.value.shape[2])
        m = T.shape[2] - n
        for times in np.unique(self.offsets.equations[rows]).tolist():
            place = np.flatnonzero(self.offsets.equations[rows] == times)
            chosen = rows[place]
            for k in range(len(T)):
                order = k + times - level
                if order < len(found.value) and T[k, chosen, :n].any():
                    left = _Uncertain(T[k, chosen, :n], V[k, chosen, :n])
                    right.subtract_product(place, left, _Uncertain(found.value[order], found.square[order]))
                first = N + m * order
                right.value[place, first : first + m] += T[k, chosen, n:]
                right.square[place, first : first + m] += V[k, chosen, n:]
        return right

    def _solution(
        self, rows: IndexArray, columns: IndexArray, right: _Uncertain, caution: Caution
    ) -> tuple[_Uncertain, float]:
        part = np.ix_(rows, columns)
        matrix = np.asfortranarray(self.J[part])
        variance = self.offsets.tight(self.system.variance[:, :, : self.system.size])[part]
        leading = LeadingMatrix.factorized(matrix)
        value = leading.solve(np.asfortranarray(right.value))
        inverse = leading.solve(np.eye(rows.size, order="F"))
        eliminated = EPS * leading.elimination_size()
        square = inverse**2 @ (right.square + (variance + eliminated**2) @ value**2)
        nothing = np.abs(value) <= caution.entry * np.sqrt(square)
        return _Uncertain(np.where(nothing, 0.0, value), np.where(nothing, 0.0, square)), leading.rcond


def levels(offsets: Offsets) -> int:
    """Count the levels of (18), with those that have only states."""
    return int(max(offsets.equations.max(), offsets.unknowns.max())) + 1


def _rescaled(signal: Signal, states: FloatArray, units: Units) -> Signal:
    """Bring displacements to the model's units; derivatives of u are by the model's time."""
    rows = units.columns[:, None]
    return Signal(
        signal.X * (rows / states),
        tuple([units.by_time(part * (rows / units.inputs), -k) for k, part in enumerate(signal.U)]),
    )


def _column_parts(values: FloatArray, first: int, width: int) -> list[FloatArray]:
    """Split the columns from `first` on into parts of one width."""
    return [values[:, k : k + width] for k in range(first, values.shape[1], width)]


def _errors_of_shift(rate: _Uncertain, shift: tuple[FloatArray, ...]) -> list[FloatArray]:
    """Follow the mean rounding errors of x' = A x + B_0 u + B_1 u' + ... into E_0, E_1, ... of (5)."""
    if not shift:
        return []
    N, m = len(rate.value), shift[0].shape[1]
    A, dA = np.abs(rate.value[:, :N]), np.sqrt(rate.square[:, :N])
    driven = _column_parts(np.sqrt(rate.square), N, m)
    errors = [driven[-1]]
    for k in reversed(range(1, len(driven) - 1)):
        errors.append(driven[k] + A @ (errors[-1] + EPS * np.abs(shift[k])) + dA @ np.abs(shift[k]))
    return errors[::-1]
