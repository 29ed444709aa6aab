"""Matrices and names from MATLAB version 5 files, byte by byte and in bounds.

`scipy.io.loadmat` (1.17) follows the lengths that a file states and crashes the interpreter on damaged
ones; here every length is checked against the bytes that there are. Numbers (full or sparse, real or complex),
char arrays and cell arrays of chars are read, which is what a model file holds; matrices in structs and cell arrays
by a longer name, ``sys.K`` and ``K{2}``.

Layout (MathWorks, MAT-File Format): a header of 128 bytes, then elements of an 8-byte tag (type, length) and
data padded to 8 bytes; up to four bytes of data may stand in the tag itself.
"""

import zlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import DENSE_ROW_LIMIT
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.mostly_zeros import PIECE, without_zeros
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS
from halfdof_ctrl.files.formats.variables import (
    MOST_PARTS,
    Kind,
    Value,
    Variable,
    another_kind,
    most_unpacked,
    require_ascending,
    require_few,
    require_room,
)

MAT5_HEADER = 128  #: bytes; the last two tell the byte order
TAG = 8
NAME_PEEK = 2**12  #: bytes that hold the name of a variable
MATRIX, COMPRESSED = 14, 15
NUMBER_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXT_ENCODINGS = {16: "utf-8", 17: "utf-16", 18: "utf-32"}
CELL, STRUCT, CHAR, SPARSE, OPAQUE = 1, 2, 4, 5, 17
DEEPEST_NESTING = 4  #: structs in structs that are looked into
NUMERIC = range(6, 16)
COMPLEX_FLAG, LOGICAL_FLAG = 0x800, 0x200


def read_mat(content: bytes, wanted: Collection[str]) -> dict[str, Value]:
    """Read the wanted variables of a MATLAB version 5 file, see `mat5_variables`."""
    return {variable.name: variable.read() for variable in mat5_variables(content) if variable.name in wanted}


def mat5_variables(content: bytes) -> list[Variable]:
    """Describe the variables of a MATLAB version 5 file.

    Parameters
    ----------
    content : bytes
        The whole file.

    Returns
    -------
    list of Variable
        Read as ndarray, csc_array or list of str: char arrays give a text a row, cell arrays of chars a text a cell,
        without blanks at their ends.

    Raises
    ------
    FileFormatError
        HDF5 (version 7.3), not version 5, a variable of another kind or too large.
    ValueError, zlib.error
        The bytes are damaged or end too early.
    """
    if content.startswith(b"MATLAB 7.3") or content[MAT5_HEADER - 4 : MAT5_HEADER] in (b"\x00\x02IM", b"\x02\x00MI"):
        msg = "this is a MATLAB 7.3 (HDF5) file. Save it with  save(file, ..., '-v7')."
        raise FileFormatError(msg, path="")
    order = {b"IM": "<", b"MI": ">"}.get(content[MAT5_HEADER - 2 : MAT5_HEADER])
    if order is None:
        msg = "this is no MATLAB version 5 file (or only the beginning of one). Save it with  save(file, ..., '-v7')."
        raise FileFormatError(msg, path="")
    return [_described(*packed, order) for packed in _packed_variables(content, order)]


def _packed_variables(content: bytes, order: str) -> list[tuple[int, bytes]]:
    elements = _Bytes(content, order, MAT5_HEADER)
    found = []
    while elements:
        found.append(elements.element())
        require_few(len(found))
    return found


def _described(kind: int, data: bytes, order: str) -> Variable:
    """Describe one variable by its beginning; the rest is unpacked when it is read."""
    packed = kind == COMPRESSED
    head = _Head.of(_variable(*(_peeked(data, order) if packed else (kind, data)), order))

    if (
        packed
        and head.kind in NUMERIC
        and not head.is_complex
        and _unpacked_length(data, order) > most_unpacked(len(data))
    ):
        return Variable(
            name=head.name, kind="matrix", shape=head.shape, read=partial(_read_sparsely, head, data, order)
        )

    def body() -> tuple[_Head, _Bytes]:
        whole = _variable(*(_inflated(head.name, data, order) if packed else (kind, data)), order)
        return _Head.of(whole), whole

    return _as_variable(head.name, head, body, DEEPEST_NESTING)


def _as_variable(name: str, head: "_Head", body: Callable[[], "tuple[_Head, _Bytes]"], depth: int) -> Variable:
    def read() -> Value:
        its, rest = body()
        return _value(replace(its, name=name), rest)

    def parts() -> list[Variable]:
        its, rest = body()
        return list(_parts(name, its, rest, depth - 1)) if depth else []

    return Variable(name=name, kind=_kind(head), shape=head.shape, read=read, parts=parts)


def _kind(head: "_Head") -> Kind:
    if head.kind in NUMERIC or head.kind == SPARSE:
        return "matrix"
    kinds: dict[int, Kind] = {CHAR: "text", CELL: "cell", STRUCT: "struct"}
    return kinds.get(head.kind, "object")


def _parts(name: str, head: "_Head", body: "_Bytes", depth: int) -> list[Variable]:
    """Describe the fields of a struct or the cells of a cell array, under the names by which MATLAB calls them."""
    fields = _field_names(body) if head.kind == STRUCT else [""]
    total = min(_count(head.shape), MOST_PARTS)
    found = []
    for index in range(total):
        for field in fields:
            own = f"({index + 1})" if head.kind == STRUCT and total > 1 else f"{{{index + 1}}}"
            called = f"{name}{'' if head.kind == STRUCT and total == 1 else own}{f'.{field}' if field else ''}"
            kind, data = body.element()
            if kind == MATRIX and data:
                again = partial(_again, data, body.order)
                found.append(_as_variable(called, again()[0], again, depth))
    return found


def _again(data: bytes, order: str) -> "tuple[_Head, _Bytes]":
    body = _Bytes(data, order)
    return _Head.of(body), body


def _field_names(body: "_Bytes") -> list[str]:
    width = int(body.numbers()[0])
    _, names = body.element()
    if width < 1 or len(names) > MOST_PARTS * width:
        msg = "a struct without sound names of its fields"
        raise ValueError(msg)
    cut = [names[start : start + width].split(b"\0")[0] for start in range(0, len(names), width)]
    return [name.decode("latin-1") for name in cut]


class _Bytes:
    """Elements one after the other; none reaches past the end."""

    def __init__(self, data: bytes, order: str, position: int = 0) -> None:
        self.data, self.order, self.position = data, order, position

    def __bool__(self) -> bool:
        return self.position < len(self.data)

    def take(self, count: int) -> bytes:
        part = self.data[self.position : self.position + count]
        if len(part) < count:
            msg = "it ends too early"
            raise ValueError(msg)
        self.position += count
        return part

    def element(self) -> tuple[int, bytes]:
        """Return type and data of the next element."""
        tag = self.take(TAG)
        kind, length = np.frombuffer(tag, self.order + "u4").tolist()
        if kind >> 16:
            return kind & 0xFFFF, _Bytes(tag[4:], self.order).take(kind >> 16)
        data = self.take(length)
        if kind != COMPRESSED:
            self.position += -length % TAG
        return kind, data

    def numbers(self) -> npt.NDArray[Any]:
        """Return the next element as numbers."""
        return self.as_numbers(*self.element())

    def as_numbers(self, kind: int, data: bytes) -> npt.NDArray[Any]:
        if kind not in NUMBER_TYPES:
            msg = f"an element of type {kind} where numbers should be"
            raise ValueError(msg)
        return np.frombuffer(data, self.order + NUMBER_TYPES[kind])


@dataclass(frozen=True, slots=True)
class _Head:
    """What stands before the data of a variable."""

    kind: int  #: class of the array
    is_complex: bool
    is_logical: bool
    shape: tuple[int, ...]
    name: str

    @classmethod
    def of(cls, body: _Bytes) -> "_Head":
        flags = int(body.numbers()[0])
        kind = flags & 0xFF
        shape = () if kind == OPAQUE else tuple(body.numbers().tolist())
        _, name = body.element()
        if any(length < 0 for length in shape):
            msg = "a negative size"
            raise ValueError(msg)
        return cls(kind, bool(flags & COMPLEX_FLAG), bool(flags & LOGICAL_FLAG), shape, name.decode("latin-1"))


def _variable(kind: int, data: bytes, order: str) -> _Bytes:
    if kind != MATRIX:
        msg = f"an element of type {kind} where a variable should be"
        raise ValueError(msg)
    return _Bytes(data, order)


def _peeked(data: bytes, order: str) -> tuple[int, bytes]:
    """Unpack the beginning of a variable."""
    start = zlib.decompressobj().decompress(data, NAME_PEEK)
    kind, _ = np.frombuffer(_Bytes(start, order).take(TAG), order + "u4").tolist()
    return kind, start[TAG:]


def _inflated(name: str, data: bytes, order: str) -> tuple[int, bytes]:
    """Unpack one variable to its stated length, with its checksum."""
    stream = zlib.decompressobj()
    kind, length = np.frombuffer(stream.decompress(data, TAG), order + "u4").tolist()
    require_room(name, length, len(data))
    body = stream.decompress(stream.unconsumed_tail, length + 1)
    if len(body) != length or not stream.eof:
        msg = "a packed variable is not as long as it says"
        raise ValueError(msg)
    return kind, body


def _unpacked_length(data: bytes, order: str) -> int:
    start = zlib.decompressobj().decompress(data, TAG)
    return int(np.frombuffer(_Bytes(start, order).take(TAG), f"{order}u4")[1])


def _read_sparsely(head: _Head, data: bytes, order: str) -> csc_array:
    """Read a full matrix of zeros mostly, which packs into far fewer bytes, without ever having all of it."""
    stream = zlib.decompressobj()
    body = _Bytes(stream.decompress(data, NAME_PEEK), order, TAG)
    _Head.of(body)
    kind, length = np.frombuffer(body.take(TAG), f"{order}u4").tolist()
    if kind not in NUMBER_TYPES:
        msg = f"an element of type {kind} where numbers should be"
        raise ValueError(msg)
    dtype = np.dtype(order + NUMBER_TYPES[kind])

    def pieces() -> Iterator[bytes]:
        left = length
        piece = body.data[body.position : body.position + left]
        while piece:
            left -= len(piece)
            yield piece
            piece = stream.decompress(stream.unconsumed_tail, min(PIECE, left)) if left else b""

    matrix = without_zeros(pieces(), dtype, head.shape, head.name, len(data), by_columns=True)
    stream.decompress(stream.unconsumed_tail, TAG)  # what fills up the last number, and the checksum
    if not stream.eof:
        msg = "a packed variable is not as long as it says"
        raise ValueError(msg)
    return matrix


def _value(head: _Head, body: _Bytes) -> Value:
    if head.kind in NUMERIC:
        return _full(head, body)
    if head.kind == SPARSE:
        return _sparse(head, body)
    if head.kind == CHAR:
        return _rows(head, body)
    if head.kind == CELL:
        return [_cell(head.name, body) for _ in range(_count(head.shape))]
    raise another_kind(head.name)


def _count(shape: tuple[int, ...]) -> int:
    count = 1
    for length in shape:
        count *= length
    return count


def _full(head: _Head, body: _Bytes) -> npt.NDArray[Any]:
    _require_readable(head, _count(head.shape))
    real = body.numbers()
    imaginary = body.numbers() if head.is_complex else None
    return _joined(real, imaginary).reshape(head.shape, order="F")


def _joined(real: npt.NDArray[Any], imaginary: npt.NDArray[Any] | None) -> npt.NDArray[Any]:
    """Join real and imaginary parts without arithmetic, which would lose the signs of zeros."""
    if imaginary is None:
        return real
    values = np.empty(real.shape, dtype=np.complex128)
    values.real, values.imag = real, imaginary
    return values


def _sparse(head: _Head, body: _Bytes) -> csc_array:
    """Take over compressed columns, whose indices are checked."""
    rows, columns = head.shape
    row, start = body.numbers(), body.numbers().astype(np.int64)
    real = np.frombuffer(body.element()[1], "u1") if head.is_logical else body.numbers()  # logical: a false type
    stored = int(start[-1]) if start.size else -1
    values = _joined(real, body.numbers() if head.is_complex else None)[:stored]
    row = row[:stored].astype(np.int64)
    lengths = np.diff(start)
    sound = start.size == columns + 1 and start[0] == 0 and (lengths >= 0).all() and rows <= MOST_ROWS
    if not (sound and row.size == values.size == stored and ((row >= 0) & (row < rows)).all()):
        msg = f"the sparse matrix {head.name} has indices out of bounds"
        raise ValueError(msg)
    require_ascending(head.name, row, start)
    return csc_array((values.astype(np.result_type(values.dtype, np.float64)), row, start), shape=(rows, columns))


def _require_readable(head: _Head, entries: int) -> None:
    if entries > DENSE_ROW_LIMIT**2:
        msg = (
            f"{head.name} is larger than {DENSE_ROW_LIMIT} x {DENSE_ROW_LIMIT}, and matrices are held dense here. "
            "Reduce the model first."
        )
        raise FileFormatError(msg, path="")


def _cell(name: str, body: _Bytes) -> str:
    kind, data = body.element()
    if kind == MATRIX and not data:
        return ""
    inner = _Bytes(data, body.order)
    head = _Head.of(inner)
    if kind != MATRIX or head.kind != CHAR or head.shape[0] > 1:
        what = "matrices" if kind == MATRIX and (head.kind in NUMERIC or head.kind == SPARSE) else "other things"
        msg = (
            f"{name} must be a cell array of names, one char row each (in MATLAB a cellstr), or a matrix, but it is a "
            f"cell array of {what}. A matrix in it is called '{name}{{1}}'."
        )
        raise FileFormatError(msg, path="")
    return next(iter(_rows(head, inner)), "")


def _rows(head: _Head, body: _Bytes) -> list[str]:
    """Read a char array, which is stored by columns, as one text a row."""
    kind, data = body.element()
    if kind in TEXT_ENCODINGS:
        ending = {"<": "-le", ">": "-be"}[body.order] if kind in (17, 18) else ""
        text = data.decode(TEXT_ENCODINGS[kind] + ending)
    else:
        units = body.as_numbers(kind, data)
        if units.dtype.kind == "f":
            msg = f"text of fractions in {head.name}"
            raise ValueError(msg)
        text = units.astype("<u2").tobytes().decode("utf-16-le")
    letters = np.array(list(text), dtype=np.str_) if len(text) == _count(head.shape) else _units(text)
    return [
        "".join(row).encode("utf-16-le", "surrogatepass").decode("utf-16-le").rstrip(" ")
        for row in letters.reshape(head.shape, order="F").tolist()
    ]


def _units(text: str) -> npt.NDArray[np.str_]:
    """Split a text into the 16-bit units that MATLAB counts."""
    units = np.frombuffer(text.encode("utf-16-le"), "<u2").tolist()
    return np.array([chr(unit) for unit in units], dtype=np.str_)
