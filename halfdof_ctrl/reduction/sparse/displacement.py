"""The displacements of a sparse model as functions of state and inputs, worked out for what is asked.

All n rows of equation (4) would be a dense matrix with as many columns as there are states. Here a combination of
displacements takes one solution of ``W^T z = f``, f its static part, whose products with C T_i, K T_i, K T_c and B are
its row of (4); where the states and inputs are fewer than the combinations, their columns of (4) are solved for.
Histories of all DOFs take one solution a time.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np
from scipy.sparse import csc_array, csr_array, hstack

from halfdof_ctrl.base.arrays import EPS, FloatArray, Matrix
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.sparse_arrays import IndexArray, SparseMatrix, as_sparse, joined_sparse, sparse_unit
from halfdof_ctrl.base.sparse_factors import COLUMNS_AT_A_TIME
from halfdof_ctrl.base.sparse_products import Transposed, times
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU, largest_of_columns
from halfdof_ctrl.reduction.method.signals import Signal, absorbed, trimmed
from halfdof_ctrl.reduction.sparse.partition import HALF, INERTIAL, STATIC, SparsePartition

MOST_SYSTEM_ENTRIES = 2**26  #: of A, B, C or D of a state space, and of equation (4) for all DOFs, dense (512 MB)
SHIFT_ROUNDING = 32 * EPS  #: times n, at most 64: a coefficient of u' below this part is rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SparseEquation:
    """Equation (3) of a sparse model with n DOFs, N states and m inputs: what stands on its right.

    Its rows are scaled as those of the factorized W.
    """

    partition: SparsePartition
    states: SparseMatrix  #: (n, N) [K T_i, K T_c, C T_i], to be subtracted
    forces: tuple[SparseMatrix, ...]  #: (n, m) B, Bv, Ba, without zeros at the end, but at least one
    transposes: tuple[Transposed, ...]  #: of `states` and `forces`

    @classmethod
    def of(cls, model: SecondOrderModel, partition: SparsePartition, rows: FloatArray) -> "SparseEquation":
        """Assemble the right-hand side, its rows scaled by the given factors."""
        K, C = as_sparse(model.K), as_sparse(model.C)
        inertial, half = partition.of_kind(INERTIAL), partition.of_kind(HALF)
        columns = [partition.mapped(matrix, own) for matrix, own in ((K, inertial), (K, half), (C, inertial))]
        states = csc_array(hstack(columns, format="csc"))
        forces = [as_sparse(matrix) for matrix in model.quadratics.B]
        while len(forces) > 1 and forces[-1].nnz == 0:
            forces.pop()
        scaled = [
            csc_array((part.data * rows[part.indices], part.indices, part.indptr), shape=part.shape)
            for part in (states, *forces)
        ]
        transposes = tuple([Transposed.of(part) for part in scaled])
        return cls(partition=partition, states=scaled[0], forces=tuple(scaled[1:]), transposes=transposes)


def require_room(rows: int, columns: int, what: str, remedy: str) -> None:
    """Refuse a dense matrix of a state space that is too large.

    Raises
    ------
    ModelSizeError
        More than 2^26 entries.
    """
    if rows * columns > MOST_SYSTEM_ENTRIES:
        msg = (
            f"{what} would be a dense matrix of {rows} x {columns} and take {8e-9 * rows * columns:.3g} GB; the limit "
            f"is {8e-9 * MOST_SYSTEM_ENTRIES:.2g} GB. {remedy}"
        )
        raise ModelSizeError(msg, size=max(rows, columns), limit=MOST_SYSTEM_ENTRIES // min(rows, columns))


def inverse_rows(leading: SparseLU, places: IndexArray) -> Iterator[tuple[IndexArray, FloatArray]]:
    """Solve ``W^T z = e`` for unit vectors e, in blocks: give which of the places, and z in the scaled equations."""
    for start in range(0, places.size, COLUMNS_AT_A_TIME):
        block = np.arange(start, min(start + COLUMNS_AT_A_TIME, places.size))
        right = np.zeros((leading.rows.size, block.size), order="F")
        right[places[block], np.arange(block.size)] = 1.0
        yield block, leading.solve_transposed(right)


class SparseDisplacement:
    """All n displacements of a sparse model, equation (4), as a `signals.Signal` that is worked out where asked for.

    For N states and m inputs.
    """

    def __init__(
        self,
        equation: SparseEquation,
        leading: SparseLU,
        A: FloatArray,
        B: FloatArray,
        shift: tuple[FloatArray, ...],
        sizes: FloatArray,
    ) -> None:
        self.equation, self.leading = equation, leading
        self.A, self.B, self.shift = A, B, shift
        self.sizes = sizes  #: (n_i + n_c,) what the rounding errors of the solved rows of A and B are relative to
        self._found: tuple[SecondOrderModel, Signal] | None = None  #: the outputs that were asked for last

    @property
    def X(self) -> FloatArray:  # noqa: N802
        """(n, N) from the state: the full recovery."""
        return self.whole().X

    @property
    def U(self) -> tuple[FloatArray, ...]:  # noqa: N802
        """(n, m) each, from the inputs and their derivatives."""
        return self.whole().U

    def whole(self) -> Signal:
        """Return all displacements.

        Raises
        ------
        ModelSizeError
            Its matrices would have more than 2^26 entries.
        """
        n, N, m = self.leading.rows.size, *self.B.shape
        require_room(n, max(N, m), "The recovery of all DOFs", "Select the outputs that matter, or use `recover`.")
        return self.combined(sparse_unit(n))

    def derivative(self, A: FloatArray, B: FloatArray) -> Signal:
        """Differentiate once along the system's motion, equation (7)."""
        return self.whole().derivative(A, B)

    def plus(self, other: Signal) -> Signal:
        """Add another signal of the same size."""
        return self.whole().plus(other)

    def direct(self, inputs: int) -> FloatArray:
        """Give U_0, zeros if there is none."""
        return self.whole().direct(inputs)

    @limited_threads(1)
    def inverse_rows(self) -> FloatArray:
        """Return the (n_i + n_c, n) rows of W^-1 for p''_i and p'_c, gamma and alpha.

        Raises
        ------
        ModelSizeError
            More than 2^26 entries.
        """
        part = self.equation.partition
        moving = part.n_inertial + part.n_half
        require_room(moving, self.leading.rows.size, "gamma and alpha", "Their products with forces are in B.")
        rows = np.empty((moving, self.leading.rows.size))
        for block, z in inverse_rows(self.leading, part.order[:moving]):
            rows[block] = z.T * self.leading.rows
        return rows

    def combined(self, weights: Matrix) -> Signal:
        """Return ``weights q`` for a (k, n) matrix, dense or sparse."""
        return self._combined(as_sparse(weights))[0]

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model with these displacements, without coefficients that are rounding errors.

        Raises
        ------
        ModelSizeError
            C or D of the state space would have more than 2^26 entries.
        """
        if self._found is None or self._found[0] is not model:
            self._found = model, self._output(model)
        return self._found[1]

    def _output(self, model: SecondOrderModel) -> Signal:
        (N, m), p = self.B.shape, model.D.shape[0]
        remedy = "Select the outputs and inputs that matter: model.select(inputs=[...], outputs=[...])."
        require_room(p, max(m, 1), "D", remedy)
        require_room(p, max(N, 1), "C", remedy)
        parts = model.quadratics.F
        signal, size = self._combined(as_sparse(joined_sparse([[part] for part in parts])))
        direct = trimmed(tuple([as_sparse(matrix).toarray() for matrix in model.quadratics.D]))
        total, bound = Signal(np.zeros((p, N)), direct), Signal(np.zeros((p, N)), ())
        A, B = np.abs(self.A), self._input_sizes()[0]
        for order, part in enumerate(parts):
            if as_sparse(part).nnz == 0:
                continue
            motion, motion_size = _rows(signal, order * p, p), _rows(size, order * p, p)
            for _ in range(order):
                motion, motion_size = motion.derivative(self.A, self.B), motion_size.derivative(A, B)
            total, bound = total.plus(motion), bound.plus(motion_size)
        rounding = SHIFT_ROUNDING * min(self.leading.rows.size, 64)
        none = np.zeros((p, m))
        kept = [
            np.where(np.abs(part) <= rounding * scale, 0.0, part)
            for part, scale in zip_longest(total.U[1:], bound.U[1 : len(total.U)], fillvalue=none)
        ]
        return Signal(total.X, trimmed((*total.U[:1], *kept)))

    @limited_threads(1)
    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return q or q' (derivative 0 or 1) of all DOFs, (n, k), for states, inputs and derivatives of inputs."""
        part, forces = self.equation.partition, self.equation.forces
        for _ in range(derivative):
            x, inputs = self.A @ x + self.B @ inputs[0], inputs[1:]
        physical = x + sum((E @ u for E, u in zip(self.shift, inputs, strict=False)), np.zeros_like(x))
        n, moving = self.leading.rows.size, part.n_inertial + part.n_half
        q = np.empty((n, x.shape[1]))
        static = part.of_kind(STATIC)
        with progress_bar(x.shape[1], "times") as advance:
            for start in range(0, x.shape[1], COLUMNS_AT_A_TIME):
                span = slice(start, start + COLUMNS_AT_A_TIME)
                right = -times(self.equation.states, physical[:, span])
                for force, u in zip(forces, inputs, strict=False):
                    right += times(force, u[:, span])
                p = np.zeros_like(right)
                p[part.order[:moving]] = physical[:moving, span]
                if static.size:
                    p[static] = self.leading.solve(right)[static]
                q[:, span] = p if part.columns is None else times(part.columns, p)
                advance(right.shape[1])
        return q

    @limited_threads(1)
    def _combined(self, weights: SparseMatrix) -> tuple[Signal, Signal]:
        """Return ``weights q``, and what the rounding errors of its coefficients are relative to."""
        part, equation = self.equation.partition, self.equation
        given = part.mapped(weights)
        known = abs(given) if part.sizes is None else csc_array(abs(weights) @ part.sizes)
        moving = part.order[: part.n_inertial + part.n_half]
        X, X_size = np.zeros((2, weights.shape[0], self.B.shape[0]))
        X[:, : moving.size] = given[:, moving].toarray()
        static = csr_array(given * (part.kinds == STATIC))
        static.eliminate_zeros()
        first, same = _distinct_rows(static)
        states, by_forces, sizes = self._static_part(csr_array(static[first]))
        filled = np.flatnonzero(same >= 0)
        X[filled] -= states[same[filled]]
        X_size[:] = np.abs(X)
        X_size[:, : moving.size] = np.maximum(X_size[:, : moving.size], known[:, moving].toarray())
        E, E_size = self.shift, self._input_sizes()[1]
        U, U_size = [], []
        for power in range(max(len(equation.forces), len(E))):
            value, size = np.zeros((2, weights.shape[0], self.B.shape[1]))
            if power < len(equation.forces):
                value[filled] += by_forces[power][same[filled]]
                size[filled] += sizes[power][same[filled]]
            if power < len(E):
                value += X @ E[power]
                size += X_size @ E_size[power]
            U.append(value)
            U_size.append(size)
        return Signal(X, trimmed(tuple(U))), Signal(X_size, trimmed(tuple(U_size)))

    def _static_part(self, static: csr_array) -> tuple[FloatArray, list[FloatArray], list[FloatArray]]:
        """Multiply combinations of static coordinates (k, n) with their rows of W^-1 and with equation (3).

        Gives the products with its states (k, N) and with its forces (k, m) each, and what the rounding errors of
        these are relative to.
        """
        equation, leading = self.equation, self.leading
        columns = [equation.states, *equation.forces]
        products = [np.zeros((static.shape[0], part.shape[1])) for part in columns]
        sizes = [np.zeros_like(product) for product in products]
        needed = sum(int(np.count_nonzero(np.diff(part.indptr))) for part in columns)
        if static.shape[0] <= needed:
            scales = [abs(part).sum(axis=0) for part in columns]
            with progress_bar(static.shape[0], "solutions for outputs") as advance:
                for start in range(0, static.shape[0], COLUMNS_AT_A_TIME):
                    span = slice(start, start + COLUMNS_AT_A_TIME)
                    z = leading.solve_transposed(static[span].T.toarray(order="F"))
                    largest = largest_of_columns(z)
                    for turned, product, size, scale in zip(equation.transposes, products, sizes, scales, strict=True):
                        product[span], size[span] = turned.times(z).T, largest[:, None] * scale
                    advance(z.shape[1])
        else:
            weight = times(csc_array(abs(static)), leading.columns[:, None])
            with progress_bar(needed, "solutions for states and inputs") as advance:
                for part, product, size in zip(columns, products, sizes, strict=True):
                    filled = np.flatnonzero(np.diff(part.indptr))
                    for start in range(0, filled.size, COLUMNS_AT_A_TIME):
                        which = filled[start : start + COLUMNS_AT_A_TIME]
                        solution = leading.solve(part[:, which].toarray(order="F"))
                        product[:, which], size[:, which] = static @ solution, weight * leading.column_sizes(solution)
                        advance(which.size)
        return products[0], products[1:], sizes[1:]

    def _input_sizes(self) -> tuple[FloatArray, list[FloatArray]]:
        """Return what the rounding errors of B and of E_0, E_1 are relative to."""
        part, (N, m) = self.equation.partition, self.B.shape
        n_i, moving = part.n_inertial, part.n_inertial + part.n_half
        rates = []
        for force in self.equation.forces:
            size = np.zeros((N, m))
            solved = self.sizes[:, None] * abs(force).sum(axis=0)
            size[n_i:moving], size[moving:] = solved[n_i:], solved[:n_i]
            rates.append(size)
        B, shift = absorbed(np.abs(self.A), rates)
        return B, list(shift)


def _rows(signal: Signal, first: int, count: int) -> Signal:
    """Return some rows of a signal."""
    span = slice(first, first + count)
    return Signal(signal.X[span], trimmed(tuple([part[span] for part in signal.U])))


def _distinct_rows(matrix: csr_array) -> tuple[IndexArray, IndexArray]:
    """Find rows that differ: the first of each kind, and for each row which of these it equals (-1 if it is empty)."""
    matrix.sort_indices()
    kinds: dict[tuple[bytes, bytes], int] = {}
    first: list[int] = []
    same = np.full(matrix.shape[0], -1)
    for row in np.flatnonzero(np.diff(matrix.indptr)).tolist():
        span = slice(matrix.indptr[row], matrix.indptr[row + 1])
        key = matrix.indices[span].tobytes(), matrix.data[span].tobytes()
        if key not in kinds:
            kinds[key] = len(first)
            first.append(row)
        same[row] = kinds[key]
    return np.array(first, dtype=np.intp), same
