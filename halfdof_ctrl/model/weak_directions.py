"""Refine solutions of ``P(s) x = b`` along the directions in which the rounded sum of the terms says nothing.

Where a direction moves P(s) by no more than rounding of its entries does, as the first mode of a beam of thousands of
elements or the common motion of masses on links 1e14 times stiffer, factors of the rounded sum answer residuals along
it with any factor, and corrections by them do not shrink. Such directions are few, and the factors find them all the
same, by inverse iteration from both sides (V for the unknowns, U for the equations): what they get wrong is how far to
go, not where. How far to go tells a small matrix of the terms, summed in twice the working precision,

    x <- x + V (U^H P(s) V)^-1 U^H (b - P(s) x),

in turn with corrections by the factors for all else (deflation; R. A. Nicolaides, 1987).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.linalg.lapack import zgetrf, zgetrs

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, powers_of_two
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.model.refinement import REFINED_ENOUGH, REFINED_SOLUTION, refined

Solver: TypeAlias = Callable[[ComplexArray], ComplexArray]

FEWEST_DIRECTIONS, MOST_DIRECTIONS = 4, 64  #: looked for at first, and at most
MORE_DIRECTIONS = 4  #: times as many where corrections do not shrink
WEAK_ROUNDS = 40  #: of correction at most, of which three to five are usual
SHRINKS_WELL = 0.1  #: corrections that do not shrink by this factor ask for more directions
WEAK_SETTLED = 1e-9  #: a solution whose corrections stay above this part of it is given up
WEAKEST = 2.0**-92  #: a direction that moves P(s) by less moves it not: sums know 2^-100 of their terms
FACTOR_NUDGE = 2.0**-50  #: of rows and columns of size one, added to a diagonal whose factors are exactly singular


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """What solves with P(s) and its transpose, to some digits or none along weak directions."""

    solve: Solver  #: of (n, k) arrays
    solve_transposed: Solver
    down: FloatArray  #: (n, 1) factors that bring rows of P(s) to size one
    across: FloatArray  #: (n, 1) the same for columns
    is_nudged: bool = False  #: whether the rounded sum of the terms is exactly singular: these are of one beside it

    @property
    def transposed(self) -> "Factors":
        """The factors of the transpose."""
        return Factors(self.solve_transposed, self.solve, self.across, self.down, is_nudged=self.is_nudged)

    @classmethod
    def of_dense(cls, matrix: ComplexArray) -> "Factors | None":
        """Factorize P(s), nudged where its rounded sum is exactly singular; None where that does not help.

        Examples
        --------
        >>> Factors.of_dense(np.array([[0.0, 2.0], [4.0, 0.0j]])).solve(np.array([[2.0], [4.0 + 0j]])).real.tolist()
        [[1.0], [1.0]]
        """
        size = np.abs(matrix)
        down = powers_of_two(size.max(axis=1, initial=0.0))[:, None]
        across = powers_of_two((size * down).max(axis=0, initial=0.0))[:, None]
        lu, pivots, info = zgetrf(matrix * down * across.T, overwrite_a=True)
        is_nudged = bool(info != 0)
        if is_nudged:
            lu, pivots, info = zgetrf(matrix * down * across.T + np.diag(nudge(len(matrix))), overwrite_a=True)
        if info != 0:
            return None
        return cls(
            lambda right: np.asarray(zgetrs(lu, pivots, right * down)[0] * across),
            lambda right: np.asarray(zgetrs(lu, pivots, right * across, trans=1)[0] * down),
            down,
            across,
            is_nudged=is_nudged,
        )


def nudge(size: int) -> FloatArray:
    """Return uneven numbers of the size of rounding, the same at every call."""
    return np.asarray(FACTOR_NUDGE * np.random.default_rng(1).uniform(1.0, 2.0, size))


@dataclass(frozen=True, slots=True, eq=False)
class WeakDirections:
    """Directions in which P(s) is smallest. Those of one point serve its neighbours as well."""

    right: ComplexArray  #: (n, k) V
    left: ComplexArray  #: (n, k) U

    @classmethod
    def of(cls, factors: Factors, count: int) -> "WeakDirections":
        """Find some by two inverse iterations from each side."""
        down, across = factors.down, factors.across
        start = np.random.default_rng(0).standard_normal((len(down), count)).astype(np.complex128)

        def onto_right(left: ComplexArray) -> ComplexArray:
            return _orthonormal(factors.solve(left / down) / across)

        def onto_left(right: ComplexArray) -> ComplexArray:
            return _orthonormal(np.asarray((factors.solve_transposed(right.conj() / across) / down).conj()))

        V = onto_right(onto_left(onto_right(start)))
        return cls(across * V, down * onto_left(V))

    @property
    def transposed(self) -> "WeakDirections":
        """Those of the transpose of P(s)."""
        return WeakDirections(self.left.conj(), self.right.conj())

    def small_matrix(self, exact: ExactPolynomial, s: complex) -> ComplexArray:
        """Return ``U^H P(s) V``, of size one for directions that are not weak."""
        return np.asarray(-self.left.conj().T @ exact.residual(s, self.right))


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A solution, and whether its corrections came to an end."""

    solution: ComplexArray
    is_settled: bool
    is_singular: bool = False  #: P(s) is not told from a singular matrix in twice the working precision
    directions: WeakDirections | None = None  #: those found or given


def refined_at(
    exact: ExactPolynomial,
    s: complex,
    solution: ComplexArray,
    right: ComplexArray,
    factors: Factors,
    directions: WeakDirections | None = None,
    *,
    enough: float = REFINED_ENOUGH,
) -> Refined:
    """Refine a solution at one point, by the factors as long as that leads anywhere, then along weak directions.

    Parameters are those of `refined_along_weak`.
    """
    best, settled = refined(exact, s, solution, right, factors.solve, enough=enough)
    left = np.flatnonzero(~settled)
    if left.size == 0:
        return Refined(best, is_settled=True, directions=directions)
    found = refined_along_weak(exact, s, best[:, left], right[:, left], factors, directions, enough=enough)
    best[:, left] = found.solution
    return Refined(best, found.is_settled, found.is_singular, found.directions)


def refined_along_weak(
    exact: ExactPolynomial,
    s: complex,
    solution: ComplexArray,
    right: ComplexArray,
    factors: Factors,
    directions: WeakDirections | None = None,
    *,
    enough: float = REFINED_ENOUGH,
) -> Refined:
    """Refine a solution that corrections by the factors alone do not.

    Parameters
    ----------
    exact : ExactPolynomial
        P(s).
    s : complex
    solution : (n, m) complex ndarray
        A first one.
    right : (n, m) complex ndarray
    factors : Factors
        Of the rounded sum of the terms.
    directions : WeakDirections, optional
        Of a point nearby.
    enough : float
        A correction below this part of the largest unknown is the last.

    Examples
    --------
    Two free masses of 1 kg on a spring of 2^60 N/m move as one at 1 rad/s, -1/2 m for 1 N, though the sum of spring
    and inertia is the spring:

    >>> K, M = 2.0**60 * np.array([[1.0, -1.0], [-1.0, 1.0]]), np.eye(2)
    >>> factors, force = Factors.of_dense(K - M + 0j), np.array([[1.0 + 0j], [0j]])
    >>> exact = ExactPolynomial([K, 0.0 * K, M])
    >>> found = refined_along_weak(exact, 1j, factors.solve(force), force, factors)
    >>> found.is_settled, found.solution.real.round(12).tolist()
    (True, [[-0.5], [-0.5]])
    """
    n = len(solution)
    count = min(n, FEWEST_DIRECTIONS)
    given = directions is not None
    found = WeakDirections.of(factors, count) if directions is None else directions
    small = found.small_matrix(exact, s)
    best, last, share = solution, np.inf, np.inf
    for _ in range(WEAK_ROUNDS):
        if _is_singular(small):
            return Refined(solution, is_settled=False, is_singular=True, directions=found)
        better = best + factors.solve(exact.residual(s, best, right))
        moved = found.left.conj().T @ exact.residual(s, better, right)
        better = better + found.right @ np.linalg.solve(small, moved)
        share = _share(better - best, better, factors.across)
        best = better
        if share <= enough:
            break
        if not share <= SHRINKS_WELL * last:
            if share <= max(REFINED_SOLUTION, enough) or (count >= min(n, MOST_DIRECTIONS) and not given):
                break
            count = count if given else min(n, MORE_DIRECTIONS * count)
            found, given, last = WeakDirections.of(factors, count), False, np.inf
            small = found.small_matrix(exact, s)
            best = best if np.isfinite(best).all() else solution
            continue
        last = share
    settled = share <= max(WEAK_SETTLED, enough)
    return Refined(best if settled else solution, is_settled=settled, is_singular=False, directions=found)


def _is_singular(small: ComplexArray) -> bool:
    if not np.isfinite(small).all():
        return True
    return bool(np.linalg.svd(small, compute_uv=False).min(initial=np.inf) < WEAKEST)


def _share(correction: ComplexArray, solution: ComplexArray, across: FloatArray) -> float:
    """Return the largest correction of a column over its largest unknown, in units in which P(s) is even."""
    size = np.abs(solution / across).max(axis=0, initial=0.0)
    share = np.abs(correction / across).max(axis=0, initial=0.0) / np.where(size > 0.0, size, 1.0)
    return float(np.nan_to_num(share, nan=np.inf).max(initial=0.0))


def _orthonormal(columns: ComplexArray) -> ComplexArray:
    """Return an orthonormal basis of columns, which may be of very different sizes."""
    size = np.abs(columns).max(axis=0, initial=0.0)
    return np.asarray(np.linalg.qr(columns / np.where(size > 0.0, size, 1.0))[0])
