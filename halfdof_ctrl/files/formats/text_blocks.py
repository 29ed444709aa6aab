"""Numbers from text files, block by block and with the line that is wrong.

Rows of numbers are parsed by `numpy.loadtxt`, which refuses rows of another length and text that is no number;
before that, commas become blanks and the ``D`` of Fortran's double precision an ``E``. Fields of fixed width, as
Fortran writes them, are cut out of padded lines, so that numbers without a blank between them come apart.
"""

import io
import re
from collections.abc import Iterator, Sequence

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import FileFormatError

BOM = b"\xef\xbb\xbf"  #: begins text that Windows wrote as UTF-8
LONGEST_LINE = 1024  #: characters of a line of fixed fields; Fortran's own limit is 132
TEXT_BLOCK = 2**25  #: bytes that are parsed at once
AS_PYTHON = bytes.maketrans(b",;DdQq\t\r", b"  EeEe  ")
NEWLINE, BLANK_BYTES = 10, 32  #: bytes; what is not above the second cannot be seen
TAIL = 4096  #: bytes at the end of a text that are looked at
FEWEST_LINES = 2  #: whose last numbers tell how long such a number is
WRITTEN_FULL = 9  #: characters: longer numbers of one length are those of a format, not of chance
WIDE_ROW = 4096  #: numbers; longer rows are parsed in pieces ...
WIDE_PIECE = 2**15  #: ... of so many bytes
TOO_LONG = "a line has more than its fields"
TOO_SHORT = "lines are far shorter than their fields"
MOST_GROWTH = 10  #: times that lines may grow when blanks at their ends are filled in,
FREE_SPREAD = 2**20  #: beyond so many bytes
LARGEST_WHOLE = 2.0**53  #: above it a float64 does not tell neighbouring integers apart
ANY_FIELD = re.compile(rb"\S+")
ENDING_IN_EXPONENT = re.compile(rb"([0-9.])([+-][0-9]+)$")  #: Fortran drops the letter of an exponent of three digits


def number_rows(content: bytes, columns: int, *, comment: str, first_line: int = 1) -> FloatArray:
    r"""Parse a table of numbers.

    Parameters
    ----------
    content : bytes
        Rows of numbers between blanks or commas. Empty lines are skipped.
    columns : int
        How many numbers a row has.
    comment : str
        What follows this character in a line is no part of the table.
    first_line : int
        Number of the content's first line in the file, for messages.

    Returns
    -------
    (rows, columns) ndarray

    Raises
    ------
    FileFormatError
        A row with more or fewer numbers, text, NaN or Inf, with its line.

    Examples
    --------
    >>> number_rows(b"1,1, 2,1, -3.5D+02\n", 5, comment="*").tolist()
    [[1.0, 1.0, 2.0, 1.0, -350.0]]
    """
    tables: list[FloatArray] = []
    for block, line in _blocks(content, first_line):
        text = block.translate(AS_PYTHON)
        marked = comment.encode() in text
        if not _has_rows(text, comment):  # loadtxt would warn, and a filter is the whole process's
            continue
        try:
            if columns > WIDE_ROW:
                table = _wide_rows(text, columns, comment)
            else:
                table = np.loadtxt(io.BytesIO(text), comments=comment if marked else None, ndmin=2)
        except ValueError as cause:
            raise _bad_row(text, columns, comment, line) from cause
        if table.size and (table.shape[1] != columns or not np.isfinite(table).all()):
            raise _bad_row(text, columns, comment, line)
        tables.append(table.reshape(-1, columns))
    if not tables:
        return np.empty((0, columns))
    return tables[0] if len(tables) == 1 else np.concatenate(tables)  # a copy takes as much again


def _wide_rows(text: bytes, columns: int, comment: str) -> FloatArray:
    """Parse rows piece by piece: for one row loadtxt takes some thirty bytes a number."""
    lines = [line for line in (whole.split(comment.encode(), 1)[0].strip() for whole in text.split(b"\n")) if line]
    table = np.empty((len(lines), columns))
    for row, line in zip(table, lines, strict=True):
        start = filled = 0
        while start < len(line):
            stop = line.find(b" ", start + WIDE_PIECE)
            piece = line[start : stop if stop > 0 else len(line)]
            start += len(piece)
            if not piece.strip():
                continue
            numbers = np.loadtxt(io.BytesIO(piece), comments=None, ndmin=1)
            if filled + numbers.size > columns:
                raise ValueError(TOO_LONG)
            row[filled : filled + numbers.size] = numbers
            filled += numbers.size
        if filled < columns:
            raise ValueError(TOO_SHORT)
    return table


def whole_numbers(values: FloatArray, what: str) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Return parsed numbers as integers, and refuse fractions.

    Raises
    ------
    FileFormatError
        A number with a fraction, or too large to be told from its neighbours.
    """
    rounded = np.rint(values)
    wrong = np.flatnonzero((rounded != values) | (np.abs(values) >= LARGEST_WHOLE))
    if wrong.size:
        msg = f"{what} must be whole numbers, but one of them is {values.flat[wrong[0]]:.17g}."
        raise FileFormatError(msg, path="")
    return rounded.astype(np.int64)


def printable(text: bytes) -> str:
    r"""Return a name or title of a file for people to read, whatever damage did to it.

    >>> printable(b"KAAX \x00\n")
    'KAAX'
    >>> printable(b"KA\nX")
    'KA?X'
    """
    return visible(text.decode("latin-1").strip(" \0\r\n\t"))


def visible(text: str) -> str:
    r"""Put a question mark in the place of each letter that cannot be seen.

    >>> visible("K\x1b[2J")
    'K?[2J'
    """
    return "".join([letter if letter.isprintable() else "?" for letter in text])


def is_cut_short(content: bytes) -> bool:
    r"""Return whether the last number of a text without a last line end has lost digits for sure.

    So it is where the numbers that end the lines before it all have one length and it has less.

    >>> is_cut_short(b"1, 2.50000000e+01\n2, 1.25000000e+02\n3, 3.00000000e+00\n4, 1.5000")
    True
    """
    lines = content[-TAIL:].split(b"\n")
    ends = [line.split()[-1].lstrip(b"+-") for line in lines[1:] if line.strip()]
    if content.endswith((b"\n", b"\r")) or b"\0" in content[-TAIL:] or len(ends) <= FEWEST_LINES:
        return False
    lengths = {len(end) for end in ends[:-1]}
    return len(lengths) == 1 and lengths.pop() > max(len(ends[-1]), WRITTEN_FULL)


def fixed_width(lines: Sequence[bytes], width: int, per_line: int, counts: Sequence[int]) -> FloatArray:
    """Cut lines into fields of fixed width and parse them as numbers.

    Parameters
    ----------
    lines : sequence of bytes
        Without line ends; blanks that are missing at their ends are filled in.
    width, per_line : int
        Characters of a field, and fields of a full line.
    counts : sequence of int
        Fields of each line.

    Returns
    -------
    (fields,) ndarray

    Raises
    ------
    ValueError
        A field is no number, or a line has more than its fields.

    Examples
    --------
    >>> fixed_width([b" 1.0D+00-2.5E-01", b" 3.0-101"], 8, 2, [2, 1]).tolist()
    [1.0, -0.25, 3e-101]
    """
    full = width * per_line
    if any(len(line) > full and line[full:].strip() for line in lines):
        raise ValueError(TOO_LONG)
    if full * len(lines) > FREE_SPREAD + MOST_GROWTH * sum(map(len, lines)):
        raise ValueError(TOO_SHORT)
    text = b"".join([line[:full].ljust(full) for line in lines]).translate(AS_PYTHON)
    fields = np.frombuffer(text, dtype=f"S{width}").reshape(len(lines), per_line)
    return _parsed(fields[np.arange(per_line) < np.asarray(counts)[:, None]])


class Lines:
    """The lines of a text by number, without a list of them."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.ends = np.flatnonzero(np.frombuffer(content, dtype=np.uint8) == NEWLINE)
        if not content.endswith(b"\n"):
            self.ends = np.append(self.ends, len(content))

    def __len__(self) -> int:
        """Count the lines."""
        return int(self.ends.size)

    def __getitem__(self, number: int) -> bytes:
        """Return a line, counted from zero, without its end."""
        return self.content[self._start(number) : int(self.ends[number])].rstrip(b"\r")

    def _start(self, number: int) -> int:
        return int(self.ends[number - 1]) + 1 if number else 0

    def fields(self, first: int, stop: int, width: int, per_line: int, count: int) -> FloatArray:
        """Parse fields of fixed width in a range of lines that are full but for the last one.

        Raises
        ------
        ValueError
            A field is no number, or a line has more than its fields.
        """
        lengths = np.diff(self.ends[first : stop - 1], prepend=self._start(first) - 1)
        full = width * per_line
        if lengths.size and lengths[0] > full and (lengths == lengths[0]).all():  # alike, so cut in one piece
            text = self.content[self._start(first) : int(self.ends[stop - 2]) + 1].translate(AS_PYTHON)
            table = np.frombuffer(text, dtype=np.uint8).reshape(lengths.size, int(lengths[0]))
            if (table[:, full:] > BLANK_BYTES).any():
                raise ValueError(TOO_LONG)
            alike = _parsed(np.ascontiguousarray(table[:, :full]).reshape(-1).view(f"S{width}"))
            last = fixed_width([self[stop - 1]], width, per_line, [count - alike.size])
            return np.concatenate([alike, last])
        counts = [per_line] * (stop - first - 1) + [count - per_line * (stop - first - 1)]
        return fixed_width([self[number] for number in range(first, stop)], width, per_line, counts)


def _parsed(fields: np.ndarray[tuple[int, ...], np.dtype[np.bytes_]]) -> FloatArray:
    try:
        return fields.astype(np.float64)
    except ValueError:  # an exponent of three digits without its letter, or no number
        return np.array([_fortran_number(field) for field in fields.reshape(-1).tolist()], dtype=np.float64)


def _fortran_number(field: bytes) -> float:
    try:
        return float(field)
    except ValueError:
        return float(ENDING_IN_EXPONENT.sub(rb"\1E\2", field.strip()))


def _blocks(content: bytes, first_line: int) -> Iterator[tuple[bytes, int]]:
    """Cut the content at line ends, with the number of each block's first line."""
    start, line = 0, first_line
    while start < len(content):
        stop = content.find(b"\n", min(start + TEXT_BLOCK, len(content)))
        stop = len(content) if stop < 0 else stop + 1
        block = content[start:stop]
        yield block, line
        line += block.count(b"\n")
        start = stop


def _has_rows(text: bytes, comment: str) -> bool:
    return re.search(rb"^ *[^\s" + re.escape(comment.encode()) + rb"]", text, re.MULTILINE) is not None


def _bad_row(text: bytes, columns: int, comment: str, first_line: int) -> FileFormatError:
    """Find the first row that is wrong."""
    for number, whole in enumerate(text.split(b"\n"), start=first_line):
        row = whole.split(comment.encode(), 1)[0]
        count = sum(1 for _ in ANY_FIELD.finditer(row))
        if not count:
            continue
        shown = repr(whole[:60].decode("latin-1").strip())
        if count != columns:
            msg = f"{count} numbers where a row has {columns}: {shown}. The file is damaged or cut short."
            return FileFormatError(msg, path="", line=number)
        if not all(_is_finite_number(field) for field in row.split()):
            msg = f"something that is no finite number: {shown}. The file is damaged or of another kind."
            return FileFormatError(msg, path="", line=number)
    return FileFormatError("rows that are no numbers. The file is damaged.", path="", line=first_line)


def _is_finite_number(field: bytes) -> bool:
    try:
        return bool(np.isfinite(float(field))) and b"_" not in field
    except ValueError:
        return False
