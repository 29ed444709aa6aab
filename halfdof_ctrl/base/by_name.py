"""Mappings from names of a model, in which whole numbers stand for names too."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from halfdof_ctrl.base.doors import is_whole_number, wrong_object
from halfdof_ctrl.base.names import LARGEST_NUMBER, MOST_LISTED, unknown_name_error

Value = TypeVar("Value")


def by_name(given: Mapping[Any, Value], known: Sequence[str], what: str) -> dict[str, Value]:
    """Read a mapping from names of a model; whole numbers are read as text.

    Raises
    ------
    SignalNameError
        A name that is not known.
    WrongObjectError
        A mapping that does not give what it holds.

    Examples
    --------
    >>> by_name({101: 2.0}, ("100", "101"), "DOF")
    {'101': 2.0}
    """
    try:
        items = list(given.items())
    except Exception as cause:
        raise wrong_object("This argument", f"a mapping from {what} to numbers", given, parameter=what) from cause
    among = known if len(items) <= MOST_LISTED else set(known)
    found: dict[str, Value] = {}
    for key, value in items:
        number = is_whole_number(key) and abs(key) <= LARGEST_NUMBER
        name = str(key) if isinstance(key, str) or number else None
        if name is None or name not in among:
            raise unknown_name_error(key if name is None else name, what, known)
        found[name] = value
    return found
