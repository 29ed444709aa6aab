"""How many cores there are, and how many threads linear algebra may use of them.

NumPy and SciPy start as many threads as there are cores, in every process. Threads of several processes that wait for
each other on the same cores can be tens of times slower than one thread each.
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any


def available_cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Limit:
    """How many chunks are at work in this process, and who keeps its threads down for all of them."""

    lock = threading.Lock()
    users = 0
    keeper: "_Keeper"


class _Keeper(threading.Thread):
    """Holds the limit, since OpenBLAS with its own threads listens only to the thread that was first to set one."""

    def __init__(self, most: int) -> None:
        super().__init__(name="halfdof_ctrl thread limit", daemon=True)
        self.controller = _thread_controller(len(sys.modules))
        self.limits: dict[str, int] = {}
        for library in self.controller.info():
            prefix = library["prefix"]
            self.limits[prefix] = min(self.limits.get(prefix, most), library["num_threads"])
        self.is_set, self.is_over = threading.Event(), threading.Event()

    def run(self) -> None:
        """Set the limit, and undo it when it is over."""
        with self.controller.limit(limits=self.limits):
            self.is_set.set()
            self.is_over.wait()


@contextmanager
def limited_threads(most: int) -> Iterator[None]:
    """Hold the threads of BLAS and OpenMP in this process to a number; several threads may ask for it at a time."""
    with _Limit.lock:
        _Limit.users += 1
        if _Limit.users == 1:
            _Limit.keeper = _Keeper(most)
            _Limit.keeper.start()
            _Limit.keeper.is_set.wait()
        keeper = _Limit.keeper
    try:
        with keeper.controller.limit(limits=keeper.limits):  # OpenMP asks every thread for its own limit
            yield
    finally:
        with _Limit.lock:
            _Limit.users -= 1
            if _Limit.users == 0:
                keeper.is_over.set()
                keeper.join()


@lru_cache(maxsize=1)
def _thread_controller(modules: int) -> Any:  # noqa: ANN401, ARG001  # threadpoolctl has no types
    """Look for the libraries with threads; again when there are more modules, which may have brought some."""
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415  # only workers need it

    return ThreadpoolController()
