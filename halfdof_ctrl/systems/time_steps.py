"""A linear system from one time to the next, where the steps of python-control lose digits.

python-control takes e^(A h) of a solver in doubles, which leaves u |A| h in each step. With poles a million times
faster than the motion that is shown these add up to u |A| times its length: to 1e-7 of a motion of ten periods. Such
systems take steps that are known to all digits of a double (`matrix_exponential`), and larger ones are told of.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, FloatArray
from halfdof_ctrl.base.errors import LostDigitsWarning, give_warning
from halfdof_ctrl.base.matrix_exponential import exact_step
from halfdof_ctrl.base.spectrum import balanced_states

STEPS_LOSE = 1e-11  #: u |A| times the length of a response, up to which steps in doubles do; they lose some tenth of it
STEPS_MOST_STATES = 500  #: up to which exact steps take no longer than the rest of a response; with more ...
STEPS_TOLD = 1e-5  #: ... such a loss is told; it was a hundredth to a tenth of it


@dataclass(frozen=True, slots=True, eq=False)
class TimeSteps:
    """``x(t + h) = transition x(t) + of_value u(t) + of_change (u(t + h) - u(t))``, for N states and m inputs."""

    transition: FloatArray  #: (N, N)
    of_value: FloatArray  #: (N, m)
    of_change: FloatArray  #: (N, m)

    def states(self, inputs: FloatArray, start: FloatArray | float = 0.0) -> FloatArray:
        """Follow the states, (N, j, k), in j traces of inputs (m, j, k) that are linear between the times."""
        u = np.ascontiguousarray(np.moveaxis(inputs, 2, 0))  # times first, so that each is in one piece
        x = np.empty((len(u), len(self.transition), u.shape[2]))
        x[0] = np.reshape(start, (-1, 1))
        driven = self.of_value @ u[:-1] + self.of_change @ np.diff(u, axis=0)
        for k in range(len(driven)):
            np.matmul(self.transition, x[k], out=x[k + 1])
            x[k + 1] += driven[k]
        return np.moveaxis(x, 0, 2)


def time_steps(A: FloatArray, B: FloatArray, time: FloatArray) -> TimeSteps | None:
    """Return exact steps between equidistant times, or None where steps in doubles do, or exact ones take too long.

    Parameters
    ----------
    A, B : (N, N), (N, m) ndarrays
    time : (k,) ndarray
        At least two.

    Returns
    -------
    TimeSteps or None

    Warns
    -----
    LostDigitsWarning
        Steps in doubles lose digits of a system for which exact ones take too long.

    Examples
    --------
    A pole of -1e9 beside one of -1 [rad/s]: after ten time constants of the slow one e^-10 is left of it.

    >>> times = np.linspace(0.0, 10.0, 101)
    >>> steps = time_steps(np.array([[-1e9, 1e9], [0.0, -1.0]]), np.zeros((2, 1)), times)
    >>> x = steps.states(np.zeros((1, 1, 101)), np.ones(2))
    >>> bool(abs(x[1, 0, -1] / np.exp(-10.0) - 1.0) < 1e-13)
    True
    >>> time_steps(np.array([[-2.0]]), np.ones((1, 1)), times) is None
    True
    """
    if not len(A):
        return None
    matrix, scale = balanced_states(A)
    span = float(time[-1] - time[0])
    lost = UNIT_ROUNDOFF * float(np.abs(matrix).sum(axis=0).max()) * span
    if lost <= STEPS_LOSE:
        return None
    if len(A) > STEPS_MOST_STATES:
        if lost > STEPS_TOLD:
            _warn(lost, len(A), span)
        return None
    (change, rest), *driven = exact_step(matrix, B / scale[:, None], span / (time.size - 1))
    of_value, of_change = (scale[:, None] * (high + low) for high, low in driven)
    if not all(np.isfinite(part).all() for part in (change, of_value, of_change)):
        return None  # a motion that grows beyond the largest number within a step
    transition = (np.eye(len(A)) + change + rest) * scale[:, None] / scale
    return TimeSteps(transition, of_value, of_change)


def _warn(lost: float, states: int, span: float) -> None:
    part = f"{lost:.0e} of the motion" if lost < 1.0 else "all of the motion"
    msg = (
        f"The steps in time of {states} states lose up to {part} in {span:.3g} s: some poles are far faster than what "
        f"lasts so long, and steps that keep its digits are taken up to {STEPS_MOST_STATES} states. Give a shorter "
        "time, or make static what is faster than all that you look at, with truncate_modes or by leaving its masses "
        "and dampers out; frequency_response keeps the digits."
    )
    give_warning(msg, LostDigitsWarning)
