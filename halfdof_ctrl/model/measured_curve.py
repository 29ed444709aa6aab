"""A curve through measured points that has no extremum between them: piecewise cubic Hermite, PCHIP.

Slopes at the points after Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984), as `scipy.interpolate` has them.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.base.doors import is_choice, real_numbers, shown
from halfdof_ctrl.base.errors import ParameterError

FEWEST_CURVE_POINTS = 2  #: points that make a curve


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MeasuredCurve:
    """The force through m points, refused or straight outside them."""

    points: FloatArray  #: (m,) rising
    values: FloatArray  #: (m,)
    slopes: FloatArray  #: (m,) at the points
    coefficients: FloatArray  #: (4, m + 1) of the cubes in each interval, the straight lines outside included
    extended: bool

    @classmethod
    def through(cls, x: npt.ArrayLike, f: npt.ArrayLike, extend: Literal["linear"] | None) -> "MeasuredCurve":
        """Make the curve, as `laws.table` describes it."""
        points, values = _checked(x, f, extend)
        smooth = PchipInterpolator(points, values)
        slopes = np.asarray(smooth.derivative()(points), dtype=float)
        before, after = np.zeros((2, 4, 1))
        secants = np.diff(values) / np.diff(points)  # PCHIP may end level although the last points still rise
        before[2:, 0], after[2:, 0] = (slopes[0] or secants[0], values[0]), (slopes[-1] or secants[-1], values[-1])
        return cls(
            points=read_only(points),
            values=read_only(values),
            slopes=read_only(slopes),
            coefficients=read_only(np.hstack([before, smooth.c, after])),
            extended=extend is not None,
        )

    @property
    def end_slopes(self) -> tuple[float, float]:
        """Slopes before the first and behind the last point."""
        return float(self.coefficients[2, 0]), float(self.coefficients[2, -1])

    def __call__(self, x: Any) -> Any:  # noqa: ANN401  # a number or an array
        """Give the force at x; NaN outside the points unless the curve is extended."""
        c, from_point = self._piece(x)
        return ((c[0] * from_point + c[1]) * from_point + c[2]) * from_point + c[3]

    def slope(self, x: Any) -> Any:  # noqa: ANN401
        """Give the slope at x."""
        c, from_point = self._piece(x)
        return (3.0 * c[0] * from_point + 2.0 * c[1]) * from_point + c[2]

    def _piece(self, x: Any) -> tuple[FloatArray, FloatArray]:  # noqa: ANN401
        """Give the coefficients of the cube at x and the way from the point where it begins."""
        plain = isinstance(x, np.ndarray) and x.dtype == np.float64  # as the integration calls it
        at = x if plain else real_numbers(x, "x", "real numbers")
        place = np.searchsorted(self.points, at, side="right")
        if not self.extended:  # the last point belongs to the last interval
            place = np.where(at == self.points[-1], self.points.size - 1, place)
        c = self.coefficients[:, place]
        begin = self.points[np.maximum(place - 1, 0)]
        outside = (place == 0) | (place == self.points.size)
        way = np.where(outside, np.nan, at - begin) if not self.extended else at - begin
        return c, way


def _checked(x: npt.ArrayLike, f: npt.ArrayLike, extend: object) -> tuple[FloatArray, FloatArray]:
    if extend is not None and not is_choice(extend, ("linear",)):
        msg = f'table: extend must be "linear" or left out, not {shown(extend)}.'
        raise ParameterError(msg, parameter="extend", value=extend)
    points = np.array(real_numbers(x, "table: x", "real numbers"))
    values = np.array(real_numbers(f, "table: f", "real numbers"))
    if points.ndim != 1 or points.shape != values.shape or points.size < FEWEST_CURVE_POINTS:
        shapes = f"{points.shape} and {values.shape}"
        fewest = FEWEST_CURVE_POINTS
        msg = f"table: x and f must be two rows of the same {fewest} or more numbers, not of shapes {shapes}."
        raise ParameterError(msg, parameter="table", value=points.shape)
    if not (np.isfinite(points).all() and np.isfinite(values).all() and (np.diff(points) > 0.0).all()):
        msg = (
            "table: x must rise from point to point, and every number must be finite. Sort the points and drop doubles."
        )
        raise ParameterError(msg, parameter="table", value=None)
    return points, values
