"""Sweeps: many models, or many frequencies of a large one, here, on all cores, or on a cluster.

A function makes a model from parameters; a sweep calls it for every case and keeps poles, frequency response, or
what another function makes of the model. Any `concurrent.futures.Executor` can do the work (see `workers`). A case that
fails leaves NaN in the arrays and a named failure.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import FailedCasesWarning, ParameterError, SweepInterruptedError, give_warning
from halfdof_ctrl.base.names import Names
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.threads import available_cores
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.sweeps.cases import Parameters, listed_cases, require_accepted
from halfdof_ctrl.sweeps.one_case import CaseError, CaseWork, Constant, FrequencyWork, Quantity, System, selected
from halfdof_ctrl.sweeps.process_pool import Work
from halfdof_ctrl.sweeps.result import Outcome, SweepResult, joined_cases, joined_frequencies
from halfdof_ctrl.sweeps.workers import work_through
from halfdof_ctrl.systems.frequency import checked_frequencies

QUANTITIES = ("poles", "response")
EVERY_CORE = -1  #: as many workers as cores
NOT_RUN = CaseError(kind="NotRun", message="the sweep was interrupted before this case was done", traceback="")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """What a sweep does."""

    work: Work
    items: Sequence[Any]  #: what the work takes, one for each outcome
    what: str  #: the items are, in the plural
    join: Callable[[Sequence[Outcome]], SweepResult]


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
        Inputs or outputs that the system of the first case does not have; it is made here to see.
    WorkerError
        Processes that cannot start, or a function that cannot be sent to them.
    SweepInterruptedError
        Ctrl-C. What is done is in its `result`; the other cases stand there as failures of kind ``NotRun``.

    Warns
    -----
    FailedCasesWarning
        Some cases failed; they are in `SweepResult.failures`.

    Notes
    -----
    Cases go to the workers in chunks of about a quarter of a second. If a process that was started here dies (out of
    memory, crash in compiled code), others are started and what it was working on is done again; a case that kills
    three of them alone fails. Dask does the same by its own rules. Any other executor that breaks takes no more work,
    and the rest of the cases fails with its error. Linear algebra in a worker uses as many threads as it has cores as
    its share, and a single one in an executor that was given.

    Examples
    --------
    A mass of 1 kg on springs of 1 and 4 N/m oscillates at the square roots:

    >>> result = sweep(lambda k: mechss([[1]], None, [[k]]), {"k": [1.0, 4.0]})
    >>> result.poles.imag.round(12).tolist()
    [[1.0, -1.0], [2.0, -2.0]]
    """
    processes = _checked_workers(workers, executor)
    plan = _planned(function, parameters, paired=paired, omega=omega, inputs=inputs, outputs=outputs, compute=compute)
    outcomes: list[Outcome] = [NOT_RUN] * len(plan.items)
    whole = plan.what == "frequencies"
    here = processes is None and executor is None
    try:
        with progress_bar(len(plan.items), plan.what, show=False if whole and here else progress) as advance:

            def store(number: int, outcome: Outcome | BaseException) -> None:
                outcomes[number] = CaseError.of(outcome) if isinstance(outcome, BaseException) else outcome
                advance(1)

            work_through(plan.work, plan.items, store, executor=executor, workers=processes, even=whole)
    except KeyboardInterrupt as stop:
        done = len(outcomes) - outcomes.count(NOT_RUN)
        msg = (
            f"The sweep was interrupted after {done} of {len(outcomes)} {plan.what}. What is done is kept in this "
            "exception: `except KeyboardInterrupt as stop: result = stop.result`, or sys.last_value.result afterwards."
        )
        raise SweepInterruptedError(msg, result=plan.join(outcomes)) from stop
    result = plan.join(outcomes)
    if result.failures:
        msg = f"{len(result.failures)} of {len(outcomes)} {plan.what} failed, first {result.failures[0]}"
        give_warning(msg, FailedCasesWarning)
    return result


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
    if len(cases) and (inputs is not None or outputs is not None):
        _require_signals(function, cases.arguments(0), inputs, outputs)
    if parameters is None and frequencies is not None and quantities == ("response",):
        shared = FrequencyWork(function=function, inputs=inputs, outputs=outputs)
        return _Plan(
            work=shared,
            items=frequencies.tolist(),
            what="frequencies",
            join=lambda outcomes: joined_frequencies(outcomes, frequencies),
        )
    work = CaseWork(function=function, compute=quantities, omega=frequencies, inputs=inputs, outputs=outputs)
    return _Plan(
        work=work,
        items=[cases.arguments(number) for number in range(len(cases))],
        what="cases",
        join=lambda outcomes: joined_cases(outcomes, cases, frequencies),
    )


def _require_signals(
    function: Callable[..., object], first: Mapping[str, object], inputs: Names, outputs: Names
) -> None:
    """Refuse names of signals at once that the first system does not have; what else fails is for its case to say."""
    try:
        made = function(**first)
    except (Exception, SystemExit):  # noqa: BLE001  # whatever the user's function raises
        return
    if isinstance(made, System):
        selected(made, inputs, outputs)


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
    if not isinstance(workers, int) or isinstance(workers, bool) or (workers < 1 and workers != EVERY_CORE):
        msg = f"workers = {workers}, but it must be a positive number of processes, or -1 for one a core."
        raise ParameterError(msg, parameter="workers", value=workers)
    return available_cores() if workers == EVERY_CORE else workers
