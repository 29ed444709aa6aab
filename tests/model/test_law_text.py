"""Laws and elements as text: parsed, never evaluated."""

import numpy as np
import pytest

from halfdof_ctrl import Damper, Force, Law, Spring, laws
from halfdof_ctrl.errors import HalfdofError, ParameterError
from halfdof_ctrl.model.law_text import element_from_text, elements_from_stored, law_from_text, stored_elements


@pytest.mark.parametrize(
    "law",
    [
        laws.quadratic(1e4, 30),
        laws.quadratic(1 / 3),
        laws.power(2, 0.5),
        laws.gap(1e5, 0.01, np.inf),
        laws.coulomb(5, 1e-3, 0.1),
        laws.bilinear(1, 3),
        laws.cubic(1e-300, 7),
        laws.table([-1, 0.1, 2], [-3, 0, 1 / 7], extend="linear"),
        laws.table([0, 1], [0, 1]),
    ],
    ids=repr,
)
def test_what_is_printed_is_read_back_exactly(law: Law) -> None:
    """``law_from_text(repr(law)) == law``, and elements likewise through their stored texts."""
    assert law_from_text(repr(law)) == law
    elements = (Damper("y2", law=law), Spring("a b", "c", law), Spring("y", law=0.1))
    assert elements_from_stored(stored_elements(elements)) == elements


@pytest.mark.parametrize(
    ("text", "element"),
    [
        ("damper y2 quadratic(1e4,30)", Damper("y2", law=laws.quadratic(1e4, 30))),
        ("spring y y2 gap(k=1e5, upper=0.01, lower=inf)", Spring("y", "y2", laws.gap(1e5, 0.01, np.inf))),
        ("spring 'a b' c 300", Spring("a b", "c", 300)),
        (
            "damper n101.1 table([0, 1], [0, 2], extend=linear)",
            Damper("n101.1", law=laws.table([0, 1], [0, 2], "linear")),
        ),
        ("damper y -3.5", Damper("y", law=-3.5)),
    ],
)
def test_the_command_line_reads_elements(text: str, element: Damper | Spring) -> None:
    """Kind, one or two DOFs, law."""
    assert element_from_text(text) == element


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("damper", r'An element is "spring" or "damper"'),
        ("mass y 3", r'An element is "spring" or "damper"'),
        ("damper a b c 3", r'An element is "spring" or "damper"'),
        ("damper y2 __import__('os')", r"There is no law '__import__'"),
        ("damper y2 quadratic(open('x'))", r"is no number"),
        ("damper y2 quadratic(1,2,3)", r"too many positional arguments. It is quadratic\(c2"),
        ("damper y2 quadratic()", r"missing a required argument: 'c2'"),
        ("damper y2 quadratic(1, c3=1)", r"unexpected keyword argument 'c3'"),
        ("damper y2 abc", r"'abc' is no number. A law is a number or one of quadratic"),
        ("damper y y 3", r"A damper from y to itself"),
    ],
)
def test_other_texts_are_refused(text: str, message: str) -> None:
    """With what an element looks like; nothing is run."""
    with pytest.raises(HalfdofError, match=message):
        element_from_text(text)


@pytest.mark.parametrize("text", ["x", "[1]", '["mass", "a", null, "3"]', '["damper", "a", null, 3]'])
def test_stored_texts_that_are_none_are_refused(text: str) -> None:
    """Whatever else stands in a file."""
    with pytest.raises(ParameterError, match=r"which is no element of this package"):
        elements_from_stored([text])


@pytest.mark.parametrize("element", [Force(np.sin, "a"), Damper("a", law=Law(np.sinh))])
def test_functions_are_not_kept(element: Force | Damper) -> None:
    """By the name of the function."""
    with pytest.raises(ParameterError, match=r"sin.* is a function of your own, and files keep names and numbers only"):
        stored_elements([element])
