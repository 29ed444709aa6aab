"""Finite structure of a pencil ``A - s E``, for the oracle: deflate what is not finite, then QZ.

While E lacks row rank, a pivoted QR decomposition compresses its rows; the algebraic rows that appear
eliminate as many unknowns, again orthogonally, and the rest is a smaller pencil with the same finite
eigenvalues. The same on the transpose removes what a non-square or singular pencil has besides
(P. Van Dooren, The computation of Kronecker's canonical form of a singular pencil, 1979).

Eigenvalues are those of the diagonal blocks of the block triangular form of the pattern (A. L. Dulmage and
N. S. Mendelsohn, 1963), found anew after each deflation: a triangle of many small pivots, singular to any norm, is then
as regular as it looks. That needs zeros to be zero: each entry carries the mean square of its rounding error, and
an entry within it is set to zero. The reduction knows nothing of this module.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

from halfdof_ctrl.arrays import ComplexArray, FloatArray, Matrix, powers_of_two

EPS = float(np.finfo(float).eps)
RANK_TOLERANCE = 64 * EPS  #: times the size: pivots below this part of the largest are zero
NOISE = 512.0  #: entries within so many of their mean rounding errors are zero
SWEEPS = 10  #: equilibration passes over rows and columns
SHIFT = 1e-9  #: fixes the common factor of rows and columns that the equilibration leaves open


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FinitePart:
    """What a pencil has at finite places and, where it is regular, at infinity."""

    eigenvalues: ComplexArray  #: finite eigenvalues, by QZ on irreducible blocks
    steps: tuple[int, ...]  #: eigenvalues at infinity deflated in each step; their number is the index
    is_regular: bool  #: False if the pencil is not square or its determinant vanishes identically
    is_deficient: bool  #: rows and columns are both dependent at every s; the eigenvalues are not reliable then
    gap: float  #: smallest ratio, over all rank decisions, of a pivot that counts to one that does not


def finite_part(A: Matrix, E: Matrix) -> FinitePart:
    """Find the finite eigenvalues of the pencil ``A - s E``, and its structure at infinity.

    Parameters
    ----------
    A, E : (k, l) ndarrays
        Real or complex, square or not.

    Returns
    -------
    FinitePart
        For a non-square pencil of full rank, the eigenvalues of its regular part.
    """
    pencil = _Pencil.exact(A, E)
    rows = _deflated(pencil.equilibrated())
    columns = _deflated(rows.pencil.transposed())
    square = A.shape[0] == A.shape[1]
    eigenvalues = _blockwise_eigenvalues(pencil) if square else None
    if eigenvalues is None:  # rounding can lose eigenvalues of a singular pencil, not invent them: try both orders
        first = _deflated(pencil.transposed().equilibrated())
        both = (columns.pencil.eigenvalues(), _deflated(first.pencil.transposed()).pencil.eigenvalues())
        eigenvalues = max(both, key=len)
    return FinitePart(
        eigenvalues=eigenvalues,
        steps=tuple(rows.steps),
        is_regular=square and not rows.redundant and not columns.steps,
        is_deficient=bool(rows.redundant and columns.steps),
        gap=min(rows.gap, columns.gap),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Pencil:
    A: Matrix
    E: Matrix
    dA: FloatArray  #: mean squares of the rounding errors in A
    dE: FloatArray  #: the same in E

    @classmethod
    def exact(cls, A: Matrix, E: Matrix) -> "_Pencil":
        """Take entries as known to half a unit in the last place."""
        return cls(A, E, (EPS * np.abs(A)) ** 2, (EPS * np.abs(E)) ** 2)

    def transposed(self) -> "_Pencil":
        return _Pencil(self.A.T, self.E.T, self.dA.T, self.dE.T)

    def part(self, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]) -> "_Pencil":
        place = np.ix_(rows, columns)
        return _Pencil(self.A[place], self.E[place], self.dA[place], self.dE[place])

    def equilibrated(self) -> "_Pencil":
        """Bring the largest entries of the rows and columns of A and E together near one."""
        rows, columns = equilibrating_powers(np.maximum(np.abs(self.A), np.abs(self.E)))
        scale = rows[:, None] * columns
        return _Pencil(self.A * scale, self.E * scale, self.dA * scale**2, self.dE * scale**2)

    def from_left(self, left: Matrix) -> "_Pencil":
        """Multiply by a matrix with orthonormal rows."""
        A, dA = _product(left, self.A, self.dA)
        E, dE = _product(left, self.E, self.dE)
        return _Pencil(A, E, dA, dE)

    def from_right(self, right: Matrix) -> "_Pencil":
        """Multiply by a matrix with orthonormal columns."""
        return self.transposed().from_left(right.T).transposed()

    def eigenvalues(self) -> ComplexArray:
        """Give the eigenvalues by QZ; E must be nonsingular."""
        if self.E.shape[0] == 0:
            return np.zeros(0, dtype=np.complex128)
        return np.asarray(scipy.linalg.eigvals(self.A, self.E), dtype=np.complex128)


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    pencil: _Pencil  #: what is left
    algebraic: int  #: rows without E that were taken out
    redundant: int  #: of them, those that said nothing
    gap: float


@dataclass(frozen=True, slots=True, eq=False)
class _Deflated:
    pencil: _Pencil
    steps: list[int]
    redundant: int
    gap: float


def _deflated(pencil: _Pencil) -> _Deflated:
    """Reduce a pencil until its E has full row rank."""
    steps: list[int] = []
    redundant, gap = 0, float("inf")
    while True:
        step = _deflated_once(pencil)
        pencil, gap = step.pencil, min(gap, step.gap)
        if step.algebraic == 0:
            return _Deflated(pencil, steps, redundant, gap)
        steps.append(step.algebraic)
        redundant += step.redundant


def _deflated_once(pencil: _Pencil) -> _Step:
    """Take out the algebraic rows that there are."""
    left, rank, gap = _range(pencil.E, pencil.dE)
    algebraic = pencil.E.shape[0] - rank
    if algebraic == 0:
        return _Step(pencil, 0, 0, gap)
    turned = pencil.from_left(left.conj().T)
    size = powers_of_two(np.abs(turned.A[rank:]).max(axis=1, initial=0.0))[:, None]
    right, pivots, second = _range((turned.A[rank:] * size).conj().T, (turned.dA[rank:] * size**2).T)
    rest = _Pencil(turned.A[:rank], turned.E[:rank], turned.dA[:rank], turned.dE[:rank])
    return _Step(rest.from_right(right[:, pivots:]), algebraic, algebraic - pivots, min(gap, second))


def _range(matrix: Matrix, squares: FloatArray) -> tuple[Matrix, int, float]:
    """Give an orthogonal matrix whose first columns span the range, the rank, and the gap behind it."""
    if not matrix.any():
        return np.eye(matrix.shape[0]), 0, float("inf")
    left, triangle, _ = scipy.linalg.qr(matrix, pivoting=True)
    pivots = np.abs(np.diagonal(triangle))
    noise = NOISE * np.sqrt(squares.max())
    rank = int(np.count_nonzero(pivots > max(RANK_TOLERANCE * max(matrix.shape) * pivots[0], noise)))
    unclear = 0 < rank < pivots.size and pivots[rank] > 0.0
    return left, rank, float(pivots[rank - 1] / pivots[rank]) if unclear else float("inf")


def _blockwise_eigenvalues(pencil: _Pencil) -> ComplexArray | None:
    """Collect the eigenvalues of irreducible blocks; None if one of them is singular."""
    found: list[ComplexArray] = []
    waiting = [pencil]
    while waiting:
        blocks = _irreducible_blocks(waiting.pop())
        if blocks is None:
            return None
        for block in blocks:
            step = _deflated_once(block.equilibrated())
            if step.redundant:
                return None
            if step.algebraic == 0:
                found.append(step.pencil.eigenvalues())
            elif step.pencil.E.size:
                waiting.append(step.pencil)
    return np.concatenate([np.zeros(0, dtype=np.complex128), *found])


def _irreducible_blocks(pencil: _Pencil) -> list[_Pencil] | None:
    """Split by the block triangular form of the pattern; None if the pattern itself is singular."""
    pattern = (pencil.A != 0.0) | (pencil.E != 0.0)
    matched = maximum_bipartite_matching(csr_array(pattern), perm_type="column")
    if (matched < 0).any():
        return None
    count, labels = connected_components(csr_array(pattern[:, matched]), directed=True, connection="strong")
    members = [np.flatnonzero(labels == label) for label in range(count)]
    return [pencil.part(rows, matched[rows].astype(np.intp)) for rows in members]


def _product(left: Matrix, matrix: Matrix, squares: FloatArray) -> tuple[Matrix, FloatArray]:
    """Multiply, follow the rounding errors in the mean, and set what lies within them to zero.

    The rows of `left` are known to rounding of one wherever they are not exactly zero.
    """
    product = left @ matrix
    mean = np.abs(left) ** 2 @ squares + EPS**2 * ((left != 0.0).astype(float) @ np.abs(matrix) ** 2)
    noise = np.abs(product) <= NOISE * np.sqrt(mean)
    return np.where(noise, 0.0, product), np.where(noise, 0.0, mean)


def equilibrating_powers(size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give powers of two for rows and columns that bring their largest entries near one.

    Rows and columns are divided by the square roots of their maxima in turns, zero ones left alone.
    """
    return _with_maxima_near_one(size, np.ones(size.shape[0]), np.ones(size.shape[1]))


def balancing_powers(size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give powers of two for rows and columns that bring their entries near one.

    First in the mean of the logarithms, which has one solution whatever the units were (A. R. Curtis and J. K. Reid,
    1972), then the largest entries.
    """
    present = (size > 0.0).astype(float)
    logs = np.log2(np.where(size > 0.0, size, 1.0))
    normal = np.block([[np.diag(present.sum(axis=1)), present], [present.T, np.diag(present.sum(axis=0))]])
    right = -np.concatenate([logs.sum(axis=1), logs.sum(axis=0)])
    means = np.exp2(np.linalg.solve(normal + SHIFT * np.eye(len(normal)), right))
    return _with_maxima_near_one(size, means[: size.shape[0]], means[size.shape[0] :])


def _with_maxima_near_one(size: FloatArray, rows: FloatArray, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    for _ in range(SWEEPS):
        scaled = size * rows[:, None] * columns
        down, across = np.sqrt(scaled.max(axis=1, initial=0.0)), np.sqrt(scaled.max(axis=0, initial=0.0))
        rows, columns = rows / np.where(down > 0.0, down, 1.0), columns / np.where(across > 0.0, across, 1.0)
    return np.exp2(np.round(np.log2(rows))), np.exp2(np.round(np.log2(columns)))
