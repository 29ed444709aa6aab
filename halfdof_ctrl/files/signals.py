"""B, F, G, H and D from files: on the model's list of DOFs, and never taken for something that they may not be.

Half of the literature calls damping D or E, rotordynamics has G, Nastran B: a matrix of that name that is as large as
the stiffness is not taken for a direct term, an output or an input in silence. A load vector F is a column of B.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array, issparse

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, Storage
from halfdof_ctrl.files.sources import Source, Sources

OUTPUTS, INPUTS = "FGH", "B"
MEANING = {
    "B": "the forces of inputs",
    "F": "the displacements in outputs",
    "G": "the velocities in outputs",
    "H": "the accelerations in outputs",
    "D": "a direct term from inputs to outputs",
}
ONE_SIDED: tuple[Storage, ...] = ("lower", "upper")


def require_clear_letters(
    found: Sources, n: int, said: Mapping[str, str | None], given: Sequence[Path] | Mapping[str, Path]
) -> None:
    """Refuse a matrix called D, G, H or B that may be damping: as large as the stiffness, in a file without C.

    Raises
    ------
    FileFormatError
        With both readings.
    """
    told = (*said, *(given if isinstance(given, Mapping) else ()))
    if found.own_layout or n == 1:
        return
    for letter, source in found.signals.items():
        matrix = source.raw.matrix
        if letter not in MEANING or letter in told or matrix.shape != (n, n) or not matrix.nnz:
            continue
        damping_is_said = "C" in found.matrices or said.get("C", "") is None
        other = _other_reading(letter, matrix, found) if damping_is_said else "the damping"
        if not other:
            continue
        name = repr(source.raw.title if source.raw.named else source.path.name)
        as_damping, as_signal = f"{{'C': {name}}}", f"{{{letter!r}: {name}}}"
        if source.raw.named:
            as_damping, as_signal = f"matrices={as_damping}", f"matrices={as_signal}"
        choices = f"{as_signal} for the other, or matrices={{{letter!r}: None}} to leave it out"
        msg = (
            f"{source.path}: {letter} in {source.path.name} is {n} x {n}, as large as the stiffness, and could be "
            f"{other} or {MEANING[letter]}. Say {as_damping} for damping, {choices}."
        )
        raise FileFormatError(msg, path=str(source.path))


def _other_reading(letter: str, matrix: csc_array, found: Sources) -> str:
    """Tell what a matrix beside M, C and K may be in their equations, nothing if its letter is clear."""
    if letter == "G" and _is_skew(matrix):
        return "gyroscopic forces (add it to C)"
    has_signals = {"B", "F", "G", "H"} & set(found.signals) or {"inputs", "outputs"} & set(found.texts)
    return "" if letter != "D" or has_signals else "another matrix of the equations"


def aligned_signals(found: Sources, names: Sequence[str], *, labelled: bool) -> tuple[dict[str, Any], list[str]]:
    """Return the signals on the model's DOFs, and what was done to them.

    Raises
    ------
    FileFormatError
        A matrix that does not fit the DOFs.
    """
    n = len(names)
    places = {name: index for index, name in enumerate(names)} if labelled and found.signals else {}
    signals: dict[str, Any] = {}
    notes: list[str] = []
    for letter, source in found.signals.items():
        raw, key = source.raw, letter
        if letter == "F" and _is_load(raw, n):
            if "B" in found.signals:
                notes.append(f"F ({source.words}) is a column for {n} DOFs, no row; it is left out, since there is a B")
                continue
            key = "B"
            notes.append(f"F ({source.words}) is a column of {n} forces and is taken for the load B")
        if letter[0] in "BFGH":
            signals[key] = _on_dofs(key, raw, n, places, source.words, str(source.path))
        else:
            signals[key] = raw.matrix if raw.dense is None else raw.dense
    return signals, notes


def taken_signals(found: Sources, signals: Mapping[str, Any]) -> dict[str, Source]:
    """Return where each signal comes from: a load called F is B."""
    load = {"B": found.signals["F"]} if "B" in signals and "B" not in found.signals else {}
    return load | {letter: source for letter, source in found.signals.items() if letter in signals}


def without_dofs(letter: str, part: Any, kept: npt.NDArray[Any]) -> Any:  # noqa: ANN401  # dense or sparse
    """Take rows of B or columns of F, G, H; a direct term stays."""
    if letter[0] == INPUTS:
        return part[kept]
    if letter[0] not in OUTPUTS:
        return part
    return part[kept] if np.ndim(part) == 1 else part[:, kept]


def _is_load(raw: RawMatrix, n: int) -> bool:
    shape = raw.matrix.shape if raw.dense is None else np.shape(raw.dense)
    return n > 1 and shape == (n, 1)


def _is_skew(matrix: csc_array) -> bool:
    total = abs(matrix + matrix.T)
    return matrix.nnz > 0 and float(total.max()) <= 1e-9 * float(abs(matrix).max())


def _on_dofs(letter: str, raw: RawMatrix, n: int, places: Mapping[str, int], words: str, path: str) -> Any:  # noqa: ANN401  # dense or sparse
    axis = 0 if letter[0] == INPUTS else 1
    matrix = raw.matrix
    if raw.dofs is not None and places and (unknown := [name for name in raw.dofs if name not in places]):
        msg = f"{path}: {words} acts on {unknown[0]}, which is no DOF of the matrices. Write all from one model."
        raise FileFormatError(msg, path=path)
    if raw.dofs is not None and places and matrix.shape[axis] == len(raw.dofs):
        entries = matrix.tocoo()
        moved = np.array([places[name] for name in raw.dofs])
        where = (moved[entries.row], entries.col) if axis == 0 else (entries.row, moved[entries.col])
        shape = (n, matrix.shape[1]) if axis == 0 else (matrix.shape[0], n)
        return csc_array(coo_array((entries.data, where), shape=shape))
    if matrix.shape[axis] != n and not (raw.dense is not None and raw.dense.ndim == 1 and raw.dense.size == n):
        size = f"{matrix.shape[0]} x {matrix.shape[1]}"
        also = (
            f" If it holds forces, say matrices={{'B': {letter!r}}}."
            if letter != INPUTS and matrix.shape[0] == n
            else ""
        )
        msg = (
            f"{path}: {letter} is {size}, which does not fit {n} DOFs.{also} If it is something else, leave it out by "
            f"matrices={{{letter!r}: None}}."
        )
        raise FileFormatError(msg, path=path)
    return raw.dense if raw.dense is not None and not issparse(raw.dense) else matrix
