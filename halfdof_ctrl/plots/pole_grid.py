"""The s-plane behind a pole map: limits, logarithmic axes, and lines of equal damping and frequency.

python-control draws its grid only on axes that it makes itself. Here a line of equal damping ratio zeta is
s = r (-zeta + j sqrt(1 - zeta^2)) for all r, one of equal natural frequency s = r exp(j phi) for all phi, both drawn
as points, so that they are right on logarithmic axes too.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, SymmetricalLogLocator

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.plots.axes import size_in_inches

WIDE_PLANE = 1e3  #: ratio of the largest to the smallest |s| from which the axes are logarithmic
FAR_LINES = 20.0  #: times all others, those that swing among them: a point so far out gets logarithmic axes too
LOGARITHMIC_LABELS = (1e-3, 1e4)  #: numbers outside are written with a power of ten
DAMPING_RATIOS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95)
DISCRETE_RATIOS = (0.1, 0.2, 0.3, 0.5, 0.7, 0.9)
LABELS_APART = 0.13  #: distance between labels of lines, as part of the axes ...
LABEL_INCHES = 0.55  #: ... or across them, where they are small [in]
TICK_INCHES = (0.5, 0.35)  #: room of a number on the axes, across and up [in]
EDGE = 0.07  #: text centred nearer than this to the left edge would cross it
SAME_POLE = 1e-4  #: relative distance up to which poles count as multiple; rounding splits a triple one so far
FAR_OF_CIRCLE = 4.0  #: times its radius: points farther out would leave the unit circle no room
FAR_OUTSIDE = "halfdof_ctrl beyond"  #: gid of the text about points beyond the limits
GREY = "0.78"
BEHIND = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
GRID_TEXT: dict[str, Any] = {"fontsize": "x-small", "color": "0.4", "clip_on": True, "zorder": 1.5, "bbox": BEHIND}
CENTRED: dict[str, Any] = {"ha": "center", "va": "center"}


def set_pole_axes(ax: Axes, points: npt.NDArray[np.complexfloating], *, discrete: bool) -> None:
    """Set scales and limits that show all points, the origin (or unit circle), and some room.

    Points far out of the unit circle, as sampling makes zeros, are left out; `mark_beyond` says where they are.
    """
    if discrete:
        points = np.concatenate([points[np.abs(points) <= FAR_OF_CIRCLE], [-1.0, 1.0, 1.0j, -1.0j]])
    size = np.abs(points)
    largest = float(size.max(initial=0.0)) or 1.0
    smallest = float(size[size > 0.0].min(initial=largest))
    left, right = float(points.real.min(initial=0.0)), float(points.real.max(initial=0.0))
    height = float(np.abs(points.imag).max(initial=0.0))
    if not discrete and (largest > WIDE_PLANE * smallest or _is_squeezed(points)):
        linear = 10.0 ** np.floor(np.log10(smallest))
        across = min(8.0 * left, -10.0 * linear), max(8.0 * right, linear)
        top = max(8.0 * height, 10.0 * linear)
        room = [inches / least for inches, least in zip(size_in_inches(ax), TICK_INCHES, strict=True)]
        for axis, set_scale, most in ((ax.xaxis, ax.set_xscale, room[0]), (ax.yaxis, ax.set_yscale, room[1])):
            set_scale("symlog", linthresh=linear)
            axis.set_major_locator(_Decades(linear, most))
        ax.set_xlim(*across)
    else:
        width = max(right - left, 0.1 * height) or 1.0
        ax.set_xlim(min(left - 0.18 * width, -0.7 * width), right + 0.18 * width)
        top = 1.2 * max(height, 0.35 * width)
    ax.set_ylim(-top, top)


class _Decades(SymmetricalLogLocator):
    """Puts zero and powers of ten on a symmetric logarithmic axis, as many as have room, evenly from its ends."""

    def __init__(self, linear: float, most: float) -> None:
        super().__init__(base=10.0, linthresh=linear)
        self.linear, self.most = linear, max(most, 2.0)
        self.set_params(numticks=1000)

    def tick_values(self, vmin: float, vmax: float) -> Any:  # noqa: ANN401  # an array, where stubs have a list
        """Return the ticks between two limits."""
        every = np.asarray(super().tick_values(vmin, vmax))
        every = every[(every >= min(vmin, vmax)) & (every <= max(vmin, vmax))]
        from_zero = np.round(np.log10(np.maximum(np.abs(every) / self.linear, 0.1))) + 1.0  # in lengths of a decade
        decades = float(from_zero[every > 0.0].max(initial=1.0) + from_zero[every < 0.0].max(initial=1.0))
        step = float(max(np.ceil(decades / self.most), 1.0))
        kept = every == 0.0
        for side in (every > 0.0, every < 0.0):
            last = from_zero[side].max(initial=0.0)
            kept |= side & (np.mod(last - from_zero, step) == 0.0) & (from_zero >= step)
        return every[kept]


def _is_squeezed(points: npt.NDArray[np.complexfloating]) -> bool:
    """Tell whether a point far out would leave those that swing no room on linear axes."""
    swinging = np.abs(points[points.imag != 0.0])
    near = swinging[swinging * FAR_LINES < np.abs(points).max(initial=0.0)]
    return bool(near.size > 0)


def draw_pole_grid(ax: Axes) -> None:
    """Draw and label lines of equal damping ratio and of equal natural frequency within the limits."""
    across, up = max(np.abs(ax.get_xlim())), max(np.abs(ax.get_ylim()))
    reach = float(np.hypot(across, up))
    radii = np.geomspace(min(1e-12 * reach, 1e-3 * across, 1e-3 * up), reach, 900)  # a fast real pole leaves `up` small
    last = _axes_coordinates(ax, 1j * radii)[_inside(ax, 1j * radii)][-1]
    width, height = size_in_inches(ax)
    wide, high = LABEL_INCHES / width, 0.3 * LABEL_INCHES / height
    for zeta in DAMPING_RATIOS:
        ray = radii * complex(-zeta, np.sqrt(1.0 - zeta**2))
        inside = _axes_coordinates(ax, ray)[_inside(ax, ray)]
        end = inside[-1] if inside.size else last
        step = np.abs(end - last)
        if (
            np.hypot(*step) < LABELS_APART
            or not (step > (wide, high)).any()
            or np.hypot(*(end - (0.0, 0.5))) < LABELS_APART
        ):
            continue
        last = end
        _draw_mirrored(ax, ray)
        side = "left" if end[0] < 0.5 else "center"  # noqa: PLR2004
        ax.text(end[0] + 0.005, end[1] - 0.008, f"ζ = {zeta:g}", transform=ax.transAxes, ha=side, va="top", **GRID_TEXT)
    small = np.geomspace(1e-16, np.pi / 4.0, 250)
    angles = np.concatenate([np.pi / 2.0 + small, np.pi - small[::-1]])
    last = np.full(2, np.inf)
    for radius in _natural_frequencies(ax, reach):
        arc = radius * np.exp(1j * angles)
        path = _axes_coordinates(ax, arc.conj())[_inside(ax, arc)]
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        if length[-1] > LABELS_APART:
            _draw_mirrored(ax, arc)
            middle = path[np.searchsorted(length, 0.5 * length[-1])]
            step = np.abs(middle - last)
            if np.hypot(*step) > LABELS_APART and (step > (wide, high)).any() and middle[0] > max(EDGE, 0.5 * wide):
                ax.text(
                    middle[0], middle[1], f"{_number(radius)} rad/s", transform=ax.transAxes, **CENTRED, **GRID_TEXT
                )
                last = middle


def draw_discrete_grid(ax: Axes) -> None:
    """Draw and label lines of equal damping ratio and of equal natural frequency in the z-plane.

    z = exp(s dt) with s dt = r (-zeta + j sqrt(1 - zeta^2)), up to the Nyquist frequency.
    """
    for zeta in DISCRETE_RATIOS:
        top = np.pi / np.sqrt(1.0 - zeta**2)
        ray = np.exp(np.linspace(0.0, top, 300) * complex(-zeta, np.sqrt(1.0 - zeta**2)))
        _draw_mirrored(ax, ray)
        place = ray[np.searchsorted(np.linspace(0.0, top, 300), 0.42 * top)]
        ax.text(place.real, place.imag, f"{zeta:g}", **CENTRED, **GRID_TEXT)
    decay = np.linspace(0.0, 1.0, 200)
    for tenth in range(1, 11):
        angle = 0.1 * tenth * np.pi
        arc = np.exp(angle * (-decay + 1j * np.sqrt(1.0 - decay**2)))
        _draw_mirrored(ax, arc)
        if tenth % 2 == 0 and tenth < 10:  # noqa: PLR2004  # the last one lies on the real axis
            edge = 1.09 * arc[0]
            ax.text(edge.real, edge.imag, f"{0.1 * tenth:.1f}π/T", **CENTRED, **GRID_TEXT)


def mark_multiple(ax: Axes, points: npt.NDArray[np.complexfloating], colour: str) -> None:
    """Write the multiplicity beside points that coincide up to rounding; poles at the origin are exact zeros."""
    left = points
    while left.size:
        same = np.abs(left - left[0]) <= SAME_POLE * np.abs(left[0])
        if np.count_nonzero(same) > 1:
            ax.annotate(
                f"{np.count_nonzero(same)}x",
                (float(left[0].real), float(left[0].imag)),
                xytext=(6, 6),
                textcoords="offset points",
                fontsize="small",
                color=colour,
            )
        left = left[~same]


def mark_beyond(ax: Axes, points: npt.NDArray[np.complexfloating], what: str, colour: str) -> None:
    """Write the places of points to the left of the limits, or beyond others, at the edge."""
    beyond = sorted(points[~_inside(ax, points)].tolist(), key=abs)
    if beyond:
        places = listed([f"{value.real:.4g}" if value.imag == 0.0 else f"{value:.4g}" for value in beyond], most=4)
        place = 0.02, 0.02 + 0.06 * sum(text.get_gid() == FAR_OUTSIDE for text in ax.texts)
        text = ax.text(*place, f"{what} beyond: {places}", transform=ax.transAxes, color=colour, fontsize="small")
        text.set_gid(FAR_OUTSIDE)


def _natural_frequencies(ax: Axes, reach: float) -> FloatArray:
    """Choose round radii: decades on logarithmic axes, else equal steps."""
    if ax.get_xscale() == "symlog":
        linear = ax.xaxis.get_transform().linthresh  # type: ignore[attr-defined]
        return 10.0 ** np.arange(np.ceil(np.log10(linear)), np.log10(reach), 1.0)
    ticks = np.asarray(MaxNLocator(5).tick_values(0.0, reach))
    return ticks[ticks > 0.0]


def _number(value: float) -> str:
    r"""Write a number with its mantissa, large and small ones with a power of ten.

    >>> [_number(value) for value in (250.0, 8e4, 1e5)]
    ['250', '$8 \\times 10^{4}$', '$10^{5}$']
    """
    if LOGARITHMIC_LABELS[0] <= value < LOGARITHMIC_LABELS[1]:
        return f"{value:g}"
    mantissa, exponent = f"{value:.3e}".split("e")
    factor = f"{float(mantissa):g}"
    power = rf"10^{{{int(exponent)}}}"
    return f"${power}$" if factor == "1" else rf"${factor} \times {power}$"


def _draw_mirrored(ax: Axes, points: npt.NDArray[np.complexfloating]) -> None:
    for half in (points, points.conj()):
        ax.plot(half.real, half.imag, color=GREY, linewidth=0.7, zorder=0.6, label="_grid", scalex=False, scaley=False)


def _axes_coordinates(ax: Axes, points: npt.NDArray[np.complexfloating]) -> FloatArray:
    """Return where points of the s-plane are drawn, (0, 0) and (1, 1) being the corners of the axes."""
    return np.asarray((ax.transScale + ax.transLimits).transform(np.column_stack([points.real, points.imag])))


def _inside(ax: Axes, points: npt.NDArray[np.complexfloating]) -> npt.NDArray[np.bool_]:
    places = _axes_coordinates(ax, points)
    return np.asarray(((places >= 0.0) & (places <= 1.0)).all(axis=1))
