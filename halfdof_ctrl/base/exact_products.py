"""Residuals of matrix polynomials in twice the working precision, the same on every platform.

``K x + s (C x) + s^2 (M x)`` is worked term by term: the sum ``K + s C + s^2 M`` would lose what is small in it before
anything is multiplied. Sums and products of two doubles are split into a double and its error (T. J. Dekker, 1971;
D. E. Knuth). Matrix products are made exact by slices (K. Ozaki and others, 2012): the leading bits of the entries are
so few that their products add up without rounding, in whatever order a library does it; what is left is small and is
multiplied as usual. `numpy.longdouble` would not do, which is a double on Windows and on Apple's processors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, Matrix, powers_of_two
from halfdof_ctrl.base.double_double import BITS, Double2, two_product, two_sum
from halfdof_ctrl.base.sparse_arrays import as_sparse, is_sparse

SPARSE_SHARE = 0.1  #: a matrix with a smaller share of entries is multiplied as a sparse one
SMALL_MATRIX = 2500  #: entries of a matrix that is multiplied as it is
ROWS_TOGETHER = 4096  #: of long vectors that are multiplied: what is worked with stays near the processor


@dataclass(frozen=True, slots=True, eq=False)
class SlicedMatrix:
    """A real matrix as leading bits, the bits after them, and the rest."""

    first: Any  #: at most `bits` bits of each entry below the largest of its row
    second: Any  #: so many bits more
    rest: Any
    bits: int
    is_short: bool  #: whether the leading bits are all there are, as in the unit matrix

    @classmethod
    def of(cls, matrix: Matrix) -> "SlicedMatrix":
        """Cut a real dense or sparse matrix row by row."""
        if is_sparse(matrix):
            entries = csc_array(as_sparse(matrix))
            size = np.zeros(entries.shape[0])
            np.maximum.at(size, entries.indices, np.abs(entries.data))
            longest = int(np.bincount(entries.indices, minlength=1).max(initial=1))
            (first, second, rest), bits = _cut(entries.data, powers_of_two(size)[entries.indices], longest)
            place = (entries.indices, entries.indptr)
            shaped = [csc_array((part, *place), shape=entries.shape) for part in (first, second, rest)]
            return cls(shaped[0], shaped[1], shaped[2], bits, not (second.any() or rest.any()))
        array = np.asarray(matrix, dtype=float)
        scale = powers_of_two(np.abs(array).max(axis=1, initial=0.0))[:, None]
        (first, second, rest), bits = _cut(array, scale, array.shape[1])
        return cls(first, second, rest, bits, not (second.any() or rest.any()))

    def leading(self) -> Any:  # noqa: ANN401  # a matrix of the kind that is cut
        """Return the matrix but for its rest."""
        if is_sparse(self.first):
            place = (self.first.indices, self.first.indptr)
            return csc_array((self.first.data + self.second.data, *place), shape=self.first.shape)
        return self.first + self.second

    def times(self, x: FloatArray) -> list[FloatArray]:
        """Return parts whose sum is the product with an (n, k) array: three exact ones and one that is small."""
        scale = powers_of_two(np.abs(x).max(axis=0, initial=0.0))
        (first, second, rest), _ = _cut(x, scale, 1, self.bits)
        if self.is_short:
            return [self.first @ first, self.first @ second, self.first @ rest]
        small = self.first @ rest + self.second @ (second + rest) + self.rest @ x
        return [self.first @ first, self.first @ second, self.second @ first, small]


class ExactPolynomial:
    """``R_0 + R_1 s + R_2 s^2`` with coefficients cut for exact products."""

    def __init__(self, coefficients: Sequence[Matrix]) -> None:
        self.rows = coefficients[0].shape[0]
        self.parts: list[tuple[int, complex, SlicedMatrix]] = []
        for power, coefficient in enumerate(coefficients):
            matrix: Any = coefficient
            values: Any = as_sparse(matrix) if is_sparse(matrix) else np.asarray(matrix)
            for unit, part in ((1.0, values.real), (1j, values.imag)) if _is_complex(values) else ((1.0, values),):
                if (part.data if is_sparse(part) else part).any():
                    self.parts.append((power, unit, SlicedMatrix.of(part)))
        #: leading bits of those that act on what has errors, on s x and s^2 x
        self.leading = [matrix.leading() if power else None for power, _, matrix in self.parts]

    def residual(self, s: complex | ComplexArray, x: ComplexArray, right: ComplexArray | float = 0.0) -> ComplexArray:
        """Return ``right - P(s) x``, summed in twice the working precision and rounded once.

        Twice as precise as the largest entry of a row times the largest of x, not as each product.

        Parameters
        ----------
        s : complex or (k,) complex ndarray
            A point for all columns or one for each.
        x : (n, k) complex ndarray
        right : (rows, k) complex ndarray
            Of as many rows as P.

        Examples
        --------
        The sum ``1 + 1e-20`` rounds to 1; its product with x, less x, does not:

        >>> polynomial = ExactPolynomial([np.array([[1.0]]), np.array([[1e-20]])])
        >>> polynomial.residual(1.0, np.array([[1.0 + 0j]]), np.array([[1.0 + 0j]])).real.tolist()
        [[-1e-20]]
        """
        columns = x.shape[1]
        total = _Sum(_side_by_side(np.broadcast_to(np.asarray(right, dtype=np.complex128), (self.rows, columns))))
        points = np.broadcast_to(np.asarray(s, dtype=np.complex128), x.shape[1:])
        first = _side_by_side(x)
        powers: list[Double2] = [(first, np.zeros_like(first))]
        for (power, unit, matrix), leading in zip(self.parts, self.leading, strict=True):
            while len(powers) <= power:
                powers.append(_times(powers[-1], points))
            vector, errors = powers[power]
            parts = matrix.times(vector)
            if leading is not None:
                parts.append(leading @ errors)
            for part in parts:
                total.subtract(part if unit == 1.0 else _turned(part))
        value = total.value()
        return np.asarray(value[:, :columns] + 1j * value[:, columns:])


def _is_complex(values: Any) -> bool:  # noqa: ANN401  # dense or sparse
    return np.iscomplexobj(values.data if is_sparse(values) else values)


def _side_by_side(x: ComplexArray) -> FloatArray:
    """Return real and imaginary parts side by side."""
    return np.hstack([x.real, x.imag])


def _turned(parts: FloatArray) -> FloatArray:
    """Return real and imaginary parts, side by side, times i."""
    columns = parts.shape[1] // 2
    return np.hstack([-parts[:, columns:], parts[:, :columns]])


def _times(vector: Double2, s: ComplexArray) -> Double2:
    """Return complex numbers with errors, real and imaginary parts side by side, each column times its point."""
    if len(vector[0]) > ROWS_TOGETHER:
        starts = range(0, len(vector[0]), ROWS_TOGETHER)
        pieces = [_times((vector[0][k : k + ROWS_TOGETHER], vector[1][k : k + ROWS_TOGETHER]), s) for k in starts]
        return np.concatenate([piece[0] for piece in pieces]), np.concatenate([piece[1] for piece in pieces])
    turned = (_turned(vector[0]), _turned(vector[1]))
    return _added(_scaled(vector, np.tile(s.real, 2)), _scaled(turned, np.tile(s.imag, 2)))


class _Sum:
    """Sums of doubles with their errors."""

    def __init__(self, start: FloatArray) -> None:
        self.high = start
        self.low = np.zeros_like(start)

    def subtract(self, value: FloatArray) -> None:
        self.high, error = two_sum(self.high, -value)
        self.low += error

    def value(self) -> FloatArray:
        return np.asarray(self.high + self.low)


def as_it_is(matrix: FloatArray) -> Matrix:
    """Return a large dense matrix with few entries as a sparse one, whose residuals take less time."""
    few = matrix.size > SMALL_MATRIX and np.count_nonzero(matrix) < SPARSE_SHARE * matrix.size
    return csc_array(matrix) if few else matrix


def _scaled(pair: Double2, factor: FloatArray) -> Double2:
    high, error = two_product(pair[0], factor)
    return high, error + pair[1] * factor


def _added(a: Double2, b: Double2) -> Double2:
    high, error = two_sum(a[0], b[0])
    return high, error + (a[1] + b[1])


def _cut(
    values: FloatArray, scale: npt.NDArray[np.float64], terms: int, bits: int | None = None
) -> tuple[tuple[FloatArray, FloatArray, FloatArray], int]:
    """Cut numbers into leading bits, as many below 1 / scale as sums of that length allow, the next, and the rest."""
    count = (BITS - 1 - int(np.ceil(np.log2(max(terms, 1))))) // 2 if bits is None else bits
    unit = 2.0**count
    first = np.rint(values * scale * unit) / unit / scale
    left = values - first
    second = np.rint(left * scale * unit**2) / unit**2 / scale
    return (first, second, left - second), count
