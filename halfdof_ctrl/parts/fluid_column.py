"""What a curve holds that no springs and dampers in series follow: a column of fluid that moves in and out.

A spring kv to a mass m with a damper c has

    kv (-u^2 + 2 j zeta u) / (1 - u^2 + 2 j zeta u),    u = f / f0,
    f0 = sqrt(kv / m) / (2 pi),  zeta = c / (2 sqrt(kv m))

which is what the inertia track of a hydraulic mount adds to its rubber. Its real part first falls and then rises above:
no Maxwell series does that, since in a series storage only rises.
"""

from dataclasses import dataclass

import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.links import Link, linked
from halfdof_ctrl.parts.measured_curve import MeasuredCurve
from halfdof_ctrl.parts.prony_series import Series, best_sizes

CHECKED_FREQUENCIES = 30  #: that are scanned, over the band
DAMPINGS = np.geomspace(0.02, 1.0, 7)  #: ratios that are scanned
PER_DECADE = 4  #: rates of the rubber beside the fluid: few, so that they do not do the fluid's work


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FluidColumn:
    """A mass of fluid behind a spring, with the Maxwell series beside it."""

    frequency: float  #: f0, with which it resonates behind its spring [Hz]
    damping_ratio: float  #: zeta
    stiffness: float  #: kv [N/m]
    k0: float  #: stiffness at rest of the series beside it [N/m]
    c0: float  #: its parallel damper [N s/m]
    k: FloatArray  #: (N,) its branches [N/m]
    c: FloatArray  #: (N,) their dampers [N s/m]
    rms: float  #: of the weighted residual with it

    @property
    def mass(self) -> float:
        """Mass of the fluid, as it moves with the node between spring and damper [kg]."""
        return self.stiffness / (2.0 * np.pi * self.frequency) ** 2

    @property
    def damping(self) -> float:
        """Damper of the fluid [N s/m]."""
        return 2.0 * self.damping_ratio * self.stiffness / (2.0 * np.pi * self.frequency)

    @property
    def part(self) -> SecondOrderModel:
        """The mount that follows the curve: ports ``top``, ``bottom``, branches ``1, 2, ...``, the fluid last."""
        count = self.k.size
        links = [Link("K", "top", "bottom", {"": self.k0}), Link("C", "top", "bottom", {"": self.c0})]
        for i in range(count):
            links.append(Link("K", "top", str(i + 1), {"": float(self.k[i])}))
            links.append(Link("C", str(i + 1), "bottom", {"": float(self.c[i])}))
        fluid = str(count + 1)
        links.append(Link("K", "top", fluid, {"": self.stiffness}))
        links += [Link("C", fluid, "bottom", {"": self.damping}), Link("M", fluid, "bottom", {"": self.mass})]
        nodes = ("top", "bottom", *[str(i + 1) for i in range(count + 1)])
        return linked(nodes, links, ("",), "mount with a fluid column")


def fluid_column(curve: MeasuredCurve) -> FluidColumn | None:
    """Find the column of fluid that explains most of a curve; None where none helps."""
    w = np.geomspace(curve.omega[0] / 3.0, 3.0 * curve.omega[-1], _count(curve))
    grid = [(f, zeta) for f in np.geomspace(curve.omega[0], curve.omega[-1], CHECKED_FREQUENCIES) for zeta in DAMPINGS]
    costs = [_fitted(curve, w, f, zeta)[0].cost for f, zeta in grid]
    first = np.log(grid[int(np.argmin(costs))])

    def cost(place: FloatArray) -> float:
        return _fitted(curve, w, float(np.exp(place[0])), float(np.exp(place[1])))[0].cost

    found = scipy.optimize.minimize(
        cost,
        np.asarray(first),
        method="Nelder-Mead",
        options={"xatol": 1e-5, "fatol": 1e-12, "maxiter": 300},
    )
    f0, zeta = (float(value) for value in np.exp(found.x))
    series, kv = _fitted(curve, w, f0, zeta)
    if kv <= 0.0:
        return None
    unit, rate = curve.stiffness_unit, curve.omega_unit
    return FluidColumn(
        frequency=f0 * rate / (2.0 * np.pi),
        damping_ratio=zeta,
        stiffness=kv * unit,
        k0=(series.k0 + (curve.static or 0.0)) * unit,
        c0=series.c0 * unit / rate,
        k=series.k * unit,
        c=series.k / series.w * unit / rate,
        rms=float(np.sqrt(series.cost / curve.omega.size)),
    )


def column_of(omega: FloatArray, f0: float, zeta: float) -> ComplexArray:
    """Give the stiffness of a column of fluid over kv, with frequencies in any one unit."""
    u = omega / f0
    moved = -(u**2) + 2j * zeta * u
    return np.asarray(moved / (1.0 + moved))


def _fitted(curve: MeasuredCurve, w: FloatArray, f0: float, zeta: float) -> tuple[Series, float]:
    series, sizes = best_sizes(curve, w, [column_of(curve.omega, f0, zeta)])
    return series, float(sizes[0])


def _count(curve: MeasuredCurve) -> int:
    return int(PER_DECADE * np.log10(9.0 * curve.omega[-1] / curve.omega[0])) + 2
