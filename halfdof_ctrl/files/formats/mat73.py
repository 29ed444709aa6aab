"""Read matrices and names from MATLAB version 7.3 files, which are HDF5 files, through h5py (extra ``hdf5``).

A full matrix is a dataset with its axes reversed. A sparse one is a group with the attribute MATLAB_sparse (rows) and
the datasets ``data``, ``ir`` (row numbers) and ``jc`` (starts of the columns). Text is a dataset of 16-bit units, a
cell array a dataset of references. Links that lead out of the file are not followed, and sizes are checked before
anything is read.
"""

import importlib
import io
from collections.abc import Collection
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import DENSE_ROW_LIMIT
from halfdof_ctrl.base.errors import FileFormatError, MissingExtraError
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS

Value: TypeAlias = npt.NDArray[Any] | csc_array | list[str]

SIGNATURE = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512  #: bytes that MATLAB puts before it
EXTRA = "hdf5"
COMPRESSION = 1100  #: the most that deflate makes of a byte
REAL_KINDS = "biuf"


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
    except OSError as cause:  # of the library, not of the file system: the bytes are in memory
        msg = f"the HDF5 structure is damaged ({' '.join(str(cause).split())}). Write it anew."
        raise FileFormatError(msg, path="") from cause


def _h5py() -> Any:  # noqa: ANN401  # a module that need not be there
    try:
        return importlib.import_module("h5py")
    except ImportError as cause:
        msg = (
            f"this is a MATLAB 7.3 (HDF5) file, which needs h5py: pip install 'halfdof_ctrl[{EXTRA}]'. Or save it "
            "with  save(file, ..., '-v7')."
        )
        raise MissingExtraError(msg, path="", extra=EXTRA) from cause


def _value(file: Any, item: Any, name: str, length: int) -> Value:  # noqa: ANN401  # h5py is untyped
    if "MATLAB_sparse" in item.attrs:
        return _sparse(item, name, length)
    if not hasattr(item, "dtype"):
        raise _another_kind(name)
    data = _checked(item, name, length)
    if item.attrs.get("MATLAB_empty", 0):
        return []
    if item.dtype.kind == "O":
        if _h5py().check_ref_dtype(item.dtype) is None:
            raise _another_kind(name)
        cells = [file[reference] for reference in data.reshape(-1).tolist()]
        if not all(_is_char(cell) and len(cell.shape) == 2 and 1 in cell.shape for cell in cells):  # noqa: PLR2004
            raise _another_kind(name)
        return [row for cell in cells for row in _rows(_checked(cell, name, length))]
    if _is_char(item):
        return _rows(data)
    return _numbers(data, name).T


def _checked(item: Any, name: str, length: int) -> npt.NDArray[Any]:  # noqa: ANN401
    """Read a dataset that lies in the file and is not larger than the file can hold."""
    if item.is_virtual or item.external:
        msg = f"{name} lies in another file. Save it into one."
        raise FileFormatError(msg, path="")
    most = min(length * COMPRESSION, 16 * DENSE_ROW_LIMIT**2) if item.chunks else length
    if item.size is not None and item.size * item.dtype.itemsize > most:
        msg = (
            f"{name} has {item.size} entries, more than are read from a file of {length} bytes. Reduce the model first."
        )
        raise FileFormatError(msg, path="")
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
    matrix = csc_array((values, row, start), shape=(rows, lengths.size))
    matrix.sum_duplicates()
    return matrix


def _numbers(data: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    if data.dtype.names == ("real", "imag"):
        values = np.empty(data.shape, dtype=np.complex128)
        values.real, values.imag = data["real"], data["imag"]
        return values
    if data.dtype.kind not in REAL_KINDS:
        raise _another_kind(name)
    return data.astype(np.float64)


def _is_char(item: Any) -> bool:  # noqa: ANN401
    return hasattr(item, "dtype") and item.dtype == np.uint16 and item.attrs.get("MATLAB_class") == b"char"


def _rows(units: npt.NDArray[Any]) -> list[str]:
    """Read 16-bit units, one text a column of the dataset."""
    table = units.astype("<u2").reshape(units.shape[0], -1) if units.ndim else units.reshape(1, 1)
    return [np.ascontiguousarray(column).tobytes().decode("utf-16-le").rstrip(" ") for column in table.T]


def _another_kind(name: str) -> FileFormatError:
    msg = (
        f"{name} is a struct, string or other object, where numbers or names should be. Save plain matrices, and "
        "names as cellstr."
    )
    return FileFormatError(msg, path="")
