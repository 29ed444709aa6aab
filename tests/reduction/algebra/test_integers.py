"""Exact arithmetic on floating-point numbers, against fractions and closed forms."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.reduction.algebra.integers import (
    as_floats,
    as_integers,
    log_determinant,
    solved_exactly,
    without_common_factor,
)

FLOATS = st.lists(st.floats(-1e9, 1e9, allow_subnormal=False), min_size=1, max_size=6)


@given(values=FLOATS)
def test_integers_over_their_power_of_two_are_the_numbers(values: list[float]) -> None:
    """``integers / 2^power`` is every number again, to the last bit."""
    given_values = np.array(values)
    integers, power = as_integers(given_values)
    assert [Fraction(int(integer), 2**power) for integer in integers] == [Fraction(value) for value in values]
    assert_array_equal(as_floats(integers, 2**power), given_values)


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 6))
def test_solution_of_integers_leaves_no_residual(seed: int, size: int) -> None:
    """``matrix X = d right`` holds exactly, also where a pivot is zero; X and d share no factor."""
    generator = np.random.default_rng(seed)
    matrix = generator.integers(-3, 4, (size, size)).astype(object)
    right = generator.integers(-9, 10, (size, 2)).astype(object)
    if round(float(np.linalg.det(matrix.astype(float)))) == 0:
        with pytest.raises(np.linalg.LinAlgError, match="The matrix is singular"):
            solved_exactly(matrix, right)
        assert log_determinant(matrix) == -math.inf
        return
    X, d = solved_exactly(matrix, right)
    assert_array_equal(matrix @ X, d * right)
    assert math.gcd(d, *X.ravel().tolist()) == 1


def test_determinant_beyond_all_floats_is_known() -> None:
    """The determinant of ``2^1500 I`` of size two is ``2^3000``."""
    matrix = np.array([[1 << 1500, 0], [7, 1 << 1500]], dtype=object)
    assert log_determinant(matrix) == pytest.approx(3000 * math.log(2.0), rel=1e-15)


def test_common_factor_is_divided_out() -> None:
    """6/12 and 9/12 are 2/4 and 3/4; numbers without a common factor stay."""
    numerators, denominator = without_common_factor(np.array([6, 9], dtype=object), 12)
    assert (numerators.tolist(), denominator) == ([2, 3], 4)
    assert without_common_factor(numerators, denominator)[0] is numerators
