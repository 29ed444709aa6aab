"""Work on many items by processes that are started for it, through deaths, items without end, and Ctrl-C.

One process begins. The others are started when what is left would take it longer than `SHORT_SECONDS`: a sweep that is
too short for processes pays for one. It is a process all the same, since a case may end the process that it is in.
"""

import math
import pickle
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from typing import Any

from halfdof_ctrl.base.errors import WorkerError
from halfdof_ctrl.base.threads import available_cores
from halfdof_ctrl.sweeps.one_case import CaseError
from halfdof_ctrl.sweeps.process_pool import (
    BATCH_SECONDS,
    RESULTS,
    UNREAD,
    LostWorkerError,
    WorkerProcess,
    sent_work,
)
from halfdof_ctrl.sweeps.waiting import SHORT_SECONDS, Chunk, Store, Waiting, Work

ATTEMPTS = 3  #: workers that an item may end before it is given up
TICK_SECONDS = 0.1  #: between two looks at the clock


def work_in_processes(
    work: Work,
    items: Sequence[Any],
    store: Store,
    workers: int,
    *,
    even: bool = False,
    timeout: float | None = None,
    prompt: bool = False,
) -> str:
    """Start processes for the work, and others for those that die; say how many it took.

    Parameters
    ----------
    work, items, store, even
        As in `workers.work_through`.
    workers : int
        Most processes at a time.
    timeout : float, optional
        Seconds that one item may take.
    prompt : bool
        Have results at once, one by one, instead of in batches.

    Raises
    ------
    WorkerError
        No process can be started, or none can load the work.
    """
    crew = _Crew(work, items, store, min(workers, len(items)), even=even, timeout=timeout, prompt=prompt)
    try:
        crew.run()
    except BaseException:
        crew.end()
        raise
    crew.close()
    if crew.started == 1 < workers:
        return "in one process, since it was too short for more"
    return f"in {crew.started} process{'es' * (crew.started != 1)}"


class _Crew:
    """The processes and what they are at."""

    def __init__(
        self,
        work: Work,
        items: Sequence[Any],
        store: Store,
        most: int,
        *,
        even: bool,
        timeout: float | None,
        prompt: bool,
    ) -> None:
        self._work, self._items, self._store, self._most = work, items, store, most
        self._even, self._timeout = even, timeout
        self._prompt = prompt or timeout is not None
        self._payload = sent_work(work, threads=max(1, available_cores() // max(most, 1)), prompt=self._prompt)
        self._waiting = Waiting(len(items), most, even=even)
        self._deaths: Counter[int] = Counter()
        self._stored: set[int] = set()
        self._workers: list[WorkerProcess] = []
        self._wanted = 1  #: processes that there should be
        self.started = 0  #: the most that there were at a time

    def run(self) -> None:
        """Do everything."""
        try:
            self._start()
            while self._waiting or any(worker.chunk for worker in self._workers):
                self._step()
        except WorkerError as error:  # of a machine that starts no more processes, for example
            if not self._stored:
                raise
            self._listen(0.0)
            for number in range(len(self._items)):
                if number not in self._stored:
                    self._keep(number, error)

    def close(self) -> None:
        """Let all processes end that have nothing left to do."""
        for worker in self._workers:
            worker.dismiss()
        for worker in self._workers:
            worker.leave()

    def end(self) -> None:
        """Keep what has been done, and end all processes at once."""
        with suppress(Exception):  # a message that Ctrl-C has cut in two
            self._listen(0.0)
        for worker in self._workers:
            worker.kill()

    def _step(self) -> None:
        if self._wanted < self._most and self._seconds_left() > SHORT_SECONDS:
            self._wanted = self._most
        while len(self._workers) < min(self._wanted, len(self._waiting) + self._busy()):
            try:
                self._start()
            except WorkerError:  # fewer do it too
                if not self._workers:
                    raise
                self._wanted = self._most = len(self._workers)
        for worker in self._workers:
            if worker.is_ready and not worker.chunk and self._waiting:
                self._give(worker, self._waiting.take())
        self._listen(self._tick())
        self._end_overdue()

    def _start(self) -> None:
        self._workers.append(WorkerProcess(self._work, self._payload))
        self.started = max(self.started, len(self._workers))

    def _busy(self) -> int:
        return sum(bool(worker.chunk) for worker in self._workers)

    def _give(self, worker: WorkerProcess, chunk: Chunk) -> None:
        """Hand a chunk over; what cannot be sent fails alone."""
        items = [self._items[number] for number in chunk]
        try:
            message = pickle.dumps([items] if self._even else [[item] for item in items])
        except Exception as error:  # noqa: BLE001  # whatever an object raises that will not be pickled
            self._unsent(chunk, error)
            return
        worker.give(chunk, message)

    def _unsent(self, chunk: Chunk, error: object) -> None:
        if len(chunk) == 1:
            self._keep(chunk[0], error)
        else:
            self._waiting.split(chunk)

    def _listen(self, seconds: float | None) -> None:
        """Wait so long (None: for ever) until a worker says something, and hear all that have."""
        wait([one for worker in self._workers for one in (worker.pipe, worker.process.sentinel)], seconds)
        for worker in list(self._workers):
            while worker in self._workers and worker.has_words():
                self._hear(worker)

    def _hear(self, worker: WorkerProcess) -> None:
        before = worker.since
        try:
            kind, content = worker.heard()
        except EOFError:
            self._bury(worker)
        except WorkerError:
            self._workers.remove(worker)
            worker.kill()
            if not self._workers:
                raise
            self._wanted = self._most = len(self._workers)
        else:
            if kind == UNREAD:
                chunk, worker.chunk = worker.chunk, []
                self._unsent(chunk, content)
            elif kind == RESULTS:
                done, worker.chunk = worker.chunk[: len(content)], worker.chunk[len(content) :]
                self._waiting.took(done, worker.since - before)
                for number, result in zip(done, content, strict=True):
                    self._keep(number, result)

    def _bury(self, worker: WorkerProcess) -> None:
        """Have the chunk of a dead worker done again: the item that it was at alone, if that is known."""
        self._workers.remove(worker)
        worker.kill()
        chunk = worker.chunk
        if not chunk:
            return
        suspects, rest = (chunk[:1], chunk[1:]) if self._prompt and not self._even else (chunk, [])
        self._waiting.put_back(rest)
        if len(suspects) > 1:
            middle = len(suspects) // 2
            self._waiting.again(suspects[:middle])
            self._waiting.again(suspects[middle:])
            return
        (number,) = suspects
        self._deaths[number] += 1
        if self._deaths[number] < ATTEMPTS:
            self._waiting.again(suspects)
            return
        msg = (
            f"the worker process died {ATTEMPTS} times, each time with this case at work in it: it crashed in compiled "
            "code, was out of memory, or was ended from outside. Run the case without workers to see where."
        )
        self._keep(number, LostWorkerError(msg))

    def _end_overdue(self) -> None:
        """End the workers whose item takes too long."""
        if self._timeout is None:
            return
        now = time.monotonic()
        for worker in [worker for worker in self._workers if worker.chunk and now - worker.since > self._limit(worker)]:
            if worker.has_words():  # it has just made it
                continue
            self._workers.remove(worker)
            worker.kill()
            if self._even and len(worker.chunk) > 1:
                self._waiting.split(worker.chunk)
                continue
            self._waiting.put_back(worker.chunk[1:])
            msg = (
                f"the case was not done after timeout = {self._timeout:g} s, and its process was ended. Give more time "
                "by timeout, or run the case alone to see what it is at."
            )
            self._keep(worker.chunk[0], TimeoutError(msg))

    def _limit(self, worker: WorkerProcess) -> float:
        """Return the seconds that a worker may be silent."""
        timeout = math.inf if self._timeout is None else self._timeout
        return timeout * len(worker.chunk) if self._even else timeout

    def _tick(self) -> float | None:
        """Return how long nothing has to be looked at [s]."""
        now = time.monotonic()
        ends = [worker.since + self._limit(worker) - now for worker in self._workers if worker.chunk]
        ticks = [max(end, 0.0) for end in ends if math.isfinite(end)]
        if self._wanted < self._most:
            ticks.append(TICK_SECONDS)
        return min(ticks, default=None)

    def _seconds_left(self) -> float:
        """Estimate how long one process would take for what nobody works on yet, by what has been seen."""
        now, left = time.monotonic(), len(self._waiting)
        pace = self._waiting.pace
        for worker in self._workers:
            if worker.chunk:
                item = (now - worker.since) / len(worker.chunk) if self._even else now - worker.since - BATCH_SECONDS
                pace = max(pace, item)
        return pace * left

    def _keep(self, number: int, result: object) -> None:
        self._store(number, CaseError.of(result) if isinstance(result, BaseException) else result)
        self._stored.add(number)
