"""Powers of two for the rows and columns of a matrix, for the oracle: they balance it and round nothing.

The reduction has scaling of its own, so that an error in one cannot hide in the other.
"""

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray

BALANCING_SWEEPS = 10  #: scaling passes over rows and columns
FREE_FACTOR = 1e-9  #: fixes the common factor of rows and columns that the scaling leaves open


def scaling_powers(size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return powers of two for rows and columns that bring their largest entries near one.

    Rows and columns are divided by the square roots of their maxima in turns, zero ones left alone.
    """
    return _with_maxima_near_one(size, np.ones(size.shape[0]), np.ones(size.shape[1]))


def balancing_powers(size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return powers of two for rows and columns that bring their entries near one.

    First in the mean of the logarithms, which has one solution whatever the units were (A. R. Curtis and J. K. Reid,
    1972), then the largest entries.
    """
    present = (size > 0.0).astype(float)
    logs = np.log2(np.where(size > 0.0, size, 1.0))
    normal = np.block([[np.diag(present.sum(axis=1)), present], [present.T, np.diag(present.sum(axis=0))]])
    right = -np.concatenate([logs.sum(axis=1), logs.sum(axis=0)])
    means = np.exp2(np.linalg.solve(normal + FREE_FACTOR * np.eye(len(normal)), right))
    return _with_maxima_near_one(size, means[: size.shape[0]], means[size.shape[0] :])


def _with_maxima_near_one(size: FloatArray, rows: FloatArray, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    for _ in range(BALANCING_SWEEPS):
        scaled = size * rows[:, None] * columns
        down, across = np.sqrt(scaled.max(axis=1, initial=0.0)), np.sqrt(scaled.max(axis=0, initial=0.0))
        rows, columns = rows / np.where(down > 0.0, down, 1.0), columns / np.where(across > 0.0, across, 1.0)
    return np.exp2(np.round(np.log2(rows))), np.exp2(np.round(np.log2(columns)))
