"""Matrix Market files: ``%%MatrixMarket matrix coordinate real symmetric`` and its kin.

After the banner come comments (``%``), a line of sizes, and the entries: ``row column value`` from one on
(coordinate) or all values down the columns (array). Of a symmetric or skew-symmetric matrix one triangle is stored.
Layout: Boisvert, Pozo and Remington, The Matrix Market Exchange Formats, NIST IR 5935, 1996.

`scipy.io.mmread` (1.17) takes ``1.0D+05`` for 1.0 and passes over what follows a number, so it is not used here.
"""

from collections.abc import Sequence
from typing import cast

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS, Declared, RawMatrix, assembled
from halfdof_ctrl.files.formats.text_blocks import BOM, number_rows, whole_numbers

BANNER = b"%%matrixmarket"
BANNER_PEEK = 256  #: bytes in which the banner begins
LAYOUTS = ("coordinate", "array")
FIELDS = {"real": 1, "double": 1, "integer": 1, "unsigned-integer": 1, "complex": 2}  #: numbers of a value
WHOLE_FIELDS = ("integer", "unsigned-integer")
SYMMETRIES = ("general", "symmetric", "skew-symmetric")
SIZES_OF_LAYOUT = {"coordinate": 3, "array": 2}


def is_matrix_market(content: bytes) -> bool:
    """Tell by the banner."""
    return _begun(content[:BANNER_PEEK])[: len(BANNER)].lower() == BANNER


def _begun(content: bytes) -> bytes:
    """Take away the byte order mark of Windows and blanks before the banner, which some programs write."""
    return content.removeprefix(BOM).lstrip(b" \t\r\n")


def read_matrix_market(content: bytes, most_rows: int = MOST_ROWS) -> RawMatrix:
    r"""Read a matrix.

    Parameters
    ----------
    content : bytes
        The whole file.
    most_rows : int
        A larger size is taken for damage.

    Raises
    ------
    FileFormatError
        An unknown kind (pattern, hermitian), sizes that the file does not bear out, entries that are no numbers (or not
        of the kind), are too many or too few or lie outside the matrix.

    Examples
    --------
    >>> text = b"%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 2\n2 1 -1\n2 2 3\n"
    >>> read_matrix_market(text).matrix.toarray().tolist()
    [[2.0, -1.0], [-1.0, 3.0]]
    """
    content = _begun(content)
    layout, field, symmetry = _kind(content)
    sizes, start, line = _sizes(content, SIZES_OF_LAYOUT[layout], most_rows)
    rows, columns = sizes[0], sizes[1]
    if layout == "coordinate":
        i, j, values = _coordinate(content[start:], FIELDS[field], sizes[2], line)
    else:
        i, j, values = _array(content[start:], FIELDS[field], (rows, columns), symmetry, line)
    if field in WHOLE_FIELDS and (whole_numbers(values, f"{field} entries") < 0).any() and field.startswith("unsigned"):
        msg = "a negative entry, though the banner says unsigned. Its header is wrong, or the file is damaged."
        raise FileFormatError(msg, path="")
    return assembled(
        i,
        j,
        values,
        (rows, columns),
        declared=cast("Declared", symmetry),
        format=f"Matrix Market {layout} {field} {symmetry}",
        known_to=known_to(content[start:]),
    )


def _kind(content: bytes) -> tuple[str, str, str]:
    words = content.split(b"\n", 1)[0].decode("latin-1").lower().split()
    known = (("matrix",), LAYOUTS, tuple(FIELDS), SYMMETRIES)
    if len(words) != 1 + len(known) or not all(word in list(of) for word, of in zip(words[1:], known, strict=True)):
        msg = (
            f"the banner is {' '.join(words)!r}; real, integer and complex matrices are read (coordinate or array; "
            "general, symmetric or skew-symmetric)."
        )
        raise FileFormatError(msg, path="", line=1)
    return words[2], words[3], words[4]


def _sizes(content: bytes, count: int, most_rows: int) -> tuple[list[int], int, int]:
    """Return the sizes, where the entries start, and the line there."""
    start, line = content.find(b"\n") + 1, 2
    while start:
        stop = content.find(b"\n", start)
        text = content[start : stop if stop >= 0 else len(content)].strip()
        if text and not text.startswith(b"%"):
            return (
                _checked_sizes(text.split(), count, (most_rows, len(content)), line),
                stop + 1 or len(content),
                line + 1,
            )
        start, line = stop + 1, line + 1
    msg = "it ends before the line of sizes. Write it anew."
    raise FileFormatError(msg, path="")


def _checked_sizes(fields: Sequence[bytes], count: int, room: tuple[int, int], line: int) -> list[int]:
    if len(fields) != count or not all(field.isdigit() for field in fields):
        shown = b" ".join(fields)[:60].decode("latin-1")
        msg = f"{count} sizes belong here, not {shown!r}. The file is damaged."
        raise FileFormatError(msg, path="", line=line)
    sizes = [int(field) for field in fields]
    if not (sizes[0] and sizes[1]) or max(sizes[:2]) > max(room):
        msg = (
            f"a matrix of {sizes[0]} x {sizes[1]} in a file of {room[1]} bytes. It is damaged, or one of a model: give "
            "all files."
        )
        raise FileFormatError(msg, path="", line=line)
    return sizes


def _coordinate(content: bytes, numbers: int, count: int, line: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    table = number_rows(content, 2 + numbers, comment="%", first_line=line)
    _require_count(len(table), count)
    places = whole_numbers(table[:, :2], "row and column numbers") - 1
    return places[:, 0], places[:, 1], _joined(table[:, 2:])


def _array(
    content: bytes, numbers: int, shape: tuple[int, int], symmetry: str, line: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the entries of an array, whose triangle is stored if it is symmetric."""
    rows, columns = shape
    if symmetry != "general" and rows != columns:
        msg = f"a matrix of {rows} x {columns} cannot be {symmetry}. The header is wrong."
        raise FileFormatError(msg, path="")
    first = {"general": 0, "symmetric": 0, "skew-symmetric": 1}[symmetry]
    stored = rows * columns if symmetry == "general" else rows * (rows + 1) // 2 - first * rows
    table = number_rows(content, numbers, comment="%", first_line=line)
    _require_count(len(table), stored)
    if symmetry == "general":
        j, i = np.divmod(np.arange(stored), rows)
    else:
        j, i = np.triu_indices(rows, first, columns)
    return i, j, _joined(table)


def _require_count(found: int, said: int) -> None:
    if found != said:
        msg = f"the header says {said} entries, but there are {found}. The file is damaged or cut short."
        raise FileFormatError(msg, path="")


def _joined(table: FloatArray) -> np.ndarray:
    return table[:, 0] if table.shape[1] == 1 else table[:, 0] + 1j * table[:, 1]
