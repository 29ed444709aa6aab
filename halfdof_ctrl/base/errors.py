"""What the package raises: one base class, a few children, numbers and names as attributes.

A message states the measured fact, the DOF or signal by name, what it means physically and what to do.
The attributes repeat the facts for programs.
"""

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from halfdof_ctrl.base.printable import printable


def _rebuild(kind: type["HalfdofError"], message: str, facts: dict[str, object]) -> "HalfdofError":
    """Make an error again on the other side of a process boundary."""
    error = kind.__new__(kind)
    ValueError.__init__(error, message)
    error.__dict__.update(facts)
    return error


class HalfdofError(ValueError):
    """Base of every refusal of this package."""

    def __init__(self, *given: object) -> None:
        """Take a message, in which names from files and objects of the user's cannot steer a terminal."""
        super().__init__(*[printable(part) if isinstance(part, str) else part for part in given])

    def __reduce__(self) -> tuple[Callable[..., "HalfdofError"], tuple[object, ...]]:
        """Pickle by message and facts, since children take keyword-only arguments."""
        return _rebuild, (type(self), str(self), self.__dict__)


class NoStateSpaceError(HalfdofError):
    """A model has no state space, or none that working precision can tell; its frequency response exists all the same.

    Whatever needs no state space (`frequency_response`, `bode_plot`, `pole_map_plot`, `sweep`) falls back to the
    descriptor form where this is raised, and says `why`.
    """

    why = "no state space"  #: the cause in a few words


class MatrixError(HalfdofError):
    """A matrix cannot be used: shape, kind of entry, NaN or Inf; `matrix` is its letter."""

    def __init__(self, message: str, *, matrix: str) -> None:
        super().__init__(message)
        self.matrix = matrix


class ComplexModelError(NoStateSpaceError):
    """A real state space was asked for a complex model; `matrices` are the complex ones."""

    why = "model is complex"

    def __init__(self, message: str, *, matrices: tuple[str, ...]) -> None:
        super().__init__(message)
        self.matrices = matrices


class SignalNameError(HalfdofError):
    """Names of DOFs or signals clash, are unknown or cannot be used; `names` are the culprits."""

    def __init__(self, message: str, *, names: tuple[str, ...]) -> None:
        super().__init__(message)
        self.names = names


class ParameterError(HalfdofError):
    """A parameter is outside its physical range; `parameter` and `value` say which."""

    def __init__(self, message: str, *, parameter: str, value: object) -> None:
        super().__init__(message)
        self.parameter = parameter
        self.value = value


class WrongObjectError(ParameterError, TypeError):
    """An argument is another kind of object than the function takes; `parameter` and `value` say which."""


class SingularLeadingMatrixError(NoStateSpaceError):
    """The leading matrix W of equation (2) is singular.

    `dofs` take part in its null vector, `rcond` is the reciprocal condition number after scaling.
    """

    why = "W is singular"

    def __init__(self, message: str, *, dofs: tuple[str, ...], rcond: float) -> None:
        super().__init__(message)
        self.dofs = dofs
        self.rcond = rcond


class SingularPencilError(HalfdofError):
    """``det P(s)`` vanishes identically.

    `dofs` can move in any way without a force, and `equations` depend on each other. An equation is named by the DOF
    whose row of M, C, K it is: the equation of motion of a displacement, the constraint of a multiplier.
    """

    def __init__(self, message: str, *, dofs: tuple[str, ...], equations: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.dofs = dofs
        self.equations = equations


class UncertainRankError(NoStateSpaceError):
    """The order of the model cannot be told to working precision.

    `dofs` take part in the closest decision about a rank, `gap` is the ratio of the singular values there.
    """

    why = "order uncertain"

    def __init__(self, message: str, *, dofs: tuple[str, ...], gap: float) -> None:
        super().__init__(message)
        self.dofs = dofs
        self.gap = gap


class AssemblyError(HalfdofError):
    """Parts and joints contradict each other or leave something loose; `names` are the points or parts."""

    def __init__(self, message: str, *, names: tuple[str, ...]) -> None:
        super().__init__(message)
        self.names = names


class ImproperError(NoStateSpaceError):
    """Some transfer functions grow with frequency; `pairs` lists (input, output, order of growth)."""

    why = "improper"

    def __init__(self, message: str, *, pairs: tuple[tuple[str, str, int], ...]) -> None:
        super().__init__(message)
        self.pairs = pairs


class InconsistentStateError(HalfdofError):
    """Initial values contradict the equations without inertia.

    `names` are the displacements and velocities concerned, `given` and `required` their values.
    """

    def __init__(
        self, message: str, *, names: tuple[str, ...], given: tuple[float, ...], required: tuple[float, ...]
    ) -> None:
        super().__init__(message)
        self.names = names
        self.given = given
        self.required = required


class WeightError(HalfdofError):
    """Weights of a quadratic cost do not define a regulator problem; `names` are the quantities."""

    def __init__(self, message: str, *, names: tuple[str, ...]) -> None:
        super().__init__(message)
        self.names = names


class StabilizationError(HalfdofError):
    """No stabilizing feedback came out.

    `eigenvalue` [rad/s] is the mode left on or right of the imaginary axis, `quantity` the physical
    quantity in which it is seen most.
    """

    def __init__(self, message: str, *, eigenvalue: complex, quantity: str) -> None:
        super().__init__(message)
        self.eigenvalue = eigenvalue
        self.quantity = quantity


class LawError(HalfdofError):
    """A law that is not linear cannot do what its place in the model asks of it.

    `element` is the element in words, `dofs` are those it acts on.
    """

    def __init__(self, message: str, *, element: str, dofs: tuple[str, ...]) -> None:
        super().__init__(message)
        self.element = element
        self.dofs = dofs


class NoAnswerError(LawError):
    """During a run no motion answers a force, or a law gives NaN or Inf.

    `time` [s] is when, `force` [N] what found no answer (NaN where a law gave NaN), `state` the state reached.
    """

    def __init__(
        self, message: str, *, element: str, dofs: tuple[str, ...], time: float, force: float, state: tuple[float, ...]
    ) -> None:
        super().__init__(message, element=element, dofs=dofs)
        self.time = time
        self.force = force
        self.state = state


class EnergyFormError(HalfdofError):
    """A model has no energy coordinates; `reason` is one word for why, `dofs` are concerned."""

    def __init__(self, message: str, *, reason: str, dofs: tuple[str, ...]) -> None:
        super().__init__(message)
        self.reason = reason
        self.dofs = dofs


class ModelSizeError(HalfdofError):
    """Something would be too large: `size` is the count that decides (DOFs, states, signals), `limit` the most."""

    def __init__(self, message: str, *, size: int, limit: int) -> None:
        super().__init__(message)
        self.size = size
        self.limit = limit


class FileFormatError(HalfdofError):
    """A file cannot be read as a model, or its ending names no known format.

    `path` is the file, `line` the line that is wrong, counted from one, where a text file has a single one.
    """

    def __init__(self, message: str, *, path: str, line: int | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.line = line


class MissingExtraError(FileFormatError):
    """A file needs a package that is not installed; `extra` is what to install it by."""

    def __init__(self, message: str, *, path: str, extra: str) -> None:
        super().__init__(message, path=path)
        self.extra = extra


class CheckpointError(FileFormatError):
    """A file cannot be used as the checkpoint of a sweep: it is none, is one of another sweep, or is in use."""


class WorkerError(HalfdofError):
    """Worker processes cannot start or cannot load what they are to do; `function` is its name."""

    def __init__(self, message: str, *, function: str) -> None:
        super().__init__(message)
        self.function = function


class SweepInterruptedError(KeyboardInterrupt):
    """A sweep was stopped by Ctrl-C; `result` is a `SweepResult` in which the cases that were not done have failed."""

    def __init__(self, message: str, *, result: object) -> None:
        super().__init__(message)
        self.result = result


def callers_level() -> int:
    """Return the `stacklevel` of a warning that is to point at the first line outside this package."""
    frame, level = sys._getframe(1), 1  # noqa: SLF001  # the way that the standard library goes too
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] == __name__.split(".")[0]:
        frame, level = frame.f_back, level + 1
    return level


class HalfdofWarning(UserWarning):
    """Base of every warning of this package."""


class RecordedWarning(NamedTuple):
    """A warning of this package that was held back."""

    message: str
    category: type[HalfdofWarning]


#: the warnings held back in this thread; those of the standard library's filters belong to the whole process
_RECORD: ContextVar[list[RecordedWarning] | None] = ContextVar("halfdof_ctrl_warnings", default=None)


def give_warning(message: str, category: type[HalfdofWarning]) -> None:
    """Warn the line of the user's that called this package, or let who records warnings in this thread have it."""
    record, message = _RECORD.get(), printable(message)
    if record is None:
        warnings.warn(message, category, stacklevel=callers_level())
    else:
        record.append(RecordedWarning(message, category))


@contextmanager
def recording_warnings() -> Iterator[list[RecordedWarning]]:
    """Hold back the warnings that this package gives in this thread; the filters of the process are not touched."""
    caught: list[RecordedWarning] = []
    before = _RECORD.set(caught)
    try:
        yield caught
    finally:
        _RECORD.reset(before)


def give_first_of_each_kind(caught: Iterable[RecordedWarning]) -> None:
    """Warn of what was held back, of each kind once: a curve and the marks on it have one cause.

    >>> with recording_warnings() as told:
    ...     give_first_of_each_kind([RecordedWarning(text, LostDigitsWarning) for text in ("curve", "marks")])
    >>> [warning.message for warning in told]
    ['curve']
    """
    kinds = set()
    for message, category in caught:
        if category not in kinds:
            give_warning(message, category)
        kinds.add(category)


def own_messages(caught: Iterable[warnings.WarningMessage | RecordedWarning]) -> list[str]:
    """Give the texts of this package's own warnings, each once: the user can do nothing about other packages'."""
    own = (warning for warning in caught if issubclass(warning.category, HalfdofWarning))
    return list(dict.fromkeys(str(warning.message) for warning in own))


class NearlyMasslessWarning(HalfdofWarning):
    """A DOF has a mass so small against the others that its two states cost digits."""


class CloseDecisionWarning(HalfdofWarning):
    """A decision about a rank is close: a smaller tolerance or another rounding would give another order."""


class LostDigitsWarning(HalfdofWarning):
    """The state space is exact, but in floating point its transfer function is known to fewer digits than usual."""


class DataLimitWarning(HalfdofWarning):
    """Entries known to their last digit do not determine a response to more digits than the message says."""


class InaccurateGainWarning(HalfdofWarning):
    """A gain is optimal to fewer digits than usual, since rounding of the problem moves it."""


class FailedCasesWarning(HalfdofWarning):
    """Some cases of a sweep failed; its `failures` say which, and why."""


class CheckpointWarning(HalfdofWarning):
    """Finished cases of a sweep could not be written to its checkpoint; the result of the sweep has them."""


class SelectedSignalsWarning(HalfdofWarning):
    """A command chose some inputs and outputs of a model that has too many for it."""


class ImportedModelWarning(HalfdofWarning):
    """What a finite-element program wrote is read as it stands, but is probably not what was meant."""


class TruncationWarning(HalfdofWarning):
    """A small model is far from the full one somewhere in the band that matters."""


class LostStateWarning(HalfdofWarning):
    """The tangent of a nonlinear model has another number of states than the model, since a slope is zero there."""


class InterruptedResponseWarning(HalfdofWarning):
    """A response was stopped by the user; what it holds is right, but not all that was asked for."""
