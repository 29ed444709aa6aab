"""Springs, dampers and forces as plain data."""

import pickle

import numpy as np
import pytest

from halfdof_ctrl import Damper, Force, Law, Spring, laws
from halfdof_ctrl.errors import ParameterError, SignalNameError


@pytest.mark.parametrize(
    ("element", "text"),
    [
        (Spring("y", law=laws.gap(1e5, 0.01)), 'Spring("y", law=gap(1e5, 0.01))'),
        (Damper("y2", law=laws.quadratic(1e4, 30)), 'Damper("y2", law=quadratic(1e4, 30))'),
        (Spring("a", "b", 300), 'Spring("a", "b", law=300)'),
        (Damper("a", "b", Law(np.tanh)), 'Damper("a", "b", law=Law(tanh))'),
    ],
)
def test_elements_print_as_they_are_typed_and_are_values(element: Spring | Damper, text: str) -> None:
    """They equal their copies through pickle."""
    assert repr(element) == text
    assert pickle.loads(pickle.dumps(element)) == element  # noqa: S301  # made here


def test_a_number_is_a_linear_law() -> None:
    """Whatever kind of number it is."""
    assert Spring("a", law=np.float64(3)).is_linear
    assert Spring("a", law=3) == Spring("a", law=3.0)
    assert not Damper("a", law=laws.quadratic(1)).is_linear


def test_a_force_acts_on_what_it_declares_unless_told() -> None:
    """Displacements first, each DOF once."""
    assert Force(np.sin, "a", ("b", "a")).on == ("a", "b")
    assert Force(np.sin, "a", on="c").on == ("c",)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Spring("y", "y", 3), r"A spring from y to itself never stretches"),
        (lambda: Damper(3, law=3), r"The ends of a damper are DOFs by name"),  # type: ignore[arg-type]
        (lambda: Force(np.sin), r"on which DOFs it acts"),
        (lambda: Force(np.sin, ("a", "a")), r"stands more than once"),
    ],
)
def test_ends_that_are_none_are_refused(make: object, message: str) -> None:
    """By the kind of the element and the DOF."""
    with pytest.raises(SignalNameError, match=message):
        make()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Spring("y"), r"The spring between y and the ground needs a law or a finite number, not None"),
        (lambda: Damper("y", "z", np.tanh), r"Wrap a function as Law"),  # type: ignore[arg-type]
        (lambda: Damper("y", law=float("nan")), r"needs a law or a finite number, not nan"),
        (lambda: Force(3, "a"), r"The function of a Force must be callable"),  # type: ignore[arg-type]
        (lambda: Force(np.sin, "a", jacobian=3), r"The jacobian of a Force must be callable"),  # type: ignore[arg-type]
    ],
)
def test_laws_that_are_none_are_refused(make: object, message: str) -> None:
    """By the ends of the element."""
    with pytest.raises(ParameterError, match=message):
        make()  # type: ignore[operator]
