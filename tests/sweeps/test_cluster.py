"""Sweeps on a real cluster of processes: Dask with a worker that is killed, and MPI."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from halfdof_ctrl import sweep
from support import sweepcases

pytestmark = pytest.mark.processes

COUNT = 60
SECONDS = 0.04  #: that a case takes
MPI_SCRIPT = """
import json, os
from mpi4py.futures import MPIPoolExecutor
import halfdof_ctrl as hd
from support import sweepcases

if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        result = hd.sweep(hd.hydromount, {"C_h": [100.0, 300.0, 900.0]}, executor=executor)
        workers = hd.sweep(sweepcases.process, {"x": range(3)}, executor=executor)
    print(json.dumps([result.poles.real.tolist(), workers.values.tolist(), os.getpid()]))
"""


def kill_in_the_middle(folder: Path, killed: list[int]) -> None:
    """Kill the worker that began a case last, once a quarter of the cases has begun."""
    while len(list(folder.iterdir())) < COUNT // 4:
        time.sleep(0.01)
    begun = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime_ns)
    killed += [int(begun[-1].name.split("-")[1]), len(begun)]
    os.kill(killed[0], signal.SIGKILL)


@pytest.mark.filterwarnings("ignore")  # the cluster, which is not ours, warns of its own affairs
def test_a_dask_worker_that_is_killed_in_the_middle_loses_nothing(tmp_path: Path) -> None:
    """Two processes work, one of them dies, and all squares are there."""
    distributed = pytest.importorskip("distributed")
    marks, killed = tmp_path / "marks", list[int]()
    marks.mkdir()
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            local_directory=str(tmp_path),
            silence_logs="CRITICAL",
        ) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor() as executor,
    ):
        killer = threading.Thread(target=kill_in_the_middle, args=(marks, killed))
        killer.start()
        result = sweep(
            sweepcases.wait_a_little,
            {"x": range(COUNT), "seconds": SECONDS, "folder": str(marks)},
            executor=executor,
        )
        killer.join()
    assert_array_equal(np.asarray(result.values), np.arange(COUNT) ** 2)
    assert not result.failures
    workers = {int(path.name.split("-")[1]) for path in marks.iterdir()}
    assert killed[0] in workers
    assert len(workers) >= 2
    assert killed[1] < COUNT


def test_mpi_workers_give_the_poles(tmp_path: Path) -> None:
    """`mpi4py.futures.MPIPoolExecutor` is an executor like the others; its worker is another process."""
    pytest.importorskip("mpi4py")
    mpiexec = shutil.which("mpiexec", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    if mpiexec is None:
        pytest.skip("no mpiexec")
    script = tmp_path / "sweep_by_mpi.py"
    script.write_text(MPI_SCRIPT, encoding="utf-8")
    places = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    as_root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    ran = subprocess.run(
        [mpiexec, "-n", "2", sys.executable, "-m", "mpi4py.futures", str(script)],
        env=os.environ | as_root | {"PYTHONPATH": os.pathsep.join(filter(None, places))},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    poles, workers, master = json.loads(ran.stdout)
    here = sweep(sweepcases.mount_over_damping, {"C_h": [100.0, 300.0, 900.0]})
    assert_array_equal(poles, np.asarray(here.poles).real)
    assert master not in workers
