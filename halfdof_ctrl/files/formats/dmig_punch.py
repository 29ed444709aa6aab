"""DMIG entries as Nastran itself punches them, read by columns of characters instead of line by line.

    DMIG    NAME           0       6       2       0                      15
    DMIG*   NAME                      column node column component
    *               row node       row component       real part  imaginary part

A file with anything else about its DMIG entries (small fields, commas, tabs, other continuation marks, fields that are
no numbers) is left to the reader in `dmig`, which knows all layouts and names the line that is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.files.formats.text_blocks import AS_PYTHON, fixed_width

Keys = npt.NDArray[np.int64]

KEYWORD, LARGE_KEYWORD = b"DMIG", b"DMIG*   "
FIELD = 16  #: characters
LEAD = 8  #: characters before the fields
FULL_LINE = LEAD + 4 * FIELD
COMPONENT_BITS, MOST_COMPONENT = 3, 6
BLANK = 32


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PunchedMatrix:
    """Entries of one matrix: a key is the node, shifted, with the component."""

    header: list[str]  #: fields of 8 characters
    rows: Keys
    columns: Keys
    values: npt.NDArray[Any]  #: (k, 2) real and imaginary parts, or amplitudes and phases


def punched_matrices(content: bytes) -> list[PunchedMatrix] | None:
    """Read all matrices of a file, None if it has another layout.

    Parameters
    ----------
    content : bytes
        The whole file.
    """
    start = content.find(KEYWORD)
    if start < 0 or any(mark in content[start:] for mark in (b"\t", b",", b"_", b"dmig")):
        return None
    lines = [line.rstrip(b"\r ") for line in content.split(b"\n")]
    lines = [line for line in lines if line and not line.startswith(b"$")]
    begins = [number for number, line in enumerate(lines) if not line.startswith(b"*")]
    in_entry = False  #: of DMIG, which goes on in lines that begin with blanks or a plus
    blocks: list[tuple[bytes, list[bytes], list[bytes], list[int]]] = []  # header, columns, rows, rows of each column
    for number, stop in zip(begins, [*begins[1:], len(lines)], strict=True):
        line = lines[number]
        if not line.startswith(KEYWORD):
            if line.startswith((b"+", b" ")) and in_entry:
                return None
            in_entry = in_entry and line.startswith((b"+", b" "))
            continue
        in_entry = True
        if line[LEAD + 8 : LEAD + 16].strip() == b"0" and line[:LEAD] == b"DMIG    ":
            blocks.append((line, [], [], []))
            if stop > number + 1:
                return None
        elif not blocks or line[:LEAD] != LARGE_KEYWORD or line[LEAD:24].strip() != blocks[-1][0][LEAD:16].strip():
            return None
        else:
            blocks[-1][1].append(line)
            blocks[-1][2].extend(lines[number + 1 : stop])
            blocks[-1][3].append(stop - number - 1)
    try:
        return [_matrix(*block) for block in blocks]
    except ValueError:
        return None


def _matrix(header: bytes, columns: Sequence[bytes], rows: Sequence[bytes], counts: Sequence[int]) -> PunchedMatrix:
    column_keys = _keys(_fields(columns, LEAD + FIELD, 2))
    row_keys = _keys(_fields(rows, LEAD, 2))
    if any(len(line) > FULL_LINE for line in (*columns, *rows)) or any(b"$" in line for line in rows):
        msg = "more than four fields, or a remark"
        raise ValueError(msg)
    text = header.decode("latin-1").ljust(72)
    return PunchedMatrix(
        header=[text[place : place + 8] for place in range(8, 72, 8)],
        rows=row_keys,
        columns=np.repeat(column_keys, np.array(counts, dtype=np.int64)),
        values=_fields([line.translate(AS_PYTHON) for line in rows], LEAD + 2 * FIELD, 2),
    )


def _fields(lines: Sequence[bytes], start: int, count: int) -> FloatArray:
    """Parse fields of sixteen characters from one place of each line on; an empty one is zero."""
    if not lines:
        return np.zeros((0, count))
    wide = b"".join([line[start : start + count * FIELD].ljust(count * FIELD) for line in lines])
    table = np.frombuffer(wide, dtype=np.uint8).reshape(-1, FIELD).copy()
    table[(table == BLANK).all(axis=1), -1] = ord("0")
    values = fixed_width([table.tobytes()], FIELD, len(table), [len(table)])
    if not np.isfinite(values).all():
        msg = "no finite number"
        raise ValueError(msg)
    return values.reshape(-1, count)


def _keys(labels: FloatArray) -> Keys:
    whole = np.rint(labels)
    nodes, components = whole.astype(np.int64).T
    if (whole != labels).any() or (nodes <= 0).any() or (components < 0).any() or (components > MOST_COMPONENT).any():
        msg = "no node"
        raise ValueError(msg)
    return np.asarray((nodes << COMPONENT_BITS) + components)
