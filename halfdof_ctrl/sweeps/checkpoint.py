"""Finished cases in a file, as they come: what a second run continues from.

One line a case, of plain text (JSON, arrays as base64 of their bytes), behind the checksum of what follows. The first
line says whose cases these are. A line is written by a single call, so that a run that is killed leaves whole lines,
and at most one that is cut; nothing in the file is ever executed.
"""

import base64
import binascii
import json
import os
import stat
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.errors import CheckpointError
from halfdof_ctrl.sweeps.one_case import RESULT_KINDS, CaseResult

FORMAT = "halfdof_ctrl sweep checkpoint"
VERSION = 1
CHECKPOINT_ARRAYS = ("poles", "response", "value")
CHECKPOINT_NAMES = ("inputs", "outputs", "dofs")
MODE = 0o666  #: of a new file, less what the user's umask takes away


class Checkpoint:
    """An open file that takes finished cases; made by `open_checkpoint`."""

    def __init__(self, path: str, descriptor: int, done: dict[int, CaseResult]) -> None:
        self.path = path
        self.done = done  #: results that were there already, by the number of the case
        self.failure: OSError | None = None  #: why nothing more can be written
        self.unwritten = 0  #: results that are not in the file
        self._descriptor = descriptor

    def add(self, number: int, result: CaseResult) -> None:
        """Append a finished case; a disk that is full stops no sweep, but is remembered."""
        if self.failure is None:
            try:
                _append(self._descriptor, _line({"case": number} | _as_plain(result)))
            except OSError as failure:
                self.failure = failure
        if self.failure is not None:
            self.unwritten += 1


@contextmanager
def open_checkpoint(
    path: str | os.PathLike[str], fingerprint: str, about: Mapping[str, object]
) -> Iterator[Checkpoint]:
    """Open a checkpoint, or begin one, and read what is done.

    Parameters
    ----------
    path : path-like
    fingerprint : str
        Of the sweep whose cases these are.
    about : mapping
        What the first line says besides, for people: plain values.

    Raises
    ------
    CheckpointError
        The file is no checkpoint, is one of another sweep, or is in use.
    OSError
        It cannot be read or written.
    """
    name = os.fspath(path)
    header = _line({"format": FORMAT, "version": VERSION, "fingerprint": fingerprint} | dict(about))
    descriptor = os.open(name, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0), MODE)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            msg = f"{name}: a checkpoint must be a file, not a device or a pipe. Give another path."
            raise CheckpointError(msg, path=name)
        _lock(descriptor, name)
        content = Path(name).read_bytes()
        if not content or (len(content) < len(header) and header.startswith(content)):  # new, or cut in its first line
            os.ftruncate(descriptor, 0)
            _append(descriptor, header)
            done: dict[int, CaseResult] = {}
        else:
            done = _read(content, name, fingerprint)
            os.ftruncate(descriptor, content.rfind(b"\n") + 1)
        yield Checkpoint(name, descriptor, done)
        with suppress(OSError):  # a device that has no such thing
            os.fsync(descriptor)
    except OSError as failure:
        if failure.filename is None:
            raise OSError(failure.errno, failure.strerror, name) from failure
        raise
    finally:
        os.close(descriptor)


def _read(content: bytes, name: str, fingerprint: str) -> dict[int, CaseResult]:
    """Read the cases of a file; a damaged line is left out, so that its case is done again."""
    first, *lines = content.split(b"\n")[:-1] or [b""]
    header = _parsed(first)
    if header is None or header.get("format") != FORMAT:
        msg = f"{name}: it is no checkpoint of a sweep. Give another path, or remove the file if nobody needs it."
        raise CheckpointError(msg, path=name)
    if header.get("version") != VERSION:
        msg = f"{name}: it is a checkpoint of version {header.get('version')}, but this package reads {VERSION}."
        raise CheckpointError(msg, path=name)
    if header.get("fingerprint") != fingerprint:
        was = f"{header.get('function')} with {header.get('parameters')}, {header.get('cases')} {header.get('what')}"
        msg = (
            f"{name}: it holds the cases of another sweep ({was}): its function, parameters, omega, inputs, outputs or "
            "compute are others. Give another path, or the same sweep."
        )
        raise CheckpointError(msg, path=name)
    done = {}
    for record in filter(None, map(_parsed, lines)):
        with suppress(KeyError, ValueError, TypeError, binascii.Error):
            done[int(record["case"])] = _from_plain(record)
    return done


def _line(record: Mapping[str, object]) -> bytes:
    text = json.dumps(record, ensure_ascii=True, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _parsed(line: bytes) -> dict[str, Any] | None:
    """Read a line; None where it is not as it was written."""
    checksum, _, text = line.partition(b" ")
    try:
        if int(checksum, 16) != zlib.crc32(text):
            return None
        record = json.loads(text)
    except ValueError:
        return None
    return record if isinstance(record, dict) else None


def _as_plain(result: CaseResult) -> dict[str, object]:
    arrays = {name: getattr(result, name) for name in CHECKPOINT_ARRAYS}
    plain: dict[str, object] = {
        name: [array.dtype.newbyteorder("<").str, list(array.shape), _bytes_of(array)]
        for name, array in arrays.items()
        if array is not None
    }
    return plain | {name: list(getattr(result, name)) for name in CHECKPOINT_NAMES} | {"discrete": result.discrete}


def _from_plain(record: Mapping[str, Any]) -> CaseResult:
    arrays: dict[str, Any] = {name: _array(*record[name]) for name in CHECKPOINT_ARRAYS if name in record}
    names: dict[str, Any] = {name: tuple(map(str, record[name])) for name in CHECKPOINT_NAMES}
    return CaseResult(**arrays, **names, discrete=bool(record["discrete"]))


def _bytes_of(array: npt.NDArray[Any]) -> str:
    return base64.b64encode(array.astype(array.dtype.newbyteorder("<")).tobytes()).decode("ascii")


def _array(kind: str, shape: list[int], text: str) -> npt.NDArray[Any]:
    dtype = np.dtype(kind)
    if dtype.kind not in RESULT_KINDS:
        msg = f"{kind} is no kind of numbers."
        raise ValueError(msg)
    return np.frombuffer(base64.b64decode(text, validate=True), dtype).astype(dtype.newbyteorder("=")).reshape(shape)


def _append(descriptor: int, line: bytes) -> None:
    """Write a line by one call; one that does not fit is taken away again."""
    end = os.fstat(descriptor).st_size
    written = 0
    try:
        while written < len(line):  # more than one call only where the disk is full
            written += os.write(descriptor, line[written:])
    except OSError:
        with suppress(OSError):
            os.ftruncate(descriptor, end)
        raise


def _lock(descriptor: int, name: str) -> None:
    """Keep other runs out as long as this process lives, where the system can."""
    try:
        import fcntl  # noqa: PLC0415  # not on Windows
    except ImportError:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as cause:
        msg = f"{name}: another sweep is writing it. Wait until that has ended, or give another path."
        raise CheckpointError(msg, path=name) from cause
    except OSError:  # a file system without locks
        return
