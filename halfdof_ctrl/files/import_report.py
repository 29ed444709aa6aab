"""What was found in files: sizes, symmetry, rank and definiteness, mass per direction, kinds of DOFs.

These are the looks that find the usual faults of exported matrices before they become wrong frequencies: a triangle
that is missing, a mass in other units, a DOF with mass that nothing holds, a boundary condition as a huge spring, a
damping file that was forgotten.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.base.definiteness import Inertia, inertia
from halfdof_ctrl.base.digits import digits_in_words
from halfdof_ctrl.base.names import listed, removal_of
from halfdof_ctrl.files.formats.labels import translations
from halfdof_ctrl.files.formats.raw_matrix import Storage

SYMMETRIC_ENTRIES = 1e-9  #: asymmetry relative to the largest entry up to which a matrix is called symmetric
PENALTY = 1e35  #: a stiffness from here on is a boundary condition; Abaqus writes 1e36
TELLING_VALUES = 3  #: different entries of a matrix that is no identity or chain of equal parts
WHAT = {"M": "mass", "C": "damping", "K": "stiffness", "S": "structural damping"}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MatrixReport:
    """What was found about one matrix."""

    letter: str  #: M, C, K or S (structural damping, the imaginary part of K)
    source: str  #: the file, and its name for the matrix
    format: str
    shape: tuple[int, int]
    nonzero: int  #: entries, with those of a triangle that was filled in
    stored: Storage  #: which off-diagonal entries the file holds
    completed: bool  #: whether a triangle was filled in
    half_stored: bool  #: whether a triangle seems to be missing
    is_complex: bool
    asymmetry: float  #: largest entry of A - A^T over the largest of A
    skew: bool  #: whether A = -A^T
    null_columns: int
    inertia: Inertia  #: of the symmetric real part
    notes: tuple[str, ...]
    doubts: tuple[str, ...]  #: what may be wrong with the file
    known_to: float = EPS  #: relative rounding of the entries by the file's digits

    @property
    def symmetry(self) -> str:
        """Symmetry in words."""
        if self.skew:
            return "skew-symmetric"
        return "symmetric" if self.asymmetry <= SYMMETRIC_ENTRIES else f"unsymmetric ({self.asymmetry:.0e})"

    @property
    def rank(self) -> str:
        """Rank and definiteness in words."""
        known = self.inertia.rank
        rounded = self.letter == "K" and self.known_to > EPS and not self.inertia.negative
        motions = self.inertia.zero if rounded else 0
        lowest = self.inertia.lowest
        sign = f"negative by {-lowest:.0e}, " if lowest is not None and lowest < 0.0 else ""
        words = (
            f", {motions} zero to the file's {digits_in_words(self.known_to)} ({sign}which is the rounding of such a "
            "file): rigid-body motions, or softer than it tells"
        )
        digits = words if motions else ""
        part = "" if self.asymmetry <= SYMMETRIC_ENTRIES and not self.is_complex else " (of the symmetric real part)"
        return self.inertia.in_words + part + ("" if known is None else f", rank {known}") + digits


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class ImportReport:
    """What was found in the files of a model. Prints as a small table."""

    files: tuple[str, ...]
    matrices: tuple[MatrixReport, ...]
    n_dofs: int
    labelled: bool  #: whether the files name their DOFs
    missing: tuple[str, ...]  #: letters among M, C, K for which there is no matrix
    signals: tuple[str, ...]  #: B, F, G, H, D that are read, and from where
    doubts: tuple[str, ...]  #: what may be wrong with the files of these
    unused: tuple[str, ...]  #: what else is in the files
    similar: tuple[str, ...]  #: of that, what is as large as the stiffness
    known_to: float  #: relative rounding of the entries by the digits of the files
    n_inertial: int  #: DOFs whose column of M is not null
    n_half: int  #: of the others, those whose column of C is not null
    n_static: int  #: the rest
    mass: Mapping[str, float]  #: sum of M over the translations u1, u2, u3 of all nodes
    unsupported: tuple[str, ...]  #: DOFs with mass or damping whose column of K is null
    empty: tuple[str, ...]  #: DOFs whose columns are null in all matrices
    penalized: tuple[str, ...]  #: DOFs with a stiffness of 1e35 or more
    removed: tuple[str, ...]  #: of these, the ones that were taken out on request
    notes: tuple[str, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is probably not as it was meant, one sentence each."""
        found = [
            f"{part.letter} ({part.source}) has no off-diagonal entry whose partner across the diagonal is stored, and "
            "the file does not say that it is symmetric: half of it seems to be missing. If it is symmetric, pass "
            f"triangle={'lower' if part.stored == 'lower' else 'upper'!r}."
            for part in self.matrices
            if part.half_stored
        ]
        doubts = [f"{part.source} {doubt}" for part in self.matrices for doubt in part.doubts]
        found += [f"{doubt}." for doubt in (*doubts, *self.doubts)]
        found += [
            f"{part.letter} ({part.source}) is {part.inertia.in_words}: {part.inertia.negative} eigenvalues of its "
            f"symmetric part are negative{_beyond_rounding(part)}."
            for part in self.matrices
            if part.inertia.negative and not part.half_stored
        ]
        if self.similar:
            found.append(
                f"not used: {listed(self.similar)}, as large as the stiffness. If it is the damping, the mass or the "
                "like, say so: matrices={'C': name}."
            )
        if self.penalized and not self.removed:
            found.append(
                f"{len(self.penalized)} DOFs have a stiffness of {PENALTY:.0e} or more, which stands for a boundary "
                f"condition ({listed(self.penalized)}). Pass remove_fixed=True to take them out."
            )
        if self.unsupported:
            found.append(
                f"{len(self.unsupported)} DOFs have mass or damping but no stiffness ({listed(self.unsupported)})."
            )
        if self.empty:
            found.append(
                f"{len(self.empty)} DOFs have no entry in any matrix ({listed(self.empty)}): they move without a "
                "force, and the model has no state space. Take them out: "
                f"{removal_of(self.empty, owner='the names in `empty` of hd.inspect_files')}."
            )
        return tuple(found)

    def __repr__(self) -> str:
        """Return the table."""
        names = "named by node and component" if self.labelled else "without names in the files"
        lines = [f"{type(self).__name__}: {self.n_dofs} DOFs, {names}", *_table(self.matrices)]
        lines += [f"  {text}" for text in self.signals]
        lines.append(f"  files: {', '.join(self.files)}")
        if self.unused:
            lines.append(f"  not used: {listed(self.unused)}")
        if self.removed:
            lines.append(f"  removed as fixed: {listed(self.removed)}")
        lines += [f"  {letter}  no {WHAT[letter]} in the files: taken as zero" for letter in self.missing]
        if self.known_to > EPS:
            lines.append(f"  entries have {digits_in_words(self.known_to)}: known to {self.known_to:.0e}")
        lines.append(f"  DOFs by null columns: {self.n_inertial} inertial, {self.n_half} half, {self.n_static} static")
        if self.mass:
            lines.append("  sum of M: " + ", ".join(f"{size:.6g} along {name}" for name, size in self.mass.items()))
        lines += [f"  note: {part.letter}: {note}" for part in self.matrices for note in part.notes]
        lines += [f"  note: {note}" for note in self.notes]
        lines += [f"  WARNING: {text}" for text in self.warnings]
        return "\n".join(lines)


def _beyond_rounding(part: MatrixReport) -> str:
    """Say how far below zero the lowest eigenvalue is, where the digits of the file would hide less."""
    if part.known_to <= EPS:
        return ""
    words = f", beyond the rounding of a file with {digits_in_words(part.known_to)}"
    lowest = part.inertia.lowest
    return (
        words
        if lowest is None
        else f"{words} (down to {lowest:.1e} of the diagonal, zero being {part.inertia.zero_to:.1e})"
    )


def _table(matrices: Sequence[MatrixReport]) -> list[str]:
    rows = [("", "from", "size", "nonzero", "stored", "symmetry", "definiteness")]
    for part in matrices:
        stored = {"either": "one of each pair", "both": "full"}.get(part.stored, part.stored)
        words = f"{stored}, completed" if part.completed else stored
        size = f"{part.shape[0]} x {part.shape[1]}"
        rows.append((part.letter, part.source, size, str(part.nonzero), words, part.symmetry, part.rank))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  " + "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]


def matrix_report(letter: str, source: str, matrix: csc_array, largest: int, **found: Any) -> MatrixReport:  # noqa: ANN401
    """Look at one square matrix.

    Parameters
    ----------
    letter, source : str
    matrix : (n, n) csc_array
    largest : int
        Components with more rows are not factorized for the rank.
    **found
        format, stored, completed, half_stored, notes, doubts and known_to, as the reader found them.
    """
    real = csc_array(matrix.real)
    largest_entry = float(np.abs(matrix.data).max(initial=0.0))
    difference = abs(matrix - matrix.T)
    scale = largest_entry or 1.0
    return MatrixReport(
        letter=letter,
        source=source,
        shape=(matrix.shape[0], matrix.shape[1]),
        nonzero=int(matrix.nnz),
        is_complex=bool(np.iscomplexobj(matrix.data)),
        asymmetry=float(difference.max()) / scale if difference.nnz else 0.0,
        skew=bool(difference.nnz) and float(abs(matrix + matrix.T).max()) <= SYMMETRIC_ENTRIES * scale,
        null_columns=int(np.count_nonzero(~has_entries(matrix))),
        inertia=inertia(real, largest, found.get("known_to", EPS)),
        **found,
    )


def copies(matrices: Mapping[str, csc_array]) -> list[str]:
    """Tell which two of M, C and K are the same numbers, more than two of them: one was saved under two names.

    Examples
    --------
    >>> whole = csc_array([[3.0, -1.0], [-1.0, 2.0]])
    >>> copies({"K": whole, "M": whole, "C": 2 * whole})
    ['K and M are the same matrix, number for number: one may have been saved under the name of the other']
    """
    return [
        f"{one} and {other} are the same matrix, number for number: one may have been saved under the name of the other"
        for one, other in combinations(matrices, 2)
        if _are_same(matrices[one], matrices[other]) and np.unique(matrices[one].data).size >= TELLING_VALUES
    ]


def _are_same(one: csc_array, other: csc_array) -> bool:
    return one.shape == other.shape and one.nnz == other.nnz > 0 and csc_array(one - other).nnz == 0


def has_entries(matrix: csc_array) -> npt.NDArray[np.bool_]:
    """Tell which columns are not null."""
    return np.diff(matrix.indptr) > 0


def mass_per_direction(mass: csc_array | None, dofs: Sequence[str]) -> dict[str, float]:
    """Sum M over the translations of all nodes in each direction, where DOFs have directions.

    Examples
    --------
    >>> mass_per_direction(csc_array(np.diag([2.0, 3.0, 3.0])), ["n1_u1", "n2_u1", "n2_u2"])
    {'u1': 5.0, 'u2': 3.0}
    """
    if mass is None:
        return {}
    sums = {}
    for direction, chosen in translations(dofs).items():
        if chosen.any():
            sums[direction] = float(np.real(chosen @ (mass @ chosen)))
    return sums
