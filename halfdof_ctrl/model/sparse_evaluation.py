"""Evaluate equation (1) for sparse models: one factorization at each point, the order of elimination found once.

The coefficients of P(s) are put on one pattern. At the first point SuperLU orders it (X. S. Li, 2005): where the
pattern is nearly symmetric by minimum degree of ``P + P^T``, with pivots on the diagonal, else by columns with partial
pivoting. All points after it are factorized in that order. Pivots on the diagonal are safe as long as they do not
vanish; whether they did is seen from the residual, and a point where it is not small gets stricter pivots.
Solved is for the inputs, or with the transpose for the outputs, whichever are fewer. Where the solution of a random
right-hand side shows that P(s) is nearly singular, the sum of its terms has lost digits: there solutions are refined
with residuals summed term by term (`exact_products`), and (DATA) says what the entries determine.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import SuperLU

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, Matrix, powers_of_two
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.base.progress import progress
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse, column_of_entries, largest_by_row_and_column
from halfdof_ctrl.base.sparse_factors import COLUMNS_AT_A_TIME, CORRECTED_ABOVE, PIVOTINGS, SYMMETRIC_SHARE, sparse_lu
from halfdof_ctrl.base.sparse_products import times
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.refinement import COARSE_GROWTH, ENOUGH_FOR_DATA, REFINED_ENOUGH, SUSPECT_GROWTH, DataLimit
from halfdof_ctrl.model.weak_directions import Factors, WeakDirections, nudge, refined_at

MOST_BOUNDED = 32  #: outputs (of a model with more outputs than inputs), or inputs, whose bounds are found at a point
MOST_VALUES = 2**27  #: complex entries of a response, all channels and points (2 GB)
STRICTER_PIVOTS_ABOVE = 1e-10  #: componentwise backward error of a corrected solution that calls for stricter pivots


@limited_threads(1)
def sparse_transfer(
    P: Coefficients, B: Coefficients, F: Coefficients, D: Coefficients, points: ComplexArray
) -> ComplexArray:
    """Evaluate ``F(s) P(s)^-1 B(s) + D(s)`` at every point, with a progress bar where it takes long.

    Parameters
    ----------
    P, B, F, D : sequences of (n, n), (n, m), (p, n), (p, m) csc_arrays
        Coefficients of 1, s, s^2.
    points : (k,) complex ndarray
        Where to evaluate [rad/s].

    Returns
    -------
    (p, m, k) complex ndarray
        ``inf + nan j`` in every entry where ``P(s)`` is exactly singular.

    Raises
    ------
    ModelSizeError
        The response would have more than 2^27 entries.
    """
    p, m = D[0].shape
    require_room(p, m, points.size)
    values = np.empty((p, m, points.size), dtype=np.complex128)
    transfer = SparseTransfer(P, B, F, D)
    for k, s in enumerate(progress(points.tolist(), "frequencies")):
        values[:, :, k] = transfer.at(s)
    return values


def require_room(p: int, m: int, points: int) -> None:
    """Refuse a response that is too large to be held.

    Raises
    ------
    ModelSizeError
        More than 2^27 complex entries.
    """
    if p * m * points > MOST_VALUES:
        msg = (
            f"The response of {p} outputs to {m} inputs at {points} points would take "
            f"{1.6e-8 * p * m * points:.3g} GB. Select the inputs and outputs that matter: "
            "model.select(inputs=[...], outputs=[...])."
        )
        raise ModelSizeError(msg, size=p * m * points, limit=MOST_VALUES)


class SparseTransfer:
    """``F(s) P(s)^-1 B(s) + D(s)`` of a sparse model, point by point."""

    def __init__(
        self,
        P: Coefficients,
        B: Coefficients,
        F: Coefficients,
        D: Coefficients,
        *,
        bounded_above: float = SUSPECT_GROWTH,
    ) -> None:
        self.bounded_above = bounded_above  #: growth from which on (DATA) is found
        self.turned = F[0].shape[0] < B[0].shape[1]  #: whether the transpose is solved, for the outputs
        parts = (P, F, B, D) if self.turned else (P, B, F, D)
        square, self.B, self.F, self.D = (
            [csc_array(as_sparse(X).T) if self.turned else as_sparse(X) for X in part] for part in parts
        )
        pencil = SparsePencil.on_one_pattern(square)
        self.pivotings = PIVOTINGS if pencil.is_nearly_symmetric else PIVOTINGS[-1:]
        self.pencils = [pencil] * len(self.pivotings)  #: in the order found for each way of pivoting
        self.growth = 0.0  #: of a random solution, relative to the scaled P(s), the largest so far
        self._limit = DataLimit.none(self.D[0].shape)
        self.square = square
        self.exact: ExactPolynomial | None = None  #: made when it is needed
        self.exact_transposed: ExactPolynomial | None = None  #: likewise
        self.weak: WeakDirections | None = None  #: found at a point before

    def at(self, s: complex) -> ComplexArray:
        """Evaluate at one point [rad/s]: (p, m)."""
        value = np.full(self.D[0].shape, complex(np.inf, np.nan))
        self._limit = DataLimit.none(value.shape)
        with np.errstate(all="ignore"):
            B, F, D = (_polynomial(part, s) for part in (self.B, self.F, self.D))
            for way in range(len(self.pivotings)):
                try:
                    motion, backward_error = self._times_solution(F, B, s, way)
                except RuntimeError:  # exactly singular
                    self.growth = np.inf
                    break
                if backward_error <= STRICTER_PIVOTS_ABOVE or way == len(self.pivotings) - 1:
                    value = np.asarray(motion + D.toarray())
                    break
        value[~np.isfinite(value)] = complex(np.inf, np.nan)
        return np.asarray(value.T if self.turned else value)

    def _times_solution(self, F: SparseMatrix, B: SparseMatrix, s: complex, way: int) -> tuple[ComplexArray, float]:
        """Return ``F P(s)^-1 B`` and the componentwise backward error of the solution."""
        factors = self._factorized(s, way)
        growth = factors.growth()
        self.growth = max(self.growth, np.inf if factors.is_nudged else growth)
        refines = factors.is_nudged or growth > SUSPECT_GROWTH
        left = None
        if growth > self.bounded_above:
            left = factors.solve_transposed(F[:MOST_BOUNDED].toarray().T)
            if factors.is_nudged or growth > COARSE_GROWTH:
                left = self._refined(s, left, F[:MOST_BOUNDED].toarray().T, factors, is_transposed=True)
        product = np.zeros((F.shape[0], B.shape[1]), dtype=np.complex128)
        worst = 0.0
        for start in range(0, B.shape[1], COLUMNS_AT_A_TIME):
            right = B[:, start : start + COLUMNS_AT_A_TIME].toarray()
            solution, backward_error = factors.solve(right)
            if refines:
                solution = self._refined(s, solution, right, factors)
            if left is not None:
                self._bound(s, left, solution, start)
            product[:, start : start + COLUMNS_AT_A_TIME] = times(F, solution)
            worst = max(worst, backward_error)
        return product, worst

    def _refined(
        self, s: complex, solution: ComplexArray, right: Matrix, factors: "PointFactors", *, is_transposed: bool = False
    ) -> ComplexArray:
        """Refine a solution; infinite where P(s) is singular."""
        if self.exact is None:
            self.exact = ExactPolynomial(self.square)
        exact, solver, known, enough = self.exact, factors.both_ways(), self.weak, REFINED_ENOUGH
        if is_transposed:
            if self.exact_transposed is None:
                self.exact_transposed = ExactPolynomial([csc_array(part.T) for part in self.square])
            exact, solver, enough = self.exact_transposed, solver.transposed, ENOUGH_FOR_DATA
            known = None if known is None else known.transposed
        found = refined_at(exact, s, solution, np.asarray(right, dtype=np.complex128), solver, known, enough=enough)
        if found.directions is not None:
            self.weak = found.directions.transposed if is_transposed else found.directions
        if found.is_singular or (factors.is_nudged and not found.is_settled):
            return np.full(solution.shape, complex(np.inf, np.nan))
        return found.solution

    def _factorized(self, s: complex, way: int) -> "PointFactors":
        """Factorize P(s) in one way, in the order of the first point that was."""
        pencil, (ordering, threshold) = self.pencils[way], self.pivotings[way]
        try:
            factors = PointFactors.of(pencil, s, "NATURAL" if pencil.is_ordered else ordering, threshold)
        except RuntimeError:  # the rounded sum is singular: P(s) may not be
            return PointFactors.beside(pencil, s)
        if not pencil.is_ordered:
            order = np.argsort(factors.lu.perm_c)
            self.pencils[way] = pencil.in_order(None if ordering == "COLAMD" else order, order)
        return factors

    @property
    def limit(self) -> DataLimit:
        """(p, m) of the last point; zero where P(s) was far from singular."""
        limit = self._limit
        return DataLimit(limit.data.T, limit.slope.T) if self.turned else limit

    def _bound(self, s: complex, left: ComplexArray, solution: ComplexArray, start: int) -> None:
        """Bound what rounding of the entries changes, for some columns."""
        sizes = _polynomial([csc_array(abs(part)) for part in self.square], abs(s))
        slope = _polynomial([self.square[1], 2.0 * self.square[2]], s)
        place = (slice(left.shape[1]), slice(start, start + solution.shape[1]))
        self._limit.data[place] = EPS * (np.abs(left).T @ times(sizes, np.abs(solution)))
        self._limit.slope[place] = np.abs(s * (left.T @ times(slope, solution)))


@dataclass(frozen=True, slots=True, eq=False)
class SparsePencil:
    """Coefficients of a square matrix polynomial on one pattern of compressed columns."""

    values: tuple[npt.NDArray[Any] | None, ...]  #: entries of the coefficients of 1, s, s^2, None for zeros
    indices: npt.NDArray[np.int32]
    indptr: npt.NDArray[np.int32]
    rows: npt.NDArray[np.intp] | None  #: which row of P stands where, None for all in their places
    columns: npt.NDArray[np.intp] | None  #: likewise
    is_ordered: bool

    @classmethod
    def on_one_pattern(cls, coefficients: Sequence[SparseMatrix]) -> "SparsePencil":
        """Put coefficients of 1, s, s^2 on the union of their patterns."""
        patterns = [csc_array((np.ones(X.nnz), X.indices, X.indptr), shape=X.shape) for X in coefficients]
        union = csc_array(patterns[0] + patterns[1] + patterns[2])
        union.sort_indices()
        union.data = np.arange(1.0, union.nnz + 1.0)
        values: list[npt.NDArray[Any] | None] = []
        for X, pattern in zip(coefficients, patterns, strict=True):
            if X.nnz == 0:
                values.append(None)
                continue
            places = csc_array(union.multiply(pattern))
            places.sort_indices()
            spread = np.zeros(union.nnz, dtype=X.dtype)
            spread[places.data.astype(np.intp) - 1] = X.data
            values.append(spread)
        return cls(tuple(values), union.indices, union.indptr, None, None, is_ordered=False)

    @property
    def is_nearly_symmetric(self) -> bool:
        """Whether most entries have a partner across the diagonal, which is full."""
        n = self.indptr.size - 1
        pattern = csc_array((np.ones(self.indices.size), self.indices, self.indptr), shape=(n, n))
        partners = pattern.multiply(pattern.T).nnz
        return bool(partners >= SYMMETRIC_SHARE * pattern.nnz)

    def at(self, s: complex) -> SparseMatrix:
        """Give P(s), its rows and columns in order."""
        total = np.zeros(self.indices.size, dtype=np.complex128)
        for power, part in enumerate(self.values):
            if part is not None:
                total += s**power * part
        n = self.indptr.size - 1
        return csc_array((total, self.indices, self.indptr), shape=(n, n))

    def scaled_at(self, s: complex) -> tuple[SparseMatrix, FloatArray, FloatArray]:
        """Give P(s) with the largest entries of its rows and columns near one, and the powers of two that do it."""
        P = self.at(s)
        by_row, _ = largest_by_row_and_column(P)
        down = powers_of_two(by_row)
        P.data *= down[P.indices]
        _, by_column = largest_by_row_and_column(P)
        across = powers_of_two(by_column)
        P.data *= across[column_of_entries(P)]
        return P, down, across

    def in_order(self, rows: npt.NDArray[np.intp] | None, columns: npt.NDArray[np.intp]) -> "SparsePencil":
        """Bring rows and columns into a new order."""
        n = self.indptr.size - 1
        place = csc_array((np.arange(1, self.indices.size + 1), self.indices, self.indptr), shape=(n, n))[:, columns]
        if rows is not None:
            place = csc_array(place.tocsr()[rows])
        place = csc_array(place)
        place.sort_indices()
        values = tuple([None if part is None else part[place.data - 1] for part in self.values])
        return SparsePencil(values, place.indices, place.indptr, rows, columns, is_ordered=True)


@dataclass(frozen=True, slots=True, eq=False)
class PointFactors:
    """P(s), scaled by powers of two and factorized."""

    lu: SuperLU
    matrix: SparseMatrix  #: what was factorized
    size: SparseMatrix  #: its absolute values
    down: FloatArray  #: (n, 1) factors of its rows
    across: FloatArray  #: (n, 1) factors of its columns
    pencil: SparsePencil
    is_nudged: bool = (
        False  #: whether the rounded sum of the terms is exactly singular: a matrix beside it was factorized
    )

    @classmethod
    def of(cls, pencil: SparsePencil, s: complex, ordering: Any, threshold: float) -> "PointFactors":  # noqa: ANN401  # Literal
        """Factorize P(s).

        Raises
        ------
        RuntimeError
            It is exactly singular.
        """
        P, down, across = pencil.scaled_at(s)
        return cls(sparse_lu(P, ordering, threshold), P, csc_array(abs(P)), down[:, None], across[:, None], pencil)

    @classmethod
    def beside(cls, pencil: SparsePencil, s: complex) -> "PointFactors":
        """Factorize a matrix that differs from P(s), which is exactly singular, by rounding of a diagonal.

        Raises
        ------
        RuntimeError
            That is singular too.
        """
        P, down, across = pencil.scaled_at(s)
        P = csc_array(P + diags_array(nudge(P.shape[0])))
        return cls(sparse_lu(P), P, csc_array(abs(P)), down[:, None], across[:, None], pencil, is_nudged=True)

    def both_ways(self) -> Factors:
        """Return what solves with P(s) and its transpose, and its scales, in the order of the model."""
        down, across = self.down.copy(), self.across.copy()
        if self.pencil.rows is not None:
            down[self.pencil.rows] = self.down
        if self.pencil.columns is not None:
            across[self.pencil.columns] = self.across
        return Factors(self.solve_once, self.solve_transposed, down, across)

    def solve(self, right: Matrix) -> tuple[ComplexArray, float]:
        """Return ``P(s)^-1 right`` for an (n, k) array, corrected once where needed, and its backward error."""
        rows, columns = self.pencil.rows, self.pencil.columns
        scaled: ComplexArray = np.asarray((right if rows is None else right[rows]) * self.down, dtype=np.complex128)
        solution: Any = self.lu.solve(scaled)
        residual, backward_error = self._residual(scaled, solution)
        if backward_error > CORRECTED_ABOVE:
            solution += self.lu.solve(residual)
            _, backward_error = self._residual(scaled, solution)
        solution *= self.across
        if columns is None:
            return solution, backward_error
        back = np.empty_like(solution)
        back[columns] = solution
        return back, backward_error

    def solve_once(self, right: ComplexArray) -> ComplexArray:
        """Return ``P(s)^-1 right`` for an (n, k) array as the factors give it."""
        rows, columns = self.pencil.rows, self.pencil.columns
        scaled = np.asarray((right if rows is None else right[rows]) * self.down)
        solution: ComplexArray = np.asarray(self.lu.solve(scaled), dtype=np.complex128)
        solution *= self.across
        if columns is None:
            return solution
        back = np.empty_like(solution)
        back[columns] = solution
        return back

    def solve_transposed(self, right: Matrix) -> ComplexArray:
        """Return ``P(s)^-T right`` for an (n, k) array."""
        rows, columns = self.pencil.rows, self.pencil.columns
        scaled = np.asarray((right if columns is None else right[columns]) * self.across, dtype=np.complex128)
        solution: Any = cast("Any", self.lu).solve(scaled, trans="T")
        solution *= self.down
        if rows is None:
            return np.asarray(solution)
        back = np.empty_like(solution)
        back[rows] = solution
        return np.asarray(back)

    def growth(self) -> float:
        """Return the size of ``P(s)^-1 r`` for a random r of size one, in the units in which P(s) is even."""
        right = np.random.default_rng(0).uniform(1.0, 2.0, self.matrix.shape[0]).astype(np.complex128)
        size = float(np.abs(self.lu.solve(right)).max(initial=0.0))
        return size if np.isfinite(size) else np.inf

    def _residual(self, right: ComplexArray, solution: ComplexArray) -> tuple[ComplexArray, float]:
        residual = right - times(self.matrix, solution)
        size = times(self.size, np.abs(solution)) + np.abs(right)
        worst = float((np.abs(residual) / np.where(size > 0.0, size, 1.0)).max(initial=0.0))
        return residual, worst if np.isfinite(worst) else np.inf


def _polynomial(coefficients: Sequence[SparseMatrix], s: complex) -> SparseMatrix:
    """Return the value of a matrix polynomial, skipping zero coefficients."""
    value = csc_array(coefficients[0])
    for power, part in enumerate(coefficients[1:], start=1):
        if part.nnz:
            value = value + s**power * part
    return csc_array(value)
