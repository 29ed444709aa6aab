"""Scaling: powers of two that bring maxima near one, and logarithmic means that are the same in any units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csc_array

from halfdof_ctrl.reduction.algebra import scaling
from halfdof_ctrl.reduction.algebra.scaling import (
    EVEN,
    level_scaling,
    log_scaling,
    log_scaling_with_time,
    max_scaling,
    time_log,
    unit_free_scaling,
)

ITERATED = 1e-6  # in logarithms to the base of two, after conjugate gradients
SHAPES = st.tuples(st.integers(1, 8), st.integers(1, 8))


@given(shape=SHAPES, seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 150))
def test_maxima_of_rows_and_columns_become_even(shape: tuple[int, int], seed: int, spread: int) -> None:
    """Whatever the units of rows and columns, all maxima end between 1/1024 and 1024."""
    generator = np.random.default_rng(seed)
    down, across = (2.0 ** generator.integers(-spread, spread + 1, size) for size in shape)
    matrix = generator.standard_normal(shape) * (generator.random(shape) < 0.7) * down[:, None] * across
    rows, columns = max_scaling(matrix)
    scaled = np.abs(matrix * rows[:, None] * columns)
    for maxima in (scaled.max(axis=0), scaled.max(axis=1)):
        present = maxima[maxima > 0.0]
        assert ((present >= 1.0 / EVEN) & (present <= EVEN)).all()


@given(seed=st.integers(0, 2**32 - 1), power=st.integers(-300, 300))
def test_factors_are_powers_of_two(seed: int, power: int) -> None:
    """So that scaling and unscaling round nothing."""
    matrix = np.random.default_rng(seed).standard_normal((5, 4)) * 10.0**power
    for factors in max_scaling(matrix):
        assert_array_equal(np.frexp(factors)[0], np.full(factors.size, 0.5))


@pytest.mark.parametrize(
    "matrix", [np.zeros((3, 3)), np.zeros((0, 0)), np.zeros((2, 0)), np.eye(4), np.array([[700.0]])]
)
def test_even_or_empty_matrices_are_left_alone(matrix: np.ndarray) -> None:
    """Zero rows and columns, and maxima that are even already, keep the factor one."""
    rows, columns = max_scaling(matrix)
    assert_array_equal(rows, np.ones(matrix.shape[0]))
    assert_array_equal(columns, np.ones(matrix.shape[1]))


def test_matrix_is_not_changed() -> None:
    """The factors are given, the matrix stays."""
    matrix = np.array([[1e9, 0.0], [0.0, 1e-9]])
    max_scaling(matrix)
    assert_array_equal(matrix, [[1e9, 0.0], [0.0, 1e-9]])


def badly_scaled(seed: int, shape: tuple[int, int], share: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    """Draw a matrix with gaps, zero rows perhaps, and the same in units far apart."""
    generator = np.random.default_rng(seed)
    matrix = generator.standard_normal(shape) * (generator.random(shape) < share)
    down, across = (10.0 ** generator.integers(-9, 10, size) for size in shape)
    return matrix, matrix * down[:, None] * across


@given(shape=SHAPES, seed=st.integers(0, 2**32 - 1))
def test_logarithmic_factors_are_a_least_squares_solution(shape: tuple[int, int], seed: int) -> None:
    """The logarithms of the scaled entries add up to zero in every row and column: the normal equations."""
    _, matrix = badly_scaled(seed, shape)
    scaled = log_scaling(matrix).of(matrix)
    logs = np.log2(np.abs(scaled), out=np.zeros_like(scaled), where=scaled != 0.0)
    assert_allclose(logs.sum(axis=0), 0.0, atol=ITERATED)
    assert_allclose(logs.sum(axis=1), 0.0, atol=ITERATED)


@given(shape=SHAPES, seed=st.integers(0, 2**32 - 1))
def test_scaled_matrix_is_the_same_in_any_units(shape: tuple[int, int], seed: int) -> None:
    """Least squares have one residual; what follows it starts there."""
    both = [unit_free_scaling(matrix).of(matrix) for matrix in badly_scaled(seed, shape)]
    assert_allclose(both[1], both[0], rtol=ITERATED)
    assert np.abs(both[0]).max(initial=0.0) <= 1.0 + ITERATED


@pytest.mark.parametrize("size", [3, 12, 60])
@pytest.mark.parametrize("share", [0.1, 0.6])
def test_sparse_and_direct_solutions_agree(size: int, share: float) -> None:
    """Conjugate gradients on a dense pattern, on a sparse one, and a direct solution: the same scaled entries."""
    _, matrix = badly_scaled(size, (size, size), share)
    sums = [
        (rows[:, None] + columns)[matrix != 0.0]
        for rows, columns in (
            np.log2(log_scaling(matrix)),
            np.log2(log_scaling(csc_array(matrix))),
            log_scaling_with_time(matrix[None])[:2],
        )
    ]
    assert_allclose(sums[1], sums[0], atol=ITERATED)
    assert_allclose(sums[2], sums[0], atol=ITERATED)
    for mine, dense in zip(level_scaling(csc_array(matrix)), level_scaling(matrix), strict=True):
        assert_allclose(mine, dense, rtol=ITERATED)


@given(size=st.integers(1, 8), seed=st.integers(0, 2**32 - 1))
def test_time_is_that_of_the_direct_solution(size: int, seed: int) -> None:
    """The mean time scale of full K, C and M; zero where rows and columns can take it up."""
    coefficients = np.stack([badly_scaled(seed + k, (size, size), 1.0)[1] for k in range(3)])
    assert_allclose(time_log(list(coefficients)), log_scaling_with_time(coefficients)[2], atol=ITERATED)
    assert time_log([np.eye(size), np.zeros((size, size)), np.zeros((size, size))]) == 0.0


def test_many_rows_are_scaled_as_few_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time first and then rows and columns, by iteration: the same scaled coefficients as by all unknowns at once."""
    generator = np.random.default_rng(0)
    chain = 2.0 * np.eye(12) - np.eye(12, k=1) - np.eye(12, k=-1)
    units = 10.0 ** generator.uniform(-3.0, 3.0, (2, 12))
    P = np.stack([1e4 * chain, 0.1 * chain, np.diag(generator.uniform(1.0, 9.0, 12))]) * units[0][:, None] * units[1]
    few = log_scaling_with_time(P)
    monkeypatch.setattr(scaling, "SOLVED_AT_ONCE", 1)
    many = log_scaling_with_time(P)
    assert_allclose(many[2], few[2], atol=ITERATED)
    assert_allclose(many[0][:, None] + many[1], few[0][:, None] + few[1], atol=ITERATED)
