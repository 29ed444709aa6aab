"""Time responses of models as data: to a step, from an initial motion, to any inputs.

They are computed in energy coordinates where a model has them, which keep the slow modes of stiff structures, in steps
that keep them beside fast ones (`time_steps`), and given with the states of ``mech2ss(model)``: displacements and
velocities. `ExactReduction.recover` makes the motion of every DOF of them, those without inertia too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.by_name import by_name
from halfdof_ctrl.base.doors import real_numbers
from halfdof_ctrl.base.errors import HalfdofError, ParameterError
from halfdof_ctrl.base.names import control_label, control_labels
from halfdof_ctrl.descriptor.data_limit import warn_of_span
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.sparse.displacement import SparseDisplacement
from halfdof_ctrl.systems.origin import poles_of_model
from halfdof_ctrl.systems.pole_bounds import BoundedPoles
from halfdof_ctrl.systems.state_map import StateMap
from halfdof_ctrl.systems.state_space import system_of_map, system_of_model
from halfdof_ctrl.systems.state_space_data import StateSpaceData
from halfdof_ctrl.systems.step_times import relevant_poles, step_times
from halfdof_ctrl.systems.time_steps import time_steps
from halfdof_ctrl.systems.working_states import working_map

Motion: TypeAlias = npt.ArrayLike | Mapping[str, float] | None
Histories: TypeAlias = npt.ArrayLike | Mapping[str, npt.ArrayLike]

SLOWEST_TURN, FASTEST_TURN = 2.0, 60.0  #: angles [rad] that motions turn in a response, from the slowest that show on
EVEN_TIMES = 1e-6  #: relative differences between time steps that are rounding
MOST_TIMED = 200  #: DOFs of a sparse model up to which times are chosen for all of them, not only for outputs


@np.errstate(all="ignore")  # an unstable motion grows beyond all numbers, and is refused then
def step_response(model: SecondOrderModel, timepts: npt.ArrayLike | None = None) -> control.TimeResponseData:
    """Compute the response to a unit step of each input, from rest.

    Parameters
    ----------
    model : SecondOrderModel
    timepts : (k,) array_like or float, optional
        Equidistant times [s], or the last time. By default as `step_plot` chooses them: until the slowest mode that is
        seen in an output or a recovered DOF has settled, or swung for 20 periods.

    Returns
    -------
    control.TimeResponseData
        With a trace for each input, and the states of ``mech2ss(model)``: ``exact_reduction(model).recover(response)``
        gives displacement and velocity of every DOF.

    Raises
    ------
    ParameterError
        Times that are not rising and equidistant.
    ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        The model has no state space (see `mech2ss`).

    Warns
    -----
    DataLimitWarning
        Entries known to their last digit do not determine the motion to 1e-6, at a frequency that it shows.
    LostDigitsWarning
        States lose digits (see `mech2ss`), or steps beside poles that are many decades faster, of more than 500 states.

    Examples
    --------
    A spring of 8 N/m beside a damper of 4 N s/m settles at 1/8 m:

    >>> response = step_response(mechss([[0]], [[4]], [[8]]))
    >>> round(float(response.outputs[-1]), 3), round(float(response.time[-1]), 9)
    (0.124, 2.5)
    """
    plant = _Plant.of(model)
    time = plant.times(timepts)
    m = len(model.inputs)
    inputs = np.broadcast_to(np.eye(m)[:, :, None], (m, m, time.size)).copy()
    outputs, states = plant.histories(time, inputs)
    labels = [f"From {label}" for label in control_labels(model.inputs)]
    return plant.data(time, outputs, states, inputs, "Step response", trace_labels=labels)


@np.errstate(all="ignore")  # an unstable motion grows beyond all numbers, and is refused then
def initial_response(
    model: SecondOrderModel,
    timepts: npt.ArrayLike | None = None,
    *,
    displacement: Motion = None,
    velocity: Motion = None,
) -> control.TimeResponseData:
    """Compute the free motion from initial displacements and velocities.

    Parameters
    ----------
    model : SecondOrderModel
    timepts : (k,) array_like or float, optional
        As in `step_response`.
    displacement, velocity : (n,) array_like or mapping from DOF to value, optional
        Initial motion [m, m/s]. A DOF that is missing is at zero where it has a state of its own, and follows from the
        equations where it has none.

    Returns
    -------
    control.TimeResponseData
        As of `step_response`, with a single trace.

    Raises
    ------
    InconsistentStateError
        A value that the equations without inertia do not allow.
    ParameterError, ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        As in `step_response`.

    Warns
    -----
    DataLimitWarning, LostDigitsWarning
        As in `step_response`.

    Examples
    --------
    A mass of 1 kg on 4 N/m, let go at 1 m, is at -1 m after half a period:

    >>> model = mechss([[1]], None, [[4]], dofs="y")
    >>> response = initial_response(model, np.linspace(0, np.pi / 2, 51), displacement={"y": 1.0})
    >>> round(float(response.outputs[-1]), 9)
    -1.0
    """
    plant = _Plant.of(model)
    start = plant.start(displacement, velocity, 0.0)
    time = plant.times(timepts, start)
    inputs = np.zeros((len(model.inputs), time.size))
    outputs, states = plant.histories(time, inputs[:, None], start)
    return plant.data(time, outputs[:, 0], states[:, 0], inputs, "Initial response")


@np.errstate(all="ignore")  # an unstable motion grows beyond all numbers, and is refused then
def forced_response(
    model: SecondOrderModel,
    timepts: npt.ArrayLike,
    inputs: Histories = 0.0,
    *,
    displacement: Motion = None,
    velocity: Motion = None,
) -> control.TimeResponseData:
    """Compute the response to inputs over time.

    Parameters
    ----------
    model : SecondOrderModel
    timepts : (k,) array_like
        Equidistant times [s].
    inputs : (m, k) array_like or mapping from input to (k,) history
        Values at these times, linear between; (k,) for a single input, a number for a constant. Inputs that a mapping
        leaves out are zero.
    displacement, velocity : optional
        Initial motion, as in `initial_response`.

    Returns
    -------
    control.TimeResponseData
        As of `step_response`, with a single trace.

    Raises
    ------
    SignalNameError
        An input that is not there.
    ParameterError, InconsistentStateError, ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        As in `initial_response`; or inputs of another shape.

    Warns
    -----
    DataLimitWarning, LostDigitsWarning
        As in `step_response`.

    Examples
    --------
    A force of 3 N on a free mass of 2 kg moves it by 0.75 m in a second:

    >>> response = forced_response(mechss([[2]], None, None, dofs="y"), [0.0, 0.5, 1.0], {"F_y": [3.0, 3.0, 3.0]})
    >>> round(float(response.outputs[-1]), 12)
    0.75
    """
    plant = _Plant.of(model)
    time = plant.times(timepts)
    if np.ndim(timepts) == 0:
        msg = "timepts must be the times [s] of the inputs, not a single one."
        raise ParameterError(msg, parameter="timepts", value=timepts)
    histories = _histories(inputs, model.inputs, time.size)
    start = plant.start(displacement, velocity, histories[:, 0])
    outputs, states = plant.histories(time, histories[:, None], start)
    return plant.data(time, outputs[:, 0], states[:, 0], histories, "Forced response")


def checked_times(timepts: npt.ArrayLike) -> FloatArray:
    """Read times, which must rise in equal steps.

    Raises
    ------
    ParameterError
        They do not.
    """
    given = real_numbers(timepts, "timepts", "rising, equidistant times [s]")
    steps = np.diff(given) if given.ndim == 1 else np.zeros(0)
    if steps.size == 0 or not (np.abs(steps - steps[0]) <= EVEN_TIMES * steps[0]).all():
        msg = (
            "timepts must be rising, equidistant times [s], at least two, since python-control simulates on no "
            "others: take numpy.linspace, or give the last time alone."
        )
        raise ParameterError(msg, parameter="timepts", value=timepts)
    return given


@dataclass(frozen=True, slots=True, eq=False)
class _Plant:
    """A model with the states that its responses are worked in."""

    model: SecondOrderModel
    reduction: ExactReduction
    states: StateMap | None  #: None where it stays in DOF states
    sys: control.StateSpace  #: in the working states

    @classmethod
    def of(cls, model: SecondOrderModel) -> "_Plant":
        reduction = reduced(checked_model(model, "A time response"))
        sys = system_of_model(reduction)  # refuses what has no state space
        states = working_map(reduction)
        if states is None or states.kind != "energy":
            reduction.solution.evidence.warn_of_loss()
        return cls(model, reduction, states, sys if states is None else system_of_map(states))

    def times(self, timepts: npt.ArrayLike | None, start: FloatArray | None = None) -> FloatArray:
        """Return the given times, or those that show what is seen in outputs and recovered DOFs."""
        if timepts is not None and real_numbers(timepts, "timepts", "times [s]").ndim > 0:
            return checked_times(timepts)
        A, B, C, D = StateSpaceData.of(self.sys)
        if not (self.model.is_sparse and len(self.model.dofs) > MOST_TIMED):
            motion = (self.reduction if self.states is None else self.states).displacement
            motion = motion.whole() if isinstance(motion, SparseDisplacement) else motion
            C, D = np.vstack([C, motion.X]), np.vstack([D, motion.direct(self.sys.ninputs)])
        if start is not None:  # C (exp(A t) - 1) x0 is the step response to B = A x0
            B, D = (A @ start)[:, None], np.zeros((len(C), 1))
        poles: BoundedPoles | None = poles_of_model(self.model, A) if A.size else None
        horizon = None if timepts is None else float(real_numbers(timepts, "timepts", "times [s]"))
        return step_times(relevant_poles(A, B, C, D, poles), horizon)

    def start(self, displacement: Motion, velocity: Motion, inputs: npt.ArrayLike) -> FloatArray:
        """Return the state of an initial motion."""
        source = self.reduction if self.states is None else self.states
        return source.state({} if displacement is None else displacement, velocity, inputs)

    def histories(
        self, time: FloatArray, inputs: FloatArray, start: FloatArray | float = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """Return outputs (p, j, k) and DOF states (N, j, k) in j traces of inputs (m, j, k)."""
        steps = time_steps(*StateSpaceData.of(self.sys)[:2], time)
        x = self._by_control(time, inputs, start) if steps is None else steps.states(inputs, start)
        outputs = np.tensordot(self.sys.C, x, 1) + np.tensordot(self.sys.D, inputs, 1)
        return np.asarray(outputs), x if self.states is None else self.states.to_dofs(x)

    def _by_control(self, time: FloatArray, inputs: FloatArray, start: FloatArray | float) -> FloatArray:
        """Let python-control follow the states, (N, j, k)."""
        x = np.empty((self.sys.nstates, *inputs.shape[1:]))
        for trace in range(inputs.shape[1] if x.size else 0):
            found = control.forced_response(
                self.sys,
                time - time[0],  # python-control wants a start at zero for exact steps
                inputs[:, trace],
                initial_state=start,
                return_states=True,
                squeeze=False,
            )
            x[:, trace] = np.asarray(found.x, dtype=float).reshape(self.sys.nstates, time.size)
        return x

    def warn(self, time: FloatArray) -> None:
        """Warn where entries do not determine the motion: what lasts as long as the response, and what is faster."""
        span = float(time[-1] - time[0])
        if self.sys.nstates and span > 0.0:
            warn_of_span(self.model, SLOWEST_TURN / span, FASTEST_TURN / span)

    def data(
        self,
        time: FloatArray,
        outputs: FloatArray,
        states: FloatArray,
        inputs: FloatArray,
        what: str,
        *,
        trace_labels: list[str] | None = None,
    ) -> control.TimeResponseData:
        """Pack a response with the names of the model."""
        model = self.model
        bad = ~np.isfinite(np.vstack([part.reshape(-1, time.size) for part in (outputs, states)])).all(axis=0)
        if bad.any():
            msg = (
                f"The response is beyond the largest number from t = {time[bad][0]:.4g} s on: the model is unstable. "
                "Give a shorter time."
            )
            raise ParameterError(msg, parameter="timepts", value=float(time[bad][0]))
        self.warn(time)
        name = control_label(model.name) if model.name else None
        several = {} if trace_labels is None else {"trace_labels": trace_labels, "trace_types": ["step"] * len(inputs)}
        return control.TimeResponseData(
            time,
            outputs,
            states,
            inputs,
            issiso=len(model.inputs) == len(model.outputs) == 1,
            output_labels=list(control_labels(model.outputs)),
            state_labels=list(control_labels(self.reduction.states)),
            input_labels=list(control_labels(model.inputs)),
            title=f"{what} for {name}" if name else what,
            sysname=name,
            multi_trace=trace_labels is not None,
            plot_inputs=False,
            **several,
        )


def _histories(inputs: Histories, names: tuple[str, ...], count: int) -> FloatArray:
    """Read inputs over time, (m, k)."""
    values = np.zeros((len(names), count))
    try:
        if isinstance(inputs, Mapping):
            for name, history in by_name(inputs, names, "input").items():
                values[names.index(name)] = real_numbers(history, "inputs", "histories of real numbers")
        else:
            values[:] = real_numbers(inputs, "inputs", "histories of real numbers")
    except ValueError as cause:
        if isinstance(cause, HalfdofError):
            raise
        msg = f"inputs must be histories of {len(names)} inputs at {count} times, ({len(names)}, {count}): {cause}."
        raise ParameterError(msg, parameter="inputs", value=None) from cause
    if not np.isfinite(values).all():
        msg = "inputs must be finite numbers at all times."
        raise ParameterError(msg, parameter="inputs", value=None)
    return values
