"""Matrices of a model from the files of finite-element programs, put on one list of DOFs and looked at.

The matrices are put on the union of all labels, in the order of the stiffness (of the mass if there is none); what only
other matrices have follows. What the files do not say is told in the report, not guessed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, Triangle, storage, with_triangle
from halfdof_ctrl.files.import_report import (
    PENALTY,
    ImportReport,
    MatrixReport,
    has_entries,
    mass_per_direction,
    matrix_report,
)
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.files.sources import SIGNALS, Source, Sources, find_sources

REQUIRED = ("M", "C", "K")
ORDER = ("K", "M", "C", "S")  #: whose DOFs come first
Matrices = dict[str, csc_array]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ImportedModel:
    """The matrices of a model on one list of n DOFs, and what was found about them."""

    M: csc_array | None  #: (n, n) float64; None if no file holds it
    C: csc_array | None  #: (n, n) float64
    K: csc_array | None  #: (n, n) float64; complex128 with structural damping
    signals: Mapping[str, csc_array]  #: B, F, G, H, if there are files of that name
    dofs: tuple[str, ...] | None  #: names of the DOFs, None if the files have no labels
    report: ImportReport


def read_matrices(
    given: Sequence[Path] | Mapping[str, Path],
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str] | None = None,
    largest: int = LARGEST_COMPONENT,
) -> ImportedModel:
    """Read the matrices of a model.

    Parameters
    ----------
    given : sequence of Path or mapping from letter to Path
        A single folder; a single file, whose siblings are looked for; several files; or a file for each of M, C, K, S.
    triangle : {"lower", "upper"}, optional
        Complete matrices of which only this triangle is stored and whose file does not say that they are symmetric.
    remove_fixed : bool
        Take out DOFs whose stiffness is 1e35 or more.
    matrices : mapping from letter to str, optional
        Names of the matrices to take from files that hold several (Nastran).
    largest : int
        Connected parts of a matrix with more DOFs are not factorized for rank and definiteness.

    Returns
    -------
    ImportedModel

    Raises
    ------
    FileFormatError
        A file is of no known kind or damaged; two matrices for one letter; sizes or labels that do not fit together.
    OSError
        A file is not there or cannot be read.
    """
    found = find_sources(given, matrices or {})
    raws = {letter: _completed(source, triangle) for letter, source in found.matrices.items()}
    square, dofs, notes = _aligned(found, raws)
    names = dofs or tuple([f"q{index}" for index in range(next(iter(square.values())).shape[0])])
    signals = _signals(found, len(names))
    penalized = _penalized(square.get("K"))
    held = tuple([names[index] for index in np.flatnonzero(penalized).tolist()])
    if remove_fixed and held:
        kept = np.flatnonzero(~penalized)
        square = {letter: csc_array(csc_array(part[:, kept])[kept]) for letter, part in square.items()}
        signals = {key: csc_array(part[kept] if key == "B" else part[:, kept]) for key, part in signals.items()}
        names = dofs = tuple([names[index] for index in kept.tolist()])
    looks = tuple(
        [_looked_at(found.matrices[letter], letter, raws[letter], square[letter], largest) for letter in square]
    )
    report = _report(
        looks,
        square,
        names,
        files=tuple([path.name for path in found.files]),
        labelled=dofs is not None,
        unused=tuple([source.words for source in found.unused if source.path.stem not in signals]),
        penalized=held,
        removed=held if remove_fixed else (),
        notes=notes,
    )
    return ImportedModel(
        M=square.get("M"), C=square.get("C"), K=_stiffness(square), signals=signals, dofs=dofs, report=report
    )


def report_on(
    square: Matrices, names: Sequence[str], path: Path, *, labelled: bool, largest: int = LARGEST_COMPONENT
) -> ImportReport:
    """Look at matrices of one size from a file that says which is which, as .npz and .mat do."""
    looks = []
    for letter, matrix in square.items():
        raw = RawMatrix(
            matrix=matrix, format=path.suffix[1:], declared="unsaid", stored=storage(matrix), completed=False
        )
        looks.append(_looked_at(Source(path, letter, raw), letter, raw, matrix, largest))
    held = [names[index] for index in np.flatnonzero(_penalized(square.get("K"))).tolist()]
    return _report(tuple(looks), square, names, files=(path.name,), labelled=labelled, penalized=tuple(held))


def _completed(source: Source, triangle: Triangle | None) -> RawMatrix:
    raw = source.raw
    if raw.matrix.shape[0] != raw.matrix.shape[1]:
        size = f"{raw.matrix.shape[0]} x {raw.matrix.shape[1]}"
        msg = f"{source.path}: {source.words} is {size}, but the matrices of a model must be square."
        raise FileFormatError(msg, path=str(source.path))
    if triangle is None:
        return raw
    with naming_the_file(source.path):
        return with_triangle(raw, triangle)


def _aligned(found: Sources, raws: Mapping[str, RawMatrix]) -> tuple[Matrices, tuple[str, ...] | None, list[str]]:
    """Put the matrices on one list of DOFs."""
    names = {letter: _names_of(found, letter, raw) for letter, raw in raws.items()}
    order = [letter for letter in ORDER if letter in raws]
    labelled = [letter for letter in order if names[letter] is not None]
    union: dict[str, int] = {}
    for letter in labelled:
        for name in names[letter] or ():
            union.setdefault(name, len(union))
    n = len(union) or raws[order[0]].matrix.shape[0]
    square: Matrices = {}
    notes = []
    for letter in order:
        matrix, own = raws[letter].matrix, names[letter]
        if own is None:
            if matrix.shape[0] != n:
                raise _sizes_differ(found, raws)
            if labelled:
                notes.append(f"{letter} has no labels; its rows are taken in the order of {labelled[0]}")
            square[letter] = matrix
        elif own == tuple(union):
            square[letter] = matrix
        else:
            square[letter] = _moved(matrix, np.array([union[name] for name in own]), n)
    notes += _differences(names, labelled)
    return {letter: square[letter] for letter in ("M", "C", "K", "S") if letter in square}, tuple(union) or None, notes


def _names_of(found: Sources, letter: str, raw: RawMatrix) -> tuple[str, ...] | None:
    """Return the names of a matrix's rows: its own, those of the label file beside it, or of the only one that fits."""
    if raw.dofs is not None:
        return raw.dofs
    path, n = found.matrices[letter].path, raw.matrix.shape[0]
    own = [names for file, names in found.labels.items() if file.stem.lower() == path.stem.lower()]
    fitting = own or list({names for names in found.labels.values() if len(names) == n})
    if len(fitting) != 1:
        return None
    if len(fitting[0]) != n:
        file = next(file for file, names in found.labels.items() if names is fitting[0])
        msg = f"{path}: {n} rows, but {file.name} names {len(fitting[0])}. Write both from the same run."
        raise FileFormatError(msg, path=str(path))
    if len(set(fitting[0])) != n:
        msg = f"{path}: the names of its rows are not all different. The file with the names is damaged."
        raise FileFormatError(msg, path=str(path))
    return fitting[0]


def _sizes_differ(found: Sources, raws: Mapping[str, RawMatrix]) -> FileFormatError:
    path = next(iter(found.matrices.values())).path
    sizes = listed([f"{letter} {raw.matrix.shape[0]} x {raw.matrix.shape[1]}" for letter, raw in raws.items()])
    msg = f"{path}: the matrices differ in size ({sizes}), and there are no labels for all. Write them from one run."
    return FileFormatError(msg, path=str(path))


def _differences(names: Mapping[str, tuple[str, ...] | None], labelled: Sequence[str]) -> list[str]:
    """Return which DOFs only some of the matrices have."""
    notes = []
    for letter in labelled[1:]:
        extra = [name for name in names[letter] or () if name not in set(names[labelled[0]] or ())]
        if extra:
            notes.append(f"{len(extra)} DOFs are in {letter} but not in {labelled[0]} ({listed(extra)})")
        count = len(set(names[labelled[0]] or ()) - set(names[letter] or ()))
        if count:
            notes.append(f"{count} DOFs are in {labelled[0]} but not in {letter}")
    return notes


def _moved(matrix: csc_array, places: npt.NDArray[Any], n: int) -> csc_array:
    entries = matrix.tocoo()
    return csc_array(coo_array((entries.data, (places[entries.row], places[entries.col])), shape=(n, n)))


def _signals(found: Sources, n: int) -> Matrices:
    """Find the matrices B, F, G, H by the names of their files."""
    signals = {}
    for source in found.unused:
        letter = source.path.stem
        if letter in SIGNALS and source.letter is None:
            matrix = source.raw.matrix
            if matrix.shape[0 if letter == "B" else 1] != n:
                size = f"{matrix.shape[0]} x {matrix.shape[1]}"
                msg = f"{source.path}: {letter} is {size}, which does not fit {n} DOFs."
                raise FileFormatError(msg, path=str(source.path))
            signals[letter] = matrix
    return signals


def _penalized(stiffness: csc_array | None) -> npt.NDArray[np.bool_]:
    return np.zeros(0, dtype=bool) if stiffness is None else np.abs(stiffness.diagonal()) >= PENALTY


def _stiffness(square: Matrices) -> csc_array | None:
    if "S" not in square:
        return square.get("K")
    damping = square["S"] * 1j
    return csc_array(square["K"] + damping if "K" in square else damping)


def _looked_at(source: Source, letter: str, raw: RawMatrix, matrix: csc_array, largest: int) -> MatrixReport:
    return matrix_report(
        letter,
        source.words,
        matrix,
        largest,
        format=raw.format,
        stored=raw.stored,
        completed=raw.completed,
        half_stored=replace(raw, matrix=matrix).is_half_stored,
        notes=raw.notes,
        doubts=raw.doubts,
    )


def _report(
    looks: tuple[MatrixReport, ...],
    square: Matrices,
    names: Sequence[str],
    *,
    files: tuple[str, ...],
    labelled: bool,
    unused: tuple[str, ...] = (),
    penalized: tuple[str, ...] = (),
    removed: tuple[str, ...] = (),
    notes: Sequence[str] = (),
) -> ImportReport:
    used = {letter: has_entries(matrix) for letter, matrix in square.items()}
    nothing = np.zeros(len(names), dtype=bool)
    mass, damping, stiffness = (used.get(letter, nothing) for letter in REQUIRED)
    held = stiffness | used.get("S", nothing)

    def named(which: npt.NDArray[np.bool_]) -> tuple[str, ...]:
        return tuple([names[index] for index in np.flatnonzero(which).tolist()])

    return ImportReport(
        files=files,
        matrices=looks,
        n_dofs=len(names),
        labelled=labelled,
        missing=tuple([letter for letter in REQUIRED if letter not in square]),
        unused=unused,
        n_inertial=int(mass.sum()),
        n_half=int((damping & ~mass).sum()),
        n_static=int((~damping & ~mass).sum()),
        mass=mass_per_direction(square.get("M"), names),
        unsupported=named((mass | damping) & ~held) if "K" in square else (),
        empty=named(~(mass | damping | held)) if "K" in square else (),
        penalized=penalized,
        removed=removed,
        notes=tuple(notes),
    )
