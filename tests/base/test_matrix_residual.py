"""Residuals of matrix products against rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.base.matrix_residual import COLUMNS_TOGETHER, exact_product, exact_residual

BEYOND = 2.0**-85  #: of the largest terms: what is left of twice the working precision


def _random(seed: int) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    n, k, m = generator.integers(1, 9, 3)
    left = generator.standard_normal((n, k)) * 10.0 ** generator.integers(-5, 6, (n, k))
    return left, generator.standard_normal((k, m)) * 10.0 ** generator.integers(-5, 6, (k, m))


@given(st.integers(0, 10**6))
def test_residual_of_a_rounded_product_is_its_rounding_error(seed: int) -> None:
    """``fl(L R) - L R`` by fractions, entry by entry."""
    left, right = _random(seed)
    rounded = left @ right
    found = exact_residual(rounded, left, right)
    for i, j in np.ndindex(*rounded.shape):
        terms = [Fraction(a) * Fraction(b) for a, b in zip(left[i].tolist(), right[:, j].tolist(), strict=True)]
        size = np.abs(left[i]).max() * np.abs(right[:, j]).max() * len(terms)
        assert abs(Fraction(float(rounded[i, j])) - sum(terms) - Fraction(float(found[i, j]))) <= BEYOND * size


def test_empty_factors_give_zeros() -> None:
    """A product over no terms is zero, so that the residual is the target."""
    assert_array_equal(exact_product(np.zeros((2, 0)), np.zeros((0, 3))), np.zeros((2, 3)))
    assert_array_equal(exact_residual(np.ones((2, 3)), np.zeros((2, 0)), np.zeros((0, 3))), np.ones((2, 3)))


def test_many_columns_are_worked_as_each_of_them_is() -> None:
    """A sparse factor multiplies a few columns at a time, to the last bit as it does single ones."""
    generator = np.random.default_rng(0)
    left = np.diag(generator.standard_normal(60)) + np.diag(generator.standard_normal(59), 1)
    right, target = generator.standard_normal((2, 60, 2 * COLUMNS_TOGETHER + 3))
    single = [exact_residual(target[:, [j]], left, right[:, [j]]) for j in range(right.shape[1])]
    assert_array_equal(exact_residual(target, left, right), np.hstack(single))
