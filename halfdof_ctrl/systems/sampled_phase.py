"""A continuous phase of sampled values."""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, IndexArray

HALF_TURN = 1e-6  #: [rad] a jump of the phase this close to pi comes from an undamped pole or zero


def continuous_phase(values: ComplexArray) -> FloatArray:
    """Return the phase [rad] of a frequency response without jumps, NaN where there is none.

    Parameters
    ----------
    values : (k,) complex ndarray
        At rising frequencies.

    Returns
    -------
    (k,) ndarray
        ``numpy.angle`` plus whole turns. The first value lies in [-pi, pi], a negative real one at pi
        where the magnitude rises (a zero at the origin), else at -pi; a half turn is taken downwards
        where the magnitude rises into it (an undamped pole), else upwards (a zero).

    Examples
    --------
    >>> continuous_phase(np.array([1.0, 2.0, -2.0, -1.0, 1.0])).round(3).tolist()
    [0.0, 0.0, -3.142, -3.142, 0.0]
    """
    angle = np.where((values == 0.0) | ~np.isfinite(values), np.nan, np.angle(values))
    there = np.flatnonzero(~np.isnan(angle))
    if there.size == 0:
        return angle
    known, size = angle[there], np.abs(values[there])
    if np.pi - np.abs(known[0]) < HALF_TURN and (known[0] > 0.0) != (size[1:2] > size[0]).any():
        known[0] = -known[0]
    jumps = np.mod(np.diff(known) + np.pi, 2.0 * np.pi) - np.pi
    half = np.pi - np.abs(jumps) < HALF_TURN
    rising = np.diff(size[:-1], prepend=0.0) >= 0.0
    jumps += 2.0 * np.pi * ((half & ~rising & (jumps < 0.0)) * 1.0 - (half & rising & (jumps > 0.0)) * 1.0)
    unwrapped = known[0] + np.concatenate([[0.0], np.cumsum(jumps)])
    phase = angle.copy()
    phase[there] += 2.0 * np.pi * np.round((unwrapped - angle[there]) / (2.0 * np.pi))
    return phase


def on_branch(values: ComplexArray, phase: FloatArray, places: IndexArray) -> FloatArray:
    """Return the phase of values at some points of a curve, on the turn nearest to the curve there.

    Parameters
    ----------
    values : (l,) complex ndarray
    phase : (k,) ndarray
        Phase of the curve [rad].
    places : (l,) ndarray of int
        Which points; at an undamped pole a value may be on either side of its half turn, so their neighbours count too.
    """
    angle = np.where(values == 0.0, np.nan, np.angle(values))
    last = phase.size - 1
    around = np.stack([phase[np.clip(places + step, 0, last)] for step in (0, -1, 1)])
    turned = angle + 2.0 * np.pi * np.nan_to_num(np.round((around - angle) / (2.0 * np.pi)))
    nearest = np.nan_to_num(np.abs(turned - around), nan=np.inf).argmin(axis=0)
    return np.asarray(turned[nearest, np.arange(places.size)])
