"""A measured curve of dynamic stiffness: checked, sorted, in units of its own, with weights.

With e^{+j w t} a passive part has ``K''(w) = Im K >= 0``. What a table of measured points can violate is refused here,
before anything is fitted. The scatter of a curve is estimated from third differences of neighbours: for independent
errors of size sigma they have ``sigma^2 (1 + 9 + 9 + 1)`` (J. von Neumann and others, 1941, for first differences).
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.doors import is_choice, is_real_number, real_numbers, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import listed

Weight: TypeAlias = Literal["relative", "absolute", "parts"]

WEIGHTS: tuple[Weight, ...] = get_args(Weight)
THIRD_DIFFERENCES = 20.0  #: sum of the squares of 1, 3, 3, 1
NORMAL_MEDIAN = 0.6745  #: of the size of a normal variable, in standard deviations
COMPLEX_MEDIAN = 0.8326  #: of the size of a complex one, the root of log 2
SIGMAS = 4.0  #: a negative loss beyond so many times the scatter is no scatter
LOSS_ROUNDING = 1e-12  #: of |K|: a negative loss below is none
FEWEST_MEASURED = 2  #: points of a curve


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MeasuredCurve:
    """p points of K, frequencies rising, in units of a middle frequency and stiffness."""

    omega: FloatArray  #: (p,) over `omega_unit` [-]
    values: ComplexArray  #: (p,) over `stiffness_unit`, less the static stiffness where that is given [-]
    weights: FloatArray  #: (2, p) of real and imaginary parts
    static: float | None  #: static stiffness over its unit; None where it is to be found
    omega_unit: float  #: [rad/s]
    stiffness_unit: float  #: [N/m] or [Pa]

    def weighted(self, columns: ComplexArray) -> FloatArray:
        """Give weighted real parts above weighted imaginary parts, (2p,) or (2p, k)."""
        real, imag = self.weights if columns.ndim == 1 else self.weights[:, :, None]
        return np.concatenate([real * columns.real, imag * columns.imag])


def measured_curve(
    frequency: npt.ArrayLike, stiffness: npt.ArrayLike, weight: Weight, static_stiffness: float | None
) -> MeasuredCurve:
    """Check a table of points and bring it into units of its own.

    Raises
    ------
    ParameterError
        Lists of different lengths or fewer than two points; NaN, Inf or zero; a frequency that is not positive; loss
        that is negative beyond its scatter; a static stiffness above the curve; an unknown weight.
    """
    if not is_choice(weight, WEIGHTS):
        msg = f"weight must be one of {listed(WEIGHTS)}, not {shown(weight)}."
        raise ParameterError(msg, parameter="weight", value=weight)
    f, K = _checked_points(frequency, stiffness)
    order = np.argsort(f, kind="stable")
    f, K = f[order], K[order]
    _require_loss(f, K)
    omega = 2.0 * np.pi * f
    omega_unit, stiffness_unit = float(np.sqrt(omega[0] * omega[-1])), float(np.median(np.abs(K)))
    static = _checked_static(static_stiffness, f, K)
    static = None if static is None else static / stiffness_unit
    values = K / stiffness_unit
    return MeasuredCurve(
        omega=omega / omega_unit,
        values=values - (static or 0.0),
        weights=_weights(values, weight),
        static=static,
        omega_unit=omega_unit,
        stiffness_unit=stiffness_unit,
    )


def scatter(values: npt.NDArray[np.inexact]) -> float:
    """Estimate the size of independent errors of neighbours on a smooth curve; 0 for fewer than four.

    >>> round(scatter(np.array([0.0, 1.0, 4.0, 9.0, 16.0])), 12)
    0.0
    """
    third = np.diff(values, 3)
    return float(np.sqrt(np.mean(np.abs(third) ** 2) / THIRD_DIFFERENCES)) if third.size else 0.0


def typical_scatter(values: npt.NDArray[np.inexact]) -> float:
    """Estimate the same from the median, which a few points that are far off do not move."""
    third = np.abs(np.diff(values, 3))
    median = COMPLEX_MEDIAN if np.iscomplexobj(values) else NORMAL_MEDIAN
    return float(np.median(third) / median / np.sqrt(THIRD_DIFFERENCES)) if third.size else 0.0


def _checked_points(frequency: npt.ArrayLike, stiffness: npt.ArrayLike) -> tuple[FloatArray, ComplexArray]:
    try:
        f = np.array(real_numbers(frequency, "frequency", "real numbers"))
        K = np.array(stiffness, dtype=complex)
    except Exception as cause:
        msg = f"frequency must be a list of real numbers [Hz] and stiffness one of complex numbers: {cause}."
        raise ParameterError(msg, parameter="stiffness", value=None) from cause
    if f.ndim != 1 or f.shape != K.shape or f.size < FEWEST_MEASURED:
        msg = (
            f"frequency has the shape {f.shape} and stiffness {K.shape}, but both must be lists of the same length, "
            "two points at least."
        )
        raise ParameterError(msg, parameter="frequency", value=f.shape)
    bad = f[~(np.isfinite(f) & (f > 0.0))]
    if bad.size:
        msg = (
            f"frequency holds {listed([f'{value:g}' for value in bad.tolist()])}, but every one must be positive [Hz]. "
            "A stiffness at rest goes to static_stiffness."
        )
        raise ParameterError(msg, parameter="frequency", value=tuple(bad.tolist()))
    unsound = f[~np.isfinite(K) | (K == 0.0)]
    if unsound.size:
        msg = f"stiffness is NaN, Inf or zero at {_hertz(unsound)}. Leave these points out."
        raise ParameterError(msg, parameter="stiffness", value=tuple(unsound.tolist()))
    return f, K


def _require_loss(f: FloatArray, K: ComplexArray) -> None:
    """Refuse loss that is negative by more than its scatter."""
    sine = K.imag / np.abs(K)
    bound = max(SIGMAS * min(scatter(sine), typical_scatter(sine)), LOSS_ROUNDING)
    negative = sine < -bound
    if not negative.any() and np.count_nonzero(sine < -LOSS_ROUNDING) <= f.size / 2:
        return
    if np.count_nonzero(sine < -LOSS_ROUNDING) > f.size / 2:
        msg = (
            f"The imaginary part of stiffness is negative at {np.count_nonzero(sine < 0.0)} of {f.size} points: that "
            "is the sign convention e^{-jwt}, in which this package does not compute. Pass the complex conjugate."
        )
        raise ParameterError(msg, parameter="stiffness", value=tuple(f[sine < 0.0].tolist()))
    msg = (
        f"The loss is negative at {_hertz(f[negative])}, beyond its scatter of {bound / SIGMAS:.1e} of |K|: a part "
        "that gives off energy is not passive, and no springs and dampers follow it. Look at the rig's phase, or "
        "leave these points out."
    )
    raise ParameterError(msg, parameter="stiffness", value=tuple(f[negative].tolist()))


def _checked_static(static: float | None, f: FloatArray, K: ComplexArray) -> float | None:
    if static is None:
        return None
    number = float(static) if is_real_number(static) else np.nan
    largest = float(np.abs(K).max())
    if not (np.isfinite(number) and 0.0 <= number <= largest):
        msg = (
            f"static_stiffness = {shown(static)}, but it must be a number from 0 to {largest:.6g}, the largest "
            f"stiffness that was measured ({f[0]:.4g} to {f[-1]:.4g} Hz): a passive part is softest at rest."
        )
        raise ParameterError(msg, parameter="static_stiffness", value=static)
    return number


def _weights(values: ComplexArray, weight: Weight) -> FloatArray:
    if weight == "absolute":
        return np.full((2, values.size), 1.0 / float(np.sqrt(np.mean(np.abs(values) ** 2))))
    if weight == "relative":
        return np.tile(1.0 / np.abs(values), (2, 1))
    floor = SIGMAS * scatter(values / np.abs(values)) * np.abs(values)
    tiny = LOSS_ROUNDING * np.abs(values)
    parts = [np.maximum(np.maximum(np.abs(part), floor), tiny) for part in (values.real, values.imag)]
    return 1.0 / np.array(parts)


def _hertz(f: FloatArray) -> str:
    return f"{listed([f'{value:.4g}' for value in f.tolist()])} Hz"
