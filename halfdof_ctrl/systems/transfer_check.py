"""The transfer function of a state space against that of the descriptor form, both by refined solves.

An error is relative to the value of its channel at that point. Beside a zero or an undamped resonance a value says
little: there the value that the channel has at a frequency 0.1 % away counts, and deep in the roll-off, where states
have digits that the output does not show, a millionth of the channel's largest value. A channel that is zero, or zero
but for rounding, has no value: it is measured by the sizes of its output and its input.
"""

from collections.abc import Callable
from dataclasses import dataclass

import control
import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.refined_response import RefinedResponse, refined_response
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.judged import Judged, graded, safety
from halfdof_ctrl.systems.state_space_data import StateSpaceData

TRANSFER_TOLERANCE = 1e-10  #: relative to the value
DEEP = 1e-6  #: of a channel's largest value: deeper in the roll-off, errors are relative to that
NEARBY = 1e-3  #: relative change of frequency: beside a zero the value so far away counts
BESIDE_AXIS = 2e-3  #: points nearer to the imaginary axis, as a part of their size, are what plots show
ROUNDING_OF_ZERO = 1024 * EPS  #: of the size of output and input, left of a channel that is zero


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TransferCheck:
    """What a comparison of transfer functions says."""

    judged: Judged
    zero_scale: FloatArray  #: (p, m, 1) what a channel that is zero is measured by; 0 for the others
    pointwise: float  #: largest error relative to each value
    data: float  #: what the entries of M, C, K determine the transfer function to, the worst relative figure
    data_worst: str
    doubles: float  #: what rounding of A, B, C, D changes, the worst relative figure
    evaluation: float  #: relative error of python-control's own evaluation of A, B, C, D
    evaluation_worst: str


def compare_transfer(
    model: SecondOrderModel,
    sys: control.StateSpace,
    points: ComplexArray,
    exact: RefinedResponse,
    advance: Callable[[int], None] = lambda _: None,
) -> TransferCheck:
    """Compare at points that are no poles what the descriptor form says there.

    Parameters
    ----------
    model : SecondOrderModel
        Real and regular.
    sys : control.StateSpace
        With the model's inputs and outputs.
    points : (k,) complex ndarray
    exact : RefinedResponse
        Of the model.
    advance : callable
        Is told of every point that is done.
    """
    found = system_response(sys, points, advance)
    known, many = max(model.known_to / EPS, 1.0), safety(len(model.dofs))
    size, data = np.abs(exact.values), exact.data * known
    is_zero = ~(size > many * data).any(axis=2, keepdims=True)
    is_zero |= ~(size > ROUNDING_OF_ZERO * _by_signals(np.where(is_zero, 0.0, size))).any(axis=2, keepdims=True)
    scale = _by_signals(np.where(is_zero, 0.0, size))
    scale = np.where(scale > 0.0, scale, np.nan_to_num(exact.natural).max(axis=2, keepdims=True))
    deep = DEEP * np.nan_to_num(size).max(axis=2, keepdims=True)
    value = np.where(is_zero, scale, np.maximum(np.maximum(size, NEARBY * exact.slope), deep))
    value = np.where(value > 0.0, value, 1.0)  # no response at all, or none determined
    room = np.where(is_zero, ROUNDING_OF_ZERO * scale, 0.0) + many * (data + _finite(found.data))
    determined = np.isfinite(exact.values)
    difference = np.where(determined, np.abs(found.values - exact.values), 0.0)
    errors, allowed = difference / value, room / value
    grade, place = graded(errors, allowed, TRANSFER_TOLERANCE)
    shares = np.where(~is_zero & determined, data, 0.0) / value
    lost, lost_place = _evaluation_loss(sys, points, found.values, value)
    with np.errstate(divide="ignore", invalid="ignore"):
        pointwise = np.where(difference > 0.0, difference / size, 0.0)
    return TransferCheck(
        judged=Judged(grade, float(errors.ravel()[place]), float(allowed.ravel()[place]), _where(model, points, place)),
        zero_scale=np.where(is_zero, scale, 0.0),
        pointwise=float(np.where(is_zero, 0.0, pointwise).max(initial=0.0)),
        data=float(shares.max(initial=0.0)),
        data_worst=_where(model, points, int(shares.argmax())),
        doubles=float((np.where(~is_zero & determined, _finite(found.data), 0.0) / value).max(initial=0.0)),
        evaluation=lost,
        evaluation_worst=_where(model, points, lost_place),
    )


def system_response(
    sys: control.StateSpace, points: ComplexArray, advance: Callable[[int], None] = lambda _: None
) -> RefinedResponse:
    """Evaluate a state space by refined solves; what rounding changes is that of its doubles."""
    A, B, C, D = StateSpaceData.of(sys)
    return refined_response([-A, np.eye(len(A))], [B], [C], [D], points, exact_powers=(1,), advance=advance)


def _evaluation_loss(
    sys: control.StateSpace, points: ComplexArray, values: ComplexArray, size: FloatArray
) -> tuple[float, int]:
    """Return the largest relative error of python-control's own evaluation, and where it is."""
    evaluated = np.asarray(sys(points, squeeze=False, warn_infinite=False))
    shown = np.isfinite(values) & (np.abs(points.real) <= BESIDE_AXIS * np.abs(points))
    loss = np.where(shown, np.abs(evaluated - values), 0.0) / size
    loss = np.nan_to_num(loss, nan=np.inf)
    place = int(loss.argmax())
    return float(loss.ravel()[place]), place


def _by_signals(size: FloatArray) -> FloatArray:
    """Return the size that the outputs and the inputs of channels tell of each, (p, m, 1)."""
    largest = np.nan_to_num(size).max(axis=2, keepdims=True)
    by_output = largest.max(axis=1, keepdims=True)
    by_input = np.divide(largest, by_output, out=np.zeros_like(largest), where=by_output > 0.0).max(
        axis=0, keepdims=True
    )
    return np.asarray(by_output * by_input)


def _finite(data: FloatArray) -> FloatArray:
    return np.where(np.isfinite(data), data, 0.0)


def _where(model: SecondOrderModel, points: ComplexArray, place: int) -> str:
    i, j, k = np.unravel_index(place, (len(model.outputs), len(model.inputs), points.size))
    return f"{model.outputs[int(i)]} from {model.inputs[int(j)]} at s = {complex_in_words(complex(points[int(k)]))}"
