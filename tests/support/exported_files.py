"""Matrices whose files lie in tests/data, and files in layouts that no library here writes.

``tests/data/nastran`` was written by pyyeti from these matrices (``tests/data/write_with_pyyeti.py``), so that the
readers are tried on what another program writes; Matrix Market files are written by scipy when a test needs them, and
single precision, which Nastran writes and pyyeti does not, here. All entries are short binary fractions: they keep
their value in every format.
"""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.io

from support import fe_models

Matrix = npt.NDArray[Any]
DATA = Path(__file__).parents[1] / "data" / "nastran"
BIGMAT_COLUMN = 2  #: words in front of a string: its length and its row


def fractions(rows: int, columns: int, *, seed: int, sparsity: int = 3) -> Matrix:
    """Make a matrix of eighths; about one in `sparsity` entries is not zero."""
    i, j = np.ogrid[:rows, :columns]
    numbers = (7 * i * i + 13 * j + 5 * i * j + seed) % 41 - 20
    return np.where((3 * i + 5 * j + i * j + seed) % sparsity == 0, numbers / 8.0, 0.0)


HOLES = np.array([[0.0, 1.0, 0.0], [5.0, 0.0, 2.0], [0.0, -3.0, 0.0], [2.0**-30, 0.0, 0.0]])
LAYOUTS = {"kaa": fractions(12, 12, seed=4), "cplx": fractions(5, 5, seed=9) * (2 - 1j), "rect": HOLES}

GRIDS, SCALARS = (3, 11, 19, 27), tuple(range(2995001, 2995009))
SUPERELEMENT_DOFS = (
    *(f"n{grid}_{kind}{axis}" for grid in GRIDS for kind in "ur" for axis in (1, 2, 3)),
    *(f"n{scalar}" for scalar in SCALARS),
)


def superelement() -> dict[str, Matrix]:
    """Make four grid points in a row, free in space, and eight modes that move with the second and third.

    Neighbours are tied in each of six directions, which leaves six motions without stiffness. There is neither
    damping, of which Nastran writes one zero, nor a load; one matrix has other rows.
    """
    row = np.array([[1.0, -1.0, 0.0, 0.0], [-1.0, 2.0, -1.0, 0.0], [0.0, -1.0, 2.0, -1.0], [0.0, 0.0, -1.0, 1.0]])
    stiffness, mass = np.diag([96.0, 64.0, 48.0, 12.0, 10.0, 8.0]), np.diag([2.0, 2.0, 2.0, 0.5, 0.25, 0.125])
    n, modes = len(SUPERELEMENT_DOFS), len(SCALARS)
    K, M = np.zeros((n, n)), np.eye(n)
    K[:-modes, :-modes], M[:-modes, :-modes] = np.kron(row, stiffness), np.kron(np.eye(4), mass)
    K[-modes:, -modes:] = np.diag(np.arange(4.0, 4.0 + modes) ** 2)
    coupled = np.arange(modes)
    M[6 + coupled, n - modes + coupled] = M[n - modes + coupled, 6 + coupled] = 0.125
    return {"kxx": K, "mxx": M, "bxx1": np.zeros((1, 1)), "mug1": fractions(9, n, seed=2)}


FORM_PLACES = [*((node, component) for node in (1, 2) for component in range(1, 7)), (10, 0), (11, 0), (12, 0)]
_N = len(FORM_PLACES)
FORMS = {
    "patrn": np.tile(np.arange(1.0, _N + 1.0), (_N, 1)),
    "ident": np.eye(_N),
    "randm": fractions(_N, _N, seed=6, sparsity=4) + np.diag(np.full(_N, 32.0)),
}
TWO_WAYS = {
    "maa": np.diag(np.arange(1.0, 25.0) / 16.0),
    "ll": np.tril(fractions(24, 24, seed=5)),
    "dd": np.diag(fractions(24, 1, seed=3, sparsity=1)[:, 0]),
}


def single_text(matrices: dict[str, Matrix]) -> bytes:
    """Write OUTPUT4 as text, type 1 (single precision), with row numbers above 65535 allowed."""
    lines = []
    for name, matrix in matrices.items():
        rows, columns = matrix.shape
        lines.append(f"{columns:8d}{-rows:8d}{2:8d}{1:8d}{name.upper():8s}1P,3E23.16")
        for column in range(columns):
            for first, values in _strings(matrix[:, column]):
                words = len(values)
                lines += [f"{column + 1:8d}{0:8d}{words + BIGMAT_COLUMN:8d}", f"{words + 1:8d}{first + 1:8d}"]
                texts = [f"{value:23.16E}" for value in values]
                lines += ["".join(texts[k : k + 3]) for k in range(0, words, 3)]
        lines += [f"{columns + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    return ("\n".join(lines) + "\n").encode()


def single_binary(matrices: dict[str, Matrix]) -> bytes:
    """Write the same in records of Fortran with words of four bytes."""

    def record(data: bytes) -> bytes:
        mark = struct.pack("<i", len(data))
        return mark + data + mark

    content = b""
    for name, matrix in matrices.items():
        rows, columns = matrix.shape
        content += record(struct.pack("<4i", columns, -rows, 2, 1) + name.upper().encode().ljust(8))
        for column in range(columns):
            for first, values in _strings(matrix[:, column]):
                data = struct.pack("<2i", len(values) + 1, first + 1) + values.astype("<f4").tobytes()
                content += record(struct.pack("<3i", column + 1, 0, len(data) // 4) + data)
        content += record(struct.pack("<3if", columns + 1, 1, 1, 1.0))
    return content


def _strings(column: Matrix) -> list[tuple[int, Matrix]]:
    """Give the first row and the values from the first to the last entry of a column, if it has one."""
    used = np.flatnonzero(column)
    return [(int(used[0]), column[used[0] : used[-1] + 1])] if used.size else []


def content(name: str, folder: Path) -> bytes:
    """Give one of the files by name; `folder` is for those that are written when they are needed."""
    if name.startswith("single_"):
        return {"single_text.op4": single_text, "single_binary.op4": single_binary}[name](TWO_WAYS)
    if name.startswith("bcsst"):
        return write_structure(folder, "01")[0].read_bytes()
    return (DATA / name).read_bytes()


#: as the Harwell-Boeing collection names its structures; numbers of DOFs with and without mass are known
STRUCTURES = {
    "01": fe_models.space_frame(2, 2, 3, 8),
    "03": fe_models.spring_grid(14, 8, 72),
    "12": fe_models.spring_grid(20, 21, 420),
    "13": fe_models.space_frame(3, 3, 3, 30, parts=2),
}


def write_structure(folder: Path, number: str) -> tuple[Path, Path]:
    """Write stiffness and mass of a structure by scipy, one entry of each symmetric pair, all digits."""
    structure = STRUCTURES[number]
    paths = folder / f"bcsstk{number}.mtx", folder / f"bcsstm{number}.mtx"
    for path, matrix in zip(paths, (structure.K, structure.M), strict=True):
        scipy.io.mmwrite(path, matrix.tocoo(), comment=" by scipy", precision=17, symmetry="symmetric")
    return paths
