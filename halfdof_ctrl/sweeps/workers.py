"""Work on many items by the workers of an executor: in chunks, through crashes, and with their cores to themselves.

Items are handed over in chunks that take about `CHUNK_SECONDS`, measured as the work goes on, so that short ones are
not drowned by the way to the worker and back. A worker that dies loses nothing: what it may have been working on
is done again alone, in halves, until either all is done or a single item has killed `ATTEMPTS` workers on its own.

Linear algebra in a worker is held to its share of the cores (see `threads`).
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import suppress
from typing import Any, TypeAlias

from halfdof_ctrl.base.errors import WorkerError
from halfdof_ctrl.base.progress import silence
from halfdof_ctrl.base.threads import available_cores, limited_threads
from halfdof_ctrl.sweeps.process_pool import ProcessPool, Work

Store: TypeAlias = Callable[[int, Any], None]  #: takes the number of an item and its result or the error that it met
Chunk: TypeAlias = list[int]  #: numbers of items
CHUNK_SECONDS = 0.25  #: of work in a chunk
SHARES = 2  #: chunks that a worker still gets at least, so that none has all that is left
EVEN_SHARES = 4  #: chunks for each worker where all are cut at the beginning
ATTEMPTS = 3  #: workers that an item may kill on its own before it is given up
USUAL_WORKERS = 32  #: of an executor that does not say how many it has


class LostWorkerError(RuntimeError):
    """A worker process died each time that an item was given to it alone."""


def work_through(
    work: Work,
    items: Sequence[Any],
    store: Store,
    *,
    executor: Executor | None,
    workers: int | None,
    even: bool = False,
) -> None:
    """Do all items and store their results as they come.

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

    Raises
    ------
    WorkerError
        No worker can be started, or none can load the work.
    """
    if executor is not None:
        _work_elsewhere(work, items, store, executor, even=even)
    elif workers is not None:
        _work_in_processes(work, items, store, workers, even=even)
    else:
        _work_here(work, items, store, even=even)


def _work_here(work: Work, items: Sequence[Any], store: Store, *, even: bool) -> None:
    if even:  # all at once, which shows its own progress
        for number, result in enumerate(work(list(items))):
            store(number, result)
        return
    for number, item in enumerate(items):
        with silence():
            (result,) = work([item])
        store(number, result)


class _Waiting:
    """The items that nobody works on yet."""

    def __init__(self, count: int, workers: int, *, even: bool) -> None:
        self._left = deque(range(count))
        self._single: deque[int] = deque()  # of chunks that failed as a whole
        self._workers = workers
        self._size = math.ceil(count / (EVEN_SHARES * workers)) if even else None
        self._seconds = self._done = 0.0

    def __bool__(self) -> bool:
        return bool(self._left or self._single)

    def take(self) -> Chunk:
        """Return the next chunk: a single item as long as nobody knows how long one takes."""
        if not self._left:
            return [self._single.popleft()]
        size = self._size
        if size is None:
            share = math.ceil(len(self._left) / (SHARES * self._workers))
            size = min(share, int(CHUNK_SECONDS * self._done / max(self._seconds, 1e-9)))
        return [self._left.popleft() for _ in range(min(max(size, 1), len(self._left)))]

    def took(self, chunk: Chunk, seconds: float) -> None:
        """Remember how long a chunk took."""
        self._seconds += seconds
        self._done += len(chunk)

    def put_back(self, chunk: Chunk) -> None:
        """Return back what could not be handed over."""
        self._left.extendleft(reversed(chunk))

    def split(self, chunk: Chunk) -> None:
        """Have the items of a chunk done one by one, after the others."""
        self._single.extend(chunk)


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

    def run(self, executor: Executor, waiting: _Waiting, most: int) -> list[Chunk]:
        """Keep up to so many chunks on their way until all is done; give those that a broken executor has lost."""
        while waiting or self.running:
            while waiting and len(self.running) < most:
                chunk = waiting.take()
                try:
                    self.submit(executor, chunk)
                except BrokenExecutor:
                    waiting.put_back(chunk)
                    return self.collect(wait(self.running).done, waiting)
            lost = self.collect(wait(self.running, return_when=FIRST_COMPLETED).done, waiting)
            if lost:
                return lost + self.collect(wait(self.running).done, waiting)
        return []

    def collect(self, done: Iterable[Future[Any]], waiting: _Waiting) -> list[Chunk]:
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
    waiting, current = _Waiting(len(items), workers, even=even), _Round(work, items, store, threads=1)
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


def _work_in_processes(work: Work, items: Sequence[Any], store: Store, workers: int, *, even: bool) -> None:
    """Start processes for the work, and others for those that die."""
    workers = min(workers, len(items))
    current = _Round(work, items, store, threads=max(1, available_cores() // workers))
    waiting = _Waiting(len(items), workers, even=even)
    pool = ProcessPool(work, workers)
    try:
        while waiting:
            suspects = deque(current.run(pool.executor, waiting, most=workers))
            if suspects or waiting:
                pool.restart()
            while suspects:
                suspects.extendleft(_alone(pool, current, waiting, suspects.popleft()))
        pool.executor.shutdown()
    except WorkerError as error:  # a machine that starts no more processes, for example
        current.give_up(error)
    except BaseException:
        current.cancel()
        raise
    finally:
        pool.stop()


def _alone(pool: "ProcessPool", current: _Round, waiting: _Waiting, chunk: Chunk) -> list[Chunk]:
    """Do a chunk with nothing beside it; if its worker dies, give its halves, or fail the single item."""
    for _ in range(ATTEMPTS if len(chunk) == 1 else 1):
        with suppress(BrokenExecutor):  # a process that died with nothing to do counts like one that died at work
            current.submit(pool.executor, chunk)
            if not current.collect(wait(current.running).done, waiting):
                return []
        pool.restart()
    if len(chunk) == 1:
        msg = (
            f"the worker process died {ATTEMPTS} times, each time with this case alone at work in it: it crashed in "
            "compiled code, was out of memory, or was ended from outside. Run the case without workers to see where."
        )
        current.store(chunk, [LostWorkerError(msg)])
        return []
    middle = len(chunk) // 2
    return [chunk[middle:], chunk[:middle]]  # as extendleft takes them


def _error_of(future: Future[Any]) -> BaseException | None:
    try:
        return future.exception()
    except CancelledError as error:
        return error
