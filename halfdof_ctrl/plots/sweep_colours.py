"""Colours of the cases of a sweep that a plot shows, by the value of a parameter."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

from halfdof_ctrl.base.doors import require_mapping, require_text, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.plots.axes import AxesArray
from halfdof_ctrl.plots.units import Units, plain, typeset
from halfdof_ctrl.sweeps.cases import Values, in_full, in_short
from halfdof_ctrl.sweeps.result import SweepResult

Colour: TypeAlias = tuple[float, float, float, float]
Numbers: TypeAlias = npt.NDArray[np.intp]

LIGHTEST = 0.9  #: part of viridis that is seen on white
MOST_NAMED_VALUES = 6  #: values that a legend names; more of them get a colour bar
WIDE_VALUES = 30.0  #: ratio of the largest value to the smallest from which colours follow the logarithm
FEWEST_LABEL_DIGITS, MOST_DIGITS = 4, 10  #: of a number in a legend
SAME_VALUE = 1e-9  #: relative difference of values that count as one
ONE_COLOUR: Colour = (0.12, 0.47, 0.71, 1.0)  #: where nothing was varied


@dataclass(frozen=True, slots=True, eq=False)
class CaseColours:
    """The cases that are drawn, each with its value of a parameter and its colour."""

    numbers: Numbers  #: of the cases, in the order of the arrays
    name: str  #: of the parameter, "" where nothing was varied
    values: Values  #: of the parameter
    colours: tuple[Colour, ...]
    scale: ScalarMappable | None  #: of the colour bar; without it a legend names the values

    def entry(self, place: int) -> str:
        """Write a value as it stands in a legend."""
        value = self.values[place]
        return plain(f"{self.name} = {_brief(value.item() if isinstance(value, np.generic) else value, self.values)}")

    def draw_bar(self, axes: AxesArray, units: Units) -> None:
        """Put a colour bar beside the axes, if the colours need one."""
        if self.scale is not None:
            unit = (units or {}).get(self.name)
            label = plain(self.name) + (f" [{typeset(unit)}]" if unit else "")
            axes[0, 0].figure.colorbar(self.scale, ax=list(axes.flat), label=label, aspect=30.0, pad=0.02)


def _brief(value: object, among: Values) -> str:
    """Write a value with as few digits as tell it from the others, and all of them where they are few."""
    text = in_short(value)
    if not isinstance(value, float) or float(text) == value:
        return text
    others = {other for other in _distinct(among) if isinstance(other, float)}
    for digits in range(FEWEST_LABEL_DIGITS, MOST_DIGITS):
        if len({f"{other:.{digits}g}" for other in others}) == len(others):
            return text if digits == FEWEST_LABEL_DIGITS else f"{value:.{digits}g}"
    return in_full(value)


def coloured_cases(result: SweepResult, parameter: str | None, at: Mapping[str, object] | None) -> CaseColours:
    """Choose the cases that are drawn, and their colours.

    Parameters
    ----------
    result : SweepResult
    parameter : str, optional
        Whose values are colours; by default the first that differs among the cases.
    at : mapping, optional
        Only cases with these values are drawn.

    Raises
    ------
    ParameterError
        A parameter or a value that the sweep does not have; no case that was done.
    """
    require_mapping({} if at is None else at, "at", "from parameters to values")
    require_text(parameter, "parameter")
    numbers = _kept(result, at or {})
    several = [name for name, values in result.parameters.items() if len(_distinct(values.reshape(-1)[numbers])) > 1]
    if parameter is not None:
        _require_parameter(result, parameter)
    elif several:
        parameter = several[0]
    if parameter is None:
        return CaseColours(numbers, "", np.zeros(numbers.size), (ONE_COLOUR,) * numbers.size, None)
    values = result.parameters[parameter].reshape(-1)[numbers]
    colours, scale = _coloured(values)
    return CaseColours(numbers, parameter, values, colours, scale)


def _kept(result: SweepResult, at: Mapping[str, object]) -> Numbers:
    """Return the numbers of the cases that were done and have the wanted values."""
    keep = np.ones(result.shape, dtype=bool)
    for name, value in at.items():
        _require_parameter(result, name)
        values = result.parameters[name]
        same = np.array([_are_same(one, value) for one in values.reshape(-1).tolist()]).reshape(result.shape)
        if not same.any():
            known = listed([in_full(known) for known in _distinct(values.reshape(-1))], most=12)
            msg = f"at: no case has {name} = {in_full(value)}. There are {known}."
            raise ParameterError(msg, parameter=name, value=value)
        keep &= same
    for failure in result.failures:
        if result.shape:
            keep[failure.case] = False
    if not keep.any():
        msg = "No case is left to draw: those with these values have all failed. See `failures` for the reasons."
        raise ParameterError(msg, parameter="at", value=dict(at))
    return np.flatnonzero(keep)


def _require_parameter(result: SweepResult, name: str) -> None:
    if name not in result.parameters:
        known = listed(list(result.parameters)) or "none"
        msg = f"The sweep varied no parameter {shown(name)}. It varied: {known}."
        raise ParameterError(msg, parameter=name, value=name)


def _coloured(values: Values) -> tuple[tuple[Colour, ...], ScalarMappable | None]:
    """Colour the values: by their place among a few, by their size among many."""
    distinct = _distinct(values)
    colourmap = _colourmap()
    if len(distinct) > MOST_NAMED_VALUES and values.dtype.kind in "iuf":
        low, high = float(values.min()), float(values.max())
        norm = LogNorm(low, high) if low > 0.0 and high > WIDE_VALUES * low else Normalize(low, high)
        scale = ScalarMappable(norm, colourmap)
        return tuple([tuple(colour) for colour in scale.to_rgba(values.astype(float)).tolist()]), scale
    places = [distinct.index(value) for value in values.tolist()]
    return tuple([colourmap(place / max(len(distinct) - 1, 1)) for place in places]), None


def _distinct(values: Values) -> list[Any]:
    """List the different values, numbers in order."""
    found: list[Any] = []
    for value in values.tolist():
        if value not in found:
            found.append(value)
    return sorted(found) if values.dtype.kind in "iuf" else found


def _are_same(first: object, second: object) -> bool:
    """Compare two values, numbers up to rounding."""
    if isinstance(first, int | float) and isinstance(second, int | float | np.integer | np.floating):
        return math.isclose(first, second, rel_tol=SAME_VALUE)
    return bool(first == second)


def _colourmap() -> LinearSegmentedColormap:
    """Return viridis without its lightest part."""
    whole = mpl.colormaps["viridis"]
    return LinearSegmentedColormap.from_list("viridis on white", whole(np.linspace(0.0, LIGHTEST, 256)))
