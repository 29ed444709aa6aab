"""Evaluate ``C (s I - A)^-1 B + D`` at many points at once, without eigenvectors.

For one input b, a Householder reflection and a Hessenberg reduction give Q with Q^T b = beta e_1 and
H = Q^T A Q upper Hessenberg. Rows 2 to n of (s I - H) x = beta e_1 determine x from its last entry upwards,

    x_{k-1} = ((s - h_kk) x_k - sum_{j>k} h_kj x_j) / h_{k,k-1},                           (10)

and row 1 its length (M. A. Hyman, 1957). Substitution in a triangular matrix makes this componentwise backward
stable (N. J. Higham, Accuracy and Stability of Numerical Algorithms, section 14.6.1), defective A or not,
and (10) runs over the states with all points side by side, in blocks that are matrix products.

What Q mixes is lost where the output is small against the state, as in roll-off or far below the fastest pole. To
first order the relative error of a response H = c x is below

    eps |A| |x| |y| / |H|,    (s I - A)^T y = c,    |y| about |x| |c| / |b|,

the last by reciprocity. Where that is much, H is corrected once by the adjoint solution y on the residual in the
original coordinates, c x + y^T (b - (s I - A) x), whose error is the product of the errors of x and y. Where the
bound exceeds one (at the far end of a long chain) a sparse factorization of s I - A itself keeps the digits.
"""

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.systems.sparse_elimination import sparse_response

SUBSTITUTION_BLOCK = 12  #: states whose substitution is done before the rest is updated by one matrix product
POINT_ENTRIES = 2**21  #: complex entries of states held at a time (32 MB)
HUGE, TINY = 2.0**400, 2.0**-400  #: a solution that grows beyond the one is scaled by the other
ZERO_SUBDIAGONAL = 2.0**-500  #: times the largest entry of H: below it h_{k,k-1} counts as zero
UNSAFE_CORRECTION = 1e-3  #: a correction above this part of the value calls for a solution in the original coordinates
RISK = 1e-11  #: bound of the relative error above which a response is corrected; it exceeds the error by some 30 times


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
    values = np.empty((*D.shape, points.size), dtype=np.complex128)
    values[:] = D[:, :, None]
    if A.shape[0] == 0:
        return values
    matrix, scale = balanced_states(A)
    balanced = np.asarray(matrix, dtype=np.float64)
    inputs, outputs = np.asarray(B / scale[:, None]), np.asarray(C * scale)
    batch = max(1, POINT_ENTRIES // A.shape[0])
    if B.shape[1] <= C.shape[0]:
        _add_channels(values, balanced, inputs, outputs, points, batch)
    else:
        _add_channels(np.swapaxes(values, 0, 1), balanced.T, outputs.T, inputs.T, points, batch)
    values[np.isnan(values)] = complex(np.inf, np.nan)
    return values


def _add_channels(
    values: ComplexArray, A: FloatArray, B: FloatArray, C: FloatArray, points: ComplexArray, batch: int
) -> None:
    """Add ``C (s I - A)^-1 B`` to values (p, m, k), an input at a time."""
    adjoints: dict[int, ShiftedSolver] = {}
    lengths, size = np.linalg.norm(C, axis=1), float(np.linalg.norm(A, 1))
    for j in range(B.shape[1]):
        solver = ShiftedSolver(A, B[:, j])
        rotated = C @ solver.Q
        for start in range(0, points.size, batch):
            part = points[start : start + batch]
            x = solver.solve(part)
            with np.errstate(invalid="ignore", over="ignore"):
                response = _real_times_complex(rotated, x)
                bound = EPS * size * _column_norms(x) ** 2 * lengths[:, None] / abs(solver.beta)
                small = bound > RISK * np.abs(response)
                hopeless = bound > np.abs(response)
            for i in np.flatnonzero(hopeless.any(axis=1)).tolist():
                response[i, hopeless[i]] = sparse_response(A, B[:, j], C[i], part[hopeless[i]])
            small &= ~hopeless
            for i in np.flatnonzero(small.any(axis=1)).tolist():
                if i not in adjoints:
                    adjoints[i] = ShiftedSolver(A.T, C[i])
                response[i, small[i]] = _refined(
                    response[i, small[i]], (A, B[:, j], C[i]), part[small[i]], (solver, x[:, small[i]]), adjoints[i]
                )
            values[:, j, start : start + batch] += response


def _refined(
    response: ComplexArray,
    system: tuple[FloatArray, FloatArray, FloatArray],
    points: ComplexArray,
    solution: tuple["ShiftedSolver", ComplexArray],
    adjoint: "ShiftedSolver",
) -> ComplexArray:
    """Add ``y^T (b - (s I - A) x)`` to the response ``c x``, or solve again where that is not small."""
    (A, b, c), (solver, x) = system, solution
    state = _real_times_complex(solver.Q, x)
    residual = b[:, None] - points * state + _real_times_complex(A, state)
    correction = (_real_times_complex(adjoint.Q, adjoint.solve(points)) * residual).sum(axis=0)
    refined = np.asarray(response + correction)
    unsafe = np.abs(correction) > UNSAFE_CORRECTION * np.abs(refined)
    if unsafe.any():
        refined[unsafe] = sparse_response(A, b, c, points[unsafe])
    return refined


class ShiftedSolver:
    """``Q x = (s I - A)^-1 b`` for one b and many s, by equation (10)."""

    def __init__(self, A: FloatArray, b: FloatArray) -> None:
        reflected, mirror, self.beta = _reflected(A, b)
        H, Q = scipy.linalg.hessenberg(reflected, calc_q=True, overwrite_a=True, check_finite=False)
        below = np.abs(np.diagonal(H, -1))
        stops = np.flatnonzero(below <= ZERO_SUBDIAGONAL * np.abs(H).max())
        reached = int(stops[0]) + 1 if stops.size else H.shape[0]
        self.H = np.ascontiguousarray(H[:reached, :reached])  #: the part of H that b reaches
        self.Q = (Q - np.outer(mirror, mirror @ Q))[:, :reached]  #: (N, reached) its orthonormal basis

    def solve(self, points: ComplexArray) -> ComplexArray:
        """Return x, (reached, k), in the coordinates of Q."""
        H = self.H
        n, k = H.shape[0], points.size
        x = np.empty((n, k), dtype=np.complex128)
        x[n - 1] = 1.0
        real = x.view(np.float64)
        length = np.empty(k, dtype=np.complex128)
        scratch = np.empty((SUBSTITUTION_BLOCK, 2 * k))
        for stop in range(n, 0, -SUBSTITUTION_BLOCK):
            first = max(0, stop - SUBSTITUTION_BLOCK)
            sums = H[first:stop, stop - 1 :] @ real[stop - 1 :]  # row i: sum of h_ij x_j over the known j
            for i in range(stop - 1, first - 1, -1):
                row = points * x[i]
                row -= sums[i - first].view(np.complex128)
                if i == 0:
                    length = row
                    break
                np.multiply(row, 1.0 / H[i, i - 1], out=x[i - 1])
                if max(real[i - 1].max(), -real[i - 1].min()) > HUGE:
                    _scale_down(x[i - 1 :], sums.view(np.complex128))
                if i > first:
                    sums[: i - first] += np.multiply(H[first:i, i - 1 : i], real[i - 1], out=scratch[: i - first])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x *= self.beta / length
        return x


def _reflected(A: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Reflect so that b becomes beta e_1: give P A P, v and beta, P = I - v v^T."""
    norm = float(np.linalg.norm(b))
    if not b[1:].any():
        return A.copy(), np.zeros_like(b), float(b[0])
    sign = -1.0 if b[0] > 0.0 else 1.0
    v = b / norm
    v[0] -= sign
    v *= np.sqrt(2.0) / np.linalg.norm(v)
    reflected = A - np.outer(v, v @ A)
    return reflected - np.outer(reflected @ v, v), v, sign * norm


def _scale_down(known: ComplexArray, sums: ComplexArray) -> None:
    """Scale the points whose solution has grown, in all that depends on it."""
    grown = np.abs(known[0]) > HUGE
    known[:, grown] *= TINY
    sums[:, grown] *= TINY


def _real_times_complex(matrix: FloatArray, x: ComplexArray) -> ComplexArray:
    """Multiply as one real product, half the work of a complex one."""
    return (matrix @ np.ascontiguousarray(x).view(np.float64)).view(np.complex128)


def _column_norms(x: ComplexArray) -> FloatArray:
    real = x.view(np.float64)
    squares = np.einsum("ij,ij->j", real, real)
    return np.asarray(np.sqrt(squares[0::2] + squares[1::2]))
