"""Simulate a nonlinear model, with defaults that can be trusted.

The state equation (N3) goes to a solver of scipy with a relative tolerance of 1e-8 and absolute ones of rtol times the
size of each state, which a first coarse run measures. Laws whose inverse has an infinite slope (a square damper at
rest) come to rest in finite time; they are eased below the tolerance (`easing`), or a solver would crawl there.
"""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import control
import numpy as np
import numpy.typing as npt
import scipy.integrate

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.doors import is_choice, real_numbers, shown
from halfdof_ctrl.base.errors import (
    InterruptedResponseWarning,
    MatrixError,
    NoAnswerError,
    ParameterError,
    give_warning,
)
from halfdof_ctrl.base.names import control_label, control_labels
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.model.doors import checked_nonlinear
from halfdof_ctrl.model.nonlinear import NonlinearModel, Values
from halfdof_ctrl.nonlinear.answers import UnansweredError
from halfdof_ctrl.nonlinear.easing import eased_answers
from halfdof_ctrl.nonlinear.given_inputs import Inputs, joined, read_inputs
from halfdof_ctrl.nonlinear.initial import initial_state
from halfdof_ctrl.nonlinear.reduction import NonlinearReduction, no_answer, reduce_nonlinear
from halfdof_ctrl.nonlinear.system import require_proper

Method: TypeAlias = Literal["LSODA", "BDF", "Radau", "RK45", "RK23", "DOP853"]

SOLVER_METHODS = ("LSODA", "BDF", "Radau", "RK45", "RK23", "DOP853")
COARSE_TOLERANCE = 1e-3  #: relative tolerance of the run that measures the sizes
STEP_SAFETY = 0.03  #: of rtol is what each step may err; over a run errors add up (measured: to 150 times a step's)
LEAST_STEP_TOLERANCE = 1e-13  #: relative; solvers refuse less
BAR_STEPS = 1000  #: of the progress bar
FEWEST_RUN_STEPS = 50  #: in a run whose inputs are functions, which may move between the times asked for


def nonlinear_response(
    nonlinear: NonlinearModel,
    timepts: npt.ArrayLike,
    inputs: Any = 0.0,  # noqa: ANN401  # numbers, arrays, functions, by order or by name
    initial: Values = None,
    *,
    rtol: float = 1e-8,
    method: Method = "LSODA",
) -> control.TimeResponseData:
    """Simulate a nonlinear model.

    Parameters
    ----------
    nonlinear : NonlinearModel
        Made by `nlmechss`.
    timepts : (k,) array_like
        Times [s] at which the response is wanted, rising. Two of them are two times, not limits.
    inputs : float, array_like, callable, list or mapping of these by input, optional
        A number is held. An array (k,) for one input, or (m, k), is joined linearly between the times. A function of
        time is called. Zero by default.
    initial : mapping from ``<dof>`` and ``<dof>_dot`` to a number, or (N,) array_like, optional
        As in `NonlinearModel.state`; at rest by default.
    rtol : float, optional
        Relative tolerance of each step. Absolute tolerances are rtol times the largest value of each state.
    method : {"LSODA", "BDF", "Radau", "RK45", "RK23", "DOP853"}, optional
        Of `scipy.integrate`.

    Returns
    -------
    control.TimeResponseData
        Outputs, states and inputs by name. `NonlinearModel.recover` gives the motion of all DOFs.

    Raises
    ------
    ParameterError, MatrixError, SignalNameError, InconsistentStateError
        Times, inputs or initial values that cannot be used.
    ImproperError
        An output follows a derivative of an input or of an element's force.
    NoAnswerError
        During the run no motion answers a force, or a law gives NaN or Inf.

    Warns
    -----
    InterruptedResponseWarning
        Ctrl-C was pressed: the response ends at the last time that was reached.

    Examples
    --------
    A spring of 4 N/m pulls a node through oil (1 N s²/m²): 1 m dies out in finite time, ``2 sqrt(1 m / 4)`` = 1 s.

    >>> from halfdof_ctrl import laws
    >>> node = nlmechss(mechss(None, None, [[4]]), Damper("q0", law=laws.quadratic(1)))
    >>> response = nonlinear_response(node, [0, 0.5, 2], initial={"q0": 1})
    >>> abs(response.outputs.round(6)).tolist()
    [1.0, 0.25, 0.0]
    """
    reduction = reduce_nonlinear(checked_nonlinear(nonlinear, "nonlinear_response"))
    require_proper(reduction)
    times = _checked_times(timepts)
    _require_valid(rtol, method)
    forcing = read_inputs(inputs, nonlinear.inputs, times)
    x_0 = initial_state(reduction, initial, forcing.at(float(times[0])), float(times[0]))
    step = max(STEP_SAFETY * rtol, LEAST_STEP_TOLERANCE)
    tolerances = step * _sizes(reduction, forcing, times, x_0, method)
    run = _Run.of(reduction, forcing, times, tolerances)
    states, reached = run.integrate(x_0, step, tolerances, method, show=None)
    if reached < times.size:
        msg = (
            f"The simulation was stopped at t = {times[reached - 1]:.6g} s: {reached} of {times.size} times are "
            "done, and "
            "the response ends there."
        )
        give_warning(msg, InterruptedResponseWarning)
    return _response(reduction, forcing, times[:reached], states[:, :reached])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Run:
    reduction: NonlinearReduction
    rate: Callable[[float, FloatArray], FloatArray]
    times: FloatArray
    kinks: tuple[float, ...]
    longest: float  #: step [s]

    @classmethod
    def of(cls, reduction: NonlinearReduction, forcing: Inputs, times: FloatArray, tolerances: FloatArray) -> "_Run":
        N, B_d, find = len(reduction.states), reduction.B_d, eased_answers(reduction, tolerances).solve
        by_x = np.vstack([reduction.A, reduction.X_w])
        by_u = np.vstack([reduction.B, reduction.U_w])
        if forcing.samples is not None:  # what the inputs do is piecewise linear as they are, and is joined once
            driven = joined(times, by_u @ forcing.samples)
        else:

            def driven(t: float) -> FloatArray:
                return np.asarray(by_u @ forcing.at(t))

        def rate(t: float, x: FloatArray) -> FloatArray:
            z = by_x @ x
            z += driven(t)
            try:
                _, d = find(t, z[N:])
            except UnansweredError as cause:
                raise no_answer(reduction, cause, t, x) from cause
            z = z[:N]
            z += B_d @ d
            return z

        span = float(times[-1] - times[0])
        longest = math.inf
        if forcing.samples is None and times.size > 1:
            longest = min(float(np.diff(times).max()), span / FEWEST_RUN_STEPS)
        return cls(reduction=reduction, rate=rate, times=times, kinks=forcing.kinks, longest=longest)

    def integrate(
        self, x: FloatArray, rtol: float, atol: FloatArray | float, method: str, *, show: bool | None
    ) -> tuple[FloatArray, int]:
        """Return the states at the times, and how many of these were reached before Ctrl-C."""
        states = np.empty((x.size, self.times.size))
        states[:, 0] = x
        done = 1
        if x.size == 0 or self.times.size == 1:
            return states, self.times.size
        ends, grid = [*self.kinks, float(self.times[-1])], self.times.tolist()
        start, span = float(self.times[0]), float(self.times[-1] - self.times[0])
        shown = 0
        try:
            with progress_bar(BAR_STEPS, "simulation", show=show) as advance:
                for end in ends:
                    solver = getattr(scipy.integrate, method)(
                        self.rate, start, x, end, rtol=rtol, atol=atol, max_step=self.longest
                    )
                    while solver.status == "running":
                        message = solver.step()
                        if solver.status == "failed" or not math.isfinite(solver.y.sum()):
                            raise self._stalled(solver.t, solver.y, str(message))
                        if done < len(grid) and solver.t >= grid[done]:
                            upto = bisect_right(grid, solver.t)
                            states[:, done:upto] = solver.dense_output()(self.times[done:upto])
                            done = upto
                        here = int(BAR_STEPS * (solver.t - float(self.times[0])) / span)
                        if here > shown:
                            advance(here - shown)
                            shown = here
                    start, x = end, solver.y
        except KeyboardInterrupt:
            return states, done
        return states, done

    def _stalled(self, t: float, x: FloatArray, message: str) -> NoAnswerError:
        places = self.reduction.geometry.places
        words = ", ".join([place.words for place in places])
        dofs = tuple(dict.fromkeys(name for place in places for name in place.dofs))
        msg = (
            f"The solver stops at t = {t:.6g} s ({message or 'a state is no finite number'}) with {words}; state "
            "reached: "
            f"{x.tolist()}. The motion may grow without bound in finite time, or a law jump; look at it with "
            "another method."
        )
        return NoAnswerError(msg, element=words, dofs=dofs, time=float(t), force=math.nan, state=tuple(x.tolist()))


def _sizes(
    reduction: NonlinearReduction, forcing: Inputs, times: FloatArray, x_0: FloatArray, method: str
) -> FloatArray:
    """Measure the size of each state by a coarse run; a state that stays zero takes the size of its kind."""
    if x_0.size == 0 or times.size == 1:
        return _filled(np.abs(x_0), reduction)
    guess = _filled(np.maximum(np.abs(x_0), _reach(reduction, forcing, times, x_0)), reduction)
    tolerances = COARSE_TOLERANCE * COARSE_TOLERANCE * guess
    run = _Run.of(reduction, forcing, times, COARSE_TOLERANCE * guess)
    states, done = run.integrate(x_0, COARSE_TOLERANCE, tolerances, method, show=False)
    if done < times.size:  # stopped by the user before anything was done that could be kept
        raise KeyboardInterrupt
    return _filled(np.maximum(np.abs(states[:, :done]).max(axis=1), np.abs(x_0)), reduction)


def _reach(reduction: NonlinearReduction, forcing: Inputs, times: FloatArray, x_0: FloatArray) -> FloatArray:
    """Guess how far the states go: what the first rates make of them within a hundredth of the run."""
    span = float(times[-1] - times[0])
    tried = times[:: max(1, times.size // 16)].tolist()
    return np.asarray(np.max([np.abs(reduction.rate(t, x_0, forcing.at(t))) for t in tried], axis=0) * (span / 100.0))


def _filled(sizes: FloatArray, reduction: NonlinearReduction) -> FloatArray:
    """Give states that do not move the size of the largest of their kind, displacement or velocity."""
    moving = len(reduction.partition.inertial) + len(reduction.partition.half)
    filled = sizes.copy()
    for part in (slice(0, moving), slice(moving, None)):
        largest = float(sizes[part].max(initial=0.0))
        filled[part] = np.where(sizes[part] > 0.0, sizes[part], largest)
    return np.where(filled > 0.0, filled, 1.0)


def _response(
    reduction: NonlinearReduction, forcing: Inputs, times: FloatArray, states: FloatArray
) -> control.TimeResponseData:
    model = reduction.model
    u = np.array([forcing.at(float(t)) for t in times]).T.reshape(len(model.inputs), times.size)
    m = u.shape[0]
    direct = reduction.output.direct(m + reduction.B_d.shape[1])
    y = reduction.output.X @ states + direct[:, :m] @ u
    if direct[:, m:].any():
        y += (
            direct[:, m:]
            @ np.array([reduction.solved(float(t), states[:, k], u[:, k])[1] for k, t in enumerate(times)]).T
        )
    name = control_label(model.name or "nonlinear model")
    return control.TimeResponseData(
        times,
        y,
        states,
        u,
        issiso=len(model.inputs) == len(model.outputs) == 1,
        output_labels=list(control_labels(model.outputs)),
        state_labels=list(control_labels(reduction.states)),
        input_labels=list(control_labels(model.inputs)),
        title=f"Response of {name}",
        sysname=name,
        plot_inputs=False,
    )


def _checked_times(timepts: npt.ArrayLike) -> FloatArray:
    times = np.array(real_numbers(timepts, "timepts", "rising numbers [s]"))
    if times.ndim != 1 or times.size == 0 or not np.isfinite(times).all() or not (np.diff(times) > 0.0).all():
        msg = "timepts must be one or more finite times [s] that rise from one to the next."
        raise MatrixError(msg, matrix="timepts")
    return times


def _require_valid(rtol: float, method: str) -> None:
    if not is_choice(method, SOLVER_METHODS):
        msg = f"method must be one of {', '.join(SOLVER_METHODS)}, not {shown(method)}."
        raise ParameterError(msg, parameter="method", value=method)
    if not (isinstance(rtol, int | float) and LEAST_STEP_TOLERANCE <= rtol < 1.0):
        msg = f"rtol = {shown(rtol)}, but a relative tolerance lies between 1e-13, near rounding, and 1."
        raise ParameterError(msg, parameter="rtol", value=rtol)
