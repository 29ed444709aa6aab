"""The step response of a state space against that of the descriptor form, by one integrator on both.

Radau IIA takes the same steps on ``E x' = A x + b`` with the singular E of the model and with E = 1 of the state space.
What it leaves out is then the same on both sides, and what differs are the equations. python-control's own step
response is measured beside it and decides nothing. Errors are relative to the channel's largest value, since a response
in time passes through zero.
"""

from dataclasses import dataclass, replace
from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, read_only
from halfdof_ctrl.descriptor.radau import Segment, descriptor_step_response, step_plan, system_step_response
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.judged import Judged, graded, safety
from halfdof_ctrl.systems.state_space_data import StateSpaceData

STEP_TOLERANCE = 1e-9  #: relative to the channel's largest value
ROUNDINGS = 3  #: tried, of which the largest change counts: a single one may happen to change next to nothing
STEP_CHECK_ROUNDED = 16.0  #: eps, or what entries are known to: how much these change each number
STEP_CHECK_MOST_INPUTS = 8  #: for which python-control's own response is measured ...
MANY_STATES = 200  #: ... and one of a system with more states
RUN_AWAY = "rounding of M, C, K grows in its steps"
STEP_WORK = 1e5  #: steps times unknowns of one integration, for eight inputs or fewer; the horizon ends early for it
STEP_CHECK_FEWEST_STEPS = 50  #: of an integration
MOST_STEPS = 1500  #: of an integration
FEW_UNKNOWNS = 200  #: up to which steps may have any number of lengths ...
FEW_LENGTHS = 2  #: ... and above which so many, since each takes factorizations


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StepCheck:
    """What a comparison of step responses says."""

    judged: Judged
    horizon: float  #: how far it was followed [s]
    evaluation: float  #: error of python-control's own step response, relative to the channel's largest value
    evaluation_worst: str


def compare_steps(
    model: SecondOrderModel, sys: control.StateSpace, moving: ComplexArray, zero_scale: FloatArray, least: FloatArray
) -> StepCheck:
    """Follow the response to a step of each input, segment by segment.

    Where constraints are rounded, in rotated coordinates, an integration of the descriptor form multiplies rounding
    from step to step. A channel that one more rounding of M, C, K changes by its size says nothing and is passed over.

    Parameters
    ----------
    model : SecondOrderModel
    sys : control.StateSpace
    moving : (k,) complex ndarray
        Eigenvalues that are not at the origin.
    zero_scale : (p, m, 1) ndarray
        What channels that are zero are measured by; 0 for the others.
    least : (p, m, 1) ndarray
        What others are measured by at least: of many states the response is followed for so short a time that what
        stands far from the force has hardly begun to move.
    """
    if any(matrix.any() for matrix in (model.Bv, model.Ba, model.Dv, model.Da)):
        return _not_followed("a step has no derivative for Bv, Ba, Dv, Da")
    unknowns = 2 * len(model.dofs) + sys.nstates
    work = unknowns * max(1.0, sys.ninputs / STEP_CHECK_MOST_INPUTS)
    steps = int(np.clip(STEP_WORK / work, STEP_CHECK_FEWEST_STEPS, MOST_STEPS))
    plan = step_plan(moving, steps)[: None if unknowns <= FEW_UNKNOWNS else FEW_LENGTHS]
    data = StateSpaceData.of(sys)
    with np.errstate(over="ignore", invalid="ignore"):
        exact, found = descriptor_step_response(model, plan), system_step_response(*data, plan)
    time = np.cumsum(np.concatenate([np.full(segment.steps, segment.h) for segment in plan]))
    run_away = ~np.isfinite(exact).all(axis=2, keepdims=True)
    exact = np.where(run_away, found, exact)
    largest = np.where(zero_scale > 0.0, zero_scale, np.abs(exact).max(axis=2, keepdims=True))
    largest = np.maximum(largest, least)
    largest = np.where(largest > 0.0, largest, 1.0)  # no response at all
    difference = np.abs(found - exact)
    room = np.zeros(largest.shape)
    if run_away.any() or not (difference <= STEP_TOLERANCE * largest).all():
        room = _allowed(model, data, plan)
        run_away |= ~(room <= largest)
        if run_away.all() and np.isfinite(found).all():
            return _not_followed(RUN_AWAY)
    difference = np.where(run_away & np.isfinite(found), 0.0, difference)
    errors, allowed = difference / largest, np.broadcast_to(room / largest, difference.shape)
    grade, place = graded(errors, allowed, STEP_TOLERANCE)
    evaluated = _by_control(data, plan, min(sys.ninputs, STEP_CHECK_MOST_INPUTS if sys.nstates <= MANY_STATES else 1))
    lost = np.nan_to_num(
        np.abs(evaluated - found[:, : evaluated.shape[1]]) / largest[:, : evaluated.shape[1]], nan=np.inf
    )
    i, j, k = np.unravel_index(int(lost.argmax()), lost.shape)
    return StepCheck(
        judged=Judged(
            grade,
            float(errors.ravel()[place]),
            float(allowed.ravel()[place]),
            _where(model, time, *np.unravel_index(place, errors.shape)),
        ),
        horizon=float(time[-1]),
        evaluation=float(lost[i, j, k]),
        evaluation_worst=_where(model, time, i, j, k),
    )


def _not_followed(why: str) -> StepCheck:
    judged = Judged.nothing(f"not followed: {why}")
    return StepCheck(judged=judged, horizon=0.0, evaluation=0.0, evaluation_worst="not followed")


def _by_control(data: StateSpaceData, plan: tuple[Segment, ...], inputs: int) -> FloatArray:
    """Follow the responses to a step of the first inputs as python-control does, (p, inputs, k)."""
    A, B, C, D = data
    found = np.empty((len(C), inputs, sum(segment.steps for segment in plan)))
    for j in range(inputs):
        system = control.StateSpace(A, B[:, [j]], C, D[:, [j]], 0)
        state, done = np.zeros(len(A)), 0
        for segment in plan:
            time = segment.h * np.arange(segment.steps + 1)
            part = control.forced_response(
                system, time, np.ones((1, time.size)), initial_state=state, return_states=True, squeeze=False
            )
            found[:, j, done : done + segment.steps] = np.asarray(part.y).reshape(len(C), time.size)[:, 1:]
            state = np.asarray(part.x).reshape(len(A), time.size)[:, -1]
            done += segment.steps
    return found


def _allowed(model: SecondOrderModel, data: StateSpaceData, plan: tuple[Segment, ...]) -> FloatArray:
    """Return what rounding every number once more, at random, changes in the largest value of each channel, (p, m, 1).

    Above index one an integration multiplies it by powers of 1 / h.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _moved(model, data, plan)


def _moved(model: SecondOrderModel, data: StateSpaceData, plan: tuple[Segment, ...]) -> FloatArray:
    exact, found = descriptor_step_response(model, plan), system_step_response(*data, plan)
    moved = np.zeros((*exact.shape[:2], 1))
    for seed in range(ROUNDINGS):
        other = descriptor_step_response(_rounded(model, seed), plan)
        generator = np.random.default_rng(seed)
        A, B, C, D = (part * (1.0 + _shares(generator, part.shape, EPS)) for part in data)
        another = system_step_response(A, B, C, D, plan)
        change = np.abs(other - exact).max(axis=2) + np.abs(another - found).max(axis=2)
        moved = np.maximum(moved, change[:, :, None])
    return np.asarray(safety(len(model.dofs)) * moved)


def _rounded(model: SecondOrderModel, seed: int) -> SecondOrderModel:
    """Round every entry of a model once more, at random."""
    generator = np.random.default_rng(seed)
    rounded: dict[str, Any] = {}
    for letter in ("M", "C", "K", "B", "F", "G", "H", "D"):
        entries = getattr(model, letter)
        known = model.known_to if letter in {"M", "C", "K"} else EPS
        rounded[letter] = read_only(entries * (1.0 + _shares(generator, entries.shape, known)))
    return replace(model, **rounded)


def _shares(generator: np.random.Generator, shape: tuple[int, ...], known: float) -> FloatArray:
    return STEP_CHECK_ROUNDED * known * generator.uniform(-1.0, 1.0, shape)


def _where(model: SecondOrderModel, time: FloatArray, i: Any, j: Any, k: Any) -> str:  # noqa: ANN401  # integers of numpy
    return f"{model.outputs[int(i)]} from {model.inputs[int(j)]} at t = {time[int(k)]:.4g} s"
