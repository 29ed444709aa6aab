"""Residuals of triangular factors against rational arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.gram_residual import gram_residual

TWICE = 2.0**-90  #: of the columns of the factor: twice the working precision but for a few bits, of n terms


def exact_residual(K: FloatArray, U: FloatArray) -> FloatArray:
    """Give the upper triangle of K - U^T U, rounded once."""
    n = len(K)
    left = np.zeros((n, n))
    for i in range(n):
        for j in range(i, n):
            terms = [Fraction(U[k, i]) * Fraction(U[k, j]) for k in np.flatnonzero(U[:, i] * U[:, j])]
            left[i, j] = float(Fraction(K[i, j]) - sum(terms))
    return left


@pytest.mark.parametrize("bands", [2, 8])
@settings(max_examples=max(6, settings().max_examples // 10))  # in rational arithmetic
@given(seed=st.integers(0, 10**6), spread=st.integers(0, 20))
def test_residual_has_twice_the_precision(bands: int, seed: int, spread: int) -> None:
    """Of banded and full factors, in units over many decades: 90 bits of the columns."""
    generator = np.random.default_rng(seed)
    n = 60 if bands == 2 else bands  # of which the first is multiplied as a sparse matrix
    U = np.triu(generator.standard_normal((n, n))) * (np.arange(n) - np.arange(n)[:, None] < bands)
    U[np.diag_indices(n)] = generator.uniform(0.5, 2.0, n)
    U *= 2.0 ** generator.integers(-spread, spread + 1, n)
    K = U.T @ U
    size = np.linalg.norm(U, axis=0)
    left = np.triu(gram_residual(K, U))
    assert_allclose(left / np.outer(size, size), exact_residual(K, U) / np.outer(size, size), rtol=1e-15, atol=TWICE)


def test_entries_of_k_that_cancel_with_the_pattern_of_the_factor_are_not_lost() -> None:
    """A chain with springs of one size, large enough to be multiplied as a sparse factor: |U|^T |U| + K has zeros."""
    n = 64
    U = np.eye(n) - np.eye(n, k=1)
    K = U.T @ U
    K[0, 1] = K[1, 0] = -1.0 - 2.0**-52
    left = np.triu(gram_residual(K, U))
    assert left[0, 1] == -(2.0**-52)
    assert np.count_nonzero(left) == 1
