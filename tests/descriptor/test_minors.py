"""Zeros of system pencils that are not square, against the greatest common divisor of all their minors."""

from itertools import combinations
from typing import Any

import flint
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl.descriptor.minors import invariant_zeros
from support import exact

SCATTER = 1e-6  # of simple zeros, relative to the zero or one


def divisor_of_minors(parts: list[np.ndarray]) -> flint.fmpq_poly:
    """Give the greatest common divisor of the largest minors that do not all vanish."""
    rows, columns = parts[0].shape
    for rank in range(min(rows, columns), 0, -1):
        divisor = flint.fmpq_poly([])
        for i in combinations(range(rows), rank):
            for j in combinations(range(columns), rank):
                divisor = divisor.gcd(exact.polynomial_determinant([part[np.ix_(i, j)] for part in parts]))
        if divisor.degree() >= 0:
            return divisor
    return flint.fmpq_poly([1])


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 4), columns=st.integers(1, 4), inner=st.integers(1, 3))
def test_zeros_of_any_shape_are_those_of_the_minors(seed: int, rows: int, columns: int, inner: int) -> None:
    """A square factor between two random ones brings zeros, an inner size below both a lower rank."""
    generator = np.random.default_rng(seed)
    left, right = generator.integers(-2, 3, (rows, inner)), generator.integers(-2, 3, (inner, columns))
    middle = generator.integers(-2, 3, (3, inner, inner)) * generator.integers(0, 2, (3, inner, inner))
    parts = [np.asarray(left @ part @ right, dtype=float) for part in middle]
    divisor = divisor_of_minors(parts)
    found = invariant_zeros(parts)
    numerator: Any = flint.fmpz_poly([int(c) for c in divisor.numer().coeffs()])
    roots = numerator.complex_roots() if divisor.degree() > 0 else []
    simple = [complex(root) for root, times in roots if times == 1]
    if len(simple) == len(roots):
        assert not found.doubts
    assert found.values.size == divisor.degree() or found.doubts  # how rounding splits multiple ones, no kernel shares
    assume(simple and not found.doubts)
    for root in simple:
        assert np.abs(found.values - root).min() <= SCATTER * max(1.0, abs(root))


@pytest.mark.parametrize("shape", [(2, 1), (1, 2), (3, 3)])
def test_nothing_has_no_zeros(shape: tuple[int, int]) -> None:
    """A zero polynomial has rank zero everywhere, and so no place where it drops."""
    assert invariant_zeros([np.zeros(shape)] * 3).values.size == 0


def test_common_zeros_at_the_origin_are_exactly_zero() -> None:
    """``(s^2, s^2 (s + 1))`` vanishes twice at the origin."""
    parts = [np.zeros((1, 2)), np.zeros((1, 2)), np.array([[1.0, 1.0]])]
    found = invariant_zeros(parts)
    assert_allclose(found.values, [0.0, 0.0], rtol=0.0, atol=0.0)
