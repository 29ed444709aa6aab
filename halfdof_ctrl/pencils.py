"""Finite structure of a pencil ``A - s E``, for the oracle: deflate what is not finite, then QZ.

While E lacks row rank, an orthogonal transformation compresses its rows; the algebraic rows that appear
eliminate as many unknowns, again orthogonally, and the rest is a smaller pencil with the same finite
eigenvalues. The same on the transpose removes what a non-square or singular pencil has besides
(P. Van Dooren, The computation of Kronecker's canonical form of a singular pencil, 1979). Rows and
columns are equilibrated before each rank decision. The reduction knows nothing of this module.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.arrays import ComplexArray, FloatArray, Matrix

RANK_TOLERANCE = 64 * np.finfo(float).eps  #: times the size: smaller singular values are zero
CANCELLATION = 16 * np.finfo(float).eps  #: times the number of terms: smaller sums are zero
SWEEPS = 10  #: equilibration passes over rows and columns


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FinitePart:
    """The regular pencil ``A - s E`` with nonsingular E that holds the finite eigenvalues."""

    A: Matrix  #: (k, k)
    E: Matrix  #: (k, k), nonsingular
    steps: tuple[int, ...]  #: eigenvalues at infinity deflated in each step; their number is the index
    is_regular: bool  #: False if the pencil is not square or its determinant vanishes identically
    gap: float  #: smallest ratio, over all rank decisions, of a singular value that counts to one that does not

    @property
    def eigenvalues(self) -> ComplexArray:
        """The finite eigenvalues by QZ [rad/s]."""
        if self.E.shape[0] == 0:
            return np.zeros(0, dtype=np.complex128)
        return np.asarray(scipy.linalg.eigvals(self.A, self.E), dtype=np.complex128)


def finite_part(A: Matrix, E: Matrix) -> FinitePart:
    """Deflate everything of the pencil ``A - s E`` but its finite eigenvalues.

    Parameters
    ----------
    A, E : (k, l) ndarrays
        Real or complex, square or not.
    """
    rows = _Deflation(*_equilibrated(A, E))
    columns = _Deflation(rows.A.T, rows.E.T)
    regular = A.shape[0] == A.shape[1] and not rows.redundant and not columns.steps
    return FinitePart(
        A=columns.A.T,
        E=columns.E.T,
        steps=tuple(rows.steps),
        is_regular=regular,
        gap=min(rows.gap, columns.gap),
    )


class _Deflation:
    """Reduce a pencil until its E has full row rank."""

    def __init__(self, A: Matrix, E: Matrix) -> None:
        self.A, self.E = A, E
        self.steps: list[int] = []  #: algebraic rows found in each step
        self.redundant = 0  #: algebraic rows that say nothing
        self.gap = float("inf")
        while self._deflate_once():
            pass

    def _deflate_once(self) -> bool:
        """Take out the algebraic rows that there are; tell whether there were any."""
        left, rank = self._range(self.E)
        algebraic_rows = self.E.shape[0] - rank
        if algebraic_rows == 0:
            return False
        left = left.conj().T
        algebra = clean_product(left[rank:], self.A)
        size = np.abs(algebra).max(axis=1, initial=0.0)
        right, pivots = self._range((algebra * powers_of_two(size)[:, None]).conj().T)
        self.redundant += algebraic_rows - pivots
        keep = right[:, pivots:]
        self.A = clean_product(clean_product(left[:rank], self.A), keep)
        self.E = clean_product(clean_product(left[:rank], self.E), keep)
        self.steps.append(algebraic_rows)
        return True

    def _range(self, matrix: Matrix) -> tuple[Matrix, int]:
        """Give an orthogonal matrix whose first columns span the range, and the rank."""
        if matrix.size == 0:
            return np.eye(matrix.shape[0]), 0
        left, triangle, _ = scipy.linalg.qr(matrix, pivoting=True)
        values = np.abs(np.diagonal(triangle))
        rank = int(np.count_nonzero(values > RANK_TOLERANCE * max(matrix.shape) * values[0]))
        if 0 < rank < values.size and values[rank] > 0.0:
            self.gap = min(self.gap, float(values[rank - 1] / values[rank]))
        return left, rank


def clean_product(left: Matrix, right: Matrix) -> Matrix:
    """Multiply, and set entries to zero that are rounding of a sum whose terms cancel."""
    product = left @ right
    size = np.abs(left) @ np.abs(right)
    return np.where(np.abs(product) <= CANCELLATION * right.shape[0] * size, 0.0, product)


def _equilibrated(A: Matrix, E: Matrix) -> tuple[Matrix, Matrix]:
    """Bring the rows and columns of E near one, and those of A where E has none."""
    rows, columns = equilibrating_powers(np.abs(E))
    A, E = A * rows[:, None] * columns, E * rows[:, None] * columns
    size = np.abs(A).max(axis=0, initial=0.0)
    A = A * np.where(E.any(axis=0), 1.0, powers_of_two(size))
    size = np.abs(A).max(axis=1, initial=0.0)
    return A * np.where(E.any(axis=1), 1.0, powers_of_two(size))[:, None], E


def equilibrating_powers(size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give powers of two for rows and columns that bring their largest entries near one.

    Rows and columns are divided by the square roots of their maxima in turns, zero ones left alone.
    """
    rows, columns = np.ones(size.shape[0]), np.ones(size.shape[1])
    for _ in range(SWEEPS):
        scaled = size * rows[:, None] * columns
        down, across = np.sqrt(scaled.max(axis=1, initial=0.0)), np.sqrt(scaled.max(axis=0, initial=0.0))
        rows, columns = rows / np.where(down > 0.0, down, 1.0), columns / np.where(across > 0.0, across, 1.0)
    return np.exp2(np.round(np.log2(rows))), np.exp2(np.round(np.log2(columns)))


def powers_of_two(size: FloatArray) -> FloatArray:
    """Powers of two that bring sizes to between 1/2 and 1, and 1 for a zero."""
    return np.ldexp(1.0, -np.frexp(size)[1])
