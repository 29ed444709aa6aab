"""The step response: outputs of the state space, and the DOFs without inertia recovered from its states."""

from itertools import product
from typing import Any

import control
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.doors import require_switches, require_texts
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.plots.axes import (
    AxesArray,
    AxesLike,
    draw_grid,
    finished_plot,
    label_y,
    legend_prefix,
    no_lines,
    prepared_axes,
    require_system,
)
from halfdof_ctrl.plots.units import Units, known_units, plain, signal_label, signal_names, typeset
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.frequency import DISCRETE_ORIGIN
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.step_times import relevant_poles, step_times
from halfdof_ctrl.systems.time_response import checked_times, step_response

FEWEST_SAMPLES, MOST_SAMPLES = 10, 5000  #: of the response of a discrete system
NAMED_LINES = 8  #: recovered DOFs that the legend names
MOST_RECOVERED = 200  #: DOFs of a sparse model up to which those without inertia are drawn


def step_plot(
    sysdata: control.StateSpace | SecondOrderModel,
    timepts: npt.ArrayLike | None = None,
    *,
    ax: AxesLike = None,
    grid: bool = True,
    title: str | None = None,
    label: str | None = None,
    units: Units = None,
) -> control.ControlPlot:
    """Draw the response to a unit step of each input, for a model with the DOFs that have no inertia.

    Parameters
    ----------
    sysdata : control.StateSpace or SecondOrderModel
        The outputs are `control.step_response` of the state space, for a model in the states that keep most digits
        (energy coordinates where it has them, else scaled ones; see `mech2ss`). Below them
        stand the displacements of its half and static DOFs, as `ExactReduction.recover` gives them (with
        orthonormal bases, of every DOF that a half or static coordinate moves); not those of a sparse model with more
        than 200 DOFs.
    timepts : (k,) array_like or float, optional
        Equidistant times [s], or the last time. By default `step_times` of the modes that are seen in the
        plot, for a discrete-time system of ``log(z) / dt`` of its poles.
    ax : (rows, m) array_like of Axes, optional
        p outputs in rows, and a row for the recovered displacements of each unit, if there are any; m inputs
        in columns.
    grid : bool
        Draw grid lines.
    title, label, units : optional
        As in `bode_plot`.

    Returns
    -------
    control.ControlPlot
        ``lines`` has the shape of the axes.

    Raises
    ------
    ParameterError
        Axes of the wrong shape, times that are not equidistant, something that is neither system nor model.
    SignalNameError
        A unit for an unknown signal.
    ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        The model has no state space (see `mech2ss`).

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> cplt = step_plot(hydromount().select(inputs="F_y", outputs="y"))
    >>> [ax.get_ylabel() for ax in cplt.axes[:, 0]]
    ['y [m]', 'displacement [m]']
    >>> plt.close(cplt.figure)
    """
    require_texts(title=title, label=label)
    require_switches(grid=grid)
    require_system(sysdata)
    known = known_units(sysdata, units)
    reduction: ExactReduction | None = None
    if isinstance(sysdata, SecondOrderModel):
        reduction, discrete = reduced(sysdata), False
        response = step_response(sysdata, timepts)
        if sysdata.is_sparse and len(sysdata.dofs) > MOST_RECOVERED:
            reduction = None  # nobody could tell so many curves apart
    else:
        discrete = sysdata.isdtime(strict=True)
        response = control.step_response(sysdata, _times(sysdata, timepts), squeeze=False)
    time, outputs = np.asarray(response.time), np.asarray(response.y)
    (p, m), panels = outputs.shape[:2], _panels(reduction, known)
    what = f"{p} outputs and {len(panels)} groups of recovered displacements in rows, {m} inputs in columns"
    axes = prepared_axes(ax, (p + len(panels), m), what, height=1.2 + 1.6 * max(2, p + len(panels)))
    lines, prefix = no_lines(axes), legend_prefix(label)
    style: dict[str, Any] = {"drawstyle": "steps-post" if discrete else "default", "linewidth": 1.5}
    for i, j in product(range(p), range(m)):
        lines[i, j] += axes[i, j].plot(
            time, outputs[i, j], label=f"{prefix}outputs" if panels or prefix else "_outputs", **style
        )
    if reduction is not None and panels:
        recovered = reduction.recover(response)
        kinds = reduction.partition.kinds_of(reduction.model.dofs)
        for (row, (unit, dofs)), j in product(enumerate(panels.items(), start=p), range(m)):
            histories = [recovered[dof][j] for dof in dofs]
            lines[row, j] += _draw_recovered(axes[row, j], time, histories, {d: kinds[d] for d in dofs}, prefix)
            axes[row, j].set_ylabel((plain(dofs[0]) if len(dofs) == 1 else "displacement") + unit)
    _dress(axes, sysdata, known, grid=grid)
    return finished_plot(lines, axes, title, sysdata, own=ax is None)


def _times(sys: control.StateSpace, timepts: npt.ArrayLike | None) -> FloatArray | float | None:
    """Check the given times of a state space, or choose them from the modes seen in the outputs."""
    if timepts is not None and np.ndim(timepts) > 0:
        return checked_times(timepts)
    horizon = None if timepts is None else float(np.asarray(timepts))
    if sys.isdtime(strict=True):
        return horizon if horizon is not None else _sampled_horizon(sys)
    return step_times(relevant_poles(sys.A, sys.B, sys.C, sys.D), horizon)


def _sampled_horizon(sys: control.StateSpace) -> float | None:
    """Return the last time at which a discrete system is looked at, by s = log(z) / dt of its poles."""
    dt = float(sys.dt)
    poles = bounded_poles(np.asarray(sys.A, dtype=float)).values
    slow = np.log(poles[poles != 0.0]) / dt
    slow = np.where(np.abs(slow) * dt <= DISCRETE_ORIGIN, 0.0, slow)
    if slow.size == 0 or not np.isfinite(slow).all():
        return None
    steps = int(np.clip(np.ceil(step_times(slow)[-1] / dt), FEWEST_SAMPLES, MOST_SAMPLES))
    return steps * dt


def _panels(reduction: ExactReduction | None, units: dict[str, str]) -> dict[str, list[str]]:
    """Group the DOFs that are recovered by the unit they are drawn in."""
    groups: dict[str, list[str]] = {}
    for dof in [] if reduction is None else reduction.partition.kinds_of(reduction.model.dofs):
        groups.setdefault(f" [{typeset(units[dof])}]" if dof in units else "", []).append(dof)
    return groups


def _draw_recovered(
    ax: Axes, time: FloatArray, histories: list[FloatArray], kinds: dict[str, str], prefix: str
) -> list[Line2D]:
    """Draw displacements, of which the legend names the first eight."""
    lines: list[Line2D] = []
    for k, ((dof, kind), history) in enumerate(zip(kinds.items(), histories, strict=True)):
        text = f"{prefix}{plain(dof)} ({kind} DOF)"
        if len(kinds) > NAMED_LINES and k >= NAMED_LINES - 1:
            text = f"{prefix}{len(kinds) - k} more" if k == NAMED_LINES - 1 else "_more"
        colour, dashes = f"C{1 + k % 9}", ("-", "--", "-.", ":")[k % 4]
        lines += ax.plot(time, history, color=colour, linestyle=dashes, linewidth=1.5, label=text)
    return lines


def _dress(axes: AxesArray, sys: control.StateSpace | SecondOrderModel, units: dict[str, str], *, grid: bool) -> None:
    """Set labels and grid of all axes."""
    for i, name in enumerate(signal_names(sys)[0]):
        for ax in axes[i]:
            label_y(ax, signal_label(name, units))
    time_unit = "[samples]" if getattr(sys, "dt", 0) is True else "[s]"
    for j, name in enumerate(signal_names(sys)[1]):
        step = f"{plain(name)} = 1 {typeset(units[name])}" if name in units else f"{plain(name)} = 1"
        axes[-1, j].set_xlabel(f"time after the step {step} {time_unit}")
    for ax in axes.flat:
        ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 4), useMathText=True)
        ax.ticklabel_format(axis="x", style="sci", scilimits=(-3, 5), useMathText=True)
        for axis in (ax.xaxis, ax.yaxis):
            axis.get_offset_text().set_fontsize("small")
        ax.margins(x=0.0)
    draw_grid(list(axes.flat), on=grid)
    axes[0, 0].figure.align_ylabels(list(axes.flat))
