"""Processes that a sweep works with on this machine, each at the end of a pipe of its own.

A worker sends results as they come, so that whoever started it knows which item it is at: a worker that dies, or is
ended because its item takes too long, costs that item and no other. A worker ends with the process that started it,
however that ended: the pipe to the parent closes, which a thread of the worker waits for, and which on Linux is a
signal to the whole process, for work that does not let threads run.
"""

import multiprocessing
import multiprocessing.connection
import os
import pickle
import signal
import sys
import threading
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from halfdof_ctrl.base.errors import WorkerError
from halfdof_ctrl.base.progress import silence
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.sweeps.one_case import CaseError
from halfdof_ctrl.sweeps.waiting import Work

READY, FAILED, UNREAD, RESULTS = "ready", "failed", "unread", "results"  #: what a worker says first in a message
BATCH_SECONDS = 0.05  #: of work after which a worker sends what it has, where nobody waits for single results
PATIENCE = 5.0  #: [s] that an idle worker has to end by itself


class LostWorkerError(RuntimeError):
    """A worker process died each time that an item was given to it."""


class WorkerProcess:
    """A process that does chunks of items, and what it is at."""

    def __init__(self, work: Work, payload: bytes) -> None:
        """Start a process; `payload` is from `sent_work`.

        Raises
        ------
        WorkerError
            The system starts no more processes.
        """
        self.work = work
        self.is_ready = False
        self.chunk: list[int] = []  #: numbers of the items that it has not answered yet
        self.since = time.monotonic()  #: when it was last heard of
        context = _context()
        try:
            self.pipe, theirs = context.Pipe()
            self.process = context.Process(target=serve, args=(theirs,), name="halfdof_ctrl sweep")
            self.process.start()
        except (OSError, RuntimeError, AssertionError) as cause:  # no more processes, no main guard, a daemon's child
            raise _cannot_start(work, str(cause)) from cause
        theirs.close()
        with suppress(OSError):  # it died already, which is noticed when it is listened to
            self.pipe.send_bytes(payload)

    def give(self, chunk: list[int], items: bytes) -> None:
        """Give it a pickled list of items to do."""
        self.chunk, self.since = list(chunk), time.monotonic()
        with suppress(OSError):
            self.pipe.send_bytes(items)

    def heard(self) -> tuple[str, Any]:
        """Return what it says next: `RESULTS` and those of the next items, `READY`, or `UNREAD` and why.

        Raises
        ------
        EOFError
            It is dead.
        WorkerError
            It cannot load the work.
        """
        try:
            kind, content = pickle.loads(self.pipe.recv_bytes())  # noqa: S301  # from a process of our own
        except (EOFError, OSError) as cause:
            if self.is_ready:
                raise EOFError from cause
            raise _cannot_start(self.work, "it ended; its own words are on stderr") from cause
        if kind == FAILED:
            raise _cannot_start(self.work, content)
        self.is_ready, self.since = True, time.monotonic()
        return kind, content

    def has_words(self) -> bool:
        """Tell whether something can be heard, if only that it is dead."""
        try:
            return self.pipe.poll()
        except OSError:
            return True

    def kill(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def dismiss(self) -> None:
        """Tell it that there is nothing left to do."""
        self.pipe.close()

    def leave(self) -> None:
        """Wait until it has ended."""
        self.process.join(PATIENCE)
        if self.process.exitcode is None:
            self.process.kill()
            self.process.join()


def sent_work(work: Work, *, threads: int, prompt: bool) -> bytes:
    """Write the work as workers take it: with so many threads for linear algebra, and each result at once or not.

    Raises
    ------
    WorkerError
        A function that has no name that another process finds.
    """
    try:
        return pickle.dumps((work, threads, prompt))
    except Exception as cause:  # whatever an object raises that will not be pickled
        msg = (
            f"{work} cannot be sent to another process: {cause}. Write the function at the top level of a module "
            "(no lambda, no function within a function), or use an executor of threads or of Dask."
        )
        raise WorkerError(msg, function=str(work)) from cause


def serve(pipe: Connection) -> None:
    """Do chunks until the other end of the pipe is closed: what runs in the worker."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it without a word: the parent tells what became of it
    _end_with_parent()
    try:
        work, threads, prompt = pickle.loads(pipe.recv_bytes())  # noqa: S301  # from the process that started this one
    except EOFError:
        return
    except Exception as error:  # noqa: BLE001  # whatever the import of the user's module raises
        pipe.send_bytes(pickle.dumps((FAILED, f"{type(error).__name__}: {CaseError.of(error).message}")))
        return
    pipe.send_bytes(pickle.dumps((READY, None)))
    with suppress(EOFError, OSError):  # the parent has ended, or has all that it wants
        while True:
            message = pipe.recv_bytes()
            with limited_threads(threads), silence():
                _do_chunk(work, message, pipe, prompt=prompt)


def _do_chunk(work: Work, message: bytes, pipe: Connection, *, prompt: bool) -> None:
    """Do a chunk of items in steps that are sent as they come."""
    try:
        steps: list[list[Any]] = pickle.loads(message)  # noqa: S301  # from the process that started this one
    except Exception as error:  # noqa: BLE001  # whatever an object raises that cannot be made again
        pipe.send_bytes(pickle.dumps((UNREAD, CaseError.of(error))))
        return
    begin, ready = time.monotonic(), list[Any]()
    for step in steps:
        try:
            ready += work(step)
        except Exception as error:  # noqa: BLE001  # of work that raises all the same
            ready += [CaseError.of(error)] * len(step)
        if prompt or time.monotonic() - begin > BATCH_SECONDS:
            pipe.send_bytes(_pickled(ready))
            begin, ready = time.monotonic(), []
    if ready:
        pipe.send_bytes(_pickled(ready))


def _pickled(results: list[Any]) -> bytes:
    """Pickle results; one that cannot be sent is an error of its item alone."""
    try:
        return pickle.dumps((RESULTS, results))
    except Exception as error:  # noqa: BLE001  # whatever an object raises that will not be pickled
        if len(results) == 1:
            return pickle.dumps((RESULTS, [CaseError.of(error)]))
        single = [pickle.loads(_pickled([result]))[1] for result in results]  # noqa: S301  # written here
        return pickle.dumps((RESULTS, [result for (result,) in single]))


def _context() -> "multiprocessing.context.ForkServerContext | multiprocessing.context.SpawnContext":
    """Choose how processes start."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")  # forks from a process that has loaded the package, no more
    context.set_forkserver_preload(["halfdof_ctrl"])
    return context


def _cannot_start(work: Work, why: str) -> WorkerError:
    msg = (
        f"The worker processes cannot start, or cannot load {work}; {why}. "
        "A script that starts processes needs `if __name__ == '__main__':` before what it does, and a function "
        "that was typed into a notebook or an interpreter must be moved into a module that both can import."
    )
    return WorkerError(msg, function=str(work))


def _end_with_parent() -> None:
    """End this process when the one that started it has ended, by SIGKILL for example."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    sentinel = parent.sentinel

    def watch() -> None:
        multiprocessing.connection.wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="halfdof_ctrl parent watch", daemon=True).start()
    if sys.platform == "linux":
        import fcntl  # noqa: PLC0415  # Linux alone

        with suppress(OSError):  # a system that has no such signal has the thread
            fcntl.fcntl(sentinel, fcntl.F_SETOWN, os.getpid())
            fcntl.fcntl(sentinel, fcntl.F_SETFL, fcntl.fcntl(sentinel, fcntl.F_GETFL) | os.O_ASYNC)
