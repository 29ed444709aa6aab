"""Files are written to a temporary name and renamed: whole or not at all."""

import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import scipy.io
from scipy.sparse import issparse

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.containers import MATRIX_ENDINGS, Content, PathLike, ending, has_controls, sparse_parts
from halfdof_ctrl.files.formats.variables import FREE_BYTES

BYTES_OF_A_CELL = 64  #: of MATLAB, beside its text


@contextmanager
def replacing(path: PathLike) -> Iterator[BinaryIO]:
    """Open a temporary file beside the target; it takes the target's place at the end, or goes on an error."""
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        msg = f"{path}: there is something of that name that is no file. Choose another name."
        raise FileFormatError(msg, path=str(path))
    temporary = target.with_name(f".{target.name[:100]}.{secrets.token_hex(4)}.part")
    try:
        with naming_target(path):
            stream = temporary.open("xb")
        with naming_full_disk(path), stream:
            yield stream
        with naming_target(path):
            temporary.replace(target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


@contextmanager
def naming_full_disk(path: PathLike) -> Iterator[None]:
    """Let a failed write tell of the target: the system says which file it was only when one is opened."""
    try:
        yield
    except OSError as cause:
        if cause.filename is not None or cause.errno is None:
            raise
        raise OSError(cause.errno, cause.strerror, str(path)) from cause


@contextmanager
def naming_target(path: PathLike) -> Iterator[None]:
    """Let an OSError tell of the target instead of a temporary name."""
    try:
        yield
    except OSError as cause:
        raise OSError(cause.errno, cause.strerror, str(path)) from cause


def save_matrices(path: PathLike, content: Content, names: Mapping[str, Sequence[str]], name: str | None) -> None:
    """Write matrices and names of signals as `.npz` or `.mat`."""
    suffix = ending(path, MATRIX_ENDINGS)
    for text in (*(text for group in names.values() for text in group), name or ""):
        if has_controls(text):
            msg = f"{path}: the name {text!r} holds a control character, which files do not keep. Rename the signal."
            raise FileFormatError(msg, path=str(path))
    with replacing(path) as stream:
        if suffix == ".npz":
            parts = [sparse_parts(key, value) if issparse(value) else {key: value} for key, value in content.items()]
            arrays: dict[str, Any] = {key: value for part in parts for key, value in part.items()}
            arrays |= {key: np.array(value, dtype=np.str_) for key, value in names.items()}
            np.savez(stream, allow_pickle=False, **arrays, **({} if name is None else {"name": np.array(name)}))
        else:
            cells = {key: np.array(value, dtype=object).reshape(1, -1) for key, value in names.items()}
            title = {} if name is None else {"name": name}
            every: Any = {**title, **cells, **content}
            sizes = [_size(value) for value in content.values()] + [_size_of_names(value) for value in names.values()]
            packed = max(sizes, default=0) < FREE_BYTES // 2  # with a checksum; larger ones might not be unpacked
            scipy.io.savemat(stream, every, do_compression=packed)  # type: ignore[arg-type]  # stubs know paths only


def _size(value: Any) -> int:  # noqa: ANN401  # dense or sparse
    parts = [getattr(value, part) for part in ("data", "indices", "indptr")] if issparse(value) else [np.asarray(value)]
    return int(sum([part.nbytes for part in parts]))


def _size_of_names(names: Sequence[str]) -> int:
    return sum([BYTES_OF_A_CELL + 4 * len(name) for name in names])
