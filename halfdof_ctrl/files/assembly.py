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
from scipy.sparse import coo_array, csc_array, issparse

from halfdof_ctrl.base.arrays import EPS, Matrix
from halfdof_ctrl.base.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, Triangle, with_triangle
from halfdof_ctrl.files.import_report import (
    PENALTY,
    ImportReport,
    MatrixReport,
    copies,
    has_entries,
    mass_per_direction,
    matrix_report,
)
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.files.signals import aligned_signals, require_clear_letters, taken_signals, without_dofs
from halfdof_ctrl.files.sources import Source, Sources, find_sources

REQUIRED = ("M", "C", "K")
ORDER = ("K", "M", "C", "S")  #: whose DOFs come first
Matrices = dict[str, csc_array]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ImportedModel:
    """The matrices of a model on one list of n DOFs, and what was found about them."""

    M: Matrix | None  #: (n, n) float64, dense where the file holds it so; None if no file holds it
    C: Matrix | None  #: (n, n) float64
    K: Matrix | None  #: (n, n) float64; complex128 with structural damping
    signals: Mapping[str, Any]  #: B, F, G, H, D and their kin, if there are some
    dofs: tuple[str, ...] | None  #: names of the DOFs, None if the files have no labels
    report: ImportReport
    texts: Mapping[str, Any]  #: names of signals and of the model, as the file has them
    known_to: float  #: relative rounding of the entries by the digits of the files
    own_layout: bool  #: whether it is one file with all that save_model writes
    holds: str  #: what is in files with named variables besides, for a refusal


def read_matrices(
    given: Sequence[Path] | Mapping[str, Path],
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str | None] | None = None,
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
    raws = {letter: _completed(letter, source, triangle) for letter, source in found.matrices.items()}
    raws = _compared(found, raws)
    square, dofs, notes = _aligned(found, raws)
    names = dofs or tuple([f"q{index}" for index in range(next(iter(square.values())).shape[0])])
    require_clear_letters(found, len(names), matrices or {}, given)
    signals, signal_notes = aligned_signals(found, names, labelled=dofs is not None)
    penalized = _penalized(square.get("K"))
    held = tuple([names[index] for index in np.flatnonzero(penalized).tolist()])
    values: dict[str, Any] = {letter: _as_stored(raws[letter], matrix) for letter, matrix in square.items()}
    if remove_fixed and held:
        kept = np.flatnonzero(~penalized)
        values = {letter: part[:, kept][kept] for letter, part in values.items()}
        square = {letter: csc_array(csc_array(part[:, kept])[kept]) for letter, part in square.items()}
        signals = {key: without_dofs(key, part, kept) for key, part in signals.items()}
        names = dofs = tuple([names[index] for index in kept.tolist()])
    rounding = max([raw.known_to for raw in raws.values()], default=EPS)
    looks = [_looked_at(found.matrices[key], key, raws[key], square[key], largest) for key in square]
    report = _report(
        tuple(looks),
        square,
        names,
        files=tuple([path.name for path in found.files]),
        labelled=dofs is not None,
        signals=tuple([_origin(letter, source) for letter, source in taken_signals(found, signals).items()]),
        doubts=(*found.doubts, *copies(square)),
        unused=_unused(found, signals),
        similar=_similar(found, raws, [letter for letter, name in (matrices or {}).items() if name is None]),
        known_to=rounding,
        penalized=held,
        removed=held if remove_fixed else (),
        notes=[*notes, *signal_notes],
    )
    return ImportedModel(
        M=values.get("M"),
        C=values.get("C"),
        K=_stiffness(values),
        signals=signals,
        dofs=dofs,
        report=report,
        texts=found.texts,
        known_to=rounding,
        own_layout=found.own_layout,
        holds="" if "K" in square or "S" in square else found.holds,
    )


def _origin(letter: str, source: Source) -> str:
    """Tell where a signal comes from, with its name if it is called otherwise."""
    also = f": {source.name}" if source.raw.named and source.name == source.letter != letter else ""
    return f"{letter} from {source.words}{also}"


def _as_stored(raw: RawMatrix, matrix: csc_array) -> Matrix:
    """Return a matrix dense where its file holds it so: as it is there, or as it was completed."""
    if raw.dense is None:
        return matrix
    unchanged = raw.matrix is matrix and not raw.completed
    return raw.dense if unchanged else matrix.toarray()


def _unused(found: Sources, signals: Mapping[str, Any]) -> tuple[str, ...]:
    """List what is in the files and not in the model, with its size."""
    taken = [id(source) for source in taken_signals(found, signals).values()]
    sources = [*found.unused, *(source for source in found.signals.values() if id(source) not in taken)]
    shown = [f"{source.words} ({' x '.join(map(str, source.raw.matrix.shape))})" for source in sources]
    return (*shown, *[f"{path.name}: {part.words}" for path, parts in found.left.items() for part in parts])


def _similar(found: Sources, raws: Mapping[str, RawMatrix], declined: Sequence[str]) -> tuple[str, ...]:
    """Find matrices as large as the stiffness that are not used, in files whose variables have free names."""
    size = raws[next(letter for letter in ORDER if letter in raws)].matrix.shape
    names = [
        f"{source.words} ({size[0]} x {size[1]})"
        for source in found.unused
        if source.raw.matrix.shape == size
        and not source.raw.format.startswith("Nastran")
        and (source.letter or source.raw.title) not in declined
    ]
    parts = [(path, part) for path, variables in found.left.items() for part in variables]
    names += [
        f"{path.name}: {part.words}"
        for path, part in parts
        if part.is_matrix and part.shape == size and part.name not in declined
    ]
    return tuple(names) if size[0] > 1 else ()


def _completed(letter: str, source: Source, triangle: Triangle | None) -> RawMatrix:
    raw = source.raw
    if raw.matrix.shape[0] != raw.matrix.shape[1]:
        size = f"{raw.matrix.shape[0]} x {raw.matrix.shape[1]}"
        what = source.raw.title if source.raw.named else source.path.name
        msg = (
            f"{source.path}: {what} is {size}, but the matrices of a model must be square. If it is something else, "
            f"name the right one: matrices={{{letter!r}: name}}, or {{{letter!r}: path}}."
        )
        raise FileFormatError(msg, path=str(source.path))
    if triangle is None:
        return raw
    with naming_the_file(source.path):
        return with_triangle(raw, triangle)


def _aligned(found: Sources, raws: Mapping[str, RawMatrix]) -> tuple[Matrices, tuple[str, ...] | None, list[str]]:
    """Put the matrices on one list of DOFs."""
    longest = max([raw.matrix.shape[0] for raw in raws.values()])
    names = {letter: _names_of(found, letter, raw, longest) for letter, raw in raws.items()}
    order = [letter for letter in ORDER if letter in raws]
    labelled = [letter for letter in order if names[letter] is not None]
    every = _union([names[letter] or () for letter in labelled])
    open_sizes = [raw.matrix.shape[0] for letter, raw in raws.items() if names[letter] is None]
    n = len(every) or max(open_sizes)
    square: Matrices = {}
    notes = _require_one_count(found, raws, names)
    union: dict[str, int] = {}
    for letter in order:
        matrix, own = raws[letter].matrix, names[letter]
        if own is None:
            if matrix.shape[0] > n or (matrix.shape[0] < n and not raws[letter].open_size):
                raise _sizes_differ(found, raws)
            if labelled:
                notes.append(f"{letter} has no labels; its rows are taken in the order of {labelled[0]}")
            if matrix.shape[0] < n:
                notes.append(
                    f"{letter} has entries up to row {matrix.shape[0]} alone; the {n} rows of the others are taken"
                )
            square[letter] = matrix if matrix.shape[0] == n else _moved(matrix, np.arange(matrix.shape[0]), n)
        elif own == every:
            square[letter] = matrix
        else:
            union = union or dict(zip(every, range(n), strict=True))
            square[letter] = _moved(matrix, np.array([union[name] for name in own]), n)
    notes += _differences(names, labelled)
    return {letter: square[letter] for letter in ("M", "C", "K", "S") if letter in square}, every or None, notes


def _compared(found: Sources, raws: Mapping[str, RawMatrix]) -> dict[str, RawMatrix]:
    """Doubt a matrix that does not have its entries where those of the same run have them."""
    compared = dict(raws)
    written = {letter: raw.places for letter, raw in raws.items() if raw.places is not None}
    first = next(iter(written), "")
    for letter, places in list(written.items())[1:]:
        other = written[first]
        if other is None or places is None or raws[letter].matrix.shape != raws[first].matrix.shape:
            continue
        if np.array_equal(places, other):  # in one order, as programs write them
            continue
        different = np.setxor1d(places, other)
        if different.size:
            row, column = divmod(int(different[0]), raws[letter].matrix.shape[0])
            doubt = (
                f"and {found.matrices[first].path.name} should have lines for the same places, but {different.size} "
                f"are in one of them alone, the first in row {row + 1} and column {column + 1}: lines were lost"
            )
            compared[letter] = replace(raws[letter], doubts=(*raws[letter].doubts, doubt))
    return compared


def _union(labels: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Join the names of all matrices, which mostly have the same."""
    first = labels[0] if labels else ()
    others = [own for own in labels if own != first]
    return tuple(dict.fromkeys([*first, *[name for own in others for name in own]])) if others else first


def _require_one_count(
    found: Sources, raws: Mapping[str, RawMatrix], names: Mapping[str, tuple[str, ...] | None]
) -> list[str]:
    """Refuse files without labels some of which count rows from 0: the others may do so without showing it."""
    bare = [letter for letter, raw in raws.items() if raw.open_size and names[letter] is None]
    from_zero = [letter for letter in bare if raws[letter].first_index == 0]
    others = [letter for letter in bare if letter not in from_zero]
    if from_zero and others:
        path = found.matrices[from_zero[0]].path
        msg = (
            f"{path}: its rows are counted from 0, but {found.matrices[others[0]].path.name} has no entry in a row 0, "
            "so it may count from 1, or have nothing there. Write both as Matrix Market files, which count from 1."
        )
        raise FileFormatError(msg, path=str(path))
    return []


def _names_of(found: Sources, letter: str, raw: RawMatrix, longest: int) -> tuple[str, ...] | None:
    """Return the names of a matrix's rows: its own, those of the label file beside it, or of the only one that fits."""
    if raw.dofs is not None:
        return raw.dofs
    path, n = found.matrices[letter].path, raw.matrix.shape[0]
    own = [names for file, names in found.labels.items() if file.stem.lower() == path.stem.lower()]
    fitting = own or list({names for names in found.labels.values() if len(names) == n})
    if len(fitting) != 1:
        return None
    if len(fitting[0]) == longest > n and raw.open_size:
        return fitting[0][:n]
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
    also = f" Or one of them is something else; {found.holds}." if found.holds else ""
    msg = (
        f"{path}: the matrices differ in size ({sizes}), and there are no labels for all. Write them from one run, or "
        f"leave one out, as matrices={{'C': None}}.{also}"
    )
    return FileFormatError(msg, path=str(path))


def _differences(names: Mapping[str, tuple[str, ...] | None], labelled: Sequence[str]) -> list[str]:
    """Tell which DOFs only some of the matrices have."""
    notes = []
    others = [letter for letter in labelled[1:] if names[letter] != names[labelled[0]]]
    first = set(names[labelled[0]] or ()) if others else set()
    for letter in others:
        own = names[letter] or ()
        extra = [name for name in own if name not in first]
        if extra:
            notes.append(f"{len(extra)} DOFs are in {letter} but not in {labelled[0]} ({listed(extra)})")
        count = len(first.difference(own))
        if count:
            notes.append(f"{count} DOFs are in {labelled[0]} but not in {letter}")
    return notes


def _moved(matrix: csc_array, places: npt.NDArray[Any], n: int) -> csc_array:
    entries = matrix.tocoo()
    return csc_array(coo_array((entries.data, (places[entries.row], places[entries.col])), shape=(n, n)))


def _penalized(stiffness: csc_array | None) -> npt.NDArray[np.bool_]:
    return np.zeros(0, dtype=bool) if stiffness is None else np.abs(stiffness.diagonal()) >= PENALTY


def _stiffness(values: Mapping[str, Any]) -> Any:  # noqa: ANN401  # dense or sparse
    if "S" not in values:
        return values.get("K")
    damping = values["S"] * 1j
    if "K" not in values:
        return damping
    both_dense = not issparse(values["K"]) and not issparse(damping)
    return values["K"] + damping if both_dense else csc_array(csc_array(values["K"]) + csc_array(damping))


def _looked_at(source: Source, letter: str, raw: RawMatrix, matrix: csc_array, largest: int) -> MatrixReport:
    return matrix_report(
        letter,
        source.words,
        matrix,
        largest,
        format=raw.format,
        stored=raw.stored,
        completed=raw.completed,
        half_stored=raw.is_half_stored,
        known_to=raw.known_to,
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
    signals: tuple[str, ...] = (),
    doubts: tuple[str, ...] = (),
    unused: tuple[str, ...] = (),
    similar: tuple[str, ...] = (),
    known_to: float = EPS,
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
        signals=signals,
        doubts=doubts,
        unused=unused,
        similar=similar,
        known_to=known_to,
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
