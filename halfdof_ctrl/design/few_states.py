"""The Riccati equation of few states, solved as its stored numbers have it, in decimals of many digits.

    A^T X + X A + Q - (X B + N) R^-1 (B^T X + N^T) = 0,    K = R^-1 (B^T X + N^T)          (30)

Doubles cannot tell the gain of a cheap actuator at a weak damper: poles, costs and the parts of X lie twenty decades
apart. So the residual of (30) is formed in `DIGITS` decimal digits, for the entries of A, B, Q, R and N exactly as they
are, and each step of Newton's method is one in doubles, in the eigenvectors of the closed loop. The steps shrink by ten
digits or so each; when the last is below `CONVERGED` nothing is left but the rounding of the gain to doubles. Where no
start is found, or the eigenvectors are too nearly dependent, X comes from the sign of the Hamiltonian matrix,

    H = [ A - B R^-1 N^T   -B R^-1 B^T          ]      sign(H) [ I ] = - [ I ]
        [ N R^-1 N^T - Q   -(A - B R^-1 N^T)^T  ],             [ X ]     [ X ]

which has no start (J. D. Roberts, 1971), and exists if and only if no eigenvalue of H is on the imaginary axis.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, FloatArray
from halfdof_ctrl.design.care_problem import CareProblem, CareSolution, Roundings, relative_change
from halfdof_ctrl.design.digits import Decimals, decimals, doubles, inverse, lyapunov, many_digits, matrix_sign
from halfdof_ctrl.design.modal_basis import ModalBasis
from halfdof_ctrl.design.newton_steps import MOST_NEWTON_STEPS, NewtonSteps

DIGITS = 80  #: of a residual
SIGN_DIGITS = (160, 400)  #: of a sign, the next if the one before leaves too large a step
CONVERGED = 1e-18  #: a last step below this part of the gain
FEW_STATES_REFINEMENTS = 3  #: of what a random rounding does to X
FEW_STATES_NOTHING = 1e-30  #: of the largest effort: that of an input to which nothing is fed back


@dataclass(frozen=True, slots=True, eq=False)
class _Exact:
    """The stored problem in decimals."""

    A: Decimals
    B: Decimals
    Q: Decimals
    R: Decimals
    N: Decimals
    R_inverse: Decimals

    @classmethod
    def of(cls, problem: CareProblem) -> "_Exact":
        A, B, Q, R, N = (decimals(part) for part in (problem.A, problem.B, problem.Q, problem.R, problem.N))
        Q, R = (Q + Q.T) / 2, (R + R.T) / 2
        return cls(A, B, Q, R, N, inverse(R)[0])

    def gain(self, X: Decimals) -> Decimals:
        return np.asarray(self.R_inverse.dot(self.B.T.dot(X) + self.N.T))

    def closed(self, gain: Decimals) -> Decimals:
        return np.asarray(self.A - self.B.dot(gain))

    def residual(self, X: Decimals, gain: Decimals) -> Decimals:
        motion = X.dot(self.A)
        return np.asarray(motion + motion.T + self.Q - gain.T.dot(self.R).dot(gain))

    def step_of_gain(self, Y: Decimals) -> Decimals:
        return np.asarray(self.R_inverse.dot(self.B.T.dot(Y)))


def solved_with_digits(problem: CareProblem, starts: Iterable[FloatArray]) -> CareSolution | None:
    """Solve (30) to the last digit of its doubles.

    Parameters
    ----------
    problem : CareProblem
        Of few states: the cost grows with the cube of their number, some milliseconds for ten.
    starts : iterable of (N, N) ndarray
        Approximate solutions X, asked for one after the other.

    Returns
    -------
    CareSolution or None
        None where no solution stabilizes, or not even hundreds of digits tell.
    """
    with many_digits(DIGITS):
        exact = _Exact.of(problem)
        for start in starts:
            X = _improved(problem, exact, decimals(start))
            if X is not None:
                return _solution(problem, exact, X)
    for digits in SIGN_DIGITS:
        with many_digits(digits):
            found = _by_sign(problem)
        if found is not None:
            return found
    return None


def _improved(problem: CareProblem, exact: _Exact, X: Decimals) -> Decimals | None:
    """Take Newton's steps, in doubles, from residuals of many digits; None where they do not shrink."""
    steps = NewtonSteps()
    rows = doubles(exact.R_inverse.dot(exact.B.T))
    for _ in range(MOST_NEWTON_STEPS):
        gain = exact.gain(X)
        basis = _basis(exact, gain)  # of each step: one that is small beside the gain may double a small damping
        if basis is None:
            return None
        components = basis.components(doubles(exact.residual(X, gain)))
        step, found, unit = basis.bound(rows, components), doubles(gain), np.ones(len(X))
        length = max(relative_change(step, found, problem.R, size, FEW_STATES_NOTHING) for size in (unit, basis.scale))
        if not steps.goes_on(length):
            return None
        X = X + decimals(basis.solution(components))
        if length < CONVERGED:
            return X
    return None


def _basis(exact: _Exact, gain: Decimals) -> ModalBasis | None:
    """Return the eigenvectors of a closed loop; None where it is not stable, or they are dependent."""
    closed = doubles(exact.closed(gain))
    if not np.isfinite(closed).all():
        return None
    try:
        basis = ModalBasis(closed)
    except np.linalg.LinAlgError:
        return None
    return basis if basis.is_stable else None


def _solution(problem: CareProblem, exact: _Exact, X: Decimals) -> CareSolution | None:
    """Round a solution to doubles, with what rounding of the problem does to it."""
    gain = exact.gain(X)
    basis = _basis(exact, gain)
    if basis is None:
        return None
    roundings = Roundings(problem, doubles(X), doubles(gain))
    closed = exact.closed(gain)
    changes = [
        doubles(exact.step_of_gain(_moved(closed, decimals(side), basis)) + exact.R_inverse.dot(decimals(direct)))
        for side, direct in roundings.samples()
    ]
    return CareSolution(doubles(gain), doubles(X), UNIT_ROUNDOFF, *roundings.errors(changes), doubles(closed))


def _moved(closed: Decimals, side: Decimals, basis: ModalBasis) -> Decimals:
    """Solve ``F^T Y + Y F = -S`` with residuals of many digits: what the inputs hardly reach cancels in B^T Y."""
    solution = side * 0
    for _ in range(FEW_STATES_REFINEMENTS):
        motion = solution.dot(closed)
        residual = doubles(motion + motion.T + side)
        solution = solution + decimals(basis.solution(basis.components(residual)))
    return np.asarray(solution)


def _by_sign(problem: CareProblem) -> CareSolution | None:
    """Solve by the sign of the Hamiltonian matrix; None where it has none, or too few digits."""
    exact = _Exact.of(problem)
    n = len(exact.A)
    A = exact.A - exact.B.dot(exact.R_inverse).dot(exact.N.T)
    G = exact.B.dot(exact.R_inverse).dot(exact.B.T)
    Q = exact.Q - exact.N.dot(exact.R_inverse).dot(exact.N.T)
    sign = matrix_sign(np.block([[A, -G], [-Q, -A.T]]))
    if sign is None:
        return None
    unit = decimals(np.eye(n))
    left = np.concatenate([sign[:n, n:], sign[n:, n:] + unit])
    right = np.concatenate([sign[:n, :n] + unit, sign[n:, :n]])
    try:
        X = -inverse(left.T.dot(left))[0].dot(left.T.dot(right))
    except ZeroDivisionError:
        return None
    X = (X + X.T) / 2
    gain = exact.gain(X)
    roundings = Roundings(problem, doubles(X), doubles(gain))
    samples = list(roundings.samples())
    closed = exact.closed(gain)
    solved = lyapunov(closed, [exact.residual(X, gain), *[decimals(side) for side, _ in samples]])
    if solved is None:
        return None
    step = np.abs(doubles(exact.step_of_gain(solved[0])))
    if relative_change(step, doubles(gain), problem.R, np.ones(n), FEW_STATES_NOTHING) > CONVERGED:
        return None
    X = X + solved[0]
    changes = [
        doubles(exact.step_of_gain(Y) + exact.R_inverse.dot(decimals(direct)))
        for Y, (_, direct) in zip(solved[1:], samples, strict=True)
    ]
    gain = exact.gain(X)
    return CareSolution(
        doubles(gain), doubles(X), UNIT_ROUNDOFF, *roundings.errors(changes), doubles(exact.closed(gain))
    )
