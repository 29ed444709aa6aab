"""OUTPUT4 files of Nastran, text or binary.

A file holds matrices one after the other. A header (columns, rows, form, type, name) is followed by columns, each with
its number, the first row and the count of words, and a last one whose number is one more than there are columns:

    dense        first row > 0     then the values from that row on
    sparse       first row 0       then strings of (length and row in one word) and values, up to 65535 rows
    big sparse   rows < 0          then strings of (length, row) and values

In binary each record stands between two counts of its bytes (little or big endian, words of 4 or 8 bytes). All counts
are checked against the bytes or lines that there are. Form 6 is symmetric, 3 a diagonal (stored as one column or
whole), 8 an identity whose columns are not stored; factors (4, 5, 10, 13, 15) are called so. Types 1, 2 are real
(single, double), 3, 4 complex. With words of 8 bytes each holds 4 characters of a name.

Source: MSC Nastran DMAP Programmer's Guide, module OUTPUT4.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.base.digits import SINGLE_ROUNDING
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.columns import runs
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.output4_binary import (
    CUT,
    DAMAGED,
    RECORD_MARK,
    BinaryWords,
    binary_strings,
)
from halfdof_ctrl.files.formats.output4_forms import declared_by_form, doubts_of_form, meant_by_form
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS, RawMatrix, assembled, most_rows
from halfdof_ctrl.files.formats.text_blocks import LONGEST_LINE, Lines, fixed_width, printable

OP4_COMPLEX_TYPES, DOUBLE_TYPES, OP4_TYPES = (3, 4), (2, 4), range(1, 5)
HEADER_BYTES = {24: 4, 48: 8}  #: bytes of a header: bytes of a word in it
MOST_SETS = 4  #: matrices of as many columns as the file has bytes
BIG = 65536  #: rows from which a sparse matrix is stored in the big form
NUMBER_FORMAT = re.compile(r"\(?(?:1P,?)?(\d+)[ED](\d+)\.\d+\)?")
WIDE = "|I16"  #: ends a header whose counts have 16 characters
DEFAULT_FORMAT = (5, 16)  #: numbers of a line and characters of a number


@dataclass(slots=True)
class _Matrix:
    """A matrix while it is read: strings of values that stand below each other in a column."""

    name: str
    shape: tuple[int, int]
    form: int
    type: int
    big: bool
    rows: list[int] = field(default_factory=list)  #: first row of each string, from one on
    columns: list[int] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)  #: values of each string

    @property
    def per_value(self) -> int:
        """Real numbers of a value."""
        return 2 if self.type in OP4_COMPLEX_TYPES else 1

    def add(self, column: int, row: int, count: int) -> None:
        """Note where the next values belong, `column` and `row` counted from one."""
        self.columns.append(column)
        self.rows.append(row)
        self.counts.append(count)

    def finished(self, numbers: npt.NDArray[Any], words: str, rounding: float) -> RawMatrix:
        """Put the numbers to their places."""
        columns, rows, counts = (np.array(part, dtype=np.int64) for part in (self.columns, self.rows, self.counts))
        outside = (
            (columns < 1) | (columns > self.shape[1]) | (rows < 1) | (counts < 0) | (rows - 1 + counts > self.shape[0])
        )
        if outside.any():
            first = int(np.argmax(outside))
            msg = (
                f"{counts[first]} values from row {rows[first]} of column {columns[first]} in {self.name}, which is "
                f"{self.shape[0]} x {self.shape[1]}. {DAMAGED}"
            )
            raise FileFormatError(msg, path="")
        if not np.isfinite(numbers).all():
            msg = f"{self.name} has entries that are not finite. {DAMAGED}"
            raise FileFormatError(msg, path="")
        values = numbers[0::2] + 1j * numbers[1::2] if self.per_value > 1 else numbers
        places = (runs(rows - 1, counts), np.repeat(columns - 1, counts))
        i, j, values, shape = meant_by_form(self.form, self.shape, self.name, (*places, values))
        return assembled(
            i,
            j,
            values,
            shape,
            declared=declared_by_form(self.form) if shape[0] == shape[1] else "unsaid",
            format=f"Nastran OUTPUT4 {words}, form {self.form}",
            title=self.name,
            named=True,
            doubts=doubts_of_form(self.form),
            known_to=rounding,
        )


def is_binary_output4(content: bytes) -> bool:
    """Tell by the count of bytes of the first header."""
    return _byte_order(content) is not None


def is_text_output4(content: bytes) -> bool:
    """Tell by the four integers, the name and the format in the first line."""
    return re.match(rb"^[ \d]{7}\d[ \d-]{7}\d {6,7}\d {6,7}[1-4][A-Za-z]", content[:80]) is not None


def read_output4(content: bytes, room: int = MOST_ROWS) -> list[RawMatrix]:
    """Read all matrices of a file.

    Parameters
    ----------
    content : bytes
        The whole file.
    room : int
        A header with more rows or columns is taken for damage.

    Raises
    ------
    FileFormatError
        A header, a record or a string of values that contradicts the file or the matrix's size, numbers that are not
        finite, no matrix at all.
    """
    order = _byte_order(content)
    found: list[RawMatrix] = []
    columns = 0
    for raw in _text_matrices(Lines(content), room) if order is None else _binary_matrices(content, order, room):
        found.append(raw)
        columns += raw.matrix.shape[1]
        if columns > MOST_SETS * most_rows(len(content)):
            msg = f"matrices of {columns} columns in all in a file of {len(content)} bytes. {DAMAGED}"
            raise FileFormatError(msg, path="")
    if not found:
        msg = "no matrix in it. Write it by OUTPUT4 or EXTSEOUT(ASMBULK,EXTBULK,DMIGOP2 or MATOP4)."
        raise FileFormatError(msg, path="")
    return found


def _opened(numbers: tuple[int, ...], name: str, room: int) -> _Matrix:
    columns, rows, form, kind = numbers
    sound = 0 < columns <= room and 0 < abs(rows) <= room and kind in OP4_TYPES
    if not sound:
        msg = f"a header with {columns} columns, {rows} rows and type {kind}. {DAMAGED}"
        raise FileFormatError(msg, path="")
    return _Matrix(name.lower(), (abs(rows), columns), form, kind, big=rows < 0 or rows >= BIG)


def _byte_order(content: bytes) -> str | None:
    for order in "<>":
        if int(np.frombuffer(content[:RECORD_MARK].ljust(RECORD_MARK, b"\0"), order + "u4")[0]) in HEADER_BYTES:
            return order
    return None


def _binary_matrices(content: bytes, order: str, room: int) -> Iterator[RawMatrix]:
    words = BinaryWords(content, order)
    place = 0
    while place < len(words.quarters):
        start, stop = words.record(place)
        word = HEADER_BYTES.get(RECORD_MARK * (stop - start))
        if word is None:
            msg = f"a record of {RECORD_MARK * (stop - start)} bytes where a header should be. {DAMAGED}"
            raise FileFormatError(msg, path="")
        numbers = tuple([words.integer(start, number, word) for number in range(4)])
        title = content[RECORD_MARK * start + 4 * word : RECORD_MARK * stop]
        matrix = _opened(numbers, printable(_joined_name(title, word)), room)
        real = np.dtype(f"{order}f8" if matrix.type in DOUBLE_TYPES else f"{order}f{word}")
        strings = binary_strings(words, stop + 1, matrix, (word, real.itemsize))
        matrix.rows, matrix.columns, matrix.counts = strings.rows, strings.columns, strings.counts
        rounding = SINGLE_ROUNDING if real.itemsize == RECORD_MARK else EPS
        yield matrix.finished(words.values(strings, real, matrix.per_value), "binary", rounding)
        place = strings.stop
    words.require_whole()


def _joined_name(field: bytes, word: int) -> bytes:
    """Return a name without the blanks that fill words of 8 bytes, where each holds four characters.

    >>> _joined_name(b"LAMB    DA      ", 8), _joined_name(b"LAMBDA  ", 4)
    (b'LAMBDA  ', b'LAMBDA  ')
    """
    halves = [field[place : place + word] for place in range(0, len(field), word)]
    if word == RECORD_MARK or any(half[RECORD_MARK:].strip(b" \0") for half in halves):
        return field
    return b"".join([half[:RECORD_MARK] for half in halves])


def _text_matrices(lines: Lines, room: int) -> Iterator[RawMatrix]:
    number = 0
    rounding = known_to(lines.content)
    while number < len(lines) and lines[number].strip():
        matrix, per_line, width = _text_header(lines[number].decode("latin-1").rstrip(), room, number)
        number += 1
        parts: list[bytes] = []
        counts: list[int] = []
        while True:
            column, row, words = _integers(lines, number, 3)
            if column > matrix.shape[1]:
                break
            number = _text_column(matrix, lines, number, (column, row, words), (per_line, parts, counts))
        number += 1 + -(-words // per_line)  # with the value of the last column, which means nothing
        if number > len(lines):
            raise FileFormatError(CUT, path="")
        try:
            numbers = fixed_width(parts, width, per_line, counts) if parts else np.zeros(0)
        except ValueError as cause:
            msg = f"{matrix.name} has entries that are no numbers. {DAMAGED}"
            raise FileFormatError(msg, path="") from cause
        yield matrix.finished(numbers, "text", rounding)
    if any(lines[later].strip() for later in range(number, len(lines))):
        msg = f"an empty line stands between its matrices. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number + 1)


def _text_header(line: str, room: int, number: int) -> tuple[_Matrix, int, int]:
    wide = line.endswith(WIDE)
    stops = (16, 32, 40, 48, 56) if wide else (8, 16, 24, 32, 40)
    cuts = [line[start:stop] for start, stop in zip((0, *stops), stops, strict=False)]
    try:
        numbers = tuple(int(cut) for cut in cuts[:4])
    except ValueError as cause:
        msg = f"columns, rows, form, type and name of a matrix belong here, not {line[:60]!r}. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number + 1) from cause
    text = line[stops[-1] :].removesuffix(WIDE).strip()
    match = NUMBER_FORMAT.fullmatch(text.upper())
    per_line, width = DEFAULT_FORMAT if match is None else (int(match[1]), int(match[2]))
    if not 0 < per_line * width <= LONGEST_LINE or (text and match is None):
        msg = f"the number format {text[:60]!r} is none of OUTPUT4. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number + 1)
    return _opened(numbers, printable(cuts[4].encode("latin-1")), room), per_line, width


def _integers(lines: Lines, number: int, count: int) -> list[int]:
    """Read integers of eight characters."""
    if number >= len(lines):
        raise FileFormatError(CUT, path="")
    line = lines[number]
    try:
        return [int(line[8 * i : 8 * i + 8]) for i in range(count)]
    except ValueError as cause:
        msg = f"{count} integers of 8 characters belong here, not {line[:60].decode('latin-1')!r}. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number + 1) from cause


def _text_column(
    matrix: _Matrix,
    lines: Lines,
    number: int,
    head: tuple[int, int, int],
    into: tuple[int, list[bytes], list[int]],
) -> int:
    """Collect the lines of a column and give the number of the line after it."""
    column, row, words = head
    if words < 0:
        msg = f"a column of {words} words. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number + 1)
    number += 1
    if row > 0:
        return _text_string(matrix, lines, number, (column, row, words), into)
    per_number = 2 if matrix.type in DOUBLE_TYPES else 1
    while words > 0:
        if matrix.big:
            length, start = _integers(lines, number, 2)
            words -= length + 1
        else:
            if number >= len(lines):
                raise FileFormatError(CUT, path="")
            packed = _packed(lines[number], number)
            length, start = packed >> 16, packed & 0xFFFF
            words -= length
        if length < 1 or words < 0:
            msg = f"a string of {length} words in column {column} of {matrix.name}. {DAMAGED}"
            raise FileFormatError(msg, path="", line=number + 1)
        number = _text_string(matrix, lines, number + 1, (column, start, (length - 1) // per_number), into)
    return number


def _packed(line: bytes, number: int) -> int:
    try:
        return int(line)
    except ValueError as cause:
        msg = f"an integer belongs here, not {line[:60].decode('latin-1')!r}. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number + 1) from cause


def _text_string(
    matrix: _Matrix,
    lines: Lines,
    number: int,
    where: tuple[int, int, int],
    into: tuple[int, list[bytes], list[int]],
) -> int:
    """Collect the lines of consecutive numbers."""
    column, row, count = where
    per_line, parts, counts = into
    stop = number + -(-count // per_line)
    if stop > len(lines):
        raise FileFormatError(CUT, path="")
    if count % matrix.per_value:
        msg = f"{count} numbers in column {column} of {matrix.name} are no whole complex values. {DAMAGED}"
        raise FileFormatError(msg, path="", line=number)
    matrix.add(column, row, count // matrix.per_value)
    for place in range(number, stop):
        parts.append(lines[place])
        counts.append(min(per_line, count - per_line * (place - number)))
    return stop
