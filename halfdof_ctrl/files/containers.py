"""Named variables from the files that hold several: ``.npz`` archives, and MATLAB's ``.mat`` of version 4, 5 and 7.3.

A sparse matrix K in an archive is stored by its compressed columns, ``K.data``, ``K.indices``, ``K.indptr`` and
``K.shape``; in ``.mat`` it is MATLAB's own. Nothing is unpickled, and sizes are checked before anything is unpacked.
A ``.npy`` file holds one array, which has no name.
"""

import os
import unicodedata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.doors import require_path
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.mat4 import is_mat4, mat4_variables
from halfdof_ctrl.files.formats.mat5 import mat5_variables
from halfdof_ctrl.files.formats.mat73 import is_mat73, mat73_variables
from halfdof_ctrl.files.formats.npy import SPARSE_PARTS, is_npy, npy_variable, npz_variables
from halfdof_ctrl.files.formats.text_blocks import LARGEST_WHOLE
from halfdof_ctrl.files.formats.variables import Variable, require_names_once
from halfdof_ctrl.files.naming import naming_the_file

PathLike: TypeAlias = str | os.PathLike[str]
Content: TypeAlias = Mapping[str, Any]

MATRIX_ENDINGS = (".npz", ".mat")
ARRAY_ENDINGS = (*MATRIX_ENDINGS, ".npy")


def ending(path: PathLike, known: Sequence[str]) -> str:
    """Return the ending of a path in small letters, and refuse one that is not known."""
    require_path(path, "A file name")
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
        found = variables(content, is_archive=is_archive)
        return {variable.name: variable.read() for variable in found if variable.name in wanted}


def variables(content: bytes, *, is_archive: bool) -> list[Variable]:
    """Describe the variables of a file: a .npy array, an .npz archive, or MATLAB's of any version.

    Raises
    ------
    FileFormatError, ValueError, ...
        The file is damaged or of another kind.
    """
    if is_npy(content):
        return [npy_variable(content)]
    if is_archive:
        return npz_variables(content)
    if is_mat73(content):
        return mat73_variables(content)
    found = mat4_variables(content) if is_mat4(content) else mat5_variables(content)
    require_names_once(found)
    return found


def texts(content: Content, key: str) -> list[str] | None:
    """Return names, which are a text array in .npz, a list of texts from .mat, or whole numbers, as those of nodes."""
    value = content.get(key)
    if value is None or isinstance(value, list):
        return value
    array = np.asarray(value)
    if array.dtype.kind in "iuf" and (array == np.rint(array)).all() and (np.abs(array) < LARGEST_WHOLE).all():
        return [f"{int(number)}" for number in array.reshape(-1).tolist()]
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
    if has_controls(found[0]):
        msg = "name has control characters, which no name has. Write the file anew, with another name."
        raise FileFormatError(msg, path="")
    return found[0] or None


def has_controls(text: str) -> bool:
    r"""Tell whether a text holds control characters or halves of characters, which files and terminals do not keep.

    >>> has_controls("mount 3\xa0kg"), has_controls("a\x1b[2J"), has_controls("a\ud800")
    (False, True, True)
    """
    return any(unicodedata.category(letter) in {"Cc", "Cs"} for letter in text)


def sparse_parts(key: str, matrix: Any) -> dict[str, Any]:  # noqa: ANN401  # any sparse format
    """Return the arrays by which an archive stores a sparse matrix."""
    columns = csc_array(matrix)
    return {f"{key}.{part}": np.asarray(getattr(columns, part)) for part in SPARSE_PARTS}
