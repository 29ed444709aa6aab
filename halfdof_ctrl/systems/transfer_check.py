"""The transfer function of a state space against that of the descriptor form, both by refined solves.

An error is relative to the value of its channel at that point. Beside a zero or an undamped resonance a value says
little: there the value that the channel has at a frequency 0.1 % away counts, and deep in the roll-off, where states
have digits that the output does not show, a millionth of the channel's largest value, but no more than a hundredth of
what the output would be at that point if all DOFs moved as the one that moves most: beside a slow drift a mode is not
deep. A channel that is zero, or zero but for rounding, has no value: it is measured by the sizes of its output and its
input. A weak one of which both sides hold digits has.

Of many values those are refined where the two sides differ by more than a hundredth of what is good: elsewhere
rounding of both solves agrees to that, and whatever it hides is a hundredth of an error.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.refined_response import RefinedResponse, ResponseEvaluator
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.judged import Judged, graded, safety
from halfdof_ctrl.systems.state_space_data import StateSpaceData

TRANSFER_TOLERANCE = 1e-10  #: relative to the value
DEEP = 1e-6  #: of a channel's largest value: deeper in the roll-off, errors are relative to that
DEEP_THERE = 1e-2  #: of what an output would be if all DOFs moved as the largest does there: no larger value is deep
NEARBY = 1e-3  #: relative change of frequency: beside a zero the value so far away counts
BESIDE_AXIS = 2e-3  #: points nearer to the imaginary axis, as a part of their size, are what plots show
ROUNDING_OF_ZERO = 1024 * EPS  #: of the size of output and input, left of a channel that is zero
DIGITS_HELD = 1e-6  #: of a value: where rounding changes no more, a weak channel is no rounding
FEW_VALUES = 2**20  #: of all channels at all points, which are refined one and all
DOUBTED = 1e-2 * TRANSFER_TOLERANCE  #: difference of the two sides from which, of many values, a column is refined


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TransferCheck:
    """What a comparison of transfer functions says."""

    judged: Judged
    zero_scale: FloatArray  #: (p, m, 1) what a channel that is zero is measured by; 0 for the others
    least: FloatArray  #: (p, m, 1) the smallest value that counts as more than the beginning of a response
    pointwise: float  #: largest error relative to each value
    data: float  #: what the entries of M, C, K determine the transfer function to, the worst relative figure
    data_worst: str
    doubles: float  #: what rounding of A, B, C, D changes, the worst relative figure
    evaluation: float  #: relative error of python-control's own evaluation of A, B, C, D
    evaluation_worst: str


class _Measure(NamedTuple):
    """What errors of each value are relative to, and what is allowed on top."""

    is_zero: npt.NDArray[np.bool_]  #: (p, m, 1) channels that are zero, or zero but for rounding
    scale: FloatArray  #: (p, m, 1) what such a channel is measured by
    value: FloatArray  #: (p, m, k) what an error is relative to
    data: FloatArray  #: (p, m, k) what the entries of the model determine, in the unit of the value


def transfer_of_both(
    model: SecondOrderModel,
    sys: control.StateSpace,
    points: ComplexArray,
    advance: Callable[[int], None] = lambda _: None,
) -> tuple[RefinedResponse, RefinedResponse]:
    """Evaluate a dense model and a state space, refined where it matters.

    Parameters
    ----------
    model : SecondOrderModel
        Real, dense and regular.
    sys : control.StateSpace
        With the model's inputs and outputs.
    points : (k,) complex ndarray
    advance : callable
        Is told of every point that is done.
    """
    sides = ResponseEvaluator(*model.quadratics, points), _of_system(sys, points)
    few = model.D.size * points.size <= FEW_VALUES
    exact, found = (side.response(refined=few, advance=advance) for side in sides)
    if not few:
        measure = _measured(model, exact, found)
        differs = ~(np.abs(found.values - exact.values) <= DOUBTED * measure.value)
        for side, response in zip(sides, (exact, found), strict=True):
            side.refine(response, np.asarray(differs.any(axis=0)))
    return exact, found


def compare_transfer(
    model: SecondOrderModel,
    sys: control.StateSpace,
    points: ComplexArray,
    exact: RefinedResponse,
    found: RefinedResponse,
) -> TransferCheck:
    """Compare at points that are no poles what the descriptor form says there.

    Parameters
    ----------
    model : SecondOrderModel
        Real and regular.
    sys : control.StateSpace
        With the model's inputs and outputs.
    points : (k,) complex ndarray
    exact, found : RefinedResponse
        Of the model and of the state space.
    """
    measure, many = _measured(model, exact, found), safety(len(model.dofs))
    doubles = np.where(np.isfinite(found.data), found.data, 0.0)
    room = np.where(measure.is_zero, ROUNDING_OF_ZERO * measure.scale, 0.0) + many * (measure.data + doubles)
    determined = np.isfinite(exact.values)
    difference = np.where(determined, np.abs(found.values - exact.values), 0.0)
    errors, allowed = difference / measure.value, room / measure.value
    grade, place = graded(errors, allowed, TRANSFER_TOLERANCE)
    told = ~measure.is_zero & determined
    shares = np.where(told, measure.data, 0.0) / measure.value
    lost, lost_place = _evaluation_loss(sys, points, found.values, measure.value)
    with np.errstate(divide="ignore", invalid="ignore"):
        pointwise = np.where(difference > 0.0, difference / np.abs(exact.values), 0.0)
    return TransferCheck(
        judged=Judged(grade, float(errors.ravel()[place]), float(allowed.ravel()[place]), _where(model, points, place)),
        zero_scale=np.where(measure.is_zero, measure.scale, 0.0),
        least=DEEP * np.nan_to_num(np.abs(exact.values)).max(axis=2, keepdims=True, initial=0.0),
        pointwise=float(np.where(measure.is_zero, 0.0, pointwise).max(initial=0.0)),
        data=float(shares.max(initial=0.0)),
        data_worst=_where(model, points, int(shares.argmax())),
        doubles=float((np.where(told, doubles, 0.0) / measure.value).max(initial=0.0)),
        evaluation=lost,
        evaluation_worst=_where(model, points, lost_place),
    )


def _measured(model: SecondOrderModel, exact: RefinedResponse, found: RefinedResponse) -> _Measure:
    """Return what errors are relative to.

    A channel far below what its output and its input do elsewhere is zero but for rounding, unless the entries of the
    model and those of the state space both hold digits of it.
    """
    known, many = max(model.known_to / EPS, 1.0), safety(len(model.dofs))
    size, data = np.abs(exact.values), exact.data * known
    is_zero = ~(size > many * data).any(axis=2, keepdims=True)
    is_held = (size * DIGITS_HELD > many * (data + found.data)).all(axis=2, keepdims=True)
    weak = ~(size > ROUNDING_OF_ZERO * _by_signals(np.where(is_zero, 0.0, size))).any(axis=2, keepdims=True)
    is_zero |= weak & ~is_held
    scale = _by_signals(np.where(is_zero, 0.0, size))
    scale = np.where(scale > 0.0, scale, np.nan_to_num(exact.natural).max(axis=2, keepdims=True))
    deep = DEEP * np.nan_to_num(size).max(axis=2, keepdims=True)
    deep = np.minimum(deep, DEEP_THERE * np.nan_to_num(exact.natural, nan=np.inf))
    value = np.where(is_zero, scale, np.maximum(np.maximum(size, NEARBY * exact.slope), deep))
    value = np.where(value > 0.0, value, 1.0)  # no response at all, or none determined
    return _Measure(np.asarray(is_zero), scale, value, data)


def system_response(
    sys: control.StateSpace, points: ComplexArray, advance: Callable[[int], None] = lambda _: None
) -> RefinedResponse:
    """Evaluate a state space by refined solves; what rounding changes is that of its doubles."""
    return _of_system(sys, points).response(advance=advance)


def _of_system(sys: control.StateSpace, points: ComplexArray) -> ResponseEvaluator:
    A, B, C, D = StateSpaceData.of(sys)
    return ResponseEvaluator([-A, np.eye(len(A))], [B], [C], [D], points, exact_powers=(1,), sizes=False)


def _evaluation_loss(
    sys: control.StateSpace, points: ComplexArray, values: ComplexArray, size: FloatArray
) -> tuple[float, int]:
    """Return the largest relative error of python-control's own evaluation, and where it is."""
    loss = np.zeros(size.shape)
    shown = np.flatnonzero(np.abs(points.real) <= BESIDE_AXIS * np.abs(points))
    evaluated = np.asarray(sys(points[shown], squeeze=False, warn_infinite=False))
    there = values[:, :, shown]
    lost = np.where(np.isfinite(there), np.abs(evaluated - there), 0.0) / size[:, :, shown]
    loss[:, :, shown] = np.nan_to_num(lost, nan=np.inf)
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


def _where(model: SecondOrderModel, points: ComplexArray, place: int) -> str:
    i, j, k = np.unravel_index(place, (len(model.outputs), len(model.inputs), points.size))
    return f"{model.outputs[int(i)]} from {model.inputs[int(j)]} at s = {complex_in_words(complex(points[int(k)]))}"
