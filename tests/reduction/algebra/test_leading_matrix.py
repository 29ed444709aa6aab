"""The leading matrix: factorized once, scaled where that matters, and judged the same in any units."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.reduction.algebra import leading_matrix
from halfdof_ctrl.reduction.algebra.leading_matrix import PLAINLY_REGULAR_IF_SMALL, LeadingMatrix
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.dense.single_solve import leading_columns
from support.anykinds import drawn_models, in_units
from support.structures import Structure, arrow

ROUNDOFF = 1e-11  # random 6 x 6 matrices
EPS = float(np.finfo(float).eps)
FACTOR = 10.0  # between condition numbers in different units: powers of two, the estimate, and the bases' rotation
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


@pytest.mark.parametrize("size", [4, 12])
def test_solution_is_the_same_in_the_place_of_the_right_hand_side(size: int) -> None:
    """`overwrite` changes no bit of it, and without it the right-hand side stays."""
    generator = np.random.default_rng(0)
    leading = LeadingMatrix.factorized(np.asfortranarray(generator.standard_normal((size, size)) + 9.0 * np.eye(size)))
    right = np.asfortranarray(generator.standard_normal((size, 5)))
    kept = right.copy(order="F")
    solved = leading.solve(right)
    assert_array_equal(right, kept)
    assert_array_equal(leading.solve(kept, overwrite=True), solved)


@given(seed=SEEDS, spread=st.sampled_from([0, 5, 40]))
def test_singular_values_are_those_of_the_matrix_that_was_factorized(seed: int, spread: int) -> None:
    """Of W, or of the scaled one."""
    W = badly_scaled(seed, spread)
    leading = LeadingMatrix.factorized(W)
    matrix = W if leading.scaled is None else leading.scaled
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


@pytest.mark.parametrize("power", [0, 40, 60])
def test_even_maxima_do_not_hide_a_regular_matrix(power: int) -> None:
    """An arrow of ones over a diagonal of 2^-60 is regular in other units: its determinant there is -3."""
    W = arrow(2.0**-power)
    assert_array_equal(np.abs(W).max(axis=0) <= 2.0, [True] * 3)
    leading = LeadingMatrix.factorized(W)
    assert not leading.is_singular
    assert leading.rcond > 0.05
    assert leading.singular_values().min() > 0.1
    units = np.exp2(0.5 * power * np.array([1.0, -1.0, -1.0]))
    solution = leading.solve((units * [2.0 + 2.0**-power, 2.0, 3.0])[:, None])
    assert_allclose(solution[:, 0], 1.0 / units, rtol=ROUNDOFF)


def test_model_with_even_maxima_keeps_its_method() -> None:
    """The arrow as mass: six states by selection, which refused it, with and without being asked for."""
    small = 2.0**-60
    model = mechss(arrow(small), None, np.diag([1.0 / small, small, small]))
    for method in ("selection", None):
        reduction = exact_reduction(model, method=method)
        assert (reduction.method, reduction.order) == ("selection", 6)
        assert reduction.evidence[-1].gap > 1e12


@given(seed=SEEDS, spread=st.sampled_from([8, 40]))
def test_scaling_reaches_the_least_condition_number(seed: int, spread: int) -> None:
    """Bauer's theorem: the least one over all scalings is the spectral radius of ``|W^-1| |W|``, in any units."""
    leading = LeadingMatrix.factorized(badly_scaled(seed, spread))
    plain = badly_scaled(seed, spread) if leading.scaled is None else leading.scaled
    least = np.abs(np.linalg.eigvals(np.abs(np.linalg.inv(plain)) @ np.abs(plain))).max()
    assert leading.rcond <= 3.0 / least  # the norm of the inverse is estimated, from below
    enough = leading.rcond >= PLAINLY_REGULAR_IF_SMALL
    assert enough or leading.rcond >= 0.25 / least


POWERS = st.lists(st.integers(-9, 9), min_size=12, max_size=12)


@pytest.mark.parametrize("partition", [select_columns, orthonormal_bases])
@given(case=drawn_models(), columns=POWERS, rows=POWERS, time=st.integers(-9, 9))
def test_condition_of_the_leading_matrix_is_the_same_in_any_units(
    partition: Callable[[SecondOrderModel], DofPartition],
    case: tuple[Structure, SecondOrderModel],
    columns: list[int],
    rows: list[int],
    time: int,
) -> None:
    """DOFs, equations and time in units of 8^k: singular or not, and rcond the same to a factor of ten below 1e-3."""
    structure, model = case
    n = structure.size
    scaled = in_units(model, 8.0 ** np.array(columns[:n]), 8.0 ** np.array(rows[:n]), 8.0**time)
    plain, other = [LeadingMatrix.factorized(leading_columns(one, partition(one))) for one in (model, scaled)]
    assert plain.is_singular == other.is_singular
    if not plain.is_singular:
        ratio = min(plain.rcond, PLAINLY_REGULAR_IF_SMALL) / min(other.rcond, PLAINLY_REGULAR_IF_SMALL)
        assert 1.0 / FACTOR <= ratio <= FACTOR


def test_a_large_matrix_that_is_surely_regular_is_factorized_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of static nodes, condition 1e5: no scaling changes it, and none is looked for."""
    tried: list[int] = []
    factorize = leading_matrix.lu_and_rcond

    def counted(W: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        tried.append(len(W))
        return factorize(W)

    monkeypatch.setattr(leading_matrix, "lu_and_rcond", counted)
    n = 600
    leading = LeadingMatrix.factorized(2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    assert tried == [n]
    assert not leading.is_plainly_regular
    assert_allclose(leading.solve(np.ones((n, 1)))[n // 2 - 1, 0], n / 2 * (n / 2 + 1) / 2, rtol=ROUNDOFF)
