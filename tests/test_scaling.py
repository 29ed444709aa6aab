"""Equilibration: powers of two that bring row and column maxima near one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.scaling import EVEN, equilibrating_factors

SHAPES = st.tuples(st.integers(1, 8), st.integers(1, 8))


@given(shape=SHAPES, seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 150))
def test_maxima_of_rows_and_columns_become_even(shape: tuple[int, int], seed: int, spread: int) -> None:
    """Whatever the units of rows and columns, all maxima end between 1/1024 and 1024."""
    generator = np.random.default_rng(seed)
    down, across = (2.0 ** generator.integers(-spread, spread + 1, size) for size in shape)
    matrix = generator.standard_normal(shape) * (generator.random(shape) < 0.7) * down[:, None] * across
    rows, columns = equilibrating_factors(matrix)
    scaled = np.abs(matrix * rows[:, None] * columns)
    for maxima in (scaled.max(axis=0), scaled.max(axis=1)):
        present = maxima[maxima > 0.0]
        assert ((present >= 1.0 / EVEN) & (present <= EVEN)).all()


@given(seed=st.integers(0, 2**32 - 1), power=st.integers(-300, 300))
def test_factors_are_powers_of_two(seed: int, power: int) -> None:
    """So that scaling and unscaling round nothing."""
    matrix = np.random.default_rng(seed).standard_normal((5, 4)) * 10.0**power
    for factors in equilibrating_factors(matrix):
        assert_array_equal(np.frexp(factors)[0], np.full(factors.size, 0.5))


@pytest.mark.parametrize(
    "matrix", [np.zeros((3, 3)), np.zeros((0, 0)), np.zeros((2, 0)), np.eye(4), np.array([[700.0]])]
)
def test_even_or_empty_matrices_are_left_alone(matrix: np.ndarray) -> None:
    """Zero rows and columns, and maxima that are even already, keep the factor one."""
    rows, columns = equilibrating_factors(matrix)
    assert_array_equal(rows, np.ones(matrix.shape[0]))
    assert_array_equal(columns, np.ones(matrix.shape[1]))


def test_matrix_is_not_changed() -> None:
    """The factors are given, the matrix stays."""
    matrix = np.array([[1e9, 0.0], [0.0, 1e-9]])
    equilibrating_factors(matrix)
    assert_array_equal(matrix, [[1e9, 0.0], [0.0, 1e-9]])
