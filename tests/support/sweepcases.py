"""Functions that worker processes of the sweep tests import: they count, fail, wait, and end their own process."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import threadpoolctl

from halfdof_ctrl import SecondOrderModel, hydromount, mechss


def oscillator(*, k: float, m: float = 1.0) -> SecondOrderModel:
    """Give a mass on a spring: poles ``+-j sqrt(k / m)``."""
    return mechss([[m]], None, [[k]])


def square(x: float) -> float:
    """Give a number."""
    return x * x


def inverse(x: float) -> float:
    """Give a number, or fail at zero."""
    return 1.0 / x


def process(x: int) -> int:  # noqa: ARG001  # a case needs a parameter
    """Give the number of the process that works."""
    return os.getpid()


def end_process_once(x: int, fatal: int, folder: str) -> int:
    """Square a number, but end the process the first time that the fatal one comes."""
    mark = Path(folder) / "ended"
    if x == fatal and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def end_process(x: int, fatal: int) -> int:
    """Square a number, but end the process whenever the fatal one comes."""
    if x == fatal:
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def leave(x: int) -> int:
    """Square a number, but call ``sys.exit`` at zero."""
    if x == 0:
        sys.exit("no more")
    return x * x


def interrupt_parent(x: int, at: int, parent: int) -> int:
    """Square a number; at one of them send Ctrl-C to another process and take long over it."""
    if x == at:
        os.kill(parent, signal.SIGINT)
        time.sleep(60.0)
    return x * x


def threads(x: int) -> int:  # noqa: ARG001  # a case needs a parameter
    """Give the number of threads that linear algebra may use."""
    np.linalg.solve(np.eye(2), np.ones(2))
    return max(int(library["num_threads"]) for library in threadpoolctl.threadpool_info())


def wait_a_little(x: int, seconds: float, folder: str) -> int:
    """Square a number after some time, and leave a mark that it was begun, with the number of the process."""
    (Path(folder) / f"{x}-{os.getpid()}").touch()
    time.sleep(seconds)
    return x * x


def mount_over_damping(C_h: float) -> SecondOrderModel:
    """Give the hydromount without oil flow as another model, with fewer states."""
    return hydromount(C_h=C_h)


def mount(C_h: float, K_v: float = 500.0) -> SecondOrderModel:
    """Give the hydromount by a function that is not one of the package."""
    return hydromount(C_h=C_h, K_v=K_v)


def marked_square(x: int, folder: str, seconds: float = 0.0) -> int:
    """Square a number and leave a mark each time, with the number of the process, before and after."""
    attempt = sum(path.name.startswith(f"begun-{x}-") for path in Path(folder).iterdir())
    (Path(folder) / f"begun-{x}-{attempt}-{os.getpid()}").touch()
    time.sleep(seconds)
    (Path(folder) / f"done-{x}-{attempt}-{os.getpid()}").touch()
    return x * x


def endless_at(x: int, endless: int) -> int:
    """Square a number, but never come to an end at one, in compiled code that lets no thread run."""
    return sum(range(10**15)) if x == endless else x * x


def patient_at(x: int, endless: int, folder: str) -> int:
    """Square a number, but wait at one until somebody ends this process."""
    (Path(folder) / f"begun-{x}-{os.getpid()}").touch()
    if x == endless:
        time.sleep(3600.0)
    return x * x
