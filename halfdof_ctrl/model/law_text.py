"""Laws and elements as text, for files and the command line: parsed by a small grammar, never evaluated.

    law      = name "(" [value {"," value}] ")" | number
    value    = [name "="] (number | "[" numbers "]" | "linear")
    element  = ("spring" | "damper") a [b] law

Names of laws are those of `halfdof_ctrl.laws`; anything else is refused, so nothing in a text can run.
"""

import inspect
import json
import re
import shlex
from collections.abc import Sequence
from typing import Any

from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.model.elements import Damper, Element, Force, Spring
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.model.laws import BUILT_IN_LAWS, as_typed

ELEMENT_KINDS: dict[str, type[Spring | Damper]] = {"spring": Spring, "damper": Damper}
CALL = re.compile(r"\s*([A-Za-z_]\w*)\s*\((.*)\)\s*", re.DOTALL)
ELEMENT = re.compile(r"\s*(\w+)\s+(.+?)\s+([A-Za-z_]\w*\s*\(.*\)|[-+.\w]+)\s*", re.DOTALL)
LAW_PARTS = 4  #: of a stored element: kind, a, b, law
MOST_ENDS = 2  #: DOFs of an element


def law_from_text(text: str) -> Law | float:
    """Read a law as it is typed.

    Raises
    ------
    ParameterError
        The text is no number and no call of a built-in law with numbers.

    Examples
    --------
    >>> law_from_text("quadratic(1e4,30)")
    quadratic(1e4, 30)
    """
    call = CALL.fullmatch(text)
    if call is None:
        return _number(text, text)
    name, inside = call.groups()
    if name not in BUILT_IN_LAWS:
        msg = f"There is no law {name!r}. Known: {', '.join(BUILT_IN_LAWS)}."
        raise ParameterError(msg, parameter="law", value=text)
    given: list[Any] = []
    named: dict[str, Any] = {}
    for part in _split(inside):
        key, equals, value = part.rpartition("=")
        if equals:
            named[key.strip()] = _value(value, text)
        else:
            given.append(_value(part, text))
    try:
        inspect.signature(BUILT_IN_LAWS[name]).bind(*given, **named)
    except TypeError as cause:
        msg = f"{text}: {cause}. It is {name}{inspect.signature(BUILT_IN_LAWS[name])}.".replace(
            " -> halfdof_ctrl.model.law.Law", ""
        )
        raise ParameterError(msg, parameter="law", value=text) from cause
    return BUILT_IN_LAWS[name](*given, **named)


def element_from_text(text: str) -> Spring | Damper:
    """Read an element as the command line takes it: kind, one or two DOFs, law.

    Raises
    ------
    ParameterError
        Another kind, no or more than two DOFs, or no law.
    SignalNameError
        Both ends are the same.

    Examples
    --------
    >>> element_from_text("damper y y2 quadratic(1e4,30)")
    Damper("y", "y2", law=quadratic(1e4, 30))
    """
    found = ELEMENT.fullmatch(text)
    ends = _ends(found.group(2)) if found else []
    if found is None or found.group(1) not in ELEMENT_KINDS or not 1 <= len(ends) <= MOST_ENDS:
        usual = '"spring" or "damper", one or two DOFs and a law, as in "damper y2 quadratic(1e4,30)"'
        msg = f"An element is {usual}, not {text!r}."
        raise ParameterError(msg, parameter="element", value=text)
    return ELEMENT_KINDS[found.group(1)](
        ends[0], ends[1] if len(ends) == MOST_ENDS else None, law_from_text(found.group(3))
    )


def stored_elements(elements: Sequence[Element]) -> tuple[str, ...]:
    """Write elements as texts that `elements_from_stored` reads back exactly.

    Raises
    ------
    ParameterError
        A `Force` or a law of the user's: a function cannot be kept in a file, of which nothing is executed.
    """
    texts = []
    for element in elements:
        if isinstance(element, Force):
            what = f"Force({element.name})"
        elif isinstance(element.law, Law) and element.law.written is None:
            what = f"the law {element.law.name} of {element!r}"
        else:
            law = repr(element.law) if isinstance(element.law, Law) else as_typed(element.law)
            texts.append(json.dumps([type(element).__name__.lower(), element.a, element.b, law]))
            continue
        msg = (
            f"{what} is a function of your own, and files keep names and numbers only: nothing in a file is executed. "
            "Save the linear model, and add the element after loading."
        )
        raise ParameterError(msg, parameter="elements", value=element)
    return tuple(texts)


def elements_from_stored(texts: Sequence[str]) -> tuple[Spring | Damper, ...]:
    """Read elements from the texts of `stored_elements`.

    Raises
    ------
    ParameterError
        A text that is none of these.
    """
    elements = []
    for text in texts:
        try:
            parts = json.loads(text)
        except ValueError:
            parts = None
        if not (
            isinstance(parts, list)
            and len(parts) == LAW_PARTS
            and parts[0] in ELEMENT_KINDS
            and isinstance(parts[3], str)
        ):
            msg = f"elements holds {text!r}, which is no element of this package."
            raise ParameterError(msg, parameter="elements", value=text)
        elements.append(ELEMENT_KINDS[parts[0]](parts[1], parts[2], law_from_text(parts[3])))
    return tuple(elements)


def _ends(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:
        return []


def _split(inside: str) -> list[str]:
    """Split at the commas outside brackets."""
    parts, depth, part = [], 0, ""
    for letter in inside:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += letter
    return [*parts, part] if part.strip() or parts else []


def _value(text: str, whole: str) -> Any:  # noqa: ANN401  # a number, a list of numbers or a word
    text = text.strip()
    if text.startswith("[") and text.endswith("]"):
        return [_number(part, whole) for part in _split(text[1:-1])]
    if text.strip("\"'") == "linear":
        return "linear"
    return _number(text, whole)


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError as cause:
        laws = ", ".join(BUILT_IN_LAWS)
        msg = f"{whole!r}: {text.strip()!r} is no number. A law is a number or one of {laws} with numbers."
        raise ParameterError(msg, parameter="law", value=whole) from cause
