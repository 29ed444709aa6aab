"""What python-control's evaluation of a state space will lose, measured before it is relied on.

``sys(s)``, `control.bode_plot` and `control.frequency_response` bring A to Hessenberg form as it stands, without
balancing. Where states are of very different sizes, as displacements and velocities of stiff structures are, that mixes
large into small: a beam of forty elements loses a hundredth at its first resonance, though A, B, C, D hold all digits.
There is no cheap predictor of the loss but one of its absence: by how much balancing A changes it. Where that is much,
the evaluation is done at the frequencies where a loss shows and compared with refined solves. Of many states it takes
longer than the reduction: there the loss is estimated at one frequency.
"""

from dataclasses import dataclass

import control
import numpy as np
from control.exception import slycot_check
from scipy.linalg.lapack import dgebal

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.errors import LostDigitsWarning, give_warning
from halfdof_ctrl.base.spectrum import balanced
from halfdof_ctrl.model.weak_directions import Factors
from halfdof_ctrl.reduction.method.loss_points import BELOW_ALL, BESIDE_MODE, loss_points, over_modes
from halfdof_ctrl.systems.transfer_check import system_response

WARNED = 1e-6  #: part of the value from which a loss is told
UNEVEN = 1e4  #: change of A by balancing, in its norm times the range of the factors, from which it is measured
EVALUATION_LOSS_MOST_STATES = 1000  #: for which it is measured: beyond, it is estimated
HESSENBERG_ROUNDING = EPS / 3.0  #: of the norm of A, over n: what each entry changes; 0.4 to 17 times what was found
EVALUATION_LOSS_MANY_STATES = 200  #: from which it is measured at one frequency alone
BESIDE_ORIGIN = 1.01  #: times the largest pole that stands for one at the origin: frequencies up to there are not tried
SHALLOW = 1e-3  #: of a channel's largest value: below, a loss is measured by that
EVALUATION_LOSS_ZERO_CHANNEL = 100.0  #: times what rounding of A, B, C, D changes in it: a smaller channel is zero
CURES = {
    "dofs": 'mech2ss(model, states="scaled") keeps the digits, as "energy" does where a model has it, and so does',
    "scaled": 'mech2ss(model, states="energy") keeps more digits where a model has such states, and so does',
}


@dataclass(frozen=True, slots=True)
class EvaluationLoss:
    """Which part of a value python-control's evaluation loses, where that is most."""

    value: float
    omega: float  #: [rad/s]
    output: int
    source: int
    estimated: bool = False  #: and not measured


def warn_of_evaluation(sys: control.StateSpace, states: str, at_origin: int) -> None:
    """Warn where python-control's evaluation of a system loses more than 1e-6.

    Parameters
    ----------
    sys : control.StateSpace
        As it is handed to the user.
    states : str
        What the states are.
    at_origin : int
        Number of its poles at exactly 0.

    Warns
    -----
    LostDigitsWarning
    """
    loss = evaluation_loss(sys, at_origin)
    if loss is None or not loss.value > WARNED:
        return
    msg = (
        f"A, B, C and D are right, but python-control's evaluation of them (sys(s), control.bode_plot, "
        f"control.frequency_response) will lose {_part_in_words(loss)} of {sys.output_labels[loss.output]} from "
        f"{sys.input_labels[loss.source]} at {loss.omega:.3g} rad/s: it does not balance states of different sizes. "
        f"{CURES.get(states, 'The digits are kept by')} halfdof_ctrl.frequency_response."
    )
    give_warning(msg, LostDigitsWarning)


def evaluation_loss(sys: control.StateSpace, at_origin: int = 0) -> EvaluationLoss | None:
    """Measure what python-control's evaluation loses, at the frequencies where it shows.

    None where it can lose nothing. An error is relative to the value, or to a thousandth of the channel's largest where
    the value is smaller. So many of the slowest poles of A are zeros that rounding has moved: nobody looks there.
    """
    A = np.asarray(sys.A, dtype=float)
    if not _is_uneven(A):
        return None
    points = _points(A, at_origin)
    if points.size == 0:
        return None
    estimated = len(A) > EVALUATION_LOSS_MOST_STATES and slycot_check()  # without it control solves once, as we do here
    points = points[:1] if estimated else points
    right = system_response(sys, points)
    size = np.nan_to_num(np.abs(right.values))
    errors = np.minimum(_hessenberg_rounding(sys, points[0]), size) if estimated else _errors(sys, points, right.values)
    seen = (size > EVALUATION_LOSS_ZERO_CHANNEL * np.nan_to_num(right.data, nan=np.inf)).any(axis=2, keepdims=True)
    value = np.maximum(size, SHALLOW * size.max(axis=2, keepdims=True))
    told = seen & np.isfinite(right.values) & (value > 0.0)
    shares = np.divide(errors, value, out=np.zeros(value.shape), where=told)
    if not shares.size:
        return None
    i, j, k = (int(place) for place in np.unravel_index(int(shares.argmax()), shares.shape))
    value = float(shares[i, j, k])
    relative = value if value <= WARNED else float(errors[i, j, k] / size[i, j, k])  # that is what a user finds there
    return EvaluationLoss(relative, float(abs(points[k])), i, j, estimated)


def _errors(sys: control.StateSpace, points: ComplexArray, right: ComplexArray) -> FloatArray:
    found = np.asarray(sys(points, squeeze=False, warn_infinite=False))
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(np.nan_to_num(np.abs(found - right), nan=np.inf))


def _hessenberg_rounding(sys: control.StateSpace, point: complex) -> FloatArray:
    """Estimate what rounding of A's Hessenberg form changes at a point of m inputs and p outputs, (p, m, 1).

    The form is that of A + E, where E is about as large in all places. With (s I - A) x = b and (s I - A)^T y = c the
    response changes by y^T E x, a sum of n^2 terms of either sign: about n times one of mean size.
    """
    n = sys.nstates
    factors = Factors.of_dense(point * np.eye(n) - sys.A)
    if factors is None:
        return np.full((sys.noutputs, sys.ninputs, 1), np.inf)
    x, y = factors.solve(sys.B.astype(np.complex128)), factors.solve_transposed(sys.C.T.astype(np.complex128))
    rounding = HESSENBERG_ROUNDING / n * np.linalg.norm(sys.A)
    return np.asarray(rounding * np.outer(np.linalg.norm(y, axis=0), np.linalg.norm(x, axis=0)))[:, :, None]


def _part_in_words(loss: EvaluationLoss) -> str:
    return f"{loss.value:.1e}" if not loss.estimated else "all" if loss.value >= 1.0 else f"about {loss.value:.0e}"


def _points(A: FloatArray, at_origin: int) -> ComplexArray:
    """Choose frequencies: beside the slowest modes and a decade below, and over the faster ones."""
    points = loss_points(A)
    if len(A) > EVALUATION_LOSS_MANY_STATES and not at_origin:
        return points[:1]
    size = np.sort(np.abs(np.linalg.eigvals(balanced(A))))
    still = BESIDE_ORIGIN * size[min(at_origin, len(A)) - 1] if at_origin else 0.0
    points = points[np.abs(points) > still]
    if len(A) > EVALUATION_LOSS_MANY_STATES or points.size == 0:
        return points[:1]
    slowest = float(np.abs(points).min())
    faster = size[size > slowest]
    below = max(BELOW_ALL * slowest, still)
    return np.concatenate([points, over_modes(faster), [1j * BESIDE_MODE * below]])


def _is_uneven(A: FloatArray) -> bool:
    """Return whether balancing changes A so much that doing without it may lose a part of 1e-6."""
    balanced, _, _, factors, _ = dgebal(A, scale=1, permute=0)
    change = np.linalg.norm(A) / np.linalg.norm(balanced) * (factors.max() / factors.min())
    return bool(change > UNEVEN)
