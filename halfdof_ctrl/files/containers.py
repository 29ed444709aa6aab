"""Named variables from the files that hold several: ``.npz`` archives and MATLAB's ``.mat``, version 5 and 7.3.

A sparse matrix K in an archive is stored by its compressed columns, ``K.data``, ``K.indices``, ``K.indptr`` and
``K.shape``; in ``.mat`` it is MATLAB's own. Nothing is unpickled, and sizes are checked before anything is unpacked.
"""

import io
import os
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.formats.mat5 import MOST_BYTES, read_mat
from halfdof_ctrl.files.formats.mat73 import is_mat73, read_mat73
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS
from halfdof_ctrl.files.naming import naming_the_file

PathLike: TypeAlias = str | os.PathLike[str]
Content: TypeAlias = Mapping[str, Any]

MATRIX_ENDINGS = (".npz", ".mat")
ZIP_HEADER = b"PK\x03\x04"
SPARSE_PARTS = ("data", "indices", "indptr", "shape")


def ending(path: PathLike, known: Sequence[str]) -> str:
    """Return the ending of a path in small letters, and refuse one that is not known."""
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        msg = f"{path}: the ending {suffix or '(none)'} names no format for this. Use {', '.join(known)}."
        raise FileFormatError(msg, path=str(path))
    return suffix


def load_variables(path: PathLike, wanted: Sequence[str]) -> Content:
    """Read the wanted variables of a file; whatever a damaged file does to the readers is one refusal."""
    is_archive = ending(path, MATRIX_ENDINGS) == ".npz"
    if Path(path).exists() and not Path(path).is_file():
        msg = f"{path}: this is no file. Give a file that ends in {' or '.join(MATRIX_ENDINGS)}."
        raise FileFormatError(msg, path=str(path))
    content = Path(path).read_bytes()
    with naming_the_file(path):
        if is_archive:
            return _read_npz(content, wanted)
        return read_mat73(content, wanted) if is_mat73(content) else read_mat(content, wanted)


def texts(content: Content, key: str) -> list[str] | None:
    """Return names, which are a text array in .npz and a list of texts from .mat."""
    value = content.get(key)
    if value is None or isinstance(value, list):
        return value
    array = np.asarray(value)
    if array.size and array.dtype.kind not in "US":
        msg = f"{key} must be names, but it holds entries of type {array.dtype}. Give text (in MATLAB a cellstr)."
        raise FileFormatError(msg, path="")
    found = array.reshape(-1).tolist()
    return [text.decode() if isinstance(text, bytes) else str(text) for text in found]


def single_text(content: Content) -> str | None:
    """Return the variable ``name``, None if it is empty or not there."""
    found = texts(content, "name") or [""]
    if len(found) > 1:
        msg = f"name must be one text, but it has {len(found)}."
        raise FileFormatError(msg, path="")
    return found[0] or None


def sparse_parts(key: str, matrix: Any) -> dict[str, Any]:  # noqa: ANN401  # any sparse format
    """Return the arrays by which an archive stores a sparse matrix."""
    columns = csc_array(matrix)
    return {f"{key}.{part}": np.asarray(getattr(columns, part)) for part in SPARSE_PARTS}


def _read_npz(content: bytes, wanted: Sequence[str]) -> Content:
    if not content.startswith(ZIP_HEADER):
        msg = "this is no archive of arrays. Write it by numpy.savez(path, M=M, C=C, K=K)."
        raise FileFormatError(msg, path="")
    archive: Any = np.load(io.BytesIO(content), allow_pickle=False)
    with archive, zipfile.ZipFile(io.BytesIO(content)) as members:
        sizes = {info.filename.removesuffix(".npy"): info.file_size for info in members.infolist()}
        parts = {key: [f"{key}.{part}" for part in SPARSE_PARTS] for key in wanted}
        sparse = [key for key in wanted if key not in archive.files and set(parts[key]) <= set(archive.files)]
        full = [key for key in wanted if key in archive.files]
        too_large = [
            key for key in (*full, *(part for key in sparse for part in parts[key])) if sizes[key] > MOST_BYTES
        ]
        if too_large:
            msg = (
                f"{listed(too_large)} is larger than the {MOST_BYTES:.0e} bytes that are read. Reduce the model first."
            )
            raise FileFormatError(msg, path="")
        found = {key: archive[key] for key in full}
        return found | {key: _sparse(key, *(archive[part] for part in parts[key])) for key in sparse}


def _sparse(key: str, data: Any, indices: Any, indptr: Any, shape: Any) -> csc_array:  # noqa: ANN401  # as they come
    """Make a matrix of parts that may be damaged."""
    rows, columns = (int(size) for size in shape)
    sound = (
        data.ndim == indices.ndim == indptr.ndim == 1
        and indices.dtype.kind == indptr.dtype.kind == "i"
        and 0 < rows <= MOST_ROWS
        and indptr.size == columns + 1
        and indptr[0] == 0
        and bool((np.diff(indptr) >= 0).all())
        and indptr[-1] == data.size == indices.size
        and bool(((indices >= 0) & (indices < rows)).all())
    )
    if not sound:
        msg = f"the sparse matrix {key} has indices out of bounds. Write it anew."
        raise FileFormatError(msg, path="")
    matrix = csc_array((data, indices, indptr), shape=(rows, columns))
    matrix.sum_duplicates()
    return matrix
