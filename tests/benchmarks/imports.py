"""Measure the import of labelled finite-element models over their size, for every reader with labels.

Run ``python tests/benchmarks/imports.py [LARGEST]`` on a quiet machine. A chain of n DOFs with stiffness and mass is
written in each format; the table shows the time of `load_model`, how it grows when n doubles, and its ratio to the time
of reading the numbers alone (`numpy.loadtxt` of the same files; for fields of fixed width, of the fields cut out; for
binary records, of one record after the other). Nothing is asserted: times depend on the machine.
"""

import io
import struct
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

import halfdof_ctrl as hd

LARGEST = 500_000
DOUBLINGS = 3
SMALL = 100
PER_NODE = 1
Entries = tuple[np.ndarray, np.ndarray, np.ndarray]


def chain(n: int) -> Iterator[tuple[str, Entries]]:
    """Give the lower triangles of stiffness and mass, rows and columns from 1 on."""
    every = np.arange(1, n + 1)
    rows, columns = np.concatenate([every, every[1:]]), np.concatenate([every, every[:-1]])
    order = np.lexsort((rows, columns))
    values = np.concatenate([np.full(n, 2.0), np.full(n - 1, -1.0)])
    yield "K", (rows[order], columns[order], values[order])
    yield "M", (every, every, np.full(n, 1.5))


def abaqus(folder: Path, n: int) -> list[Path]:
    """Write node, DOF, node, DOF, value."""
    paths = []
    for letter, (rows, columns, values) in chain(n):
        paths.append(folder / f"job_{'STIF' if letter == 'K' else 'MASS'}1.mtx")
        lines = [f"{i},1, {j},1, {v:.15e}\n" for i, j, v in zip(rows, columns, values, strict=True)]
        paths[-1].write_text("".join(lines))
    return paths


def calculix(folder: Path, n: int) -> list[Path]:
    """Write row, column, value of the upper triangle, zeros of the mass too, and the names of the rows."""
    paths = []
    (_, (rows, columns, stiffness)), _ = chain(n)
    for ending, values in ((".sti", stiffness), (".mas", np.where(rows == columns, 1.5, 0.0))):
        paths.append(folder / f"job{ending}")
        lines = [f"{j} {i} {v:20.13e}\n" for i, j, v in zip(rows, columns, values, strict=True)]
        paths[-1].write_text("".join(lines))
    (folder / "job.dof").write_text("".join([f"{node}.1\n" for node in range(1, n + 1)]))
    return paths


def punch(folder: Path, n: int) -> list[Path]:
    """Write DMIG entries in fields of 16 characters."""
    path = folder / "job.pch"
    with path.open("w") as stream:
        for letter, (rows, columns, values) in chain(n):
            stream.write(f"DMIG    {letter}AAX    {0:8d}{6:8d}{2:8d}{0:8d}\n")
            before = 0
            for i, j, v in zip(rows.tolist(), columns.tolist(), values.tolist(), strict=True):
                if j != before:
                    stream.write(f"DMIG*   {letter}AAX            {j:16d}{1:16d}\n")
                    before = j
                stream.write(f"*       {i:16d}{1:16d}{v:16.9E}\n")
    return [path]


def output4(folder: Path, n: int) -> list[Path]:
    """Write binary OUTPUT4 in the big sparse layout, and the names of the rows in EXTRN."""

    def record(data: bytes) -> bytes:
        return struct.pack("<i", len(data)) + data + struct.pack("<i", len(data))

    content = bytearray()
    for letter, (_, columns, values) in chain(n):
        content += record(struct.pack("<4i", n, -n, 6, 2) + f"{letter}XX".ljust(8).encode())
        starts = np.searchsorted(columns, np.arange(1, n + 2))
        for j in range(n):
            part = values[starts[j] : starts[j + 1]]
            data = struct.pack("<2i", 2 * part.size + 1, j + 1) + part.tobytes()
            content += record(struct.pack("<3i", j + 1, 0, len(data) // 4) + data)
        content += record(struct.pack("<3id", n + 1, 1, 2, 1.0))
    path = folder / "job.op4"
    path.write_bytes(content)
    with (folder / "job.pch").open("w") as stream:
        stream.write("EXTRN   ")
        for node in range(1, n + 1):
            stream.write(f"{node:8d}{1:8d}" + ("\n        " if node % 4 == 0 else ""))
        stream.write("\n")
    return [path, folder / "job.pch"]


def matrix_market(folder: Path, n: int) -> list[Path]:
    """Write row, column and value of the lower triangle."""
    paths = []
    for letter, (rows, columns, values) in chain(n):
        paths.append(folder / f"job_{letter}.mtx")
        lines = [f"{i} {j} {v:.15e}\n" for i, j, v in zip(rows, columns, values, strict=True)]
        head = f"%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {rows.size}\n"
        paths[-1].write_text(head + "".join(lines))
    return paths


def harwell_boeing(folder: Path, n: int) -> list[Path]:
    """Write what HBMAT writes, a number a line, and the mapping file."""
    paths = []
    for letter, (rows, columns, values) in chain(n):
        word = "Stiffness" if letter == "K" else "Mass"
        starts = np.searchsorted(columns, np.arange(1, n + 2)) + 1
        counts = [n + 1, rows.size, rows.size]
        head = [
            f"{word + ' matrix':72s}{'key':8s}",
            "".join([f"{count:14d}" for count in (sum(counts), *counts, 0)]),
            f"{'RSA':14s}" + "".join([f"{count:14d}" for count in (n, n, rows.size, 0)]),
            f"{'(1I14)':16s}{'(1I14)':16s}{'(1d25.15)':20s}{'':20s}",
        ]
        lines = [*head, *[f"{v:14d}" for v in starts], *[f"{v:14d}" for v in rows], *[f"{v:25.15E}" for v in values]]
        paths.append(folder / f"{word.lower()}.matrix")
        paths[-1].write_text("\n".join(lines) + "\n")
    names = [f"{node:14d}{node:14d}    UX\n" for node in range(1, n + 1)]
    (folder / "stiffness.mapping").write_text("  Matrix Eqn   Node   DOF\n" + "".join(names))
    return paths


WRITERS: dict[str, Callable[[Path, int], list[Path]]] = {
    "Abaqus": abaqus,
    "CalculiX": calculix,
    "DMIG": punch,
    "OUTPUT4 + EXTRN": output4,
    "Harwell-Boeing + mapping": harwell_boeing,
    "Matrix Market": matrix_market,
}


def numbers_alone(path: Path) -> None:
    """Read the numbers of a file without asking what they mean."""
    content = path.read_bytes()
    if path.suffix == ".matrix":
        np.array(content.split(b"\n", 4)[4].split(), dtype=np.float64)
    elif path.suffix == ".op4":
        place = 0
        while place < len(content):
            (length,) = struct.unpack_from("<i", content, place)
            np.frombuffer(content, np.float64, max(length - 20, 0) // 8, min(place + 24, len(content)))
            place += length + 8
    elif content.startswith(b"%%Matrix"):
        np.loadtxt(io.BytesIO(content), comments="%")
    elif content.startswith(b"EXTRN"):
        np.array(content[8:].split(), dtype=np.float64)
    elif path.suffix == ".pch":
        np.array([line[-16:] for line in content.split(b"\n") if line.startswith(b"*")], dtype=np.float64)
    else:
        np.loadtxt(io.BytesIO(content.replace(b",", b" ")))


def seconds(work: Callable[[], object]) -> float:
    """Time a work by the processor, which other processes do not disturb as much [s]."""
    start = time.process_time()
    work()
    return time.process_time() - start


def main(largest: int) -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    print(f"{'format':26s}{'DOFs':>10s}{'load_model [s]':>16s}{'growth':>8s}{'of reading alone':>18s}")
    for name, write in WRITERS.items():
        before = 0.0
        for n in [SMALL, *[largest // 2**k for k in range(DOUBLINGS, -1, -1)]]:
            with tempfile.TemporaryDirectory() as folder:
                paths = write(Path(folder), n)
                alone = sum(seconds(partial(numbers_alone, path)) for path in paths)
                spent = seconds(partial(hd.load_model, paths[0]))
            if n == SMALL:  # loads the modules
                continue
            growth = f"{spent / before:8.2f}" if before else " " * 8
            print(f"{name:26s}{n:10d}{spent:16.2f}{growth}{spent / alone:18.1f}", flush=True)
            before = spent


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else LARGEST)
