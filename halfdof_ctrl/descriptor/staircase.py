"""One step of the staircase algorithm on a pencil ``A - s E``, for the oracle.

While E lacks row rank, a pivoted QR decomposition compresses its rows; the algebraic rows that appear
eliminate as many unknowns, again orthogonally, and the rest is a smaller pencil with the same finite
eigenvalues (P. Van Dooren, The computation of Kronecker's canonical form of a singular pencil, 1979).

Structure lives on zeros. So each entry carries the mean square of its rounding error, and an entry within it is set to
zero. The reduction knows nothing of this module.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, ComplexArray, DenseMatrix, FloatArray, powers_of_two
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.descriptor.patterns import Places, diagonal_blocks

ZERO_PIVOT = 64 * EPS  #: times the size: pivots below this part of the largest are zero
ROUNDING_NOISE = 512.0  #: entries within so many of their mean rounding errors are zero


@dataclass(frozen=True, slots=True, eq=False)
class Pencil:
    """``A - s E`` with an estimate of the rounding errors that its entries carry."""

    A: DenseMatrix  #: (k, l)
    E: DenseMatrix  #: (k, l)
    dA: FloatArray  #: mean squares of the rounding errors in A
    dE: FloatArray  #: the same in E

    @classmethod
    def exact(cls, A: DenseMatrix, E: DenseMatrix) -> "Pencil":
        """Take entries as known to half a unit in the last place."""
        return cls(A, E, (EPS * np.abs(A)) ** 2, (EPS * np.abs(E)) ** 2)

    def transposed(self) -> "Pencil":
        """Return the pencil with rows and columns exchanged."""
        return Pencil(self.A.T, self.E.T, self.dA.T, self.dE.T)

    def reversed(self) -> "Pencil":
        """Return ``E - s A``, which has the inverse eigenvalues."""
        return Pencil(self.E, self.A, self.dE, self.dA)

    def part(self, rows: Places, columns: Places) -> "Pencil":
        """Pick rows and columns."""
        place = np.ix_(rows, columns)
        return Pencil(self.A[place], self.E[place], self.dA[place], self.dE[place])

    def scaled(self) -> "Pencil":
        """Bring the largest entries of the rows and columns of A and E together near one."""
        rows, columns = scaling_powers(np.maximum(np.abs(self.A), np.abs(self.E)))
        scale = rows[:, None] * columns
        return Pencil(self.A * scale, self.E * scale, self.dA * scale**2, self.dE * scale**2)

    def from_left(self, left: DenseMatrix) -> "Pencil":
        """Multiply by a matrix with orthonormal rows."""
        A, dA = _product(left, self.A, self.dA)
        E, dE = _product(left, self.E, self.dE)
        return Pencil(A, E, dA, dE)

    def from_right(self, right: DenseMatrix) -> "Pencil":
        """Multiply by a matrix with orthonormal columns."""
        return self.transposed().from_left(right.T).transposed()

    def diagonal_blocks(self) -> list["Pencil"]:
        """Split by the block triangular form of the pattern."""
        return [self.part(*places) for places in diagonal_blocks((self.A != 0.0) | (self.E != 0.0))]

    def eigenvalues(self) -> ComplexArray:
        """Return the eigenvalues by QZ; E must be nonsingular."""
        if self.E.shape[0] == 0:
            return np.zeros(0, dtype=np.complex128)
        return np.asarray(scipy.linalg.eigvals(self.A, self.E), dtype=np.complex128)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """How clear the rank decisions were."""

    gap: float = float("inf")  #: smallest ratio of a pivot that counts to one that does not
    margin: float = float("inf")  #: smallest ratio of a pivot that counts to the level from which it would not

    def and_also(self, other: "Evidence") -> "Evidence":
        """Return the weaker of both."""
        return Evidence(min(self.gap, other.gap), min(self.margin, other.margin))


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What one deflation leaves and what it took out."""

    pencil: Pencil  #: what is left
    algebraic: int  #: rows without E that were taken out
    redundant: int  #: of them, those that said nothing
    evidence: Evidence


@dataclass(frozen=True, slots=True, eq=False)
class Staircase:
    """What is left when E has full row rank, and all that was taken out."""

    pencil: Pencil
    steps: tuple[int, ...]  #: algebraic rows of each deflation
    redundant: int
    evidence: Evidence


def deflated(pencil: Pencil) -> Staircase:
    """Reduce a pencil until its E has full row rank."""
    steps: list[int] = []
    redundant, evidence = 0, Evidence()
    while True:
        step = deflated_once(pencil)
        pencil, evidence = step.pencil, evidence.and_also(step.evidence)
        if step.algebraic == 0:
            return Staircase(pencil, tuple(steps), redundant, evidence)
        steps.append(step.algebraic)
        redundant += step.redundant


def deflated_once(pencil: Pencil) -> Step:
    """Take out the algebraic rows that there are."""
    left, rank, evidence = _range(pencil.E, pencil.dE)
    algebraic = pencil.E.shape[0] - rank
    if algebraic == 0:
        return Step(pencil, 0, 0, evidence)
    turned = pencil.from_left(left.conj().T)
    size = powers_of_two(np.abs(turned.A[rank:]).max(axis=1, initial=0.0))[:, None]
    right, pivots, second = _range((turned.A[rank:] * size).conj().T, (turned.dA[rank:] * size**2).T)
    rest = Pencil(turned.A[:rank], turned.E[:rank], turned.dA[:rank], turned.dE[:rank])
    return Step(rest.from_right(right[:, pivots:]), algebraic, algebraic - pivots, evidence.and_also(second))


def _range(matrix: DenseMatrix, squares: FloatArray) -> tuple[DenseMatrix, int, Evidence]:
    """Return an orthogonal matrix whose first columns span the range, the rank, and how clear it is."""
    if not matrix.any():
        return np.eye(matrix.shape[0]), 0, Evidence()
    left, triangle, _ = scipy.linalg.qr(matrix, pivoting=True)
    pivots = np.abs(np.diagonal(triangle))
    level = max(ZERO_PIVOT * max(matrix.shape) * pivots[0], ROUNDING_NOISE * np.sqrt(squares.max()))
    rank = int(np.count_nonzero(pivots > level))
    if rank == 0:
        return left, 0, Evidence()
    rest = pivots[rank:].max(initial=0.0)
    gap = float(pivots[rank - 1] / rest) if rest > 0.0 else float("inf")
    return left, rank, Evidence(gap, float(pivots[rank - 1] / level))


def _product(left: DenseMatrix, matrix: DenseMatrix, squares: FloatArray) -> tuple[DenseMatrix, FloatArray]:
    """Multiply, follow the rounding errors in the mean, and set what lies within them to zero.

    The rows of `left` are known to rounding of one wherever they are not exactly zero.
    """
    product = left @ matrix
    mean = np.abs(left) ** 2 @ squares + EPS**2 * ((left != 0.0).astype(float) @ np.abs(matrix) ** 2)
    noise = np.abs(product) <= ROUNDING_NOISE * np.sqrt(mean)
    return np.where(noise, 0.0, product), np.where(noise, 0.0, mean)
