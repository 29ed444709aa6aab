"""A continuous phase of sampled values."""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray

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


def on_branch(values: ComplexArray, phase: FloatArray) -> FloatArray:
    """Return the phase of values on the turn nearest to a given one."""
    angle = np.where(values == 0.0, np.nan, np.angle(values))
    turns = np.round((phase - angle) / (2.0 * np.pi))
    return np.asarray(angle + 2.0 * np.pi * np.where(np.isnan(turns), 0.0, turns))
