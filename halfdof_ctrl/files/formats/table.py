"""Tables of numbers in text that says nothing of itself: dense matrices, or entries by row and column.

Dense rows come from ``numpy.savetxt``, OpenSees' ``printA``, MATLAB's ``writematrix`` and spreadsheets: between
blanks, tabs, commas or semicolons; with a decimal comma where tabs or semicolons separate; with names of rows and
columns. Three or five numbers a line may be ``row column value`` or Abaqus' ``node, DOF, node, DOF, value`` as well.
What could be two things is refused with both.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats import abaqus
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, storage
from halfdof_ctrl.files.formats.text_blocks import BOM, number_rows

COMMENTS = (b"#", b"%", b"//", b"!")
UTF16 = (b"\xff\xfe", b"\xfe\xff")
LIKE_NUMBER = re.compile(rb"[-+]?(\d+(\.\d*)?|\.\d+)([EeDdQq][-+]?\d+|[-+]\d{2,3})?")
TITLE_BEGIN = re.compile(rb"[A-Za-z_\"'\x80-\xff]")  #: begins the title of a column
NO_NAMES = (b"nan", b"inf", b"infinity", b"i", b"j")
REMARK = re.compile(rb"(#|%|//|!)[^\n]*")
DIGITS_ALONE = re.compile(rb"\d+")
DECIMAL_COMMA = re.compile(rb"(?<=\d),(?=\d)")
TABLE_HEAD = 2**16  #: bytes in which the first line of data must stand
HEAD_LINES = 3  #: that are looked at however long they are: titles and two rows
TABLE_SYMMETRY = 1e-9  #: of the largest entry
TRIPLET, LABELLED_TABLE = 3, 5  #: numbers of a line that may be places and a value
SIZES_LINE = 3  #: numbers of a line of sizes
LONG = 64  #: lines above which a table of so few columns is no square matrix


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the lines of a table are cut."""

    separator: bytes | None  #: None: blanks
    decimal_comma: bool
    titles: tuple[str, ...]  #: of the columns, if the first line has them
    labelled: bool  #: whether each row begins with a name
    skipped: int  #: lines before the first row
    columns: int  #: fields of the second line


def is_table(content: bytes) -> bool:
    """Return whether the first line that is no comment, or the one after a line of titles, is made of numbers."""
    if b"\0" in content[:TABLE_HEAD]:
        return False
    lines = [fields for _, fields in _first_lines(content.removeprefix(BOM))][:2]
    return any(
        bool(fields) and sum(LIKE_NUMBER.fullmatch(field) is not None for field in fields) >= max(1, len(fields) - 1)
        for fields in (_cut(line, *_separators(line)) for line in lines)
    )


def read_table(content: bytes, *, dense: bool, most_rows: int) -> RawMatrix:
    r"""Read a matrix.

    Parameters
    ----------
    content : bytes
        The whole file.
    dense : bool
        Whether it is known that all numbers stand there, as those of B and F.
    most_rows : int
        A larger row number is taken for damage.

    Raises
    ------
    FileFormatError
        Rows of different lengths, text among numbers, or a table that could be two things.

    Examples
    --------
    >>> read_table(b"4, -1\n-1, 3\n", dense=False, most_rows=9).matrix.toarray().tolist()
    [[4.0, -1.0], [-1.0, 3.0]]
    >>> read_table(b"0 0 4.\n1 1 3.\n2 2 3.\n3 3 1.\n", dense=False, most_rows=9).notes
    ('rows have no labels in this format', 'rows and columns are counted from 0')
    """
    content = content.removeprefix(BOM)
    layout = _layout(content)
    plain = _plain(content, layout)
    bare = not (dense or layout.labelled or layout.titles)
    if bare and plain.count(b"\n", 0, TABLE_HEAD) > LONG and layout.columns in {TRIPLET, LABELLED_TABLE}:
        return _long_by_place(plain, layout.columns, most_rows)
    table, names = _numbers(plain, layout)
    if bare and table.shape[1] in {TRIPLET, LABELLED_TABLE}:
        by_place = _by_place(plain, table, most_rows)
        if by_place is not None:
            return by_place
    return _dense(table, names, layout, known_to(plain))


def _first_lines(content: bytes) -> list[tuple[int, bytes]]:
    """Return the first lines that are neither empty nor comments, with their numbers; at least two whole ones."""
    stop = TABLE_HEAD
    while len(content) > stop and content.count(b"\n", 0, stop) < HEAD_LINES:
        stop = (content.find(b"\n", stop) + 1) or len(content)
    lines = enumerate(content[:stop].split(b"\n"))
    return [
        (number, line.rstrip(b"\r"))
        for number, line in lines
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]


def _separators(line: bytes) -> tuple[bytes | None, bool]:
    """Tell what separates the fields, and whether commas are decimal points."""
    for separator in (b";", b"\t"):
        if separator in line.strip():
            return separator, DECIMAL_COMMA.search(line) is not None
    return (b",", False) if b"," in line else (None, False)


def _cut(line: bytes, separator: bytes | None, decimal_comma: bool) -> list[bytes]:  # noqa: FBT001  # as found
    text = DECIMAL_COMMA.sub(b".", line) if decimal_comma else line
    fields = text.split() if separator is None else [field.strip().strip(b'"') for field in text.split(separator)]
    while fields and not fields[-1]:  # a separator at the end of the line
        fields.pop()
    return fields


def _layout(content: bytes) -> _Layout:
    lines = _first_lines(content)
    if not lines:
        msg = "no line of numbers in it. The file is empty, or of another kind."
        raise FileFormatError(msg, path="")
    rows = [line for _, line in lines]
    separator, decimal_comma = _separators(rows[min(1, len(rows) - 1)])
    decimal_comma = separator in {b";", b"\t"} and DECIMAL_COMMA.search(content) is not None
    first = _cut(rows[0], separator, decimal_comma)
    second = _cut(rows[1], separator, decimal_comma) if len(rows) > 1 else first
    others = [field for field in first if LIKE_NUMBER.fullmatch(field) is None]
    counted = others == [b""] and not first[0] and all(DIGITS_ALONE.fullmatch(field) for field in first[1:])
    words = any(others) and all(TITLE_BEGIN.match(field) and field.lower() not in NO_NAMES for field in others if field)
    has_titles = counted or (words and all(DIGITS_ALONE.fullmatch(field) for field in first if field not in others))
    names_rows = second[:1] != [b""] and LIKE_NUMBER.fullmatch(second[0]) is None if second else False
    labelled = names_rows or (has_titles and not first[0])
    titles = tuple([field.decode("utf-8", "replace") for field in first]) if has_titles else ()
    return _Layout(
        separator, decimal_comma, titles, labelled, lines[has_titles][0] if len(lines) > has_titles else 0, len(second)
    )


def _plain(content: bytes, layout: _Layout) -> bytes:
    """Return the rows with decimal points, without the lines before them."""
    text = content.split(b"\n", layout.skipped)[-1] if layout.skipped else content
    return DECIMAL_COMMA.sub(b".", text) if layout.decimal_comma else text


def _numbers(plain: bytes, layout: _Layout) -> tuple[FloatArray, tuple[str, ...] | None]:
    """Parse the rows, and their names if they have some."""
    names: list[str] = []
    first = layout.skipped + 1
    text = _without_remarks(plain)
    if layout.labelled:
        rows = []
        for line in text.split(b"\n"):
            fields = _cut(line.rstrip(b"\r"), layout.separator, decimal_comma=False)
            if fields:
                names.append(fields[0].decode("utf-8", "replace"))
                rows.append(b" ".join(fields[1:]))
        text = b"\n".join(rows)
    head = next(iter(_first_lines(text)), (0, b""))[1]
    columns = len(_cut(head, None if layout.labelled else layout.separator, decimal_comma=False))
    if layout.separator is not None and re.search(rb"(^|[,;\t])[ ]*[,;\t]", text, re.MULTILINE):
        msg = "an empty cell among the numbers. Write a number into each, zeros too."
        raise FileFormatError(msg, path="")
    return number_rows(text.replace(b'"', b" "), columns, comment="#", first_line=first), tuple(names) or None


def _by_place(plain: bytes, table: FloatArray, most_rows: int) -> RawMatrix | None:
    """Read the rows as places and values, if they can be that; None if they are a dense matrix."""
    rows, columns = table.shape
    plain = _without_remarks(plain)
    places = table[:, :-1]
    if (places != np.rint(places)).any() or (columns == TRIPLET and (places < 0).any()):
        return None if rows == columns or columns != LABELLED_TABLE else _refuse_places(table)
    if _is_size_line(table):
        raise _size_line_error(table[0], rows - 1)
    if rows != columns:
        return abaqus.read_abaqus(plain, most_rows)
    twice = len(np.unique(places, axis=0)) < rows
    sparse = None if twice or places.max() > most_rows else _readable_by_place(plain, most_rows)
    is_symmetric = _asymmetry(table) <= TABLE_SYMMETRY * float(np.abs(table).max(initial=0.0))
    if sparse is None or (is_symmetric and np.count_nonzero(sparse.matrix.diagonal()) < sparse.matrix.shape[0]):
        return None
    covers = np.count_nonzero(sparse.matrix.diagonal()) == sparse.matrix.shape[0]
    if _written_as_places(plain, columns) or (covers and not is_symmetric):
        return sparse
    words = "row column value" if columns == TRIPLET else "node, DOF, node, DOF, value"
    size = sparse.matrix.shape[0]
    msg = (
        f"{rows} lines of {columns} whole numbers could be a dense matrix of {rows} x {columns}, or lines of "
        f"'{words}' for a matrix of {size} x {size}. Say which: write the dense one by numpy.save, or the other with "
        "the banner '%%MatrixMarket matrix coordinate real general'."
    )
    raise FileFormatError(msg, path="")


def _readable_by_place(plain: bytes, most_rows: int) -> RawMatrix | None:
    try:
        return abaqus.read_abaqus(plain, most_rows)
    except FileFormatError:  # labels or places that are none, so it is something else
        return None


def _long_by_place(plain: bytes, columns: int, most_rows: int) -> RawMatrix:
    """Read rows that are too many for a square matrix, without parsing them twice."""
    plain = _without_remarks(plain)
    head = number_rows(b"\n".join([line for _, line in _first_lines(plain)[:LONG]]), columns, comment="#")
    if (head[:, :-1] != np.rint(head[:, :-1])).any():
        return _refuse_places(head)
    first = head[0]
    if columns == SIZES_LINE and first[0] == first[1] and first[2] == _count_rows(plain) - 1:
        raise _size_line_error(first, int(first[2]))
    return abaqus.read_abaqus(plain, most_rows)


def _without_remarks(text: bytes) -> bytes:
    return REMARK.sub(b"", text) if any(mark in text for mark in COMMENTS) else text


def _count_rows(plain: bytes) -> int:
    return len([line for line in plain.split(b"\n") if line.strip()])


def _refuse_places(table: FloatArray) -> RawMatrix:
    words = "row column value" if table.shape[1] == TRIPLET else "node, DOF, node, DOF, value"
    msg = (
        f"lines of {table.shape[1]} numbers that are no square matrix, and no '{words}' either, since places must be "
        "whole numbers."
    )
    raise FileFormatError(msg, path="")


def _is_size_line(table: FloatArray) -> bool:
    rows, columns = table.shape
    if columns != SIZES_LINE or rows < SIZES_LINE - 1 or table[0, 0] != table[0, 1] or table[0, 2] != rows - 1:
        return False
    return bool(table[1:, :2].max() <= table[0, 0])


def _size_line_error(first: FloatArray, entries: int) -> FileFormatError:
    shown = " ".join([f"{size:g}" for size in first])
    msg = (
        f"the first line, {shown}, could be the sizes of a matrix with {entries} entries, or the entry of row "
        f"{first[0]:g} and column {first[1]:g}. Take it away, or write the banner '%%MatrixMarket matrix coordinate "
        "real general' before it."
    )
    return FileFormatError(msg, path="", line=1)


def _asymmetry(table: FloatArray) -> float:
    return float(np.abs(table - table.T).max(initial=0.0))


def _written_as_places(plain: bytes, columns: int) -> bool:
    """Return whether all but the last number of each line are written without a point, and the last one with it."""
    lines = [_cut(line, *_separators(line)) for _, line in _first_lines(plain)]
    return all(
        len(fields) == columns
        and all(DIGITS_ALONE.fullmatch(field) for field in fields[:-1])
        and not DIGITS_ALONE.fullmatch(fields[-1])
        and b"." in fields[-1]
        for fields in lines
    )


def _dense(table: FloatArray, names: tuple[str, ...] | None, layout: _Layout, rounding: float) -> RawMatrix:
    notes = ("commas are read as decimal points",) if layout.decimal_comma else ()
    rows, columns = table.shape
    if not table.size:
        msg = "no rows of numbers in it. The file is empty, or cut short."
        raise FileFormatError(msg, path="")
    if not layout.titles and rows == columns + 1 and rows > SIZES_LINE and _counts(table[0]):
        table, rows = table[1:], columns
        notes = (*notes, "its first line counts the columns and is left out")
    if layout.titles and not layout.labelled:
        notes = (*notes, "its first line is no row of numbers and is left out")
    matrix = csc_array(table)
    raw = RawMatrix(
        matrix=matrix,
        format="dense text",
        declared="unsaid",
        stored=storage(matrix),
        completed=False,
        dofs=_names(names, layout.titles, rows),
        notes=notes,
        known_to=rounding,
    )
    return raw if rows == columns else replace(raw, dofs=None)


def _counts(row: FloatArray) -> bool:
    """Return whether a row is 0, 1, 2, ... or 1, 2, 3, ..."""
    return bool((np.diff(row) == 1.0).all()) and row[0] in {0.0, 1.0}


def _names(rows: Sequence[str] | None, titles: tuple[str, ...], count: int) -> tuple[str, ...] | None:
    """Return the names of rows, which must be those of the columns where these have some too."""
    if rows is None or len(rows) != count or all(name.isdigit() for name in rows):
        return None
    columns = titles[len(titles) - count :]
    if titles and columns != tuple(rows):
        msg = (
            f"its rows are named {', '.join(rows[:3])}, ... and its columns {', '.join(columns[:3])}, .... Put both "
            "into one order."
        )
        raise FileFormatError(msg, path="")
    return tuple(rows)
