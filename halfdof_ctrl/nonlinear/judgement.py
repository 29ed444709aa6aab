"""What a law must be where it is solved for: rising, onto, nowhere flat.

Where an element alone holds a DOF without mass, its variable answers its force. There is exactly one answer to every
force if and only if the law rises strictly and without bound. Built-in laws know this of themselves; of others it is
found by values, which can refute but not prove: what they do not see shows during the run, loudly.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.model.law import Law

FAR_POINTS = (1e100, 1e150)  #: where a law is asked whether it still grows
STILL = 1e-6  #: relative growth between these two that is none
GRID = np.concatenate([-np.geomspace(1e12, 1e-9, 253), [0.0], np.geomspace(1e-9, 1e12, 253)])  #: values that are tried
FORCE_ROUNDING = 64 * np.finfo(float).eps  #: a fall by this part of the force is rounding


@dataclass(frozen=True, slots=True)
class Judgement:
    """What is known of a law."""

    rises: bool  #: never falls, as far as is known
    bounds: tuple[float, float]  #: forces that it approaches
    flat: bool  #: stays the same over some way

    @property
    def answers_all(self) -> bool:
        """Whether every force has exactly one answer."""
        return self.rises and not self.flat and self.bounds == (-np.inf, np.inf)


def judged(law: Law) -> Judgement:
    """Judge a law by what it says of itself and, where it is a user's, by its values.

    Examples
    --------
    >>> import numpy as np
    >>> judged(Law(np.tanh)).bounds
    (-1.0, 1.0)
    """
    if law.written is not None:
        return Judgement(law.monotone, _beyond_domain(law, law.bounds or (-np.inf, np.inf)), law.flat)
    x = GRID[(law.domain[0] <= GRID) & (law.domain[1] >= GRID)]
    force = np.array([_value(law, float(value)) for value in x])
    known = np.isfinite(force)
    x, force = x[known], force[known]
    rise = np.diff(force)
    noise = FORCE_ROUNDING * np.maximum(np.abs(force[1:]), np.abs(force[:-1]))
    bounds = _reach(law) if law.bounds is None else law.bounds
    unbounded_part = np.abs(force[1:]) < STILL_BELOW * _largest(bounds)  # a law is flat where it has reached its bound
    flat = law.flat or bool(((rise == 0.0) & (np.abs(force[1:]) > 0.0) & unbounded_part).any() or _dead(x, force))
    return Judgement(law.monotone and bool((rise >= -noise).all()), _beyond_domain(law, bounds), flat)


STILL_BELOW = 0.999  #: of a bound: closer to it, equal values say nothing new
DEAD_ZONE = 1e-6  #: zeros over more than this [m or m/s] around zero are no underflow


def _beyond_domain(law: Law, bounds: tuple[float, float]) -> tuple[float, float]:
    """Call a law unbounded on a side where its domain ends first: a run that gets there is stopped."""
    low, high = law.domain
    return (bounds[0] if low == -np.inf else -np.inf, bounds[1] if high == np.inf else np.inf)


def _dead(x: np.ndarray, force: np.ndarray) -> bool:
    """Tell whether the force is zero over a way that no underflow explains."""
    zero = x[force == 0.0]
    return bool(zero.size and np.ptp(zero) > DEAD_ZONE)


def _largest(bounds: tuple[float, float]) -> float:
    return max(abs(bounds[0]), abs(bounds[1]))


def _reach(law: Law) -> tuple[float, float]:
    """Find the forces that a law approaches far out."""
    ends = []
    for sign in (-1.0, 1.0):
        near, far = (_value(law, sign * at) for at in FAR_POINTS)
        grows = not np.isfinite(far) or not np.isfinite(near) or abs(far - near) > STILL * max(abs(far), abs(near))
        ends.append(sign * np.inf if grows else float(far))
    return (ends[0], ends[1]) if ends[0] < ends[1] else (-np.inf, np.inf)


def _value(law: Law, x: float) -> float:
    try:
        with np.errstate(all="ignore"):
            return float(law.force(x))
    except (ArithmeticError, ValueError):
        return float("nan")
