"""Integrate ``E x' = A x + b`` with a constant, possibly singular E: the oracle for time responses.

Five-stage Radau IIA (order 9, stiffly accurate, L-stable): on a step of length h the solution is a
polynomial that satisfies the equations at the Radau points c_1, ..., c_5 = 1,

    E X' = A (x_0 1^T + h X' R^T) + b 1^T,    x_1 = x_0 + h X' r_5,                        (11)

with the columns of X' the slopes at the points. R = S diag(lambda) S^-1 splits (11) into five systems
(E - h lambda_i A) l_i = ..., of which conjugate pairs share one factorization (E. Hairer and G. Wanner,
Solving Ordinary Differential Equations II, sections IV.5 and IV.8). The value at the end is a stage, so
algebraic equations hold there exactly, whatever the initial values of algebraic unknowns are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.linalg
import scipy.special

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.base.dense_lu import lu_factors
from halfdof_ctrl.base.exact_products import ExactPolynomial, as_it_is
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.model.second_order import SecondOrderModel

STAGES = 5
REFINEMENTS = 2  #: of a solution, by residuals in twice the working precision: rounding of M is no state
MOST_REFINED = 200  #: unknowns up to which solutions are refined, which takes several times as long as to find them
RESOLUTION = 0.25  #: step length times the size of the fastest eigenvalue that still moves
GONE = 33.0  #: time constants after which a mode is below rounding, exp(-33) = 5e-15
GROWN = 5.0  #: time constants for which a growing mode is followed, which multiplies rounding by exp(5) = 150
MOST_RADAU_STEPS = 1500  #: steps of one integration; the horizon shrinks where they do not suffice


@dataclass(frozen=True, slots=True)
class Segment:
    """Equal steps from one time to a later one."""

    h: float  #: step [s]
    steps: int


def step_plan(eigenvalues: ComplexArray, most_steps: int = MOST_RADAU_STEPS) -> tuple[Segment, ...]:
    """Choose steps that resolve every mode for as long as it moves, up to a period of the slowest one.

    Parameters
    ----------
    eigenvalues : (k,) complex ndarray
        Finite eigenvalues [rad/s].
    most_steps : int, optional
        What the integration may cost; with fast undamped modes beside slow ones the horizon ends early.
    """
    moving = eigenvalues[np.abs(eigenvalues) > 1e-12 * np.abs(eigenvalues).max(initial=0.0)]
    if moving.size == 0:
        return (Segment(0.05, 20),)
    horizon = 2.0 * np.pi / float(np.abs(moving).min())
    growth = float(moving.real.max())
    if growth > 0.0:
        horizon = min(horizon, GROWN / growth)
    plan: list[Segment] = []
    time, left = 0.0, most_steps
    with np.errstate(divide="ignore"):
        ends = np.where(moving.real < 0.0, GONE / np.abs(moving.real), np.inf)
    while time < horizon and left > 0:
        alive = ends > time * (1.0 + 1e-9)
        fastest = float(np.abs(moving[alive]).max()) if alive.any() else 2.0 * np.pi / horizon
        h = float(2.0 ** np.floor(np.log2(RESOLUTION / fastest)))
        until = min(horizon, float(ends[alive].min())) if alive.any() else horizon
        steps = min(left, max(1, int(np.ceil((until - time) / h))))
        plan.append(Segment(h, steps))
        time += h * steps
        left -= steps
    return tuple(plan)


def descriptor_step_response(model: SecondOrderModel, plan: Sequence[Segment]) -> FloatArray:
    """Integrate the descriptor equations from rest under a unit step of each input.

    The unknowns are (q, v): ``q' = v``, ``M v' = B u - C v - K q``.

    Parameters
    ----------
    model : SecondOrderModel
        A real model with n DOFs, without derivatives of the inputs (`Bv`, `Ba`, `Dv`, `Da` zero).
    plan : sequence of Segment
        Steps to take.

    Returns
    -------
    (p, m, k) ndarray
        Outputs at the end of each of the k steps.
    """
    n = len(model.dofs)
    zero, unit = np.zeros((n, n)), np.eye(n)
    E = np.block([[unit, zero], [zero, model.M]])
    A = np.block([[zero, unit], [-model.K, -model.C]])
    b = np.vstack([np.zeros_like(model.B), model.B])
    at_end, of_slope = np.hstack([model.F, model.G]), np.hstack([np.zeros_like(model.H), model.H])
    return _step_response(E, A, b, (at_end, of_slope, model.D), plan)


def system_step_response(
    A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, plan: Sequence[Segment]
) -> FloatArray:
    """Integrate a state space from rest under a unit step of each input, (p, m, k), by the same steps."""
    return _step_response(np.eye(len(A)), A, B, (C, np.zeros_like(C), D), plan)


def _step_response(
    E: FloatArray,
    A: FloatArray,
    b: FloatArray,
    output: tuple[FloatArray, FloatArray, FloatArray],
    plan: Sequence[Segment],
) -> FloatArray:
    """Integrate ``E x' = A x + b`` from zero, for the outputs of x, of x' and of the inputs."""
    at_end, of_slope, direct = output
    outputs = np.empty((sum(segment.steps for segment in plan), *direct.shape))  # those of a step lie side by side
    if not A.size:
        outputs[:] = direct
        return outputs.transpose(1, 2, 0)
    x, done = np.zeros_like(b), 0
    few, has_slope = as_it_is(at_end), of_slope.any()
    for segment in plan:
        step = RadauStep.factorized(E, A, segment.h)
        from_x, slope_from_x = step.advance(np.eye(len(A)), np.zeros((len(A), 1)))  # a step is affine in x
        from_b, slope_from_b = step.advance(np.zeros_like(b), b)
        before, constant = of_slope @ slope_from_x, of_slope @ slope_from_b + direct
        for k in range(done, done + segment.steps):
            outputs[k] = before @ x + constant if has_slope else constant
            x = from_x @ x + from_b
            outputs[k] += few @ x
        done += segment.steps
    return outputs.transpose(1, 2, 0)


@dataclass(frozen=True, slots=True, eq=False)
class RadauStep:
    """One step length of (11), factorized."""

    h: float  #: step [s]
    A: FloatArray
    rows: FloatArray  #: (n, 1) powers of two that scale the rows to even sizes
    columns: FloatArray  #: (n, 1) and the columns, whatever the units of the unknowns are
    factors: tuple[tuple[DenseMatrix, DenseMatrix], ...]  #: LU for each eigenvalue of `_modes`
    exact: ExactPolynomial  #: ``E - s A``, rows and columns scaled

    @classmethod
    def factorized(cls, E: FloatArray, A: FloatArray, h: float) -> "RadauStep":
        """Factorize for steps of length h."""
        down, across = scaling_powers(np.abs(E) + h * np.abs(A))
        rows, columns = down[:, None], across[:, None]
        even = [rows * E * columns.T, -rows * A * columns.T]
        factors = [lu_factors(even[0] + h * mode.eigenvalue * even[1]) for mode in _modes()]
        return cls(h, A, rows, columns, tuple(factors), ExactPolynomial([as_it_is(part) for part in even]))

    def advance(self, x: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the states (n, k) one step later, and their slopes there."""
        right = (self.rows * (self.A @ x + b)).astype(np.complex128)
        change, slope = np.zeros_like(x), np.zeros_like(x)
        for mode, factor in zip(_modes(), self.factors, strict=True):
            part = scipy.linalg.lu_solve(factor, right, check_finite=False)
            for _ in range(REFINEMENTS if len(self.A) <= MOST_REFINED else 0):
                residual = self.exact.residual(self.h * mode.eigenvalue, part, right)
                part += scipy.linalg.lu_solve(factor, residual, check_finite=False)
            part *= self.columns
            change += (mode.to_change * part).real
            slope += (mode.to_slope * part).real
        return x + self.h * change, slope


@dataclass(frozen=True, slots=True)
class _Mode:
    """An eigenvalue of R, standing for its conjugate too, with its shares of x_1 and of the last slope."""

    eigenvalue: complex
    to_change: complex
    to_slope: complex


@cache
def _modes() -> tuple[_Mode, ...]:
    R = radau_matrix(radau_points())
    eigenvalues, S = np.linalg.eig(R)
    weights = np.linalg.solve(S, np.ones(STAGES))
    modes = []
    for i in np.flatnonzero(eigenvalues.imag >= 0.0).tolist():
        share = weights[i] * S[-1, i] * (1.0 if eigenvalues[i].imag == 0.0 else 2.0)
        modes.append(_Mode(complex(eigenvalues[i]), complex(share * eigenvalues[i]), complex(share)))
    return tuple(modes)


def radau_points(stages: int = STAGES) -> FloatArray:
    """Return the Radau points on (0, 1], the last of them 1."""
    inner, _ = scipy.special.roots_jacobi(stages - 1, 1.0, 0.0)
    return np.append((inner + 1.0) / 2.0, 1.0)


def radau_matrix(points: FloatArray) -> FloatArray:
    """Give R: the integrals from 0 to each point of the polynomials that are one at one point."""
    powers = np.arange(points.size)
    values = points[:, None] ** powers
    integrals = points[:, None] ** (powers + 1) / (powers + 1)
    return np.asarray(np.linalg.solve(values.T, integrals.T).T)
