"""Transfer functions by refined solves, with what rounding of the entries makes of them, (DATA), for the cross-check.

    H(s) = F(s) P(s)^-1 B(s) + D(s),    P x = B,    P^T y = F^T

Residuals are summed term by term in twice the working precision, so that x is as good as the stored entries say. With
y, relative errors of eps in every entry change the response by

    eps (|y|^T (|P_0| + |s| |P_1| + |s|^2 |P_2|) |x| + |y|^T |B| + |F| |x| + |D|).           (DATA)

Where (DATA) is far above rounding of the value, as of an acceleration below all modes, whose terms F x + D cancel, or
of a small unknown beside large ones, x needs more digits than it has. There the sum is formed in twice the working
precision too, and what x lacks follows from its residual,

    H(s) = F x + D + y^T (B - P x).

Residuals are as precise as the largest entry of a row times the largest unknown, so that equations and unknowns are
scaled first.

Refinement takes several times as long as the solves, so it can be left for the columns of P x = B that ask for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, IndexArray
from halfdof_ctrl.base.exact_products import ExactPolynomial, as_it_is
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.descriptor.matrix_polynomial import MatrixPolynomial
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.refinement import ENOUGH_FOR_DATA, REFINED_ENOUGH
from halfdof_ctrl.model.weak_directions import Factors, refined_along_weak, refined_at

FACTORS_HELD = 2**20  #: complex entries of factors held at a time (16 MB)
MOST_ROUNDS = 4  #: of refinement; two are enough but where P(s) is nearly singular
LAST_STEP = REFINED_ENOUGH**0.5  #: a correction below this part of the largest unknown is the last but for rounding
SENSITIVE = 64.0  #: times rounding of a value, (DATA) from which x needs more digits than it has
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


class _Sensitive(NamedTuple):
    """Columns at a point for which x lacks digits."""

    place: int
    inputs: IndexArray
    x: ComplexArray  #: (n, len(inputs))
    y: ComplexArray  #: (p, n)


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
        rows, columns = _scales(P, points)
        P, B, F = [rows * part * columns for part in P], [rows * part for part in B], [part * columns for part in F]
        self.P, self.B, self.F, self.D = (MatrixPolynomial(parts) for parts in (P, B, F, D))
        self.touched = MatrixPolynomial([0.0 * part if k in exact_powers else part for k, part in enumerate(P)])
        self.exact = ExactPolynomial([as_it_is(part) for part in P])
        self.coefficients = P
        self.inputs, self.outputs = B, (F, D)
        self.transposed: ExactPolynomial | None = None  #: made when it is needed, and so are ...
        self.together: tuple[ExactPolynomial, ExactPolynomial] | None = None  #: ... ``[P -B]`` and ``[-F -D]``
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
                sensitive = [self._finish(found, point) for point in solved]
                if refined:
                    self._sum_again(found, [part for part in sensitive if part.inputs.size])
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

    def _finish(self, found: RefinedResponse, point: _Point) -> _Sensitive:
        """Write what is found at a point, and return the columns that need more digits."""
        s, x, inputs = point.s, point.x, point.inputs
        output = self.F.at(s)
        y = self._adjoint(point, output).T if len(x) else output
        (sx, most), (sy, _) = _sizes(x, point.factors.across), _sizes(y.T, point.factors.down)
        values = self.F.times(s, x) + self.D.at(s)[:, inputs]
        found.values[:, inputs, point.place] = values
        terms = self.B.size_at(s)[:, inputs] + self.touched.size_times(s, sx)
        data = EPS * (sy.T @ terms + self.F.size_times(s, sx) + self.D.size_at(s)[:, inputs])
        found.data[:, inputs, point.place] = data
        if self.sizes:
            change = self.B.slope_at(s)[:, inputs] - self.P.slope_times(s, x)
            moved = y @ change + self.F.slope_times(s, x) + self.D.slope_at(s)[:, inputs]
            found.slope[:, inputs, point.place] = np.abs(s * moved)
            found.natural[:, inputs, point.place] = self.F.size_times(s, most)
        lacks = (data > SENSITIVE * EPS * np.abs(values)).any(axis=0) & bool(len(x))
        return _Sensitive(point.place, inputs[lacks], x[:, lacks], y)

    def _sum_again(self, found: RefinedResponse, left: Sequence[_Sensitive]) -> None:
        """Write ``F x + D + y^T (B - P x)`` where x lacks digits, all points at once."""
        if not left:
            return
        if self.together is None:
            more = [np.zeros(self.B.shape)] * (len(self.coefficients) - len(self.inputs))
            driven, (F, D) = [-part for part in self.inputs] + more, self.outputs
            self.together = _side_by_side(self.coefficients, driven), _side_by_side([-f for f in F], [-d for d in D])
        places = np.repeat([part.place for part in left], [part.inputs.size for part in left])
        inputs = np.concatenate([part.inputs for part in left])
        unknowns = np.vstack([np.hstack([part.x for part in left]), np.eye(self.D.shape[1])[:, inputs]])
        sums, residual = (side.residual(self.points[places], unknowns) for side in self.together[::-1])
        ends = np.cumsum([part.inputs.size for part in left])[:-1]
        lacking = [part.y @ rest for part, rest in zip(left, np.split(residual, ends, axis=1), strict=True)]
        found.values[:, inputs, places] = sums + np.hstack(lacking)


def _side_by_side(one: Coefficients, other: Coefficients) -> ExactPolynomial:
    """Return two matrix polynomials as one."""
    return ExactPolynomial([as_it_is(np.hstack(parts)) for parts in zip(one, other, strict=True)])


def _scales(P: Coefficients, points: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return powers of two for the equations (n, 1) and the unknowns (n,), at the frequency in the middle."""
    away = np.abs(points[points != 0.0])
    middle = float(np.exp(np.log(away).mean())) if away.size else 1.0
    size = np.zeros(P[0].shape)
    for power, part in enumerate(P):
        size += middle**power * np.abs(part)
    rows, columns = scaling_powers(size)
    return rows[:, None], columns


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
