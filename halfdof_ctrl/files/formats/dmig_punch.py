"""DMIG and EXTRN entries as Nastran itself punches them, read by columns of characters instead of line by line.

    DMIG    NAME           0       6       2       0                      15
    DMIG*   NAME                      column node column component
    *               row node       row component       real part  imaginary part

    EXTRN       node  components    node  components ...  (four pairs a line, in fields of 8 characters)

A file with anything else about these entries (small fields, commas, tabs, other continuation marks, fields that are
no numbers) is left to the reader in `dmig`, which knows all layouts and names the line that is wrong.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.files.formats.columns import (
    BLANK,
    Characters,
    CutLines,
    Integers,
    cut_lines,
    real_fields,
    runs,
    texts_of,
    whole_fields,
)
from halfdof_ctrl.files.formats.text_blocks import AS_PYTHON

KEYWORD = b"DMIG"
HEADER, COLUMN = b"DMIG    ", b"DMIG*   "  #: first fields of the two kinds of entries
FIELD = 16  #: characters
LEAD = 8  #: characters before the fields
FULL_LINE = LEAD + 4 * FIELD
PUNCH_COMPONENT_BITS, MOST_COMPONENT = 3, 6
MOST_NODE = 2 ** (63 - PUNCH_COMPONENT_BITS)
STAR, PLUS, DMIG_PUNCH_REMARK = ord("*"), ord("+"), ord("$")
EXPONENTS = np.frombuffer(AS_PYTHON, dtype=np.uint8)  #: what each character becomes for Python
DMIG_PUNCH_EXTRN, DMIG_PUNCH_SMALL = b"\nEXTRN   ", 8
DIGIT = 9
BLOCK = 2**14  #: lines that are read at once
GOES_ON = np.array([BLANK, PLUS], dtype=np.uint8)  #: first characters of the lines by which an EXTRN entry goes on
OTHER_MARKS = (b"\t", b",", b"_", b"dmig")  #: of the layouts that are not read here


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PunchedMatrix:
    """Entries of one matrix: a key is the node, shifted, with the component."""

    header: list[str]  #: fields of 8 characters
    rows: Integers
    columns: Integers
    values: npt.NDArray[Any]  #: (k, 2) real and imaginary parts, or amplitudes and phases


def punched_matrices(content: bytes) -> list[PunchedMatrix] | None:
    """Read all matrices of a file, None if it has another layout.

    Parameters
    ----------
    content : bytes
        The whole file.
    """
    start = content.find(KEYWORD)
    if start < 0 or any(content.find(mark, start) >= 0 for mark in OTHER_MARKS):
        return None
    lines = cut_lines(content[content.rfind(b"\n", 0, start) + 1 :])
    first = lines.cut(0, 1)[:, 0]
    kept = first != DMIG_PUNCH_REMARK
    hollow = np.flatnonzero(first == BLANK)  # perhaps empty lines
    kept[hollow] = (lines.cut(0, FULL_LINE, hollow) != BLANK).any(axis=1)
    if not kept.all():
        lines, first = CutLines(text=lines.text, starts=lines.starts[kept], lengths=lines.lengths[kept]), first[kept]
    try:
        return _matrices(lines, first)
    except ValueError:
        return None


def _matrices(lines: CutLines, first: Characters) -> list[PunchedMatrix] | None:
    """Sort lines into headers, columns and rows."""
    heads = np.flatnonzero(first != STAR)  # lines that begin an entry, or go on with one of another layout
    names = lines.cut(0, LEAD + FIELD, heads)
    words = texts_of(names[:, :LEAD])
    is_dmig = texts_of(names[:, : len(KEYWORD)]) == KEYWORD
    if _goes_on(first[heads], is_dmig).any():
        return None
    is_header = words == HEADER
    is_header[is_header] = np.char.strip(texts_of(names[is_header, FIELD:])) == b"0"
    is_column = is_dmig & ~is_header
    stops = np.append(heads[1:], first.size)
    if (is_column & (words != COLUMN)).any() or (stops - heads > 1)[is_header].any():
        return None
    headers = np.flatnonzero(is_header)
    if not headers.size or is_column[: headers[0]].any():
        return [] if not is_column.any() else None
    found = []
    for begin, stop in zip(headers, [*headers[1:].tolist(), heads.size], strict=True):
        own = np.flatnonzero(is_column[begin:stop]) + begin
        if own.size and own.size < own[-1] - begin:  # other entries between the columns
            return None
        titles = np.char.strip(np.unique(texts_of(names[own, LEAD:])))
        if (titles != names[begin, LEAD:FIELD].tobytes().strip()).any():
            return None
        header = lines.cut(0, FULL_LINE, heads[begin : begin + 1])[0].tobytes().decode("latin-1")
        found.append(_matrix(lines, header, heads[own], stops[own]))
    return found


def _goes_on(first: Characters, is_dmig: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Find lines by which a DMIG entry goes on, other than by a star."""
    more = (first == PLUS) | (first == BLANK)
    if not more.any():
        return np.asarray(more)
    entry = np.maximum.accumulate(np.where(more, 0, np.arange(first.size)))  # line that begins the entry
    return np.asarray(more & is_dmig[entry])


def _matrix(lines: CutLines, header: str, heads: Integers, stops: Integers) -> PunchedMatrix:
    """Read one matrix of its columns, each from a line to the one before another."""
    counts = stops - heads - 1
    rows = runs(heads + 1, counts)
    longest = max(int(lines.lengths[part].max(initial=0)) for part in (rows, heads))
    if longest > FULL_LINE and any((lines.cut(FULL_LINE, longest, part) != BLANK).any() for part in (rows, heads)):
        msg = "more than four fields"
        raise ValueError(msg)
    values = np.empty((rows.size, 2))
    for place in (2, 3):
        values[:, place - 2] = _by_blocks(_values, lines, LEAD + place * FIELD, rows)
    return PunchedMatrix(
        header=[header[place : place + 8] for place in range(8, FULL_LINE, 8)],
        rows=_by_blocks(_keys, lines, LEAD, rows),
        columns=np.repeat(_by_blocks(_keys, lines, LEAD + FIELD, heads), counts),
        values=values,
    )


def _by_blocks(
    read: Callable[[CutLines, int, Integers], npt.NDArray[Any]], lines: CutLines, start: int, which: Integers
) -> npt.NDArray[Any]:
    """Read a field of many lines some at a time: what is made in between stays in the processor's cache."""
    return np.concatenate([read(lines, start, which[at : at + BLOCK]) for at in range(0, max(which.size, 1), BLOCK)])


def _values(lines: CutLines, start: int, which: Integers) -> npt.NDArray[Any]:
    """Parse numbers whose exponent may be D."""
    if not (lines.lengths[which] > start).any():
        return np.zeros(which.size)
    return real_fields(EXPONENTS[lines.cut(start, FIELD, which)])


def _keys(lines: CutLines, start: int, which: Integers) -> Integers:
    """Read node and component."""
    nodes = whole_fields(lines.cut(start, FIELD, which))
    components = whole_fields(lines.cut(start + FIELD, FIELD, which))
    sound = (nodes > 0) & (nodes < MOST_NODE) & (components >= 0) & (components <= MOST_COMPONENT)
    if not sound.all():
        msg = "no node"
        raise ValueError(msg)
    return np.asarray((nodes << PUNCH_COMPONENT_BITS) + components)


def extrn_labels(content: bytes) -> tuple[list[int], list[int]] | None:
    r"""Read nodes and components of the only EXTRN entry, None if it has another layout.

    Examples
    --------
    >>> extrn_labels(b"$ ROWS$\nEXTRN          3     123    1001       0$\n              12       2\nGRID\n")
    ([3, 3, 3, 1001, 12], [1, 2, 3, 0, 2])
    """
    start = 0 if content.startswith(DMIG_PUNCH_EXTRN[1:]) else content.find(DMIG_PUNCH_EXTRN) + 1
    if not content.startswith(DMIG_PUNCH_EXTRN[1:], start) or content.find(DMIG_PUNCH_EXTRN, start) >= 0:
        return None
    characters = cut_lines(content[start:]).cut(0, FULL_LINE)
    more = np.isin(characters[1:, 0], GOES_ON) | (characters[1:, 0] == DMIG_PUNCH_REMARK)
    characters = characters[: 1 + int(np.argmin(np.append(more, False)))]
    remark = characters == DMIG_PUNCH_REMARK
    if remark.any():
        characters = np.where(np.maximum.accumulate(remark, axis=1), np.uint8(BLANK), characters)
    fields = np.ascontiguousarray(characters[:, LEAD:]).reshape(-1, 2, DMIG_PUNCH_SMALL)
    fields = fields[(fields != BLANK).any(axis=(1, 2))]
    marks = fields[:, 1] != BLANK
    digits = fields[:, 1][marks] - np.uint8(ord("0"))
    if not len(fields) or not marks.any(axis=1).all() or (digits > DIGIT).any():
        return None
    try:
        nodes = whole_fields(fields[:, 0])
    except ValueError:
        return None
    if not (fields[:, 0] != BLANK).any(axis=1).all() or (nodes < 0).any():
        return None
    return np.repeat(nodes, marks.sum(axis=1)).tolist(), digits.tolist()
