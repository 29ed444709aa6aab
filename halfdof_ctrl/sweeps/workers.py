"""Work on many items here, by the workers of an executor, or by processes that are started for it (see `crew`).

Items are handed over in chunks that take about a quarter of a second, measured as the work goes on, so that short ones
are not drowned by the way to the worker and back. What an executor loses is done again piece by piece, where it takes
more work.

Linear algebra in a worker is held to its share of the cores (see `threads`).
"""

import time
from collections.abc import Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from typing import Any

from halfdof_ctrl.base.progress import silence
from halfdof_ctrl.base.threads import available_cores, limited_threads
from halfdof_ctrl.sweeps.waiting import CHUNK_SECONDS, SHORT_SECONDS, Chunk, Store, Waiting, Work

USUAL_WORKERS = 32  #: of an executor that does not say how many it has
LONGEST_WAIT = 1.0  #: [s] an interrupt that comes as a wait begins is heard at its end
PIECES = 20  #: of even work that is done here and whose results are wanted as they come


def work_through(
    work: Work,
    items: Sequence[Any],
    store: Store,
    *,
    executor: Executor | None,
    workers: int | None,
    even: bool = False,
    timeout: float | None = None,
    prompt: bool = False,
    trusted: bool = False,
) -> str:
    """Do all items and store their results as they come; say in words where they were done.

    Parameters
    ----------
    work : callable
        Does a list of items. What it raises all the same (a pickle that fails) becomes the result of each of them.
    items : sequence
    store : callable
        Called here with the number of the item and its result.
    executor : concurrent.futures.Executor, optional
        Where to work; it is left open.
    workers : int, optional
        Without an executor: how many processes to start for it; None to work here.
    even : bool
        Cut the items into equal chunks instead of measuring: for work that takes its time once for each chunk.
    timeout : float, optional
        Seconds that an item may take in a process.
    prompt : bool
        Have results as soon as they are there.
    trusted : bool
        The work cannot end this process, so that it is tried here before processes are started for it.

    Raises
    ------
    WorkerError
        No worker can be started, or none can load the work.
    """
    if executor is not None:
        _work_elsewhere(work, items, store, executor, even=even)
        return "in the executor"
    if workers is None:
        if even:
            _work_here_evenly(work, items, store, pieces=PIECES if prompt else 1)
        else:
            _work_here(work, items, store)
        return "in this process"
    done = 0
    if trusted and not even and timeout is None:
        with limited_threads(max(1, available_cores() // workers)):  # the same numbers wherever a case is done
            done = _work_here(work, items, store, while_short=True)
        if done == len(items):
            return "in this process, since it was too short for others"

    from halfdof_ctrl.sweeps.crew import work_in_processes  # noqa: PLC0415  # multiprocessing costs time to import

    def store_rest(number: int, result: object) -> None:
        store(done + number, result)

    return work_in_processes(work, items[done:], store_rest, workers, even=even, timeout=timeout, prompt=prompt)


def _work_here(work: Work, items: Sequence[Any], store: Store, *, while_short: bool = False) -> int:
    """Do items one by one, if asked only while they look too short for processes; give how many are done."""
    begin = time.monotonic()
    for number, item in enumerate(items):
        with silence():
            (result,) = work([item])
        store(number, result)
        spent, left = time.monotonic() - begin, len(items) - number - 1
        if while_short and spent > CHUNK_SECONDS and spent / (number + 1) * left > SHORT_SECONDS:
            return number + 1
    return len(items)


def _work_here_evenly(work: Work, items: Sequence[Any], store: Store, *, pieces: int) -> None:
    """Do items in a few pieces, each of which shows its own progress."""
    size = -(-len(items) // pieces) or 1
    for first in range(0, len(items), size):
        for number, result in enumerate(work(list(items[first : first + size])), start=first):
            store(number, result)


class _Round:
    """Chunks on their way through one executor, as long as it lives."""

    def __init__(self, work: Work, items: Sequence[Any], store: Store, threads: int) -> None:
        self._work, self._items, self._store, self._threads = work, items, store, threads
        self.running: dict[Future[Any], Chunk] = {}
        self.stored: set[int] = set()

    def store(self, chunk: Chunk, results: Sequence[Any]) -> None:
        """Store the results of some items, or the errors that they met."""
        for number, result in zip(chunk, results, strict=True):
            self._store(number, result)
            self.stored.add(number)

    def submit(self, executor: Executor, chunk: Chunk) -> None:
        """Hand a chunk over."""
        items = [self._items[number] for number in chunk]
        self.running[executor.submit(run_chunk, self._work, items, self._threads)] = chunk

    def run(self, executor: Executor, waiting: Waiting, most: int) -> list[Chunk]:
        """Keep up to so many chunks on their way until all is done; give those that a broken executor has lost."""
        while waiting or self.running:
            while waiting and len(self.running) < most:
                chunk = waiting.take()
                try:
                    self.submit(executor, chunk)
                except BrokenExecutor:
                    waiting.put_back(chunk)
                    return self.collect(wait(self.running).done, waiting)
            back = wait(self.running, timeout=LONGEST_WAIT, return_when=FIRST_COMPLETED).done
            lost = self.collect(back, waiting)
            if lost:
                return lost + self.collect(wait(self.running).done, waiting)
        return []

    def collect(self, done: Iterable[Future[Any]], waiting: Waiting) -> list[Chunk]:
        """Store what has come back; give the chunks that were lost with their worker."""
        lost = []
        for future in done:
            chunk = self.running[future]
            error = _error_of(future)
            if error is None:
                results, seconds = future.result()
                waiting.took(chunk, seconds)
                self.store(chunk, results)
            elif isinstance(error, BrokenExecutor):
                lost.append(chunk)
            elif len(chunk) > 1:  # Dask gives up a chunk that has killed workers, guilty items and innocent ones
                waiting.split(chunk)
            else:
                self.store(chunk, [error])
            del self.running[future]  # last, so that Ctrl-C before it loses nothing
        return lost

    def cancel(self) -> None:
        """Take back what has not begun, and store what was done in the meantime."""
        for future in self.running:
            future.cancel()
        for future in [future for future in self.running if future.done() and _error_of(future) is None]:
            self.store(self.running.pop(future), future.result()[0])

    def give_up(self, error: BaseException) -> None:
        """Have all fail that is not done yet."""
        self.cancel()
        rest = [number for number in range(len(self._items)) if number not in self.stored]
        self.store(rest, [error] * len(rest))


def run_chunk(work: Work, items: list[Any], threads: int) -> tuple[list[Any], float]:
    """Do a chunk in a worker, with so many threads for linear algebra; tell how long it took [s]."""
    start = time.perf_counter()
    with limited_threads(threads), silence():
        results = work(items)
    return results, time.perf_counter() - start


def _work_elsewhere(work: Work, items: Sequence[Any], store: Store, executor: Executor, *, even: bool) -> None:
    """Use an executor that was given: when it takes no more work, what is left fails with its error."""
    workers = _workers_of(executor)
    waiting, current = Waiting(len(items), workers, even=even), _Round(work, items, store, threads=1)
    try:
        if current.run(executor, waiting, most=2 * workers) or waiting:
            msg = "the executor broke: one of its workers died, and it takes no more work"
            current.give_up(BrokenExecutor(msg))
    except Exception as error:  # whatever an executor of others raises when it is given work
        current.cancel()
        if not current.stored:
            raise
        current.give_up(error)
    except BaseException:
        current.cancel()
        raise


def _workers_of(executor: Executor) -> int:
    """Ask an executor how much it can do at a time."""
    said = [getattr(executor, name, None) for name in ("num_workers", "_max_workers")]  # of mpi4py, of Python
    client = getattr(executor, "_client", None)  # of Dask, which may start more workers when there is work
    if client is not None:
        said.append(max(sum(client.ncores().values()), USUAL_WORKERS))
    return max([number for number in said if isinstance(number, int) and number > 0], default=USUAL_WORKERS)


def _error_of(future: Future[Any]) -> BaseException | None:
    try:
        return future.exception()
    except CancelledError as error:
        return error
