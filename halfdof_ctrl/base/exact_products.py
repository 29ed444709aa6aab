"""Residuals of matrix polynomials in twice the working precision, the same on every platform.

``K x + s (C x) + s^2 (M x)`` is worked term by term: the sum ``K + s C + s^2 M`` would lose what is small in it before
anything is multiplied. Sums and products of two doubles are split into a double and its error (T. J. Dekker, 1971;
D. E. Knuth). Matrix products are made exact by slices (K. Ozaki and others, 2012): the leading bits of the entries are
so few that their products add up without rounding, in whatever order a library does it; what is left is small and is
multiplied as usual. `numpy.longdouble` would not do, which is a double on Windows and on Apple's processors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, Matrix, powers_of_two
from halfdof_ctrl.base.double_double import BITS, SPLITTER
from halfdof_ctrl.base.sparse_arrays import as_sparse, is_sparse

SPARSE_SHARE = 0.1  #: a matrix with a smaller share of entries is multiplied as a sparse one
SMALL_MATRIX = 2500  #: entries of a matrix that is multiplied as it is
Pair: TypeAlias = tuple[FloatArray, FloatArray]  #: a number as the sum of a double and its error


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
        self.parts: list[tuple[int, complex, SlicedMatrix]] = []
        for power, coefficient in enumerate(coefficients):
            matrix: Any = coefficient
            values: Any = as_sparse(matrix) if is_sparse(matrix) else np.asarray(matrix)
            if np.iscomplexobj(values.data if is_sparse(matrix) else values):
                self.parts += [(power, 1.0, SlicedMatrix.of(values.real)), (power, 1j, SlicedMatrix.of(values.imag))]
            else:
                self.parts.append((power, 1.0, SlicedMatrix.of(values)))

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
        rows = self.parts[0][2].first.shape[0]
        total = _Sum(np.broadcast_to(np.asarray(right, dtype=np.complex128), (rows, x.shape[1])))
        points = np.broadcast_to(np.asarray(s, dtype=np.complex128), x.shape[1:])
        powers = [_Complex.of(x)]
        for power, unit, matrix in self.parts:
            while len(powers) <= power:
                powers.append(powers[-1].times(points))
            vector = powers[power]
            columns = x.shape[1]
            both = np.hstack([vector.real[0], vector.imag[0]])
            parts = matrix.times(both)
            if power:  # x itself has no errors
                parts.append((matrix.first + matrix.second) @ np.hstack([vector.real[1], vector.imag[1]]))
            for part in parts:
                value = part[:, :columns] + 1j * part[:, columns:]
                total.subtract(value if unit == 1.0 else 1j * value)
        return total.value()


class _Sum:
    """Complex sums of doubles with their errors."""

    def __init__(self, start: ComplexArray) -> None:
        self.high = start.copy()
        self.low = np.zeros_like(start)

    def subtract(self, value: ComplexArray) -> None:
        real, real_error = two_sum(self.high.real, -value.real)
        imag, imag_error = two_sum(self.high.imag, -value.imag)
        self.high = real + 1j * imag
        self.low += real_error + 1j * imag_error

    def value(self) -> ComplexArray:
        return np.asarray(self.high + self.low)


@dataclass(frozen=True, slots=True, eq=False)
class _Complex:
    """Complex numbers whose parts are doubles with errors."""

    real: Pair
    imag: Pair

    @classmethod
    def of(cls, x: ComplexArray) -> "_Complex":
        none = np.zeros(x.shape)
        return cls((x.real.copy(), none), (x.imag.copy(), none))

    def times(self, s: ComplexArray) -> "_Complex":
        real, imag = s.real, s.imag
        return _Complex(
            _added(_scaled(self.real, real), _scaled(self.imag, -imag)),
            _added(_scaled(self.real, imag), _scaled(self.imag, real)),
        )


def as_it_is(matrix: FloatArray) -> Matrix:
    """Return a large dense matrix with few entries as a sparse one, whose residuals take less time."""
    few = matrix.size > SMALL_MATRIX and np.count_nonzero(matrix) < SPARSE_SHARE * matrix.size
    return csc_array(matrix) if few else matrix


def two_sum(a: FloatArray, b: FloatArray) -> Pair:
    """Return the rounded sum and its error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: FloatArray, b: FloatArray) -> Pair:
    """Return the rounded product and its error, for numbers whose product neither overflows nor vanishes."""
    value = a * b
    a_high, b_high = (SPLITTER * x - (SPLITTER * x - x) for x in (a, b))
    a_low, b_low = a - a_high, b - b_high
    return value, ((a_high * b_high - value) + a_high * b_low + a_low * b_high) + a_low * b_low


def _scaled(pair: Pair, factor: FloatArray) -> Pair:
    high, error = two_product(pair[0], np.broadcast_to(factor, pair[0].shape))
    return high, error + pair[1] * factor


def _added(a: Pair, b: Pair) -> Pair:
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
