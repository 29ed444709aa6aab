"""What the stored A, B, C, D lose against M, C, K, measured at the frequencies where it shows.

Two responses are compared, each known beyond the last digit: that of the stored numbers, and that of the model. For the
latter, motions q that are nearly right are put into the equation of motion. What is left of that,

    r = B(s) - P(s) q,                                                                     (29)

is a force, and the response to it is what q lacks: H = F(s) (q + P(s)^-1 r) + D(s). Residuals and outputs are summed in
twice the working precision, in units in which equations, DOFs and states are of one size, since what is looked for is
smaller than the rounding of any of them; of P(s)^-1 r the first digit counts. Derivation:
docs/explanation/evaluation.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import (
    EPS,
    ComplexArray,
    FloatArray,
    IndexArray,
    Matrix,
    as_dense,
    powers_of_two,
)
from halfdof_ctrl.base.exact_products import as_it_is
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.integers import has_short_entries
from halfdof_ctrl.reduction.algebra.leading_matrix import FEW_DOFS
from halfdof_ctrl.reduction.algebra.scaling import Scaling, max_scaling
from halfdof_ctrl.reduction.method.channels import (
    columns_of,
    falls_towards_rest,
    is_gentle,
    is_looked_at,
    least_powers,
    rounding_of_channels,
    rounding_of_zeros,
    slopes_from,
)
from halfdof_ctrl.reduction.method.long_answers import long_responses
from halfdof_ctrl.reduction.method.loss_points import (
    NOTHING_SLOW,
    Slow,
    looked_at,
    loss_points,
    one_below,
    points_of_few,
    signal_speeds,
    typical_speeds,
)
from halfdof_ctrl.reduction.method.refined_answers import (
    Equations,
    Response,
    Solver,
    StateSolver,
    moved_by_rounding,
    pencil_solver,
    refined_response,
    sizes_at,
    state_equations,
)
from halfdof_ctrl.reduction.method.signals import Signal

MOST_INPUTS = 8  #: columns of B for which it is measured, spread over all
SAME_UNITS = 100.0  #: ratio of frequencies at which unknowns are measured in the same units
TEN_TIMES_DATA = 100.0  #: times what rounding of M, C, K at random changes, which is a tenth of (DATA) or less
UNSETTLED = 10.0  #: times what two responses are known to: a smaller difference is none
UNCLEAR = 1e-10  #: of a value, or ...
UNCLEAR_CHANNEL = 1e-22  #: ... of what a channel could be: responses known to no more are worked in hundreds of bits
LONG_ZERO = 1e-60  #: of what a channel could be: less is nothing in hundreds of bits
UNDETERMINED_VALUE = 1e-2  #: of a value, that rounding of M, C and K changes: nothing is looked for where it is more
ASKED_STATES = 120  #: states of which it is asked whether they are even; of more, that takes as long as the reduction
SPREAD = 4.0  #: between singular values of a block of M or C, from which on it is mixed if DOFs lose digits ...
SAVED = 0.1  #: ... and the loss is then this part of what it was, or less


@dataclass(frozen=True, slots=True)
class Loss:
    """How much of a channel is lost, where that is most."""

    value: float = 0.0  #: judged by what the channel is at this and at frequencies near it
    there: float = 0.0  #: of its value at this frequency
    omega: float = float("nan")  #: [rad/s]
    output: str = ""  #: name of the output ...
    source: str = ""  #: ... and of the input


NOTHING_LOST = Loss()


class Stored(Protocol):
    """What is looked at: a reduction with n DOFs, N states, m inputs and p outputs."""

    @property
    def model(self) -> SecondOrderModel:
        """The model that was reduced."""

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model that differs in them alone."""

    def answers(self, states: StateSolver) -> Solver:
        """Return what gives the response of all DOFs, (n, k), to forces (n, k), to a digit or two."""


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """What k inputs do in p outputs at some points, (points, p, k) each."""

    missed: FloatArray  #: size of what is lost
    value: FloatArray  #: size of the value
    rounding: FloatArray  #: below which the value is zero
    moved: FloatArray  #: what rounding of M, C, K at random changes in it
    grown: FloatArray  #: size of the part of it that grows with frequency


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What was found at the frequencies that are looked at."""

    model: SecondOrderModel
    chosen: IndexArray  #: (k,) which inputs
    slow: Slow  #: below which little is looked at
    found: Sequence[tuple[ComplexArray, Measured]]  #: points, and what is lost there


def measured_loss(stored: Stored) -> Loss:
    """Measure what A, B, C, D lose, relative to each channel's value at the frequencies that are looked at."""
    return loss_of(measured(stored))


def measured(stored: Stored, also: ComplexArray | None = None) -> Measurement:
    """Compare the stored system with the model at the frequencies that are looked at, and others, to be judged."""
    comparison = _Comparison.of(stored, also)
    points = comparison.points
    together = comparison.is_small or not stored.model.is_sparse  # which takes a few times the room
    groups = _neighbours(points) if together else [points[k : k + 1] for k in range(points.size)]
    found = [part for group in groups for part in comparison.tried(group)]
    return Measurement(stored.model, comparison.chosen, comparison.slow, found)


def loss_of(measurement: Measurement, allowed: float = 0.0, deep: float = 0.0) -> Loss:
    """Return what is lost, where that is most.

    Relative to what the channel would be if it fell by s^3 from where it is largest, or to its part that grows with
    frequency and is in no state space, where these are larger. What is at most `allowed` times what rounding of M, C
    and K at random changes is none. A value below the part `deep` of the channel's largest is measured by that.
    """
    found = measurement.found
    if not found:
        return NOTHING_LOST
    at = np.concatenate([where for where, _ in found])
    order = np.argsort(np.abs(at), kind="stable")
    at = at[order]
    missed, value, rounding, moved, grown = (
        np.concatenate([getattr(part, what.name) for _, part in found])[order] for what in fields(Measured)
    )
    own = np.maximum(value, grown)
    missed, value = np.where(missed > allowed * moved, missed, 0.0), np.where(value > rounding, value, 0.0)
    value = np.where((value > rounding_of_zeros(value)).any(axis=0), value, 0.0)
    gentle = is_gentle(np.abs(at), value)
    size = np.maximum(np.maximum(value, grown), np.where(gentle, 0.0, slopes_from(np.abs(at), value)))
    size = np.maximum(size, deep * value.max(axis=0, initial=0.0))
    kinds = least_powers(measurement.model, measurement.chosen)
    missed = np.where(is_looked_at(np.abs(at), value, measurement.slow, kinds), missed, 0.0)
    relative = np.divide(missed, size, out=np.zeros(size.shape), where=size > 0.0)
    if not relative.size:
        return NOTHING_LOST
    worst = np.unravel_index(int(np.nan_to_num(relative, nan=np.inf).argmax()), relative.shape)
    k, i, j = (int(place) for place in worst)
    lost, there = relative[k, i, j], missed[k, i, j] / own[k, i, j] if own[k, i, j] > 0.0 else np.inf
    return Loss(
        float(np.nan_to_num(lost, nan=np.inf)),
        float(np.nan_to_num(there, nan=np.inf)),
        float(abs(at[k])),
        measurement.model.outputs[i],
        measurement.model.inputs[int(measurement.chosen[j])],
    )


def _neighbours(points: ComplexArray) -> list[ComplexArray]:
    """Group points in rising order so that within a group unknowns are of a few sizes."""
    at, groups = np.abs(points), []
    while at.size:
        near = int(np.searchsorted(at, SAME_UNITS * at[0], side="right"))
        groups.append(points[points.size - at.size :][:near])
        at = at[near:]
    return groups


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Comparison:
    """A model and its stored state space in even units, for chosen inputs."""

    stored: Stored
    points: ComplexArray
    scaling: Scaling  #: of the equations of motion
    motion: Equations  #: of the model, scaled
    states: Equations  #: of the state space, balanced
    chosen: IndexArray  #: which inputs
    slow: Slow  #: below which only channels are looked at that stay about what they are
    unrounded: bool  #: whether no entry of M, C and K fills the digits of a double

    @classmethod
    def of(cls, stored: Stored, also: ComplexArray | None = None) -> "_Comparison":
        model, m, N = stored.model, stored.B.shape[1], len(stored.A)
        chosen = looked_at(m, MOST_INPUTS)
        few = len(model.dofs) <= FEW_DOFS
        points = loss_points(stored.A) if N and not few else np.zeros(0, dtype=np.complex128)
        if points.size and falls_towards_rest(model, chosen):
            points = np.append(points, one_below(points))
        if also is not None:
            points = np.append(points, also)
        points = points[np.argsort(np.abs(points))]
        speeds = typical_speeds(model) if few else [float(np.median(np.abs(points))) if N else 1.0]
        speed = speeds[-1]
        rows, columns = scaling = max_scaling(sizes_at(model.quadratics.P, speed), even=2.0)
        B = [rows[:, None] * part for part in columns_of(model.quadratics.B, chosen)]
        inputs = powers_of_two(np.asarray(sizes_at(B, speed)).max(axis=0, initial=0.0))
        motion = Equations(
            R=[_scaled(part, rows, columns) for part in model.quadratics.P],
            B=[part * inputs for part in B],
            C=[_scaled(part, np.ones(part.shape[0]), columns) for part in model.quadratics.F],
            D=[part * inputs for part in columns_of(model.quadratics.D, chosen)],
        )
        (A, scale), output = balanced_states(stored.A), stored.output(model)
        into = stored.B[:, chosen] * inputs / scale[:, None]
        direct = [part[:, chosen] * inputs for part in output.U] or [np.zeros((len(output.X), chosen.size))]
        states = state_equations(A, into, output.X * scale, direct)
        slow = NOTHING_SLOW
        if few:
            points, slow = points_of_few(model, stored.A, speeds, _speeds_of_signals(motion))
        return cls(
            stored=stored,
            points=points,
            scaling=scaling,
            motion=motion,
            states=states,
            chosen=chosen,
            slow=slow,
            unrounded=few and all(has_short_entries(as_dense(part)) for part in model.quadratics.P),
        )

    @property
    def is_small(self) -> bool:
        """Whether factors of P(s) itself answer."""
        return len(self.stored.model.dofs) <= FEW_DOFS

    def tried(self, points: ComplexArray) -> list[tuple[ComplexArray, Measured]]:
        """Compare at some points but those that are eigenvalues, at which nothing is determined."""
        try:
            return [(points, self.at(points))]
        except np.linalg.LinAlgError:
            single = [points[k : k + 1] for k in range(points.size)] if points.size > 1 else []
            return [found for point in single for found in self.tried(point)]

    def at(self, points: ComplexArray) -> Measured:
        """Compare at some points."""
        solver = StateSolver(self.stored.A, points)
        answer = pencil_solver(self.motion.R, points) if self.is_small else self._answers(solver)
        s = np.repeat(points, self.chosen.size)
        u = np.tile(np.eye(self.chosen.size, dtype=np.complex128), points.size)
        said = refined_response(self.states, solver.balanced_solve, s, u)
        true = refined_response(self.motion, answer, s, u)
        grown = self.states.grown(s, u)
        settled = self._settled(points, said, true, grown)
        value, moved = np.abs(true.y), np.zeros(true.y.shape)
        if not self.unrounded:
            moved = moved_by_rounding(self.motion, answer, points, s, true.x)
        rounding = rounding_of_channels(true, moved)
        shape = (len(value), points.size, self.chosen.size)
        missed = np.abs(true.y - said.y)
        looked_for = (
            settled & (missed > UNSETTLED * (true.rounding + said.rounding)) & (moved <= UNDETERMINED_VALUE * value)
        )
        missed = np.where(looked_for, missed, 0.0)
        parts = (missed, value, rounding, moved, grown)
        return Measured(*[np.moveaxis(part.reshape(shape), 1, 0) for part in parts])

    def _settled(
        self, points: ComplexArray, said: Response, true: Response, grown: FloatArray
    ) -> npt.NDArray[np.bool_]:
        """Work in hundreds of bits, in place, what looks like a loss and what is not known well; say what is known."""
        size, known = self._known(said, true, grown)
        doubtful = ~known | (np.abs(true.y - said.y) > UNCLEAR * size)
        shares = np.divide(np.abs(true.y - said.y), size, out=np.zeros(size.shape), where=doubtful & (size > 0.0))
        worst = np.nan_to_num(shares, nan=np.inf).reshape(len(size), points.size, -1).max(axis=(0, 2), initial=0.0)
        places = np.flatnonzero(doubtful.reshape(len(size), points.size, -1).any(axis=(0, 2)))
        places = places[np.argsort(-worst[places], kind="stable")]
        omegas = [float(points[k].imag) for k in places.tolist()]
        for equations, response in ((self.states, said), (self.motion, true)):
            for k, value in zip(places.tolist(), long_responses(equations, omegas), strict=True):
                if value is not None:
                    columns = slice(k * self.chosen.size, (k + 1) * self.chosen.size)
                    nothing = LONG_ZERO * response.shown[:, columns]
                    response.y[:, columns], response.rounding[:, columns] = value, EPS * np.abs(value) + nothing
        return self._known(said, true, grown)[1]

    def _known(self, said: Response, true: Response, grown: FloatArray) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """Return how large values are, and which are known well enough to be compared."""
        size = np.maximum(np.maximum(np.abs(true.y), np.abs(said.y)), grown)
        enough = np.maximum(UNCLEAR * size, UNCLEAR_CHANNEL * (true.shown + said.shown))
        return size, np.asarray(UNSETTLED * (true.rounding + said.rounding) <= enough)

    def _answers(self, states: StateSolver) -> Solver:
        """Return what gives the answer of all DOFs in the scaled units."""
        (rows, columns), answer = self.scaling, self.stored.answers(states)
        return lambda force: np.asarray(answer(force / rows[:, None]) / columns[:, None])


def _speeds_of_signals(motion: Equations) -> list[float]:
    """Return where inputs, outputs and what passes directly change their kind, entry by entry."""
    return [
        speed for parts in (motion.B, motion.C, motion.D) for speed in signal_speeds([as_dense(part) for part in parts])
    ]


def _scaled(matrix: Matrix, rows: FloatArray, columns: FloatArray) -> Matrix:
    scaling = Scaling(rows, columns)
    return as_it_is(scaling.of(matrix)) if isinstance(matrix, np.ndarray) else scaling.of_sparse(matrix)
