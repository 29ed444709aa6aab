"""What sweeps survive: cases without end, killed workers, a killed parent, Ctrl-C; nothing that was done is lost."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from halfdof_ctrl import hydromount, sweep
from halfdof_ctrl.base.errors import FailedCasesWarning, ParameterError, SignalNameError, WorkerError
from halfdof_ctrl.sweeps import crew, workers
from support import sweepcases

pytestmark = pytest.mark.processes

COUNT = 40
SQUARES = np.arange(COUNT) ** 2
PATIENCE = 120.0  #: [s] that a test waits for what must come, on however slow a machine
ROOT = Path(__file__).parents[2]

PARENT = """
import sys
import halfdof_ctrl as hd
from support import sweepcases

if __name__ == "__main__":
    folder, path, workers = sys.argv[1:]
    many = {"x": range(40), "seconds": 0.1, "folder": folder}
    hd.sweep(sweepcases.marked_square, many, workers=int(workers) or None, checkpoint=path)
"""
HUNG = """
import sys
import halfdof_ctrl as hd
from support import sweepcases

if __name__ == "__main__":
    print("begins", flush=True)
    hd.sweep(sweepcases.endless_at, {"x": range(3), "endless": 1}, workers=2, checkpoint=sys.argv[1])
"""


def wait_for(come: Callable[[], bool]) -> None:
    """Wait until something is so."""
    end = time.monotonic() + PATIENCE
    while not come():
        assert time.monotonic() < end, "what a test waited for has not come"
        time.sleep(0.02)


def started(script: str, *arguments: str, mark: str) -> "subprocess.Popen[str]":
    """Start a script whose processes, however far from it, carry a mark in their environment."""
    places = [str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, places)), "HALFDOF_TEST_MARK": mark}
    return subprocess.Popen(
        [sys.executable, "-c", script, *arguments],
        env=surroundings,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def processes_with(mark: str) -> list[int]:
    """Find the processes, zombies left out, that carry a mark."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and f"HALFDOF_TEST_MARK={mark}".encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def lines_of(path: Path) -> int:
    """Count the whole lines of a file that may not be there yet."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def needs_proc() -> None:
    """Skip where processes cannot be looked at."""
    if not Path("/proc/self/environ").exists():
        pytest.skip("no /proc")


# --- cases without end


def test_a_case_without_end_fails_alone() -> None:
    """It is in compiled code that lets no thread run, so its process is killed; the reason has a name."""
    with pytest.warns(FailedCasesWarning, match=r"1 of 40 cases failed, first x = 7: TimeoutError: .*timeout = 3 s"):
        result = sweep(sweepcases.endless_at, {"x": range(COUNT), "endless": 7}, workers=2, timeout=3.0)
    assert [(failure.case, failure.kind) for failure in result.failures] == [((7,), "TimeoutError")]
    assert_array_equal(np.asarray(result.values), np.where(np.arange(COUNT) == 7, np.nan, SQUARES))


def test_the_process_of_a_case_without_end_is_ended(tmp_path: Path) -> None:
    """And another does what is left."""
    needs_proc()
    asked = {"x": range(6), "endless": 2, "folder": str(tmp_path)}
    with pytest.warns(FailedCasesWarning, match="1 of 6 cases failed"):
        result = sweep(sweepcases.patient_at, asked, workers=1, timeout=2.0)
    at_work = {int(path.name.split("-")[2]) for path in tmp_path.iterdir()}
    assert len(at_work) == 2
    assert not any(Path(f"/proc/{process}").exists() for process in at_work)
    assert_array_equal(np.asarray(result.values), [0, 1, np.nan, 9, 16, 25])


def test_a_timeout_without_workers_takes_a_process() -> None:
    """Nothing can interrupt compiled code in this one."""
    with pytest.warns(FailedCasesWarning, match="1 of 3 cases failed, first x = 1: TimeoutError"):
        result = sweep(sweepcases.endless_at, {"x": range(3), "endless": 1}, timeout=2.0)
    assert result.ran == "in 1 process"
    assert os.getpid() not in np.asarray(sweep(sweepcases.process, {"x": [1, 2]}, timeout=PATIENCE).values)


def test_a_timeout_holds_for_the_case_that_shows_the_signals() -> None:
    """The first case is not made in this process to see its signals, where nothing could end it."""
    with pytest.warns(FailedCasesWarning, match="1 of 2 cases failed, first x = 0: TimeoutError"):
        sweep(sweepcases.endless_at, {"x": range(2), "endless": 0}, inputs="F_y", compute=float, workers=1, timeout=2.0)


@pytest.mark.parametrize("timeout", [0, -1.0, float("nan"), float("inf"), "5", True])
def test_a_timeout_is_a_positive_time(timeout: Any) -> None:  # noqa: ANN401
    """Nothing else has a meaning."""
    with pytest.raises(ParameterError, match="positive number of seconds"):
        sweep(hydromount, {"C_h": [100.0]}, timeout=timeout)


def test_a_timeout_that_nobody_can_keep_is_refused() -> None:
    """An executor owns its workers; a lambda cannot be sent to a process."""
    with ThreadPoolExecutor(1) as executor, pytest.raises(ParameterError, match="not this sweep's to end"):
        sweep(sweepcases.square, {"x": [1.0]}, executor=executor, timeout=1.0)
    with pytest.raises(WorkerError, match="cannot be sent to another process"):
        sweep(lambda x: x, {"x": [1.0]}, timeout=1.0)


# --- sweeps too short for processes


NEVER_LONG = 1e6  #: seconds that a sweep may take and still count as short, however slow the machine is


def test_a_sweep_of_the_package_too_short_for_processes_runs_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says so, by no warning, and gives the same numbers."""
    monkeypatch.setattr(workers, "SHORT_SECONDS", NEVER_LONG)
    result = sweep(hydromount, {"C_h": [100.0, 300.0]}, workers=4)
    assert result.ran == "in this process, since it was too short for others"
    assert repr(result).splitlines()[-1] == f"  computed {result.ran}"
    assert_array_equal(np.asarray(result.poles), np.asarray(sweep(hydromount, {"C_h": [100.0, 300.0]}).poles))


def test_a_sweep_of_a_users_function_too_short_for_many_processes_takes_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """The function may end the process that it is in, so that is not this one."""
    monkeypatch.setattr(crew, "SHORT_SECONDS", NEVER_LONG)
    result = sweep(sweepcases.process, {"x": range(COUNT)}, workers=4)
    assert result.ran == "in one process, since it was too short for more"
    assert len({os.getpid(), *np.asarray(result.values).tolist()}) == 2


def test_a_longer_sweep_takes_all_processes(tmp_path: Path) -> None:
    """As soon as what is left would take one of them more than a second."""
    asked = {"x": range(COUNT), "seconds": 0.2, "folder": str(tmp_path)}
    result = sweep(sweepcases.marked_square, asked, workers=2)
    assert result.ran == "in 2 processes"
    assert len({path.name.split("-")[3] for path in tmp_path.iterdir()}) == 2


def test_signals_that_the_first_system_lacks_are_refused_by_workers_too(tmp_path: Path) -> None:
    """At once, not case by case, and with the name that it has."""
    with pytest.raises(SignalNameError, match="nope") as refusal:
        sweep(sweepcases.mount, {"C_h": np.linspace(1.0, 9.0, 30)}, inputs="nope", workers=2, checkpoint=tmp_path / "c")
    assert refusal.value.names == ("nope",)
    assert lines_of(tmp_path / "c") == 1


# --- killed processes


def test_workers_that_are_killed_from_outside_lose_nothing(tmp_path: Path) -> None:
    """Five of them, one after the other, in the middle of a case."""
    killed: list[int] = []

    def kill_workers() -> None:
        for count in (2, 6, 10, 14, 18):
            wait_for(lambda count=count: len(list(tmp_path.glob("done-*"))) >= count)  # type: ignore[misc]
            newest = max(tmp_path.glob("begun-*"), key=lambda path: path.stat().st_mtime_ns)
            killed.append(int(newest.name.split("-")[3]))
            os.kill(killed[-1], signal.SIGKILL)

    killer = threading.Thread(target=kill_workers)
    killer.start()
    asked = {"x": range(COUNT), "seconds": 0.2, "folder": str(tmp_path)}
    result = sweep(sweepcases.marked_square, asked, workers=2)
    killer.join()
    assert len(set(killed)) >= 2
    assert not result.failures
    assert_array_equal(np.asarray(result.values), SQUARES)


@pytest.mark.parametrize(
    ("sent", "workers"), [(signal.SIGKILL, 0), (signal.SIGKILL, 2), (signal.SIGTERM, 2), (signal.SIGINT, 0)]
)
def test_a_parent_that_is_killed_leaves_a_checkpoint_and_no_processes(
    tmp_path: Path, sent: signal.Signals, workers: int
) -> None:
    """A second run does the cases that were not finished, and no other; nothing runs on after the first."""
    needs_proc()
    marks, path, mark = tmp_path / "marks", tmp_path / "sweep.jsonl", f"{tmp_path.name}-{os.getpid()}"
    marks.mkdir()
    parent = started(PARENT, str(marks), str(path), str(workers), mark=mark)
    wait_for(lambda: lines_of(path) >= 6 or parent.poll() is not None)
    assert parent.poll() is None, parent.communicate()
    parent.send_signal(sent)
    parent.communicate(timeout=PATIENCE)
    wait_for(lambda: not processes_with(mark))
    kept = lines_of(path) - 1
    begun = len(list(marks.glob("begun-*")))
    assert kept >= 5
    result = sweep(
        sweepcases.marked_square, {"x": range(COUNT), "seconds": 0.1, "folder": str(marks)}, checkpoint=path, workers=2
    )
    assert_array_equal(np.asarray(result.values), SQUARES)
    assert not result.failures
    assert len(list(marks.glob("begun-*"))) == begun + COUNT - kept
    assert f"{kept} of 40 cases taken from the checkpoint" in repr(result)


def test_a_worker_in_compiled_code_ends_with_its_parent(tmp_path: Path) -> None:
    """It lets no thread run that could notice, but the system does."""
    needs_proc()
    if sys.platform != "linux":
        pytest.skip("the signal is one of Linux")
    path, mark = tmp_path / "sweep.jsonl", f"{tmp_path.name}-{os.getpid()}"
    parent = started(HUNG, str(path), mark=mark)
    wait_for(lambda: lines_of(path) >= 3 or parent.poll() is not None)  # the two cases around the endless one
    assert parent.poll() is None, parent.communicate()
    time.sleep(0.2)
    parent.kill()
    parent.communicate(timeout=PATIENCE)
    wait_for(lambda: not processes_with(mark))
