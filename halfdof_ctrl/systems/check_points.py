"""The points at which the cross-check compares transfer functions, and the poles that count as moving."""

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.systems.refined_poles import RefinedPoles

SMALL_EIGENVALUE = 1e-6  #: of the largest or the typical frequency: eigenvalues below may stand for one at the origin
SURELY_AWAY = 100.0  #: times its bound: an eigenvalue beyond that is not at the origin
EIGENVALUE_AT_ORIGIN = 1e-12  #: of the typical frequency: eigenvalues below are at the origin
CLEARANCE = 1e-3  #: points keep this relative distance from the poles on the imaginary axis
WIDER = 10.0  #: times the sizes of the slowest and the fastest pole, as far as points on the axis go
GRID_POINTS = 60  #: points on the axis besides those at the poles
FEWEST_ON_GRID = 15  #: of these in the largest models
MOST_POLE_POINTS = 100  #: poles that get a point of their own
OFF_AXIS = (1.0 + 0.0j, 1.0 + 1.0j)  #: directions of the points off the axis, in units of a pole's size


def moving_eigenvalues(finite: ComplexArray, bounds: FloatArray, poles: RefinedPoles, gamma: float) -> ComplexArray:
    """Leave out eigenvalues at the origin, which QZ finds at the square root of rounding where they are double.

    One counts as at the origin if it is small, its nearest pole of the state space is zero to what A tells, and its own
    bound does not keep it from there: beside a half DOF of 1e13 rad/s A tells of no slow pole that it is not zero.
    Where none is left, the model's typical frequency stands for the time scale.
    """
    kept = np.abs(finite) > EIGENVALUE_AT_ORIGIN * gamma
    kept |= bounds * SURELY_AWAY < np.abs(finite)
    away, bounds = finite[kept], bounds[kept]
    if poles.values.size and away.size:
        nearest = np.abs(away[:, None] - poles.values).argmin(axis=1)
        at_origin = _is_small(away, gamma) & poles.at_origin[nearest]
        away = away[~(at_origin & (np.abs(away) <= SURELY_AWAY * bounds))]
    return np.asarray(away) if away.size else np.array([-gamma + 0.0j])


def _is_small(eigenvalues: ComplexArray, gamma: float) -> npt.NDArray[np.bool_]:
    """Return which eigenvalues are so small that they may stand for one at the origin."""
    return np.asarray(np.abs(eigenvalues) <= SMALL_EIGENVALUE * max(np.abs(eigenvalues).max(initial=0.0), gamma))


def check_points(moving: ComplexArray, most: int) -> ComplexArray:
    """Choose points on the imaginary axis around and at the poles, and off the axis, about as many as asked for."""
    share = min(1.0, most / (GRID_POINTS + 2 * MOST_POLE_POINTS))
    at_most = max(1, int(share * MOST_POLE_POINTS))
    chosen = moving[np.unique(np.linspace(0, moving.size - 1, min(moving.size, at_most)).astype(np.intp))]
    low, high = np.abs(moving).min(), np.abs(moving).max()
    grid = np.geomspace(low / WIDER, high * WIDER, max(FEWEST_ON_GRID, int(share * GRID_POINTS)))
    swinging = chosen[chosen.imag >= low / WIDER]  # a slower one of a pair beside it on the real axis shows nothing
    lift = np.maximum(0.0, CLEARANCE * np.abs(swinging) - np.abs(swinging.real))
    at_poles = lift + 1j * swinging.imag
    at_sizes = 1j * np.abs(chosen)
    off_axis = np.concatenate([direction * np.array([low, np.sqrt(low * high), high]) for direction in OFF_AXIS])
    points = np.concatenate([1j * grid, at_poles, at_sizes, off_axis])
    near = np.abs(points[:, None] - moving).min(axis=1) < CLEARANCE * np.abs(points)
    return np.where(near, points + CLEARANCE * np.abs(points), points)
