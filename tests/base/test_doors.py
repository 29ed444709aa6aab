"""What is asked of arguments, and how they are described: `halfdof_ctrl.base.doors`."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from halfdof_ctrl.base.doors import (
    answer_of,
    is_choice,
    is_real_number,
    items_of,
    real_number,
    real_numbers,
    require_path,
    require_switches,
    require_texts,
    shown,
)
from halfdof_ctrl.base.errors import MatrixError, ParameterError, WrongObjectError


class Hostile:
    """An object that fails whatever it is asked."""

    def __repr__(self) -> str:
        """Fail."""
        raise KeyError

    def __iter__(self) -> Any:  # noqa: ANN401
        """Fail."""
        raise KeyError

    def __array__(self, dtype: object = None, copy: object = None) -> Any:  # noqa: ANN401
        """Fail."""
        raise KeyError


def test_an_object_that_fails_is_refused_by_its_kind() -> None:
    """Neither its text, nor its items, nor its numbers are there to be had."""
    assert shown(Hostile()) == "<Hostile>"
    with pytest.raises(WrongObjectError, match="joints takes a list"):
        items_of(Hostile(), "joints", "a list", parameter="joints")
    with pytest.raises(ParameterError, match="omega must be numbers, not <Hostile>"):
        real_numbers(Hostile(), "omega", "numbers")


def test_a_long_value_is_cut_short() -> None:
    """A message is to be read."""
    assert len(shown("x" * 100_000)) < 100


@pytest.mark.parametrize("value", ["a", None, [1, 2], True, 1j, [[1.0]], float, 10**400, np.array(["1"])])
def test_what_is_no_single_number_is_refused_or_no_number(value: object) -> None:
    """Truth values are read as numbers by numpy, and are none here."""
    assert not is_real_number(value)
    if value is not True and not (isinstance(value, list) and np.size(value) == 1):
        with pytest.raises(ParameterError, match="m must be a real number"):
            real_number(value, "m")


def test_numbers_of_every_type_are_numbers() -> None:
    """Of Python and of numpy."""
    assert all(is_real_number(value) for value in (1, 1.5, np.float32(1.0), np.int8(3), float("nan")))


def test_an_array_is_no_choice() -> None:
    """It would be compared entry by entry."""
    assert not is_choice(np.array(["a", "b"]), ("a", "b"))
    assert is_choice("a", ("a", "b"))


def test_texts_and_switches_are_named_in_their_refusal() -> None:
    """By the name of the argument."""
    require_texts(title=None, label="a")
    require_switches(grid=True, dB=np.False_)
    with pytest.raises(WrongObjectError, match="title takes text, or None; this is the number 5"):
        require_texts(title=5)
    with pytest.raises(WrongObjectError, match="grid takes True or False; this is the text 'on'"):
        require_switches(grid="on")


@pytest.mark.parametrize("path", ["a\0b", "\ud800"])
def test_a_path_that_no_file_can_have_is_refused(path: str) -> None:
    """The operating system would end in an error that names no file."""
    with pytest.raises(ParameterError, match="holds characters that no file system takes"):
        require_path(path, "The path")


def test_a_path_is_text_or_a_path() -> None:
    """Bytes and numbers are none."""
    require_path(Path("a"), "The path")
    with pytest.raises(WrongObjectError, match=r"The path takes the path of a file.*; this is a bytes"):
        require_path(b"a", "The path")


def test_a_function_that_fails_is_named_and_its_error_kept() -> None:
    """The user's own error is the cause; refusals of this package pass as they are."""

    def broken(x: float) -> float:
        raise KeyError(x)

    def refused(x: float) -> float:
        raise MatrixError(str(x), matrix="K")

    words = r"inputs is called as a function of time; this failed: KeyError: 1\.0"
    with pytest.raises(ParameterError, match=words) as refusal:
        answer_of(broken, 1.0, parameter="inputs", meaning="a function of time")
    assert isinstance(refusal.value.__cause__, KeyError)
    with pytest.raises(MatrixError):
        answer_of(refused, 1.0, parameter="inputs", meaning="a function of time")
