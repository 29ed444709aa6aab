"""Threads of linear algebra in workers."""

from concurrent.futures import ThreadPoolExecutor
from threading import Thread

import numpy as np
import threadpoolctl
from numpy.testing import assert_array_equal

from halfdof_ctrl import sweep
from halfdof_ctrl.base.threads import available_cores, limited_threads
from support import sweepcases


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


def test_a_limit_raises_nothing() -> None:
    """Who allows one thread gets no more by a larger share."""
    with threadpoolctl.threadpool_limits(1), limited_threads(64):
        assert set(thread_counts()) == {1}
