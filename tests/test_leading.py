"""The leading matrix: factorized once, equilibrated where that matters, and judged."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.leading import LeadingMatrix

ROUNDOFF = 1e-11  # random 6 x 6 matrices
EPS = float(np.finfo(float).eps)
SEEDS = st.integers(0, 2**32 - 1)


def badly_scaled(seed: int, spread: int) -> np.ndarray:
    """Draw a matrix with rows and columns in units far apart."""
    generator = np.random.default_rng(seed)
    rows, columns = 2.0 ** generator.integers(-spread, spread + 1, (2, 6))
    return np.asarray((generator.standard_normal((6, 6)) + 4 * np.eye(6)) * rows[:, None] * columns)


@given(seed=SEEDS, spread=st.sampled_from([0, 5, 40]))
def test_solution_is_that_of_numpy(seed: int, spread: int) -> None:
    """``W^-1 b`` in any units."""
    W = badly_scaled(seed, spread)
    right = np.random.default_rng(seed).standard_normal((6, 2))
    desired = np.linalg.solve(W, right)
    solved = LeadingMatrix.factorized(W).solve(np.asfortranarray(right))
    scale = np.abs(np.linalg.inv(W)).sum(axis=1, keepdims=True) * np.abs(right).max()
    assert_allclose(solved / scale, desired / scale, rtol=0.0, atol=ROUNDOFF)


@given(seed=SEEDS, spread=st.sampled_from([0, 5, 40]))
def test_singular_values_are_those_of_the_matrix_that_was_factorized(seed: int, spread: int) -> None:
    """Of W, or of the equilibrated one."""
    W = badly_scaled(seed, spread)
    leading = LeadingMatrix.factorized(W)
    matrix = W if leading.equilibrated is None else leading.equilibrated
    assert_allclose(leading.singular_values(), np.linalg.svd(matrix, compute_uv=False), rtol=0.0, atol=ROUNDOFF * 100)


@given(seed=SEEDS, spread=st.sampled_from([0, 5, 40]))
def test_elimination_size_is_at_least_the_matrix(seed: int, spread: int) -> None:
    """``|L| |U|``, brought back to the rows and units of W, bounds ``|L U| = |W|`` entry by entry."""
    W = badly_scaled(seed, spread)
    size = LeadingMatrix.factorized(W).elimination_size()
    assert (size >= np.abs(W) * (1 - 20 * EPS)).all()


def test_elimination_that_cancels_shows_in_its_size() -> None:
    """The last entry of ``[[1, 1], [1, 1 + e]]`` comes as ``1 + e = 1 * 1 + e``: sizes of order one."""
    assert_allclose(LeadingMatrix.factorized(np.array([[1.0, 1.0], [1.0, 1.5]])).elimination_size()[1, 1], 1.5)
    assert_allclose(LeadingMatrix.factorized(np.array([[1.0, 2.0], [1.0, 1.0]])).elimination_size()[1, 1], 3.0)


@pytest.mark.parametrize(
    ("W", "singular"),
    [([[1.0, 1.0], [1.0, 1.0]], True), ([[0.0]], True), ([[1e-300, 0.0], [0.0, 1e200]], False), ([[3.0]], False)],
)
def test_singular_matrix_is_told_from_badly_scaled_one(W: list[list[float]], singular: bool) -> None:  # noqa: FBT001
    """An exact zero pivot, or nothing but units."""
    leading = LeadingMatrix.factorized(np.array(W))
    assert leading.is_singular == singular
    if singular:
        assert_array_equal(leading.rcond, 0.0)
