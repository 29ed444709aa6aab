"""Names of DOFs and signals: unique, reversible, and refused where they would mislead."""

import control
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from halfdof_ctrl.base.errors import SignalNameError
from halfdof_ctrl.base.names import (
    checked_dofs,
    checked_names,
    control_label,
    force_names,
    listed,
    motion_names,
    motions,
    name_from_label,
    unknown_name_error,
)
from halfdof_ctrl.base.printable import printable


@given(name=st.text(max_size=20))
@example(name="101.1")
@example(name="a:b")
@example(name="%3A")
@example(name="%253A.%25")
@example(name=":.%:%.")
def test_label_mapping_is_reversible(name: str) -> None:
    """`name_from_label` is the exact inverse of `control_label`, for any text."""
    assert name_from_label(control_label(name)) == name


@given(name=st.text(st.characters(categories=["L", "N", "P", "S"]), min_size=1, max_size=20))
def test_label_is_accepted_by_python_control(name: str) -> None:
    """A state space takes the label as it is."""
    label = control_label(name)
    assert "." not in label
    assert control.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], outputs=[label]).output_labels == [label]


@given(names=st.lists(st.text(alphabet=".:%3A25", max_size=6), unique=True, max_size=6))
def test_different_names_get_different_labels(names: list[str]) -> None:
    """The mapping is injective, so no two signals merge."""
    assert len({control_label(name) for name in names}) == len(names)


def test_names_of_motions_and_forces_follow_the_dofs() -> None:
    """y, y_dot, y_ddot and F_y."""
    assert motion_names(("y",), 0) == ("y",)
    assert motion_names(("y", "z"), 1) == ("y_dot", "z_dot")
    assert motion_names(("y",), 2) == ("y_ddot",)
    assert force_names(("y", "z")) == ("F_y", "F_z")
    assert motions(("y",)) == {"y": (0, 0), "y_dot": (0, 1), "y_ddot": (0, 2)}


def test_long_lists_are_cut_in_messages() -> None:
    """Eight names, then how many more."""
    assert listed(["a", "b"]) == "a, b"
    assert listed([str(i) for i in range(11)]) == "0, 1, 2, 3, 4, 5, 6, 7 and 3 more"


def test_single_name_may_stand_for_a_list() -> None:
    """A string is one name, not its letters."""
    assert checked_names("abc", 1, "inputs") == ("abc",)


@pytest.mark.parametrize("given_names", [(), ("a",), ("a", "b", "c"), "ab"])
def test_wrong_count_of_names_is_refused(given_names: tuple[str, ...] | str) -> None:
    """As many names as signals."""
    with pytest.raises(SignalNameError, match=r"names were given for 2 inputs: .*Name each one"):
        checked_names(given_names, 2, "inputs")


@pytest.mark.parametrize("bad", ["", " a", "a ", "\n", 3.0, True, None, b"a", ("a",)])
def test_things_that_are_no_names_are_refused(bad: object) -> None:
    """Non-empty text without blanks at its ends."""
    with pytest.raises(SignalNameError, match="Names of inputs must be non-empty text without blanks at the ends"):
        checked_names(["good", bad], 2, "inputs")  # type: ignore[list-item]


def test_duplicates_are_refused_by_name() -> None:
    """python-control would merge them silently."""
    with pytest.raises(SignalNameError, match="Names of inputs must differ, but b stands more than once") as refusal:
        checked_names(["a", "b", "b", "b"], 4, "inputs")
    assert refusal.value.names == ("b",)


@pytest.mark.parametrize("dofs", [("y", "y_dot"), ("y_ddot", "y"), ("a", "a_dot", "b"), ("a_dot", "a_ddot", "a")])
def test_dof_named_like_a_derivative_is_refused(dofs: tuple[str, ...]) -> None:
    """The velocity of y is y_dot, so no DOF may be called that."""
    with pytest.raises(SignalNameError, match="would name both a DOF's motion and a derivative"):
        checked_dofs(dofs, len(dofs))


def test_derivative_suffix_alone_is_no_clash() -> None:
    """y_dot may be a DOF as long as y is none."""
    assert checked_dofs(("y_dot", "z"), 2) == ("y_dot", "z")


def test_unknown_name_lists_the_known_ones() -> None:
    """The refusal helps to find the right name."""
    error = unknown_name_error("w", "input", ["u", "v"])
    assert str(error) == "The model has no input 'w'. Known: u, v."
    assert error.names == ("w",)


@pytest.mark.parametrize("name", ["a\x1b[31m", "a\nb", "a\tb", "a\x9bb", "a\u202eb", "a\ud800"])
def test_names_that_a_terminal_obeys_are_refused(name: str) -> None:
    """ESC, line ends, and what turns the direction of text; the message shows them as escapes."""
    with pytest.raises(SignalNameError, match="control characters") as refusal:
        checked_names([name], 1, "DOFs")
    assert printable(str(refusal.value)) == str(refusal.value)
