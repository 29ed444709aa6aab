"""Where Newton's method for the Riccati equation begins: what a solver finds, or a gain that stabilizes.

Of many states the solvers are slow, since they work on a pencil of twice the size. A structure is regulated through its
slow modes: the gain of these alone is so near to that of all that few steps are left.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import control
import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, FloatArray
from halfdof_ctrl.design.care_problem import CareProblem

Solver = Literal["scipy", "slycot"]

GAP = 1e3  #: ratio of neighbouring eigenvalues at which fast and slow parts are told apart
STARTS_LARGE = 80  #: states from which on the slowest modes give the start
STARTS_SLOWEST = (20, 40)  #: number of them, between which the largest gap is looked for
SHIFTS = tuple(10.0**power for power in range(-14, -1, 2))  #: of |A|, by which a start is made stable


def solutions(problem: CareProblem, method: Solver) -> Iterator[FloatArray]:
    """Give the solutions X that solvers find."""
    for solver in dict.fromkeys((method, "scipy", "slycot")):
        X = _solution(problem, solver)
        if X is not None:
            yield X


def starts(problem: CareProblem, method: Solver) -> Iterator[tuple[FloatArray | None, FloatArray]]:
    """Give solutions X with their gains, or None with a gain that stabilizes, for R = 1, the best first."""
    if len(problem.A) > STARTS_LARGE:
        folded = _folded(problem)
        for gain in _gain_of_slowest(folded, method):
            yield None, gain + problem.N.T
    for X in solutions(problem, method):
        yield X, problem.B.T @ X + problem.N.T
    for gain in stabilizing_gains(problem, method):
        yield None, gain


def stabilizing_gains(problem: CareProblem, method: Solver) -> Iterator[FloatArray]:
    """Give gains that stabilize, for R = 1: of the slow part alone, or of A made less stable."""
    folded = _folded(problem)
    for gain in _gains_of_slow_part(folded, method):
        yield gain + problem.N.T
    size = float(np.linalg.norm(folded.A, 2))
    Q = folded.Q + UNIT_ROUNDOFF * max(float(np.linalg.norm(folded.Q, 2)), 1.0) * np.eye(len(folded.Q))
    for shift in SHIFTS:
        X = _solution(replace(folded, A=folded.A + shift * size * np.eye(len(Q)), Q=Q), method)
        if X is not None:
            yield problem.B.T @ X + problem.N.T


def _folded(problem: CareProblem) -> CareProblem:
    """Take the part of the feedback that N asks for into A."""
    A, N = problem.A - problem.B @ problem.N.T, problem.N
    return replace(problem, A=A, Q=problem.Q - N @ N.T, N=np.zeros_like(N))


def _solution(problem: CareProblem, method: Solver) -> FloatArray | None:
    """Ask a solver; None where it finds nothing or is not there."""
    try:
        Q = (problem.Q + problem.Q.T) / 2.0
        found = control.lqr(problem.A, problem.B, Q, problem.R, problem.N, method=method)[1]
    except (ArithmeticError, ValueError, ImportError, Warning):  # what the solvers raise; slycot warns, as an error
        return None
    X = np.asarray(found, dtype=float)
    return (X + X.T) / 2.0 if np.isfinite(X).all() else None


def _gains_of_slow_part(problem: CareProblem, method: Solver) -> Iterator[FloatArray]:
    """Give gains on the slow eigenvalues alone, wherever a gap parts them from fast ones."""
    sizes = np.sort(np.abs(scipy.linalg.eigvals(problem.A)))[::-1]
    for k in np.flatnonzero(sizes[1:] * GAP < sizes[:-1]).tolist():
        yield from _gain_below(math.sqrt(sizes[k] * max(sizes[k + 1], sizes[k] * UNIT_ROUNDOFF)), problem, method)


def _gain_of_slowest(problem: CareProblem, method: Solver) -> Iterator[FloatArray]:
    """Give the gain on the slowest eigenvalues alone."""
    sizes = np.sort(np.abs(scipy.linalg.eigvals(problem.A)))
    gaps = sizes[STARTS_SLOWEST[0] : STARTS_SLOWEST[1]] / np.maximum(
        sizes[STARTS_SLOWEST[0] - 1 : STARTS_SLOWEST[1] - 1], np.finfo(float).tiny
    )
    k = STARTS_SLOWEST[0] + int(np.argmax(gaps))
    yield from _gain_below(math.sqrt(sizes[k - 1] * sizes[k]), problem, method)


def _gain_below(limit: float, problem: CareProblem, method: Solver) -> Iterator[FloatArray]:
    """Give the gain on the eigenvalues below a limit, if all others are stable: K = K_s W^T, W^T A = A_s W^T."""

    def is_slow(real: float, imag: float) -> bool:
        return math.hypot(real, imag) < limit

    slow, W, count = scipy.linalg.schur(problem.A.T, output="real", sort=is_slow)
    if not 0 < count < len(slow) or not (np.diagonal(slow)[count:] < 0.0).all():
        return
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
