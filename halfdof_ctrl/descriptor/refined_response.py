"""Transfer functions by refined solves, with what rounding of the entries makes of them, (DATA), for the cross-check.

    H(s) = F(s) P(s)^-1 B(s) + D(s),    P x = B,    P^T y = F^T

Residuals are summed term by term in twice the working precision, so that x is as good as the stored entries say. With
y, relative errors of eps in every entry change the response by

    eps (|y|^T (|P_0| + |s| |P_1| + |s|^2 |P_2|) |x| + |y|^T |B| + |F| |x| + |D|).           (DATA)

Refinement takes several times as long as the solves, so it can be left for the columns of P x = B that ask for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, IndexArray
from halfdof_ctrl.base.exact_products import ExactPolynomial, as_it_is
from halfdof_ctrl.descriptor.matrix_polynomial import MatrixPolynomial
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.refinement import ENOUGH_FOR_DATA, REFINED_ENOUGH
from halfdof_ctrl.model.weak_directions import Factors, refined_along_weak, refined_at

FACTORS_HELD = 2**20  #: complex entries of factors held at a time (16 MB)
MOST_ROUNDS = 4  #: of refinement; two are enough but where P(s) is nearly singular
LAST_STEP = REFINED_ENOUGH**0.5  #: a correction below this part of the largest unknown is the last but for rounding
NO_FACTORS = Factors(lambda right: right, lambda right: right, np.zeros((0, 1)), np.zeros((0, 1)))  #: of no unknowns


@dataclass(frozen=True, slots=True, eq=False)
class RefinedResponse:
    """A transfer function at k points, p outputs and m inputs; NaN where P(s) is exactly singular."""

    values: ComplexArray  #: (p, m, k)
    data: FloatArray  #: (p, m, k) what relative errors of eps in the entries change, (DATA)
    slope: FloatArray  #: (p, m, k) size of ``s dH/ds``
    natural: FloatArray  #: (p, m, k) what an output would be if all unknowns were as large as the largest, scaled


def refined_response(
    P: Coefficients,
    B: Coefficients,
    F: Coefficients,
    D: Coefficients,
    points: ComplexArray,
    *,
    exact_powers: tuple[int, ...] = (),
    advance: Callable[[int], None] = lambda _: None,
) -> RefinedResponse:
    """Evaluate a dense model at every point.

    Parameters
    ----------
    P, B, F, D : sequences of (n, n), (n, m), (p, n), (p, m) ndarrays
        Coefficients of 1, s, s^2 or fewer of them.
    points : (k,) complex ndarray
    exact_powers : tuple of int
        Of s in P whose coefficients no rounding touches, such as the unit matrix of a state space.
    advance : callable
        Is told how many points are done since the last call.

    Examples
    --------
    A spring of 4 N/m under 2 N gives 0.5 m, to which force, stiffness and the output contribute one eps each:

    >>> four, two, one, none = ([np.array([[value]])] for value in (4.0, 2.0, 1.0, 0.0))
    >>> found = refined_response(four, two, one, none, np.array([1j]))
    >>> found.values[0, 0, 0].real.item(), round(found.data[0, 0, 0].item() / float(np.finfo(float).eps), 3)
    (0.5, 1.5)
    """
    return ResponseEvaluator(P, B, F, D, points, exact_powers=exact_powers).response(advance=advance)


@dataclass(slots=True, eq=False)
class _Point:
    """P(s), factorized, and what it is solved for."""

    place: int
    s: complex
    inputs: IndexArray  #: columns of B
    factors: Factors
    right: ComplexArray
    x: ComplexArray
    is_coarse: bool  #: whether the factors give not even a few digits


class ResponseEvaluator:
    """Evaluates a dense model at points, with or without refinement, all columns or some.

    Parameters are those of `refined_response`. Slopes and natural sizes are found for `sizes` alone.
    """

    def __init__(
        self,
        P: Coefficients,
        B: Coefficients,
        F: Coefficients,
        D: Coefficients,
        points: ComplexArray,
        *,
        exact_powers: tuple[int, ...] = (),
        sizes: bool = True,
    ) -> None:
        self.P, self.B, self.F, self.D = (MatrixPolynomial(parts) for parts in (P, B, F, D))
        self.touched = MatrixPolynomial([0.0 * part if k in exact_powers else part for k, part in enumerate(P)])
        self.exact = ExactPolynomial([as_it_is(part) for part in P])
        self.coefficients = P
        self.transposed: ExactPolynomial | None = None  #: made when it is needed
        self.points, self.sizes = points, sizes

    def response(self, *, refined: bool = True, advance: Callable[[int], None] = lambda _: None) -> RefinedResponse:
        """Evaluate all columns at every point."""
        shape = (self.points.size, *self.D.shape)
        values = np.full(shape, np.nan, dtype=np.complex128)
        sizes = [np.full(shape if needed else (1, 1, 1), np.nan) for needed in (True, self.sizes, self.sizes)]
        turned = [part.transpose(1, 2, 0) for part in (values, *sizes)]  # the values at a point lie side by side
        found = RefinedResponse(turned[0], turned[1], turned[2], turned[3])
        self._into(found, np.ones((self.D.shape[1], self.points.size), dtype=bool), refined, advance)
        return found

    def refine(
        self, found: RefinedResponse, wanted: npt.NDArray[np.bool_], advance: Callable[[int], None] = lambda _: None
    ) -> None:
        """Evaluate some columns anew, refined: `wanted` says of each of the m inputs at which of the k points."""
        self._into(found, wanted, refined=True, advance=advance)

    def _into(
        self,
        found: RefinedResponse,
        wanted: npt.NDArray[np.bool_],
        refined: bool,  # noqa: FBT001  # of the two public ones above
        advance: Callable[[int], None],
    ) -> None:
        """Write what is found, some points at a time."""
        places = np.flatnonzero(wanted.any(axis=0)) if wanted.size else np.arange(self.points.size)
        held = max(1, FACTORS_HELD // max(1, self.P.shape[0] ** 2))
        for start in range(0, places.size, held):
            chosen = places[start : start + held].tolist()
            with np.errstate(all="ignore"):
                tried = [self._factorized(place, np.flatnonzero(wanted[:, place])) for place in chosen]
                solved = [point for point in tried if point is not None and (refined or not point.factors.is_nudged)]
                if refined:
                    self._refine(solved)
                for point in solved:
                    self._finish(found, point)
            advance(len(chosen))

    def _factorized(self, place: int, inputs: IndexArray) -> _Point | None:
        s = complex(self.points[place])
        matrix, right = self.P.at(s), self.B.at(s)[:, inputs]
        factors = Factors.of_dense(matrix) if len(matrix) else NO_FACTORS
        if factors is None:
            return None
        return _Point(place, s, inputs, factors, right, factors.solve(right), is_coarse=factors.is_nudged)

    def _refine(self, solved: Sequence[_Point]) -> None:
        """Refine the solutions of all points until corrections are small; along weak directions where they do not."""
        last = {point.place: np.inf for point in solved}
        left = [point for point in solved if point.x.size]
        for _ in range(MOST_ROUNDS):
            if not left:
                break
            counts = [point.inputs.size for point in left]
            residual = self.exact.residual(
                np.repeat([point.s for point in left], counts),
                np.hstack([point.x for point in left]),
                np.hstack([point.right for point in left]),
            )
            further = []
            for point, part in zip(left, np.split(residual, np.cumsum(counts)[:-1], axis=1), strict=True):
                correction = point.factors.solve(part)
                share = _share(correction, point.x)
                point.is_coarse |= not share <= ENOUGH_FOR_DATA and not np.isfinite(last[point.place])
                if not share < min(1.0, last[point.place]):
                    continue
                point.x = point.x + correction
                last[point.place] = share
                if share > LAST_STEP:  # errors shrink by the same factor once more
                    further.append(point)
            left = further
        for point in solved:
            if point.x.size and (point.factors.is_nudged or last[point.place] > LAST_STEP):
                found = refined_along_weak(self.exact, point.s, point.x, point.right, point.factors)
                is_lost = found.is_singular or (point.factors.is_nudged and not found.is_settled)
                point.x = np.full_like(point.x, np.nan) if is_lost else found.solution

    def _adjoint(self, point: _Point, output: ComplexArray) -> ComplexArray:
        """Solve ``P^T y = F^T`` to a few digits."""
        right = np.asarray(output.T + 0j)
        y = point.factors.solve_transposed(right)
        if not point.is_coarse:
            return y
        if self.transposed is None:
            self.transposed = ExactPolynomial([as_it_is(part.T) for part in self.coefficients])
        return refined_at(self.transposed, point.s, y, right, point.factors.transposed, enough=ENOUGH_FOR_DATA).solution

    def _finish(self, found: RefinedResponse, point: _Point) -> None:
        s, x, inputs = point.s, point.x, point.inputs
        output = self.F.at(s)
        y = self._adjoint(point, output).T if len(x) else output
        found.values[:, inputs, point.place] = self.F.times(s, x) + self.D.at(s)[:, inputs]
        (sx, most), (sy, _) = _sizes(x, point.factors.across), _sizes(y.T, point.factors.down)
        terms = self.B.size_at(s)[:, inputs] + self.touched.size_times(s, sx)
        data = sy.T @ terms + self.F.size_times(s, sx) + self.D.size_at(s)[:, inputs]
        found.data[:, inputs, point.place] = EPS * data
        if self.sizes:
            change = self.B.slope_at(s)[:, inputs] - self.P.slope_times(s, x)
            moved = y @ change + self.F.slope_times(s, x) + self.D.slope_at(s)[:, inputs]
            found.slope[:, inputs, point.place] = np.abs(s * moved)
            found.natural[:, inputs, point.place] = self.F.size_times(s, most)


def _share(correction: ComplexArray, x: ComplexArray) -> float:
    """Return the largest correction of a column over its largest unknown."""
    size = np.abs(x).max(axis=0, initial=0.0)
    share = np.abs(correction).max(axis=0, initial=0.0) / np.where(size > 0.0, size, 1.0)
    return float(share.max(initial=0.0))


def _sizes(x: ComplexArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sizes of the unknowns, and what they would be if all were as large as the largest, scaled.

    One that should be zero is only as small as rounding lets it be.
    """
    size = np.abs(x)
    most = (size / scale).max(axis=0, initial=0.0) * scale
    return size + EPS * most, most
