"""A square matrix as a file gives it, and its missing triangle.

Programs store a symmetric matrix by one triangle, the lower or the upper one, some by either entry of a pair. Where
the format says so, the other entry of each pair is filled in. Where it does not, nothing is, and what is stored is
told: a stiffness matrix that lacks a triangle looks like a matrix and gives wrong frequencies.
"""

from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.base.errors import FileFormatError

Declared: TypeAlias = Literal["symmetric", "skew-symmetric", "general", "unsymmetric", "unsaid"]
Storage: TypeAlias = Literal["diagonal", "lower", "upper", "either", "both"]
Triangle: TypeAlias = Literal["lower", "upper"]
IndexArray: TypeAlias = npt.NDArray[np.signedinteger[Any]]

MOST_ROWS = 20_000_000  #: index arrays of 160 MB; a header that says more than this and the file's length is damaged
FREE_ROWS = 10_000  #: rows that a file may say it has, whatever its length
TWICE = (
    "has {} entries at places that have one already, and they are added up: these are matrices of elements that nobody "
    "assembled, or lines that stand twice"
)
LONELY = 1e-9  #: of the largest entry: smaller ones may be rounding, without a partner
EQUAL_PAIRS = 1e-6  #: relative; both entries of a pair, printed in decimals, may differ by rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RawMatrix:
    """One matrix of a file."""

    matrix: csc_array  #: (n, m) float64 or complex128, triangles filled in where the format says so
    format: str  #: in words
    declared: Declared  #: what the file says of symmetry
    stored: Storage  #: which off-diagonal entries the file holds
    completed: bool  #: whether a triangle was filled in
    title: str = ""  #: what the file calls it
    letter: str | None = None  #: M, C, K or S (structural damping), if the file tells
    dofs: tuple[str, ...] | None = None  #: names of its rows, if the file has labels
    named: bool = False  #: whether `title` is its name among those of the file
    dense: npt.NDArray[Any] | None = None  #: the same numbers, if the file holds all n x m of them
    open_size: bool = False  #: whether there may be more rows, without entries, than the file tells
    first_index: int = 1  #: from which number on the file counts rows, where it does not say so
    known_to: float = EPS  #: relative rounding of the entries by the file's digits
    rectangular: bool = False  #: whether its columns are no DOFs, whatever their number
    places: IndexArray | None = None  #: row times n plus column of all entries, where a run writes the same for each
    notes: tuple[str, ...] = ()  #: anything else that a user should know
    doubts: tuple[str, ...] = ()  #: what may be wrong with the file

    @property
    def is_half_stored(self) -> bool:
        """Whether all off-diagonal entries lack their partner, and nobody said that this means symmetric."""
        one_sided = self.stored in {"lower", "upper", "either"} and self.declared != "unsymmetric"
        return one_sided and not self.completed and self.matrix.shape[0] == self.matrix.shape[1]


def assembled(
    rows: IndexArray,
    columns: IndexArray,
    values: npt.NDArray[Any],
    shape: tuple[int, int],
    *,
    declared: Declared,
    **words: Any,  # noqa: ANN401  # format, title, letter, dofs, notes of the RawMatrix
) -> RawMatrix:
    """Make a matrix of its entries, adding up those that stand more than once.

    Parameters
    ----------
    rows, columns : (k,) integer ndarrays
        From zero on.
    values : (k,) ndarray
    shape : (int, int)
    declared : {"symmetric", "skew-symmetric", "general", "unsymmetric", "unsaid"}
        The first two let the other entry of each pair be filled in.

    Returns
    -------
    RawMatrix
        With a doubt where entries stand more than once: assembled matrices have none, but lines may have been doubled.

    Raises
    ------
    FileFormatError
        Indices outside the shape; a matrix said to be symmetric with pairs of entries that differ.

    Examples
    --------
    >>> half = [np.array([0, 1, 1]), np.array([0, 0, 1]), np.array([2.0, -1.0, 3.0]), (2, 2)]
    >>> assembled(*half, declared="symmetric", format="example").matrix.toarray().tolist()
    [[2.0, -1.0], [-1.0, 3.0]]
    >>> assembled(*half, declared="unsaid", format="example").is_half_stored
    True
    """
    if rows.size and min(rows.min(), columns.min()) == -1:
        msg = (
            f"an entry lies outside the {shape[0]} x {shape[1]} matrix, in row or column 0: it counts rows from 0, but "
            "this format counts from 1. Add 1 to all row and column numbers."
        )
        raise FileFormatError(msg, path="")
    if rows.size and (min(rows.min(), columns.min()) < 0 or rows.max() >= shape[0] or columns.max() >= shape[1]):
        msg = f"an entry lies outside the {shape[0]} x {shape[1]} matrix. The file is damaged."
        raise FileFormatError(msg, path="")
    matrix = csc_array(coo_array((values, (rows, columns)), shape=shape))  # duplicates are added up
    doubts = tuple(words.pop("doubts", ()))
    if matrix.nnz < rows.size:
        doubts = (*doubts, TWICE.format(rows.size - matrix.nnz))
    doubts = (*doubts, *_lonely(matrix, declared))
    matrix.eliminate_zeros()
    raw = RawMatrix(matrix=matrix, declared=declared, stored=storage(matrix), completed=False, doubts=doubts, **words)
    return completed(raw) if declared in {"symmetric", "skew-symmetric"} else raw


def _lonely(matrix: csc_array, declared: Declared) -> tuple[str, ...]:
    """Doubt a matrix some of whose off-diagonal entries have their partner and others lack it.

    A file has both entries of a pair or one of each, except where a matrix is unsymmetric: then most have both.
    """
    if declared == "unsymmetric" or matrix.shape[0] != matrix.shape[1]:
        return ()
    entries = matrix.tocoo()
    row, column = entries.row.astype(np.int64), entries.col.astype(np.int64)
    if not ((row > column).any() and (row < column).any()):
        return ()
    places = np.sort(column * matrix.shape[0] + row)
    partners = row * matrix.shape[0] + column
    has_partner = places[np.minimum(np.searchsorted(places, partners), places.size - 1)] == partners
    counts = (row != column) & (np.abs(entries.data) > LONELY * np.abs(entries.data).max())
    both, alone = int((counts & has_partner).sum()), int((counts & ~has_partner).sum())
    if both and alone and (declared in {"symmetric", "skew-symmetric"} or alone > both):
        words = f"has {alone} entries without their partner across the diagonal, and {both} with it"
        return (f"{words}: some may be lost, or have a damaged place",)
    return ()


def most_rows(length: int) -> int:
    """Return how many rows files of so many bytes may have: a row without a byte carries no entry in any matrix."""
    return min(MOST_ROWS, max(FREE_ROWS, length))


def storage(matrix: csc_array) -> Storage:
    """Return where the off-diagonal entries of a matrix are.

    "either" means in both triangles, but never both entries of a pair.
    """
    entries = matrix.tocoo()
    below, above = bool((entries.row > entries.col).any()), bool((entries.row < entries.col).any())
    if not (below and above):
        return "lower" if below else "upper" if above else "diagonal"
    if matrix.shape[0] != matrix.shape[1]:
        return "both"
    pattern = _pattern(matrix)
    pairs = pattern.multiply(pattern.T).sum() - np.count_nonzero(matrix.diagonal())
    return "both" if pairs else "either"


def completed(raw: RawMatrix) -> RawMatrix:
    """Fill in the other entry of each pair that has one.

    Raises
    ------
    FileFormatError
        A pair of which both entries are stored, and differ.
    """
    matrix = raw.matrix
    if matrix.shape[0] != matrix.shape[1]:
        msg = f"a matrix of {matrix.shape[0]} x {matrix.shape[1]} cannot be {raw.declared}. The header is wrong."
        raise FileFormatError(msg, path="")
    partner = csc_array(-matrix.T if raw.declared == "skew-symmetric" else matrix.T)
    if raw.stored == "both" or raw.declared == "skew-symmetric":
        _require_equal_pairs(raw, partner)
    missing = partner - partner.multiply(_pattern(matrix))
    return replace(raw, matrix=csc_array(matrix + missing), completed=bool(missing.nnz))


def with_triangle(raw: RawMatrix, triangle: Triangle) -> RawMatrix:
    """Complete a half-stored matrix because the user says that it is symmetric.

    Raises
    ------
    FileFormatError
        Its entries are in the other triangle, or in either.
    """
    if not raw.is_half_stored:
        return raw
    if raw.stored != triangle:
        where = f"in the {raw.stored} triangle" if raw.stored != "either" else "on either side of the diagonal"
        msg = f"triangle={triangle!r}, but its off-diagonal entries are {where}."
        raise FileFormatError(msg, path="")
    return completed(replace(raw, declared="symmetric"))


def _pattern(matrix: csc_array) -> csc_array:
    return csc_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)


def _require_equal_pairs(raw: RawMatrix, partner: csc_array) -> None:
    matrix = raw.matrix
    both = _pattern(matrix).multiply(_pattern(partner))
    difference = csc_array((matrix - partner).multiply(both))
    if not difference.nnz:
        return
    worst = int(np.argmax(np.abs(difference.data)))
    size = float(np.abs(difference.data[worst]))
    if size > EQUAL_PAIRS * float(np.abs(matrix.data).max()):
        row = int(difference.indices[worst])
        column = int(np.searchsorted(difference.indptr, worst, side="right")) - 1
        sign = "minus " if raw.declared == "skew-symmetric" else ""
        msg = (
            f"it says that it is {raw.declared}, but its entries ({row + 1}, {column + 1}) and {sign}({column + 1}, "
            f"{row + 1}) differ by {size:.3g}. Its header is wrong, or the file is damaged."
        )
        raise FileFormatError(msg, path="")
