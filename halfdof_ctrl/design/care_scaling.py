"""The Riccati equation freed from the units of states, inputs, time and cost.

States are balanced by powers of two (or stay as they are where they have one unit already, as those of the energy), R
is turned to the identity, time is measured by |A|, and X = g Y so that Q and B B^T are of one size: whatever the units
of force, length and time, a solver sees the same numbers.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.design.care_problem import CareProblem


@dataclass(frozen=True, slots=True, eq=False)
class ScaledCare:
    """A problem in such units, and the way back."""

    problem: CareProblem  #: with R the identity
    input_scale: FloatArray  #: (m, m) u = input_scale w
    size: float  #: X = size Y
    scale: FloatArray  #: (N,) x = scale y

    def gain(self, K: FloatArray) -> FloatArray:
        """Return a gain in the units of the problem that was given."""
        return np.asarray(self.input_scale @ K / self.scale)

    def solution(self, Y: FloatArray) -> FloatArray:
        """Return X in the units of the problem that was given."""
        return Y * self.size / self.scale / self.scale[:, None]


def scaled_care(problem: CareProblem, *, balance: bool) -> ScaledCare:
    """Free a problem from the units of states, unless they are not to be balanced, inputs, time and cost."""
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
    sizes, left_out = (
        None if part is None else part * scale / scale[:, None] / a for part in (problem.sizes, problem.left_out)
    )
    shown = None if problem.shown is None else problem.shown / scale[:, None]
    inner = CareProblem(A / a, B * (root_of_both / a), Q / a / g, unit, N / root_of_both, sizes, left_out, shown)
    return ScaledCare(inner, root * root_of_both, g, scale)


def _exponent(value: float) -> int:
    return round(math.log2(value)) if value > 0.0 and math.isfinite(value) else 0
