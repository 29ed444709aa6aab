"""What the plots share: axes to draw on, a legend that covers no data, and labels with units.

A signal's unit follows from the model: a DOF's displacement is in m, its derivatives in m/s and m/s^2, the
force on it in N, unless the user says otherwise. Where nothing is known, nothing is claimed.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import control
import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from halfdof_ctrl.base.doors import require_text
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import name_from_label
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.plots.units import plain
from halfdof_ctrl.systems.doors import require_finite_system

AxesArray: TypeAlias = npt.NDArray[Any]  #: two-dimensional, of matplotlib Axes
AxesLike: TypeAlias = Axes | Sequence[Axes] | npt.NDArray[Any] | None
FIGURE_WIDTH = 6.0  #: [in] of a plot with one or two columns
LEGEND = "halfdof_ctrl legend"  #: gid by which a later plot on the same axes finds the figure's legend
LEGEND_SIZE = 9.0  #: [pt]
USUAL_WIDTH = 0.95  #: part of the width on which curves lie in the range that is shown in any case
LEGEND_CHARACTERS = 13.0  #: that fit into an inch of a legend
MADE_UP = re.compile(r"sys\[\d+\](\$\w+)*")  #: names that python-control makes, also for what it makes of a system
CIRCLE: dict[str, Any] = {"linestyle": "none", "marker": "o", "markerfacecolor": "none", "color": "black"}


def prepared_axes(
    ax: AxesLike, shape: tuple[int, int], what: str, *, height: float, ratios: Iterable[float] | None = None
) -> AxesArray:
    """Return an array of axes of the wanted shape: the given ones, or those of a new figure.

    Parameters
    ----------
    ax : Axes, array_like of Axes, or None
        A single Axes where one is enough; one dimension where there is one row or one column.
    shape : (int, int)
        Rows and columns that the plot needs.
    what : str
        What stands in rows and columns, for the message.
    height : float
        Of a new figure [in].
    ratios : iterable of float, optional
        Heights of the rows of a new figure, relative to each other.

    Raises
    ------
    ParameterError
        Axes of another shape, or things that are no Axes.
    """
    rows, columns = shape
    if ax is None:
        figure = plt.figure(figsize=(max(FIGURE_WIDTH, 3.0 * columns), height), layout="constrained")
        heights = None if ratios is None else list(ratios)
        axes = figure.subplots(rows, columns, squeeze=False, sharex="col", height_ratios=heights)
        if columns > 1:
            _small_text(axes)
        return axes
    try:
        given = np.asarray(ax, dtype=object)
        sound = all(isinstance(entry, Axes) for entry in given.flat)
    except Exception:  # noqa: BLE001  # the object is the user's, and so is what it raises
        sound = False
    if not sound:
        msg = f"ax must be matplotlib Axes or an array of them, not {type(ax).__name__}: pass plt.subplots(...)[1]."
        raise ParameterError(msg, parameter="ax", value=ax)
    if not all(entry.figure is not None and entry.name == "rectilinear" for entry in given.flat):
        msg = "ax must be Axes with straight x and y axes that are still in a figure: pass plt.subplots(...)[1]."
        raise ParameterError(msg, parameter="ax", value=ax)
    if given.shape != shape and not (given.ndim < 2 and min(shape) == 1 and given.size == max(shape)):  # noqa: PLR2004
        msg = (
            f"ax has shape {given.shape}, but this plot needs axes of shape {shape}: {what}. "
            f"Pass plt.subplots({rows}, {columns})[1], or leave ax out for a new figure."
        )
        raise ParameterError(msg, parameter="ax", value=given.shape)
    return given.reshape(shape)


def _small_text(axes: AxesArray) -> None:
    """Write as small as python-control does where axes stand side by side; rcParams belong to the whole process."""
    sizes = control.config.defaults["ctrlplot.rcParams"]
    for one in axes.flat:
        one.title.set_size(sizes["axes.titlesize"])
        for axis, letter in ((one.xaxis, "x"), (one.yaxis, "y")):
            axis.label.set_size(sizes["axes.labelsize"])
            axis.set_tick_params(labelsize=sizes[f"{letter}tick.labelsize"])


def size_in_inches(ax: Axes) -> tuple[float, float]:
    """Return about how wide and how high axes are, before they are laid out [in]."""
    place, whole, dpi = ax.get_position(), ax.figure.bbox, ax.figure.dpi
    return float(place.width * whole.width / dpi), float(place.height * whole.height / dpi)


def no_lines(axes: AxesArray) -> npt.NDArray[Any]:
    """Return an empty list for each of the axes."""
    lines = np.empty(axes.shape, dtype=object)
    for place in np.ndindex(axes.shape):
        lines[place] = []
    return lines


def finished_plot(
    lines: npt.NDArray[Any],
    axes: AxesArray,
    title: str | None,
    system: control.StateSpace | SecondOrderModel,
    *,
    own: bool,
) -> control.ControlPlot:
    """Add legend and title, and pack everything up.

    `own` tells that the figure was made here: its title is by default the name of the system, if it has one.
    """
    legend = draw_legend(axes, own=own)
    name = system.name or ""
    if title is None and own and not MADE_UP.fullmatch(name):
        title = plain(name_from_label(name))
    if title:
        draw_title(axes, title, own=own)
    return control.ControlPlot(lines, axes, axes[0, 0].figure, legend=legend)


def require_system(sysdata: object) -> None:
    """Refuse what is neither a state space nor a model.

    Raises
    ------
    ParameterError
        Anything else, such as a transfer function.
    MatrixError
        A state space with NaN or Inf.
    """
    if not isinstance(sysdata, control.StateSpace | SecondOrderModel):
        msg = (
            f"sysdata must be a SecondOrderModel or a control.StateSpace, not {type(sysdata).__name__}. "
            "Convert it first, by mechss or control.ss."
        )
        raise ParameterError(msg, parameter="sysdata", value=sysdata)
    if isinstance(sysdata, control.StateSpace):
        require_finite_system(sysdata)


def legend_prefix(label: str | None) -> str:
    """Return what stands before the entries of a system in the legend."""
    require_text(label, "label")
    return f"{plain(label)}: " if label else ""


def label_y(ax: Axes, text: str) -> None:
    """Label the y axis, but keep a label that says the same and more (the unit, from a model drawn before)."""
    if not ax.get_ylabel().startswith(text):
        ax.set_ylabel(text)


def usual_sizes(ax: Axes, part: float) -> tuple[float, float]:
    """Return the sizes that a part of the width of a plot stays above, and below, for all its curves.

    Points weigh by the width between them, since grids are dense at resonances; markers do not count.
    """
    sizes, widths = [np.zeros(0)], [np.zeros(0)]
    for line in ax.get_lines():
        if line.get_linestyle() == "None":
            continue
        x, y = (np.asarray(data, dtype=float) for data in (line.get_xdata(), line.get_ydata()))
        places = np.log(x, where=x > 0.0, out=np.full(x.size, np.nan))
        width = np.abs(np.gradient(places)) if x.size > 1 else np.ones(x.size)
        sound = np.isfinite(y) & (y > 0.0)
        sizes.append(y[sound])
        widths.append(np.nan_to_num(width[sound]))
    every, weights = np.concatenate(sizes), np.concatenate(widths)
    order = np.argsort(every)
    total = np.cumsum(weights[order])
    if total.size == 0 or total[-1] <= 0.0:
        return float(every.min(initial=np.inf)), float(every.max(initial=0.0))
    least, most = np.searchsorted(total, np.array([1.0 - part, part]) * total[-1])
    return float(every[order][least]), float(every[order][most])


def draw_grid(axes: Iterable[Axes], *, on: bool) -> None:
    """Draw light grid lines, or none."""
    style: dict[str, Any] = {"color": "0.85", "linewidth": 0.7} if on else {}  # matplotlib draws what has a style
    for ax in axes:
        ax.grid(visible=on, which="major", **style)
        ax.set_axisbelow(True)


def draw_legend(axes: AxesArray, *, own: bool) -> Legend | None:
    """Put a legend where it covers no data: below a figure of our own, else above the first of the axes.

    Lines with the same text and look stand in it once.
    """
    figure = axes[0, 0].figure
    ours = [legend for legend in figure.legends if legend.get_gid() == LEGEND]
    entries: dict[tuple[object, ...], Line2D] = {}
    for line in [line for ax in axes.flat for line in ax.get_lines()]:
        look = (line.get_label(), line.get_color(), line.get_linestyle(), line.get_marker())
        if not str(line.get_label()).startswith("_"):
            entries.setdefault(look, line)
    if not entries:
        return None
    lines = list(entries.values())
    longest = max(len(str(line.get_label())) for line in lines) + 8
    for_figure = own or bool(ours)
    width = figure.bbox.width / figure.dpi * (1.0 if for_figure else axes[0, 0].get_position().width)
    rows = -(-len(lines) // int(np.clip(LEGEND_CHARACTERS * width // longest, 1, len(lines))))
    style: dict[str, Any] = {
        "handles": lines,
        "ncols": -(-len(lines) // rows),
        "fontsize": LEGEND_SIZE,
        "frameon": False,
    }
    for old in ours:
        old.remove()
    if for_figure:
        legend: Legend = figure.legend(loc="outside lower center", **style)
        legend.set_gid(LEGEND)
        return legend
    first: Axes = axes[0, 0]
    if first.get_yscale() == "log":
        style |= {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0)}
    else:  # a power of ten may stand at the left
        style |= {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
    beside: Legend = first.legend(borderaxespad=0.2, **style)
    return beside


def draw_title(axes: AxesArray, title: str, *, own: bool) -> None:
    """Put a title above a figure of our own, or above the first of given axes."""
    if own:
        axes[0, 0].figure.suptitle(title, fontsize="medium")
    else:
        legend = axes[0, 0].get_legend()
        axes[0, 0].set_title(title, fontsize="medium", pad=6.0 if legend is None else 14.0 * _legend_rows(legend) + 8.0)


def _legend_rows(legend: Legend) -> int:
    columns = max(1, int(getattr(legend, "_ncols", 1)))
    return -(-len(legend.get_texts()) // columns)
