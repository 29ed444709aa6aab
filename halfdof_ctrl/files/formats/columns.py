"""Characters of many lines at once: fields of fixed width as tables of bytes, and whole numbers in them.

A loop over lines costs more than parsing their numbers does; here a text is one array of bytes, and a field of all its
lines one block of it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray

Characters = npt.NDArray[np.uint8]
Integers = npt.NDArray[np.int64]

IndexArray = npt.NDArray[Any]

COLUMNS_NEWLINE, RETURN, BLANK, ZERO = b"\n"[0], b"\r"[0], b" "[0], b"0"[0]
DECIMAL = 10
COLUMNS_MOST_DIGITS = 18  #: of a whole number that int64 surely holds


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CutLines:
    """The lines of a text, of which fields are cut out for many lines at once."""

    text: Characters
    starts: Integers  #: where each line begins in `text`
    lengths: Integers  #: its characters, without the line end

    def cut(self, start: int, width: int, which: IndexArray | None = None) -> Characters:
        """Cut out one field, filled with blanks where a line is shorter.

        Parameters
        ----------
        start, width : int
            Characters of a line.
        which : integer or boolean ndarray, optional
            The lines to take, all of them by default.

        Returns
        -------
        (lines, width) ndarray
        """
        starts, lengths = (self.starts, self.lengths) if which is None else (self.starts[which], self.lengths[which])
        reach = int(starts.max(initial=0)) + start + width
        text = self.text
        if reach > text.size:
            text = np.concatenate([text, np.full(reach - text.size, BLANK, dtype=np.uint8)])
        cut = np.lib.stride_tricks.sliding_window_view(text, width)[starts + start]
        short = np.flatnonzero(lengths < start + width)
        if short.size:  # what was cut out of the lines that follow
            beyond = np.arange(start, start + width) >= lengths[short, None]
            cut[short] = np.where(beyond, np.uint8(BLANK), cut[short])
        return cut

    def cut_from_the_right(self, width: int) -> Characters:
        """Cut out the last characters of each line, filled with blanks at their left where a line is shorter."""
        text = np.concatenate([np.full(width, BLANK, dtype=np.uint8), self.text])
        cut = np.lib.stride_tricks.sliding_window_view(text, width)[self.starts + self.lengths]
        short = np.flatnonzero(self.lengths < width)
        before = np.arange(width) < width - self.lengths[short, None]
        cut[short] = np.where(before, np.uint8(BLANK), cut[short])
        return np.asarray(cut)


def cut_lines(content: bytes) -> CutLines:
    r"""Find the lines of a text, which end with a line feed, with a carriage return before it or not.

    Examples
    --------
    >>> lines = cut_lines(b"ab\ncdef\r\n")
    >>> lines.cut(0, 3).tobytes(), lines.lengths.tolist()
    (b'ab cde', [2, 4])
    """
    text = np.frombuffer(content, dtype=np.uint8)
    ends = np.flatnonzero(text == COLUMNS_NEWLINE)
    if text.size and text[-1] != COLUMNS_NEWLINE:
        ends = np.append(ends, text.size)
    starts = np.concatenate([[0], ends[:-1] + 1]) if ends.size else ends
    lengths = ends - starts
    if RETURN in content:
        lengths = lengths - ((lengths > 0) & (text[np.maximum(ends - 1, 0)] == RETURN))
    return CutLines(text=text, starts=starts, lengths=lengths)


def runs(starts: Integers, lengths: Integers) -> Integers:
    """Join runs of consecutive numbers.

    >>> runs(np.array([5, 1]), np.array([2, 3])).tolist()
    [5, 6, 1, 2, 3]
    """
    before = np.cumsum(lengths) - lengths
    return np.asarray(np.arange(int(lengths.sum())) + np.repeat(starts - before, lengths))


def texts_of(field: Characters) -> npt.NDArray[np.bytes_]:
    """Return a field of all lines as one text a line."""
    lines, width = field.shape
    return np.ascontiguousarray(field).reshape(-1).view(f"S{width}") if width else np.full(lines, b"")


def whole_fields(field: Characters) -> Integers:
    """Parse a field as whole numbers, digits that end at its right; an empty one is zero.

    Parameters
    ----------
    field : (lines, width) ndarray of characters

    Raises
    ------
    ValueError
        A field is no whole number.

    Examples
    --------
    >>> whole_fields(np.frombuffer(b"  12   7    ", dtype=np.uint8).reshape(3, 4)).tolist()
    [12, 7, 0]
    """
    values = np.zeros(len(field), dtype=np.int64)
    begun = np.zeros(len(field), dtype=bool)
    any_begun = False
    for place, characters in enumerate(np.ascontiguousarray(field.T)):
        digits = characters - np.uint8(ZERO)  # wraps around below the zero
        is_digit = digits < DECIMAL
        if not any_begun and not is_digit.any() and (characters == BLANK).all():
            continue
        if place < field.shape[1] - COLUMNS_MOST_DIGITS or (begun > is_digit).any():
            return _any_whole(field)
        if not is_digit.all():
            if (is_digit == (characters == BLANK)).any():
                return _any_whole(field)
            digits[~is_digit] = 0
        begun, any_begun = is_digit, True
        values *= DECIMAL
        values += digits
    return values


def _any_whole(field: Characters) -> Integers:
    """Parse whole numbers with signs, or with blanks behind them."""
    filled = np.array(field)
    filled[(filled == BLANK).all(axis=1), -1] = ZERO
    if (filled == ord("_")).any():
        msg = "no whole number"
        raise ValueError(msg)
    return texts_of(filled).astype(np.int64)


def real_fields(field: Characters) -> FloatArray:
    """Parse a field as numbers; an empty one is zero.

    Parameters
    ----------
    field : (lines, width) ndarray of characters
        With an exponent E, not D.

    Raises
    ------
    ValueError
        A field is no finite number.

    Examples
    --------
    >>> real_fields(np.frombuffer(b" 1E3-2.5    ", dtype=np.uint8).reshape(3, 4)).tolist()
    [1000.0, -2.5, 0.0]
    """
    empty = field[:, -1] == BLANK
    if empty.any():
        empty = (field == BLANK).all(axis=1)
        field = np.array(field)
        field[empty, -1] = ZERO
    values = texts_of(field).astype(np.float64)
    if not np.isfinite(values).all() or (field == ord("_")).any():
        msg = "no finite number"
        raise ValueError(msg)
    return values
