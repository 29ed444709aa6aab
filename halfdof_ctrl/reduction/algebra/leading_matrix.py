"""The leading matrix W of equation (2), factorized once."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg.lapack import dgecon, dgesv, dgetrf, dgetri, dgetrs, dlange

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.reduction.algebra.scaling import Scaling, log_scaling, max_scaling

SINGULAR_RCOND = EPS  #: times n: W is singular below this reciprocal condition number
LEAST_SIZE = 256  #: n in that bound at least
PLAINLY_REGULAR = 1e-5  #: W with this reciprocal condition number is not scaled, nor its state space compared ...
PLAINLY_REGULAR_IF_SMALL = 1e-3  #: ... and W of few DOFs with this one
FEW_DOFS = 60  #: DOFs that are few
FEWEST_DOFS = 8  #: DOFs that are so few that a factorization takes less than a microsecond
SURELY_REGULAR = 1e-8  #: W with a smaller one is checked by equation (19): many DOFs are scaled for the best below it
MOST_SCALING_STEPS = 16  #: of the iteration for the best scaling
LEAST_FACTOR = 2.0**-200  #: of a row, in that iteration, over the largest one
SCALING_GAIN = 0.95  #: a step of it must bring the condition number below this part of what it was


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LeadingMatrix:
    """W of equation (2), factorized; scaled by powers of two where its condition asks for it.

    How well W is conditioned must not depend on the units of DOFs, equations and time, so what counts is the least
    condition number that scaled rows and columns can have. It is the spectral radius of ``|W^-1| |W|`` (F. L. Bauer,
    Optimally scaled matrices, 1963), and says how near a singular matrix is: as long as no entry of W changes by more
    than this part of itself, W stays regular.
    """

    factors: FloatArray  #: (n, n) L and U
    pivots: npt.NDArray[np.int32]
    rows: FloatArray | None  #: (n,) powers of two, None where W was taken as it is
    columns: FloatArray | None  #: (n,) likewise
    scaled: FloatArray | None  #: (n, n) what was factorized, kept where it is small or solutions are to be refined
    rcond: float  #: reciprocal 1-norm condition number of the matrix that was factorized; 0 if exactly singular

    @classmethod
    def factorized(cls, W: FloatArray) -> "LeadingMatrix":
        """Factorize and estimate the condition; scale first where that might matter.

        A W that is well conditioned as it stands, or with its rows and columns brought to one size, is so in the
        best units too. Otherwise it is scaled by the means
        of the logarithms of its entries, which gives the same matrix whatever the units were, and by the best
        scaling after that if its condition still asks for it; of many DOFs, that takes as long as several solves, and
        only a W that might be called singular asks for it. So `rcond` is the same in any units up to what powers
        of two and the estimate leave, a factor of about four, or large enough in all of them.
        """
        enough = plainly_regular(len(W))
        leading = None
        if len(W) <= FEW_DOFS or not _is_uneven(W, enough):
            factors, pivots, rcond = lu_and_rcond(W)
            kept = None if len(W) > FEWEST_DOFS and rcond >= enough else W
            leading = cls(factors=factors, pivots=pivots, rows=None, columns=None, scaled=kept, rcond=rcond)
            if rcond >= enough:
                return leading
        if len(W) > FEW_DOFS:
            leading = cls._scaled(W, max_scaling(W), leading)
            if leading.rcond >= SURELY_REGULAR:
                return leading
        leading = cls._scaled(W, log_scaling(W, powers_of_two=True), leading)
        if leading.rcond == 0.0 or leading.rcond >= enough:
            return leading
        better = cls._scaled(W, leading.best_scaling())
        return better if better.rcond > leading.rcond else leading

    @classmethod
    def _scaled(cls, W: FloatArray, scaling: Scaling, known: "LeadingMatrix | None" = None) -> "LeadingMatrix":
        """Scale and factorize, but for what is only a multiple of what is known."""
        rows, columns = scaling
        if known is not None and _is_a_multiple(known, scaling):
            return known if known.rows is not None else replace(known, rows=np.ones(len(W)), columns=np.ones(len(W)))
        scaled = scaling.of(W)
        factors, pivots, rcond = lu_and_rcond(scaled)
        return cls(factors=factors, pivots=pivots, rows=rows, columns=columns, scaled=scaled, rcond=rcond)

    def best_scaling(self) -> Scaling:
        """Return powers of two near the row and column factors with which W has its least 1-norm condition number.

        The row factors u are the left Perron vector of ``|W| |W^-1|``, the column factors one over ``u |W|``. For
        any u the condition number is the largest entry of ``u |W| |W^-1| / u``, and power iteration lowers it.
        """
        if self.scaled is None or self.rows is None or self.columns is None:
            return Scaling(np.ones(len(self.factors)), np.ones(len(self.factors)))
        size, inverse = np.abs(self.scaled), np.abs(dgetri(self.factors, self.pivots)[0])
        u, least = np.ones(len(size)), np.inf
        best = u, u
        for _ in range(MOST_SCALING_STEPS):
            across = u @ size
            following = across @ inverse
            largest = float((following / u).max())
            if not largest < SCALING_GAIN * least:
                break
            best, least = (u, 1.0 / across), largest
            u = np.maximum(following / following.max(), LEAST_FACTOR)
        return Scaling(self.rows, self.columns).then(Scaling(*[np.exp2(np.round(np.log2(part))) for part in best]))

    @property
    def is_plainly_regular(self) -> bool:
        """Whether the condition of W is so good that no digit worth a look is lost."""
        return self.rcond >= plainly_regular(len(self.factors))

    @property
    def is_singular(self) -> bool:
        """Whether W is singular to working precision: rcond below n eps, or 256 eps.

        Columns of W that combine DOFs are rounded themselves, which even a small W may show.
        """
        return self.rcond < max(len(self.factors), LEAST_SIZE) * SINGULAR_RCOND

    def singular_values(self) -> FloatArray:
        """Return the singular values of the matrix that was factorized."""
        L, U = np.tril(self.factors, -1) + np.eye(len(self.factors)), np.triu(self.factors)
        return np.asarray(scipy.linalg.svdvals(L @ U))

    def elimination_size(self) -> FloatArray:
        """Return ``|L| |U|`` in the rows and units of W: what rounding errors of the elimination are relative to."""
        L, U = np.tril(np.abs(self.factors), -1) + np.eye(len(self.factors)), np.triu(np.abs(self.factors))
        order = np.arange(len(self.factors))
        for i, j in enumerate(self.pivots.tolist()):
            order[[i, j]] = order[[j, i]]
        size = np.empty_like(L)
        size[order] = L @ U
        if self.rows is not None and self.columns is not None:
            size = size / self.rows[:, None] / self.columns
        return size

    def solve(self, right: FloatArray, *, overwrite: bool = False) -> FloatArray:
        """Return ``W^-1 right`` for an (n, k) array, refined once where W was scaled and its condition asks for it.

        With `overwrite` the result may take the place of `right`, which a large array that nobody else needs allows.
        """
        if self.scaled is None:
            return np.asarray(dgetrs(self.factors, self.pivots, right, overwrite_b=overwrite)[0])
        if self.rows is None or self.columns is None:  # factorizing again is nothing beside threads that dgetrs starts
            return np.asarray(dgesv(self.scaled, right)[2])
        right = right * self.rows[:, None]
        solution = dgetrs(self.factors, self.pivots, right)[0]
        if not self.is_plainly_regular:
            solution += dgetrs(self.factors, self.pivots, right - self.scaled @ solution)[0]
        return np.asarray(solution * self.columns[:, None])


def plainly_regular(size: int) -> float:
    """Return the reciprocal condition number from which on W of so many DOFs needs no closer look."""
    return PLAINLY_REGULAR_IF_SMALL if size <= FEW_DOFS else PLAINLY_REGULAR


def _is_a_multiple(known: LeadingMatrix, scaling: Scaling) -> bool:
    """Return whether a scaling gives what was factorized already, but for one factor."""
    rows, columns = scaling
    if known.rows is not None and known.columns is not None:
        rows, columns = rows / known.rows, columns / known.columns
    return bool(np.ptp(rows) == 0.0 and np.ptp(columns) == 0.0)


def _is_uneven(W: FloatArray, enough: float) -> bool:
    """Return whether sizes of columns differ by so much that the condition number is worse for that alone."""
    size = np.abs(W).sum(axis=0)
    return bool(size.min() < enough * size.max())


def lu_and_rcond(matrix: FloatArray) -> tuple[FloatArray, npt.NDArray[np.int32], float]:
    """Factorize and estimate the reciprocal 1-norm condition number, 0 where a pivot vanishes."""
    norm = dlange("1", matrix)  # type: ignore[call-arg]  # the stubs lack its first argument
    factors, pivots, exact_zero = dgetrf(matrix)
    return factors, pivots, 0.0 if exact_zero else float(dgecon(factors, norm)[0])
