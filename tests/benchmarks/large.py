"""Measure large sparse models, each side in a process of its own, so that its peak of memory is its own.

Run ``python tests/benchmarks/large.py`` on a quiet machine for the table, and with the arguments ``growth FILE`` for
the figure of times over sizes. ``HALFDOF_PYMOR=/path/to/python`` names an environment with pyMOR, whose frequency
response is then measured too. Nothing is asserted: times depend on the machine.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, csc_matrix, load_npz, save_npz
from scipy.sparse.linalg import splu

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.fe_models import Structure, leading_matrix, space_frame, spring_grid

MASSES = 50
PATIENCE = 300.0  #: [s] after which a side counts as endless
WIDTH = 3  #: right-hand sides that SuperLU works at a time, the fastest with two threads and near it with one
SYMMETRIC: dict[str, Any] = {
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 0.0,
    "options": {"SymmetricMode": True},
}
MODELS: dict[str, Callable[[], Structure]] = {
    "space frame, 209 088 DOFs": lambda: space_frame(12, 12, 12, 17, parts=8, dampers=5),
    "slender frame, 244 800 DOFs": lambda: space_frame(40, 40, 2, 17, parts=6, dampers=5),
    "grid, 499 849 DOFs": lambda: spring_grid(707, 707, MASSES, dampers=5),
}
FREQUENCIES = np.geomspace(1.0, 100.0, 4)  #: [rad/s]
GROWTH = (20, 36, 64, 114, 202, 360, 640)  #: nodes along a side of the grid
DENSE_SIDES = (9, 14, 20, 30, 45)  #: the same where matrices are dense


def factorized(structure: Structure) -> Callable[[], object]:
    """W factorized by SuperLU in its best order, and as many solutions as there are masses: the floor."""
    W = leading_matrix(structure)
    right = structure.K[:, structure.massive].toarray(order="F")

    def work() -> object:
        factors = splu(W, **SYMMETRIC)
        return [factors.solve(right[:, first : first + WIDTH]) for first in range(0, right.shape[1], WIDTH)]

    return work


def reduced(structure: Structure) -> Callable[[], object]:
    """Reduce to a state space with an input and two outputs."""
    import halfdof_ctrl as hd  # noqa: PLC0415  # not for the other sides

    names = [f"q{place}" for place in structure.massive[[0, -1]]]
    model = structure.model().select(f"F_{names[0]}", names)
    return lambda: hd.mech2ss(model)


def responses(structure: Structure) -> Callable[[], object]:
    """Evaluate the descriptor form at a few frequencies."""
    import halfdof_ctrl as hd  # noqa: PLC0415

    names = [f"q{place}" for place in structure.massive[[0, -1]]]
    model = structure.model().select(f"F_{names[0]}", names)
    return lambda: hd.descriptor_response(model, FREQUENCIES)


def solved(structure: Structure) -> Callable[[], object]:
    """Factorize P(s) by SuperLU and solve, at the same frequencies."""
    force = np.zeros(structure.size, dtype=np.complex128)
    force[structure.massive[0]] = 1.0

    def at(omega: float) -> object:
        P = structure.K + 1j * omega * structure.C - omega**2 * structure.M
        return splu(csc_array(P), **SYMMETRIC).solve(force)[structure.massive[[0, -1]]]

    return lambda: [at(omega) for omega in FREQUENCIES]


def by_pymor(structure: Structure) -> Callable[[], object]:
    """Evaluate pyMOR's second-order model at the same frequencies, in the environment that has it."""
    from pymor.models.iosys import SecondOrderModel  # noqa: PLC0415

    B = np.zeros((structure.size, 1))
    B[structure.massive[0]] = 1.0
    C = np.zeros((2, structure.size))
    C[[0, 1], structure.massive[[0, -1]]] = 1.0
    M, E, K = (csc_matrix(matrix) for matrix in (structure.M, structure.C, structure.K))
    model = SecondOrderModel.from_matrices(M, E, K, B, C)
    transfer = model.transfer_function
    return lambda: [transfer.eval_tf(1j * omega) for omega in FREQUENCIES]


SIDES = {side.__name__: side for side in (factorized, reduced, responses, solved, by_pymor)}


def measured(folder: Path, side: str, interpreter: str = sys.executable) -> dict[str, float]:
    """Run one side in a process with one thread: seconds of the processor, and the peak of memory [MB].

    A process inherits the peak of the one that starts it, which is why that builds no model itself.
    """
    one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    command = [interpreter, __file__, "side", str(folder), side]
    try:
        done = subprocess.run(
            command, env=os.environ | one, check=True, capture_output=True, text=True, timeout=PATIENCE
        )
    except subprocess.TimeoutExpired:
        return {"seconds": float("inf"), "peak": float("nan")}
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def run_side(folder: str, side: str) -> None:
    """Load the matrices, work once, and print what it took."""
    M, C, K = (csc_array(load_npz(f"{folder}/{letter}.npz")) for letter in "MCK")
    work = SIDES[side](Structure(M, C, K, np.flatnonzero(M.diagonal())))
    start = time.process_time()
    work()
    seconds = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(json.dumps({"seconds": seconds, "peak": peak}))


def build(name: str, folder: str) -> None:
    """Write the matrices of a model for the other processes."""
    structure = MODELS[name]()
    for letter in "MCK":
        save_npz(f"{folder}/{letter}.npz", getattr(structure, letter), compressed=False)


def report(work: str, ours: dict[str, float], other: dict[str, float], name: str, target: str) -> None:
    """Print one row: both times and peaks, and their ratios."""
    if other["seconds"] == float("inf"):
        print(f"{work:48} {ours['seconds']:8.2f} s, {name} more than {PATIENCE:.0f} s", flush=True)
        return
    times, peaks = ours["seconds"] / other["seconds"], ours["peak"] / other["peak"]
    print(
        f"{work:48} {ours['seconds']:8.2f} s {other['seconds']:8.2f} s {times:6.2f} x  {ours['peak']:7.0f} MB "
        f"{other['peak']:7.0f} MB {peaks:6.2f} x  {name:28} target {target}",
        flush=True,
    )


def table(rounds: int = 3) -> None:
    """Print all rows, the smallest of some rounds, taken in turns."""
    pymor = os.environ.get("HALFDOF_PYMOR")
    for name in MODELS:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            subprocess.run([sys.executable, __file__, "build", name, place], check=True)

            def best(*sides: str, folder: Path = folder) -> list[dict[str, float]]:
                runs = [[measured(folder, side) for side in sides] for _ in range(rounds)]
                return [min(column, key=lambda run: run["seconds"]) for column in zip(*runs, strict=True)]

            ours, floor = best("reduced", "factorized")
            report(f"mech2ss: {name}", ours, floor, "LU of W and 50 solves", "<= 1.5, <= 1.5")
            ours, plain = best("responses", "solved")
            report(f"descriptor_response: {name}", ours, plain, "splu at each frequency", "(none)")
            if pymor:
                theirs = measured(folder, "by_pymor", pymor)
                report(f"descriptor_response: {name}", ours, theirs, "pyMOR", "(none)")


def growth(path: str) -> None:
    """Draw times over the number of DOFs, the floor among them."""
    import matplotlib.pyplot as plt  # noqa: PLC0415
    import scipy.linalg  # noqa: PLC0415

    import halfdof_ctrl as hd  # noqa: PLC0415
    from halfdof_ctrl.base.threads import limited_threads  # noqa: PLC0415

    def seconds(work: Callable[[], object], rounds: int = 3) -> float:
        best = float("inf")
        for _ in range(rounds):
            start = time.process_time()
            work()
            best = min(best, time.process_time() - start)
        return best

    curves: dict[str, tuple[list[int], list[float], dict[str, Any]]] = {
        "floor: LU of W and 50 solves": ([], [], {"color": "0.45", "linestyle": "--"}),
        "mech2ss, sparse model": ([], [], {"color": "C0", "marker": "o"}),
        "mech2ss, dense model": ([], [], {"color": "C1", "marker": "s"}),
        "QZ of the companion pencil": ([], [], {"color": "C3", "marker": "^"}),
    }

    def note(name: str, size: int, value: float) -> None:
        curves[name][0].append(size)
        curves[name][1].append(value)

    with limited_threads(1):
        for side in GROWTH:
            structure = spring_grid(side, side, MASSES, dampers=5)
            note("floor: LU of W and 50 solves", structure.size, seconds(factorized(structure)))
            note("mech2ss, sparse model", structure.size, seconds(reduced(structure)))
        for side in DENSE_SIDES:
            structure = spring_grid(side, side, min(MASSES, side**2 // 4), dampers=5)
            names = [f"q{place}" for place in structure.massive[[0, -1]]]
            dense = structure.model().select(f"F_{names[0]}", names).as_dense()
            note("mech2ss, dense model", structure.size, seconds(lambda dense=dense: hd.mech2ss(dense)))  # type: ignore[misc]
            if structure.size <= DENSE_SIDES[-3] ** 2:
                n = structure.size
                E = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), dense.M]])
                A = np.block([[np.zeros((n, n)), np.eye(n)], [-dense.K, -dense.C]])
                note("QZ of the companion pencil", n, seconds(lambda A=A, E=E: scipy.linalg.eigvals(A, E), rounds=1))  # type: ignore[misc]
    fig, ax = plt.subplots(figsize=(6.0, 4.2), layout="constrained")
    for name, (sizes, values, style) in curves.items():
        ax.loglog(sizes, values, label=name, linewidth=1.5, markersize=5.0, **style)
    ax.set_xlabel("DOFs of a grid, 50 of them with mass")
    ax.set_ylabel("time [s]")
    ax.grid(visible=True, color="0.9")
    ax.legend(loc="upper left", fontsize="small")
    fig.savefig(path, dpi=130)


def main(arguments: list[str]) -> None:
    """Print the table, draw the figure, or run one side."""
    if arguments[:1] == ["side"]:
        run_side(*arguments[1:])
    elif arguments[:1] == ["build"]:
        build(*arguments[1:])
    elif arguments[:1] == ["growth"]:
        growth(arguments[1])
    else:
        table()


if __name__ == "__main__":
    main(sys.argv[1:])
