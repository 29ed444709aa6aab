"""One scalar equation of a law that rises: ``law(w) + rest w = r`` has exactly one root.

By the law's inverse where it has one (with the rest, where the law knows how to take it up), else by Newton's method
inside a bracket, which starts anew from the same place at every call: the root depends on r alone.
"""

import math
from collections.abc import Callable

import numpy as np

from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.model.law import Law

MOST_DOUBLINGS = 2200  #: from 2^-1074 to 2^1024 and back: every positive double
MOST_SCALAR_STEPS = 200  #: of Newton or bisection inside the bracket; bisection alone takes 64 for all digits

Root = Callable[[float], float]


def root_of(law: Law, rest: float) -> Root:
    """Return the function that solves ``law(w) + rest w = r`` for w; NaN where no w answers r.

    Examples
    --------
    >>> from halfdof_ctrl import laws
    >>> round(root_of(laws.power(1, 3), 1.0)(10.0), 12)
    2.0
    """
    whole = law if rest == 0.0 else law.beside(rest) if law.beside is not None else None
    if whole is not None and whole.inverse is not None:
        return _by_inverse(whole)
    return _by_bracket(law, rest)


def _by_inverse(law: Law) -> Root:
    inverse, (low, high) = law.inverse, law.bounds or (-math.inf, math.inf)

    def root(r: float) -> float:
        return float(inverse(r)) if low < r < high else math.nan  # type: ignore[misc]  # the caller has seen that it is

    return root


def _by_bracket(law: Law, rest: float) -> Root:
    force, slope = law.force, law.slope
    lowest, highest = law.domain

    def residual(w: float, r: float) -> float:
        return float(force(w)) + rest * w - r

    def root(r: float) -> float:
        at_zero = residual(0.0, r) if lowest <= 0.0 <= highest else math.nan
        if at_zero == 0.0 or not math.isfinite(at_zero):
            return 0.0 if at_zero == 0.0 else math.nan
        end = highest if at_zero < 0.0 else lowest
        with np.errstate(over="ignore", invalid="ignore"):  # far out, where only signs matter
            found = _bracket(lambda w: residual(w, r), at_zero, end, first=abs(at_zero) / _steepness(slope, rest))
            if found is None:
                return math.nan
            return _newton(lambda w: residual(w, r), lambda w: float(slope(w)) + rest, *found)

    return root


def _steepness(slope: Callable[[float], float], rest: float) -> float:
    """Return the slope at rest, or one where it tells nothing of the size of the root."""
    at_rest = float(slope(0.0)) + rest
    return at_rest if math.isfinite(at_rest) and at_rest > 0.0 else 1.0


def _bracket(residual: Root, at_zero: float, end: float, first: float) -> tuple[float, float] | None:
    """Find two values between which the residual changes sign, going out from zero by ever larger steps."""
    sign = math.copysign(1.0, -at_zero)
    near, far = 0.0, sign * max(first, 1e-300)
    factor = 2.0
    for _ in range(MOST_DOUBLINGS):
        if abs(far) >= abs(end):
            far = end
        value = residual(far)
        if math.isnan(value):
            return None
        if value * at_zero <= 0.0:
            return near, far
        if far == end or math.isinf(far):
            return None
        near, far, factor = far, far * factor, min(factor * factor, 1e16)
    return None


def _newton(residual: Root, slope: Root, near: float, far: float) -> float:
    """Find the root between two values of different sign; it is the same whatever the steps were, up to rounding."""
    low, high = (near, far) if residual(near) < 0.0 else (far, near)  # residual(low) < 0 <= residual(high)
    w = 0.5 * (low + high)
    before = abs(high - low)
    for _ in range(MOST_SCALAR_STEPS):
        value = residual(w)
        if value == 0.0:
            return w
        if value < 0.0:
            low = w
        else:
            high = w
        steep = slope(w)
        step = value / steep if steep > 0.0 and math.isfinite(steep) else math.inf
        inside = min(low, high) < w - step < max(low, high)
        if inside and abs(step) < 0.5 * before:
            before, following = abs(step), w - step
        else:  # Newton leaves the bracket or does not shrink it: halve
            before, following = abs(high - low), low + 0.5 * (high - low)
        if abs(following - w) <= EPS * abs(following):
            return following
        w = following
    return w
