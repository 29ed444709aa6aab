"""Transfer functions by refined solves, with what rounding of the entries makes of them, (DATA), for the cross-check.

    H(s) = F(s) P(s)^-1 B(s) + D(s),    P x = B,    P^T y = F^T

Residuals are summed term by term in twice the working precision, so that x is as good as the stored entries say. With
y, relative errors of eps in every entry change the response by

    eps (|y|^T (|P_0| + |s| |P_1| + |s|^2 |P_2|) |x| + |y|^T |B| + |F| |x| + |D|).           (DATA)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import zgetrf, zgetrs

from halfdof_ctrl.base.arrays import EPS, ComplexArray, DenseMatrix, FloatArray, powers_of_two
from halfdof_ctrl.base.exact_products import ExactPolynomial, as_it_is
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.refinement import REFINED_ENOUGH

FACTORS_HELD = 2**20  #: complex entries of factors held at a time (16 MB)
MOST_ROUNDS = 4  #: of refinement; two are enough but where P(s) is nearly singular


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
    shape = (*D[0].shape, points.size)
    sizes = [np.full(shape, np.nan) for _ in range(3)]
    found = RefinedResponse(np.full(shape, np.nan, dtype=np.complex128), *sizes)
    evaluator = _Evaluator(P, B, F, D, exact_powers)
    held = max(1, FACTORS_HELD // max(1, P[0].size))
    for start in range(0, points.size, held):
        places = list(range(start, min(start + held, points.size)))
        evaluator.into(found, points, places)
        advance(len(places))
    return found


@dataclass(slots=True, eq=False)
class _Point:
    """P(s), scaled by powers of two and factorized, and what it is solved for."""

    place: int
    s: complex
    rows: FloatArray
    columns: FloatArray
    lu: ComplexArray
    pivots: FloatArray
    right: ComplexArray
    output: ComplexArray
    x: ComplexArray

    def solve(self, right: ComplexArray) -> ComplexArray:
        return np.asarray(zgetrs(self.lu, self.pivots, right * self.rows[:, None])[0] * self.columns[:, None])

    def solve_transposed(self, right: ComplexArray) -> ComplexArray:
        solved = zgetrs(self.lu, self.pivots, right * self.columns[:, None], trans=1)[0]
        return np.asarray(solved * self.rows[:, None])


class _Evaluator:
    """Works through points, some at a time."""

    def __init__(
        self, P: Coefficients, B: Coefficients, F: Coefficients, D: Coefficients, exact_powers: tuple[int, ...]
    ) -> None:
        self.P, self.B, self.F, self.D = P, B, F, D
        self.exact = ExactPolynomial([as_it_is(part) for part in P])
        self.sizes = [np.abs(part) if k not in exact_powers and part.any() else None for k, part in enumerate(P)]

    def into(self, found: RefinedResponse, points: ComplexArray, places: list[int]) -> None:
        """Write what is found at some of the points."""
        with np.errstate(all="ignore"):
            tried = [self._factorized(place, complex(points[place])) for place in places]
            solved = [point for point in tried if point is not None]
            self._refine(solved)
            for point in solved:
                self._finish(found, point)

    def _factorized(self, place: int, s: complex) -> _Point | None:
        matrix = _at(self.P, s)
        if not len(matrix):
            empty = np.zeros(0)
            right, output = _at(self.B, s), _at(self.F, s)
            return _Point(place, s, empty, empty, matrix, empty, right, output, right)
        rows = powers_of_two(np.abs(matrix).max(axis=1))
        matrix = matrix * rows[:, None]
        columns = powers_of_two(np.abs(matrix).max(axis=0))
        lu, pivots, info = zgetrf(matrix * columns, overwrite_a=True)
        if info != 0:
            return None
        point = _Point(place, s, rows, columns, lu, pivots, _at(self.B, s), _at(self.F, s), matrix)
        point.x = point.solve(point.right)
        return point

    def _refine(self, solved: list[_Point]) -> None:
        """Refine the solutions of all points until corrections are small or no longer shrink."""
        last = {point.place: np.inf for point in solved}
        left = [point for point in solved if point.x.size]
        for _ in range(MOST_ROUNDS):
            if not left:
                return
            columns = left[0].x.shape[1]
            residual = self.exact.residual(
                np.repeat([point.s for point in left], columns),
                np.hstack([point.x for point in left]),
                np.hstack([point.right for point in left]),
            )
            further = []
            for k, point in enumerate(left):
                correction = point.solve(residual[:, k * columns : (k + 1) * columns])
                share = _share(correction, point.x)
                if not share < min(1.0, last[point.place]):
                    continue
                point.x = point.x + correction
                last[point.place] = share
                if share > REFINED_ENOUGH**0.5:  # errors shrink by the same factor once more
                    further.append(point)
            left = further

    def _finish(self, found: RefinedResponse, point: _Point) -> None:
        s, x = point.s, point.x
        y = point.solve_transposed(point.output.T.copy()).T if x.size or len(point.rows) else point.output
        found.values[:, :, point.place] = point.output @ x + _at(self.D, s)
        change = _slope(self.B, s) - _slope(self.P, s) @ x
        moved = y @ change + _slope(self.F, s) @ x + _slope(self.D, s)
        found.slope[:, :, point.place] = np.abs(s * moved)
        (sx, most), (sy, _) = _sizes(x, point.columns), _sizes(y.T, point.rows)
        terms = _size_at(self.B, s)
        for power, size in enumerate(self.sizes):
            if size is not None:
                terms = terms + abs(s) ** power * (size @ sx)
        output = _size_at(self.F, s)
        found.data[:, :, point.place] = EPS * (sy.T @ terms + output @ sx + _size_at(self.D, s))
        found.natural[:, :, point.place] = output @ most


def _share(correction: ComplexArray, x: ComplexArray) -> float:
    """Return the largest correction of a column over its largest unknown."""
    size = np.abs(x).max(axis=0, initial=0.0)
    share = np.abs(correction).max(axis=0, initial=0.0) / np.where(size > 0.0, size, 1.0)
    return float(share.max(initial=0.0))


def _sizes(x: ComplexArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sizes of the unknowns, and what they would be if all were as large as the largest, scaled.

    One that should be zero is only as small as rounding lets it be.
    """
    most = (np.abs(x) / scale[:, None]).max(axis=0, initial=0.0) * scale[:, None]
    return np.abs(x) + EPS * most, most


def _at(coefficients: Coefficients, s: complex) -> ComplexArray:
    value = np.asarray(coefficients[0], dtype=np.complex128)
    for power, part in enumerate(coefficients[1:], start=1):
        if part.any():
            value = value + s**power * part
    return value


def _size_at(coefficients: Coefficients, s: complex) -> FloatArray:
    return np.asarray(sum(abs(s) ** power * np.abs(part) for power, part in enumerate(coefficients)))


def _slope(coefficients: Coefficients, s: complex) -> DenseMatrix:
    """Return the derivative of a matrix polynomial."""
    value: DenseMatrix = np.zeros(coefficients[0].shape)
    for power, part in enumerate(coefficients[1:], start=1):
        if part.any():
            value = value + power * s ** (power - 1) * part
    return value
