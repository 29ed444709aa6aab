"""What a sweep gave, as a family of Bode curves or as poles on their way, coloured by a parameter."""

from collections.abc import Mapping
from itertools import product
from typing import Any, Literal, TypeAlias

import control
import numpy as np
from matplotlib.axes import Axes

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.doors import require_mapping, require_switches, require_texts, shown, wrong_object
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import control_labels, force_names, motion_names
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.plots.axes import AxesArray, AxesLike, draw_legend, draw_title, no_lines, prepared_axes
from halfdof_ctrl.plots.bode import Scales, dress_bode
from halfdof_ctrl.plots.branches import followed
from halfdof_ctrl.plots.pole_grid import mark_beyond, set_pole_axes
from halfdof_ctrl.plots.pole_map import draw_plane
from halfdof_ctrl.plots.sweep_colours import CaseColours, Numbers, coloured_cases
from halfdof_ctrl.plots.units import Units, known_units
from halfdof_ctrl.sweeps.result import SweepResult
from halfdof_ctrl.systems.phase import phase_by_work
from halfdof_ctrl.systems.sampled_phase import continuous_phase

Kind: TypeAlias = Literal["bode", "poles"]

MANY_CASES = 12  #: from so many curves on they are drawn thinner
BRANCH: dict[str, Any] = {"color": "0.6", "linewidth": 0.9, "label": "_branch", "zorder": 2.4}
FIRST_CASE: dict[str, Any] = {"marker": "x", "markersize": 7.0, "markeredgewidth": 1.8, "zorder": 3.0}
CASES_BETWEEN: dict[str, Any] = {"marker": "o", "markersize": 4.0, "markeredgewidth": 0.0, "zorder": 2.8}
LAST_CASE: dict[str, Any] = {"marker": "s", "markersize": 5.5, "markeredgewidth": 0.0, "zorder": 3.1}
ARROW: dict[str, Any] = {
    "arrowstyle": "-|>",
    "color": "0.35",
    "linewidth": 0.0,
    "mutation_scale": 14.0,
    "shrinkA": 0.0,
    "shrinkB": 0.0,
}
ARROW_LENGTH = 10.0  #: [px at 100 dpi], about
NEAR_MIDDLE = 0.15  #: part of a branch on both sides of its middle where the longest step gets the arrow
SHORTEST = 30.0  #: [px at 100 dpi] length from which a branch gets an arrow


def sweep_plot(
    result: SweepResult,
    kind: Kind | None = None,
    *,
    parameter: str | None = None,
    at: Mapping[str, object] | None = None,
    ax: AxesLike = None,
    dB: bool = False,
    Hz: bool = False,
    deg: bool = True,
    grid: bool = True,
    title: str | None = None,
    units: Units = None,
) -> control.ControlPlot:
    """Draw the frequency responses or the poles of a sweep, coloured by a parameter.

    Parameters
    ----------
    result : SweepResult
        With a frequency response, or with poles. Cases that failed are left out.
    kind : {'bode', 'poles'}, optional
        A family of Bode curves, or the poles in the s-plane; by default Bode curves if there is a response. Along an
        axis of a grid, poles are joined to branches that run from a cross (first value) by an arrow to a square (last).
    parameter : str, optional
        Whose values are the colours, and along which poles move; by default the first that was varied.
    at : mapping from parameter to value, optional
        Draw only cases with these values, such as ``{"K_v": 500}``.
    ax : array_like of Axes, optional
        As in `bode_plot`, (2 p, m); a single one for the poles.
    dB, Hz, deg, grid : bool
        As in `bode_plot`; `grid` also as in `pole_map_plot`.
    title : str, optional
        Above the figure, or above the first of the given axes.
    units : mapping from name to unit, optional
        As in `bode_plot`, and for parameters: ``{"C_h": "N s/m"}``.

    Returns
    -------
    control.ControlPlot
        ``lines`` has the shape of the axes, and in each entry a line for each case, in order; poles are followed by the
        lines of their branches. More than six values of a numeric parameter have a colour bar, fewer a legend.

    Notes
    -----
    A sweep keeps the values of responses and not the models. So the phase of a curve is unwrapped from its samples, and
    lightly damped resonances between two frequencies may be missed; but that of a DOF at its own force keeps the
    half circle that passive structures have, on any grid. `bode_plot` of one case has the phase of poles and zeros.

    Raises
    ------
    ParameterError
        Nothing of the kind in the result, an unknown parameter or value, axes of the wrong shape.
    SignalNameError
        A unit for something that is neither signal, DOF nor parameter.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> result = sweep(hydromount, {"C_h": [100, 300, 900]}, omega=[1.0, 10.0], inputs="F_y", outputs="y")
    >>> cplt = sweep_plot(result)
    >>> [text.get_text() for text in cplt.legend.get_texts()]
    ['C_h = 100', 'C_h = 300', 'C_h = 900']
    >>> plt.close(cplt.figure)
    """
    require_texts(title=title)
    require_switches(dB=dB, Hz=Hz, deg=deg, grid=grid)
    wanted = _checked_kind(result, kind)
    cases = coloured_cases(result, parameter, at)
    if wanted == "bode":
        lines, axes = _draw_curves(result, cases, ax, Scales(dB, Hz, deg), units, grid=grid)
    else:
        lines, axes = _draw_poles(result, cases, ax, grid=grid)
    cases.draw_bar(axes, units)
    legend = draw_legend(axes, own=ax is None)
    if title:
        draw_title(axes, title, own=ax is None)
    return control.ControlPlot(lines, axes, axes[0, 0].figure, legend=legend)


def _checked_kind(result: SweepResult, kind: str | None) -> str:
    """Find what there is to draw."""
    if not isinstance(result, SweepResult):
        raise wrong_object("sweep_plot", "what sweep returned", result, parameter="result")
    there = {"bode": result.response, "poles": result.poles}
    if kind is not None and not isinstance(kind, str):
        raise wrong_object("kind", "'bode' or 'poles'", kind, parameter="kind")
    wanted = kind or ("poles" if result.response is None else "bode")
    if wanted not in there:
        msg = f"kind = {shown(kind)}, but a sweep is drawn as 'bode' or 'poles'."
        raise ParameterError(msg, parameter="kind", value=kind)
    if there[wanted] is None:
        lacking = "frequency response: give omega" if wanted == "bode" else "poles: let compute have 'poles'"
        msg = f"The result has no {lacking} in sweep()."
        raise ParameterError(msg, parameter="kind", value=kind)
    return wanted


def _draw_curves(
    result: SweepResult, cases: CaseColours, ax: AxesLike, scales: Scales, units: Units, *, grid: bool
) -> tuple[AxesArray, AxesArray]:
    """Draw magnitude and phase of every case."""
    p, m = len(result.outputs), len(result.inputs)
    known = _signal_units(result, units)
    what = f"magnitude and phase of {p} outputs in rows, {m} inputs in columns"
    axes = prepared_axes(ax, (2 * p, m), what, height=4.2 if p == 1 else 1.0 + 3.0 * p, ratios=[1.4, 1.0] * p)
    omega, lines = np.asarray(result.omega), no_lines(axes)
    curves = np.asarray(result.response).reshape(-1, p, m, omega.size)[cases.numbers]
    width = 1.5 if len(curves) < MANY_CASES else 0.9
    for (i, j), place in product(np.ndindex(p, m), range(len(curves))):
        style = {"color": cases.colours[place], "linewidth": width, "label": _label(cases, place)}
        values, x = curves[place, i, j], scales.frequency(omega)
        lines[2 * i, j] += axes[2 * i, j].plot(x, scales.magnitude(values), **style)
        lines[2 * i + 1, j] += axes[2 * i + 1, j].plot(x, scales.phase(_phase(result, i, j, values)), **style)
    largest = np.abs(curves).max(axis=0)
    named = control.FrequencyResponseData(
        largest, omega, inputs=list(control_labels(result.inputs)), outputs=list(control_labels(result.outputs))
    )
    dress_bode(axes, named, named, known, scales, grid=grid)
    return lines, axes


def _phase(result: SweepResult, output: int, source: int, values: ComplexArray) -> FloatArray:
    """Return the phase of a channel [rad]: that of samples, but at its own force a motion keeps to the work done."""
    dofs = result.dofs
    for order in range(3):
        motions = dict(zip(motion_names(dofs, order), force_names(dofs), strict=True))
        if motions.get(result.outputs[output]) == result.inputs[source]:
            phase = phase_by_work(values, order)
            return continuous_phase(values) if phase is None else phase
    return continuous_phase(values)


def _signal_units(result: SweepResult, units: Units) -> dict[str, str]:
    """Return the units of the signals, as a model with the same DOFs has them."""
    require_mapping({} if units is None else units, "units", "from names of signals to their units")
    given = {name: unit for name, unit in (units or {}).items() if name not in result.parameters}
    own = {name: unit for name, unit in given.items() if name in {*result.inputs, *result.outputs} - {*result.dofs}}
    rest = {name: unit for name, unit in given.items() if name not in own}
    dofs = result.dofs or ("none",)
    model = mechss(np.eye(len(dofs)), None, None, dofs=dofs)
    return known_units(model, rest) | own


def _draw_poles(result: SweepResult, cases: CaseColours, ax: AxesLike, *, grid: bool) -> tuple[AxesArray, AxesArray]:
    """Draw the poles of every case, and along an axis of a grid the way that they take."""
    axes = prepared_axes(ax, (1, 1), "a single one for the s-plane", height=4.8)
    plane, lines = axes[0, 0], no_lines(axes)
    poles = np.asarray(result.poles)
    poles = poles.reshape(-1, poles.shape[-1])
    shown = poles[cases.numbers]
    if not plane.has_data():
        set_pole_axes(plane, shown[~np.isnan(shown)], discrete=result.discrete)
        draw_plane(plane, grid=grid, discrete=result.discrete)
        if result.discrete:
            mark_beyond(plane, shown[~np.isnan(shown)], "poles", "0.3")
    ways = _ways(result, cases)
    ends = {number: style for way in ways for number, style in ((way[0], FIRST_CASE), (way[-1], LAST_CASE))}
    for place, number in enumerate(cases.numbers.tolist()):
        label = cases.entry(place) if number in ends else _label(cases, place)
        points = poles[number]
        style = {"color": cases.colours[place], "linestyle": "none", "label": label}
        lines[0, 0] += plane.plot(points.real, points.imag, **style, **ends.get(number, CASES_BETWEEN))
    for way in ways:
        for branch in followed(poles[way]).T:
            lines[0, 0] += plane.plot(branch.real, branch.imag, **BRANCH)
            _draw_arrow(plane, branch[~np.isnan(branch)])
    return lines, axes


def _ways(result: SweepResult, cases: CaseColours) -> list[Numbers]:
    """List the cases along the axis of the parameter, for each combination of the other parameters."""
    if cases.name not in result.axes:
        return []
    axis = list(result.axes).index(cases.name)
    numbers = np.moveaxis(np.arange(np.prod(result.shape, dtype=int)).reshape(result.shape), axis, -1)
    ways = [way[np.isin(way, cases.numbers)] for way in numbers.reshape(-1, result.shape[axis])]
    return [way for way in ways if way.size > 1]


def _draw_arrow(ax: Axes, branch: ComplexArray) -> None:
    """Put an arrow between two poles near the middle of a branch, unless it is too short to show a direction."""
    path = ax.transData.transform(np.column_stack([branch.real, branch.imag]))
    steps = np.hypot(*np.diff(path, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    if way[-1] * 100.0 / ax.figure.dpi < SHORTEST:
        return
    central = (way[1:] >= (0.5 - NEAR_MIDDLE) * way[-1]) & (way[:-1] <= (0.5 + NEAR_MIDDLE) * way[-1])
    k = int(np.argmax(steps * central))
    direction = (path[k + 1] - path[k]) / steps[k]
    tip = 0.5 * (path[k] + path[k + 1]) + 0.5 * ARROW_LENGTH * direction
    start, end = ax.transData.inverted().transform([tip - direction, tip])
    ax.annotate("", xy=end, xytext=start, arrowprops=ARROW, zorder=2.9)


def _label(cases: CaseColours, place: int) -> str:
    return cases.entry(place) if cases.name and cases.scale is None else "_case"
