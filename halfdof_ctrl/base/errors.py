"""What the package raises: one base class, a few children, numbers and names as attributes.

A message states the measured fact, the DOF or signal by name, what it means physically and what to do.
The attributes repeat the facts for programs.
"""

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

MOST_WORDS = 300  #: characters of another library's error that are passed on


def _rebuild(kind: type["HalfdofError"], message: str, facts: dict[str, object]) -> "HalfdofError":
    """Make an error again on the other side of a process boundary."""
    error = kind.__new__(kind)
    ValueError.__init__(error, message)
    error.__dict__.update(facts)
    return error


class HalfdofError(ValueError):
    """Base of every refusal of this package."""

    def __reduce__(self) -> tuple[Callable[..., "HalfdofError"], tuple[object, ...]]:
        """Pickle by message and facts, since children take keyword-only arguments."""
        return _rebuild, (type(self), str(self), self.__dict__)


class MatrixError(HalfdofError):
    """A matrix cannot be used: shape, kind of entry, NaN or Inf; `matrix` is its letter."""

    def __init__(self, message: str, *, matrix: str) -> None:
        super().__init__(message)
        self.matrix = matrix


class ComplexModelError(HalfdofError):
    """A real state space was asked for a complex model; `matrices` are the complex ones."""

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


class SingularLeadingMatrixError(HalfdofError):
    """The leading matrix W of equation (2) is singular.

    `dofs` take part in its null vector, `rcond` is the reciprocal condition number after scaling.
    """

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


class UncertainRankError(HalfdofError):
    """The order of the model cannot be told to working precision.

    `dofs` take part in the closest decision about a rank, `gap` is the ratio of the singular values there.
    """

    def __init__(self, message: str, *, dofs: tuple[str, ...], gap: float) -> None:
        super().__init__(message)
        self.dofs = dofs
        self.gap = gap


class ImproperError(HalfdofError):
    """Some transfer functions grow with frequency; `pairs` lists (input, output, order of growth)."""

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


@contextmanager
def naming_the_file(path: object) -> Iterator[None]:
    """Turn what goes wrong with a file's content into a refusal that names the file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the parsers of damaged headers; what is read gets checked
            yield
    except MissingExtraError as refusal:
        msg = f"{path}: {refusal}"
        raise MissingExtraError(msg, path=str(path), extra=refusal.extra) from refusal
    except HalfdofError as refusal:
        line = getattr(refusal, "line", None)
        words = " ".join(str(refusal).splitlines())
        msg = f"{path}{'' if line is None else f', line {line}'}: {words}"
        raise FileFormatError(msg, path=str(path), line=line) from refusal
    except OSError:
        raise
    except Exception as cause:  # the readers raise anything on damaged bytes: zlib.error, KeyError, struct.error, ...
        reason = " ".join(str(cause).split()) or type(cause).__name__
        reason = reason if len(reason) <= MOST_WORDS else f"{reason[:MOST_WORDS]}..."  # some quote the file at length
        msg = f"{path}: the file is damaged or of another kind than its ending says ({reason}). Write it anew."
        raise FileFormatError(msg, path=str(path)) from cause


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
    """Give the `stacklevel` of a warning that is to point at the first line outside this package."""
    frame, level = sys._getframe(1), 1  # noqa: SLF001  # the way that the standard library goes too
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] == __name__.split(".")[0]:
        frame, level = frame.f_back, level + 1
    return level


class NearlyMasslessWarning(UserWarning):
    """A DOF has a mass so small against the others that its two states cost digits."""


class CloseDecisionWarning(UserWarning):
    """A decision about a rank is close: a smaller tolerance or another rounding would give another order."""


class LostDigitsWarning(UserWarning):
    """The state space is exact, but in floating point its transfer function is known to fewer digits than usual."""


class DataLimitWarning(UserWarning):
    """Entries known to their last digit do not determine a response to more digits than the message says."""


class FailedCasesWarning(UserWarning):
    """Some cases of a sweep failed; its `failures` say which, and why."""


class ImportedModelWarning(UserWarning):
    """What a finite-element program wrote is read as it stands, but is probably not what was meant."""


class TruncationWarning(UserWarning):
    """A small model is far from the full one somewhere in the band that matters."""


class InterruptedResponseWarning(UserWarning):
    """A frequency response was stopped by the user; what it holds is right, but not all that was asked for."""
