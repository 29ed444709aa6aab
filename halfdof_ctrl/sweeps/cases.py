"""The cases of a sweep: what was asked for as a grid, a list or a sample, in one form.

| asked for | axes | cases |
|---|---|---|
| ``{"a": [1, 2], "b": [3, 4, 5]}`` | a, b | the 2 x 3 grid |
| the same mapping with sequences of one length, paired | case | first with first, second with second, ... |
| ``[{"a": 1, "b": 3}, {"a": 2, "b": 5}]`` | case | the entries |
| None | none | a single one |
"""

import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Number
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.doors import is_mapping, shown
from halfdof_ctrl.base.errors import ParameterError

Values: TypeAlias = npt.NDArray[Any]  #: numbers, or objects where the values are something else
Parameters: TypeAlias = Mapping[str, object] | Sequence[Mapping[str, object]] | None

CASE = "case"  #: name of the axis of a list or sample

CASES_SHORT = 7  #: characters of a number that is written as it is
FOUR_DIGITS, TEN_DIGITS = 1e4, 1e10  #: sizes between which four digits would need a power of ten


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Cases:
    """The cases of a sweep in the order of its axes, the last one running fastest."""

    axes: dict[str, Values]  #: values along each axis, 1D, by the name of the parameter
    parameters: dict[str, Values]  #: value of each parameter that varies, at each case: arrays of shape `shape`
    fixed: dict[str, object]  #: parameters that are the same for all cases

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes."""
        return tuple([len(values) for values in self.axes.values()])

    def __len__(self) -> int:
        """Count the cases."""
        return math.prod(self.shape)

    def varied(self, number: int) -> dict[str, object]:
        """Return the parameters of a case that are not the same for all."""
        place = np.unravel_index(number, self.shape)
        return {name: _plain(values[place]) for name, values in self.parameters.items()}

    def arguments(self, number: int) -> dict[str, object]:
        """Return all parameters of a case."""
        return self.fixed | self.varied(number)


def listed_cases(parameters: Parameters, *, paired: bool = False) -> Cases:
    """Read the parameters of a sweep.

    Parameters
    ----------
    parameters : mapping, sequence of mappings, or None
        As in `sweep`.
    paired : bool
        Take the sequences of a mapping together instead of as axes of a grid.

    Raises
    ------
    ParameterError
        No values, values without an order, sequences of different length that were to be paired, cases with different
        parameters.

    Examples
    --------
    >>> cases = listed_cases({"a": [1, 2], "b": [3.0, 4.0, 5.0], "c": 7})
    >>> cases.shape, cases.arguments(4)
    ((2, 3), {'c': 7, 'a': 2, 'b': 4.0})
    """
    if parameters is None:
        return Cases(axes={}, parameters={}, fixed={})
    if is_mapping(parameters):
        _require_names(parameters)
        fixed = {name: value for name, value in parameters.items() if _is_single(value)}
        varied = {name: _as_values(name, value) for name, value in parameters.items() if name not in fixed}
        return _sample(varied, fixed) if paired else _grid(varied, fixed)
    return _sample(_columns(parameters), {})


def require_accepted(function: Callable[..., object], cases: Cases) -> None:
    """Refuse parameters that the function does not take, before any case is run.

    Raises
    ------
    ParameterError
        A parameter that the function does not know, or one that it needs and that is not there.
    """
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # some functions of compiled modules do not tell
        return
    given = dict.fromkeys((*cases.fixed, *cases.parameters))
    try:
        signature.bind(**given)
    except TypeError as cause:
        known = signature.parameters
        wrong = [name for name in given if name not in known] or [name for name in known if name not in given]
        msg = f"{name_of(function)} cannot be called with these parameters: {cause}. It takes {', '.join(known)}."
        raise ParameterError(msg, parameter=wrong[0] if wrong else "parameters", value=tuple(given)) from cause


def name_of(function: object) -> str:
    """Return the name of a function as messages write it."""
    return str(getattr(function, "__qualname__", None) or type(function).__name__)


def in_words(parameters: Mapping[str, object]) -> str:
    """Write the parameters of a case.

    >>> in_words({"C_h": 300.0, "kind": "soft"})
    'C_h = 300, kind = soft'
    """
    return ", ".join(f"{name} = {in_short(value)}" for name, value in parameters.items())


def in_short(value: object) -> str:
    """Write a value, a number in full where that is short or before the point, else with four digits.

    >>> in_short(150001.0), in_short(0.125), in_short(1 / 3)
    ('150001', '0.125', '0.3333')
    """
    if not isinstance(value, float):
        return str(value)
    text = in_full(value)
    return text if len(text) <= CASES_SHORT or FOUR_DIGITS <= abs(value) < TEN_DIGITS else f"{value:.4g}"


def in_full(value: object) -> str:
    """Write a value with the digits that tell it from others."""
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _grid(varied: dict[str, Values], fixed: dict[str, object]) -> Cases:
    """Combine every value of each parameter with every value of the others."""
    arrays = np.meshgrid(*varied.values(), indexing="ij")
    return Cases(axes=varied, parameters=dict(zip(varied, map(_frozen, arrays), strict=True)), fixed=fixed)


def _sample(varied: dict[str, Values], fixed: dict[str, object]) -> Cases:
    """Take the first values of all parameters together, then the second, and so on."""
    lengths = {name: len(values) for name, values in varied.items()}
    if len(set(lengths.values())) != 1:
        found = ", ".join(f"{name} has {length}" for name, length in lengths.items()) or "there is none"
        msg = (
            f"Paired parameters need one value a case each, so lists of one length, but {found}. Complete the shorter, "
            "or leave paired out for the grid of all combinations."
        )
        raise ParameterError(msg, parameter="parameters", value=lengths)
    return Cases(axes={CASE: _frozen(np.arange(next(iter(lengths.values()))))}, parameters=varied, fixed=fixed)


def _columns(parameters: Iterable[object]) -> dict[str, Values]:
    """Turn a list of cases into a list of values for each parameter."""
    try:
        rows = [] if isinstance(parameters, str | np.ndarray) else list(parameters)
    except Exception:  # noqa: BLE001  # no collection, or one that fails
        rows = []
    if not rows or not all(is_mapping(row) for row in rows):
        msg = (
            "parameters must be a mapping from names to lists of values, or a list of mappings with one value for each "
            f"name, not {type(parameters).__name__}. A pandas table gives the latter by to_dict('records')."
        )
        raise ParameterError(msg, parameter="parameters", value=parameters)
    names: Mapping[str, object] = rows[0]  # type: ignore[assignment]
    _require_names(names)
    for number, row in enumerate(rows):
        different = sorted(map(str, set(row) ^ set(names)))  # type: ignore[call-overload]
        if different:
            msg = f"Cases 0 and {number} must have the same parameters, but only one has {', '.join(different)}."
            raise ParameterError(msg, parameter=different[0], value=number)
    return {name: _as_values(name, [row[name] for row in rows]) for name in names}  # type: ignore[index]


def _require_names(names: Mapping[str, object]) -> None:
    for name in names:
        if not (isinstance(name, str) and name.isidentifier()):
            msg = f"{shown(name)} cannot be a parameter: parameters are named as in Python, such as C_h."
            raise ParameterError(msg, parameter=str(name), value=name)


def _is_single(value: object) -> bool:
    """Tell a value that all cases share from a list of values."""
    if isinstance(value, np.ndarray):
        return value.ndim == 0
    return isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable)


def _as_values(name: str, given: object) -> Values:
    """Make a 1D array of values: of numbers where all are, else of objects."""
    if isinstance(given, set | frozenset):
        msg = f"The values of {name} were given as a set, which has no order. Give a list."
        raise ParameterError(msg, parameter=name, value=given)
    values = list(given)  # type: ignore[call-overload]
    if not values:
        msg = f"{name} has no values, so there is no case to compute. Give at least one."
        raise ParameterError(msg, parameter=name, value=given)
    if all(isinstance(value, Number | np.number) and not isinstance(value, bool) for value in values):
        return _frozen(np.array(values))
    array = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):  # an assignment as a whole would look into values that are lists
        array[place] = value
    return _frozen(array)


def _plain(value: object) -> object:
    """Return a Python number for a NumPy one."""
    return value.item() if isinstance(value, np.generic) else value


def _frozen(values: Values) -> Values:
    values.flags.writeable = False
    return values
