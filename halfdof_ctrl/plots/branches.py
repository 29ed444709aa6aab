"""Poles over a parameter: which pole of one value is which of the next."""

import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray

UNKNOWN = 2.0  #: distance to a pole that is not there; no two poles are farther apart


def followed(poles: ComplexArray) -> ComplexArray:
    """Sort poles into branches, so that what moves from each value of a parameter to the next is least in all.

    Distances are relative to the larger of two poles, since slow and fast ones may lie decades apart.

    Parameters
    ----------
    poles : (k, N) complex ndarray
        Poles at k values of a parameter, NaN where there are fewer than N.

    Returns
    -------
    (k, N) complex ndarray
        The same, each branch in a column; NaN where it has no pole.

    Examples
    --------
    >>> followed(np.array([[1j, 2j], [2.1j, 1.1j]])).imag.tolist()
    [[1.0, 2.0], [1.1, 2.1]]
    """
    branches = poles.copy()
    last = poles[:1].reshape(-1).copy()
    for step in range(1, len(poles)):
        _, order = scipy.optimize.linear_sum_assignment(_distances(last, poles[step]))
        branches[step] = poles[step][order]
        last = np.where(np.isnan(branches[step]), last, branches[step])
    return branches


def _distances(first: ComplexArray, second: ComplexArray) -> FloatArray:
    size = np.maximum(np.abs(first)[:, None], np.abs(second))
    apart = np.abs(first[:, None] - second) / np.where(size == 0.0, 1.0, size)
    return np.where(np.isnan(apart), UNKNOWN, apart)
