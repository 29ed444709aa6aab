"""Models, state spaces, gains and responses in files, whole or not at all.

| what | endings | content |
|---|---|---|
| model | .npz, .mat | M, C, K, B, F, G, H, D (Bv, Ba, Dv, Da, prescribed if there), dofs, inputs, outputs, name |
| state space | .npz, .mat | A, B, C, D, states, inputs, outputs, name, dt (-1: sampled with unknown period) |
| gain | .npz, .mat, .csv | K, inputs, states |
| response | .csv | one row a frequency or time, see `save_response` |

Files are read with ``allow_pickle=False`` and nothing in them is executed. They are written to a temporary
name beside the target, which takes the target's place when it is complete.
"""

import csv
import io
import os
import secrets
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias

import control
import numpy as np
import scipy.io

from halfdof_ctrl.arrays import checked_matrix, is_zero
from halfdof_ctrl.design import StateFeedback
from halfdof_ctrl.errors import FileFormatError, HalfdofError
from halfdof_ctrl.matfile import MOST_BYTES, read_mat
from halfdof_ctrl.model import LETTERS, SecondOrderModel, mechss
from halfdof_ctrl.names import checked_names, listed, name_from_label

PathLike: TypeAlias = str | os.PathLike[str]
Content: TypeAlias = Mapping[str, Any]

MATRIX_ENDINGS = (".npz", ".mat")
TABLE_ENDINGS = (".csv",)
GAIN_ENDINGS = (*MATRIX_ENDINGS, *TABLE_ENDINGS)
OPTIONAL_LETTERS = ("Bv", "Ba", "Dv", "Da")  #: written only where they are not zero
MODEL_NAMES = ("dofs", "inputs", "outputs")
SYSTEM_LETTERS = ("A", "B", "C", "D")
SYSTEM_NAMES = ("states", "inputs", "outputs")
ZIP_HEADER = b"PK\x03\x04"
UNKNOWN_PERIOD = -1.0  #: MATLAB's Ts of a sampled system without a period, True in python-control


def save_model(model: SecondOrderModel, path: PathLike) -> None:
    """Write a model to a file that `load_model` reads back exactly.

    Parameters
    ----------
    model : SecondOrderModel
    path : path-like
        Ends in ``.npz``, or in ``.mat`` for MATLAB (version 5), where ``mechss`` takes the same letters.

    Raises
    ------
    FileFormatError
        Another ending, or a name that files cannot keep (control characters).
    OSError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_model(hydromount(), f"{folder}/mount.npz")
    ...     load_model(f"{folder}/mount.npz").outputs
    ('y', 'y1', 'y2')
    """
    kept = [letter for letter in LETTERS if letter not in OPTIONAL_LETTERS or not is_zero(getattr(model, letter))]
    kept.sort(key="K".__eq__)  # last, so that no beginning of a file passes for a model
    content = {letter: getattr(model, letter) for letter in kept}
    names = {key: getattr(model, key) for key in MODEL_NAMES}
    _save_matrices(path, content, names | ({"prescribed": model.prescribed} if model.prescribed else {}), model.name)


def load_model(path: PathLike) -> SecondOrderModel:
    """Read a model from a file.

    Parameters
    ----------
    path : path-like
        An ``.npz`` or MATLAB version 5 ``.mat`` file with K, and any of M, C, B, F, G, H, D, Bv, Ba, Dv, Da
        (dense or sparse in ``.mat``), ``dofs``, ``inputs``, ``outputs``, ``prescribed`` (text arrays; in ``.mat``
        cell or char arrays) and ``name``. What is missing is as in `mechss`; other variables are not looked at.

    Returns
    -------
    SecondOrderModel

    Raises
    ------
    FileFormatError
        Another ending, damaged, of another kind, with objects or text for numbers, or a model that
        `mechss` refuses; the message starts with the file and the cause is the refusal.
    OSError
        The file is not there or cannot be read.
    """
    content = _load_matrices(path, (*LETTERS, *MODEL_NAMES, "prescribed", "name"))
    if "K" not in content:
        found = f"it has {listed(sorted(content))}" if content else "it has none of a model's letters"
        msg = f"{path}: no stiffness K in the file ({found}). A model file holds M, C and K, capital letters."
        raise FileFormatError(msg, path=str(path))
    with _naming_the_file(path):
        matrices: dict[str, Any] = {letter: content.get(letter) for letter in LETTERS}
        names: dict[str, Any] = {key: _texts(content, key) for key in MODEL_NAMES}
        prescribed = _texts(content, "prescribed")
        if not prescribed:
            return mechss(**matrices, **names, name=_single_text(content))
        return _with_prescribed(mechss(**matrices, dofs=names["dofs"], name=_single_text(content)), names, prescribed)


def _with_prescribed(model: SecondOrderModel, names: Mapping[str, Any], prescribed: Sequence[str]) -> SecondOrderModel:
    """Name the signals of a model in which the force on a DOF or its motion may be a direct term."""
    signals: dict[str, Any] = {
        key: getattr(model, key) if names[key] is None else checked_names(names[key], len(getattr(model, key)), key)
        for key in ("inputs", "outputs")
    }
    return replace(model, **signals, prescribed=checked_names(prescribed, len(prescribed), "prescribed DOFs"))


def save_system(sys: control.StateSpace, path: PathLike) -> None:
    """Write A, B, C, D and the labels of a state space, which Python cannot pickle.

    Parameters
    ----------
    sys : control.StateSpace
    path : path-like
        Ends in ``.npz`` or ``.mat``; in MATLAB: ``load mount.mat; sys = ss(A, B, C, D)``.

    Raises
    ------
    FileFormatError
        Another ending.
    OSError
        The file cannot be written.
    """
    content = {letter: np.asarray(getattr(sys, letter), dtype=float) for letter in SYSTEM_LETTERS}
    if sys.dt is not None:
        content["dt"] = np.array(UNKNOWN_PERIOD if sys.dt is True else float(sys.dt))
    names = {"states": sys.state_labels, "inputs": sys.input_labels, "outputs": sys.output_labels}
    _save_matrices(path, content, names, sys.name)


def load_system(path: PathLike) -> control.StateSpace:
    """Read a state space that `save_system` wrote, or any with A, B, C, D.

    Raises
    ------
    FileFormatError
        As `load_model`.
    OSError
        The file is not there or cannot be read.
    """
    content = _load_matrices(path, (*SYSTEM_LETTERS, *SYSTEM_NAMES, "name", "dt"))
    missing = [letter for letter in SYSTEM_LETTERS if letter not in content]
    if missing:
        msg = f"{path}: {listed(missing)} not in the file. A state space file holds A, B, C and D."
        raise FileFormatError(msg, path=str(path))
    with _naming_the_file(path):
        return _system(content)


def save_gain(feedback: StateFeedback, path: PathLike) -> None:
    """Write the gain K of ``u = -K x`` with the names of its inputs (rows) and states (columns).

    Raises
    ------
    FileFormatError
        The ending is not ``.npz``, ``.mat`` or ``.csv``.
    OSError
        The file cannot be written.
    """
    if ending(path, GAIN_ENDINGS) not in TABLE_ENDINGS:
        names = {"inputs": feedback.inputs, "states": feedback.states}
        _save_matrices(path, {"K": np.asarray(feedback.K)}, names, None)
        return
    rows = ([name, *map(repr, row)] for name, row in zip(feedback.inputs, feedback.K.tolist(), strict=True))
    _save_table(path, ["input", *feedback.states], rows)


def save_response(data: control.FrequencyResponseData | control.TimeResponseData, path: PathLike) -> None:
    """Write the numbers of a response as a table with full precision.

    Parameters
    ----------
    data : control.FrequencyResponseData or control.TimeResponseData
        A frequency response gives ``omega [rad/s]``, ``f [Hz]`` and for each channel ``y/F_y`` its real and
        imaginary part, magnitude, and phase [deg] without jumps. A time response gives ``t [s]`` and its outputs,
        ``y``, or ``y/F_y`` where there is a trace for each input.
    path : path-like
        Ends in ``.csv``. Names are those of the model (``101.1``), not python-control's labels.

    Raises
    ------
    FileFormatError
        Another ending.
    OSError
        The file cannot be written.
    """
    ending(path, TABLE_ENDINGS)
    header, columns = _time_table(data) if isinstance(data, control.TimeResponseData) else _frequency_table(data)
    _save_table(path, header, (map(repr, row) for row in np.column_stack(columns).tolist()))


def ending(path: PathLike, known: Sequence[str]) -> str:
    """Give the ending of a path in small letters, and refuse one that is not known."""
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        msg = f"{path}: the ending {suffix or '(none)'} names no format for this. Use {', '.join(known)}."
        raise FileFormatError(msg, path=str(path))
    return suffix


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
        with stream:
            yield stream
        with naming_target(path):
            temporary.replace(target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


@contextmanager
def naming_target(path: PathLike) -> Iterator[None]:
    """Let an OSError tell of the target instead of a temporary name."""
    try:
        yield
    except OSError as cause:
        raise OSError(cause.errno, cause.strerror, str(path)) from cause


def _save_matrices(path: PathLike, content: Content, names: Mapping[str, Sequence[str]], name: str | None) -> None:
    suffix = ending(path, MATRIX_ENDINGS)
    for text in (*(text for texts in names.values() for text in texts), name or ""):
        if any(ord(letter) < ord(" ") or "\ud800" <= letter <= "\udfff" for letter in text):
            msg = f"{path}: the name {text!r} holds a control character, which files do not keep. Rename the signal."
            raise FileFormatError(msg, path=str(path))
    with replacing(path) as stream:
        if suffix == ".npz":
            texts = {key: np.array(value, dtype=np.str_) for key, value in names.items()}
            np.savez(
                stream, allow_pickle=False, **content, **texts, **({} if name is None else {"name": np.array(name)})
            )
        else:
            cells = {key: np.array(value, dtype=object).reshape(1, -1) for key, value in names.items()}
            title = {} if name is None else {"name": name}
            scipy.io.savemat(stream, {**title, **cells, **content})  # type: ignore[arg-type]  # stubs know paths only


def _save_table(path: PathLike, header: Sequence[str], rows: Iterable[Iterable[str]]) -> None:
    with replacing(path) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
        text.detach()


def _frequency_table(data: control.FrequencyResponseData) -> tuple[list[str], list[Any]]:
    omega = np.asarray(data.omega, dtype=float)
    header, columns = ["omega [rad/s]", "f [Hz]"], [omega, omega / (2.0 * np.pi)]
    values = np.asarray(data.frdata)
    for i, result in enumerate(data.output_labels):
        for j, cause in enumerate(data.input_labels):
            channel = f"{name_from_label(result)}/{name_from_label(cause)}"
            header += [f"{channel} {part}" for part in ("real", "imag", "magnitude", "phase [deg]")]
            value = values[i, j]
            columns += [value.real, value.imag, np.abs(value), np.degrees(_unwrapped(np.angle(value)))]
    return header, columns


def _unwrapped(phase: Any) -> Any:  # noqa: ANN401 - an array of floats, which control leaves untyped
    """Remove jumps of whole turns, leaving out values at poles, which have no phase."""
    known = np.isfinite(phase)
    unwrapped = phase.copy()
    unwrapped[known] = np.unwrap(phase[known])
    return unwrapped


def _time_table(data: control.TimeResponseData) -> tuple[list[str], list[Any]]:
    time = np.asarray(data.t, dtype=float)
    results = [name_from_label(label) for label in data.output_labels]
    if data.ntraces:
        causes = [name_from_label(label) for label in data.trace_labels or data.input_labels]
        causes = [cause.removeprefix("From ") for cause in causes]
        header = [f"{result}/{cause}" for result in results for cause in causes]
    else:
        header = results
    histories = np.asarray(data.y, dtype=float).reshape(-1, time.size)
    return ["t [s]", *header], [time, *histories]


def _load_matrices(path: PathLike, wanted: Sequence[str]) -> Content:
    """Read the wanted variables of a file; whatever a damaged file does to the readers is one refusal."""
    read = _read_npz if ending(path, MATRIX_ENDINGS) == ".npz" else read_mat
    if Path(path).exists() and not Path(path).is_file():
        msg = f"{path}: this is no file. Give a file that ends in {' or '.join(MATRIX_ENDINGS)}."
        raise FileFormatError(msg, path=str(path))
    content = Path(path).read_bytes()
    with _naming_the_file(path):
        return read(content, wanted)


@contextmanager
def _naming_the_file(path: PathLike) -> Iterator[None]:
    """Turn what goes wrong with a file's content into a refusal that names the file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the parser of damaged headers; what is read gets checked
            yield
    except HalfdofError as refusal:
        msg = f"{path}: {refusal}"
        raise FileFormatError(msg, path=str(path)) from refusal
    except Exception as cause:  # the readers raise anything on damaged bytes: zlib.error, KeyError, struct.error, ...
        reason = " ".join(str(cause).split()) or type(cause).__name__
        msg = f"{path}: the file is damaged or of another kind than its ending says ({reason}). Write it anew."
        raise FileFormatError(msg, path=str(path)) from cause


def _refused(msg: str) -> FileFormatError:
    """Make a refusal that gets its file in `_naming_the_file`."""
    return FileFormatError(msg, path="")


def _read_npz(content: bytes, wanted: Sequence[str]) -> Content:
    if not content.startswith(ZIP_HEADER):
        msg = "this is no archive of arrays. Write it by numpy.savez(path, M=M, C=C, K=K)."
        raise _refused(msg)
    archive: Any = np.load(io.BytesIO(content), allow_pickle=False)
    with archive, zipfile.ZipFile(io.BytesIO(content)) as members:
        sizes = {info.filename.removesuffix(".npy"): info.file_size for info in members.infolist()}
        found = [key for key in wanted if key in archive.files]
        too_large = [key for key in found if sizes[key] > MOST_BYTES]
        if too_large:
            msg = (
                f"{listed(too_large)} is larger than the {MOST_BYTES:.0e} bytes that are read. Reduce the model first."
            )
            raise _refused(msg)
        return {key: archive[key] for key in found}


def _texts(content: Content, key: str) -> list[str] | None:
    """Give names, which are a text array in .npz and a list of texts from .mat."""
    value = content.get(key)
    if value is None or isinstance(value, list):
        return value
    array = np.asarray(value)
    if array.size and array.dtype.kind not in "US":
        msg = f"{key} must be names, but it holds entries of type {array.dtype}. Give text (in MATLAB a cellstr)."
        raise _refused(msg)
    texts = array.reshape(-1).tolist()
    return [text.decode() if isinstance(text, bytes) else str(text) for text in texts]


def _single_text(content: Content) -> str | None:
    texts = _texts(content, "name") or [""]
    if len(texts) > 1:
        msg = f"name must be one text, but it has {len(texts)}."
        raise _refused(msg)
    return texts[0] or None


def _system(content: Content) -> control.StateSpace:
    shapes = [np.shape(content[letter]) for letter in SYSTEM_LETTERS]
    n, m, p = ([*shape, 0, 0][axis] for shape, axis in ((shapes[0], 0), (shapes[3], 1), (shapes[3], 0)))
    expected = ((n, n), (n, m), (p, n), (p, m))
    matrices = [checked_matrix(content[key], key, size) for key, size in zip(SYSTEM_LETTERS, expected, strict=True)]
    labels: dict[str, Any] = {}
    for key, count in zip(SYSTEM_NAMES, (n, m, p), strict=True):
        texts = _texts(content, key)
        if texts is not None:
            labels[key] = list(checked_names(texts, count, key))
    if "dt" in content:
        period = float(np.asarray(content["dt"]).item())
        labels["dt"] = True if period == UNKNOWN_PERIOD else period
    name = _single_text(content)
    return control.StateSpace(*matrices, **labels, **({} if name is None else {"name": name}))
