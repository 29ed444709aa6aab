"""What has become of the cases of a sweep so far: done in this run, taken from a checkpoint, or not yet run."""

from collections.abc import Callable

from halfdof_ctrl.base.errors import CheckpointWarning, SignalNameError, give_warning
from halfdof_ctrl.sweeps.checkpoint import Checkpoint
from halfdof_ctrl.sweeps.one_case import CaseError, CaseResult
from halfdof_ctrl.sweeps.result import Outcome

NOT_RUN = CaseError(kind="NotRun", message="the sweep was interrupted before this case was done", traceback="")


class RefusedSignals(BaseException):  # no error of an executor, whose ways it must pass
    """The system of the first case does not have the signals that were asked for."""

    def __init__(self, error: CaseError) -> None:
        super().__init__(error.message)
        self.error = error

    def in_words(self) -> SignalNameError:
        """Return the error that the user sees."""
        return SignalNameError(self.error.message, names=self.error.unknown)


class Ledger:
    """The outcomes of a number of cases."""

    def __init__(self, count: int) -> None:
        self.outcomes: list[Outcome] = [NOT_RUN] * count
        self.left = list(range(count))  #: numbers of the cases that this run has to do
        self._file: Checkpoint | None = None
        self._advance: Callable[[int], None] | None = None

    @property
    def done(self) -> int:
        """Count the cases that have an outcome."""
        return len(self.outcomes) - self.outcomes.count(NOT_RUN)

    def begin(self, file: Checkpoint | None, advance: Callable[[int], None]) -> int:
        """Take what a checkpoint has, and give how many cases that is."""
        self._file, self._advance = file, advance
        known = {} if file is None else file.done
        for number in self.left:
            if number in known:
                self.outcomes[number] = known[number]
        self.left = [number for number in self.left if number not in known]
        advance(self.done)
        return self.done

    def store(self, place: int, found: Outcome | BaseException) -> None:
        """Take the outcome of one of the cases that were left.

        Raises
        ------
        RefusedSignals
            It is the first case of all, and has not the signals that were asked for.
        """
        number = self.left[place]
        outcome = CaseError.of(found) if isinstance(found, BaseException) else found
        if number == 0 and isinstance(outcome, CaseError) and outcome.unknown:
            raise RefusedSignals(outcome)
        self.outcomes[number] = outcome
        if self._file is not None and isinstance(outcome, CaseResult):
            self._file.add(number, outcome)
        if self._advance is not None:
            self._advance(1)

    def warn_of_lost_lines(self) -> None:
        """Warn where the checkpoint has not taken everything."""
        if self._file is not None and self._file.failure is not None:
            msg = (
                f"{self._file.unwritten} finished cases are not in the checkpoint {self._file.path}: "
                f"{self._file.failure.strerror}. This result has them; another run would compute them again."
            )
            give_warning(msg, CheckpointWarning)
