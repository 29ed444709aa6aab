"""Models, state spaces, gains and responses in files, whole or not at all.

| what | endings | content |
|---|---|---|
| model | .npz, .mat | M, C, K, B, F, G, H, D (Bv, Ba, Dv, Da, prescribed if there), dofs, inputs, outputs, name |
| model, read only | .mtx, .matrix, .op4, .pch, ... | what finite-element programs write, see `import_model` |
| state space | .npz, .mat | A, B, C, D, states, inputs, outputs, name, dt (-1: sampled with unknown period) |
| gain | .npz, .mat, .csv | K, inputs, states |
| response | .csv | one row a frequency or time, see `save_response` |

Files are read with ``allow_pickle=False`` and nothing in them is executed. They are written to a temporary
name beside the target, which takes the target's place when it is complete.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from halfdof_ctrl.base.arrays import is_zero
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import checked_names, listed
from halfdof_ctrl.files.containers import MATRIX_ENDINGS, PathLike, load_variables, single_text, texts
from halfdof_ctrl.files.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.files.formats.raw_matrix import Triangle
from halfdof_ctrl.files.import_model import container_report, filled, import_model, import_report
from halfdof_ctrl.files.import_report import ImportReport
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.files.writing import save_matrices
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import LETTERS, SecondOrderModel

Paths: TypeAlias = PathLike | Sequence[PathLike] | Mapping[str, PathLike]
OPTIONAL_LETTERS = ("Bv", "Ba", "Dv", "Da")  #: written only where they are not zero
MODEL_NAMES = ("dofs", "inputs", "outputs")


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
    save_matrices(path, content, names | ({"prescribed": model.prescribed} if model.prescribed else {}), model.name)


def load_model(
    path: Paths,
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str] | None = None,
) -> SecondOrderModel:
    """Read a model from a file, or from the files that a finite-element program wrote.

    Parameters
    ----------
    path : path-like, sequence of path-like, or mapping from letter to path-like
        An ``.npz`` or MATLAB ``.mat`` file with K, and any of M, C, B, F, G, H, D, Bv, Ba, Dv, Da (full or
        sparse), ``dofs``, ``inputs``, ``outputs``, ``prescribed`` (text arrays; in ``.mat`` cell or char arrays)
        and ``name``. What is missing is as in `mechss`; other variables are not looked at. Version 7.3 needs the
        extra ``hdf5``.

        Or files of Matrix Market, Abaqus, ANSYS or Nastran: a folder that holds one model; one file, to which
        those of the same name for M, C, K are found; a list of files; or ``{"K": path, "M": path, ...}`` where names
        do not say what is what. S stands for structural damping, the imaginary part of K.
    triangle : {"lower", "upper"}, optional
        Says that matrices of which only this triangle is stored are symmetric. Not needed where the format says so.
    remove_fixed : bool
        Takes out DOFs whose stiffness is 1e35 or more, by which Abaqus writes boundary conditions.
    matrices : mapping from letter to str, optional
        Names of the matrices to take from files that hold several, ``{"K": "kaa", "M": "maa"}``.

    Returns
    -------
    SecondOrderModel
        Its DOFs are named by node and component (``n101_u1``) where the files have labels.

    Raises
    ------
    FileFormatError
        An unknown format, damaged, of another kind, with objects or text for numbers, no stiffness, matrices that do
        not fit together, or a model that `mechss` refuses; the message starts with the file, the cause is the refusal.
    MissingExtraError
        A MATLAB 7.3 file where h5py is not installed.
    OSError
        A file is not there or cannot be read.

    Warns
    -----
    ImportedModelWarning
        What a finite-element program wrote is probably not what was meant: a triangle is missing, boundary conditions
        are huge springs, DOFs have mass and no stiffness, there is no file with damping beside the one that was given.

    See Also
    --------
    inspect_files : what is in the files, as a table
    """
    if not _is_container(path):
        return import_model(_as_paths(path), triangle=triangle, remove_fixed=remove_fixed, matrices=matrices)
    path = _single(path)
    content = load_variables(path, (*LETTERS, *MODEL_NAMES, "prescribed", "name"))
    if "K" not in content:
        found = f"it has {listed(sorted(content))}" if content else "it has none of a model's letters"
        msg = f"{path}: no stiffness K in the file ({found}). A model file holds M, C and K, capital letters."
        raise FileFormatError(msg, path=str(path))
    with naming_the_file(path):
        values: dict[str, Any] = {letter: content.get(letter) for letter in LETTERS}
        values |= {letter: filled(letter, values[letter], triangle) for letter in "MCK"}
        names: dict[str, Any] = {key: texts(content, key) for key in MODEL_NAMES}
        prescribed = texts(content, "prescribed")
        if not prescribed:
            return mechss(**values, **names, name=single_text(content))
        return _with_prescribed(mechss(**values, dofs=names["dofs"], name=single_text(content)), names, prescribed)


def _with_prescribed(model: SecondOrderModel, names: Mapping[str, Any], prescribed: Sequence[str]) -> SecondOrderModel:
    """Name the signals of a model in which the force on a DOF or its motion may be a direct term."""
    signals: dict[str, Any] = {
        key: getattr(model, key) if names[key] is None else checked_names(names[key], len(getattr(model, key)), key)
        for key in ("inputs", "outputs")
    }
    return replace(model, **signals, prescribed=checked_names(prescribed, len(prescribed), "prescribed DOFs"))


def inspect_files(
    path: Paths,
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str] | None = None,
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
    if _is_container(path):
        return container_report(Path(_single(path)), triangle=triangle, largest=largest)
    return import_report(
        _as_paths(path), triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=largest
    )


def _is_container(path: Paths) -> bool:
    """Return whether it is one file that names its matrices."""
    one = path if isinstance(path, str | os.PathLike) else next(iter(path)) if len(path) == 1 else None
    return isinstance(one, str | os.PathLike) and Path(one).suffix.lower() in MATRIX_ENDINGS


def _single(path: Paths) -> PathLike:
    return path if isinstance(path, str | os.PathLike) else next(iter(path))


def _as_paths(path: Paths) -> list[Path] | dict[str, Path]:
    if isinstance(path, str | os.PathLike):
        return [Path(path)]
    if isinstance(path, Mapping):
        return {letter: Path(one) for letter, one in path.items()}
    if not path:
        msg = "No file is given. Give at least the stiffness."
        raise FileFormatError(msg, path="")
    return [Path(one) for one in path]
