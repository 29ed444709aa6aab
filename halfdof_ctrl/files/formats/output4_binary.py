"""The records of binary OUTPUT4 files: where the strings of values stand, and the values.

A record stands between two counts of its bytes. That of a column holds its number, the first row, the count of words,
and then values (first row > 0), or strings of values, each behind its length and row. All is counted here in quarters,
words of four bytes, since records lie on multiples of four bytes even where their words have eight.
"""

import sys
from array import array
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.columns import runs

Views = tuple[tuple["array[int]", "array[int]"], int]  #: words from even and odd quarters on, and a shift

RECORD_MARK = 4  #: bytes of a record's length, and of a quarter
OUTPUT4_BINARY_HALF, HALF_MASK = 16, 0xFFFF  #: bits of the row in a word that holds length and row
CUT = "it ends within a matrix. The file is cut short."
DAMAGED = "The file is damaged."


class MatrixHead(Protocol):
    """What the header of a matrix says."""

    name: str
    shape: tuple[int, int]
    big: bool

    @property
    def per_value(self) -> int: ...  # noqa: D102


@dataclass(slots=True)
class Strings:
    """Values that stand below each other in a column: where they are in the file and where they belong."""

    columns: list[int] = field(default_factory=list)  #: from one on
    rows: list[int] = field(default_factory=list)  #: of the first value, from one on
    counts: list[int] = field(default_factory=list)  #: values
    places: list[int] = field(default_factory=list)  #: quarter where they begin
    stop: int = 0  #: quarter behind the matrix's last record


class BinaryWords:
    """The words of a file in the processor's byte order."""

    def __init__(self, content: bytes, order: str) -> None:
        self.length = len(content)
        self.stored = np.frombuffer(content, "u4", len(content) // RECORD_MARK)
        self.content, self.order = content, order
        self.quarters = _native(content, order, "i", 0)
        self.views: dict[int, Views] = {RECORD_MARK: ((self.quarters, self.quarters), 0)}

    def of_size(self, word: int) -> Views:
        """Return words from even and from odd quarters on, and the shift from a quarter to its place there."""
        if word not in self.views:
            starts = (0, RECORD_MARK)
            even, odd = (_native(self.content, self.order, "q", start) for start in starts)
            self.views[word] = ((even, odd), 1)
        return self.views[word]

    def integer(self, place: int, number: int, word: int) -> int:
        """Return one of the words from a quarter on."""
        place += number * word // RECORD_MARK
        views, shift = self.of_size(word)
        return views[place & 1][place >> shift]

    def record(self, place: int) -> tuple[int, int]:
        """Return where the content of the record at a quarter begins and ends.

        Raises
        ------
        FileFormatError
            It goes beyond the file, or does not end as it begins.
        """
        length = self.quarters[place]
        stop = place + 1 + (length & 0xFFFFFFFF) // RECORD_MARK
        if stop >= len(self.quarters):
            raise FileFormatError(CUT, path="")
        if self.quarters[stop] != length or length % RECORD_MARK:
            msg = f"the record at byte {RECORD_MARK * place} does not end as it begins. {DAMAGED}"
            raise FileFormatError(msg, path="")
        return place + 1, stop

    def require_whole(self) -> None:
        """Refuse bytes behind the last record."""
        if self.length % RECORD_MARK:
            raise FileFormatError(CUT, path="")

    def values(self, strings: Strings, real: np.dtype[Any], per_value: int) -> npt.NDArray[np.float64]:
        """Take the values of all strings out of the file at once."""
        lengths = np.array(strings.counts, dtype=np.int64) * (real.itemsize * per_value // RECORD_MARK)
        places = np.array(strings.places, dtype=np.int64)
        return self.stored[runs(places, lengths)].view(real).astype(np.float64)


def _native(content: bytes, order: str, kind: str, start: int) -> "array[int]":
    """Return integers whose single ones are fast to look at, which those of numpy are not."""
    words = array(kind)
    words.frombytes(content[start : start + (len(content) - start) // words.itemsize * words.itemsize])
    if (order == "<") != (sys.byteorder == "little"):
        words.byteswap()
    return words


def binary_strings(words: BinaryWords, place: int, matrix: MatrixHead, sizes: tuple[int, int]) -> Strings:
    """Follow the columns of a matrix from a quarter to its last record.

    Parameters
    ----------
    words : BinaryWords
    place : int
    matrix : MatrixHead
    sizes : (int, int)
        Bytes of a word, and of a real number.

    Raises
    ------
    FileFormatError
        A record or a string that contradicts itself or the file.
    """
    word, real = sizes
    step, views = word // RECORD_MARK, words.of_size(word)
    per_value = real * matrix.per_value // RECORD_MARK
    quarters, last, columns = words.quarters, len(words.quarters), matrix.shape[1]
    found = Strings()
    while place < last:
        begin, end = words.record(place)
        if end - begin < 3 * step:
            msg = f"a record of {RECORD_MARK * (end - begin)} bytes where a column should be. {DAMAGED}"
            raise FileFormatError(msg, path="")
        if step == 1:  # far more often, and there may be a million of them
            column, row, count = quarters[begin], quarters[begin + 1], quarters[begin + 2]
        else:
            column, row, count = (words.integer(begin, number, word) for number in range(3))
        if column > columns:
            found.stop = end + 1
            return found
        data = begin + 3 * step
        if count * step != end - data:
            size = f"{count} words, but its record has {RECORD_MARK * (end - begin)} bytes"
            msg = f"column {column} of {matrix.name} says {size}. {DAMAGED}"
            raise FileFormatError(msg, path="")
        _follow(found, views, (data, end, step), (column, row, per_value), matrix)
        place = end + 1
    raise FileFormatError(CUT, path="")


def _follow(
    found: Strings, views: Views, where: tuple[int, int, int], what: tuple[int, int, int], matrix: MatrixHead
) -> None:
    """Follow the strings of one column, whose words take `step` quarters each from one to another."""
    (even, odd), shift = views
    data, end, step = where
    column, row, per_value = what
    while data < end:
        length = (end - data) // step
        if row <= 0:
            packed = (odd if data & 1 else even)[data >> shift]
            data += step
            length, row_here = (packed >> OUTPUT4_BINARY_HALF) - 1, packed & HALF_MASK
            if matrix.big:
                length, row_here = packed - 1, (odd if data & 1 else even)[data >> shift] if data < end else 0
                data += step
        else:
            row_here = row
        values, rest = divmod(length * step, per_value)
        if length < 0 or data + length * step > end or rest:
            reason = "are no whole values" if rest else "do not fit into its record"
            msg = f"a string of {length + 1} words in column {column} of {matrix.name}, which {reason}. {DAMAGED}"
            raise FileFormatError(msg, path="")
        found.columns.append(column)
        found.rows.append(row_here)
        found.counts.append(values)
        found.places.append(data)
        data += length * step
