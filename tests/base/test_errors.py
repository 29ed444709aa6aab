"""Errors are ValueErrors that carry their facts, also across a process boundary."""

import inspect
import pickle
import re

import pytest

from halfdof_ctrl.base import errors
from halfdof_ctrl.base.errors import (
    AssemblyError,
    CheckpointError,
    CloseDecisionWarning,
    ComplexModelError,
    EnergyFormError,
    FileFormatError,
    HalfdofError,
    HalfdofWarning,
    ImproperError,
    InconsistentStateError,
    LawError,
    LostDigitsWarning,
    MatrixError,
    MissingExtraError,
    ModelSizeError,
    NearlyMasslessWarning,
    NoAnswerError,
    NoStateSpaceError,
    ParameterError,
    SignalNameError,
    SingularLeadingMatrixError,
    SingularPencilError,
    StabilizationError,
    UncertainRankError,
    WeightError,
    WorkerError,
    WrongObjectError,
    give_warning,
    recording_warnings,
)
from halfdof_ctrl.files.naming import naming_the_file

EXAMPLES: list[HalfdofError] = [
    AssemblyError("Nothing holds part a", names=("a",)),
    LawError("bounded", element="damper 1 (coulomb)", dofs=("y2",)),
    NoAnswerError("stops", element="damper 1 (table)", dofs=("y2",), time=0.5, force=7.0, state=(0.0, 1.0)),
    MatrixError("K is empty", matrix="K"),
    ComplexModelError("K is complex", matrices=("K", "C")),
    SignalNameError("no such name", names=("a",)),
    ParameterError("m = -1", parameter="m", value=-1.0),
    WrongObjectError("zeros takes a model", parameter="model", value=None),
    SingularLeadingMatrixError("W is singular", dofs=("a", "b"), rcond=1e-18),
    SingularPencilError("floats", dofs=("a",), equations=("b",)),
    UncertainRankError("close", dofs=("a",), gap=2.0),
    ImproperError("grows", pairs=(("u", "y", 2),)),
    InconsistentStateError("contradicts", names=("a",), given=(1.0,), required=(2.0,)),
    WeightError("negative", names=("a",)),
    StabilizationError("unstable", eigenvalue=1 + 2j, quantity="a"),
    FileFormatError("truncated", path="model.mtx", line=3),
    MissingExtraError("needs h5py", path="model.mat", extra="hdf5"),
    CheckpointError("of another sweep", path="sweep.jsonl"),
    WorkerError("cannot start", function="hydromount"),
    EnergyFormError("no energy coordinates", reason="unsymmetric", dofs=("a",)),
    ModelSizeError("too many states", size=400_000, limit=8192),
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
    assert public - {HalfdofError, NoStateSpaceError} == {type(error) for error in EXAMPLES}


@pytest.mark.parametrize("kind", [NearlyMasslessWarning, CloseDecisionWarning, LostDigitsWarning])
def test_warning_is_a_user_warning(kind: type[Warning]) -> None:
    """It can be filtered by its own type."""
    assert issubclass(kind, UserWarning)


@pytest.mark.parametrize(
    ("cause", "message", "line"),
    [
        (FileFormatError("cut short", path="", line=3), "a.mtx, line 3: cut short", 3),
        (MatrixError("K is empty", matrix="K"), "a.mtx: K is empty", None),
        (
            KeyError("x"),
            "a.mtx: the file is damaged or of another kind than its ending says ('x'). Write it anew.",
            None,
        ),
        (ValueError(), "a.mtx: the file is damaged or of another kind than its ending says (ValueError)", None),
    ],
)
def test_whatever_a_reader_raises_becomes_one_refusal_that_names_the_file(
    cause: Exception, message: str, line: int | None
) -> None:
    """With the line, and the cause kept."""
    with pytest.raises(FileFormatError, match=re.escape(message)) as caught, naming_the_file("a.mtx"):
        raise cause
    assert (caught.value.path, caught.value.line, caught.value.__cause__) == ("a.mtx", line, cause)


def test_what_a_reader_says_at_length_is_cut() -> None:
    """Some quote the bytes that they do not understand."""
    with pytest.raises(FileFormatError, match=r"x\.\.\.\)\. Write it anew") as caught, naming_the_file("a.npz"):
        raise KeyError("x" * 5000)
    assert len(str(caught.value)) < 500


def test_a_missing_extra_stays_one_and_an_os_error_too() -> None:
    """Neither is a fault of the file."""
    with pytest.raises(MissingExtraError, match=r"a\.mat: needs h5py"), naming_the_file("a.mat"):
        raise MissingExtraError("needs h5py", path="", extra="hdf5")
    with pytest.raises(FileNotFoundError), naming_the_file("a.mat"):
        raise FileNotFoundError


def test_no_message_steers_a_terminal() -> None:
    """Names come from files, and causes from objects of the user's: what a terminal obeys is written as an escape."""
    assert str(HalfdofError("a\x1b[31m\nb")) == "a\\x1b[31m\nb"
    assert str(pickle.loads(pickle.dumps(MatrixError("\x07", matrix="M")))) == "\\x07"  # noqa: S301  # our own
    with recording_warnings() as caught:
        give_warning("\x9b", HalfdofWarning)
    assert caught[0].message == "\\x9b"
