"""One law between a motion and a force: what a spring makes of an elongation, a damper of its rate.

    f = force(x),    f' = slope(x),    x = inverse(f)  for  bounds[0] < f < bounds[1]

`Law` holds any such function; the ones that are built in come from `halfdof_ctrl.laws` and are values: they print as
they are typed, compare, pickle and can be stored. Laws know no model; docs/explanation/laws.md has what they must be
where a DOF without mass hangs on them.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from halfdof_ctrl.base.doors import real_numbers, shown
from halfdof_ctrl.base.errors import ParameterError

Function: TypeAlias = Callable[[Any], Any]

EVERYWHERE = (-np.inf, np.inf)
RELATIVE_STEP = float(np.cbrt(np.finfo(float).eps))  #: of central differences: their two errors meet there
LADDER = 10.0 ** -np.arange(3, 14)  #: steps at x = 0, where a relative step has nothing to be relative to
STEADY = 1e-3  #: quotients that change less than this from one step to the next have arrived
FADING = 0.9  #: quotients that fall by this factor a rung go to zero, and to infinity if they rise by its inverse


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Law:
    """A force as a function of one elongation or of its rate.

    Parameters
    ----------
    force : callable
        ``f(x)`` [N]: takes a number or an array, gives as much. x is an elongation [m] in a `Spring`, its rate [m/s]
        in a `Damper`.
    slope : callable, optional
        Its derivative [N/m or N s/m], vectorized likewise; inf is allowed. By default it is differenced with a step
        relative to x.
    inverse : callable, optional
        The x that answers a force, where there is exactly one. By default it is solved for where it is needed.
    bounds : (float, float), optional
        The force that the law approaches to the left and to the right, -inf and inf if it grows without end. By
        default they are unknown, and found by trying very large x where they matter.
    monotone : bool, optional
        Whether the force never falls while x grows. True is believed only where values do not contradict it.
    domain : (float, float), optional
        Where the law is known; by default everywhere.

    Raises
    ------
    ParameterError
        Something that must be callable is not, bounds or a domain that are not two rising numbers.

    Examples
    --------
    A rubber that stiffens, with its slope:

    >>> rubber = Law(np.sinh, np.cosh, np.arcsinh, bounds=(-np.inf, np.inf))
    >>> float(rubber.force(0.0)), float(rubber.slope(0.0))
    (0.0, 1.0)
    """

    force: Function
    slope: Function = None  # type: ignore[assignment]  # replaced below by a differenced one
    inverse: Function | None = None
    bounds: tuple[float, float] | None = None
    monotone: bool = True
    domain: tuple[float, float] = EVERYWHERE
    written: str | None = field(default=None, kw_only=True)  #: how a built-in law is typed; None for a user function
    flat: bool = field(default=False, kw_only=True)  #: whether the force is known to stay the same over some way
    beside: Callable[[float], "Law"] | None = field(default=None, kw_only=True)  #: the law with ``c x`` added, of c

    def __post_init__(self) -> None:
        """Check the parts, and difference a slope that is missing."""
        for what, part in (("force", self.force), ("slope", self.slope), ("inverse", self.inverse)):
            if not callable(part) and (part is not None or what == "force"):
                msg = f"The {what} of a law must be a function of one variable, not {shown(part)}. Give a callable."
                raise ParameterError(msg, parameter=what, value=part)
        for what, pair in (("bounds", self.bounds), ("domain", self.domain)):
            if pair is not None and not _is_rising_pair(pair):
                msg = f"The {what} of a law must be two numbers of which the second is larger, not {shown(pair)}."
                raise ParameterError(msg, parameter=what, value=pair)
        given: object = self.slope
        if given is None:
            object.__setattr__(self, "slope", DifferencedSlope(self.force))

    @property
    def name(self) -> str:
        """Name of a built-in law (``quadratic``) or of the user's function."""
        if self.written is not None:
            return self.written.partition("(")[0]
        return str(getattr(self.force, "__name__", type(self.force).__name__)).strip("<>")

    def __eq__(self, other: object) -> bool:
        """Built-in laws are equal if they are typed alike, others if they have the same functions."""
        if not isinstance(other, Law):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        if self.written is not None:
            return (self.written,)
        slope = None if isinstance(self.slope, DifferencedSlope) else self.slope
        return (self.force, slope, self.inverse, self.bounds, self.monotone, self.domain)

    def __repr__(self) -> str:
        """Give a built-in law as it is typed, any other by the name of its function."""
        return self.written if self.written is not None else f"Law({self.name})"


@dataclass(frozen=True, slots=True)
class DifferencedSlope:
    """The slope of a function by central differences with a step relative to x.

    A fixed step knows nothing of a law that bends within it: 1e-6 m/s is wide for oil that seeps. At x = 0 the
    quotient is followed down a ladder of steps to its limit, which may be 0 (a square law) or infinite (a root).
    """

    force: Function

    def __call__(self, x: Any) -> Any:  # noqa: ANN401  # a number or an array, as the force takes
        """Give the slope at x, as many values as x has."""
        values = np.asarray(x, dtype=float)
        slopes = np.array([self._at(float(value)) for value in values.reshape(-1)])
        return float(slopes[0]) if values.ndim == 0 else slopes.reshape(values.shape)

    def _at(self, x: float) -> float:
        if x != 0.0:
            return self._quotient(x, RELATIVE_STEP * abs(x))
        quotients = np.array([self._quotient(0.0, float(step)) for step in LADDER])
        return _limit(quotients)

    def _quotient(self, x: float, step: float) -> float:
        above, below = x + step, x - step
        return float((self.force(above) - self.force(below)) / (above - below))


def _limit(quotients: np.ndarray) -> float:
    """Give the limit of difference quotients whose steps fall by ten from one to the next."""
    size = np.abs(quotients)
    if not np.isfinite(size).all() or size[-1] == 0.0:
        return float(quotients[-1])
    change = np.abs(np.diff(quotients)) / size[1:]
    best = int(change.argmin())
    if change[best] <= STEADY:
        return float(quotients[best + 1])
    ratios = size[1:] / np.maximum(size[:-1], np.finfo(float).tiny)
    if (ratios < FADING).all():
        return 0.0
    if (ratios > 1.0 / FADING).all():
        return float(np.copysign(np.inf, quotients[-1]))
    return float(quotients[best + 1])


def _is_rising_pair(pair: object) -> bool:
    try:
        low, high = real_numbers(pair, "bounds", "two numbers").tolist()
        return bool(low < high)
    except Exception:  # noqa: BLE001  # the object is the user's, and so is what it raises
        return False
