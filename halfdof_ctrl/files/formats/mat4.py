"""Matrices and names from MATLAB version 4 files.

A file is a row of variables, each with five integers (type, rows, columns, whether complex, length of the name), the
name with a zero behind it, and the numbers by columns. The type is a decimal number MOPT: M 0 little-endian IEEE, 1
big-endian (2 to 4 are of VAX and Cray); O 0; P 0 double, 1 single, 2 int32, 3 int16, 4 uint16, 5 uint8; T 0 full, 1
text, 2 sparse, whose rows are (row, column, value) and whose last row is the size.

Source: MathWorks, MAT-File Format, chapter "Level 4 MAT-File Format".
"""

import re
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS
from halfdof_ctrl.files.formats.variables import Value, Variable, require_few

MAT4_HEADER = 20  #: bytes of the five integers
PRECISIONS = ("f8", "f4", "i4", "i2", "u2", "u1")
FULL, TEXT, MAT4_SPARSE = 0, 1, 2
BIG_ENDIAN = 1000
MOST_TYPE = 5000
LONGEST_NAME = 64
VARIABLE_NAME = re.compile(rb"[A-Za-z]\w*\Z")
TRIPLET_COLUMNS = 3


@dataclass(frozen=True, slots=True)
class _Header:
    name: str
    kind: int
    dtype: np.dtype[Any]
    shape: tuple[int, int]
    is_complex: bool
    start: int  #: of the numbers

    @property
    def stop(self) -> int:
        """Where the next variable begins."""
        return self.start + self.shape[0] * self.shape[1] * self.dtype.itemsize * (2 if self.is_complex else 1)


def is_mat4(content: bytes) -> bool:
    """Tell by the first header, whose name is one of MATLAB's."""
    return _header(content, 0) is not None


def mat4_variables(content: bytes) -> list[Variable]:
    """Describe the variables of a file.

    Raises
    ------
    FileFormatError
        A header that is none, numbers of a VAX or a Cray, or fewer bytes than the headers say.
    """
    found: list[Variable] = []
    place = 0
    while place < len(content):
        header = _header(content, place)
        if header is None or header.stop > len(content):
            known = ", ".join([variable.name for variable in found]) or "nothing"
            msg = f"at byte {place} there is no whole variable of MATLAB 4 ({known} before it). The file is damaged."
            raise FileFormatError(msg, path="")
        found.append(
            Variable(
                name=header.name,
                kind="text" if header.kind == TEXT else "matrix",
                shape=_shape(content, header),
                read=partial(_read, content, header),
            )
        )
        require_few(len(found))
        place = header.stop
    return found


def _header(content: bytes, place: int) -> _Header | None:
    for order in "<>":
        words = np.frombuffer(content[place : place + MAT4_HEADER].ljust(MAT4_HEADER, b"\xff"), order + "i4").tolist()
        kind, rows, columns, is_complex, length = words
        big, rest = divmod(kind, BIG_ENDIAN)
        precision, what = divmod(rest, 10)
        sound = (
            0 <= kind < MOST_TYPE
            and big == (order == ">")
            and precision < len(PRECISIONS)
            and what in {FULL, TEXT, MAT4_SPARSE}
            and rows >= 0
            and columns >= 0
            and is_complex in {0, 1}
            and 1 < length <= LONGEST_NAME
        )
        name, end = content[place + MAT4_HEADER : place + MAT4_HEADER + length - 1], place + MAT4_HEADER + length
        if sound and VARIABLE_NAME.match(name) and content[end - 1 : end] == b"\0":
            dtype = np.dtype(order + PRECISIONS[precision])
            return _Header(name.decode("latin-1"), what, dtype, (rows, columns), bool(is_complex), end)
    return None


def _shape(content: bytes, header: _Header) -> tuple[int, ...]:
    if header.kind != MAT4_SPARSE or header.shape[0] < 1 or header.shape[1] < TRIPLET_COLUMNS:
        return header.shape
    last = _table(content, header)[0][-1, :2]
    return tuple(np.nan_to_num(last).astype(np.int64).tolist()) if np.abs(last).max() <= MOST_ROWS else header.shape


def _table(content: bytes, header: _Header) -> tuple[npt.NDArray[Any], npt.NDArray[Any] | None]:
    count = header.shape[0] * header.shape[1]
    real = np.frombuffer(content, header.dtype, count, header.start).reshape(header.shape, order="F")
    if not header.is_complex:
        return real, None
    start = header.start + count * header.dtype.itemsize
    return real, np.frombuffer(content, header.dtype, count, start).reshape(header.shape, order="F")


def _read(content: bytes, header: _Header) -> Value:
    real, imaginary = _table(content, header)
    if header.kind == TEXT:
        rows = ["".join([chr(int(unit)) for unit in row]) for row in real.tolist()]
        return [row.encode("utf-16-le", "surrogatepass").decode("utf-16-le").rstrip(" ") for row in rows]
    if header.kind == MAT4_SPARSE:
        if imaginary is not None:  # which stand in a fourth column of the same table
            msg = f"the sparse matrix {header.name} says that it is followed by imaginary parts. The file is damaged."
            raise FileFormatError(msg, path="")
        return _sparse(header.name, real.astype(np.float64))
    return real if imaginary is None else real + 1j * imaginary


def _sparse(name: str, table: npt.NDArray[Any]) -> csc_array:
    """Read rows of (row, column, value) or (row, column, real, imaginary); the last one tells the size."""
    rows, columns = table.shape
    last = table[-1, :2] if rows and columns >= TRIPLET_COLUMNS else np.array([-1.0, -1.0])
    places = table[:-1, :2] - 1.0
    sound = (
        columns in {TRIPLET_COLUMNS, TRIPLET_COLUMNS + 1}
        and bool(np.isfinite(table).all())
        and bool((last >= 0).all() and (last <= MOST_ROWS).all())
        and bool((places >= 0).all() and (places < last).all() and (places == np.rint(places)).all())
    )
    if not sound:
        msg = f"the sparse matrix {name} has indices out of bounds. The file is damaged."
        raise FileFormatError(msg, path="")
    values = table[:-1, 2] + 1j * table[:-1, 3] if columns > TRIPLET_COLUMNS else table[:-1, 2]
    shape = (int(last[0]), int(last[1]))
    i, j = places.astype(np.int64).T
    matrix = csc_array(coo_array((values, (i, j)), shape=shape))
    if matrix.nnz < i.size:
        msg = f"the sparse matrix {name} has two entries at one place. The file is damaged."
        raise FileFormatError(msg, path="")
    return matrix
