"""Forces, slopes and inverses of the built-in laws, for numbers and arrays.

A plain float takes the short way without numpy, since a simulation asks for one value at a time.
"""

import math
from typing import Any

import numpy as np


def quadratic_force(c2: float, c1: float, x: Any) -> Any:  # noqa: ANN401
    """Return the force at x of `laws.quadratic`."""
    return (c1 + c2 * abs(x)) * x


def quadratic_slope(c2: float, c1: float, x: Any) -> Any:  # noqa: ANN401
    """Return the slope at x of `laws.quadratic`."""
    return c1 + 2.0 * c2 * abs(x)


def quadratic_inverse(c2: float, c1: float, f: Any) -> Any:  # noqa: ANN401
    """Solve by the root that does not cancel: 2 f / (c1 + √(c1² + 4 c2 |f|))."""
    if isinstance(f, float):
        below = c1 + math.sqrt(c1 * c1 + 4.0 * c2 * abs(f))
        return 2.0 * f / below if below > 0.0 else 0.0
    below = c1 + np.sqrt(c1 * c1 + 4.0 * c2 * np.abs(f))
    return np.divide(2.0 * np.asarray(f), below, out=np.zeros(np.shape(f)), where=below > 0.0)


def power_force(c: float, p: float, x: Any) -> Any:  # noqa: ANN401
    """Return the force at x of `laws.power`."""
    if isinstance(x, float):
        return c * math.copysign(abs(x) ** p, x)
    return c * np.copysign(np.abs(x) ** p, x)


def power_slope(c: float, p: float, x: Any) -> Any:  # noqa: ANN401
    """Return the slope at x of `laws.power`."""
    with np.errstate(divide="ignore"):  # of a root at rest, whose slope is infinite
        steep = np.power(np.abs(np.asarray(x, dtype=float)), p - 1.0)
    return c * p * steep if c else 0.0 * np.asarray(x, dtype=float)


def power_inverse(c: float, p: float, f: Any) -> Any:  # noqa: ANN401
    """Return the x that answers f of `laws.power`."""
    if isinstance(f, float):
        return math.copysign((abs(f) / c) ** (1.0 / p), f)
    return np.copysign((np.abs(f) / c) ** (1.0 / p), f)


def cubic_force(k3: float, k1: float, x: Any) -> Any:  # noqa: ANN401
    """Return the force at x of `laws.cubic`."""
    return (k1 + k3 * x * x) * x


def cubic_slope(k3: float, k1: float, x: Any) -> Any:  # noqa: ANN401
    """Return the slope at x of `laws.cubic`."""
    return k1 + 3.0 * k3 * x * x


def cubic_inverse(k3: float, k1: float, f: Any) -> Any:  # noqa: ANN401
    """Solve by Newton from above, where the cubic is convex: no root formula keeps all digits at both ends."""
    force = np.abs(np.asarray(f, dtype=float))
    with np.errstate(divide="ignore", over="ignore"):
        x = np.minimum(force / k1 if k1 else np.inf, np.cbrt(force / k3) if k3 else np.inf)
    for _ in range(60):  # at most about 6 are needed from an upper bound that is off by a factor below 1.5
        slope = k1 + 3.0 * k3 * x * x
        step = np.divide((k1 + k3 * x * x) * x - force, slope, out=np.zeros_like(x), where=slope > 0.0)
        x = x - step
        if (np.abs(step) <= np.finfo(float).eps * np.abs(x)).all():
            break
    return np.copysign(x, f)


def bilinear_force(k_minus: float, k_plus: float, x: Any) -> Any:  # noqa: ANN401
    """Return the force at x of `laws.bilinear`."""
    if isinstance(x, float):
        return (k_minus if x < 0.0 else k_plus) * x
    return np.where(np.asarray(x) < 0.0, k_minus, k_plus) * x


def bilinear_slope(k_minus: float, k_plus: float, x: Any) -> Any:  # noqa: ANN401
    """Return the slope at x of `laws.bilinear`."""
    return np.where(np.asarray(x) < 0.0, k_minus, k_plus)


def gap_force(k: float, upper: float, lower: float, x: Any) -> Any:  # noqa: ANN401
    """Return the force at x of `laws.gap`."""
    if isinstance(x, float):
        return k * (x - upper) if x > upper else k * (x + lower) if x < -lower else 0.0
    return k * np.maximum(x - upper, 0.0) + k * np.minimum(x + lower, 0.0)


def gap_slope(k: float, upper: float, lower: float, x: Any) -> Any:  # noqa: ANN401
    """Return the slope at x of `laws.gap`."""
    x = np.asarray(x)
    return k * ((x > upper) | (x < -lower))


def coulomb_force(F: float, v0: float, c: float, x: Any) -> Any:  # noqa: ANN401
    """Return the force at x of `laws.coulomb`."""
    if isinstance(x, float):
        return F * (x / math.hypot(x, v0)) + c * x
    return F * (x / np.hypot(x, v0)) + c * x


def coulomb_slope(F: float, v0: float, c: float, x: Any) -> Any:  # noqa: ANN401
    """Return the slope at x of `laws.coulomb`."""
    size = math.hypot(x, v0) if isinstance(x, float) else np.hypot(x, v0)
    return F * (v0 / size) ** 2 / size + c


def coulomb_inverse(F: float, v0: float, f: Any) -> Any:  # noqa: ANN401
    """Return the x that answers f of `laws.coulomb`."""
    return v0 * f / np.sqrt((F - f) * (F + f))
