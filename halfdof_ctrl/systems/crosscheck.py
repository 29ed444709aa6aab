"""Compare a state space with the descriptor form of its model, by routes that share no code.

| quantity | descriptor form | state space |
|---|---|---|
| count | finite eigenvalues left by deflation | order |
| poles | QZ, matched one to one | eigenvalues of A |
| transfer function | direct solves of equation (1) | direct solves with balanced A, B, C, D |
| step response | Radau IIA on the descriptor equations | `control.forced_response` |

Errors are relative to the largest value of each channel, since pointwise ones explode in roll-off; those
are given beside them. What `sys(s)` of python-control itself loses is measured too, and is no reason to fail.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, powers_of_two, read_only
from halfdof_ctrl.base.errors import MatrixError, ParameterError
from halfdof_ctrl.base.spectrum import ROUNDING_OF_A
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.first_order import typical_frequency
from halfdof_ctrl.descriptor.radau import descriptor_step_response, step_plan
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.dense_copy import complex_model_error, dense_copy
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.evaluation import quadratic_rounding
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.balanced_system import BalancedSystem
from halfdof_ctrl.systems.check_points import check_points, moving_eigenvalues
from halfdof_ctrl.systems.doors import checked_system
from halfdof_ctrl.systems.pole_check import POLE_TOLERANCE, compare_poles
from halfdof_ctrl.systems.second_opinion import second_opinion

TRANSFER_TOLERANCE = 1e-10  #: relative to the channel's largest value, beside what rounding in A may change
STEP_TOLERANCE = 1e-9  #: relative to the channel's largest value
SAFETY = 10.0  #: times what a random rounding of the descriptor form changes in a step response
ROUNDINGS = 3  #: tried, of which the largest change counts: a single one may happen to change next to nothing
ROUNDING_OF_ZERO = 1024 * EPS  #: of the size of output and input, left of a channel that is zero


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CrossCheck:
    """The errors of a state space against its descriptor form. Printing it gives a table."""

    order: int  #: states
    n_finite: int  #: finite eigenvalues of the descriptor form
    n_infinite: int  #: infinite ones
    max_transfer_error: float  #: relative to the channel's largest value (Notes of `crosscheck`)
    transfer_worst: str  #: where: output, input, s
    max_pointwise_error: float  #: the same, relative to each value
    max_pole_error: float  #: relative to each pole (Notes of `crosscheck`)
    pole_worst: str  #: which pole
    max_step_error: float  #: relative to the channel's largest value
    step_worst: str  #: where: output, input, t
    step_horizon: float  #: how far the step response was followed [s]
    evaluation_error: float  #: of python-control's sys(s) against a direct solve with the same A, B, C, D
    index: int  #: of the descriptor form, pencil (8)
    slycot: str  #: what slycot's ag08bd counts, where it is installed; it never decides

    @property
    def passed(self) -> bool:
        """Whether the count agrees and every error is within its tolerance."""
        return (
            self.order == self.n_finite
            and self.max_transfer_error <= TRANSFER_TOLERANCE
            and self.max_pole_error <= POLE_TOLERANCE
            and self.max_step_error <= STEP_TOLERANCE
        )

    def as_dict(self) -> dict[str, bool | int | float | str]:
        """Return the verdict and all figures, as for a JSON file."""
        return {"passed": self.passed, **asdict(self)}

    def __repr__(self) -> str:
        """Print as a small table."""
        count = f"{self.n_finite} finite, {self.n_infinite} infinite, index {self.index}"
        rows = [
            ("states", f"{self.order}", count, self.order == self.n_finite),
            (
                "transfer",
                f"{self.max_transfer_error:.1e}",
                self.transfer_worst,
                self.max_transfer_error <= TRANSFER_TOLERANCE,
            ),
            ("poles", f"{self.max_pole_error:.1e}", self.pole_worst, self.max_pole_error <= POLE_TOLERANCE),
            ("step", f"{self.max_step_error:.1e}", self.step_worst, self.max_step_error <= STEP_TOLERANCE),
        ]
        lines = [f"{'':10}{'error':>10}  {'verdict':8}  worst at"]
        lines += [f"{what:10}{error:>10}  {'ok' if good else 'FAILED':8}  {where}" for what, error, where, good in rows]
        lines.append(
            f"{'pointwise':10}{self.max_pointwise_error:>10.1e}  {'(info)':8}  transfer, relative to each value"
        )
        lines.append(f"{'sys(s)':10}{self.evaluation_error:>10.1e}  {'(info)':8}  python-control's own evaluation")
        lines.append(f"{'slycot':10}{'':>10}  {'(info)':8}  {self.slycot}")
        return "\n".join(["Cross-check passed" if self.passed else "Cross-check FAILED", *lines])


def crosscheck(model: SecondOrderModel, sys: control.StateSpace) -> CrossCheck:
    """Check a state space against the descriptor form of the model that it claims to be.

    Parameters
    ----------
    model : SecondOrderModel
        A real, regular model.
    sys : control.StateSpace
        With as many inputs and outputs, in the model's order.

    Returns
    -------
    CrossCheck
        Errors and where they are worst; `passed` is the verdict. The limits are 1e-10 for the transfer
        function and the poles, 1e-9 for the step response.

    Raises
    ------
    ComplexModelError, SingularPencilError
        The model has no real state space.
    ParameterError
        The system is discrete in time.
    MatrixError
        Another number of inputs or outputs.

    Notes
    -----
    A pole's error is compared with ``1e-10 |pole|`` plus what rounding of A moves it in first order,
    16 eps ``|A|`` over the cosine between its left and right eigenvectors, and a transfer function's error with 1e-10
    of the channel's largest value plus 16 eps ``|y| |A| |x|``, x and y the solutions for input and output, and what a
    relative error of 16 eps in M, C, K, B and F changes in the descriptor form. So a double pole, a sharp resonance or
    a DOF that constraints hold raises no false alarm. The figures are scaled so that 1e-10 is the limit.

    Examples
    --------
    >>> model = hydromount()
    >>> crosscheck(model, mech2ss(model)).passed
    True
    """
    model, sys = checked_model(model, "crosscheck"), checked_system(sys, "crosscheck")
    if model.is_complex:
        raise complex_model_error(model)
    model = dense_copy(
        model,
        "crosscheck",
        "Compare descriptor_response(model, omega) with frequency_response(mech2ss(model), omega) instead.",
    )
    if (sys.noutputs, sys.ninputs) != model.D.shape:
        msg = (
            f"The system has {sys.noutputs} outputs and {sys.ninputs} inputs, the model {len(model.outputs)} and "
            f"{len(model.inputs)}. Compare it with the model it was made of."
        )
        raise MatrixError(msg, matrix="D")
    if sys.isdtime(strict=True):
        msg = f"The system is discrete in time (dt = {sys.dt}), the model is not. Check it before it is sampled."
        raise ParameterError(msg, parameter="dt", value=sys.dt)
    require_regular(model)
    with limited_threads(1):  # small matrices by the hundred: more threads wait for each other
        return _compared(model, sys)


def _compared(model: SecondOrderModel, sys: control.StateSpace) -> CrossCheck:
    """Compare all that can be."""
    structure = pencil_structure(model)
    system = BalancedSystem.of(sys)
    finite = structure.finite_eigenvalues
    gamma = typical_frequency(model)
    moving = moving_eigenvalues(finite, system.data.A, gamma)
    transfer = _compare_transfer(model, system, sys, moving)
    pole_error, pole_worst = compare_poles(model, system.data.A, finite, gamma)
    step_error, step_worst, horizon = _compare_steps(model, system, moving, transfer.unclear, structure.index)
    return CrossCheck(
        order=sys.nstates,
        n_finite=finite.size,
        n_infinite=structure.n_infinite,
        max_transfer_error=transfer.error,
        transfer_worst=transfer.worst,
        max_pointwise_error=transfer.pointwise,
        evaluation_error=transfer.evaluation,
        index=structure.index,
        slycot=second_opinion(model),
        max_pole_error=pole_error,
        pole_worst=pole_worst,
        max_step_error=step_error,
        step_worst=step_worst,
        step_horizon=horizon,
    )


@dataclass(frozen=True, slots=True)
class _TransferErrors:
    error: float
    worst: str
    pointwise: float
    evaluation: float
    unclear: FloatArray  #: (p, m, 1) what rounding of M, C, K and of inputs and outputs changes in the descriptor form


def _compare_transfer(
    model: SecondOrderModel, system: BalancedSystem, sys: control.StateSpace, moving: ComplexArray
) -> _TransferErrors:
    points = check_points(moving)
    exact = model(points, squeeze=False)
    found, rounding = system(points)
    difference, size = np.abs(found - exact), np.abs(exact)
    largest = _channel_size(size)
    by_equations = quadratic_rounding(*model.quadratics, points) * (ROUNDING_OF_A / EPS)
    errors = difference / (largest + (rounding + by_equations + _rounding_of_zeros(largest)) / TRANSFER_TOLERANCE)
    i, j, k = _place_of_largest(errors)
    worst = f"{model.outputs[i]} from {model.inputs[j]} at s = {complex_in_words(points[k])}"
    with np.errstate(divide="ignore", invalid="ignore"):
        pointwise = np.where(difference > 0.0, difference / size, 0.0)
    evaluated = np.asarray(sys(points, squeeze=False, warn_infinite=False))
    with np.errstate(invalid="ignore"):
        loss = np.abs(evaluated - found) / (largest + _rounding_of_zeros(largest) / TRANSFER_TOLERANCE)
    evaluation = float(np.nan_to_num(loss, nan=np.inf).max())
    unclear = by_equations.max(axis=2, keepdims=True)
    return _TransferErrors(float(errors[i, j, k]), worst, float(pointwise.max()), evaluation, unclear)


def _compare_steps(
    model: SecondOrderModel, system: BalancedSystem, moving: ComplexArray, unclear: FloatArray, index: int
) -> tuple[float, str, float]:
    """Follow the response to a step of each input by both routes, segment by segment."""
    if any(matrix.any() for matrix in (model.Bv, model.Ba, model.Dv, model.Da)):
        return 0.0, "not followed: a step has no derivative for Bv, Ba, Dv, Da", 0.0
    plan = step_plan(moving)
    exact = descriptor_step_response(model, plan)
    found = np.empty_like(exact)
    A, B, C, D = system.data
    drives, gauges = (powers_of_two(np.abs(part).max(axis=axis, initial=0.0)) for axis, part in enumerate((B, C)))
    unit = gauges[:, None] * drives
    scaled = control.StateSpace(A, B * drives, gauges[:, None] * C, D * unit)
    for j in range(scaled.ninputs):
        state, done = np.zeros(scaled.nstates), 0
        for segment in plan:
            time = segment.h * np.arange(segment.steps + 1)
            inputs = np.zeros((scaled.ninputs, time.size))
            inputs[j] = 1.0
            part = control.forced_response(scaled, time, inputs, initial_state=state, return_states=True, squeeze=False)
            outputs = np.asarray(part.y).reshape(scaled.noutputs, time.size)[:, 1:]
            found[:, j, done : done + segment.steps] = outputs / unit[:, j : j + 1]
            state = np.asarray(part.x).reshape(scaled.nstates, time.size)[:, -1]
            done += segment.steps
    time = np.cumsum(np.concatenate([np.full(segment.steps, segment.h) for segment in plan]))
    largest = _channel_size(np.abs(exact))
    if index > 1:
        others = (_rounded(model, seed) for seed in range(ROUNDINGS))
        moved = [np.abs(descriptor_step_response(other, plan) - exact).max(axis=2, keepdims=True) for other in others]
        unclear = unclear + SAFETY * np.maximum.reduce(moved)
    errors = np.abs(found - exact) / (largest + (unclear + _rounding_of_zeros(largest)) / STEP_TOLERANCE)
    i, j, k = _place_of_largest(errors)
    return float(errors[i, j, k]), f"{model.outputs[i]} from {model.inputs[j]} at t = {time[k]:.4g} s", float(time[-1])


def _rounded(model: SecondOrderModel, seed: int) -> SecondOrderModel:
    """Round every entry once more, at random: above index one an integration multiplies that by powers of 1 / h."""
    generator = np.random.default_rng(seed)
    letters = ("M", "C", "K", "B", "F", "G", "H", "D")
    entries = {letter: getattr(model, letter) for letter in letters}
    shares = {letter: ROUNDING_OF_A * generator.uniform(-1.0, 1.0, entry.shape) for letter, entry in entries.items()}
    rounded: dict[str, Any] = {k: read_only(entry * (1.0 + shares[k])) for k, entry in entries.items()}
    return replace(model, **rounded)


def _channel_size(size: FloatArray) -> FloatArray:
    """Return the largest value of each channel (p, m, 1); of the whole response where a channel is zero."""
    largest = size.max(axis=2, keepdims=True)
    overall = size.max(initial=0.0)
    return np.where(largest > 0.0, largest, overall if overall > 0.0 else 1.0)


def _rounding_of_zeros(largest: FloatArray) -> FloatArray:
    """Return what rounding leaves of a channel that is zero, by the sizes of its output and its input (p, m, 1)."""
    by_output = largest.max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        by_input = (largest / by_output).max(axis=0, keepdims=True)
    return np.asarray(ROUNDING_OF_ZERO * by_output * by_input)


def _place_of_largest(errors: FloatArray) -> tuple[int, int, int]:
    i, j, k = np.unravel_index(int(np.argmax(errors)), errors.shape)
    return int(i), int(j), int(k)
