"""What every public function asks of its arguments: what was wanted, what was given, and what to do.

A wrong object is refused where it enters, since further in it ends in an error that names no argument.
"""

import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, TypeGuard, TypeVar

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import HalfdofError, ParameterError, WrongObjectError

Item = TypeVar("Item")

LARGEST = int(np.finfo(float).max)  #: a Python integer has no largest one
LONGEST_SHOWN = 60  #: characters of a wrong value in a message
OTHER_NAMES = {"control.statesp": "control", "control.xferfcn": "control", "control.frdata": "control"}
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")  #: of an object that has no text of its own; it tells nobody anything
NAMELESS = frozenset({"builtins", "numpy"})  #: modules whose types everybody knows without them


def described(value: object) -> str:
    """Say what an object is, for a message.

    >>> described(None), described([1]), described(float), described(1.5)
    ('None', 'a list', 'the class float', 'the number 1.5')
    """
    if value is None:
        return "None"
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, str):
        return f"the text {shown(value)}"
    if isinstance(value, int | float | complex | np.number) and not isinstance(value, bool):
        return f"the number {shown(value)}"
    kind = type(value)
    home = OTHER_NAMES.get(kind.__module__, kind.__module__.split(".")[0])
    name = kind.__name__ if home in NAMELESS else f"{home}.{kind.__name__}"
    return f"{'an' if name[0] in 'aeioAEIO' else 'a'} {name}"


def shown(value: object) -> str:
    """Write a value for a message, cut short; one that cannot be written, by its kind."""
    try:
        text = repr(value)
    except Exception:  # noqa: BLE001  # the object is the user's, and so is its __repr__
        return f"<{type(value).__name__}>"
    text = ADDRESS.sub("", text)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def wrong_object(taker: str, wanted: str, value: object, remedy: str = "", *, parameter: str) -> WrongObjectError:
    """Make the refusal of an object of another kind.

    Parameters
    ----------
    taker : str
        The function, or the argument, that takes it.
    wanted : str
        What it takes, in words.
    value : object
        What was given.
    remedy : str, optional
        What to do, a sentence.
    parameter : str
        Name of the argument.
    """
    msg = f"{taker} takes {wanted}; this is {described(value)}."
    return WrongObjectError(f"{msg} {remedy}" if remedy else msg, parameter=parameter, value=value)


def is_choice(value: object, choices: Collection[object]) -> bool:
    """Return whether a value is one of some texts; an array, which compares entry by entry, is not."""
    return isinstance(value, str) and value in choices


def is_real_number(value: object) -> bool:
    """Return whether a value is one real number that a float holds; neither text nor a truth value is."""
    if type(value) is float:  # the usual case at once
        return True
    if is_whole_number(value):
        return not isinstance(value, int) or abs(value) <= LARGEST
    return isinstance(value, float | np.floating)


def is_whole_number(value: object) -> TypeGuard[int]:
    """Return whether a value is a whole number; neither a truth value nor a span of time is, whatever their classes."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool | np.timedelta64)


def is_mapping(value: object) -> TypeGuard[Mapping[Any, Any]]:
    """Return whether a value maps names to something; a sparse matrix does not, whatever its class."""
    return isinstance(value, Mapping) and not hasattr(value, "nnz")


def require_mapping(value: object, parameter: str, meaning: str) -> None:
    """Refuse what is no mapping, or one that does not give what it holds.

    Raises
    ------
    WrongObjectError
        It is none.
    """
    try:
        sound = is_mapping(value) and list(value.items()) is not None
    except Exception:  # noqa: BLE001  # the object is the user's, and so is what it raises
        sound = False
    if not sound:
        raise wrong_object(parameter, f"a mapping {meaning}", value, parameter=parameter)


def require_texts(**given: object) -> None:
    """Refuse arguments that are neither text nor None, each by its name.

    Raises
    ------
    WrongObjectError
        One is neither.
    """
    for parameter, value in given.items():
        require_text(value, parameter)


def require_text(value: object, parameter: str) -> None:
    """Refuse what is neither text nor None.

    Raises
    ------
    WrongObjectError
        It is neither.
    """
    if value is not None and not isinstance(value, str):
        raise wrong_object(parameter, "text, or None", value, parameter=parameter)


def require_switches(**given: object) -> None:
    """Refuse arguments that are neither True nor False, each by its name.

    Raises
    ------
    WrongObjectError
        One is neither.
    """
    for parameter, value in given.items():
        require_switch(value, parameter)


def require_switch(value: object, parameter: str) -> None:
    """Refuse what is neither True nor False.

    Raises
    ------
    WrongObjectError
        It is neither.
    """
    if not isinstance(value, bool | np.bool_):
        raise wrong_object(parameter, "True or False", value, parameter=parameter)


def require_path(value: object, taker: str, *, parameter: str = "path", kind: str = "file") -> None:
    """Refuse what names no file, or folder.

    Raises
    ------
    WrongObjectError
        It is no text and no path.
    """
    try:
        text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    except Exception:  # noqa: BLE001  # the object is the user's, and so is what it raises
        text = None
    if not isinstance(text, str):
        raise wrong_object(taker, f"the path of a {kind}, a text or pathlib.Path", value, parameter=parameter)
    try:
        sound = b"\0" not in os.fsencode(text)
    except UnicodeEncodeError:
        sound = False
    if not sound:
        msg = f"{taker} is {shown(value)}, which holds characters that no file system takes. Take others."
        raise ParameterError(msg, parameter=parameter, value=value)


def answer_of(function: Callable[..., Any], *arguments: object, parameter: str, meaning: str) -> Any:  # noqa: ANN401
    """Call a function of the user's; what it raises becomes the cause of a refusal that says which function it is.

    Parameters
    ----------
    function : callable
    *arguments
        What it is called with.
    parameter : str
        Name of the argument by which it was given.
    meaning : str
        What it is a function of, and what it must give, in words.

    Raises
    ------
    ParameterError
        The function failed.
    """
    try:
        return function(*arguments)
    except HalfdofError:
        raise
    except Exception as cause:
        msg = f"{parameter} is called as {meaning}; this failed: {type(cause).__name__}: {cause}."
        raise ParameterError(msg, parameter=parameter, value=function) from cause


def items_of(value: Iterable[Item], taker: str, wanted: str, *, parameter: str) -> list[Item]:
    """List the items of a collection, or refuse what has none.

    Raises
    ------
    WrongObjectError
        It cannot be listed.
    """
    try:
        return list(value)
    except Exception as cause:
        raise wrong_object(taker, wanted, value, parameter=parameter) from cause


def real_numbers(value: Any, parameter: str, meaning: str) -> FloatArray:  # noqa: ANN401  # whatever the user gave
    """Read real numbers as an array of their own shape; NaN and Inf pass.

    Parameters
    ----------
    value : array_like
    parameter : str
        Name of the argument.
    meaning : str
        What it must be, in words.

    Raises
    ------
    ParameterError
        Text, ragged lists, complex numbers or other things that are no real numbers.
    """
    try:
        given = np.asarray(value)
        text = given.dtype == object and any(_is_no_number(entry) for entry in given.flat)
        numbers = given.astype(float) if given.dtype.kind in "biufO" and not text else None
    except Exception as cause:
        msg = f"{parameter} must be {meaning}, not {shown(value)}: {str(cause).rstrip('.')}."
        raise ParameterError(msg, parameter=parameter, value=value) from cause
    if numbers is None:
        msg = f"{parameter} must be {meaning}, not {shown(value)}."
        raise ParameterError(msg, parameter=parameter, value=value)
    return numbers


def _is_no_number(entry: object) -> bool:
    return entry is None or isinstance(entry, str | bytes)


def real_number(value: Any, parameter: str) -> float:  # noqa: ANN401  # whatever the user gave
    """Read one real number; NaN and Inf pass.

    Raises
    ------
    ParameterError
        It is none.
    """
    numbers = real_numbers(value, parameter, "a real number")
    if numbers.size != 1:
        msg = f"{parameter} must be a real number, not {shown(value)}."
        raise ParameterError(msg, parameter=parameter, value=value)
    return float(numbers.reshape(-1)[0])
