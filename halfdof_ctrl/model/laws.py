"""The laws that are built in: oil through holes, stops with a gap, rubber that stiffens, friction, a measured curve.

Each is a value. It prints as it is typed, and equals another one that is typed alike:

>>> quadratic(1e4, 30)
quadratic(1e4, 30)
>>> quadratic(1e4, 30) == quadratic(10000, c1=30.0)
True

x stands for an elongation [m] in a `Spring` and for its rate [m/s] in a `Damper`. Sources: the square law is that of
turbulent flow through an orifice, with its laminar part c1 (Merritt, Hydraulic Control Systems, 1967, section 3.4);
`coulomb` is friction with its jump rounded off over v0.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.doors import is_real_number, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.model.law import EVERYWHERE, Law
from halfdof_ctrl.model.law_functions import (
    bilinear_force,
    bilinear_slope,
    coulomb_force,
    coulomb_inverse,
    coulomb_slope,
    cubic_force,
    cubic_inverse,
    cubic_slope,
    gap_force,
    gap_slope,
    power_force,
    power_inverse,
    power_slope,
    quadratic_force,
    quadratic_inverse,
    quadratic_slope,
)
from halfdof_ctrl.model.measured_curve import MeasuredCurve

__all__ = ["bilinear", "coulomb", "cubic", "gap", "power", "quadratic", "table"]

LARGE_EXPONENT = 1e4  #: numbers from here on that end in zeros print as 1e4


def quadratic(c2: float, c1: float = 0.0) -> Law:
    """Return ``c1 x + c2 |x| x``: turbulent flow, with a laminar part c1.

    Parameters
    ----------
    c2 : float
        Square coefficient [N s²/m² in a damper].
    c1 : float, optional
        Linear coefficient [N s/m].

    Raises
    ------
    ParameterError
        A coefficient that is no finite number.

    Examples
    --------
    A force of 4 N answers 2 m/s where c2 = 1, and the slope there is ``2 c2 |x|``:

    >>> oil = quadratic(1)
    >>> float(oil.inverse(4.0)), float(oil.slope(2.0))
    (2.0, 4.0)
    """
    a, b = _numbers(quadratic, c2=c2, c1=c1)
    rises = a >= 0.0 and b >= 0.0
    onto = rises and (a > 0.0 or b > 0.0)
    return Law(
        partial(quadratic_force, a, b),
        partial(quadratic_slope, a, b),
        partial(quadratic_inverse, a, b) if onto else None,
        bounds=_grown(a or b),
        monotone=rises,
        written=_written(quadratic, c2, c1),
        flat=a == 0.0 and b == 0.0,
        beside=partial(_beside, quadratic, c2, b),
    )


def power(c: float, exponent: float) -> Law:
    """Return ``c |x|^exponent sign(x)``.

    Parameters
    ----------
    c : float
        Coefficient.
    exponent : float
        Above zero. Below 1 the slope at x = 0 is infinite, above 1 it is zero.

    Raises
    ------
    ParameterError
        A coefficient that is no finite number, or an exponent that is not positive.

    Examples
    --------
    >>> float(power(3, 1.5).force(-4.0))
    -24.0
    """
    a, p = _numbers(power, c=c, exponent=exponent)
    if p <= 0.0:
        msg = f"power: exponent = {exponent}, but it must be positive, or the force at rest would jump or be infinite."
        raise ParameterError(msg, parameter="exponent", value=exponent)
    return Law(
        partial(power_force, a, p),
        partial(power_slope, a, p),
        partial(power_inverse, a, p) if a > 0.0 else None,
        bounds=_grown(a),
        monotone=a >= 0.0,
        written=_written(power, c, exponent),
        flat=a == 0.0,
    )


def cubic(k3: float, k1: float = 0.0) -> Law:
    """Return ``k1 x + k3 x³``: rubber that stiffens.

    Parameters
    ----------
    k3 : float
        Cubic coefficient [N/m³ in a spring].
    k1 : float, optional
        Linear coefficient [N/m].

    Raises
    ------
    ParameterError
        A coefficient that is no finite number.

    Examples
    --------
    >>> float(cubic(2, 1).force(3.0))
    57.0
    """
    a, b = _numbers(cubic, k3=k3, k1=k1)
    rises = a >= 0.0 and b >= 0.0
    onto = rises and (a > 0.0 or b > 0.0)
    return Law(
        partial(cubic_force, a, b),
        partial(cubic_slope, a, b),
        partial(cubic_inverse, a, b) if onto else None,
        bounds=_grown(a or b),
        monotone=rises,
        written=_written(cubic, k3, k1),
        flat=a == 0.0 and b == 0.0,
        beside=partial(_beside, cubic, k3, b),
    )


def bilinear(k_minus: float, k_plus: float) -> Law:
    """Return ``k_minus x`` for x < 0 and ``k_plus x`` from there on.

    Parameters
    ----------
    k_minus, k_plus : float
        Slopes to the left and to the right of zero; the slope at zero itself is k_plus.

    Raises
    ------
    ParameterError
        A coefficient that is no finite number.

    Examples
    --------
    >>> bilinear(1, 3).force(np.array([-2.0, 2.0])).tolist()
    [-2.0, 6.0]
    """
    a, b = _numbers(bilinear, k_minus=k_minus, k_plus=k_plus)
    left, right = (math.copysign(math.inf, -a) if a else 0.0), (math.copysign(math.inf, b) if b else 0.0)
    return Law(
        partial(bilinear_force, a, b),
        partial(bilinear_slope, a, b),
        partial(bilinear_force, 1.0 / a, 1.0 / b) if a > 0.0 and b > 0.0 else None,
        bounds=(left, right) if left < right else None,
        monotone=a >= 0.0 and b >= 0.0,
        written=_written(bilinear, k_minus, k_plus),
        flat=a == 0.0 or b == 0.0,
        beside=partial(_bilinear_beside, a, b),
    )


def gap(k: float, upper: float, lower: float | None = None) -> Law:
    """Return a stop with a gap: ``k (x - upper)`` above `upper`, ``k (x + lower)`` below ``-lower``, between them zero.

    Parameters
    ----------
    k : float
        Stiffness of the stop [N/m in a spring].
    upper : float
        Way to the stop on the positive side [m].
    lower : float, optional
        Way to the one on the negative side; by default as `upper`. inf for a stop on the positive side alone.

    Raises
    ------
    ParameterError
        A number that is NaN, a negative k, or stops that overlap: ``upper + lower < 0``.

    Examples
    --------
    >>> gap(100, 0.5).force(np.array([-1.0, 0.2, 1.0])).tolist()
    [-50.0, 0.0, 50.0]
    """
    (a,) = _numbers(gap, k=k)
    ways = (upper, upper if lower is None else lower)
    above, below = (float(way) if is_real_number(way) else math.nan for way in ways)
    overlap = not above + below >= 0.0  # NaN too
    if a < 0.0 or overlap or math.isinf(above):
        msg = (
            f"gap: k = {k}, upper = {shown(upper)}, lower = {shown(lower)}, but a stop needs a stiffness that is not "
            "negative, a finite way to it, and one to the other stop that does not overlap. For a stop on the negative "
            "side alone, turn the element round."
        )
        raise ParameterError(msg, parameter="gap", value=(k, upper, lower))
    left, right = (0.0 if math.isinf(below) or not a else -math.inf), (math.inf if a else 0.0)
    return Law(
        partial(gap_force, a, above, below),
        partial(gap_slope, a, above, below),
        None,
        bounds=(left, right) if left < right else None,
        monotone=True,
        written=_written(gap, k, upper, lower),
        flat=above + below > 0.0 or not a,
    )


def coulomb(F: float, v0: float, c: float = 0.0) -> Law:
    """Return ``F x / √(x² + v0²) + c x``: friction whose jump is rounded off over v0.

    Parameters
    ----------
    F : float
        Force of friction [N].
    v0 : float
        Rate [m/s] at which 71 % of it is reached; above zero.
    c : float, optional
        Viscous part [N s/m]. Without it no rate answers a force above F.

    Raises
    ------
    ParameterError
        A number that is not finite, or v0 that is not positive.

    Examples
    --------
    >>> round(float(coulomb(5, 0.3).force(0.4)), 12)
    4.0
    """
    a, width, b = _numbers(coulomb, F=F, v0=v0, c=c)
    if width <= 0.0:
        msg = f"coulomb: v0 = {v0}, but the rate over which friction turns round must be positive. Take a small one."
        raise ParameterError(msg, parameter="v0", value=v0)
    return Law(
        partial(coulomb_force, a, width, b),
        partial(coulomb_slope, a, width, b),
        partial(coulomb_inverse, a, width) if b == 0.0 and a > 0.0 else None,
        bounds=_grown(b) if b else (-a, a) if a > 0.0 else None,
        monotone=a >= 0.0 and b >= 0.0,
        written=_written(coulomb, F, v0, c),
        flat=a == 0.0 and b == 0.0,
        beside=partial(_coulomb_beside, a, width, b),
    )


def table(x: npt.ArrayLike, f: npt.ArrayLike, extend: Literal["linear"] | None = None) -> Law:
    """Return the monotone curve through measured points (piecewise cubic Hermite, PCHIP).

    Parameters
    ----------
    x, f : array_like
        At least two points; x rises.
    extend : {"linear"}, optional
        Go on straight outside the points, with the slope at the last one, or that of the last interval where the
        curve ends level. By default the law is refused there, since
        nothing was measured.

    Raises
    ------
    ParameterError
        Arrays of different lengths, fewer than two points, NaN or Inf, or x that does not rise.

    Examples
    --------
    >>> float(table([0, 1, 2], [0, 1, 4]).force(1.0))
    1.0
    """
    curve = MeasuredCurve.through(x, f, extend)
    first, last = curve.end_slopes
    inside = float(curve.values[0]), float(curve.values[-1])
    bounds = inside
    if extend is not None:
        bounds = (
            inside[0] if first == 0.0 else -math.copysign(math.inf, first),
            inside[1] if last == 0.0 else math.copysign(math.inf, last),
        )
    given = [_listed(curve.points), _listed(curve.values)] + ([] if extend is None else ['extend="linear"'])
    return Law(
        curve,
        curve.slope,
        None,
        bounds=bounds if bounds[0] < bounds[1] else None,
        monotone=bool((np.diff(curve.values) >= 0.0).all()),
        domain=(float(curve.points[0]), float(curve.points[-1])) if extend is None else EVERYWHERE,
        written=f"table({', '.join(given)})",
        flat=bool((np.diff(curve.values) == 0.0).any()) or (extend is not None and 0.0 in (first, last)),
    )


BUILT_IN_LAWS: dict[str, Callable[..., Law]] = {
    law.__name__: law for law in (quadratic, power, cubic, bilinear, gap, coulomb, table)
}  #: what the name in a file or on a command line stands for


def as_typed(value: float) -> str:
    """Write a number as people type it, so that `float` gives the very same number back.

    >>> [as_typed(value) for value in (10000.0, 30, 0.5, 1e-05, 12345.0)]
    ['1e4', '30', '0.5', '1e-5', '12345']
    """
    number = float(value)
    if number.is_integer() and abs(number) < 1e16:  # noqa: PLR2004  # integers up to there are exact
        plain = str(int(number))
        short = f"{number:.15e}"
        mantissa, _, exponent = short.partition("e")
        short = f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"
        return short if abs(number) >= LARGE_EXPONENT and len(short) < len(plain) and float(short) == number else plain
    mantissa, _, exponent = repr(number).partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def _listed(values: Sequence[float] | np.ndarray) -> str:
    return f"[{', '.join(as_typed(float(value)) for value in values)}]"


def _written(law: Callable[..., Law], *given: float | None) -> str:
    """Write a call with the arguments that are not the defaults."""
    defaults = law.__defaults__ or ()
    needed = len(given) - len(defaults)
    last = max([needed, *[1 + i for i in range(needed, len(given)) if given[i] != defaults[i - needed]]])
    return f"{law.__name__}({', '.join(as_typed(value) for value in given[:last] if value is not None)})"


def _numbers(law: Callable[..., Law], **given: Any) -> tuple[float, ...]:  # noqa: ANN401  # whatever the user gave
    numbers: list[float] = []
    for name, value in given.items():
        number = float(value) if is_real_number(value) else math.nan
        if not math.isfinite(number):
            msg = f"{law.__name__}: {name} = {shown(value)}, but it must be a finite real number."
            raise ParameterError(msg, parameter=name, value=value)
        numbers.append(number)
    return tuple(numbers)


def _grown(coefficient: float) -> tuple[float, float] | None:
    """Give the bounds of an odd law that grows with this coefficient; none where it vanishes or falls."""
    return EVERYWHERE if coefficient > 0.0 else None


def _beside(law: Callable[..., Law], curved: float, straight: float, c: float) -> Law:
    return law(curved, straight + c)


def _bilinear_beside(k_minus: float, k_plus: float, c: float) -> Law:
    return bilinear(k_minus + c, k_plus + c)


def _coulomb_beside(F: float, v0: float, viscous: float, c: float) -> Law:
    return coulomb(F, v0, viscous + c)
