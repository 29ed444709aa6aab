"""The sparse factorization: solutions both ways, what it says of the condition, and every way of pivoting."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

from halfdof_ctrl.base.sparse_factors import PIVOTINGS
from halfdof_ctrl.base.sparse_products import times
from halfdof_ctrl.reduction.algebra import sparse_lu
from halfdof_ctrl.reduction.algebra.scaling import max_scaling
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU, is_nearly_symmetric
from support.fe_models import space_frame, spring_grid
from support.structures import arrow

SOLVED = 1e-13  # times the condition number: solutions of up to 30 equations
ESTIMATE = 10.0  # a 1-norm condition estimate is a lower bound, rarely off by more than 3


def random_matrix(seed: int, *, symmetric: bool) -> csc_array:
    """Draw a sparse matrix with a large diagonal, its rows and columns in random units."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 30))
    full = generator.standard_normal((n, n)) * (generator.random((n, n)) < 0.2)
    full = full + full.T if symmetric else full
    full += np.diag(np.abs(full).sum(axis=1) + 1.0)
    units = 2.0 ** generator.integers(-40, 40, (2, n))
    return csc_array(units[0][:, None] * full * units[1])


@given(seed=st.integers(0, 2**32 - 1), symmetric=st.booleans())
def test_solutions_equal_numpy(seed: int, symmetric: bool) -> None:  # noqa: FBT001
    """``W^-1`` and ``W^-T`` for the scaled equations, in the units of the unknowns."""
    W = random_matrix(seed, symmetric=symmetric)
    lu = SparseLU.factorized(W)
    full = W.toarray() * lu.rows[:, None] * lu.columns
    right = np.random.default_rng(seed).standard_normal((W.shape[0], 2))
    for found, desired in (
        (lu.solve(right) / lu.columns[:, None], np.linalg.solve(full, right)),
        (lu.solve_transposed(right / lu.columns[:, None]), np.linalg.solve(full.T, right)),
    ):
        assert_allclose(found, desired, rtol=0.0, atol=SOLVED * np.abs(desired).max() * np.linalg.cond(full))


@given(seed=st.integers(0, 2**32 - 1), symmetric=st.booleans())
def test_scaling_by_maxima_equals_the_dense_one(seed: int, symmetric: bool) -> None:  # noqa: FBT001
    """The same powers of two, pass by pass."""
    W = random_matrix(seed, symmetric=symmetric)
    for even in (2.0, 1024.0):
        for mine, other in zip(max_scaling(W, even), max_scaling(W.toarray(), even), strict=True):
            assert_array_equal(mine, other)


@given(seed=st.integers(0, 2**32 - 1))
def test_condition_is_estimated_from_below(seed: int) -> None:
    """Against the inverse of the scaled matrix, in the 1-norm."""
    lu = SparseLU.factorized(random_matrix(seed, symmetric=False))
    exact = 1.0 / np.linalg.cond(lu.scaled.toarray(), 1)
    assert exact * (1.0 - 1e-9) <= lu.rcond <= ESTIMATE * exact


@pytest.mark.parametrize("way", range(3))
def test_every_way_of_pivoting_gives_the_solution(way: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Minimum degree without and with a threshold, and columns with partial pivoting."""
    monkeypatch.setattr(sparse_lu, "PIVOTINGS", PIVOTINGS[way:])
    K = space_frame(3, 2, 3, 1).K
    lu = SparseLU.factorized(K)
    right = np.ones((K.shape[0], 1))
    assert_allclose(times(lu.scaled, lu.solve(right) / lu.columns[:, None]), right, rtol=1e-9)


def test_a_pivot_that_spoils_the_solution_is_not_taken() -> None:
    """A diagonal of 1e-20: elimination without pivoting gives nonsense, the next way the solution."""
    W = csc_array([[1e-20, 1.0, 0.0], [1.0, 1e-20, 1.0], [0.0, 1.0, 1.0]])
    assert is_nearly_symmetric(W)
    lu = SparseLU.factorized(W)
    assert_allclose(times(W, lu.solve(np.ones((3, 1)))) * lu.rows[:, None], np.ones((3, 1)), rtol=SOLVED)


def test_solutions_are_corrected_where_the_pivots_lose_digits() -> None:
    """With 1e-7 on the diagonal seven digits go in the elimination, and one correction brings them back."""
    W = csc_array([[1e-7, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 3.0]])
    lu = SparseLU.factorized(W)
    assert lu.corrected
    right = np.array([[1.0], [2.0], [3.0]])
    assert_allclose(lu.solve(right), np.linalg.solve(W.toarray(), right / lu.rows[:, None]), rtol=SOLVED)
    transposed = np.linalg.solve(W.toarray().T, right) / lu.rows[:, None]
    assert_allclose(lu.solve_transposed(right.copy()), transposed, rtol=SOLVED)


@pytest.mark.parametrize("size", [5, 40])
@pytest.mark.parametrize("factor", [1.0, np.pi])
def test_a_part_that_floats_is_singular_and_named(size: int, factor: float) -> None:
    """Two nets of springs, the second held nowhere: its null vector is that net, and nothing else."""
    held = spring_grid(size, size, 0).K
    loose = factor * (held - diags_array(held.sum(axis=1)))
    W = csc_array(block_diag([held, loose], format="csc"))
    lu = SparseLU.factorized(W)
    assert lu.is_singular
    null = np.abs(lu.null_vector())
    assert (null[: size**2] < 1e-6).all()
    assert (null[size**2 :] > 1e-3).all()


def test_an_empty_column_is_exactly_singular() -> None:
    """SuperLU finds no pivot, and the null vector is the column."""
    lu = SparseLU.factorized(csc_array(diags_array([1.0, 0.0, 3.0])))
    assert lu.rcond == 0.0
    assert lu.is_singular
    assert np.abs(lu.null_vector()).round(6).tolist() == [0.0, 1.0, 0.0]


@pytest.mark.parametrize("nodes", [100, 3000])
def test_a_long_frame_is_not_singular(nodes: int) -> None:
    """Its condition is bad by nature, 1e-8 and 1e-12, and far from rounding."""
    lu = SparseLU.factorized(space_frame(2, 1, nodes // 4, 0, parts=2).K)
    assert not lu.is_singular


def test_unsymmetric_patterns_are_ordered_by_columns() -> None:
    """Most entries of a bidiagonal matrix have no partner."""
    W = csc_array(np.eye(50) + 2.0 * np.eye(50, k=1))
    assert not is_nearly_symmetric(csc_array(W - eye_array(50) * 1.0))
    lu = SparseLU.factorized(W)
    assert_allclose(times(W, lu.solve(np.ones((50, 1)))) * lu.rows[:, None], np.ones((50, 1)), rtol=1e-9)


def test_even_maxima_do_not_hide_a_regular_matrix() -> None:
    """An arrow of ones over a diagonal of 2^-60: regular in other units, as for the dense leading matrix."""
    matrix = csc_array(arrow(2.0**-60))
    lu = SparseLU.factorized(matrix)
    assert not lu.is_singular
    assert lu.rcond > 0.05
    right = lu.rows[:, None] * (matrix @ np.array([[1.0], [2.0**60], [2.0**60]]))
    assert_allclose(lu.solve(right), [[1.0], [2.0**60], [2.0**60]], rtol=SOLVED)
