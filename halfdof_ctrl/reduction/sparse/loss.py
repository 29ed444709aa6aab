"""What the stored A, B, C, D of a sparse model lose, measured at the price of a few solutions.

As `method.loss` does, by the residual (29), with sparse factors. Where P(s) is factorized at a point, it serves both
responses: (s I - A) x = r, with rates r_p, r_c, r_v of inertial and half displacements and of velocities, is

    P(s) q = M T_i (s r_p + r_v) + C T_i r_p + C T_c r_c,    v = s p_i - r_p,

as far as A is that of the model, which residuals correct, so that no matrix of many states is factorized. A large
model with few states is looked at by its factors of W, and by one mixture of its inputs first.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, IndexArray, powers_of_two
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.base.sparse_factors import PIVOTINGS, sparse_lu
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.scaling import Scaling, max_scaling
from halfdof_ctrl.reduction.algebra.sparse_lu import is_nearly_symmetric
from halfdof_ctrl.reduction.method.channels import SMALL_CHANNEL, ZERO_CHANNEL, falls_towards_rest, rounding_of_channels
from halfdof_ctrl.reduction.method.loss import (
    MOST_INPUTS,
    UNSETTLED,
    Measured,
    Measurement,
    Stored,
)
from halfdof_ctrl.reduction.method.loss_points import (
    ALL_EIGENVALUES,
    BESIDE_MODE,
    NOTHING_SLOW,
    SLOW_MODES,
    SLOW_MODES_ACCURACY,
    beside_modes,
    looked_at,
    loss_points,
    one_below,
)
from halfdof_ctrl.reduction.method.masses import own_speeds
from halfdof_ctrl.reduction.method.refined_answers import (
    Equations,
    Response,
    Solver,
    StateSolver,
    moved_by_rounding,
    refined_response,
    sizes_at,
    state_equations,
)
from halfdof_ctrl.reduction.sparse.partition import HALF, INERTIAL, SparsePartition

FILLED_STATES = 4000  #: if most entries of A are filled: of more, nothing is measured
MOST_OUTPUTS = 32  #: that are looked at, spread over all
FACTORIZED_DOFS = 5000  #: up to which P(s) is factorized at each point, whatever the number of states
STATES_BY_W = 300  #: of more, so it is in any case
MIXED_FROM = 20_000  #: DOFs from which on few points are looked at, and a mixture of the inputs first
FILLED = 2**18  #: entries of A, above which few points are looked at as well
POINTS_OF_LARGE = 2  #: of many states; of few, one
NOTHING_MOVES = 1e-200  #: of the largest unknown: smaller ones are zero, so that no power of two overflows
LOOKED_CLOSER = 1e-10  #: part of a value from which more is asked about a loss
NOT_TOLD_APART = 1e-9  #: part of a value that is no small part of its terms: to which it is not told from a loss
STILL_KNOWN = 1e-3  #: part of a value: what is known to less is lost, or is asked of P(s) itself
POINTS_BETWEEN = 3  #: points between the slowest mode and where half of the masses would swing alone
NO_STIFFNESS = 1e-15  #: part of the largest entry of a row of K, scaled: a motion that so little resists is free
BESIDE_FREE = 1e-3  #: of the slowest frequency of a mass by itself: where slow modes are looked for if one is free
REACHED = 16.0  #: times that: modes of larger size are not told from free ones there


class SparselyStored(Stored, Protocol):
    """A sparse reduction of n DOFs to N states."""

    @property
    def coordinates(self) -> SparsePartition:
        """Which coordinates are inertial, half and static."""

    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return a derivative of all DOFs for given states and inputs."""


def measured_sparsely(stored: SparselyStored) -> Measurement:
    """Compare a stored sparse system with its model at the frequencies that are looked at, for `loss_of` to judge.

    Up to eight inputs and 32 outputs, spread over all.
    """
    model, N = stored.model, len(stored.A)
    filled = np.count_nonzero(stored.A)
    if not N or (N > FILLED_STATES and filled > FILLED_STATES**2):
        return Measurement(model, np.zeros(0, dtype=np.intp), NOTHING_SLOW, ())
    model, m = _with_few_outputs(model), len(model.inputs)
    large, by_W = len(model.dofs) > MIXED_FROM, len(model.dofs) > FACTORIZED_DOFS and N <= STATES_BY_W
    chosen = looked_at(m, MOST_INPUTS)
    first = _mixture(stored.B) if large else _picked(chosen, m)
    ground = _Ground.of(stored, model, by_W=by_W)
    comparison = ground.driven_by(first)
    points = comparison.points(below=falls_towards_rest(model, chosen))
    if large or filled > FILLED:
        points = points[: 1 if by_W else POINTS_OF_LARGE]
    if large:
        if not _is_suspect(comparison, points):
            return Measurement(model, np.zeros(0, dtype=np.intp), NOTHING_SLOW, ())
        comparison = ground.driven_by(_picked(chosen, m))
    return Measurement(
        model, chosen, NOTHING_SLOW, [(points[k : k + 1], comparison.at(s)) for k, s in enumerate(points.tolist())]
    )


def _is_suspect(mixture: "_Comparison", points: ComplexArray) -> bool:
    """Return whether enough of the response to a mixture of inputs may be lost to look at each."""
    return any(mixture.differs(s) if mixture.by_W else mixture.loses(s) for s in points.tolist())


def _with_few_outputs(model: SecondOrderModel) -> SecondOrderModel:
    """Return a model with some of its outputs, where these are many."""
    if len(model.outputs) <= MOST_OUTPUTS:
        return model
    places = looked_at(len(model.outputs), MOST_OUTPUTS)
    return model.select(outputs=[model.outputs[place] for place in places.tolist()])


def _picked(chosen: IndexArray, m: int) -> SparseMatrix:
    """Return the columns of a unit matrix."""
    ones = np.ones(chosen.size)
    return csc_array((ones, (chosen, np.arange(chosen.size))), shape=(m, chosen.size))


def _mixture(B: FloatArray) -> SparseMatrix:
    """Return weights at random that make inputs act on the states in one size."""
    size = np.abs(B).max(axis=0, initial=0.0)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size.size)
    return csc_array((signs / np.where(size > 0.0, size, 1.0))[:, None])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Ground:
    """What comparisons have in common, whatever drives the model."""

    stored: SparselyStored
    model: SecondOrderModel  #: with the outputs that are looked at
    by_W: bool  #: whether W is what solves for all DOFs
    speed: float  #: typical of the masses
    scaling: Scaling  #: of the equations of motion
    P: Sequence[SparseMatrix]  #: scaled
    F: Sequence[SparseMatrix]  #: what the outputs see of the scaled unknowns

    @classmethod
    def of(cls, stored: SparselyStored, model: SecondOrderModel, *, by_W: bool) -> "_Ground":
        speeds = own_speeds(model)
        speed = float(np.sqrt(np.median(speeds[speeds > 0.0]))) if (speeds > 0.0).any() else 1.0
        P = [as_sparse(part) for part in model.quadratics.P]
        scaling = max_scaling(csc_array(sizes_at(P, speed)), even=2.0)
        seen = Scaling(np.ones(len(model.outputs)), scaling.columns)
        return cls(
            stored=stored,
            model=model,
            by_W=by_W,
            speed=speed,
            scaling=scaling,
            P=[scaling.of_sparse(part) for part in P],
            F=[seen.of_sparse(as_sparse(part)) for part in model.quadratics.F],
        )

    def driven_by(self, mix: SparseMatrix) -> "_Comparison":
        """Return the comparison for inputs, or mixtures of them: the columns of (m, k) weights."""
        stored, model = self.stored, self.model
        B = [self.scaling.rows[:, None] * _dense(as_sparse(part) @ mix) for part in model.quadratics.B]
        inputs = powers_of_two(np.asarray(sizes_at(B, self.speed)).max(axis=0, initial=0.0))
        motion = Equations(
            R=self.P,
            B=[part * inputs for part in B],
            C=self.F,
            D=[_dense(as_sparse(part) @ mix) * inputs for part in model.quadratics.D],
        )
        (A, balance), output = balanced_states(stored.A), stored.output(model)
        into = np.asarray(stored.B @ mix) * inputs / balance[:, None]
        direct = [np.asarray(part @ mix) * inputs for part in output.U] or [np.zeros((len(output.X), inputs.size))]
        return _Comparison(
            stored=stored,
            by_W=self.by_W,
            scaling=self.scaling,
            motion=motion,
            states=state_equations(A, into, output.X * balance, direct),
            balance=balance,
            inputs=_dense(mix) * inputs,
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Comparison:
    """A model and its stored state space in even units, for k inputs or mixtures of them."""

    stored: SparselyStored
    by_W: bool  #: whether W is what solves for all DOFs
    scaling: Scaling  #: of the equations of motion
    motion: Equations  #: of the model, scaled
    states: Equations  #: of the state space, balanced
    balance: FloatArray  #: (N,) what the balanced states are multiplied by
    inputs: FloatArray  #: (m, k) the inputs that the columns stand for

    def points(self, *, below: bool) -> ComplexArray:
        """Choose points, those first that tell most: beside the slowest modes, and up to where masses swing alone.

        If channels fall towards rest, below all modes too.
        """
        A, speeds = self.stored.A, own_speeds(self.stored.model)
        few = self.by_W or len(A) <= ALL_EIGENVALUES
        slow = loss_points(A) if few else beside_modes(self._slow_modes(speeds))
        under = one_below(slow) if below else slow[:0]
        if few or not (speeds > 0.0).any():
            return np.append(slow, under)
        least, typical = np.sqrt(np.quantile(speeds[speeds > 0.0], (0.0, 0.5)))
        between: Any = (
            np.geomspace(np.abs(slow).min(), typical, POINTS_BETWEEN + 2)[1:-1] if np.abs(slow).min() < typical else []
        )
        return np.concatenate(
            [slow[:1], slow[1:][-1:], 1j * BESIDE_MODE * np.array([typical, *between, least]), slow[1:-1], under]
        )

    def _slow_modes(self, speeds: FloatArray) -> ComplexArray:
        """Return the slowest poles to a few digits, but those of free motions."""
        N, shift, least = len(self.stored.A), 0.0, 0.0
        try:
            motion = self._pencil(0.0)
            grown = np.abs(
                motion(np.random.default_rng(0).uniform(1.0, 2.0, (len(self.scaling.rows), 1)).astype(np.complex128))
            ).max()
            is_free = not NO_STIFFNESS * grown < 1.0
        except np.linalg.LinAlgError:
            is_free = True
        if is_free:
            slowest = float(np.sqrt(speeds[speeds > 0.0].min())) if (speeds > 0.0).any() else 1.0
            shift = -BESIDE_FREE * slowest
            least = REACHED * EPS**0.5 * slowest
            motion = self._pencil(shift)
        solve = lifted(self.stored, self._physical(motion), shift)
        turned = LinearOperator(
            (N, N),
            matvec=lambda v: (
                (solve((self.balance * v.ravel()).astype(np.complex128)[:, None])[:, 0] / self.balance).real
            ),
            dtype=np.float64,
        )
        start = np.random.default_rng(0).standard_normal(N)
        try:
            found = eigs(turned, k=min(SLOW_MODES, N - 2), v0=start, tol=SLOW_MODES_ACCURACY, return_eigenvectors=False)
        except ArpackNoConvergence as some:
            found = np.asarray(some.eigenvalues)
        except ArpackError:
            found = np.zeros(0, dtype=complex)
        poles = np.asarray(shift - 1.0 / found[found != 0.0], dtype=np.complex128)
        return poles[np.abs(poles) > least]

    def loses(self, s: complex) -> bool:
        """Return whether something is lost at a point."""
        found = self.at(s)
        return bool((found.missed > LOOKED_CLOSER * found.value).any())

    def differs(self, s: complex) -> bool:
        """Return whether the motion that the reduction recovers leaves forces, rounding among them, that are seen.

        Without sums in twice the working precision, which would take longer than the solutions.
        """
        solver, columns = StateSolver(self.stored.A, s), self.scaling.columns[:, None]
        point = np.full(self.inputs.shape[1], s)
        x = solver.balanced_solve(self.states.B[0].astype(np.complex128))
        physical, powers = self.balance[:, None] * x, range(len(self.motion.B))
        parts = [
            self.stored.motion_at(side(physical), [side(s**k * self.inputs) for k in powers], 0)
            for side in (np.real, np.imag)
        ]
        q = np.asarray((parts[0] + 1j * parts[1]) / columns)
        force = np.asarray(sum(s**k * part for k, part in enumerate(self.motion.B)))
        left = force - np.asarray(sum(np.asarray(part @ (s**k * q)) for k, part in enumerate(self.motion.R)))
        missed = self._answer(solver, left)
        said = self.states.seen(point, x) + sum(s**k * part for k, part in enumerate(self.states.D))
        true = self.motion.seen(point, q + missed) + sum(s**k * part for k, part in enumerate(self.motion.D))
        every = np.broadcast_to(np.abs(q).max(axis=0, initial=0.0), q.shape)
        told = np.abs(true) > ZERO_CHANNEL * EPS * self.motion.sizes(point, every)
        return bool((told & ~(np.abs(true - said) <= LOOKED_CLOSER * np.abs(true))).any())

    def at(self, s: complex) -> Measured:
        """Compare at a point."""
        k = self.states.B[0].shape[1]
        points, u = np.full(k, s), np.eye(k, dtype=np.complex128)
        try:
            answer, solve = self._solvers(s)
            said = refined_response(self.states, solve, points, u)
            true = refined_response(self.motion, answer, points, u)
            if self.by_W and _is_lost(true).any():
                answer = self._pencil(s)
                true = refined_response(self.motion, answer, points, u)
        except np.linalg.LinAlgError:  # an eigenvalue, at which nothing is determined
            none = np.zeros((len(self.states.D[0]), k))
            return Measured(*[none[None]] * 5)
        value, missed = np.abs(true.y), np.abs(true.y - said.y)
        told = missed > UNSETTLED * (true.rounding + said.rounding)
        told |= _is_lost(said) & ~_is_lost(true)
        told |= (true.rounding > NOT_TOLD_APART * value) & (
            value > SMALL_CHANNEL * true.shown
        )  # the best that is known
        missed = np.where(told, missed, 0.0)
        moved = np.zeros(missed.shape)
        if (missed > LOOKED_CLOSER * value).any():
            moved = moved_by_rounding(self.motion, answer, points[:1], points, true.x)
        parts = (missed, value, rounding_of_channels(true, moved), moved, self.states.grown(points, u))
        return Measured(*[part[None] for part in parts])

    def _solvers(self, s: complex) -> tuple[Solver, Solver]:
        """Return what answers for all DOFs, scaled, and for the balanced states."""
        if self.by_W:
            solver = StateSolver(self.stored.A, s)
            return partial(self._answer, solver), solver.balanced_solve
        motion = self._pencil(s)
        solve, balance = lifted(self.stored, self._physical(motion), s), self.balance[:, None]
        return motion, lambda right: _without_dust(solve(balance * right) / balance)

    def _answer(self, states: StateSolver, force: ComplexArray) -> ComplexArray:
        rows, columns = self.scaling
        return np.asarray(self.stored.answers(states)(force / rows[:, None]) / columns[:, None])

    def _physical(self, motion: Solver) -> Solver:
        """Return the same in the units of the model."""
        rows, columns = (part[:, None] for part in self.scaling)
        return lambda force: np.asarray(columns * motion(rows * force))

    def _pencil(self, s: complex) -> Solver:
        """Factorize the scaled P(s).

        Raises
        ------
        numpy.linalg.LinAlgError
            It is exactly singular.
        """
        parts: list[Any] = [part.astype(np.complex128) for part in self.motion.R]
        matrix = csc_array(parts[0] + s * parts[1] + s**2 * parts[2])
        way = PIVOTINGS[1 if is_nearly_symmetric(matrix) else -1]
        try:
            factors = sparse_lu(matrix, *way)
        except RuntimeError as singular:
            msg = "s is an eigenvalue"
            raise np.linalg.LinAlgError(msg) from singular
        return lambda right: _without_dust(factors.solve(np.asarray(right, dtype=np.complex128)))


def lifted(stored: SparselyStored, motion: Solver, s: complex) -> Solver:
    """Return ``(s I - A)^-1`` by what solves ``P(s) q = f``."""
    model, part = stored.model, stored.coordinates
    inertial, half = part.of_kind(INERTIAL), part.of_kind(HALF)
    n_i, moving = inertial.size, inertial.size + half.size
    M_i = part.mapped(as_sparse(model.M), inertial)
    C_i, C_c = (part.mapped(as_sparse(model.C), own) for own in (inertial, half))
    coordinates = _coordinates(part)

    def solve(rates: ComplexArray) -> ComplexArray:
        r_p, r_c, r_v = rates[:n_i], rates[n_i:moving], rates[moving:]
        force = np.asarray(M_i @ (s * r_p + r_v)) + np.asarray(C_i @ r_p) + np.asarray(C_c @ r_c)
        p = coordinates(motion(force))[:moving]
        return np.concatenate([p, s * p[:n_i] - r_p])

    return solve


def _coordinates(part: SparsePartition) -> Callable[[ComplexArray], ComplexArray]:
    """Return what takes displacements of all DOFs to coordinates."""
    if part.columns is None:
        return lambda q: np.asarray(q[part.order])
    factors: Any = sparse_lu(part.columns)
    return lambda q: np.asarray((factors.solve(q.real.copy()) + 1j * factors.solve(q.imag.copy()))[part.order])


def _without_dust(solution: Any) -> ComplexArray:  # noqa: ANN401  # SuperLU has no public type
    """Return a solution, far from where forces act, with zeros for what is next to nothing."""
    largest = np.abs(solution).max(axis=0, initial=0.0)
    return np.asarray(np.where(np.abs(solution) <= NOTHING_MOVES * largest, 0.0, solution), dtype=np.complex128)


def _is_lost(response: Response) -> Any:  # noqa: ANN401  # an array of bool
    """Return which values are hardly known."""
    return ~(response.rounding <= STILL_KNOWN * np.abs(response.y))


def _dense(product: Any) -> FloatArray:  # noqa: ANN401  # sparse
    return np.asarray(product.toarray())
