"""Processes that a sweep works with on this machine."""

import pickle
import signal
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor
from typing import Any, TypeAlias

from halfdof_ctrl.base.errors import WorkerError

Work: TypeAlias = Callable[[list[Any]], list[Any]]  #: gives one result for each item and raises nothing


class ProcessPool:
    """A process pool that can be started anew."""

    def __init__(self, work: Work, workers: int) -> None:
        self._work, self._workers = work, workers
        try:
            pickle.dumps(work)
        except Exception as cause:  # whatever an object raises that will not be pickled
            msg = (
                f"{work} cannot be sent to another process: {cause}. Write the function at the top level of a module "
                "(no lambda, no function within a function), or use an executor of threads or of Dask."
            )
            raise WorkerError(msg, function=str(work)) from cause
        self.executor = self._started()

    def _started(self) -> Executor:
        """Start all processes and wait until each has loaded the work."""
        import multiprocessing  # noqa: PLC0415  # costs time, which a bare import of the package does not need
        from concurrent.futures import ProcessPoolExecutor  # noqa: PLC0415

        if sys.platform == "linux":  # forks from a process that has loaded the package, and nothing else
            context = multiprocessing.get_context("forkserver")
            context.set_forkserver_preload(["halfdof_ctrl"])
        else:
            context = multiprocessing.get_context("spawn")
        executor = ProcessPoolExecutor(self._workers, mp_context=context, initializer=_prepare_process)
        try:
            for ready in [executor.submit(_load, self._work) for _ in range(self._workers)]:
                ready.result()
        except (BrokenExecutor, RuntimeError) as cause:
            _stop(executor)
            msg = (
                f"The worker processes cannot start, or cannot load {self._work}; their own words are on stderr. "
                "A script that starts processes needs `if __name__ == '__main__':` before what it does, and a function "
                "that was typed into a notebook or an interpreter must be moved into a module that both can import."
            )
            raise WorkerError(msg, function=str(self._work)) from cause
        except BaseException:
            _stop(executor)
            raise
        return executor

    def restart(self) -> None:
        """Replace a broken pool."""
        self.stop()
        self.executor = self._started()

    def stop(self) -> None:
        """End all processes at once."""
        _stop(self.executor)


def _stop(executor: Executor) -> None:
    for process in list((getattr(executor, "_processes", None) or {}).values()):  # Python 3.14 has a public way
        process.terminate()
    executor.shutdown(cancel_futures=True)


def _prepare_process() -> None:
    """Let Ctrl-C end a worker without a word: the main process tells what became of the work."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _load(work: Work) -> None:
    """Show that the work has arrived."""
