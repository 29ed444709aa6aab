"""Times of a step response, from the modes that are seen in it; no matplotlib here.

python-control takes the fastest and the slowest pole, whatever they contribute, and a fixed number of points:
with poles 1e5 apart, or with a slow pole that no output shows, its picture misleads. Here a mode counts if
it moves some output by more than 1e-3 of what that output does. With the residue r_k of H at s_k (`seen_modes`) a mode
of a step response is

    r_k (exp(s_k t) - 1) / s_k                                                             (14)
"""

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.systems.pole_bounds import BoundedPoles
from halfdof_ctrl.systems.seen_modes import seen_modes

SETTLING_TIME_CONSTANTS = 5.0  #: time constants after which a mode has settled, exp(-5) = 0.7 %
MOST_PERIODS = 20  #: of a lightly damped mode; more would fill the picture
SEEN = 200  #: a mode that settles within this fraction of the horizon is a jump to the eye
FINE_STEP = 0.2  #: step length times the size of the fastest mode that is seen: 31 points a period
COARSEST_STEP = 1.0  #: the same where FINE_STEP would take too many points: 6 points a period
FEWEST_STEPS = 500
MOST_TIME_STEPS = 10_000
NO_SCALE = 1.0  #: [s] horizon of a system whose modes give none: no poles, or integrators alone


def step_times(poles: npt.ArrayLike, horizon: float | None = None) -> FloatArray:
    """Choose equidistant times that show a step response.

    Parameters
    ----------
    poles : (k,) array_like of complex
        Poles [rad/s] of the modes that are seen, as `relevant_poles` gives them: integrators exactly zero.
    horizon : float, optional
        Last time [s]. By default the slowest mode settles (five time constants) or, lightly or not
        damped, swings 20 periods; the fastest unstable one grows by exp(5) at most. Integrators have no time
        scale and follow the others; alone, or without any pole, they get 1 s.

    Returns
    -------
    (n,) ndarray
        Times [s] from 0 to the horizon in 500 to 10 000 equal steps. Modes that live for a visible part of
        the picture have 31 points a period, 6 if that takes too many; where even this is too much, an
        unstated horizon ends early.

    Raises
    ------
    ParameterError
        A horizon that is no positive number, or poles that are no numbers.

    Examples
    --------
    A stiff system settles with its slow pole, and the fast one is a jump:

    >>> float(step_times([-1e5, -0.5])[-1])
    10.0
    """
    values = np.atleast_1d(np.asarray(poles, dtype=np.complex128))
    if not np.isfinite(values).all():
        msg = "poles must be finite numbers [rad/s]."
        raise ParameterError(msg, parameter="poles", value=poles)
    if horizon is not None and not (np.isfinite(horizon) and horizon > 0.0):
        msg = f"The horizon of a step response must be a positive number of seconds, not {horizon}."
        raise ParameterError(msg, parameter="horizon", value=horizon)
    moving = values[values != 0.0]
    end = _default_horizon(moving) if horizon is None else float(horizon)
    with np.errstate(divide="ignore", over="ignore"):
        seen = np.abs(moving[SETTLING_TIME_CONSTANTS / np.abs(moving.real) > end / SEEN])
    fastest = float(seen.max(initial=0.0))
    if horizon is None and end * fastest > COARSEST_STEP * MOST_TIME_STEPS:
        end = COARSEST_STEP * MOST_TIME_STEPS / fastest
    steps = int(np.clip(np.ceil(end * fastest / FINE_STEP), FEWEST_STEPS, MOST_TIME_STEPS))
    return np.linspace(0.0, end, steps + 1)


def relevant_poles(
    A: npt.ArrayLike, B: npt.ArrayLike, C: npt.ArrayLike, D: npt.ArrayLike, poles: BoundedPoles | None = None
) -> ComplexArray:
    """Find the poles whose modes are seen in a step response, those at the origin as exact zeros.

    Parameters
    ----------
    A, B, C, D : (N, N), (N, m), (p, N), (p, m) array_like
        A continuous-time state space.
    poles : BoundedPoles, optional
        Eigenvalues of A, where more is known of them than A says (`model_poles`).

    Returns
    -------
    (k,) complex ndarray
        Poles [rad/s] of modes that reach 1e-3 of the largest term of (14), or of D, in some channel. All
        poles where no mode does.

    Examples
    --------
    The slow mode does not reach the output:

    >>> relevant_poles([[-1, 0], [0, -1e-6]], [[1], [1]], [[1, 0]], [[0]])
    array([-1.+0.j])
    """
    A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in (A, B, C, D))
    if A.size == 0:
        return np.zeros(0, dtype=np.complex128)
    modes = seen_modes(A, B, C, D, poles)
    moving = modes.in_step & (modes.poles != 0.0)
    return np.asarray(modes.poles[modes.in_step] if moving.any() else modes.poles)


def _default_horizon(moving: ComplexArray) -> float:
    """Return the time [s] until the slowest mode has settled or swung long enough, or an unstable one has grown."""
    if moving.size == 0:
        return NO_SCALE
    with np.errstate(divide="ignore", over="ignore"):
        settled = SETTLING_TIME_CONSTANTS / np.abs(moving.real)
        swung = MOST_PERIODS * 2.0 * np.pi / np.abs(moving.imag)
    end = float(np.minimum(settled, swung).max())
    growth = float(moving.real.max())
    return min(end, SETTLING_TIME_CONSTANTS / growth) if growth > 0.0 else end
