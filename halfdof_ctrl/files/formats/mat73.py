"""Matrices and names from MATLAB version 7.3 files, which are HDF5 files, through h5py (extra ``hdf5``).

A full matrix is a dataset with its axes reversed. A sparse one is a group with the attribute MATLAB_sparse (rows) and
the datasets ``data``, ``ir`` (row numbers) and ``jc`` (starts of the columns). Text is a dataset of 16-bit units, a
cell array a dataset of references. Links that lead out of the file are not followed, and sizes are checked before
anything is read.
"""

import importlib
import io
import math
from collections.abc import Collection
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import DENSE_ROW_LIMIT
from halfdof_ctrl.base.errors import FileFormatError, MissingExtraError
from halfdof_ctrl.files.formats.mostly_zeros import PIECE, without_zeros
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS
from halfdof_ctrl.files.formats.variables import (
    MOST_PARTS,
    Kind,
    Value,
    Variable,
    another_kind,
    most_unpacked,
    out_of_room,
    require_ascending,
)

SIGNATURE = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512  #: bytes that MATLAB puts before it
HDF5_EXTRA = "hdf5"
MOST_DEPTH = 4  #: structs in structs that are looked into
OWN = "#"  #: begins the names of groups that MATLAB keeps for itself
REAL_KINDS = "biuf"
NUMERIC_CLASSES = tuple(
    [
        name.encode()
        for name in ("double", "single", "logical", *[f"{u}int{n}" for u in ("", "u") for n in (8, 16, 32, 64)])
    ]
)  #: of MATLAB; Octave and others write no class
MOST_READ_AGAIN = 2**33  #: bytes that are unpacked where the same pieces are unpacked several times
FREE_CHUNKS, CHUNK_ENTRY = 10_000, 16  #: pieces of a dataset in any file, and bytes that tell where each of more lies


def is_mat73(content: bytes) -> bool:
    """Tell by the signature of HDF5, at the start or behind MATLAB's header."""
    return content.startswith(SIGNATURE) or content[USER_BLOCK : USER_BLOCK + len(SIGNATURE)] == SIGNATURE


def read_mat73(content: bytes, wanted: Collection[str]) -> dict[str, Value]:
    """Read the wanted variables of a MATLAB version 7.3 file.

    Parameters
    ----------
    content : bytes
        The whole file.
    wanted : collection of str
        Names; other variables are not looked at.

    Returns
    -------
    dict from name to ndarray, csc_array or list of str
        Char arrays give a text a row, cell arrays of chars a text a cell, without blanks at their ends.

    Raises
    ------
    MissingExtraError
        h5py is not installed.
    FileFormatError
        A variable of another kind, too large, or with indices out of bounds.
    OSError, ValueError, KeyError, RuntimeError
        The bytes are damaged.
    """
    h5py = _h5py()
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            names = [name for name in wanted if isinstance(file.get(name, getlink=True), h5py.HardLink)]
            return {name: _value(file, file[name], name, len(content)) for name in names}
    except OSError as cause:
        raise _damaged(cause) from cause


def mat73_variables(content: bytes) -> list[Variable]:
    """Describe the variables of a MATLAB version 7.3 file; structs and cell arrays by their parts too.

    Raises
    ------
    MissingExtraError
        h5py is not installed.
    FileFormatError
        The structure is damaged.
    """
    h5py = _h5py()
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            return _listed(content, file, file, "", [MOST_PARTS])
    except OSError as cause:
        raise _damaged(cause) from cause


def _listed(content: bytes, file: Any, group: Any, before: str, room: list[int]) -> list[Variable]:  # noqa: ANN401
    """Describe what a group holds, up to a number of parts in all: groups may hold each other."""
    h5py = _h5py()
    found = []
    for key in group:
        room[0] -= 1
        if room[0] < 0:
            break
        if not key.startswith(OWN) and isinstance(group.get(key, getlink=True), h5py.HardLink):
            found.append(_described(content, file, group[key], (f"{before}{key}", group[key].name), room))
    return found


def _described(content: bytes, file: Any, item: Any, names: tuple[str, str], room: list[int]) -> Variable:  # noqa: ANN401
    """Describe a variable by its attributes; `names` are what it is called and where it is."""
    name, where = names
    kind: Kind = "object"
    shape: tuple[int, ...] = ()
    parts: list[Variable] = []
    if "MATLAB_sparse" in item.attrs:
        columns = item["jc"].shape[0] - 1 if "jc" in item and item["jc"].shape else 0
        kind, shape = "matrix", (int(item.attrs["MATLAB_sparse"]), columns)
    elif not hasattr(item, "dtype"):
        kind, parts = "struct", _listed(content, file, item, f"{name}.", room) if name.count(".") < MOST_DEPTH else []
    elif item.dtype.kind == "O":
        kind, parts = "cell", _cells(content, file, item, name, room)
    elif _is_char(item):
        kind = "text"
    elif item.attrs.get("MATLAB_class", NUMERIC_CLASSES[0]) not in NUMERIC_CLASSES:
        kind = "object"
    elif item.dtype.kind in REAL_KINDS or item.dtype.names == ("real", "imag"):
        kind, shape = "matrix", tuple(reversed(item.shape or ()))
    return Variable(
        name=name, kind=kind, shape=shape, read=partial(_read_again, content, where, name), parts=lambda: parts
    )


def _cells(content: bytes, file: Any, item: Any, name: str, room: list[int]) -> list[Variable]:  # noqa: ANN401
    if _h5py().check_ref_dtype(item.dtype) is None or not item.size or item.size > MOST_PARTS:
        return []
    cells = [file[reference] for reference in _checked(item, name, len(content)).reshape(-1).tolist() if reference]
    flat = [(number, cell) for number, cell in enumerate(cells, start=1) if not _is_cell(cell)]
    return [_described(content, file, cell, (f"{name}{{{number}}}", cell.name), room) for number, cell in flat]


def _is_cell(item: Any) -> bool:  # noqa: ANN401
    return hasattr(item, "dtype") and item.dtype.kind == "O"


def _read_again(content: bytes, where: str, name: str) -> Value:
    try:
        with _h5py().File(io.BytesIO(content), "r") as file:
            return _value(file, file[where], name, len(content))
    except OSError as cause:
        raise _damaged(cause) from cause


def _damaged(cause: OSError) -> FileFormatError:
    """Name what the library says: the bytes are in memory, so it is not the file system."""
    msg = f"the HDF5 structure is damaged ({' '.join(str(cause).split())}). Write it anew."
    return FileFormatError(msg, path="")


def _h5py() -> Any:  # noqa: ANN401  # a module that need not be there
    try:
        return importlib.import_module("h5py")
    except ImportError as cause:
        msg = (
            f"this is a MATLAB 7.3 (HDF5) file, which needs h5py: pip install 'halfdof_ctrl[{HDF5_EXTRA}]'. Or save it "
            "with  save(file, ..., '-v7')."
        )
        raise MissingExtraError(msg, path="", extra=HDF5_EXTRA) from cause


def _require_few_chunks(item: Any, name: str, length: int) -> None:  # noqa: ANN401
    """Refuse a dataset in more pieces than the file can hold, each of which takes time though it holds nothing."""
    if not item.chunks:
        return
    chunks = math.prod([-(-size // chunk) for size, chunk in zip(item.shape, item.chunks, strict=True)])
    if chunks > max(FREE_CHUNKS, length // CHUNK_ENTRY):
        msg = f"{name} lies in {chunks} pieces, more than a file of {length} bytes holds. It is damaged."
        raise FileFormatError(msg, path="")


def _value(file: Any, item: Any, name: str, length: int) -> Value:  # noqa: ANN401  # h5py is untyped
    if "MATLAB_sparse" in item.attrs:
        return _sparse(item, name, length)
    if not hasattr(item, "dtype"):
        raise another_kind(name)
    if item.chunks and item.dtype.kind in REAL_KINDS and item.size * item.dtype.itemsize > most_unpacked(length):
        return _without_zeros(item, name, length)
    data = _checked(item, name, length)
    if item.attrs.get("MATLAB_empty", 0):
        return []
    if item.dtype.kind == "O":
        if _h5py().check_ref_dtype(item.dtype) is None:
            raise another_kind(name)
        cells = [file[reference] for reference in data.reshape(-1).tolist()]
        if not all(_is_char(cell) and len(cell.shape) == 2 and 1 in cell.shape for cell in cells):  # noqa: PLR2004
            raise another_kind(name)
        return [row for cell in cells for row in _rows(_checked(cell, name, length))]
    if _is_char(item):
        return _rows(data)
    if item.attrs.get("MATLAB_class", NUMERIC_CLASSES[0]) not in NUMERIC_CLASSES:
        raise another_kind(name)
    return _numbers(data, name).T


def _without_zeros(item: Any, name: str, length: int) -> csc_array:  # noqa: ANN401
    """Read a full matrix of zeros mostly, some columns at a time."""
    step = max(1, PIECE // max(1, item.dtype.itemsize * item.shape[-1]))
    at_once, again = math.prod(item.chunks) * item.dtype.itemsize, -(-item.chunks[0] // step)
    size = item.size * item.dtype.itemsize
    readable = at_once <= most_unpacked(length) and size * again <= MOST_READ_AGAIN
    if len(item.shape) != 2 or item.is_virtual or item.external or not readable:  # noqa: PLR2004
        raise out_of_room(name, size, length)
    _require_few_chunks(item, name, length)
    pieces = (np.asarray(item[start : start + step]).tobytes() for start in range(0, item.shape[0], step))
    return without_zeros(pieces, item.dtype, item.shape[::-1], name, length, by_columns=True)


def _checked(item: Any, name: str, length: int) -> npt.NDArray[Any]:  # noqa: ANN401
    """Read a dataset that lies in the file and is not larger than the file can hold."""
    if item.is_virtual or item.external:
        msg = f"{name} lies in another file. Save it into one."
        raise FileFormatError(msg, path="")
    most = min(most_unpacked(length), 16 * DENSE_ROW_LIMIT**2) if item.chunks else length
    if item.size is not None and item.size * item.dtype.itemsize > most:
        msg = (
            f"{name} has {item.size} entries, more than are read from a file of {length} bytes. Reduce the model first."
        )
        raise FileFormatError(msg, path="")
    _require_few_chunks(item, name, length)
    return np.asarray(item[()])


def _sparse(item: Any, name: str, length: int) -> csc_array:  # noqa: ANN401
    rows = int(item.attrs["MATLAB_sparse"])
    start = _checked(item["jc"], name, length).astype(np.int64)
    empty = "data" not in item
    row = np.zeros(0, dtype=np.int64) if empty else _checked(item["ir"], name, length).astype(np.int64)
    values = np.zeros(0) if empty else _numbers(_checked(item["data"], name, length), name)
    lengths = np.diff(start)
    sound = start.size > 0 and start[0] == 0 and (lengths >= 0).all() and start[-1] == row.size == values.size
    if not (sound and 0 <= rows <= max(MOST_ROWS, length) and ((row >= 0) & (row < rows)).all()):
        msg = f"the sparse matrix {name} has indices out of bounds. The file is damaged."
        raise FileFormatError(msg, path="")
    require_ascending(name, row, start)
    return csc_array((values, row, start), shape=(rows, lengths.size))


def _numbers(data: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    if data.dtype.names == ("real", "imag"):
        values = np.empty(data.shape, dtype=np.complex128)
        values.real, values.imag = data["real"], data["imag"]
        return values
    if data.dtype.kind not in REAL_KINDS:
        raise another_kind(name)
    return data.astype(np.float64)


def _is_char(item: Any) -> bool:  # noqa: ANN401
    return hasattr(item, "dtype") and item.dtype == np.uint16 and item.attrs.get("MATLAB_class") == b"char"


def _rows(units: npt.NDArray[Any]) -> list[str]:
    """Read 16-bit units, one text a column of the dataset."""
    table = units.astype("<u2").reshape(units.shape[0], -1) if units.ndim else units.reshape(1, 1)
    return [np.ascontiguousarray(column).tobytes().decode("utf-16-le").rstrip(" ") for column in table.T]
