"""By which values of a channel a loss is judged: what rises or falls steeply without end is not looked at for its own.

Values are those of p outputs of k inputs at some frequencies in rising order, (points, p, k).
"""

import sys
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray, Matrix, as_dense
from halfdof_ctrl.base.sparse_arrays import filled_rows
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.loss_points import Slow
from halfdof_ctrl.reduction.method.refined_answers import Response

STEEP = 2.5  #: power of s beyond which a channel falls steeply, towards either end: there, ...
ENVELOPE_POWER = 3.0  #: ... a loss is measured by what it would be if it fell by this power ...
APART = 5.0  #: ... from frequencies that are so many times lower or higher
NEAR_REST = 1e-5  #: part that is left of a velocity there: rounding of displacements leaves ten digits of it
STEEP_RISE = 4.0  #: power of s of what is no input or output of a kind
STAYS = 2.0  #: ratio of the values of a channel at neighbouring frequencies that are about the same
ZERO_CHANNEL = 100.0  #: times what rounding of M, C and K changes in it, or of sums: a smaller channel is zero
SMALL_CHANNEL = 1e-6  #: of the largest motion, scaled: only a smaller channel can be zero but for rounding of M, C, K


def slopes_from(omega: FloatArray, value: FloatArray) -> FloatArray:
    """Return what channels would be at each point if they fell no more steeply than by s^3 from any other point."""
    ratio = np.maximum(omega, omega[:, None]) / np.minimum(omega, omega[:, None])
    shares = np.where(ratio >= APART, ratio**-ENVELOPE_POWER, 0.0)
    return np.asarray((shares[:, :, None, None] * value).max(axis=1, initial=0.0))


def is_looked_at(omega: FloatArray, value: FloatArray, slow: Slow, kinds: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which channels are looked at: below all that moves, those that change gently, and at rest, hardly at all.

    Others fall or rise without end there, but for velocities and inputs that are derivatives (`kinds` of channels, (p,
    k), powers of s), which are looked at down to where rounding of displacements leaves ten digits of them.
    """
    at_rest = (omega < slow.least)[:, None, None]
    looked_at = is_gentle(omega, value) & ~at_rest
    rates = np.zeros((omega.size, 1, 1))
    if slow.least > 0.0:
        rates = np.where((omega[:, None, None] / slow.least) ** kinds > NEAR_REST, kinds, 0.0)
    changes, ratio = _changes(value), (omega[1:] / omega[:-1])[:, None, None]
    looked_at[:-1] |= at_rest[:-1] & (changes < STAYS * ratio ** rates[:-1])
    falls = rates[1:] > 0.0  # from the point below, since above there may be a resonance
    looked_at[1:] |= at_rest[1:] & falls & (changes < STAYS * ratio ** rates[1:])
    looked_at[omega >= slow.typical] = True
    return looked_at


def least_powers(model: SecondOrderModel, chosen: IndexArray) -> FloatArray:
    """Return by which power of s channels fall towards rest at least, by their signals: 1 for a velocity."""
    _, inputs, outputs, direct = model.quadratics
    into = _least([np.any(part != 0.0, axis=0) for part in columns_of(inputs, chosen)])
    seen = _least([np.array(filled_rows([part])) for part in outputs])
    through = _least([part != 0.0 for part in columns_of(direct, chosen)])
    return np.asarray(np.minimum(seen[:, None] + into, through))


def falls_towards_rest(model: SecondOrderModel, chosen: IndexArray) -> bool:
    """Return whether a channel is a velocity, an acceleration or what a derivative of an input does."""
    return bool((least_powers(model, chosen) > 0.0).any())


def _least(is_there: Sequence[npt.NDArray[np.bool_]]) -> FloatArray:
    """Return the first of powers 0, 1, 2 of which there is something."""
    return np.asarray(np.min([np.where(part, float(k), STEEP_RISE) for k, part in enumerate(is_there)], axis=0))


def is_gentle(omega: FloatArray, value: FloatArray) -> npt.NDArray[np.bool_]:
    """Return where channels change, to the point below or above, by no power of s that is steep."""
    gently = _changes(value) < STAYS * ((omega[1:] / omega[:-1]) ** STEEP)[:, None, None]
    gentle = np.zeros(value.shape, dtype=np.bool_)
    gentle[:-1] |= gently
    gentle[1:] |= gently
    return gentle


def _changes(value: FloatArray) -> FloatArray:
    """Return the ratios of neighbouring values, the larger over the smaller."""
    ratio = np.divide(value[:-1], value[1:], out=np.zeros_like(value[1:]), where=value[1:] > 0.0)
    return np.asarray(np.maximum(ratio, 1.0 / np.maximum(ratio, sys.float_info.min)))


def rounding_of_zeros(value: FloatArray) -> FloatArray:
    """Return below which size a channel is zero but for rounding at each point, in units of rows and columns."""
    rows = value.max(axis=2, keepdims=True)
    across = np.divide(value, rows, out=np.zeros_like(value), where=rows > 0.0).max(axis=1, keepdims=True)
    return np.asarray(ZERO_CHANNEL * EPS * rows * across)


def rounding_of_channels(true: Response, moved: FloatArray) -> FloatArray:
    """Return below which size values are zero: by sums, and of a small channel, by rounding of M, C, K."""
    rounding, value = ZERO_CHANNEL * true.rounding, np.abs(true.y)
    small, most = SMALL_CHANNEL * true.shown, ZERO_CHANNEL * moved
    is_zero = (value <= np.minimum(small, most)) & (most <= small)
    return np.asarray(np.where(is_zero, np.maximum(rounding, most), rounding))


def columns_of(coefficients: Sequence[Matrix], chosen: IndexArray) -> list[FloatArray]:
    """Return columns of a polynomial's coefficients, dense."""
    return [np.asarray(as_dense(part[:, chosen])) for part in coefficients]
