"""The pole map: poles of A, finite eigenvalues of the pencil over them, zeros, and the closed loop."""

from typing import Any, TypeAlias

import control
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.base.doors import require_switches, require_texts
from halfdof_ctrl.base.errors import NoStateSpaceError, ParameterError
from halfdof_ctrl.descriptor.data_limit import warn_of_eigenvalues
from halfdof_ctrl.descriptor.finite_part import finite_part
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.descriptor.zeros import zeros
from halfdof_ctrl.design.lqr import StateFeedback
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.plots.axes import AxesLike, finished_plot, legend_prefix, no_lines, prepared_axes, require_system
from halfdof_ctrl.plots.pole_grid import draw_discrete_grid, draw_pole_grid, mark_beyond, mark_multiple, set_pole_axes
from halfdof_ctrl.systems.origin import poles_of_model
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.state_space_data import StateSpaceData
from halfdof_ctrl.systems.working_states import working_matrix

Mark: TypeAlias = tuple[ComplexArray, str, dict[str, Any]]

NONE = np.zeros(0, dtype=np.complex128)
CROSS: dict[str, Any] = {"marker": "x", "color": "C0", "markersize": 7.0, "markeredgewidth": 1.8, "zorder": 3.0}
RING: dict[str, Any] = {"marker": "o", "color": "black", "markersize": 13.0, "markerfacecolor": "none", "zorder": 2.9}
ZERO_MARK: dict[str, Any] = {
    "marker": "D",
    "color": "C2",
    "markersize": 8.0,
    "markeredgewidth": 1.5,
    "markerfacecolor": "none",
    "zorder": 3.1,  # hollow and above crosses and rings, so that neither hides the other
}
CLOSED: dict[str, Any] = {**CROSS, "color": "C3"}
NO_MARK: dict[str, Any] = {"marker": "", "color": "none"}


def pole_map_plot(
    sysdata: control.StateSpace | SecondOrderModel,
    *,
    feedback: StateFeedback | None = None,
    ax: AxesLike = None,
    grid: bool = True,
    title: str | None = None,
    label: str | None = None,
) -> control.ControlPlot:
    """Draw poles, finite eigenvalues of (M, C, K), and zeros in the s-plane.

    Parameters
    ----------
    sysdata : control.StateSpace or SecondOrderModel
        Crosses are the eigenvalues of A. For a model, open circles are the finite eigenvalues of its
        pencil (`pencil_structure`), the legend says how many infinite ones were deflated, and the zeros are `zeros`
        of it. Where a model has no A (complex, order uncertain) there are circles alone.
    feedback : StateFeedback, optional
        A design of `lqr`, whose closed-loop poles are drawn beside.
    ax : Axes, optional
    grid : bool
        Draw lines of equal damping ratio and of equal natural frequency.
    title, label : str, optional
        As in `bode_plot`.

    Returns
    -------
    control.ControlPlot
        ``lines[0, 0]`` holds the markers in the order of the legend, without the grid. The axes are
        logarithmic (symlog) where the moduli span more than three decades, or where a fast point would leave those that
        swing no room; the z-plane shows the unit circle, and says in words what lies four times as far out.

    Raises
    ------
    ParameterError
        Axes of the wrong shape, something that is neither system nor model, or no `StateFeedback`.
    SingularPencilError
        ``det P(s)`` of the model vanishes identically.

    Warns
    -----
    DataLimitWarning
        Entries of the model known to their last digit do not determine its slow motion.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> cplt = pole_map_plot(hydromount())
    >>> [text.get_text() for text in cplt.legend.get_texts()][-1]
    '2 infinite eigenvalues deflated'
    >>> plt.close(cplt.figure)
    """
    require_texts(title=title, label=label)
    require_switches(grid=grid)
    _require_feedback(feedback)
    marks = _marks(sysdata, feedback)
    axes = prepared_axes(ax, (1, 1), "a single one for the s-plane", height=4.8)
    plane, lines, prefix = axes[0, 0], no_lines(axes), legend_prefix(label)
    discrete = isinstance(sysdata, control.StateSpace) and sysdata.isdtime(strict=True)
    if not plane.has_data():
        set_pole_axes(plane, np.concatenate([points for points, _, _ in marks]), discrete=discrete)
        draw_plane(plane, grid=grid, discrete=discrete)
    for points, text, style in marks:
        lines[0, 0] += plane.plot(points.real, points.imag, label=prefix + text, linestyle="none", **style)
        if style["marker"] == "x":
            mark_multiple(plane, points, style["color"])
        if discrete:
            mark_beyond(plane, points, text, style["color"])
    return finished_plot(lines, axes, title, sysdata, own=ax is None)


def _require_feedback(feedback: object) -> None:
    if not isinstance(feedback, StateFeedback | None):
        msg = f"feedback must be a StateFeedback, as lqr(model, ...) gives it, not {type(feedback).__name__}."
        raise ParameterError(msg, parameter="feedback", value=feedback)


def _marks(sysdata: control.StateSpace | SecondOrderModel, feedback: StateFeedback | None) -> list[Mark]:
    """List what is drawn: points, text and style."""
    require_system(sysdata)
    closed = "" if feedback is None else " (open loop)"
    if isinstance(sysdata, SecondOrderModel):
        structure = pencil_structure(sysdata)
        infinite = structure.n_infinite
        poles = _poles_of_A(sysdata, closed)
        warn_of_eigenvalues(sysdata, np.concatenate([structure.finite_eigenvalues, *[mark[0] for mark in poles]]))
        marks = [
            *poles,
            (structure.finite_eigenvalues, "finite eigenvalues of (M, C, K)", RING),
            (zeros(sysdata), "zeros", ZERO_MARK),
            (NONE, f"{infinite} infinite eigenvalue{'s' * (infinite != 1)} deflated", NO_MARK),
        ]
    else:
        values = bounded_poles(np.asarray(sysdata.A, dtype=float)).values
        if sysdata.isdtime(strict=True):
            values = np.asarray(sysdata.poles())
        marks = [(values, f"poles of A{closed}", CROSS), (_zeros_of(sysdata), "zeros", ZERO_MARK)]
    if feedback is not None:
        marks.insert(1, (np.asarray(feedback.poles), "poles with feedback", CLOSED))
    return [mark for mark in marks if mark[0].size or mark[2] is NO_MARK]


def _poles_of_A(model: SecondOrderModel, closed: str) -> list[Mark]:  # noqa: N802
    try:
        poles = poles_of_model(model, working_matrix(model)).values
    except NoStateSpaceError:
        return []
    return [(poles, f"poles of A{closed}", CROSS)]


def _zeros_of(sys: control.StateSpace) -> ComplexArray:
    """Find the transmission zeros of a state space, with or without slycot the same."""
    A, B, C, D = StateSpaceData.of(sys)
    E = np.zeros((A.shape[0] + D.shape[0], A.shape[1] + D.shape[1]))
    E[: A.shape[0], : A.shape[1]] = np.eye(A.shape[0])
    return finite_part(np.block([[A, B], [C, D]]), E).eigenvalues


def draw_plane(ax: Axes, *, grid: bool, discrete: bool) -> None:
    """Draw what lies behind the markers, and label the axes."""
    boundary: dict[str, Any] = {"color": "0.35", "linewidth": 1.0, "zorder": 0.8}
    if discrete:
        ax.add_patch(Circle((0.0, 0.0), 1.0, fill=False, **boundary))
        ax.set_aspect("equal", adjustable="box")
        ax.set_xlabel("real part of z [-]")
        ax.set_ylabel("imaginary part of z [-]")
        if grid:
            draw_discrete_grid(ax)
        return
    right = ax.get_xlim()[1]
    ax.axvline(0.0, label="_boundary", **boundary)
    ax.axvspan(0.0, right, facecolor="C3", alpha=0.07, zorder=0.5)
    if ax.get_xscale() == "linear":
        ax.ticklabel_format(style="sci", scilimits=(-3, 5), useMathText=True)
    ax.set_xlabel("real part of s [rad/s]   (shaded: unstable)")
    ax.set_ylabel("imaginary part of s [rad/s]")
    if grid:
        draw_pole_grid(ax)
