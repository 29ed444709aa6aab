"""Errors are ValueErrors that carry their facts, also across a process boundary."""

import inspect
import pickle

import pytest

from halfdof_ctrl import errors
from halfdof_ctrl.errors import (
    ComplexModelError,
    FileFormatError,
    HalfdofError,
    ImproperError,
    InconsistentStateError,
    MatrixError,
    ModelSizeError,
    NearlyMasslessWarning,
    ParameterError,
    SignalNameError,
    SingularLeadingMatrixError,
    SingularPencilError,
    StabilizationError,
    WeightError,
)

EXAMPLES: list[HalfdofError] = [
    MatrixError("K is empty", matrix="K"),
    ComplexModelError("K is complex", matrices=("K", "C")),
    SignalNameError("no such name", names=("a",)),
    ParameterError("m = -1", parameter="m", value=-1.0),
    SingularLeadingMatrixError("W is singular", dofs=("a", "b"), rcond=1e-18),
    SingularPencilError("floats", dofs=("a",)),
    ImproperError("grows", pairs=(("u", "y", 2),)),
    InconsistentStateError("contradicts", names=("a",), given=(1.0,), required=(2.0,)),
    WeightError("negative", names=("a",)),
    StabilizationError("unstable", eigenvalue=1 + 2j, quantity="a"),
    ModelSizeError("too many states", size=400_000, limit=8192),
    FileFormatError("truncated", path="model.npz"),
]


@pytest.mark.parametrize("error", EXAMPLES, ids=lambda error: type(error).__name__)
def test_error_is_a_value_error_and_keeps_its_facts(error: HalfdofError) -> None:
    """python-control raises ValueError for the same causes, so users catch one type."""
    assert isinstance(error, ValueError)
    assert isinstance(error, HalfdofError)
    assert error.__dict__


@pytest.mark.parametrize("error", EXAMPLES, ids=lambda error: type(error).__name__)
def test_error_survives_pickling(error: HalfdofError) -> None:
    """A worker process hands the same type, message and facts back."""
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301  # made two words before
    assert type(copy) is type(error)
    assert str(copy) == str(error)
    assert copy.__dict__ == error.__dict__


def test_every_error_has_an_example_above() -> None:
    """No child of the base class is forgotten."""
    public = {kind for _, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, HalfdofError)}
    assert public - {HalfdofError} == {type(error) for error in EXAMPLES}


def test_warning_is_a_user_warning() -> None:
    """It can be filtered by its own type."""
    assert issubclass(NearlyMasslessWarning, UserWarning)
