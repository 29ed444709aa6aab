"""Refine a solution of ``P(s) x = b`` by residuals that are summed term by term, dense or sparse alike.

What a refined solution is exact for are the stored entries. What these determine is another matter: with x and y the
solutions for input and output, relative errors of eps in each entry change the response by

    eps |y|^T (|K| + |s| |C| + |s|^2 |M|) |x|                                              (DATA)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.exact_products import ExactPolynomial

REFINEMENT_ROUNDS = 8  #: of refinement at most
SUSPECT_GROWTH = 1e5  #: growth of a random solution above which the sum of the terms may have lost digits that matter
COARSE_GROWTH = 1e-3 / EPS  #: the same, above which a solution that is not refined lacks the digits (DATA) asks for
REFINED_ENOUGH = 4 * EPS  #: a correction below this part of the largest unknown is the last
ENOUGH_FOR_DATA = 1e-3  #: the same where three digits are enough
REFINED_SOLUTION = 1e-12  #: a solution whose corrections stay above this part of it is not found by the factors
SHRINKS = 0.1  #: corrections that do not shrink by this factor lead nowhere soon: P(s) is singular to rounding


@dataclass(frozen=True, slots=True, eq=False)
class DataLimit:
    """How far rounding of the entries moves a response, and how fast it changes with frequency."""

    data: FloatArray  #: (DATA), of all channels at one point or at many
    slope: FloatArray  #: size of ``s dH/ds``

    @classmethod
    def none(cls, shape: tuple[int, ...]) -> "DataLimit":
        """Start from nothing."""
        return cls(np.zeros(shape), np.zeros(shape))

    def of_entries_known_to(self, known_to: float) -> "DataLimit":
        """Return the limit for entries that are not known to their last digit, but to those of a file."""
        return DataLimit(self.data * (known_to / EPS), self.slope)


def refined(
    exact: ExactPolynomial,
    s: complex | ComplexArray,
    solution: ComplexArray,
    right: ComplexArray,
    solve: Callable[[ComplexArray], ComplexArray],
    *,
    enough: float = REFINED_ENOUGH,
) -> tuple[ComplexArray, npt.NDArray[np.bool_]]:
    """Refine each column until its corrections no longer shrink.

    Parameters
    ----------
    exact : ExactPolynomial
        P(s).
    s : complex or (m,) complex ndarray
        One point for all columns, or one for each.
    solution : (n, m) complex ndarray
        A first one.
    right : (n, m) complex ndarray
    solve : callable
        Takes residuals to corrections, by factors of the rounded sum of the terms.
    enough : float
        A correction below this part of the largest unknown is the last.

    Returns
    -------
    (n, m) complex ndarray
        The first solution where corrections do not shrink, or are larger than itself: more wrong than right.
    (m,) bool ndarray
        Whether corrections became so small that this is the solution.
    """
    best, last = solution.copy(), np.ones(solution.shape[1]) / SHRINKS
    smallest = np.full(last.shape, np.inf)
    for _ in range(REFINEMENT_ROUNDS):
        correction = solve(exact.residual(s, best, right))
        size = np.abs(best).max(axis=0, initial=0.0)
        share = np.abs(correction).max(axis=0, initial=0.0) / np.where(size > 0.0, size, 1.0)
        smallest = np.fmin(smallest, share)
        better = share <= SHRINKS * last
        best[:, better] += correction[:, better]
        last = np.where(better & (share > enough), share, 0.0)
        if not last.any():
            break
    return best, smallest <= max(REFINED_SOLUTION, enough)


def random_right_side(size: int) -> FloatArray:
    """Return a right-hand side of size one that knows nothing of the model, the same at every call."""
    generator = np.random.default_rng(0)
    return np.asarray(generator.uniform(0.5, 1.0, size) * generator.choice([-1.0, 1.0], size))
