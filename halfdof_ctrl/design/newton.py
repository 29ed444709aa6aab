"""Newton's method for the Riccati equation of many states, in doubles (D. L. Kleinman, 1968).

    (A - B K)^T dX + dX (A - B K) = -residual of (30),    K + B^T dX,    for R = 1

The residual is formed in about twice the working precision; each step is one real Schur form of A - B K, which serves
several once the steps are small. What remains is judged by another factorization, since a Schur form may know nothing
of a slow part beside a fast one and then takes steps that look small: in the eigenvectors of the closed loop the last
residual bounds the error, component by component. In these also the roundings of A, B, Q and N are pushed through.
"""

import math

import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dtrsyl

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, FloatArray
from halfdof_ctrl.base.double_double import Double2, added, matrix_product, two_sum
from halfdof_ctrl.design.care_problem import CAUTION, CareProblem, CareSolution, Roundings, relative_change
from halfdof_ctrl.design.modal_basis import ModalBasis
from halfdof_ctrl.design.newton_steps import MOST_NEWTON_STEPS, NewtonSteps

NEWTON_SETTLED = 1e-15  #: a step that changes the gain by less is the last one
FAST = 1e-3  #: a step below this part of the one before moves the closed loop so little that its Schur form serves on


def solved_by_newton(problem: CareProblem, X: FloatArray | None, gain: FloatArray) -> CareSolution | None:
    """Improve a solution, or find it from a gain that stabilizes.

    Parameters
    ----------
    problem : CareProblem
        With R the identity.
    X : (N, N) ndarray or None
        Approximate solution.
    gain : (m, N) ndarray
        Its gain, or one that stabilizes.

    Returns
    -------
    CareSolution or None
        None where the start does not stabilize, or does not lead to a solution.
    """
    lyapunov = _lyapunov(problem, gain)
    if lyapunov is None:
        return None
    if X is None:
        weighted = problem.Q - problem.N @ gain - gain.T @ problem.N.T + gain.T @ gain
        X, lyapunov = lyapunov.solved(weighted), None
    solution: Double2 = X, np.zeros_like(X)
    steps = NewtonSteps()
    for _ in range(MOST_NEWTON_STEPS):
        residual, gain = _residual(problem, solution)
        lyapunov = lyapunov or _lyapunov(problem, gain)
        if lyapunov is None or not np.isfinite(residual).all():
            return None
        step = lyapunov.solved(residual)
        length = relative_change(problem.B.T @ step, gain, problem.R, np.ones(len(X)), UNIT_ROUNDOFF)
        before = steps.last
        if not steps.goes_on(length):
            break
        solution = two_sum(solution[0], solution[1] + step)
        if length > FAST * before:
            lyapunov = None  # a step that is small beside the gain may still double a small damping
        if length < NEWTON_SETTLED:
            break
    return _judged(problem, solution, steps.last) if math.isfinite(steps.last) else None


def _judged(problem: CareProblem, solution: Double2, last: float) -> CareSolution | None:
    """Bound what is left, in the eigenvectors of the closed loop."""
    residual, gain = _residual(problem, solution)
    closed, X = problem.A - problem.B @ gain, solution[0] + solution[1]
    try:
        basis = ModalBasis(closed)
    except np.linalg.LinAlgError:
        return None
    if not basis.is_stable:
        return None
    bound = basis.bound(problem.B.T, basis.components(residual))
    error = max(CAUTION * last, relative_change(bound, gain, problem.R, basis.scale, UNIT_ROUNDOFF))
    roundings = Roundings(problem, X, gain)
    changes = [problem.B.T @ basis.solution(basis.components(side)) + direct for side, direct in roundings.samples()]
    return CareSolution(gain, X, error, *roundings.errors(changes), closed)


def _lyapunov(problem: CareProblem, gain: FloatArray) -> "_Lyapunov | None":
    """Return the Schur form of a closed loop, None where it is not stable."""
    closed = problem.A - problem.B @ gain
    if not np.isfinite(closed).all():
        return None
    form = _Lyapunov(closed)
    return form if form.is_stable else None


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
        self.T, self.U = scipy.linalg.schur(F, output="real")

    def solved(self, S: FloatArray) -> FloatArray:
        right = -self.U.T @ S @ self.U
        Y, scale, _ = dtrsyl(self.T, self.T, right, trana="T", tranb="N")
        solution = self.U @ (Y / scale) @ self.U.T
        return np.asarray((solution + solution.T) / 2.0)

    @property
    def is_stable(self) -> bool:
        """Tell roughly; what lies near the axis is decided by its bound at the end."""
        return bool((np.diagonal(self.T) < 0.0).all())
