"""Products and residuals of real matrices in about twice the working precision, the same on every platform."""

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.exact_products import SlicedMatrix, two_sum


def exact_residual(target: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return ``target - left @ right``, rounded once where the terms do not cancel beyond twice the precision.

    Parameters
    ----------
    target : (n, m) ndarray
    left : (n, k) ndarray
    right : (k, m) ndarray

    Returns
    -------
    (n, m) ndarray
        With an error of about k 2^-97 of the product of the largest entries of the row of `left` and the column of
        `right`, and one rounding.

    Examples
    --------
    >>> third = np.array([[1.0 / 3.0]])
    >>> float(exact_residual(np.array([[1.0]]), third, np.array([[3.0]]))[0, 0]) == 2.0**-54
    True
    """
    total, error = np.array(target, dtype=float), np.zeros(target.shape)
    for part in SlicedMatrix.of(left).times(right):
        total, lost = two_sum(total, -part)
        error += lost
    return np.asarray(total + error)


def exact_product(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return ``left @ right`` for (n, k) and (k, m), summed in twice the precision and rounded once.

    Examples
    --------
    >>> exact_product(np.array([[1.0, 2.0**70, -(2.0**70)]]), np.ones((3, 1))).tolist()
    [[1.0]]
    """
    return -exact_residual(np.zeros((left.shape[0], right.shape[1])), left, right)
