"""A measured dynamic stiffness as springs and dampers: the generalized Maxwell model that follows a curve best.

    K(s) = k0 + c0 s + sum of k_i c_i s / (k_i + c_i s),    k0, c0, k_i, c_i >= 0

Every size is positive, so the model is passive whatever was measured. The number of branches comes from Akaike's
criterion, the least residual that any such series can have from a dense grid of rates (`prony_search`). A curve that no
series follows is told from scatter by its residual, which is larger than the scatter of neighbours and does not change
sign from one to the next. Explanation: docs/explanation/measured-rubber.md.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, read_only
from halfdof_ctrl.base.doors import is_whole_number, real_numbers, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.fluid_column import FluidColumn, fluid_column
from halfdof_ctrl.parts.loss_branches import MOST_BRANCHES
from halfdof_ctrl.parts.measured_curve import MeasuredCurve, Weight, measured_curve, scatter, typical_scatter
from halfdof_ctrl.parts.prony_search import best_series, chosen_order, criterion, lag_one, rms
from halfdof_ctrl.parts.prony_series import Series
from halfdof_ctrl.parts.rubber import generalized_maxwell

ABOVE_SCATTER = 1.4  #: an rms larger than this many times the scatter is no scatter ...
IN_ROWS = 0.4  #: ... if neighbours of the residual are correlated by more than this ...
VISIBLE_MISFIT = 0.002  #: ... and it is larger than this part of the curve
UNDETERMINED = 0.1  #: standard error of k0, in parts of it, from which on it is said


@dataclass(frozen=True, slots=True, kw_only=True)
class PronyOrder:
    """How well a number of branches does."""

    branches: int
    rms: float  #: of the weighted complex residual
    aicc: float  #: Akaike's criterion with the correction for few points; less is better


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class PronyFit:
    """A generalized Maxwell model on p measured points. Made by `fit_prony`.

    In SI units N/m and N s/m; where moduli were given, Pa and Pa s.
    """

    frequency: FloatArray  #: (p,) measured points, rising [Hz]
    stiffness: ComplexArray  #: (p,) what was measured there [N/m]
    weight: Weight  #: how the residual is weighted
    k0: float  #: stiffness at rest [N/m]
    c0: float  #: damper beside all [N s/m], often 0
    k: FloatArray  #: (N,) stiffness of the branches, slowest first [N/m]
    c: FloatArray  #: (N,) their dampers [N s/m]
    standard_errors: dict[str, FloatArray]  #: of ``k0``, ``c0``, ``k``, ``c``; NaN where the curve does not say
    residual: ComplexArray  #: (p,) measured less fitted [N/m]
    rms: float  #: of the weighted complex residual; with weight `relative`, of the relative error
    floor: float  #: rms of the best series of any length, to the grid's fineness
    scatter: float  #: of the measured points, from third differences of the weighted residual
    orders: tuple[PronyOrder, ...]  #: what was tried
    follows: bool  #: whether a Maxwell series follows the curve at all
    fluid: FluidColumn | None  #: if none does: the column of fluid that does, where there is one
    verdict: str  #: the same in words

    def __call__(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Give the dynamic stiffness of the model [N/m] at frequencies [Hz]."""
        s = 2j * np.pi * real_numbers(frequency, "frequency", "real numbers [Hz]")
        return np.asarray(self.k0 + self.c0 * s + np.sum(self.k * s[..., None] / (s[..., None] + self.k / self.c), -1))

    @property
    def part(self) -> SecondOrderModel:
        """The mount with the ports ``top`` and ``bottom`` and a half DOF a branch, ``1``, ``2``, ..."""
        return generalized_maxwell(self.k0, list(zip(self.k.tolist(), self.c.tolist(), strict=True)), c=self.c0)

    @property
    def model(self) -> SecondOrderModel:
        """The mount on the ground: ``x`` under the force ``F_x``, and a half DOF a branch, ``x1``, ``x2``, ..."""
        part = self.part
        free = [0, *range(2, len(part.dofs))]
        names = ["x", *[f"x{i}" for i in range(1, len(free))]]
        K, C = part.K[np.ix_(free, free)], part.C[np.ix_(free, free)]
        return mechss(None, C, K, dofs=names, name="prony").select("F_x", "x")

    def __repr__(self) -> str:
        """Give the sizes with their standard errors, and the verdict."""
        lines = [f"PronyFit: {counted(self.k.size)} on {self.frequency.size} points, rms {self.rms:.2e}"]
        lines.append(f"  k0 = {self.k0:.6g} ± {self.standard_errors['k0'].item():.1e} N/m")
        if self.c0:
            lines.append(f"  c0 = {self.c0:.6g} ± {self.standard_errors['c0'].item():.1e} N s/m")
        for i, (k, c) in enumerate(zip(self.k.tolist(), self.c.tolist(), strict=True)):
            errors = (float(self.standard_errors[name][i]) for name in ("k", "c"))
            lines.append("  k{0} = {1:.6g} ± {3:.1e} N/m, c{0} = {2:.6g} ± {4:.1e} N s/m".format(i + 1, k, c, *errors))
        return "\n".join([*lines, f"  {self.verdict}"])


def fit_prony(
    frequency: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    branches: int | None = None,
    *,
    weight: Weight = "relative",
    static_stiffness: float | None = None,
) -> PronyFit:
    """Find springs and dampers that follow a measured dynamic stiffness.

    Parameters
    ----------
    frequency : (p,) array_like
        [Hz], positive, in any order.
    stiffness : (p,) array_like of complex
        ``K' + j K''`` [N/m], or a complex modulus [Pa], in the convention e^{+jwt}: K'' is positive.
    branches : int, optional
        Number of springs and dampers in series; by default the number that Akaike's criterion chooses, up to 12.
    weight : {"relative", "absolute", "parts"}
        What is minimised: errors over the modulus (default), errors as they are, or errors of K' over
        K' and of K'' over K''.
    static_stiffness : float, optional
        Stiffness at rest [N/m], from a static test; by default it is found from the curve.

    Returns
    -------
    PronyFit
        Print it. `part` is the mount between two ports, for `halfdof_ctrl.assemble`; `model` the mount on the ground.

    Raises
    ------
    ParameterError
        Fewer points than unknowns; frequencies that are not positive; loss that is negative beyond its scatter, or at
        most points (the convention e^{-jwt}); lists of different lengths; values out of range.

    Notes
    -----
    Sizes come with standard errors from the curvature at the minimum. Under scatter many series follow a curve about
    equally well, so judge the curve, not its parameters. In time the force after a step relaxes as a sum of
    exponentials, Prony's series.

    Examples
    --------
    >>> f = np.geomspace(1, 100, 9)
    >>> s = 2j * np.pi * f
    >>> fit = fit_prony(f, 1000 + 500 * s / (s + 60))
    >>> round(fit.k0, 6), fit.k.round(6).tolist(), (fit.k / fit.c).round(6).tolist()
    (1000.0, [500.0], [60.0])
    """
    curve = measured_curve(frequency, stiffness, weight, static_stiffness)
    most = _most_branches(curve, branches)
    found = best_series(curve, most)
    orders = tuple([_order(curve, series) for _, series in sorted(found.best.items())])
    if branches is None:
        wanted = chosen_order(curve, found.best, rms(curve, found.grid))
    else:
        wanted = max(order for order in found.best if order <= branches)
    series = found.best[wanted]
    follows = _follows(curve, series, found.grid)
    fluid = None if follows else fluid_column(curve)
    return _fit(curve, series, weight, floor=rms(curve, found.grid), orders=orders, fluid=fluid, asked=branches)


def counted(count: int) -> str:
    """Return a number of branches in words.

    >>> counted(1), counted(3)
    ('1 branch', '3 branches')
    """
    return f"{count} branch" if count == 1 else f"{count} branches"


def _most_branches(curve: MeasuredCurve, branches: int | None) -> int:
    """Give the largest number of branches, which the points must determine."""
    points = curve.omega.size
    if branches is None:
        return min(MOST_BRANCHES, points - 1)
    if not is_whole_number(branches) or branches < 0:
        msg = f"branches = {shown(branches)}, but it must be a whole number, 0 or more."
        raise ParameterError(msg, parameter="branches", value=branches)
    unknowns = 2 * int(branches) + (1 if curve.static is None else 0)
    if unknowns > 2 * points:
        msg = (
            f"{branches} branches have {unknowns} unknown sizes, but {points} complex points give {2 * points} "
            "numbers. Measure more points or take fewer branches."
        )
        raise ParameterError(msg, parameter="branches", value=branches)
    return int(branches)


def _order(curve: MeasuredCurve, series: Series) -> PronyOrder:
    return PronyOrder(branches=int(series.k.size), rms=rms(curve, series), aicc=criterion(curve, series))


def _weighted_residual(curve: MeasuredCurve, series: Series) -> ComplexArray:
    rest = curve.values - series.values(curve.omega)
    return np.asarray(curve.weights[0] * rest.real + 1j * curve.weights[1] * rest.imag)


def _noise(rest: ComplexArray) -> float:
    """Estimate the scatter from neighbours; a sharp peak that stays in the residual is none, hence the median."""
    return min(scatter(rest), typical_scatter(rest))


def _follows(curve: MeasuredCurve, series: Series, grid: Series) -> bool:
    """Tell whether the residual is scatter: no series follows if the best of all, and the one chosen, leave more."""
    for candidate in (series, grid):
        rest = _weighted_residual(curve, candidate)
        size = rms(curve, candidate)
        if size <= VISIBLE_MISFIT or size <= ABOVE_SCATTER * _noise(rest) or lag_one(rest) <= IN_ROWS:
            return True
    return False


def _fit(
    curve: MeasuredCurve,
    series: Series,
    weight: Weight,
    *,
    floor: float,
    orders: tuple[PronyOrder, ...],
    fluid: FluidColumn | None,
    asked: int | None,
) -> PronyFit:
    unit, rate = curve.stiffness_unit, curve.omega_unit
    measured = (curve.values + (curve.static or 0.0)) * unit
    rest = _weighted_residual(curve, series)
    errors = _standard_errors(curve, series)
    scale = {"k0": unit, "c0": unit / rate, "k": unit, "c": unit / rate}
    follows = _follows(curve, series, series) if fluid is None else False
    k0 = (series.k0 + (curve.static or 0.0)) * unit
    words = _verdict(curve, series, rest, floor, fluid, follows=follows)
    if asked is not None and series.k.size < asked:
        words += f" {asked} branches were asked for; the others come out as nothing."
    size = max(k0, UNDETERMINED * float(np.abs(measured).min()))
    undetermined = not errors["k0"].item() * unit <= UNDETERMINED * size
    if curve.static is None and undetermined:
        words += " The stiffness at rest is not determined by this band: pass static_stiffness."
    return PronyFit(
        frequency=read_only(curve.omega * rate / (2.0 * np.pi)),
        stiffness=read_only(measured),
        weight=weight,
        k0=k0,
        c0=series.c0 * unit / rate,
        k=read_only(series.k * unit),
        c=read_only(series.k / series.w * unit / rate),
        standard_errors={name: read_only(value * scale[name]) for name, value in errors.items()},
        residual=read_only((curve.values - series.values(curve.omega)) * unit),
        rms=rms(curve, series),
        floor=floor,
        scatter=_noise(rest),
        orders=orders,
        follows=follows,
        fluid=fluid,
        verdict=words,
    )


def _standard_errors(curve: MeasuredCurve, series: Series) -> dict[str, FloatArray]:
    """Give standard errors from the Jacobian in k0, c0, k, c; NaN where it is singular or points are too few."""
    s = 1j * curve.omega[:, None]
    share = s / (s + series.w)
    columns = [share**2, series.w**2 * s / (s + series.w) ** 2]  # d/dk, d/dc of k c s / (k + c s)
    steady = ([np.ones_like(s)] if curve.static is None else []) + ([s] if series.c0 > 0.0 else [])
    jacobian = curve.weighted(np.hstack([*steady, *columns]))
    size = np.linalg.norm(jacobian, axis=0)
    spare = jacobian.shape[0] - jacobian.shape[1]
    values, right = np.linalg.svd(jacobian / size, full_matrices=False)[1:]
    if spare <= 0 or values[-1] <= jacobian.shape[0] * np.finfo(float).eps * values[0]:
        found = np.full(size.size, np.nan)
    else:
        found = np.sqrt(series.cost / spare * np.sum((right / values[:, None]) ** 2, axis=0)) / size
    n, first = series.k.size, len(steady)
    nothing = np.zeros(1)
    return {
        "k0": found[:1] if curve.static is None else nothing,
        "c0": found[first - 1 : first] if series.c0 > 0.0 else nothing,
        "k": found[first : first + n],
        "c": found[first + n :],
    }


def _verdict(
    curve: MeasuredCurve, series: Series, rest: ComplexArray, floor: float, fluid: FluidColumn | None, *, follows: bool
) -> str:
    if follows:
        size = rms(curve, series)
        return f"A Maxwell series follows the curve: rms {size:.1e}, scatter {_noise(rest):.1e}, floor {floor:.1e}."
    worst = float(curve.omega[int(np.argmax(np.abs(rest)))] * curve.omega_unit / (2.0 * np.pi))
    words = (
        f"No Maxwell series follows this curve: the best of all leaves {floor:.1e}, the scatter is "
        f"{_noise(rest):.1e}, most at {worst:.4g} Hz."
    )
    if fluid is None:
        return words
    return (
        f"{words} A column of fluid with its resonance at {fluid.frequency:.4g} Hz (damping ratio "
        f"{fluid.damping_ratio:.2g}, {fluid.mass:.3g} kg behind {fluid.stiffness:.4g} N/m) beside a series leaves "
        f"{fluid.rms:.1e}: take fit.fluid.part, or hydraulic_mount."
    )
