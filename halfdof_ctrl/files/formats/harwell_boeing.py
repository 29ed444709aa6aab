"""Harwell-Boeing files, as the command HBMAT of ANSYS writes them, and their mapping file.

    title (72 characters), key (8)
    lines in all, of pointers, of row numbers, of values, of right-hand sides         (5 x 14 characters)
    type (3 letters), then rows, columns, entries, elements                           (14 characters each)
    formats of pointers, row numbers (16 each), values, right-hand sides (20 each)
    type of the right-hand sides, ...                                                 (only if there are any)

and then the columns compressed: where each starts, the row numbers, the values, in Fortran's fixed-width fields. The
type ``RSA`` is real, symmetric (the lower triangle is stored) and assembled, ``RUA`` unsymmetric. `scipy.io.hb_read`
(1.17) rejects RSA, which is what finite-element programs write. Layout: Duff, Grimes and Lewis, Users' Guide for the
Harwell-Boeing Sparse Matrix Collection, 1992.

The mapping file has a line of titles and then ``equation, node, DOF label`` lines.
"""

import re
from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.labels import WORD, ansys_ending, ansys_name
from halfdof_ctrl.files.formats.raw_matrix import Declared, RawMatrix, assembled, most_rows
from halfdof_ctrl.files.formats.text_blocks import AS_PYTHON, LONGEST_LINE, Lines, fixed_width, printable, whole_numbers

TYPE_LETTERS = re.compile(rb"^[RCPIQ][SUZHR][AE]", re.IGNORECASE)
FORMATS = re.compile(rb"\(((?:[^()]|\([^()]*\))*)\)")
DESCRIPTOR = re.compile(r"^(?:([+-]?\d+)P,?)?(\d*)\(?([IDEFG])(\d+)(?:\.(\d+))?(?:E\d+)?\)?$")
WITH_EXPONENT = re.compile(rb"\.[0-9]*(?:[DEQdeq][+-]?[0-9]|[+-][0-9])")
SYMMETRY_OF_LETTER: dict[str, Declared] = {"S": "symmetric", "Z": "skew-symmetric", "U": "general", "R": "general"}
TITLES = {"stiff": "K", "mass": "M", "damp": "C"}  #: first word of ANSYS's titles
HEADER_LINES = 4
SECTIONS = ("pointers", "row numbers", "values")
MAPPING_FIELDS = 3


@dataclass(frozen=True, slots=True)
class _Header:
    title: str
    kind: str
    shape: tuple[int, int]
    entries: int
    lines: tuple[int, ...]  #: of pointers, row numbers and values
    fields: tuple[tuple[int, int], ...]  #: (fields of a line, characters of a field) of the same
    decimals: int  #: digits behind the point of a value that has none
    scale: int  #: power of ten by which a value without exponent is divided
    first: int  #: index of the first line of pointers
    right_hand_sides: int  #: lines of right-hand sides


def is_harwell_boeing(content: bytes) -> bool:
    """Tell by the type in the third line."""
    lines = content[:1024].split(b"\n", 3)
    return len(lines) > HEADER_LINES - 1 and TYPE_LETTERS.match(lines[2]) is not None and lines[1].split()[:1] != []


def read_harwell_boeing(content: bytes) -> RawMatrix:
    """Read a real assembled matrix.

    Parameters
    ----------
    content : bytes
        The whole file.

    Raises
    ------
    FileFormatError
        Another type (pattern, complex, elements), a header that the file does not bear out, pointers or row numbers
        that do not describe a matrix, fields that are no numbers, or are
        numbers only with the point or the power of ten of their format.
    """
    lines = Lines(content)
    header = _header(lines, len(content))
    rows, columns = header.shape
    start = header.first
    parts: list[FloatArray] = []
    for number, count in enumerate((columns + 1, header.entries, header.entries)):
        parts.append(_section(lines, start, header, number, count))
        start += header.lines[number]
    _require_written_out(lines, range(start - header.lines[2], start), header)
    pointers, places = whole_numbers(parts[0], "pointers") - 1, whole_numbers(parts[1], "row numbers") - 1
    lengths = np.diff(pointers)
    if pointers[0] != 0 or pointers[-1] != header.entries or (lengths < 0).any():
        msg = (
            f"the pointers to the columns do not lead through the {header.entries} entries (superelements of ANSYS "
            "before 11.0 were written so). Write it anew."
        )
        raise FileFormatError(msg, path="")
    words = header.title.lower()
    letter = next((letter for word, letter in TITLES.items() if words.startswith(word)), None)
    notes = ("there are right-hand sides, which are not read",) if header.right_hand_sides else ()
    return assembled(
        places,
        np.repeat(np.arange(columns), lengths),
        parts[2],
        (rows, columns),
        declared=SYMMETRY_OF_LETTER[header.kind[1]],
        format=f"Harwell-Boeing {header.kind}",
        title=header.title,
        letter=letter,
        notes=notes,
        known_to=known_to(content),
    )


def read_mapping(content: bytes) -> tuple[str, ...]:
    r"""Read the names of the equations from an ANSYS mapping file.

    Raises
    ------
    FileFormatError
        A line that is not ``equation, node, label``, or equations that are not numbered from one on.

    Examples
    --------
    >>> read_mapping(b"  Matrix Eqn   Node   DOF\n  1   7   UX  \n  2   7   ROTZ\n")
    ('n7_u1', 'n7_r3')
    """
    return _plain_mapping(content) or _mapping_by_line(content)


def _mapping_by_line(content: bytes) -> tuple[str, ...]:
    """Read the names one by one, with the line that is wrong."""
    names: dict[int, str] = {}
    for number, line in enumerate(content.split(b"\n"), start=1):
        fields = line.decode("latin-1").split()
        if not fields or (not names and not fields[0].isdigit()):
            continue
        if not (
            len(fields) == MAPPING_FIELDS and fields[0].isdigit() and fields[1].isdigit() and WORD.match(fields[2])
        ):
            msg = f"an equation, a node and a DOF label belong here, not {line[:60].decode('latin-1').strip()!r}."
            raise FileFormatError(msg, path="", line=number)
        names[int(fields[0])] = ansys_name(int(fields[1]), fields[2])
    if not names or set(names) != set(range(1, len(names) + 1)):
        msg = f"{len(names)} equations that are not numbered from 1 on. The mapping file is damaged or cut short."
        raise FileFormatError(msg, path="")
    return tuple([names[equation] for equation in range(1, len(names) + 1)])


def _plain_mapping(content: bytes) -> tuple[str, ...] | None:
    """Read a mapping whose rows number the equations in order, None if anything else about it is unusual."""
    rows = content[content.find(b"\n") + 1 :]
    fields = rows.split()
    first = rows.split(b"\n", 1)[0].split()
    count, rest = divmod(len(fields), MAPPING_FIELDS)
    if rest or not count or len(first) != MAPPING_FIELDS or content.split(b"\n", 1)[0].split()[:1] != [b"Matrix"]:
        return None
    equations, nodes, labels = (fields[place::MAPPING_FIELDS] for place in range(MAPPING_FIELDS))
    endings = {label: ansys_ending(label.decode("latin-1")) for label in set(labels)}
    if not all(WORD.match(label.decode("latin-1")) for label in endings):
        return None
    if equations != [b"%d" % number for number in range(1, count + 1)] or not b"".join(nodes).isdigit():
        return None
    places = rows.count(b"\n") - rows.count(b"\n\n") + (not rows.endswith(b"\n"))
    if places != count:  # rows of other lengths that make up for each other
        return None
    return tuple([f"n{int(node)}_{endings[label]}" for node, label in zip(nodes, labels, strict=True)])


def _header(lines: Lines, length: int) -> _Header:
    if len(lines) < HEADER_LINES:
        msg = "it ends within its header. Write it anew."
        raise FileFormatError(msg, path="")
    cards = _numbers(lines[1], 4, 2)
    kind = lines[2][:3].decode("latin-1").upper()
    if kind[0] != "R" or kind[1] not in SYMMETRY_OF_LETTER or kind[2] != "A":
        msg = f"it holds a matrix of type {kind!r}; real assembled ones are read (RSA, RUA, RZA)."
        raise FileFormatError(msg, path="", line=3)
    rows, columns, entries = _numbers(lines[2][3:], 3, 3)[:3]
    descriptors = _descriptors(lines[3])
    right_hand_sides = cards[4] if len(cards) > HEADER_LINES else 0
    first = HEADER_LINES + (right_hand_sides > 0)
    if max(rows, columns) > most_rows(length) or first + sum(cards[1:4]) > len(lines):
        msg = (
            f"it says {rows} x {columns} with {sum(cards[1:4])} lines of data, but has {len(lines)} lines. It is "
            "damaged or cut short."
        )
        raise FileFormatError(msg, path="")
    return _Header(
        title=printable(lines[0][:72]),
        kind=kind,
        shape=(rows, columns),
        entries=entries,
        lines=tuple(cards[1:4]),
        fields=tuple([found[:2] for found in descriptors]),
        decimals=descriptors[-1][2],
        scale=descriptors[-1][3],
        first=first,
        right_hand_sides=right_hand_sides,
    )


def _numbers(line: bytes, least: int, number: int) -> list[int]:
    fields = line.split()
    if len(fields) < least or not all(field.isdigit() for field in fields):
        shown = line[:70].decode("latin-1").strip()
        msg = f"{least} or more counts belong here, not {shown!r}. The file is damaged."
        raise FileFormatError(msg, path="", line=number)
    return [int(field) for field in fields]


def _descriptors(line: bytes) -> tuple[tuple[int, int, int, int], ...]:
    """Read Fortran format descriptors such as (10I8), (d25.15), (1P,5E16.8): fields, width, decimals, scale."""
    found = []
    texts = [text.decode("latin-1").upper().replace(" ", "") for text in FORMATS.findall(line)[: len(SECTIONS)]]
    for text in texts:
        match = DESCRIPTOR.match(text)
        sound = match is not None and 0 < int(match[2] or 1) * int(match[4]) <= LONGEST_LINE
        if match is None or not sound or (match[3] == "F" and int(match[1] or 0)):
            break
        decimals = 0 if match[3] == "I" else int(match[5] or 0)
        found.append((int(match[2] or 1), int(match[4]), decimals, int(match[1] or 0)))
    if len(found) < len(SECTIONS):
        shown = line.decode("latin-1").strip()[:70]
        msg = f"the formats of pointers, row numbers and values belong here, as (10I8), not {shown!r}."
        raise FileFormatError(msg, path="", line=HEADER_LINES)
    return tuple(found)


def _section(lines: Lines, start: int, header: _Header, number: int, count: int) -> FloatArray:
    """Read one of the three parts."""
    per_line, width = header.fields[number]
    needed = -(-count // per_line)
    if needed != header.lines[number]:
        msg = (
            f"{count} {SECTIONS[number]} in fields of {per_line} a line take {needed} lines, but the header says "
            f"{header.lines[number]}. The file is damaged."
        )
        raise FileFormatError(msg, path="")
    try:
        values = lines.fields(start, start + needed, width, per_line, count)
    except ValueError as cause:
        between = _between_blanks([lines[place] for place in range(start, start + needed)], per_line, count)
        if between is None:
            raise _bad_field(lines, range(start, start + needed), (width, per_line), SECTIONS[number]) from cause
        values = between
    if not np.isfinite(values).all():
        raise _bad_field(lines, range(start, start + needed), (width, per_line), SECTIONS[number])
    return values


def _require_written_out(lines: Lines, where: range, header: _Header) -> None:
    """Refuse values in which Fortran reads a point or a power of ten that does not stand there."""
    text = b"\n".join([lines[place] for place in where]) if header.decimals or header.scale else b""
    if header.decimals and text.count(b".") < header.entries:
        what, how = "decimal point", f"makes decimals of the last {header.decimals} digits"
    elif header.scale and len(WITH_EXPONENT.findall(text)) < header.entries:
        what, how = "exponent", f"divides such values by 1e{header.scale}"
    else:
        return
    msg = f"there are values without {what}, and their format {how}, which nobody may have meant. Write them out."
    raise FileFormatError(msg, path="", line=where.start + 1)


def _between_blanks(part: list[bytes], per_line: int, count: int) -> FloatArray | None:
    """Read fields that are not as wide as the header says, as `scipy.io.hb_write` (1.17) writes them."""
    fields = [line.translate(AS_PYTHON).split() for line in part]
    counts = [per_line] * (len(part) - 1) + [count - per_line * (len(part) - 1)]
    if [len(found) for found in fields] != counts:
        return None
    try:
        return np.array([field for found in fields for field in found]).astype(np.float64)
    except ValueError:
        return None


def _bad_field(lines: Lines, where: range, layout: tuple[int, int], what: str) -> FileFormatError:
    """Find the first line with a field that is no number."""
    width, per_line = layout
    for number in where:
        line = lines[number]
        filled = min(max(-(-len(line.rstrip()) // width), 1), per_line)
        try:
            sound = bool(np.isfinite(fixed_width([line], width, per_line, [filled])).all())
        except ValueError:
            sound = False
        if not sound:
            msg = f"{what} that are no finite numbers: {line[:60].decode('latin-1').strip()!r}. The file is damaged."
            return FileFormatError(msg, path="", line=number + 1)
    return FileFormatError(f"too few {what} in their lines. The file is damaged.", path="", line=where.start + 1)
