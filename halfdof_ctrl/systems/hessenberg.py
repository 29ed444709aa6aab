"""Evaluate ``C (s I - A)^-1 B + D`` at many points at once, without eigenvectors.

For one input b, a Householder reflection and a Hessenberg reduction give Q with Q^T b = beta e_1 and
H = Q^T A Q upper Hessenberg. Rows 2 to n of (s I - H) x = beta e_1 determine x from its last entry upwards,

    x_{k-1} = ((s - h_kk) x_k - sum_{j>k} h_kj x_j) / h_{k,k-1},                           (10)

and row 1 its length (M. A. Hyman, 1957). Substitution in a triangular matrix makes this componentwise backward
stable (N. J. Higham, Accuracy and Stability of Numerical Algorithms, section 14.6.1), defective A or not,
and (10) runs over the states with all points side by side, in blocks that are matrix products.

What Q mixes is lost where the output is small against the state, as in roll-off or far below the fastest pole. To
first order the relative error of a response H = c x + d is below

    eps max(|A|, |s|) |x| |y| / |H|,    (s I - A)^T y = c.

By reciprocity |y| is about |x| |c| / |b|. How much larger it is (in a chain whose links act one way, in a companion
form) is found at a few of the points. Where the bound is much, H is corrected once by the adjoint solution y on the
residual r in the original coordinates, c x + d + y^T r, r = b - (s I - A) x. What is left is the product of the errors
of x and y, with the residual r_y of y below

    |r| |r_y| |(s I - A)^-1|,    |(s I - A)^-1| at least |x| / |b| and |y| / |c|,

and what rounding does to r, entry by entry below

    eps |y|^T (|s| |x| + |A| |x| + |b|);

the rows of the residual are rounded by themselves, so that three times the root of the sum of squares does for many.

Where the first bound exceeds one (at the far end of a long chain), or the product says that x and y are too poor (in
states whose sizes no balancing makes even), a factorization of s I - A itself keeps the digits.
"""

import math
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dger
from scipy.linalg.lapack import dgehrd, dorghr

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, IndexArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.systems.adjoint_sizes import beyond_reciprocity
from halfdof_ctrl.systems.sparse_elimination import sparse_response

OUTER_BLOCK = 24  #: states whose substitution is done before the rest is updated by one matrix product
INNER_BLOCK = 4  #: states within that, before the rest of the block is updated by another
POINT_ENTRIES = 2**21  #: complex entries of states held at a time (32 MB)
POINTS_AT_ONCE = 1024  #: points at a time of so few states that a product of an inner block stays on one thread
HUGE, TINY = 2.0**400, 2.0**-400  #: a solution that grows beyond the one is scaled by the other
CUT_PRODUCTS = 60  #: up to which products are cut so that each runs on one thread; above, threads are limited
ONE_THREAD = 2**18  #: multiplications of a product up to which OpenBLAS takes one thread
SAFE_GROWTH = 2.0**125  #: growth from one state to the next up to which it is enough to look once an inner block
ZERO_SUBDIAGONAL = 2.0**-500  #: times the largest entry of H: below it h_{k,k-1} counts as zero
UNSAFE_CORRECTION = 1e-3  #: a correction above this part of the value calls for a solution in the original coordinates
SMALL_CORRECTION = 1e-9  #: of the value: smaller ones are right but for what counts as nothing if y has two digits
UNSAFE_PRODUCT = 1e-11  #: of the errors of x and y, estimated, over the value: above it, too
RISK = 1e-11  #: bound of the relative error above which a response is corrected; it exceeds the error by some 30 times
RISK_BY_STATE = 1.25e-12  #: the same for each of many states: the bound grows with their number, errors with its root
LAPACK_BLOCK = 64  #: most columns that LAPACK's reduction to Hessenberg form works on at once
WORST_POINTS = 16  #: corrected points with the largest bounds, at which rounding of the residual is bounded ...
INDEPENDENT = 3.0  #: times the root of the sum of squares, which a sum of independent rounding errors hardly exceeds
OTHER_POINTS = 16  #: ... and as many others, spread over all


def state_space_response(
    A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, points: ComplexArray
) -> ComplexArray:
    """Evaluate ``C (s I - A)^-1 B + D``.

    Parameters
    ----------
    A, B, C, D : (N, N), (N, m), (p, N), (p, m) ndarrays
        State space; balanced here by powers of two.
    points : (k,) complex ndarray
        Where to evaluate, s [rad/s] or z.

    Returns
    -------
    (p, m, k) complex ndarray
        ``inf + nan j`` at a pole.
    """
    return bounded_response(A, B, C, D, points).values


@dataclass(frozen=True, slots=True, eq=False)
class BoundedResponse:
    """Values of a state space with p outputs and m inputs at k points, and what rounding may have done to them."""

    values: ComplexArray  #: (p, m, k), ``inf + nan j`` at a pole
    bound: float  #: of their relative errors, the largest found; infinite where it was not looked for


def bounded_response(
    A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, points: ComplexArray
) -> BoundedResponse:
    """Evaluate ``C (s I - A)^-1 B + D``, with a bound of the error that evaluation adds.

    Parameters
    ----------
    A, B, C, D, points
        As of `state_space_response`.

    Examples
    --------
    >>> one = np.eye(1)
    >>> lag = bounded_response(-one, one, one, 0.0 * one, np.array([1j]))
    >>> lag.values.ravel().tolist(), lag.bound < 1e-10
    ([(0.5-0.5j)], True)
    """
    values = np.empty((*D.shape, points.size), dtype=np.complex128)
    values[:] = D[:, :, None]
    if A.shape[0] == 0:
        return BoundedResponse(values, 0.0)
    matrix, scale = balanced_states(A)
    balanced = np.asarray(matrix, dtype=np.float64)
    inputs, outputs = np.asarray(B / scale[:, None]), np.asarray(C * scale)
    with limited_threads(1) if len(A) > CUT_PRODUCTS else nullcontext():  # threads would wait for each other
        if B.shape[1] <= C.shape[0]:
            bound = _Channels(balanced, inputs, outputs).add_to(values, points)
        else:
            bound = _Channels(balanced.T, outputs.T, inputs.T).add_to(np.swapaxes(values, 0, 1), points)
    values[np.isnan(values)] = complex(np.inf, np.nan)
    return BoundedResponse(values, bound)


class _Channels:
    """``C (s I - A)^-1 B`` with the solvers of its inputs and, where they are needed, of its outputs."""

    def __init__(self, A: FloatArray, B: FloatArray, C: FloatArray) -> None:
        self.A, self.B, self.C = A, B, C
        self.adjoints: dict[int, ShiftedSolver] = {}
        self.lengths, self.size = np.linalg.norm(C, axis=1), float(np.linalg.norm(A, 1))
        self.risk, self.bound = max(RISK, RISK_BY_STATE * len(A)), 0.0

    def add_to(self, values: ComplexArray, points: ComplexArray) -> float:
        """Add it to values (p, m, k), an input at a time; return the largest bound of a relative error."""
        batch = POINTS_AT_ONCE if len(self.A) <= CUT_PRODUCTS else max(1, POINT_ENTRIES // len(self.A))
        for j in range(self.B.shape[1]):
            solver = ShiftedSolver(self.A, self.B[:, j])
            rotated = self.C @ solver.Q
            for start in range(0, points.size, batch):
                part = slice(start, start + batch)
                values[:, j, part] += self._responses(j, solver, rotated, points[part], values[:, j, part])
        return self.bound

    def _responses(
        self, j: int, solver: "ShiftedSolver", rotated: FloatArray, points: ComplexArray, direct: ComplexArray
    ) -> ComplexArray:
        """Return the response to one input besides the direct one, corrected where its bound says so."""
        x = solver.solve(points)
        with np.errstate(invalid="ignore", over="ignore"):
            response = _real_times_complex(rotated, x)
            size, squares = np.abs(response + direct), _squared_norms(x)
            bound = EPS * self.lengths[:, None] * (np.maximum(self.size, np.abs(points)) * squares / abs(solver.beta))
            if len(solver.H) > 1:
                sizes = np.sqrt(squares)
                bound *= beyond_reciprocity(solver.H, solver.beta, rotated, self.lengths, points, sizes)[:, None]
            small, hopeless = bound > self.risk * size, bound > size
            cancelled = EPS * np.abs(direct) > self.risk * size  # which no solution of another x mends
        if cancelled.any():
            self.bound = np.inf
        if not small.any():
            self.bound = max(self.bound, self.risk)
            return response
        for i in np.flatnonzero(hopeless.any(axis=1)).tolist():
            response[i, hopeless[i]] = sparse_response(self.A, self.B[:, j], self.C[i], points[hopeless[i]])
            self.bound = np.inf
        small &= ~hopeless
        for i in np.flatnonzero(small.any(axis=1)).tolist():
            at = np.flatnonzero(small[i])
            risk = bound[i, at] / size[i, at]
            solution = solver, x[:, at]
            response[i, at] = self._corrected(direct[i, at], (i, j), points[at], solution, risk)
        return response

    def _corrected(
        self,
        direct: ComplexArray,
        channel: tuple[int, int],
        points: ComplexArray,
        solution: tuple["ShiftedSolver", ComplexArray],
        risk: FloatArray,
    ) -> ComplexArray:
        """Return ``c x + y^T (b - (s I - A) x)``, x no longer mixed, or solve again where that is far from c x."""
        (i, j), (solver, x) = channel, solution
        b, c = self.B[:, j], self.C[i]
        if i not in self.adjoints:
            self.adjoints[i] = ShiftedSolver(self.A.T, c)
        adjoint = self.adjoints[i]
        state = _real_times_complex(solver.Q, x)
        residual = b[:, None] - points * state + _real_times_complex(self.A, state)
        y = _real_times_complex(adjoint.Q, adjoint.solve(points))
        correction = (y * residual).sum(axis=0)
        refined = np.asarray(_real_times_complex(c[None], state)[0] + correction)
        total = np.abs(refined + direct)
        unsafe = ~(np.abs(correction) <= UNSAFE_CORRECTION * total)
        if not (np.abs(correction) <= SMALL_CORRECTION * total).all():
            left = _norms(residual) * _norms(c[:, None] - points * y + _real_times_complex(self.A.T, y))
            left *= np.maximum(_norms(x) / abs(solver.beta), _norms(y) / abs(adjoint.beta))
            unsafe |= ~(left <= UNSAFE_PRODUCT * total)
        if unsafe.any():
            refined[unsafe] = sparse_response(self.A, b, c, points[unsafe])
            self.bound = np.inf
        if self.bound < np.inf:
            looked_at = _looked_at(risk)
            x_size, y_size = np.abs(state[:, looked_at]), np.abs(y[:, looked_at])
            terms = np.abs(points[looked_at]) * x_size + np.abs(self.A) @ x_size + np.abs(b)[:, None]
            shares = EPS * y_size * terms
            rounding = np.minimum(shares.sum(axis=0), INDEPENDENT * np.linalg.norm(shares, axis=0))
            rounding += EPS * (np.abs(c) @ x_size)
            left = (rounding + np.abs(correction[looked_at]) * UNSAFE_CORRECTION) / total[looked_at]
            self.bound = max(self.bound, float(left.max()))
        return refined


def _looked_at(risk: FloatArray) -> IndexArray:
    """Return the places of the largest risks, and of others spread over all."""
    if risk.size <= WORST_POINTS + OTHER_POINTS:
        return np.arange(risk.size)
    spread = np.linspace(0, risk.size - 1, OTHER_POINTS).astype(np.intp)
    return np.unique(np.concatenate([np.argpartition(-risk, WORST_POINTS)[:WORST_POINTS], spread]))


class ShiftedSolver:
    """``Q x = (s I - A)^-1 b`` for one b and many s, by equation (10)."""

    def __init__(self, A: FloatArray, b: FloatArray) -> None:
        H, Q, self.beta = _hessenberg(A, b)
        below = np.abs(H.diagonal(-1))
        stops = np.flatnonzero(below <= ZERO_SUBDIAGONAL * np.abs(H).max())
        reached = int(stops[0]) + 1 if stops.size else H.shape[0]
        self.H: FloatArray = np.ascontiguousarray(H[:reached, :reached])  #: the part that b reaches
        self.Q: FloatArray = Q[:, :reached]  #: (N, reached) its orthonormal basis

    def solve(self, points: ComplexArray) -> ComplexArray:
        """Return x, (reached, k), in the coordinates of Q."""
        n, k = self.H.shape[0], points.size
        x = np.empty((n, k), dtype=np.complex128)
        x[n - 1] = 1.0
        length = points * x[0] - self.H[0, 0] if n == 1 else self._substituted(x, points)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x *= self.beta / length
        return x

    def _substituted(self, x: ComplexArray, points: ComplexArray) -> ComplexArray:
        """Fill x from its last row upwards, and return row 1 of (s I - H) x."""
        H, n, real = self.H, len(x), x.view(np.float64)
        growth = self._growth(points)
        inner = INNER_BLOCK if growth < SAFE_GROWTH else 1
        may_be_huge = n * math.log(growth) > math.log(HUGE)
        row = np.empty(x.shape[1], dtype=np.complex128)
        for stop in range(n, 0, -OUTER_BLOCK):
            first = max(0, stop - OUTER_BLOCK)
            sums = _sums(H[first:stop, stop - 1 :], real[stop - 1 :])  # row i: sum of h_ij x_j over the known j
            for end in range(stop, first, -inner):
                begin = max(first, end - inner)
                part = sums[begin - first : end - first]
                if end < stop:
                    part += H[begin:end, end - 1 : stop - 1] @ real[end - 1 : stop - 1]
                for i in range(end - 1, begin - 1, -1):
                    np.multiply(points, x[i], out=row)
                    row.view(np.float64)[:] -= part[i - begin]
                    if i == 0:
                        return row
                    np.multiply(row.view(np.float64), 1.0 / H[i, i - 1], out=real[i - 1])
                    above = i - begin
                    if above:
                        dger(1.0, real[i - 1], H[begin:i, i - 1], a=part[:above].T, overwrite_a=True)
                if may_be_huge:
                    found = real[begin - 1 : end - 1]
                    if max(found.max(), -found.min()) > HUGE:
                        _scale_down(x[begin - 1 :], end - begin, sums.view(np.complex128))
        return row

    def _growth(self, points: ComplexArray) -> float:
        """Bound how much larger a state may be than the largest of those below it; at least one."""
        H = self.H
        rows = np.abs(points).max(initial=0.0) + np.abs(H[1:]).sum(axis=1)
        return max(1.0, float((rows / np.abs(H.diagonal(-1))).max(initial=0.0)))


def _hessenberg(A: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return H, Q and beta: what LAPACK makes of ``[[0, 0], [b, A]]``, whose first unit vector it keeps."""
    n = len(A)
    bordered = np.zeros((n + 1, n + 1), order="F")
    bordered[1:, 0], bordered[1:, 1:] = b, A
    work = LAPACK_BLOCK * (n + 1 + LAPACK_BLOCK + 1)
    reduced, tau, _ = dgehrd(bordered, lwork=work, overwrite_a=True)
    Q, _ = dorghr(reduced, tau, lwork=work)
    H = reduced[1:, 1:]
    for column in range(n - 2):
        H[column + 2 :, column] = 0.0
    return H, Q[1:, 1:], float(reduced[1, 0])


def _scale_down(known: ComplexArray, new: int, sums: ComplexArray) -> None:
    """Scale the points whose solution has grown in its new rows, in all that depends on it."""
    rows = known[:new]
    grown = np.maximum(np.abs(rows.real), np.abs(rows.imag)).max(axis=0) > HUGE
    known[:, grown] *= TINY
    sums[:, grown] *= TINY


def _sums(matrix: FloatArray, x: FloatArray) -> FloatArray:
    """Return the product, in pieces so small that none starts threads, which takes longer than the work itself."""
    if len(x) == 1:  # the ones of the last state
        return np.multiply(matrix, x)
    piece = ONE_THREAD // matrix.size
    if piece >= x.shape[1] or len(x) > CUT_PRODUCTS:
        return np.asarray(matrix @ x)
    result = np.empty((len(matrix), x.shape[1]))
    for start in range(0, x.shape[1], piece):
        np.matmul(matrix, x[:, start : start + piece], out=result[:, start : start + piece])
    return result


def _real_times_complex(matrix: FloatArray, x: ComplexArray) -> ComplexArray:
    """Multiply as one real product, half the work of a complex one."""
    return (matrix @ np.ascontiguousarray(x).view(np.float64)).view(np.complex128)


def _norms(x: ComplexArray) -> FloatArray:
    return np.sqrt(_squared_norms(np.ascontiguousarray(x)))


def _squared_norms(x: ComplexArray) -> FloatArray:
    real = x.view(np.float64)
    squares = np.einsum("ij,ij->j", real, real)
    return np.asarray(squares[0::2] + squares[1::2])
