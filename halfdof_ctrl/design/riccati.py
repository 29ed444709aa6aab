"""The stabilizing solution of the Riccati equation, with the error of its gain.

    A^T X + X A + Q - (X B + N) R^-1 (B^T X + N^T) = 0,    K = R^-1 (B^T X + N^T)          (30)

A solver gives a first X, in states balanced by powers of two (or as they are where they have one unit already, as
those of the energy), with R turned to the identity, with time measured by |A| and with X = g Y measured so that Q and
B B^T are of one size: whatever the units of force, length and time, it sees the same numbers. Newton's method
(D. L. Kleinman, 1968) then works on the residual of (30), which is formed in about twice the working precision:

    (A - B K)^T dX + dX (A - B K) = -residual,    K + B^T dX.

Each step is one real Schur form of A - B K. What remains is the last step; and what the rounding of the entries of
A, B, Q and N does to the gain, of which three random samples are pushed through the same Schur form. The last step
alone underestimates the error a thousandfold where the equation is ill conditioned.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import control
import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dtrsyl

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, FloatArray
from halfdof_ctrl.base.double_double import Double2, added, matrix_product, two_sum
from halfdof_ctrl.base.spectrum import balanced_states

Solver = Literal["scipy", "slycot"]

SETTLED = 1e-15  #: a step that changes the gain by less is the last one
MOST_STEPS = 100  #: each at least halves the distance, from however far
FROM_AFAR = 0.3  #: relative steps above this one are not yet those of fast convergence, and may stagnate
REFINEMENTS = 1  #: of the solution for a random rounding
SAMPLES = 3  #: random roundings
CAUTION = 3.0  #: times the last step and the largest sample: the error that is stated; true errors reach 1.3 of it
GAP = 1e3  #: ratio of neighbouring eigenvalues at which fast and slow parts are told apart
SHIFTS = tuple(10.0**power for power in range(-14, -1, 2))  #: of |A|, by which a start is made stable


@dataclass(frozen=True, slots=True, eq=False)
class CareProblem:
    """Equation (30) for N states and m inputs."""

    A: FloatArray
    B: FloatArray
    Q: FloatArray
    R: FloatArray
    N: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class CareSolution:
    """The stabilizing solution of (30)."""

    K: FloatArray  #: (m, N)
    X: FloatArray  #: (N, N)
    error: float  #: estimated error of K, relative to it, both in scaled states


def solved_care(problem: CareProblem, method: Solver, *, balance: bool = True) -> CareSolution | None:
    """Solve (30); None where no stabilizing gain is found.

    Parameters
    ----------
    problem : CareProblem
    method : {"scipy", "slycot"}
        Whose solution is the start; the other one's is tried where it does not stabilize.
    balance : bool
        Whether states are to be balanced: not where they have one unit already.

    Returns
    -------
    CareSolution or None
    """
    scaled, scale = _scaled(problem, balance=balance)
    best: CareSolution | None = None
    for start in _starts(scaled.problem, method):
        found = _by_newton(scaled.problem, *start)
        if found is not None and (best is None or found.error < best.error):
            best = found
        if best is not None and best.error < math.sqrt(UNIT_ROUNDOFF):
            break
    if best is None:
        return None
    if balance:
        best = _in_states_of_closed_loop(scaled.problem, best)
    gain = scaled.input_scale @ best.K / scale
    X = best.X * scaled.size / scale / scale[:, None]
    return CareSolution(gain, (X + X.T) / 2.0, best.error)


@dataclass(frozen=True, slots=True, eq=False)
class _Scaled:
    problem: CareProblem  #: with R the identity
    input_scale: FloatArray  #: (m, m) u = input_scale w
    size: float  #: X = size Y


def _scaled(problem: CareProblem, *, balance: bool) -> tuple[_Scaled, FloatArray]:
    """Free the problem from the units of states, inputs, time and cost; return it and the factors of the states."""
    problem = replace(problem, Q=(problem.Q + problem.Q.T) / 2.0, R=(problem.R + problem.R.T) / 2.0)
    folded = problem.A - problem.B @ np.linalg.solve(problem.R, problem.N.T)
    scale = balanced_states(folded)[1] if balance else np.ones(len(folded))
    units = np.sqrt(np.diagonal(problem.R))
    lower = np.linalg.cholesky(problem.R / units / units[:, None])
    root = scipy.linalg.solve_triangular(lower, np.diag(1.0 / units), lower=True).T  # R^-1 = root root^T
    A, B = problem.A * scale / scale[:, None], (problem.B / scale[:, None]) @ root
    Q, N = problem.Q * scale * scale[:, None], (problem.N * scale[:, None]) @ root
    # divided by a g, with X = g Y:  A'^T Y + Y A' + Q' - (Y B' + N')(B'^T Y + N'^T) = 0, where
    # A' = A / a,  B' = B sqrt(g / a),  Q' = Q / (a g),  N' = N / sqrt(a g),  K = sqrt(a g) (B'^T Y + N'^T)
    cost, drive = float(np.linalg.norm(Q, 2)), float(np.linalg.norm(B, 2))
    rate = _exponent(float(np.linalg.norm(A)))
    size = _exponent(math.sqrt(cost) / drive if cost > 0.0 and drive > 0.0 else 1.0)
    size += (rate + size) % 2  # their product is a square, so that its root rounds nothing
    a, g = math.ldexp(1.0, rate), math.ldexp(1.0, size)
    unit, root_of_both = np.eye(len(problem.R)), math.ldexp(1.0, (rate + size) // 2)
    inner = CareProblem(A / a, B * (root_of_both / a), Q / a / g, unit, N / root_of_both)
    return _Scaled(inner, root * root_of_both, g), scale


def _in_states_of_closed_loop(problem: CareProblem, found: CareSolution) -> CareSolution:
    """Solve again in states that balance A - B K, in which all entries of the gain weigh alike."""
    scale = balanced_states(problem.A - problem.B @ found.K)[1]
    inner = replace(
        problem,
        A=problem.A * scale / scale[:, None],
        B=problem.B / scale[:, None],
        Q=problem.Q * scale * scale[:, None],
        N=problem.N * scale[:, None],
    )
    better = _by_newton(inner, found.X * scale * scale[:, None], found.K * scale)
    if better is None:
        return found
    return CareSolution(better.K / scale, better.X / scale / scale[:, None], better.error)


def _exponent(value: float) -> int:
    return round(math.log2(value)) if value > 0.0 and math.isfinite(value) else 0


def _starts(problem: CareProblem, method: Solver) -> Iterator[tuple[FloatArray | None, FloatArray]]:
    """Give solutions X with their gains, or None with a gain that stabilizes, the best first."""
    for solver in dict.fromkeys((method, "scipy", "slycot")):
        X = _solution(problem, solver)
        if X is not None:
            yield X, problem.B.T @ X + problem.N.T
    folded = replace(problem, A=problem.A - problem.B @ problem.N.T, N=np.zeros_like(problem.N))
    for gain in _gains_of_slow_part(folded, method):
        yield None, gain + problem.N.T
    size = float(np.linalg.norm(folded.A, 2))
    Q = folded.Q + UNIT_ROUNDOFF * max(float(np.linalg.norm(folded.Q, 2)), 1.0) * np.eye(len(folded.Q))
    for shift in SHIFTS:
        X = _solution(replace(folded, A=folded.A + shift * size * np.eye(len(Q)), Q=Q), method)
        if X is not None:
            yield None, problem.B.T @ X + problem.N.T


def _solution(problem: CareProblem, method: Solver) -> FloatArray | None:
    """Ask a solver; None where it finds nothing or is not there."""
    try:
        found = control.lqr(problem.A, problem.B, (problem.Q + problem.Q.T) / 2.0, problem.R, problem.N, method=method)[
            1
        ]
    except (ArithmeticError, ValueError, ImportError, Warning):  # what the solvers raise; slycot warns, as an error
        return None
    X = np.asarray(found, dtype=float)
    return (X + X.T) / 2.0 if np.isfinite(X).all() else None


def _gains_of_slow_part(problem: CareProblem, method: Solver) -> Iterator[FloatArray]:
    """Give gains on the slow eigenvalues alone, where all fast ones are stable: K = K_s W^T, W^T A = A_s W^T."""
    sizes = np.sort(np.abs(scipy.linalg.eigvals(problem.A)))[::-1]
    for k in np.flatnonzero(sizes[1:] * GAP < sizes[:-1]).tolist():
        limit = math.sqrt(sizes[k] * max(sizes[k + 1], sizes[k] * UNIT_ROUNDOFF))

        def is_slow(real: float, imag: float, limit: float = limit) -> bool:
            return math.hypot(real, imag) < limit

        slow, W, count = scipy.linalg.schur(problem.A.T, output="real", sort=is_slow)
        if not 0 < count < len(slow) or not _is_stable(slow[count:, count:]):
            continue
        basis = W[:, :count]
        part = CareProblem(
            slow[:count, :count].T,
            basis.T @ problem.B,
            basis.T @ problem.Q @ basis + UNIT_ROUNDOFF * np.linalg.norm(problem.Q) * np.eye(count),
            problem.R,
            basis.T @ problem.N,
        )
        X = _solution(part, method)
        if X is not None:
            yield (part.B.T @ X) @ basis.T


def _by_newton(problem: CareProblem, X: FloatArray | None, gain: FloatArray) -> CareSolution | None:
    """Improve a solution, or find it from a gain that stabilizes; None where the start does not."""
    if not np.isfinite(gain).all() or not _is_stable(problem.A - problem.B @ gain):
        return None
    if X is None:
        weighted = problem.Q - problem.N @ gain - gain.T @ problem.N.T + gain.T @ gain
        X = _Lyapunov(problem.A - problem.B @ gain).solved(weighted)
    solution: Double2 = X, np.zeros_like(X)
    last, lyapunov = math.inf, None
    for _ in range(MOST_STEPS):
        residual, gain = _residual(problem, solution)
        closed = problem.A - problem.B @ gain
        if not (np.isfinite(closed).all() and np.isfinite(residual).all()):
            return None
        lyapunov = _Lyapunov(closed)
        step = lyapunov.solved(residual)
        length = _relative(problem.B.T @ step, gain)
        if not math.isfinite(length) or (length >= last / 2.0 and last < FROM_AFAR):
            break
        solution, last = two_sum(solution[0], solution[1] + step), length
        if length < SETTLED:
            break
    gain = _residual(problem, solution)[1]
    if lyapunov is None or not math.isfinite(last) or not _is_stable(problem.A - problem.B @ gain):
        return None
    sample = max(_sample(problem, solution[0], gain, lyapunov, seed) for seed in range(SAMPLES))
    return CareSolution(gain, solution[0], CAUTION * (last + sample))


def _residual(problem: CareProblem, X: Double2) -> tuple[FloatArray, FloatArray]:
    """Return the residual of (30) for R = 1, and the gain, both in about twice the working precision."""
    A, B, none = problem.A, problem.B, np.zeros_like
    gain = added(_plus(matrix_product(B.T, X[0]), B.T @ X[1]), (problem.N.T, none(problem.N.T)))
    motion = _plus(matrix_product(X[0], A), X[1] @ A)
    square, mixed = matrix_product(gain[0].T, gain[0]), gain[0].T @ gain[1]
    total = added(added(motion, (motion[0].T, motion[1].T)), (problem.Q, none(problem.Q)))
    total = added(total, (-square[0], -square[1] - mixed - mixed.T))
    residual = total[0] + total[1]
    return (residual + residual.T) / 2.0, gain[0] + gain[1]


def _plus(value: Double2, small: FloatArray) -> Double2:
    return two_sum(value[0], value[1] + small)


class _Lyapunov:
    """``F^T Y + Y F = -S`` for one F and several S, by one real Schur form (R. H. Bartels and G. W. Stewart, 1972)."""

    def __init__(self, F: FloatArray) -> None:
        self.F = F
        self.T, self.U = scipy.linalg.schur(F, output="real")

    def solved(self, S: FloatArray) -> FloatArray:
        right = -self.U.T @ S @ self.U
        Y, scale, _ = dtrsyl(self.T, self.T, right, trana="T", tranb="N")
        solution = self.U @ (Y / scale) @ self.U.T
        return np.asarray((solution + solution.T) / 2.0)

    def refined(self, S: FloatArray) -> FloatArray:
        """Solve with residuals in twice the working precision: fast and slow eigenvalues together lose all digits."""
        solution: Double2 = self.solved(S), np.zeros_like(S)
        for _ in range(REFINEMENTS):
            motion = _plus(matrix_product(solution[0], self.F), solution[1] @ self.F)
            total = added(added(motion, (motion[0].T, motion[1].T)), (S, np.zeros_like(S)))
            solution = two_sum(solution[0], solution[1] + self.solved(total[0] + total[1]))
        return np.asarray(solution[0] + solution[1])


def _sample(problem: CareProblem, X: FloatArray, gain: FloatArray, lyapunov: _Lyapunov, seed: int) -> float:
    """Return how much the gain moves when the entries of the problem are rounded at random."""
    generator = np.random.default_rng(seed)

    def rounded(size: FloatArray) -> FloatArray:
        return UNIT_ROUNDOFF * size * generator.uniform(-1.0, 1.0, size.shape)

    dA = rounded(np.abs(problem.A) + 2.0 * np.abs(problem.B) @ np.abs(problem.N.T))
    dB, dN, dQ = rounded(np.abs(problem.B)), rounded(np.abs(problem.N)), rounded(np.abs(problem.Q))
    change = X @ dA - (X @ dB + dN) @ gain
    step = lyapunov.refined((dQ + dQ.T) / 2.0 + change + change.T)
    return _relative(problem.B.T @ step + dB.T @ X + dN.T, gain)


def _relative(change: FloatArray, gain: FloatArray) -> float:
    """Compare the change of a gain with the gain, input by input."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        ratios = np.linalg.norm(change, axis=1) / np.linalg.norm(gain, axis=1)
    ratios = ratios[np.linalg.norm(change, axis=1) > 0.0]
    return float(ratios.max(initial=0.0)) if not np.isnan(ratios).any() else math.inf


def _is_stable(closed: FloatArray) -> bool:
    """Tell roughly; what lies near the axis is decided by its bound at the end."""
    values = np.asarray(scipy.linalg.eigvals(balanced_states(closed)[0]), dtype=np.complex128)
    return bool((values.real < 0.0).all())
