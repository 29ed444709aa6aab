"""Small files in the layouts of finite-element programs, written independently of the readers.

The model: a chain of three nodes along x, ground - 4 - node 1 - 2 - node 2 - 1 - node 3, masses 3, 2 and none, and a
damper of 0.5 between nodes 2 and 3.
"""

import struct
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
M = np.diag([3.0, 2.0, 0.0])
C = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, -0.5], [0.0, -0.5, 0.5]])
K = np.array([[6.0, -2.0, 0.0], [-2.0, 3.0, -1.0], [0.0, -1.0, 1.0]])
CHAIN = {"M": M, "C": C, "K": K}
NAMES = ("n1_u1", "n2_u1", "n3_u1")


def triangle(matrix: Array, side: str) -> list[tuple[int, int, float]]:
    """List the nonzero entries of a triangle with the diagonal, or of all, column by column."""
    part = np.tril(matrix) if side == "lower" else np.triu(matrix) if side == "upper" else matrix
    return [(int(i), int(j), float(part[i, j])) for j, i in np.argwhere(part.T)]


def matrix_market(matrix: Array, kind: str = "coordinate real symmetric", side: str = "lower") -> str:
    """Write a coordinate file."""
    entries = triangle(matrix, side)
    lines = [f"%%MatrixMarket matrix {kind}", "% by hand", f"{matrix.shape[0]} {matrix.shape[1]} {len(entries)}"]
    return "\n".join([*lines, *(f"{i + 1} {j + 1} {value!r}" for i, j, value in entries)]) + "\n"


def abaqus(matrix: Array, side: str = "lower", nodes: tuple[int, ...] = (1, 2, 3), head: str = "** by hand\n") -> str:
    """Write the default format of *MATRIX OUTPUT."""
    lines = [f"{nodes[i]},1, {nodes[j]},1, {value:.15e}" for i, j, value in triangle(matrix, side)]
    return head + "\n".join(lines) + "\n"


def harwell_boeing(
    matrix: Array,
    kind: str = "RSA",
    title: str = "Stiffness matrix from ANSYS FULL file dumped into Harwell-Boeing format",
    layout: tuple[int, int, int, int] = (1, 14, 1, 25),
    *,
    right_hand_side: bool = False,
) -> str:
    """Write what HBMAT writes: one number a line, d25.15, or other numbers of fields and widths."""
    entries = triangle(matrix, "lower" if kind[1] == "S" else "both")
    per_int, int_width, per_real, real_width = layout
    n = matrix.shape[1]
    starts = [1 + sum(j < column for _, j, _ in entries) for column in range(n + 1)]

    def block(texts: list[str], per_line: int) -> list[str]:
        return ["".join(texts[k : k + per_line]) for k in range(0, len(texts), per_line)]

    parts = [
        block([f"{start:{int_width}d}" for start in starts], per_int),
        block([f"{i + 1:{int_width}d}" for i, _, _ in entries], per_int),
        block([_fortran(value, real_width) for _, _, value in entries], per_real),
        block([_fortran(1.0, real_width)] * n, per_real) if right_hand_side else [],
    ]
    counts = [len(part) for part in parts]
    formats = f"({per_int}I{int_width})", f"({per_real}d{real_width}.{real_width - 10})"
    head = [
        f"{title:72s}{'key':8s}",
        "".join(f"{count:14d}" for count in [sum(counts), *counts]),
        f"{kind:14s}" + "".join(f"{count:14d}" for count in (matrix.shape[0], n, len(entries), 0)),
        f"{formats[0]:16s}{formats[0]:16s}{formats[1]:20s}{formats[1]:20s}",
        *([f"{'F':14s}{1:14d}{n:14d}"] if right_hand_side else []),
    ]
    return "\n".join([*head, *(line for part in parts for line in part)]) + "\n"


def mapping(labels: tuple[str, ...] = ("UX", "UX", "UX"), nodes: tuple[int, ...] = (1, 2, 3)) -> str:
    """Write the mapping file that HBMAT writes on request."""
    lines = [f"{k:14d}{node:14d}    {label:4s}" for k, (node, label) in enumerate(zip(nodes, labels, strict=True), 1)]
    return "\n".join(["    Matrix Eqn          Node    DOF     ", *lines]) + "\n"


def dmig(matrices: dict[str, Array], form: int = 6) -> str:
    """Write fields of sixteen characters, as Nastran punches them."""
    lines = ["$ punched by hand"]
    for name, matrix in matrices.items():
        lines.append(f"DMIG    {name:8s}{0:8d}{form:8d}{2:8d}{0:8d}{'':16s}{len(matrix):8d}")
        entries = triangle(matrix, "lower" if form == 6 else "both")
        for column in sorted({j for _, j, _ in entries}):
            lines.append(f"DMIG*   {name:16s}{column + 1:16d}{1:16d}")
            lines += [f"*       {i + 1:16d}{1:16d}{_fortran(value, 16)}" for i, j, value in entries if j == column]
    return "\n".join(lines) + "\n"


def output4_text(matrices: dict[str, npt.NDArray[Any]], layout: str, form: int = 6) -> str:
    """Write text in the layout "dense", "sparse" or "big"."""
    lines = []
    for name, matrix in matrices.items():
        rows, columns = matrix.shape
        factor = 2 if np.iscomplexobj(matrix) else 1
        lines.append(f"{columns:8d}{-rows if layout == 'big' else rows:8d}{form:8d}{2 * factor:8d}{name:8s}1P,3E23.16")
        for column in range(columns):
            rows_used = np.flatnonzero(matrix[:, column])
            if rows_used.size:
                first, last = int(rows_used[0]), int(rows_used[-1])
                values = matrix[first : last + 1, column]
                numbers = np.ascontiguousarray(values).view(np.float64)
                words = 2 * numbers.size
                if layout == "dense":
                    lines.append(f"{column + 1:8d}{first + 1:8d}{numbers.size:8d}")
                elif layout == "big":
                    lines += [f"{column + 1:8d}{0:8d}{words + 2:8d}", f"{words + 1:8d}{first + 1:8d}"]
                else:
                    lines += [f"{column + 1:8d}{0:8d}{words + 1:8d}", f"{first + 1 + 65536 * (words + 1):12d}"]
                texts = [f"{number:23.16E}" for number in numbers]
                lines += ["".join(texts[k : k + 3]) for k in range(0, len(texts), 3)]
        lines += [f"{columns + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    return "\n".join(lines) + "\n"


def output4_binary(
    matrices: dict[str, npt.NDArray[Any]], layout: str, order: str = "<", word: int = 4, form: int = 6
) -> bytes:
    """Write binary in the layout "dense", "sparse" or "big", in words of 4 or 8 bytes."""
    integer = {4: "i", 8: "q"}[word]

    def record(data: bytes) -> bytes:
        mark = struct.pack(f"{order}i", len(data))
        return mark + data + mark

    content = b""
    for name, matrix in matrices.items():
        rows, columns = matrix.shape
        factor = 2 if np.iscomplexobj(matrix) else 1
        head = struct.pack(f"{order}4{integer}", columns, -rows if layout == "big" else rows, form, 2 * factor)
        content += record(head + name.encode().ljust(2 * word))
        for column in range(columns):
            rows_used = np.flatnonzero(matrix[:, column])
            if rows_used.size:
                first, last = int(rows_used[0]), int(rows_used[-1])
                numbers = np.ascontiguousarray(matrix[first : last + 1, column]).view(np.float64)
                data = numbers.astype(f"{order}f8").tobytes()
                words = len(data) // word
                if layout == "big":
                    data = struct.pack(f"{order}2{integer}", words + 1, first + 1) + data
                elif layout == "sparse":
                    data = struct.pack(f"{order}{integer}", first + 1 + 65536 * (words + 1)) + data
                start = first + 1 if layout == "dense" else 0
                content += record(struct.pack(f"{order}3{integer}", column + 1, start, len(data) // word) + data)
        last_value = struct.pack(f"{order}3{integer}d", columns + 1, 1, 8 // word, 1.0)
        content += record(last_value)
    return content


def _fortran(value: float, width: int) -> str:
    """Write a number with the exponent of double precision."""
    return f"{value:{width}.{width - 7}E}".replace("E", "D")
