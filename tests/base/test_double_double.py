"""Sums and products in about twice the working precision, against rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.base.double_double import added, matrix_product, two_product, two_sum

DIGITS = Fraction(1, 2**90)  # of the largest entry of a row times the largest of a column, for a few terms
NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False).map(lambda value: value if abs(value) > 1e-6 else 0.0)


@given(st.lists(NUMBERS, min_size=12, max_size=12), st.lists(NUMBERS, min_size=12, max_size=12))
def test_a_product_keeps_what_cancels(left: list[float], right: list[float]) -> None:
    """Every entry against the exact sum of exact products."""
    A, B = np.reshape(left, (3, 4)), np.reshape(right, (4, 3))
    high, low = matrix_product(A, B)
    for i in range(3):
        for j in range(3):
            exact = sum(Fraction(float(a)) * Fraction(float(b)) for a, b in zip(A[i], B[:, j], strict=True))
            scale = Fraction(float(np.abs(A[i]).max())) * Fraction(float(np.abs(B[:, j]).max()))
            assert abs(Fraction(float(high[i, j])) + Fraction(float(low[i, j])) - exact) <= DIGITS * scale


@given(NUMBERS, NUMBERS)
def test_sums_and_products_of_two_are_exact(a: float, b: float) -> None:
    """Value and error add up to the rational result."""
    total, error = two_sum(np.float64(a), np.float64(b))  # type: ignore[arg-type]  # a number is an array here
    assert Fraction(float(total)) + Fraction(float(error)) == Fraction(a) + Fraction(b)
    product, rest = two_product(np.float64(a), np.float64(b))  # type: ignore[arg-type]
    assert Fraction(float(product)) + Fraction(float(rest)) == Fraction(a) * Fraction(b)


def test_pairs_add() -> None:
    """1 + 2^-70 less 1 is 2^-70."""
    one, small = np.ones(1), np.full(1, 2.0**-70)
    high, low = added((one, small), (-one, np.zeros(1)))
    assert high[0] + low[0] == 2.0**-70
