"""Threads of linear algebra in workers."""

import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier, Thread

import matplotlib as mpl
import numpy as np
import threadpoolctl
from numpy.testing import assert_array_equal

from halfdof_ctrl import crosscheck, frequency_response, hydromount, load_model, mech2ss, save_model, sweep
from halfdof_ctrl.base.threads import available_cores, limited_threads
from support import sweepcases

EIGHT = 8  #: threads at work at a time


def thread_counts() -> list[int]:
    """Give the number of threads of each library of linear algebra."""
    return [library["num_threads"] for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"]


def test_workers_have_their_share_of_the_cores() -> None:
    """Processes that are started here share the cores; in a given executor everybody has one thread."""
    share = max(1, available_cores() // 2)
    assert (np.asarray(sweep(sweepcases.threads, {"x": range(2)}, workers=2).values) <= share).all()
    with ThreadPoolExecutor(2) as executor:
        assert_array_equal(np.asarray(sweep(sweepcases.threads, {"x": range(4)}, executor=executor).values), 1)


def test_threads_are_given_back_after_the_last_user() -> None:
    """Two chunks at work in one process: the first that ends changes nothing for the other, whichever thread it is."""
    before = thread_counts()
    first, second = limited_threads(1), limited_threads(1)
    for step in (first.__enter__, second.__enter__):
        thread = Thread(target=step)
        thread.start()
        thread.join()
        assert set(thread_counts()) == {1}
    first.__exit__(None, None, None)
    assert set(thread_counts()) == {1}
    second.__exit__(None, None, None)
    assert thread_counts() == before


def test_eight_threads_leave_the_process_as_it_was(tmp_path: Path) -> None:
    """Calls that overlap in any order put back the threads of BLAS, and touch neither filters nor rcParams."""
    model = hydromount()
    save_model(model, tmp_path / "mount.npz")
    before = thread_counts(), list(warnings.filters), dict(mpl.rcParams), np.geterr()
    together = Barrier(EIGHT)

    def work(number: int) -> None:
        together.wait()
        for _ in range(3):
            with limited_threads(1):
                load_model(tmp_path / "mount.npz")
                assert set(thread_counts()) == {1}
            frequency_response(model, np.geomspace(1.0, 100.0, 20 + number))
            crosscheck(model, mech2ss(model))

    with ThreadPoolExecutor(EIGHT) as executor:
        list(executor.map(work, range(EIGHT)))
    assert (thread_counts(), list(warnings.filters), dict(mpl.rcParams), np.geterr()) == before


def test_a_limit_raises_nothing() -> None:
    """Who allows one thread gets no more by a larger share."""
    with threadpoolctl.threadpool_limits(1), limited_threads(64):
        assert set(thread_counts()) == {1}
