"""The Bode diagram: a curve from the state space, markers from the descriptor form."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import control
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY, ComplexArray, FloatArray
from halfdof_ctrl.base.doors import require_switches, require_texts
from halfdof_ctrl.base.errors import (
    NoStateSpaceError,
    ParameterError,
    RecordedWarning,
    give_first_of_each_kind,
    recording_warnings,
)
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.plots.axes import (
    CIRCLE,
    USUAL_WIDTH,
    AxesArray,
    AxesLike,
    draw_grid,
    finished_plot,
    label_y,
    legend_prefix,
    no_lines,
    prepared_axes,
    require_system,
    usual_sizes,
)
from halfdof_ctrl.plots.units import Units, known_units, plain, ratio_label, signal_names
from halfdof_ctrl.systems.frequency import (
    descriptor_response,
    frequency_response,
    has_many_states,
)
from halfdof_ctrl.systems.phase import response_phase
from halfdof_ctrl.systems.sampled_phase import on_branch
from halfdof_ctrl.systems.state_space import system_of_model

MARKS = 19  #: markers spread over the frequencies
PEAK_MARKS = 6  #: markers on the highest peaks besides
ONE_MARKER = 0.05  #: relative distance between frequencies below which one marker does for two peaks
PHASE_STEPS = (15.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0, 1440.0)  #: [deg] between ticks
MOST_PHASE_STEPS = 4
FLAT_RATIO = 1.0 + 1e-6  #: a curve with a smaller ratio of its ends is constant ...
FLAT_ROOM = 5.0  #: ... and gets this factor above and below
RESONANCE_SPIKE = 1e5  #: a peak higher than this times that range is cut


@dataclass(frozen=True, slots=True)
class Scales:
    """What the axes are measured in."""

    dB: bool
    Hz: bool
    deg: bool

    def frequency(self, omega: FloatArray) -> FloatArray:
        """Return frequencies as they are drawn."""
        return omega / (2.0 * np.pi) if self.Hz else omega

    def magnitude(self, values: ComplexArray) -> FloatArray:
        """Return magnitudes as they are drawn."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(np.abs(values)) if self.dB else np.abs(values))

    def phase(self, angle: FloatArray) -> FloatArray:
        """Return an angle [rad] as it is drawn."""
        return np.degrees(angle) if self.deg else angle


def bode_plot(
    sysdata: control.StateSpace | SecondOrderModel,
    omega: npt.ArrayLike | None = None,
    *,
    reference: SecondOrderModel | None = None,
    ax: AxesLike = None,
    dB: bool = False,
    Hz: bool = False,
    deg: bool = True,
    grid: bool = True,
    title: str | None = None,
    label: str | None = None,
    units: Units = None,
) -> control.ControlPlot:
    """Draw the Bode diagram of a state space, and the descriptor form as markers on it.

    Parameters
    ----------
    sysdata : control.StateSpace or SecondOrderModel
        The curve is `frequency_response` of it, for a model in the states that keep most digits. Where a
        model has no state space (complex, improper, order uncertain, more than 1000 states of a sparse model) the curve
        is its descriptor form, and the legend says so.
    omega : (k,) array_like, optional
        Frequencies [rad/s], the very points (two are two points, not limits); also with `Hz`. By default a
        grid around the poles.
    reference : SecondOrderModel, optional
        Model whose descriptor form gives the markers, by default `sysdata` if that is a model, but not a sparse one
        with more than 2000 DOFs, where each marker takes its time.
    ax : (2 p, m) array_like of Axes, optional
        Magnitude and phase of each of p outputs in rows, m inputs in columns; (2,) for one input and output.
    dB : bool
        Magnitude in dB instead of on a logarithmic scale.
    Hz : bool
        Frequency axis in Hz instead of rad/s.
    deg : bool
        Phase in degrees instead of rad.
    grid : bool
        Draw grid lines.
    title : str, optional
        Above the figure, by default the name of the system; or above the first of the given axes.
    label : str, optional
        Stands before the entries of the legend, to tell systems on the same axes apart.
    units : mapping from signal to unit, optional
        Where they are not m, m/s, m/s^2 and N: ``{"phi": "rad"}``, also for the velocity, acceleration
        and moment of that DOF. Signals that are no motions or forces of the model's DOFs have no unit without it.

    Returns
    -------
    control.ControlPlot
        ``lines`` has the shape of the axes: in each entry the curve and, if there are any, the markers.

    Raises
    ------
    ParameterError
        Axes of the wrong shape, a reference of another size, something that is neither system nor model.
    SignalNameError
        A unit for an unknown signal.
    SingularPencilError
        ``det P(s)`` of the model vanishes identically.

    Notes
    -----
    The phase is on the branch that poles and zeros of the model give, on any grid: across an undamped pole it falls
    and across an undamped zero it rises, as with vanishing damping. See `systems.phase`.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> cplt = bode_plot(hydromount().select(inputs="F_y", outputs="y"), Hz=True)
    >>> cplt.axes[0, 0].get_ylabel(), cplt.axes[1, 0].get_xlabel()
    ('|y/F_y| [m/N]', 'frequency [Hz]')
    >>> plt.close(cplt.figure)
    """
    require_texts(title=title, label=label)
    require_switches(dB=dB, Hz=Hz, deg=deg, grid=grid)
    with recording_warnings() as of_curve:
        curve, kind, reference = _curve(sysdata, omega, reference)
    named = sysdata if reference is None else reference
    known = known_units(named, units)
    p, m = curve.noutputs, curve.ninputs
    what = f"magnitude and phase of {p} outputs in rows, {m} inputs in columns"
    axes = prepared_axes(ax, (2 * p, m), what, height=4.2 if p == 1 else 1.0 + 3.0 * p, ratios=[1.4, 1.0] * p)
    lines, scales, prefix = no_lines(axes), Scales(dB, Hz, deg), legend_prefix(label)
    values, marks, phases = np.asarray(curve.frdata), _marked(curve), response_phase(curve)
    exact, of_marks = _exact(reference, curve.omega[marks])
    give_first_of_each_kind([*of_curve, *of_marks])
    for i, j in product(range(p), range(m)):
        above, below = axes[2 * i, j], axes[2 * i + 1, j]
        phase = phases[i, j]
        x = scales.frequency(curve.omega)
        style: dict[str, Any] = {"label": prefix + kind, "linewidth": 1.5}
        lines[2 * i, j] += above.plot(x, scales.magnitude(values[i, j]), **style)
        lines[2 * i + 1, j] += below.plot(x, scales.phase(phase), **style)
        if exact is not None:
            style = {"label": prefix + "descriptor form", "markersize": 5.0, **CIRCLE}
            lines[2 * i, j] += above.plot(x[marks], scales.magnitude(exact[i, j]), **style)
            lines[2 * i + 1, j] += below.plot(x[marks], scales.phase(on_branch(exact[i, j], phase, marks)), **style)
    dress_bode(axes, curve, sysdata, known, scales, grid=grid)
    return finished_plot(lines, axes, title, sysdata, own=ax is None)


def _exact(
    reference: SecondOrderModel | None, omega: FloatArray
) -> tuple[npt.NDArray[Any] | None, list[RecordedWarning]]:
    """Return what the descriptor form says at the marks, if there are any, and what it warns of."""
    with recording_warnings() as told:
        if reference is None or omega.size == 0:
            return None, told
        return np.asarray(descriptor_response(reference, omega).frdata), told


def _curve(
    sysdata: control.StateSpace | SecondOrderModel, omega: npt.ArrayLike | None, reference: SecondOrderModel | None
) -> tuple[control.FrequencyResponseData, str, SecondOrderModel | None]:
    """Return the curve, what it is, and the model that the markers come from."""
    require_system(sysdata)
    if isinstance(sysdata, SecondOrderModel):
        if has_many_states(sysdata):
            return descriptor_response(sysdata, omega), "descriptor form", reference
        try:
            system_of_model(sysdata)
        except NoStateSpaceError as refusal:
            kind = f"descriptor form (no state space: {refusal.why})"
            return descriptor_response(sysdata, omega), kind, reference
        curve = frequency_response(sysdata, omega)
        if reference is None and not (sysdata.is_sparse and len(sysdata.dofs) > LARGEST_DENSE_COPY):
            reference = sysdata
    else:
        curve = frequency_response(sysdata, omega)
    if reference is not None:
        size = (curve.noutputs, curve.ninputs)
        if not isinstance(reference, SecondOrderModel) or reference.D.shape != size:
            msg = (
                f"reference must be a SecondOrderModel with {size[0]} outputs and {size[1]} inputs, as the system has."
            )
            raise ParameterError(msg, parameter="reference", value=reference)
        require_regular(reference)
    return curve, "state space", reference


def _marked(curve: control.FrequencyResponseData) -> npt.NDArray[np.intp]:
    """Choose frequencies for markers: spread evenly on the logarithmic axis, and the highest peaks."""
    omega = np.asarray(curve.omega, dtype=float)
    size = np.abs(np.asarray(curve.frdata)).reshape(-1, omega.size)
    usable = np.flatnonzero((omega > 0.0) & np.isfinite(size).all(axis=0))
    if usable.size <= MARKS:
        return np.asarray(usable)
    frequencies, size = np.log(omega[usable]), size[:, usable]
    wanted = np.linspace(frequencies[0], frequencies[-1], MARKS)
    spread = np.abs(frequencies[:, None] - wanted).argmin(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        size = size / size.max(axis=1, keepdims=True)
    inner = size[:, 1:-1]
    peaks = np.where((inner > size[:, :-2]) & (inner > size[:, 2:]), inner, 0.0).max(axis=0)
    highest: list[int] = []
    for k in (1 + np.argsort(-peaks, kind="stable")[: np.count_nonzero(peaks)]).tolist():
        apart = all(abs(frequencies[k] - frequencies[other]) > ONE_MARKER for other in highest)
        if apart and len(highest) < PEAK_MARKS:
            highest.append(k)
    return np.asarray(usable[np.union1d(spread, np.array(highest, dtype=np.intp))])


def dress_bode(
    axes: AxesArray,
    curve: control.FrequencyResponseData,
    system: control.StateSpace | SecondOrderModel,
    units: dict[str, str],
    scales: Scales,
    *,
    grid: bool,
) -> None:
    """Set scales, labels, ticks and grid of all axes."""
    outputs, inputs = signal_names(system)
    for i, j in product(range(len(outputs)), range(len(inputs))):
        above, below = axes[2 * i, j], axes[2 * i + 1, j]
        if (np.asarray(curve.omega) > 0.0).any():
            above.set_xscale("log")
            below.set_xscale("log")
        label_y(above, ratio_label(outputs[i], inputs[j], units, dB=scales.dB, newline=axes.size > 2))  # noqa: PLR2004
        below.set_ylabel("phase [deg]" if scales.deg else "phase [rad]")
        if scales.deg:
            _set_phase_ticks(below)
        if not np.asarray(curve.frdata)[i, j].any():
            above.text(0.5, 0.75, f"{plain(outputs[i])} does not respond", transform=above.transAxes, ha="center")
        elif not scales.dB:
            _set_logarithmic(above)
        draw_grid([above, below], on=grid)
    for ax in axes[-1]:
        ax.set_xlabel("frequency [Hz]" if scales.Hz else "frequency [rad/s]")
    axes[0, 0].figure.align_ylabels(list(axes.flat))


def _set_logarithmic(ax: Axes) -> None:
    """Make the magnitude's axis logarithmic; undamped peaks and notches leave it and do not flatten the rest."""
    curve = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.get_lines()])
    curve = curve[np.isfinite(curve) & (curve > 0.0)]
    if curve.size == 0:
        return
    if curve.max() <= FLAT_RATIO * curve.min():
        ax.set_ylim(curve.min() / FLAT_ROOM, curve.max() * FLAT_ROOM)
    ax.set_yscale("log")
    least, most = usual_sizes(ax, USUAL_WIDTH)
    if curve.max() > RESONANCE_SPIKE * most:
        ax.set_ylim(top=np.sqrt(RESONANCE_SPIKE) * most)
    if curve.min() < least / RESONANCE_SPIKE:
        ax.set_ylim(bottom=least / np.sqrt(RESONANCE_SPIKE))


def _set_phase_ticks(ax: Axes) -> None:
    """Put ticks at multiples of 15, 30, 45, 90 ... degrees."""
    low, high = ax.dataLim.intervaly
    span = high - low if np.isfinite(high - low) else 0.0
    step = next((step for step in PHASE_STEPS if span <= MOST_PHASE_STEPS * step), PHASE_STEPS[-1])
    ax.yaxis.set_major_locator(MultipleLocator(step))
