"""Eigenvalues with what rounding moves them, and balancing in any units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.base.spectrum import balanced, balanced_states, eigenvalues_and_rounding

ROUNDOFF = 1e-12  # of a well-conditioned eigenvalue


@given(powers=st.lists(st.integers(-300, 300), min_size=4, max_size=4))
def test_balancing_undoes_any_units_exactly(powers: list[int]) -> None:
    """States in units of 2^k, as far apart as 2^600: the same matrix comes back, without a warning."""
    A = np.array([[1.0, 2, 0, 1], [3, -1, 1, 0], [1, 1, 2, 1], [0, 2, 1, 4]])
    units = np.exp2(np.array(powers, dtype=float))
    matrix, factors = balanced_states(A * units / units[:, None])
    assert_array_equal(matrix, A / (units * factors)[:, None] * (units * factors))
    assert 0.01 < np.abs(matrix[matrix != 0.0]).min() <= np.abs(matrix).max() < 100.0


@pytest.mark.parametrize("size", [0, 1])
def test_small_matrices_are_balanced_as_they_are(size: int) -> None:
    """Nothing to scale."""
    A = np.full((size, size), 3.0)
    assert_array_equal(balanced(A), A)
    assert balanced_states(A)[1].tolist() == [1.0] * size


def test_bound_holds_for_a_double_eigenvalue() -> None:
    """A Jordan block of order two moves by the square root of rounding, and the bound says so."""
    values, bounds = eigenvalues_and_rounding(np.array([[-1.0, 1.0], [0.0, -1.0]]))
    assert_allclose(values, -1.0, rtol=0.0, atol=1e-7)
    assert (bounds > 1e-9).all()
    assert_allclose(eigenvalues_and_rounding(np.diag([1.0, -2.0]))[1], 0.0, rtol=0.0, atol=ROUNDOFF)


def test_vectors_that_are_orthogonal_but_for_a_denormal_number_give_a_bound_without_a_warning() -> None:
    """Two integrators of one fast signal: eigenvalues of which rounding leaves nothing."""
    values, bounds = eigenvalues_and_rounding(np.array([[0.0, 0.0, 0.0], [-2e17, 0.0, 0.0], [-2e9, 0.0, 0.0]]))
    assert not values.any()
    assert (bounds > 0.0).all()
