"""Models, state spaces, gains and responses in files, whole or not at all.

| what | endings | content |
|---|---|---|
| model | .npz, .mat | M, C, K, B, F, G, H, D (and Bv, ..., prescribed, known_to), dofs, inputs, outputs, name |
| model, read only | .mtx, .matrix, .op4, .pch, .sti, .npy, .csv, ... | what programs write, see `import_model` |
| state space | .npz, .mat | A, B, C, D, states, inputs, outputs, name, dt (-1: sampled with unknown period) |
| gain | .npz, .mat, .csv | K, inputs, states |
| response | .csv | one row a frequency or time, see `save_response` |

Files are read with ``allow_pickle=False`` and nothing in them is executed. They are written to a temporary
name beside the target, which takes the target's place when it is complete.
"""

import csv
import io
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import control
import numpy as np
import scipy.io
from scipy.sparse import issparse

from halfdof_ctrl.base.arrays import checked_matrix, is_zero
from halfdof_ctrl.base.errors import FileFormatError, naming_the_file
from halfdof_ctrl.base.names import checked_names, listed
from halfdof_ctrl.design.lqr import StateFeedback
from halfdof_ctrl.files.containers import (
    MATRIX_ENDINGS,
    Content,
    PathLike,
    ending,
    load_variables,
    single_text,
    sparse_parts,
    texts,
)
from halfdof_ctrl.files.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.files.formats.raw_matrix import Triangle
from halfdof_ctrl.files.import_model import Paths, import_model, import_report
from halfdof_ctrl.files.import_report import ImportReport
from halfdof_ctrl.files.tables import frequency_table, time_table
from halfdof_ctrl.model.second_order import EPS, LETTERS, SecondOrderModel

TABLE_ENDINGS = (".csv",)
GAIN_ENDINGS = (*MATRIX_ENDINGS, *TABLE_ENDINGS)
OPTIONAL_LETTERS = ("Bv", "Ba", "Dv", "Da")  #: written only where they are not zero
MODEL_NAMES = ("dofs", "inputs", "outputs")
SYSTEM_LETTERS = ("A", "B", "C", "D")
SYSTEM_NAMES = ("states", "inputs", "outputs")
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
    if model.known_to > EPS:
        content = {"known_to": np.array(model.known_to), **content}
    names = {key: getattr(model, key) for key in MODEL_NAMES}
    _save_matrices(path, content, names | ({"prescribed": model.prescribed} if model.prescribed else {}), model.name)


def load_model(
    path: Paths,
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str | None] | None = None,
) -> SecondOrderModel:
    """Read a model from a file, or from the files that a finite-element program wrote.

    Parameters
    ----------
    path : path-like, sequence of path-like, or mapping from letter to path-like
        An ``.npz`` or MATLAB ``.mat`` file (version 4, 5, or 7.3 with the extra ``hdf5``) with K, and any of M, C, B,
        F, G, H, D, Bv, Ba, Dv, Da (full or sparse), ``dofs``, ``inputs``, ``outputs``, ``prescribed`` (text arrays; in
        ``.mat`` cell or char arrays) and ``name``. What is missing is as in `mechss`.

        Or files of Matrix Market, Abaqus, ANSYS, CalculiX or Nastran, ``.npy`` arrays, or dense text (OpenSees,
        ``numpy.savetxt``, csv): a folder that holds one model; one file, to which those whose names differ in the word
        for the matrix are found; a list of files; or ``{"K": path, "M": path, ...}`` where names do not say what is
        what. S stands for structural damping, the imaginary part of K.
    triangle : {"lower", "upper"}, optional
        Says that matrices of which only this triangle is stored are symmetric. Not needed where the format says so.
    remove_fixed : bool
        Takes out DOFs whose stiffness is 1e35 or more, by which Abaqus writes boundary conditions.
    matrices : mapping from letter to str or None, optional
        Names of the matrices to take from files that hold several, ``{"K": "kaa", "C": "D", "M": "sys.M"}``; the
        second of two of one name is ``"kaa#2"``. None: that there is no such matrix.

    Returns
    -------
    SecondOrderModel
        Its DOFs are named by node and component (``n101_u1``) where the files have labels; ``known_to`` is the
        rounding of its entries by the digits of the files.

    Raises
    ------
    FileFormatError
        An unknown format, damaged, of another kind, with objects or text for numbers, no stiffness, matrices that do
        not fit together, or a model that `mechss` refuses; the message starts with the file, the cause is the refusal.
    MissingExtraError
        A MATLAB 7.3 file where h5py is not installed.
    OSError
        A file is not there or cannot be read.
    ParameterError
        Options or paths of another kind.

    Warns
    -----
    ImportedModelWarning
        What the files hold is probably not what was meant: a triangle is missing, boundary conditions
        are huge springs, DOFs have mass and no stiffness, there is no mass or damping, or a matrix as large as the
        stiffness is not used.

    See Also
    --------
    inspect_files : what is in the files, as a table
    """
    return import_model(path, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices)


def inspect_files(
    path: Paths,
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str | None] | None = None,
    largest: int = LARGEST_COMPONENT,
) -> ImportReport:
    """Look at what `load_model` would read: sizes, symmetry, rank, mass per direction, kinds of DOFs.

    Parameters
    ----------
    path, triangle, remove_fixed, matrices
        As in `load_model`.
    largest : int
        Connected parts of a matrix with more DOFs than this are not factorized, and their rank stays unknown.

    Returns
    -------
    ImportReport
        Prints as a small table.

    Raises
    ------
    FileFormatError, OSError
        As in `load_model`; a missing stiffness is told in the report.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_model(hydromount(), f"{folder}/mount.npz")
    ...     inspect_files(f"{folder}/mount.npz").matrices[0].rank
    'positive semidefinite, rank 1'
    """
    return import_report(path, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=largest)


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
    content = load_variables(path, (*SYSTEM_LETTERS, *SYSTEM_NAMES, "name", "dt"))
    missing = [letter for letter in SYSTEM_LETTERS if letter not in content]
    if missing:
        msg = f"{path}: {listed(missing)} not in the file. A state space file holds A, B, C and D."
        raise FileFormatError(msg, path=str(path))
    with naming_the_file(path):
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
    header, columns = time_table(data) if isinstance(data, control.TimeResponseData) else frequency_table(data)
    _save_table(path, header, (map(repr, row) for row in np.column_stack(columns).tolist()))


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
    for text in (*(text for group in names.values() for text in group), name or ""):
        if any(ord(letter) < ord(" ") or "\ud800" <= letter <= "\udfff" for letter in text):
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
            scipy.io.savemat(stream, {**title, **cells, **content})  # type: ignore[arg-type]  # stubs know paths only


def _save_table(path: PathLike, header: Sequence[str], rows: Iterable[Iterable[str]]) -> None:
    with replacing(path) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
        text.detach()


def _system(content: Content) -> control.StateSpace:
    shapes = [np.shape(content[letter]) for letter in SYSTEM_LETTERS]
    n, m, p = ([*shape, 0, 0][axis] for shape, axis in ((shapes[0], 0), (shapes[3], 1), (shapes[3], 0)))
    expected = ((n, n), (n, m), (p, n), (p, m))
    matrices = [checked_matrix(content[key], key, size) for key, size in zip(SYSTEM_LETTERS, expected, strict=True)]
    labels: dict[str, Any] = {}
    for key, count in zip(SYSTEM_NAMES, (n, m, p), strict=True):
        found = texts(content, key)
        if found is not None:
            labels[key] = list(checked_names(found, count, key))
    if "dt" in content:
        period = float(np.asarray(content["dt"]).item())
        labels["dt"] = True if period == UNKNOWN_PERIOD else period
    name = single_text(content)
    return control.StateSpace(*matrices, **labels, **({} if name is None else {"name": name}))
