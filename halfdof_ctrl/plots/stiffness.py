"""Dynamic stiffness and loss angle, transmissibility and phase, over frequency as mount engineers read them."""

from collections.abc import Iterable, Sequence
from typing import Any, Literal, TypeAlias, get_args

import control
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.doors import is_choice, items_of, require_switches, require_texts, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import Names, as_tuple, force_names, listed, reaction_names
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.plots.axes import (
    USUAL_WIDTH,
    AxesArray,
    AxesLike,
    draw_grid,
    finished_plot,
    label_y,
    no_lines,
    prepared_axes,
    usual_sizes,
)
from halfdof_ctrl.plots.units import Units, known_units, plain, ratio_unit
from halfdof_ctrl.systems.phase import response_phase
from halfdof_ctrl.systems.stiffness import (
    TransmissibilityKind,
    dynamic_stiffness_response,
    evenly_from_zero,
    motion_frequencies,
    transmissibility_response,
)

Scale: TypeAlias = Literal["linear", "log"]
Models: TypeAlias = SecondOrderModel | Iterable[SecondOrderModel]
Labels: TypeAlias = str | Sequence[str] | None

SCALES: tuple[Scale, ...] = get_args(Scale)
ANGLE_STEPS = {
    True: (1.0, 1.5, 3.0, 4.5, 6.0, 9.0, 10.0),
    False: (1.0, 2.0, 5.0, 10.0),
}  #: of ticks, by WIDE_ANGLES or not
WIDE_ANGLES = 60.0  #: [deg] range of angles with ticks at parts of a right angle
STIFFNESS_SPIKE = {"linear": 10.0, "log": 1e5}  #: a peak higher than this times that range is cut
ROOM_ABOVE = {"linear": 2.0, "log": 300.0}  #: and the axis ends at this times that range
WIDE_RANGE = (
    1e4  #: ratio of the ends of a default grid, each a factor of 10 off the modes, from which it is logarithmic
)
CONSTANT_SPAN = 1e-6  #: [deg] or part of the magnitude: a smaller range is constant


def dynamic_stiffness_plot(
    sysdata: Models,
    dof: Names,
    omega: npt.ArrayLike | None = None,
    *,
    ax: AxesLike = None,
    xscale: Scale | None = None,
    yscale: Scale = "linear",
    Hz: bool = True,
    dB: bool = False,
    grid: bool = True,
    title: str | None = None,
    label: Labels = None,
    units: Units = None,
) -> control.ControlPlot:
    r"""Draw the modulus of the dynamic stiffness at a DOF and its loss angle over frequency.

    Parameters
    ----------
    sysdata : SecondOrderModel or sequence of SecondOrderModel
        Each gives a curve of `dynamic_stiffness`, from its descriptor form.
    dof : str or sequence of str
        DOF that is moved, as in `dynamic_stiffness`.
    omega : (k,) array_like, optional
        Frequencies [rad/s], the very points; also with `Hz`. By default the same for all models, those of
        `~halfdof_ctrl.systems.stiffness.motion_frequencies`.
    ax : (2,) array_like of Axes, optional
        For the modulus and the loss angle.
    xscale, yscale : {"linear", "log"}, optional
        Axes of the frequency and of the modulus. By default they are linear, the frequency logarithmic where modes are
        seen that are more than a factor of 100 apart.
    Hz : bool
        Frequency axis in Hz, else in rad/s.
    dB : bool
        Modulus in decibels of its unit; `yscale` is then linear.
    grid : bool
        Draw grid lines.
    title : str, optional
        Above the figure, by default the name of the model and the DOF; or above the first of the given axes.
    label : str or sequence of str, optional
        One for each model, in the legend. By default several models stand there by their names.
    units : mapping from signal to unit, optional
        As in `bode_plot`: ``{"phi": "rad"}`` for a stiffness in N m/rad.

    Returns
    -------
    control.ControlPlot
        ``lines`` has the shape of the axes, (2, 1), with one curve a model in each entry.

    Raises
    ------
    ParameterError
        Axes of the wrong shape, something that is no model, as many labels as there are not models, an unknown scale.
    SignalNameError, SingularPencilError
        As in `dynamic_stiffness`; or a unit for an unknown signal.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> cplt = dynamic_stiffness_plot([hydromount(m=0, C_h=c) for c in (100, 300)], "y", label=["100", "300"])
    >>> [axes.get_ylabel() for axes in cplt.axes[:, 0]]
    ['dynamic stiffness\nat y [N/m]', 'loss angle [deg]']
    >>> plt.close(cplt.figure)
    """
    require_texts(title=title)
    require_switches(Hz=Hz, dB=dB, grid=grid)
    models, texts = _models(sysdata, label)
    _require_scales("linear" if xscale is None else xscale, yscale)
    if omega is None:
        given = motion_frequencies(models, dof, free=True)
        if xscale is None:
            xscale = "log" if given[-1] > WIDE_RANGE * given[0] else "linear"
        omega = evenly_from_zero(given) if xscale == "linear" else given
    xscale = xscale or "linear"
    responses = [dynamic_stiffness_response(model, dof, omega) for model in models]
    names = as_tuple(dof)
    unit = _ratio_unit(models[0], units, force_names(names), names)
    axes = _prepared(ax, "modulus and loss angle")
    lines = _draw(axes, responses, texts, Hz=Hz, dB=dB)
    label_y(axes[0, 0], f"dynamic stiffness\nat {plain('+'.join(names))}{_decibels(unit) if dB else unit}")
    label_y(axes[1, 0], "loss angle [deg]")
    _dress(axes, xscale, None if dB else yscale, Hz=Hz, grid=grid)
    if title is None and ax is None:
        title = _title(models, f"dynamic stiffness at {'+'.join(names)}")
    return finished_plot(lines, axes, title, models[0], own=ax is None)


def transmissibility_plot(
    sysdata: Models,
    from_: Names,
    to: Names,
    omega: npt.ArrayLike | None = None,
    *,
    kind: TransmissibilityKind = "motion",
    ax: AxesLike = None,
    xscale: Scale = "log",
    yscale: Scale = "log",
    Hz: bool = True,
    dB: bool = False,
    grid: bool = True,
    title: str | None = None,
    label: Labels = None,
    units: Units = None,
) -> control.ControlPlot:
    r"""Draw the modulus and phase of a transmissibility over frequency.

    Parameters
    ----------
    sysdata : SecondOrderModel or sequence of SecondOrderModel
        Each gives a curve of `transmissibility`, from its descriptor form.
    from_, to, kind
        As in `transmissibility`.
    omega, ax, xscale, yscale, Hz, dB, grid, title, label, units
        As in `dynamic_stiffness_plot`; the axes are logarithmic by default, since isolation is a slope.

    Returns
    -------
    control.ControlPlot
        ``lines`` has the shape of the axes, (2, 1), with one curve a model in each entry.

    Raises
    ------
    ParameterError, SignalNameError, SingularPencilError
        As in `dynamic_stiffness_plot` and `transmissibility`.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> cplt = transmissibility_plot(hydromount(), "y", "y2")
    >>> cplt.axes[0, 0].get_ylabel()
    'transmissibility\n|y2/y| [-]'
    >>> plt.close(cplt.figure)
    """
    require_texts(title=title)
    require_switches(Hz=Hz, dB=dB, grid=grid)
    models, texts = _models(sysdata, label)
    _require_scales(xscale, yscale)
    if omega is None:
        held, other = (from_, to) if kind == "motion" else (to, from_)
        omega = motion_frequencies(models, held, other=other, linear=xscale == "linear")
    responses = [transmissibility_response(model, from_, to, omega, kind=kind) for model in models]
    causes, results = as_tuple(from_), as_tuple(to)
    unit = _ratio_unit(models[0], units, results, causes)
    if kind == "force":
        unit = _ratio_unit(models[0], units, force_names(results), force_names(causes))
        causes, results = force_names(causes), reaction_names(results)
    axes = _prepared(ax, "modulus and phase")
    lines = _draw(axes, responses, texts, Hz=Hz, dB=dB)
    label_y(
        axes[0, 0],
        f"transmissibility\n|{plain('+'.join(results))}/{plain('+'.join(causes))}|{_decibels(unit) if dB else unit}",
    )
    label_y(axes[1, 0], "phase [deg]")
    _dress(axes, xscale, None if dB else yscale, Hz=Hz, grid=grid)
    if title is None and ax is None:
        title = _title(
            models, f"transmissibility of {kind} from {'+'.join(as_tuple(from_))} to {'+'.join(as_tuple(to))}"
        )
    return finished_plot(lines, axes, title, models[0], own=ax is None)


def _models(sysdata: Models, label: Labels) -> tuple[list[SecondOrderModel], list[str]]:
    """Return the models as a list, and the text of each in the legend; an underscore keeps it out."""
    given: object = [sysdata] if isinstance(sysdata, SecondOrderModel) else sysdata
    listable: Any = given if isinstance(given, Iterable) and not isinstance(given, np.ndarray) else ()
    models: list[SecondOrderModel] = items_of(listable, "sysdata", "a model, or a list of some", parameter="sysdata")
    if not models or not all(isinstance(model, SecondOrderModel) for model in models):
        msg = f"sysdata must be a SecondOrderModel or a list of some, not {type(sysdata).__name__}."
        raise ParameterError(msg, parameter="sysdata", value=sysdata)
    if label is not None:
        texts = list(as_tuple(label))
        if len(texts) != len(models):
            msg = f"label must give a text for each of {len(models)} models, not {len(texts)}: {listed(texts)}."
            raise ParameterError(msg, parameter="label", value=label)
        return models, [plain(text) for text in texts]
    if len(models) == 1:
        return models, ["_model"]
    names = [model.name or "model" for model in models]
    return models, [plain(name if names.count(name) == 1 else f"{name} {k + 1}") for k, name in enumerate(names)]


def _prepared(ax: AxesLike, what: str) -> AxesArray:
    return prepared_axes(ax, (2, 1), f"{what} in rows", height=4.2, ratios=[1.4, 1.0])


def _require_scales(xscale: str, yscale: str) -> None:
    for parameter, scale in (("xscale", xscale), ("yscale", yscale)):
        if not is_choice(scale, SCALES):
            msg = f"{parameter} must be {' or '.join(SCALES)}, not {shown(scale)}."
            raise ParameterError(msg, parameter=parameter, value=scale)


def _ratio_unit(model: SecondOrderModel, units: Units, over: Sequence[str], under: Sequence[str]) -> str:
    """Return the unit of a ratio in brackets, if all DOFs that move together have the same."""
    known = known_units(model, units)
    found = {ratio_unit(above, below, known) for above in over for below in under}
    unit = found.pop()
    return f" [{unit}]" if unit and not found else ""


def _draw(
    axes: AxesArray, responses: Sequence[control.FrequencyResponseData], texts: Sequence[str], *, Hz: bool, dB: bool
) -> npt.NDArray[np.object_]:
    lines = no_lines(axes)
    for response, text in zip(responses, texts, strict=True):
        omega, values = np.asarray(response.omega, dtype=float), np.asarray(response.frdata)[0, 0]
        x = omega / (2.0 * np.pi) if Hz else omega
        lines[0, 0] += axes[0, 0].plot(x, _in_decibels(values) if dB else np.abs(values), label=text, linewidth=1.5)
        lines[1, 0] += axes[1, 0].plot(x, np.degrees(response_phase(response)[0, 0]), label=text, linewidth=1.5)
    return lines


def _decibels(unit: str) -> str:
    """Return the unit in brackets of a modulus in decibels."""
    return f" [dB re 1 {unit.strip(' []')}]" if unit.strip(" []-") else " [dB]"


def _in_decibels(values: npt.NDArray[np.complex128]) -> FloatArray:
    """Return the modulus in decibels, NaN where it is zero."""
    modulus = np.abs(values)
    return np.asarray(20.0 * np.log10(modulus, out=np.full(modulus.shape, np.nan), where=modulus > 0.0))


def _dress(axes: AxesArray, xscale: Scale, yscale: Scale | None, *, Hz: bool, grid: bool) -> None:
    """Set scales, ticks and grid of both axes; decibels have no scale to choose."""
    above, below = axes[:, 0]
    if yscale is not None:
        _set_magnitude(above, yscale)
    _set_angle(below)
    for ax in (above, below):
        if xscale == "linear" or (np.concatenate([line.get_xdata() for line in ax.get_lines()]) > 0.0).any():
            ax.set_xscale(xscale)
        if xscale == "linear":
            ax.margins(x=0.0)
    draw_grid([above, below], on=grid)
    below.set_xlabel("frequency [Hz]" if Hz else "frequency [rad/s]")
    above.figure.align_ylabels([above, below])


def _drawn(ax: Axes) -> FloatArray:
    """Return the ordinates of all curves that are finite."""
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.get_lines()])
    return np.asarray(values[np.isfinite(values)])


def _set_angle(ax: Axes) -> None:
    """Put ticks where angles are read, and show a constant angle as such."""
    angles = _drawn(ax)
    span = float(np.ptp(angles)) if angles.size else 0.0
    ax.yaxis.set_major_locator(MaxNLocator(nbins=5, steps=list(ANGLE_STEPS[span > WIDE_ANGLES])))
    if angles.size and span < CONSTANT_SPAN:
        ax.set_ylim(angles.mean() - 1.0, angles.mean() + 1.0)


def _set_magnitude(ax: Axes, scale: Scale) -> None:
    """Scale the modulus; undamped resonances leave the axis at the top and do not flatten the rest."""
    curve = _drawn(ax)
    curve = curve[curve > 0.0]
    if curve.size == 0:
        return
    ax.set_yscale(scale)
    least, usual = usual_sizes(ax, USUAL_WIDTH)
    if curve.max() - curve.min() <= CONSTANT_SPAN * curve.max():
        ax.set_ylim(curve.mean() / 2.0, curve.mean() * 2.0)
    elif curve.max() > STIFFNESS_SPIKE[scale] * usual:
        ax.set_ylim(top=ROOM_ABOVE[scale] * usual)
    if scale == "log" and curve.min() < least / STIFFNESS_SPIKE[scale]:
        ax.set_ylim(bottom=least / ROOM_ABOVE[scale])
    if scale == "linear" and ax.get_ylim()[0] < 0.0:
        ax.set_ylim(bottom=0.0)


def _title(models: Sequence[SecondOrderModel], text: str) -> str:
    names = {model.name for model in models}
    name = names.pop()
    return plain(f"{name}: {text}" if name and not names else text)
