"""Residuals in twice the working precision against rational arithmetic."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.sparse import csc_array

from halfdof_ctrl.base import exact_products
from halfdof_ctrl.base.arrays import Matrix
from halfdof_ctrl.base.double_double import two_product, two_sum
from halfdof_ctrl.base.exact_products import ExactPolynomial

LAST_DIGIT = 2.0**-52  #: of the residual itself, which is rounded once
TWICE = 2.0**-95  #: of the largest entries of row and vector: what twice the working precision leaves


@given(seed=st.integers(0, 2**32 - 1), power=st.integers(-60, 60))
def test_sums_and_products_are_split_without_error(seed: int, power: int) -> None:
    """``a + b`` and ``a b`` are the rounded value and its error, exactly."""
    generator = np.random.default_rng(seed)
    a, b = generator.standard_normal((2, 5)) * [[1.0], [2.0**power]]
    for split, operation in ((two_sum, Fraction.__add__), (two_product, Fraction.__mul__)):
        value, error = split(a, b)
        exact = [operation(Fraction(x), Fraction(y)) for x, y in zip(a, b, strict=True)]
        assert [Fraction(v) + Fraction(e) for v, e in zip(value, error, strict=True)] == exact


def exact_residual(
    coefficients: list[np.ndarray], s: complex, x: np.ndarray, i: int
) -> tuple[Fraction, Fraction, float]:
    """Give real and imaginary part of row i of ``1 - P(s) x``, and the largest size of its terms."""
    real, imag, size = Fraction(1), Fraction(0), 1.0
    power = (Fraction(1), Fraction(0))
    step = (Fraction(s.real), Fraction(s.imag))
    for matrix in coefficients:
        for entry, value in zip(matrix[i].tolist(), x.tolist(), strict=True):
            a, b = Fraction(complex(entry).real), Fraction(complex(entry).imag)
            c, d = Fraction(value.real), Fraction(value.imag)
            c, d = power[0] * c - power[1] * d, power[0] * d + power[1] * c
            real, imag = real - (a * c - b * d), imag - (a * d + b * c)
        size += float(np.abs(matrix[i]).max() * np.abs(x).max()) * abs(complex(float(power[0]), float(power[1])))
        power = (power[0] * step[0] - power[1] * step[1], power[0] * step[1] + power[1] * step[0])
    return real, imag, size


@pytest.mark.parametrize("is_sparse", [False, True])
@pytest.mark.parametrize("is_complex", [False, True])
def test_residual_is_that_of_rational_arithmetic(*, is_sparse: bool, is_complex: bool) -> None:
    """Terms over 24 decades that cancel: the last digit of the residual is right."""
    generator = np.random.default_rng(3)
    n, s = 20, 3.0 + 2.0e3j
    matrices = [generator.standard_normal((n, n)) * 10.0 ** generator.integers(-6, 7, (n, n)) for _ in range(3)]
    matrices = [matrix * (generator.random((n, n)) < 0.3) for matrix in matrices]
    if is_complex:
        matrices[0] = matrices[0] * (1.0 + 0.1j)
    P = np.asarray(sum(s**k * matrix for k, matrix in enumerate(matrices)), dtype=np.complex128)
    x = np.asarray(np.linalg.solve(P + np.eye(n), np.ones(n)), dtype=np.complex128)
    stored = [csc_array(matrix) for matrix in matrices] if is_sparse else matrices
    found = ExactPolynomial(stored).residual(s, x[:, None], np.ones((n, 1), dtype=complex))[:, 0]
    for i in range(n):
        real, imag, size = exact_residual(matrices, s, x, i)
        error = abs(complex(float(Fraction(found[i].real) - real), float(Fraction(found[i].imag) - imag)))
        assert error <= LAST_DIGIT * abs(found[i]) + TWICE * size


def test_residual_does_not_depend_on_the_order_of_the_unknowns() -> None:
    """Exact products have one value, in whatever order a library adds them up."""
    generator = np.random.default_rng(0)
    n = 64
    matrices = [generator.standard_normal((n, n)) for _ in range(3)]
    x = generator.standard_normal((n, 2)) + 1j * generator.standard_normal((n, 2))
    order = generator.permutation(n)
    plain = ExactPolynomial(matrices).residual(0.3j, x)
    turned = ExactPolynomial([matrix[:, order] for matrix in matrices]).residual(0.3j, x[order])
    assert_array_equal(turned, plain)


@pytest.mark.parametrize("kind", [np.asarray, csc_array])
def test_coefficients_of_zeros_take_nothing_away(kind: Callable[[np.ndarray], Matrix]) -> None:
    """A polynomial without entries leaves the right-hand side, in as many rows as it has."""
    none, x = kind(np.zeros((3, 2))), np.ones((2, 4), dtype=np.complex128)
    right = np.arange(12.0).reshape(3, 4).astype(np.complex128)
    assert_array_equal(ExactPolynomial([none, none, none]).residual(2j, x, right), right)
    entries = kind(np.eye(3, 2) * (1.0 + 2.0j))
    assert_array_equal(
        ExactPolynomial([none, none, entries]).residual(2j, x, right),
        right + np.array([[4.0 + 8.0j], [4.0 + 8.0j], [0.0]]),
    )


def test_long_vectors_are_worked_in_pieces_as_they_are_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each row is multiplied by the powers of s for itself: where a piece ends changes no bit."""
    generator = np.random.default_rng(0)
    polynomial = ExactPolynomial(list(generator.standard_normal((3, 8, 8))))
    real, imag = generator.standard_normal((2, 8, 5))
    x, s = real + 1j * imag, 0.3 + 1.7j
    whole = polynomial.residual(s, x)
    monkeypatch.setattr(exact_products, "ROWS_TOGETHER", 3)
    assert_array_equal(polynomial.residual(s, x), whole)
