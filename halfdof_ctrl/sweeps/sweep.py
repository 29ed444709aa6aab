"""Sweeps: many models, or many frequencies of a large one, here, on all cores, or on a cluster.

A function makes a model from parameters; a sweep calls it for every case and keeps poles, frequency response, or
what another function makes of the model. Any `concurrent.futures.Executor` can do the work (see `workers`). A case that
fails leaves NaN in the arrays and a named failure.
"""

import functools
import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy.typing as npt

from halfdof_ctrl.base.doors import is_choice, is_real_number, is_whole_number, require_path, require_switches, shown
from halfdof_ctrl.base.errors import FailedCasesWarning, ParameterError, SweepInterruptedError, give_warning
from halfdof_ctrl.base.names import Names
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.threads import available_cores
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.sweeps.cases import Parameters, in_words, listed_cases, name_of, require_accepted
from halfdof_ctrl.sweeps.checkpoint import Checkpoint, open_checkpoint
from halfdof_ctrl.sweeps.fingerprint import fingerprint
from halfdof_ctrl.sweeps.ledger import Ledger, RefusedSignals
from halfdof_ctrl.sweeps.one_case import CaseWork, Constant, FrequencyWork, Quantity
from halfdof_ctrl.sweeps.result import Outcome, SweepResult, joined_cases, joined_frequencies
from halfdof_ctrl.sweeps.waiting import Work
from halfdof_ctrl.sweeps.workers import work_through
from halfdof_ctrl.systems.frequency import checked_frequencies

QUANTITIES = ("poles", "response")
EVERY_CORE = -1  #: as many workers as cores


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """What a sweep does."""

    work: Work
    items: Sequence[Any]  #: what the work takes, one for each outcome
    what: str  #: the items are, in the plural
    join: Callable[[Sequence[Outcome]], SweepResult]
    trusted: bool  #: the function is one of this package, which ends no process
    facts: dict[str, object]  #: what makes it this sweep and no other
    about: dict[str, object]  #: the same for people, in short

    @property
    def is_even(self) -> bool:
        """Whether the items are frequencies of one system, which is made anew for each chunk."""
        return self.what == "frequencies"


def sweep(
    function: SecondOrderModel | Callable[..., object],
    parameters: Parameters = None,
    *,
    paired: bool = False,
    omega: npt.ArrayLike | None = None,
    inputs: Names = None,
    outputs: Names = None,
    compute: Quantity | Sequence[Quantity] | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    timeout: float | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
) -> SweepResult:
    """Compute many cases of a model, or many frequencies of a large one.

    Parameters
    ----------
    function : callable or SecondOrderModel
        Takes the parameters by name and gives a `SecondOrderModel` (as `hydromount` does), a `control.StateSpace`,
        or numbers. A model stands for itself: it has no parameters, and the workers share its frequencies.
    parameters : mapping or sequence of mappings, optional
        A mapping from names to lists of values makes the grid of all combinations; a single value (a number, a text)
        is the same for all cases and makes no axis. A sequence of mappings, with one value for each name, is a list
        of cases. Without parameters there is a single case.
    paired : bool
        Take the lists of a mapping together (first with first, ...), as the sample of a Monte Carlo study.
    omega : (k,) array_like, optional
        Frequencies of the response [rad/s], the very points.
    inputs, outputs : str or sequence of str, optional
        As in `SecondOrderModel.select`; of a state space, among those that it has. All by default.
    compute : {'poles', 'response'}, callable, or a sequence of these, optional
        What is kept of each model. A callable takes the model and gives numbers, for `SweepResult.values`. By default
        the poles, and the response if `omega` is given; of a model that stands for itself the response. A function
        that gives numbers needs none.
    workers : int, optional
        Number of processes to start, -1 for one a core. By default everything is done in this process.
    executor : concurrent.futures.Executor, optional
        Does the work instead: threads or processes, Dask (``Client(...).get_executor()``), mpi4py
        (``MPIPoolExecutor()``). It is left open.
    timeout : float, optional
        Seconds that one case (or one frequency) may take; then its process is ended, the case fails as a
        ``TimeoutError``, and another process goes on with the others. Nothing can interrupt compiled code in this
        process, so without `workers` one process is started, and an `executor` is refused.
    checkpoint : path-like, optional
        File to which finished cases are appended as they come. If it is there, the cases in it are not computed again:
        the same call continues a sweep that was stopped in whatever way. Cases that failed are tried again.
    progress : bool, optional
        Show a bar, or never; by default on a terminal or in a notebook, after a second.

    Returns
    -------
    SweepResult

    Raises
    ------
    ParameterError
        Parameters that the function does not take, no values, a response without frequencies, and other requests
        without a meaning; all before anything is computed.
    SignalNameError
        Inputs or outputs that the system of the first case does not have; the other cases are not computed.
    CheckpointError
        The file of `checkpoint` is none, belongs to another sweep, or is in use by another run.
    OSError
        It cannot be written.
    WorkerError
        Processes that cannot start, or a function that cannot be sent to them.
    SweepInterruptedError
        Ctrl-C. What is done is in its `result`; the other cases stand there as failures of kind ``NotRun``.

    Warns
    -----
    FailedCasesWarning
        Some cases failed; they are in `SweepResult.failures`.
    CheckpointWarning
        The disk of the checkpoint became full or went away; the result is whole all the same.

    Notes
    -----
    Cases go to the workers in chunks of about a quarter of a second. If a process that was started here dies (out of
    memory, crash in compiled code), another is started and what it was working on is done again; a case that kills
    three of them fails. Dask does the same by its own rules. Any other executor that breaks takes no more work,
    and the rest of the cases fails with its error. Linear algebra in a worker uses as many threads as it has cores as
    its share, and a single one in an executor that was given.

    A sweep that is too short for processes does without: as long as what is left would take less than a second, one
    process does it, or this one if the function is of this package, which ends no process. `SweepResult.ran` says what
    was done. Processes end with this one, however that ends.

    Examples
    --------
    A mass of 1 kg on springs of 1 and 4 N/m oscillates at the square roots:

    >>> result = sweep(lambda k: mechss([[1]], None, [[k]]), {"k": [1.0, 4.0]})
    >>> result.poles.imag.round(12).tolist()
    [[1.0, -1.0], [2.0, -2.0]]
    """
    if progress is not None:
        require_switches(progress=progress)
    processes = _checked_workers(workers, executor)
    if timeout is not None:
        processes = _checked_timeout(timeout, processes, executor)
    plan = _planned(function, parameters, paired=paired, omega=omega, inputs=inputs, outputs=outputs, compute=compute)
    ledger = Ledger(len(plan.items))
    show = False if plan.is_even and processes is None and executor is None and checkpoint is None else progress
    try:
        with _checkpoint(checkpoint, plan) as file, progress_bar(len(plan.items), plan.what, show=show) as advance:
            known = ledger.begin(file, advance)
            ran = work_through(
                plan.work,
                [plan.items[number] for number in ledger.left],
                ledger.store,
                executor=executor,
                workers=processes,
                even=plan.is_even,
                timeout=timeout,
                prompt=file is not None,
                trusted=plan.trusted,
            )
    except KeyboardInterrupt as stop:
        msg = (
            f"The sweep was interrupted after {ledger.done} of {len(plan.items)} {plan.what}. What is done is kept in "
            "this exception: `except KeyboardInterrupt as stop: result = stop.result`, or sys.last_value.result later."
        )
        raise SweepInterruptedError(msg, result=plan.join(ledger.outcomes)) from stop
    except RefusedSignals as refused:
        raise refused.in_words() from None
    ledger.warn_of_lost_lines()
    if known:
        ran += f", {known} of {len(plan.items)} {plan.what} taken from the checkpoint"
    result = replace(plan.join(ledger.outcomes), ran=ran)
    if result.failures:
        msg = f"{len(result.failures)} of {len(plan.items)} {plan.what} failed, first {result.failures[0]}"
        give_warning(msg, FailedCasesWarning)
    return result


@contextmanager
def _checkpoint(path: str | os.PathLike[str] | None, plan: _Plan) -> Iterator[Checkpoint | None]:
    """Open the checkpoint, if there is one."""
    if path is None:
        yield None
        return
    if not isinstance(path, str | os.PathLike) or path == "":
        msg = f"checkpoint must be the path of a file, not {shown(path)}."
        raise ParameterError(msg, parameter="checkpoint", value=path)
    require_path(path, "checkpoint", parameter="checkpoint")
    with open_checkpoint(path, fingerprint(**plan.facts), plan.about) as file:
        yield file


def _planned(
    function: object,
    parameters: Parameters,
    *,
    paired: bool,
    omega: npt.ArrayLike | None,
    inputs: Names,
    outputs: Names,
    compute: Quantity | Sequence[Quantity] | None,
) -> _Plan:
    """Check a request and lay out the work."""
    require_switches(paired=paired)
    quantities = _checked_quantities(compute)
    frequencies = None if omega is None else checked_frequencies(omega)
    if "response" in quantities and frequencies is None:
        msg = "The frequency response was asked for without frequencies. Give omega [rad/s]."
        raise ParameterError(msg, parameter="omega", value=None)
    if isinstance(function, SecondOrderModel):
        if parameters is not None:
            msg = "A model has no parameters to vary. Give the function that makes it, such as hydromount without ()."
            raise ParameterError(msg, parameter="function", value=function)
        quantities = quantities or (("poles",) if frequencies is None else ("response",))
        function = Constant(function)
    if not callable(function):
        msg = f"function must be a function or a SecondOrderModel, not {type(function).__name__}."
        raise ParameterError(msg, parameter="function", value=function)
    cases = listed_cases(parameters, paired=paired)
    require_accepted(function, cases)
    trusted = _is_own(function) and not any(callable(quantity) for quantity in quantities)
    facts = {
        "function": function,
        "items": [cases.arguments(number) for number in range(len(cases))],
        "omega": frequencies,
        "signals": [inputs, outputs],
        "compute": quantities,
    }
    about: dict[str, object] = {
        "function": name_of(function),
        "parameters": in_words(cases.varied(0)) + ", ..." if cases.parameters else "no parameters",
    }
    if parameters is None and frequencies is not None and quantities == ("response",):
        shared = FrequencyWork(function=function, inputs=inputs, outputs=outputs)
        return _Plan(
            work=shared,
            items=frequencies.tolist(),
            what="frequencies",
            join=lambda outcomes: joined_frequencies(outcomes, frequencies),
            trusted=trusted,
            facts=facts,
            about=about | {"cases": len(frequencies), "what": "frequencies"},
        )
    work = CaseWork(function=function, compute=quantities, omega=frequencies, inputs=inputs, outputs=outputs)
    return _Plan(
        work=work,
        items=[cases.arguments(number) for number in range(len(cases))],
        what="cases",
        join=lambda outcomes: joined_cases(outcomes, cases, frequencies),
        trusted=trusted,
        facts=facts,
        about=about | {"cases": len(cases), "what": "cases"},
    )


def _is_own(function: object) -> bool:
    """Tell a function of this package, which ends no process, from one of the user's."""
    while isinstance(function, functools.partial):
        function = function.func
    return str(getattr(function, "__module__", "")).split(".")[0] == __name__.split(".")[0]


def _checked_quantities(compute: object) -> tuple[Quantity, ...]:
    """Read what is to be computed; an empty tuple leaves it to what the function gives."""
    if compute is None:
        return ()
    given = tuple(compute) if isinstance(compute, Sequence) and not isinstance(compute, str) else (compute,)
    functions = [quantity for quantity in given if callable(quantity)]
    if not given or len(functions) > 1 or any(not callable(one) and not is_choice(one, QUANTITIES) for one in given):
        msg = (
            f"compute = {shown(compute)}, but it must be 'poles', 'response', a function of the model, or a list of "
            "these with one function at most. Let one function give an array of all its numbers."
        )
        raise ParameterError(msg, parameter="compute", value=compute)
    return given


def _checked_workers(workers: object, executor: object) -> int | None:
    """Read the number of processes to start; None where none are."""
    if executor is not None and not isinstance(executor, Executor):
        msg = (
            f"executor must be a concurrent.futures.Executor, not {type(executor).__name__}; of a Dask client it is "
            "client.get_executor()."
        )
        raise ParameterError(msg, parameter="executor", value=executor)
    if workers is None:
        return None
    if executor is not None:
        msg = "workers is the number of processes to start here, but an executor brings its own. Give one of the two."
        raise ParameterError(msg, parameter="workers", value=workers)
    if not is_whole_number(workers) or (workers < 1 and workers != EVERY_CORE):
        msg = f"workers = {shown(workers)}, but it must be a positive number of processes, or -1 for one a core."
        raise ParameterError(msg, parameter="workers", value=workers)
    return available_cores() if workers == EVERY_CORE else workers


def _checked_timeout(timeout: object, processes: int | None, executor: Executor | None) -> int:
    """Read the time of a case; give the number of processes that can keep to it."""
    if not (is_real_number(timeout) and 0.0 < float(timeout) < math.inf):  # type: ignore[arg-type]
        msg = f"timeout = {shown(timeout)}, but it must be a positive number of seconds."
        raise ParameterError(msg, parameter="timeout", value=timeout)
    if executor is not None:
        msg = (
            "timeout ends the process of a case, but those of an executor are not this sweep's to end. Give workers "
            "instead of the executor, or set the time limit where the executor starts its workers."
        )
        raise ParameterError(msg, parameter="timeout", value=timeout)
    return 1 if processes is None else processes
