"""Matrix polynomials ``R_0 + R_1 s + R_2 s^2`` at many points: values, sizes and slopes, and their products.

Coefficients with few entries, such as those that select DOFs, are multiplied as sparse ones.
"""

from typing import Any

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.base.exact_products import as_it_is
from halfdof_ctrl.model.quadratics import Coefficients


class MatrixPolynomial:
    """Dense coefficients of 1, s, s^2 or fewer of them.

    Examples
    --------
    ``3 + 2 s`` at 2j, times 5, and its slope:

    >>> polynomial = MatrixPolynomial([np.array([[3.0]]), np.array([[2.0]])])
    >>> five = np.array([[5.0 + 0j]])
    >>> [found.item() for found in (polynomial.at(2j), polynomial.times(2j, five), polynomial.slope_at(2j))]
    [(3+4j), (15+20j), (2+0j)]
    """

    def __init__(self, coefficients: Coefficients) -> None:
        self.shape: tuple[int, int] = coefficients[0].shape
        held = [(power, np.asarray(part)) for power, part in enumerate(coefficients) if part.any()]
        self.parts = [(power, np.asfortranarray(part)) for power, part in held]
        self.sizes = [(power, np.abs(part)) for power, part in self.parts]
        self._factors = [(power, as_it_is(part)) for power, part in held]
        self._size_factors = [(power, as_it_is(np.abs(part))) for power, part in held]

    def at(self, s: complex) -> ComplexArray:
        """Return the value at a point, in an array of its own."""
        value = np.zeros(self.shape, dtype=np.complex128, order="F")
        for power, part in self.parts:
            value += s**power * part if power else part
        return value

    def size_at(self, s: complex) -> FloatArray:
        """Return the sum of the sizes of the terms."""
        value = np.zeros(self.shape)
        for power, size in self.sizes:
            value += abs(s) ** power * size
        return value

    def slope_at(self, s: complex) -> DenseMatrix:
        """Return the derivative."""
        value: DenseMatrix = np.zeros(self.shape)
        for power, part in self.parts:
            if power:
                value = value + power * s ** (power - 1) * part
        return value

    def times(self, s: complex, x: ComplexArray) -> ComplexArray:
        """Return the value times an (n, k) array."""
        return np.asarray(_summed([(s**power, factor) for power, factor in self._factors], x, self.shape[0]))

    def slope_times(self, s: complex, x: ComplexArray) -> ComplexArray:
        """Return the derivative times an (n, k) array."""
        terms = [(power * s ** (power - 1), factor) for power, factor in self._factors if power]
        return np.asarray(_summed(terms, x, self.shape[0]))

    def size_times(self, s: complex, x: FloatArray) -> FloatArray:
        """Return the sum of the sizes of the terms times an (n, k) array of sizes."""
        terms = [(abs(s) ** power, factor) for power, factor in self._size_factors]
        return np.asarray(_summed(terms, x, self.shape[0]))


def _summed(terms: list[tuple[Any, Any]], x: Any, rows: int) -> Any:  # noqa: ANN401  # real and complex alike
    """Return the sum of numbers times matrices times an array; a real matrix meets real and imaginary parts alike."""
    value = np.zeros((rows, x.shape[1]), dtype=x.dtype)
    plain = np.ascontiguousarray(x)
    for number, factor in terms:
        if isinstance(factor, np.ndarray) and np.iscomplexobj(plain) and not np.iscomplexobj(factor):
            product = (factor @ plain.view(float)).view(np.complex128)
        else:
            product = factor @ plain
        value += number * product
    return value
