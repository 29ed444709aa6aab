"""Work spread over processes, through crashes, broken pools and Ctrl-C; chunks and threads."""

import os
import pickle
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_array_equal

from halfdof_ctrl import hydromount, sweep
from halfdof_ctrl.base.errors import FailedCasesWarning, SweepInterruptedError, WorkerError
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.sweeps import crew
from halfdof_ctrl.sweeps.crew import ATTEMPTS
from halfdof_ctrl.sweeps.one_case import CaseError
from halfdof_ctrl.sweeps.process_pool import WorkerProcess
from halfdof_ctrl.sweeps.waiting import CHUNK_SECONDS, Waiting, Work
from halfdof_ctrl.sweeps.workers import work_through
from support import sweepcases

pytestmark = pytest.mark.processes

COUNT = 40
START = "forkserver" if sys.platform == "linux" else "spawn"  #: the server that the sweep uses is there already
SQUARES = np.arange(COUNT) ** 2


@pytest.fixture
def _ctrl_c() -> Iterator[None]:
    """Have SIGINT raise KeyboardInterrupt, as in an interpreter."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Inline(Executor):
    """An executor that works at once, and loses chunks of more than one item."""

    num_workers = 2

    def __init__(self) -> None:
        self.chunks: list[list[Any]] = []
        self.patience = 1000

    def submit(self, fn: Callable[..., Any], /, *args: Any, **_: Any) -> Future[Any]:  # noqa: ANN401
        """Work here and now."""
        if len(self.chunks) >= self.patience:
            msg = "closed"
            raise RuntimeError(msg)
        future: Future[Any] = Future()
        items = args[1]
        self.chunks.append(items)
        if len(items) > 1:
            future.set_exception(RuntimeError("too many"))
        else:
            future.set_result(fn(*args))
        return future


def squares(items: list[int]) -> list[int]:
    """Square some numbers."""
    return [item * item for item in items]


# --- processes that the sweep starts


def test_processes_give_what_this_process_gives() -> None:
    """The same numbers to the last bit, from processes none of which is this one."""
    asked: dict[str, Any] = {"C_h": [100.0, 300.0], "K_v": np.linspace(100.0, 900.0, 10)}
    omega = np.geomspace(1.0, 50.0, 20)
    with limited_threads(1):
        here = sweep(hydromount, asked, omega=omega, inputs="F_y", outputs="y")
    there = sweep(sweepcases.mount, asked, omega=omega, inputs="F_y", outputs="y", workers=2)
    assert_array_equal(np.asarray(there.response), np.asarray(here.response))
    assert_array_equal(np.asarray(there.poles), np.asarray(here.poles))
    processes = set(np.asarray(sweep(sweepcases.process, {"x": range(4)}, workers=2).values).tolist())
    assert os.getpid() not in processes


def test_a_process_that_dies_loses_nothing(tmp_path: Path) -> None:
    """Its work is done again by another."""
    result = sweep(sweepcases.end_process_once, {"x": range(COUNT), "fatal": 7, "folder": str(tmp_path)}, workers=2)
    assert (tmp_path / "ended").exists()
    assert_array_equal(np.asarray(result.values), SQUARES)
    assert not result.failures


def test_a_case_that_ends_each_process_fails_alone() -> None:
    """After as many attempts as there are, with its own name; all others are done."""
    with pytest.warns(
        FailedCasesWarning, match="1 of 40 cases failed, first x = 7: LostWorkerError: the worker process"
    ):
        result = sweep(sweepcases.end_process, {"x": range(COUNT), "fatal": 7}, workers=2)
    assert [(failure.case, failure.kind) for failure in result.failures] == [((7,), "LostWorkerError")]
    assert f"died {ATTEMPTS} times" in result.failures[0].message
    assert_array_equal(np.asarray(result.values), np.where(np.arange(COUNT) == 7, np.nan, SQUARES))


def test_a_machine_that_starts_no_more_processes_keeps_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rest fails with that reason."""
    started: list[WorkerProcess] = []

    def only_once(work: Work, payload: bytes) -> WorkerProcess:
        if started:
            msg = "no more processes"
            raise WorkerError(msg, function="end_process")
        started.append(WorkerProcess(work, payload))
        return started[0]

    monkeypatch.setattr(crew, "WorkerProcess", only_once)
    with pytest.warns(FailedCasesWarning, match="WorkerError: no more processes"):
        result = sweep(sweepcases.end_process, {"x": range(COUNT), "fatal": 7}, workers=1)
    assert_array_equal(np.asarray(result.values)[:1], [0])
    assert result.failures[-1].case == (COUNT - 1,)


@pytest.mark.usefixtures("_ctrl_c")
def test_ctrl_c_keeps_what_processes_have_done() -> None:
    """At case 20, which would take a minute: at once, with most of the cases before it and none after."""
    start = time.perf_counter()
    with pytest.raises(SweepInterruptedError, match=r"interrupted after \d+ of 40 cases.*stop.result") as stop:
        sweep(sweepcases.interrupt_parent, {"x": range(COUNT), "at": 20, "parent": os.getpid()}, workers=2)
    assert time.perf_counter() - start < 30.0
    result: Any = stop.value.result
    done = ~np.isnan(result.values)
    assert_array_equal(result.values[done], SQUARES[done])
    assert done.any()
    assert not done[20]
    assert {failure.kind for failure in result.failures} == {"NotRun"}
    assert len(result.failures) == COUNT - np.count_nonzero(done)


def test_a_function_that_cannot_be_sent_is_refused() -> None:
    """A lambda has no name that another process finds."""
    with pytest.raises(WorkerError, match="lambda> cannot be sent to another process") as refusal:
        sweep(lambda x: x, {"x": [1, 2]}, workers=2)
    assert "lambda" in refusal.value.function


def test_a_function_that_processes_do_not_find_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that was typed into a notebook: it can be sent by its name, but nobody there knows the name."""

    def typed_in(x: float) -> float:
        return x

    monkeypatch.setattr(typed_in, "__qualname__", "typed_in")
    monkeypatch.setattr(sweepcases, "typed_in", typed_in, raising=False)
    monkeypatch.setattr(typed_in, "__module__", "support.sweepcases")
    with pytest.raises(WorkerError, match=r"cannot load typed_in; .* must be moved into a module"):
        sweep(typed_in, {"x": [1, 2]}, workers=1)


# --- executors that are given


def test_a_given_pool_that_breaks_keeps_what_is_done() -> None:
    """The rest of the cases, and all of the next sweep, fails with the reason."""
    with ProcessPoolExecutor(1, mp_context=get_context(START)) as executor:
        assert_array_equal(np.asarray(sweep(sweepcases.threads, {"x": [1]}, executor=executor).values), [1])
        with pytest.warns(FailedCasesWarning, match="the executor broke"):
            result = sweep(sweepcases.end_process, {"x": range(COUNT), "fatal": 7}, executor=executor)
        with pytest.warns(FailedCasesWarning, match="40 of 40 cases failed"):
            sweep(sweepcases.end_process, {"x": range(COUNT), "fatal": 7}, executor=executor)
    values = np.asarray(result.values)
    done = ~np.isnan(values)
    assert_array_equal(values[done], SQUARES[done])
    assert done[0]
    assert not done[7]
    assert {failure.kind for failure in result.failures} == {"BrokenExecutor"}
    assert len(result.failures) == COUNT - np.count_nonzero(done)


def test_threads_need_no_pickling() -> None:
    """A lambda works, and the executor stays open."""
    with ThreadPoolExecutor(2) as executor:
        result = sweep(lambda x: x * x, {"x": range(COUNT)}, executor=executor)
        assert executor.submit(int, "7").result() == 7
    assert_array_equal(np.asarray(result.values), SQUARES)


def test_a_chunk_that_is_lost_as_a_whole_is_done_piece_by_piece() -> None:
    """As Dask gives up a chunk for one bad case in it: each item is tried alone."""
    executor = Inline()
    results: dict[int, int] = {}
    work_through(squares, range(COUNT), results.__setitem__, executor=executor, workers=None, even=True)
    assert max(map(len, executor.chunks)) > 1
    assert results == dict(enumerate(SQUARES.tolist()))


def test_an_executor_that_takes_no_more_work_keeps_what_is_done() -> None:
    """Whatever it raises; where nothing is done at all, the error comes through."""
    executor = Inline()
    executor.patience = 3
    with pytest.warns(FailedCasesWarning, match="37 of 40 cases failed, first x = 3: RuntimeError: closed"):
        result = sweep(sweepcases.square, {"x": range(COUNT)}, executor=executor)
    assert_array_equal(np.asarray(result.values)[:3], SQUARES[:3])
    with pytest.raises(RuntimeError, match="closed"):
        sweep(sweepcases.square, {"x": range(COUNT)}, executor=executor)


def test_an_error_of_the_executor_is_that_of_the_case() -> None:
    """A function that a process pool cannot pickle fails case by case, with Python's reason, whatever its words are."""

    def local(x: int) -> int:
        return x

    with pytest.raises((AttributeError, pickle.PicklingError)) as refusal:
        pickle.dumps(local)
    reason = re.escape(f"{refusal.typename}: {refusal.value}")
    with (
        ProcessPoolExecutor(1, mp_context=get_context(START)) as executor,
        pytest.warns(FailedCasesWarning, match=f"2 of 2 cases failed, first x = 1: {reason}"),
    ):
        result = sweep(local, {"x": [1, 2]}, executor=executor)
    assert result.values is None


@pytest.mark.usefixtures("_ctrl_c")
def test_ctrl_c_takes_back_what_an_executor_has_not_begun() -> None:
    """What it is at goes on, and the executor stays open."""
    begun: list[int] = []
    stopped = threading.Event()

    def interrupting(x: int) -> int:
        begun.append(x)
        if x == 3:
            os.kill(os.getpid(), signal.SIGINT)
            stopped.wait(60.0)
        else:
            time.sleep(1.1 * CHUNK_SECONDS)  # a chunk is one case
        return x

    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(SweepInterruptedError) as stop:
            sweep(interrupting, {"x": range(COUNT)}, executor=executor)
        stopped.set()
        assert executor.submit(int, "7").result() == 7
    result: Any = stop.value.result
    assert_array_equal(result.values[:3], np.arange(3))
    assert np.isnan(result.values[3:]).all()
    assert begun == [0, 1, 2, 3]


# --- chunks


@given(
    count=st.integers(1, 500), workers=st.integers(1, 9), even=st.booleans(), seconds=st.sampled_from([1e-6, 0.01, 3.0])
)
def test_chunks_contain_every_item_once_and_none_is_long(count: int, workers: int, even: bool, seconds: float) -> None:  # noqa: FBT001
    """Whatever the time that an item takes; one that takes long is alone in its chunk."""
    waiting, seen = Waiting(count, workers, even=even), list[int]()
    while waiting:
        chunk = waiting.take()
        waiting.took(chunk, seconds * len(chunk))
        seen += chunk
        assert even or len(chunk) * seconds <= max(CHUNK_SECONDS, seconds)
    assert seen == list(range(count))


def test_short_items_travel_together() -> None:
    """A thousand items of a microsecond take a few dozen chunks, not a thousand."""
    waiting, chunks = Waiting(1000, 2, even=False), 0
    while waiting:
        chunk = waiting.take()
        waiting.took(chunk, 1e-6 * len(chunk))
        chunks += 1
    assert chunks < 40


def test_even_chunks_are_a_few_for_each_worker() -> None:
    """Work that takes its time once a chunk is cut at the beginning."""
    waiting = Waiting(800, 2, even=True)
    assert [len(waiting.take()) for _ in range(8)] == [100] * 8
    assert not waiting


def test_errors_keep_where_they_came_from() -> None:
    """The traceback of a worker is text, since frames cannot be sent."""
    error = CaseError.of(ZeroDivisionError("division by zero"))
    assert (error.kind, error.message) == ("ZeroDivisionError", "division by zero")
    assert "ZeroDivisionError" in error.traceback
