r"""NumPy's files: an array (.npy), and archives of arrays (.npz), read without numpy.load and without unpickling.

A .npy file is the magic ``\x93NUMPY``, a version, the length of a header, a header that is a Python literal with the
keys ``descr``, ``fortran_order`` and ``shape``, and the numbers. The header is matched, not evaluated, and sizes are
checked against the bytes that there are before anything is allocated. `numpy.load` (2.4) evaluates the header, which
warns through the filters of the whole process, and allocates what a damaged header asks for.

Source: NumPy Enhancement Proposal 1, a simple file format for NumPy arrays; numpy.lib.format (version 1.0 to 3.0).
"""

import io
import itertools
import math
import re
import zipfile
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array, csr_array

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.mostly_zeros import PIECE, without_zeros
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS
from halfdof_ctrl.files.formats.variables import Kind, Value, Variable, most_unpacked, name_twice, out_of_room

Array: TypeAlias = npt.NDArray[Any]

MAGIC = b"\x93NUMPY"
ZIP_HEADER = b"PK\x03\x04"
LONGEST_HEADER = 10_000  #: characters, as numpy.load allows
LONGEST_SIZE = 18  #: digits
LENGTH_BYTES = {1: 2, 2: 4, 3: 4}  #: of the header's length, by version
NPY_HEADER = re.compile(
    r"\s*\{\s*'descr'\s*:\s*'(?P<type>[<>|=]?[a-zA-Z]\d*)'\s*,\s*'fortran_order'\s*:\s*(?P<order>True|False)\s*,"
    r"\s*'shape'\s*:\s*\((?P<shape>[\dL,\s]*)\)\s*,?\s*\}\s*"
)
RECORDS = re.compile(r"\s*\{\s*'descr'\s*:\s*\[")  #: a structured array
NUMBERS, TEXTS = "biufc", "US"
SPARSE_PARTS = ("data", "indices", "indptr", "shape")
COMPRESSED_ARRAYS = {"csc": csc_array, "csr": csr_array}
SAVED_SPARSE = {"format", "shape", "data"}  #: members that scipy.sparse.save_npz writes always
UNREADABLE = "objects, which would have to be unpickled (allow_pickle=False here), and that can run code"


@dataclass(frozen=True, slots=True)
class _Header:
    dtype: np.dtype[Any] | None  #: None for objects and records
    fortran_order: bool
    shape: tuple[int, ...]
    start: int  #: of the numbers

    @property
    def kind(self) -> Kind:
        if self.dtype is None:
            return "object"
        return "matrix" if self.dtype.kind in NUMBERS else "text" if self.dtype.kind in TEXTS else "object"


def is_npy(content: bytes) -> bool:
    """Tell by the magic."""
    return content.startswith(MAGIC)


def is_npz(content: bytes) -> bool:
    """Tell by the signature of a zip archive."""
    return content.startswith(ZIP_HEADER)


def read_npy(content: bytes, name: str = "it") -> Array:
    r"""Read an array of numbers or texts.

    Parameters
    ----------
    content : bytes
        The whole file.
    name : str
        What to call it in a refusal.

    Raises
    ------
    FileFormatError
        No .npy file, objects or records, more or fewer bytes than its header says.

    Examples
    --------
    >>> stream = io.BytesIO()
    >>> np.save(stream, np.array([[1.0, 2.0]]))
    >>> read_npy(stream.getvalue()).tolist()
    [[1.0, 2.0]]
    """
    header = _header(content, name)
    if header.kind == "object" or header.dtype is None:
        msg = (
            f"{name} holds {UNREADABLE}. Save numbers: K.toarray() of a sparse matrix (or "
            "halfdof_ctrl.save_model), names as numpy.array(names, dtype=str)."
        )
        raise FileFormatError(msg, path="")
    count = math.prod(header.shape)
    found = len(content) - header.start
    if count * header.dtype.itemsize != found:
        size = " x ".join(map(str, header.shape)) or "one number"
        msg = f"{name} says {size} of {header.dtype}, but has {found} bytes. The file is damaged or cut short."
        raise FileFormatError(msg, path="")
    array = np.frombuffer(content, header.dtype, count, header.start)
    return array.reshape(header.shape, order="F" if header.fortran_order else "C")


def npy_variable(content: bytes) -> Variable:
    """Describe the array of a .npy file, which has no name."""
    header = _header(content, "it")
    return Variable(name="", kind=header.kind, shape=header.shape, read=partial(read_npy, content))


def npz_variables(content: bytes) -> list[Variable]:
    """Describe the arrays of an archive; sparse matrices by the name of their parts.

    Raises
    ------
    FileFormatError
        No archive, or one without arrays.
    zipfile.BadZipFile, ValueError, ...
        The bytes are damaged.
    """
    if not is_npz(content):
        msg = "this is no archive of arrays. Write it by numpy.savez(path, M=M, C=C, K=K)."
        raise FileFormatError(msg, path="")
    with zipfile.ZipFile(io.BytesIO(content)) as members:
        infos = {info.filename.removesuffix(".npy"): info for info in members.infolist()}
        if len(infos) < len(members.infolist()):
            names = [info.filename.removesuffix(".npy") for info in members.infolist()]
            raise name_twice(next(name for name in names if names.count(name) > 1))
        if not any(info.filename.endswith(".npy") for info in infos.values()):
            what = "a spreadsheet: save it as csv" if "xl/workbook.xml" in infos else "an archive of other files"
            msg = f"there are no arrays in it, it is {what}."
            raise FileFormatError(msg, path="")
        found = {name: _member(content, members, info, name) for name, info in infos.items()}
    if set(found) >= SAVED_SPARSE:
        return [_saved_sparse(found)]
    stems = [name.removesuffix(".indptr") for name in found if name.endswith(".indptr")]
    sparse = [stem for stem in stems if {f"{stem}.{part}" for part in SPARSE_PARTS} <= set(found)]
    parts = {f"{stem}.{part}" for stem in sparse for part in SPARSE_PARTS}
    full = [variable for name, variable in found.items() if name not in parts]
    return full + [_sparse_variable(stem, found) for stem in sparse if stem not in found]


def _header(content: bytes, name: str) -> _Header:
    major, minor = content[len(MAGIC) : len(MAGIC) + 2].ljust(2, b"\0")
    version = major if content.startswith(MAGIC) and not minor else 0
    width = LENGTH_BYTES.get(version, 0)
    start = len(MAGIC) + 2 + width
    length = int.from_bytes(content[start - width : start], "little") if width else 0
    text = content[start : start + length].decode("latin-1")
    if not width or length > LONGEST_HEADER or len(text) < length:
        msg = f"{name} does not begin as an array of numpy.save. The file is damaged or of another kind."
        raise FileFormatError(msg, path="")
    match = NPY_HEADER.fullmatch(text)
    if match is None and not RECORDS.match(text):
        msg = f"{name} has a header that is none of numpy.save: {text[:60]!r}. The file is damaged."
        raise FileFormatError(msg, path="")
    if match is None:
        return _Header(None, fortran_order=False, shape=(), start=start + length)
    sizes = [size.strip("L") for size in match["shape"].replace(" ", "").split(",") if size]
    if any(len(size) > LONGEST_SIZE for size in sizes):
        msg = f"{name} has a header that is none of numpy.save: a size of {max(map(len, sizes))} digits. It is damaged."
        raise FileFormatError(msg, path="")
    shape = tuple([int(size) for size in sizes])
    dtype = None if "O" in match["type"] else np.dtype(match["type"])
    return _Header(dtype, match["order"] == "True", shape, start + length)


def _member(content: bytes, members: zipfile.ZipFile, info: zipfile.ZipInfo, name: str) -> Variable:
    """Describe one array by its header."""
    if info.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:  # others unpack without a limit
        msg = f"{name} is packed as numpy.savez_compressed packs nothing. Write it anew."
        raise FileFormatError(msg, path="")
    with members.open(info) as stream:
        header = _header(stream.read(len(MAGIC) + 6 + LONGEST_HEADER), name)
    return Variable(name=name, kind=header.kind, shape=header.shape, read=partial(_read_member, content, info, name))


def _read_member(content: bytes, info: zipfile.ZipInfo, name: str) -> Array | csc_array:
    if info.file_size > most_unpacked(len(content)):
        return _read_sparsely(content, info, name)
    with zipfile.ZipFile(io.BytesIO(content)) as members, members.open(info) as stream:
        return read_npy(stream.read(info.file_size), name)  # the count bounds a size that lies; the checksum is tested


def _read_sparsely(content: bytes, info: zipfile.ZipInfo, name: str) -> csc_array:
    """Read a matrix of zeros mostly, which packs into far fewer bytes, without ever having all of it."""
    with zipfile.ZipFile(io.BytesIO(content)) as members, members.open(info) as stream:
        start = stream.read(len(MAGIC) + 6 + LONGEST_HEADER)
        header = _header(start, name)
        if header.dtype is None:
            raise out_of_room(name, info.file_size, len(content))
        pieces = itertools.chain([start[header.start :]], iter(partial(stream.read, PIECE), b""))
        return without_zeros(pieces, header.dtype, header.shape, name, len(content), by_columns=header.fortran_order)


def _sparse_variable(stem: str, found: dict[str, Variable]) -> Variable:
    """Describe a matrix that is stored by its compressed columns."""

    def read() -> Value:
        return _compressed("csc", stem, *(found[f"{stem}.{part}"].read() for part in SPARSE_PARTS))

    return Variable(name=stem, kind="matrix", shape=_said_shape(found[f"{stem}.shape"]), read=read)


def _saved_sparse(found: dict[str, Variable]) -> Variable:
    """Describe the matrix of a file of scipy.sparse.save_npz, which has no name."""
    layout = np.asarray(found["format"].read()).item()
    kind = layout.decode("latin-1") if isinstance(layout, bytes) else str(layout)

    def read() -> Value:
        if kind in COMPRESSED_ARRAYS:
            return _compressed(kind, "", *(found[part].read() for part in SPARSE_PARTS))
        if kind != "coo":
            msg = f"a sparse matrix in the layout {kind!r}. Save K.tocsc()."
            raise FileFormatError(msg, path="")
        row, column, data = (np.asarray(found[part].read()) for part in ("row", "col", "data"))
        rows, columns = _sizes(found["shape"].read())
        places = np.concatenate([row, column]) if row.ndim == column.ndim == 1 else np.array([-1])
        if places.dtype.kind not in "iu" or not row.size == column.size == data.size or _outside(row, rows):
            raise _out_of_bounds("")
        if _outside(column, columns):
            raise _out_of_bounds("")
        return csc_array(coo_array((data, (row, column)), shape=(rows, columns)))

    return Variable(name="", kind="matrix", shape=_said_shape(found["shape"]), read=read)


def _said_shape(shape: Variable) -> tuple[int, ...]:
    sizes = np.asarray(shape.read()) if shape.kind == "matrix" and len(shape.shape) == 1 else np.zeros(0)
    return (
        tuple([int(size) for size in sizes])
        if sizes.size == len(COMPRESSED_ARRAYS) and sizes.dtype.kind in "iu"
        else (0, 0)
    )


def _sizes(shape: Any) -> tuple[int, int]:  # noqa: ANN401  # as it comes
    rows, columns = (int(size) for size in shape)
    return rows, columns


def _outside(places: Array, size: int) -> bool:
    return bool(places.size and (places.min() < 0 or places.max() >= size or size > MOST_ROWS))


def _compressed(kind: str, key: str, data: Any, indices: Any, indptr: Any, shape: Any) -> csc_array:  # noqa: ANN401
    """Make a matrix of parts that may be damaged."""
    rows, columns = _sizes(shape)
    lines, across = (columns, rows) if kind == "csc" else (rows, columns)
    sound = (
        data.ndim == indices.ndim == indptr.ndim == 1
        and indices.dtype.kind == indptr.dtype.kind == "i"
        and 0 < across <= MOST_ROWS
        and indptr.size == lines + 1
        and indptr[0] == 0
        and bool((np.diff(indptr) >= 0).all())
        and indptr[-1] == data.size == indices.size
        and bool(((indices >= 0) & (indices < across)).all())
    )
    if not sound:
        raise _out_of_bounds(key)
    parts = (np.array(data), np.array(indices), np.array(indptr))  # the bytes of a file cannot be written to
    matrix = csc_array(COMPRESSED_ARRAYS[kind](parts, shape=(rows, columns)))
    matrix.sum_duplicates()
    return matrix


def _out_of_bounds(key: str) -> FileFormatError:
    return FileFormatError(f"the sparse matrix {key or 'in it'} has indices out of bounds. Write it anew.", path="")
