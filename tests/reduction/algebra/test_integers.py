"""Exact arithmetic on floating-point numbers, against fractions and closed forms."""

import math
from fractions import Fraction

import flint
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.reduction.algebra.integers import (
    PRIME,
    as_floats,
    as_integers,
    degree_of_determinant,
    independent_of,
    is_regular,
    least_rank,
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


@pytest.mark.parametrize("power", range(1, 200))
def test_powers_of_two_are_told_from_one_and_from_each_other(power: int) -> None:
    """Units that round nothing make such numbers: no rank may depend on them."""
    matrix = np.array([[1.0, 1.0], [1.0, 2.0**power]])
    assert least_rank(matrix) == 2
    assert independent_of(as_integers(matrix)[0], range(2)) == [0, 1]
    assert is_regular(np.stack([matrix, 0 * matrix, 0 * matrix]))
    assert degree_of_determinant(np.stack([np.eye(2), np.zeros((2, 2)), matrix])) == 4


def test_two_is_a_primitive_root_of_the_prime() -> None:
    """Its powers have every remainder but zero before they come again."""
    factors = flint.fmpz(PRIME - 1).factor()
    assert flint.fmpz(PRIME).is_prime()
    assert all(pow(2, (PRIME - 1) // int(factor), PRIME) != 1 for factor, _ in factors)
