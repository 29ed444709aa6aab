"""Solutions of (s I - A) x = b and P(s) q = f at several points s, and their corrections beyond the last digit.

Columns of a right-hand side belong to the points in turn: first all of the first point, then all of the second.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from scipy.linalg.lapack import zgesv, zgetrf, zgetrs
from scipy.sparse import csc_array, diags_array, eye_array, hstack

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, Matrix, as_dense, powers_of_two
from halfdof_ctrl.base.exact_products import SMALL_MATRIX, ExactPolynomial, as_it_is
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.scaling import max_scaling

Solver: TypeAlias = Callable[[ComplexArray], ComplexArray]

TRIED_ROUNDINGS = 2  #: of coefficients at random
MOST_ANSWER_CORRECTIONS = 4  #: of a solution
CORRECTED = 1e-22  #: of what is seen: a smaller correction is the last one
STUCK_SHARE = 0.3  #: of a correction, that the next one must be below, ...
STUCK_ABOVE = 1e-24  #: ... as long as it is more than that of the unknowns: else the factors are too poor
CERTAIN_DIGITS = 1e-4  #: of a solution: where its first correction is smaller, the rounding of residuals is nothing
NOISE_DEVIATION = 10.0  #: times what rounding of residuals at random does in an output, which may be more
SETTLED_DIGIT = 2.0**-96  #: of the largest product in a sum: what sums of twice the working precision have
FACTORIZED_AGAIN = 12  #: unknowns up to which that costs less than the threads that zgetrs starts on a busy machine


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Equations:
    """``R(s) x = B(s) u`` and ``y = C(s) x + D(s) u``, for n unknowns, m inputs and p outputs: coefficients of s^k."""

    R: Sequence[Matrix]  #: (n, n) each
    B: Sequence[FloatArray]  #: (n, m) each
    C: Sequence[Matrix]  #: (p, n) each
    D: Sequence[FloatArray]  #: (p, m) each

    def seen(self, s: ComplexArray, x: ComplexArray) -> ComplexArray:
        """Return ``C(s) x``, each column at its point."""
        return np.asarray(sum(np.asarray(part @ (s**k * x)) for k, part in enumerate(self.C)))

    def sizes(self, s: ComplexArray, x: ComplexArray | FloatArray) -> FloatArray:
        """Return the sizes of the terms of that."""
        return sizes_of_terms(self.C, s, x)

    def grown(self, s: ComplexArray, u: ComplexArray) -> FloatArray:
        """Return the sizes of what passes directly and grows with frequency."""
        return sizes_of_terms([np.zeros_like(self.D[0]), *self.D[1:]], s, u)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Response:
    """What equations answer, known beyond the last digit, in k columns."""

    x: ComplexArray  #: (n, k) rounded
    y: ComplexArray  #: (p, k)
    rounding: FloatArray  #: (p, k) what y is known to
    shown: FloatArray  #: (p, k) what ``C(s) x`` would be if all unknowns were as large as the largest


def refined_response(equations: Equations, solve: Solver, s: ComplexArray, u: ComplexArray) -> Response:
    """Solve for k columns, each at its point, and correct the solution until nothing that is seen of it changes.

    Sums are as precise as the largest entry of a row times the largest unknown. So unknowns are measured in powers of
    two near what they turn out to be.

    Parameters
    ----------
    equations : Equations
    solve : callable
        Gives ``R(s)^-1`` times an (n, k) array to a digit or two.
    s : (k,) complex ndarray
    u : (m, k) complex ndarray
    """
    x = solve(np.asarray(sum(part @ (s**k * u) for k, part in enumerate(equations.B))))
    units = powers_of_two(np.abs(x).max(axis=1, initial=0.0))
    equation, output = (
        ExactPolynomial([_beside(left, units, right) for left, right in zip(*parts, strict=True)])
        for parts in ((equations.R, [-part for part in equations.B]), (equations.C, equations.D))
    )

    def together(x: ComplexArray, u: ComplexArray) -> ComplexArray:
        return np.concatenate([units[:, None] * x, u])

    def largest(part: ComplexArray) -> FloatArray:
        return np.asarray(np.abs(units[:, None] * part).max(axis=0, initial=0.0))

    rest = equation.residual(s, together(x, u))
    low = step = solve(rest)
    enough, every, after = CORRECTED * np.abs(equations.seen(s, x)), largest(x), largest(step)
    alike = every / units[:, None]
    noise = np.zeros_like(enough)
    if not (after <= CERTAIN_DIGITS * every).all():
        noise = _noise_of_residuals(equations, solve, s, alike, u)
    stuck = np.zeros(s.size, dtype=np.bool_)
    for _ in range(MOST_ANSWER_CORRECTIONS - 1):
        if (np.abs(equations.seen(s, step)) <= enough).all():
            break
        before = after
        rest = equation.residual(s, together(step, np.zeros_like(u)), rest)
        step = solve(rest)
        low, after = low + step, largest(step)
        stuck = (after > STUCK_SHARE * before) & (after > STUCK_ABOVE * every)
    rounding = noise + np.abs(equations.seen(s, step)) + EPS * equations.sizes(s, low)
    return Response(
        x=x,
        y=np.asarray(equations.seen(s, low) - output.residual(s, together(x, u))),
        rounding=np.where(stuck, np.inf, rounding + SETTLED_DIGIT * equations.sizes(s, alike)),
        shown=equations.sizes(s, np.broadcast_to(np.abs(x).max(axis=0, initial=0.0), x.shape)),
    )


def _noise_of_residuals(
    equations: Equations, solve: Solver, s: ComplexArray, x: FloatArray, u: ComplexArray
) -> FloatArray:
    """Return what the rounding of residuals, in unknowns of some sizes, may do in the outputs: tried at random."""
    terms = SETTLED_DIGIT * (sizes_of_terms(equations.R, s, x) + sizes_of_terms(equations.B, s, u))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], terms.shape)
    return NOISE_DEVIATION * np.abs(equations.seen(s, solve((signs * terms).astype(np.complex128))))


def state_equations(A: FloatArray, B: FloatArray, C: FloatArray, D: Sequence[FloatArray]) -> Equations:
    """Return ``(s I - A) x = B u`` and ``y = C x + D(s) u``."""
    N, none = len(A), [np.zeros_like(C) for _ in D[1:]]
    unit = np.eye(N) if N**2 <= SMALL_MATRIX else csc_array(eye_array(N))
    return Equations(R=[as_it_is(-A), unit], B=[B, np.zeros_like(B)], C=[C, *none], D=D)


def moved_by_rounding(
    motion: Equations, answer: Solver, points: ComplexArray, s: ComplexArray, x: ComplexArray
) -> FloatArray:
    """Return what rounding of the coefficients of R at random changes in the outputs.

    Parameters
    ----------
    motion : Equations
    answer : callable
        Gives ``R(s)^-1`` times an (n, k) array, its columns at the points in turn.
    points : (l,) complex ndarray
    s : (k,) complex ndarray
        Where the columns of x are: as many at each point.
    x : (n, k) complex ndarray
        Their solutions.
    """
    terms = sizes_of_terms(motion.R, s, x).reshape(len(x), points.size, 1, -1)
    signs = np.random.default_rng(0).uniform(-1.0, 1.0, (*terms.shape[:2], TRIED_ROUNDINGS, terms.shape[3]))
    force = (EPS * terms * signs).reshape(len(x), -1).astype(np.complex128)  # of each point side by side
    changes = np.abs(motion.seen(np.repeat(points, force.shape[1] // points.size), answer(force)))
    return np.asarray(changes.reshape(len(changes), *signs.shape[1:]).max(axis=2).reshape(len(changes), -1))


def sizes_of_terms(coefficients: Sequence[Matrix], s: ComplexArray, x: ComplexArray | FloatArray) -> FloatArray:
    """Return ``|C_0| |x| + |C_1| |s x| + ...``."""
    return np.asarray(sum(np.asarray(abs(part) @ np.abs(s**k * x)) for k, part in enumerate(coefficients)))


def sizes_at(coefficients: Sequence[Matrix], speed: float) -> Any:  # noqa: ANN401  # a matrix of the kind that is given
    """Return ``|K| + |C| speed + |M| speed^2``."""
    parts: list[Any] = list(coefficients)
    total = abs(parts[0])
    for k, part in enumerate(parts[1:], 1):
        total = total + abs(part) * speed**k
    return total


def _beside(left: Matrix, units: FloatArray, right: FloatArray) -> Matrix:
    """Put a matrix, whose unknowns are measured in some units, and one of inputs side by side."""
    if isinstance(left, np.ndarray):
        return as_it_is(np.hstack([left / units, right]))
    return csc_array(hstack([left @ diags_array(1.0 / units), csc_array(right)]))


class StateSolver:
    """``(s I - A)^-1``, factorized; where k states are derivatives of others, with k rows and columns less.

    With ``A = [0 E; P R]``, E diagonal, of the k first rows ``E v = s p - b`` follows, and

        (s - R) v - P p = c   is   ((s - R) E^-1 s - P) p = c + (s - R) E^-1 b.

    Raises
    ------
    numpy.linalg.LinAlgError
        A point is an eigenvalue.
    """

    def __init__(self, A: FloatArray, points: complex | ComplexArray) -> None:
        self.points = np.atleast_1d(np.asarray(points, dtype=np.complex128))
        self.matrix, self.scale = balanced_states(A)
        N = len(A)
        self.k = k = _derivatives(self.matrix)
        self.rates = np.diagonal(self.matrix[:k, N - k :])[:, None].copy()
        self.parts: list[tuple[complex, ComplexArray, Solver]] = []
        for s in self.points.tolist() if N else []:
            lower = s * np.eye(N)[k:] - self.matrix[k:]
            onto = lower[:, N - k :] / self.rates.T
            reduced = lower[:, : N - k].copy()
            reduced[:, :k] += s * onto
            self.parts.append((s, onto, factorized(reduced)))

    def solve(self, right: ComplexArray) -> ComplexArray:
        """Return ``(s I - A)^-1 right`` for an (N, k) array."""
        return np.asarray(self.scale[:, None] * self.balanced_solve(right / self.scale[:, None]))

    def balanced_solve(self, right: ComplexArray) -> ComplexArray:
        """Return the same for the balanced A."""
        if not self.parts:
            return right
        pieces = []
        for (s, onto, inner), part in zip(self.parts, np.hsplit(right, len(self.parts)), strict=True):
            upper, k = part[: self.k], self.k
            first = inner(part[k:] + onto @ upper)
            pieces += [np.concatenate([first, (s * first[:k] - upper) / self.rates])]
        return np.hstack(pieces)


def pencil_solver(P: Sequence[Matrix], points: ComplexArray) -> Solver:
    """Factorize ``P(s) = P_0 + P_1 s + P_2 s^2`` at each point and return what solves with it.

    Raises
    ------
    numpy.linalg.LinAlgError
        A point is an eigenvalue.
    """
    dense = [as_dense(part) for part in P]
    solvers = [factorized(np.asarray(sum(s**k * part for k, part in enumerate(dense)))) for s in points.tolist()]

    def solve(right: ComplexArray) -> ComplexArray:
        parts = np.hsplit(right, len(solvers))
        return np.hstack([inner(part) for inner, part in zip(solvers, parts, strict=True)])

    return solve


def scaled_pencil_solver(model: SecondOrderModel, points: ComplexArray) -> Solver:
    """Factorize ``P(s)`` of a model at each point, in units that are even there, and return what solves with it.

    Raises
    ------
    numpy.linalg.LinAlgError
        A point is an eigenvalue.
    """
    P = [as_dense(part) for part in model.quadratics.P]
    scalings = [max_scaling(sizes_at(P, abs(s)), even=2.0) for s in points.tolist()]
    solvers = [pencil_solver([scaling.of(part) for part in P], points[k : k + 1]) for k, scaling in enumerate(scalings)]

    def solve(force: ComplexArray) -> ComplexArray:
        parts = zip(scalings, solvers, np.hsplit(force, len(solvers)), strict=True)
        return np.hstack([columns[:, None] * inner(rows[:, None] * part) for (rows, columns), inner, part in parts])

    return solve


def factorized(matrix: ComplexArray) -> Solver:
    """Factorize a complex matrix and return what solves with it.

    Raises
    ------
    numpy.linalg.LinAlgError
        It is singular.
    """
    factors, pivots, _ = zgetrf(matrix)
    if not np.abs(np.diag(factors)).min() > 0.0:
        msg = "s is an eigenvalue"
        raise np.linalg.LinAlgError(msg)
    if len(matrix) <= FACTORIZED_AGAIN:
        return lambda right: np.asarray(zgesv(matrix, right)[2])
    return lambda right: np.asarray(zgetrs(factors, pivots, right)[0])


def _derivatives(A: FloatArray) -> int:
    """Count the first states whose derivatives are last states, but for a factor."""
    N = len(A)
    for k in range(N // 2, 0, -1):
        block = A[:k, N - k :]
        if np.count_nonzero(A[:k]) == k and np.diagonal(block).all():
            return k
    return 0
