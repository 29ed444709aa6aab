"""Deflation of pencils to their finite part: known canonical structures behind random transformations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.base.arrays import powers_of_two
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.descriptor.finite_part import finite_part, infinite_part

EIGENVALUES = 1e-9  # after transformations of condition up to 1e3 on at most 10 unknowns


def nilpotent(size: int) -> np.ndarray:
    """Give a Jordan block of zeros: index `size` at infinity."""
    return np.eye(size, k=1)


def hidden(A: np.ndarray, E: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Multiply a pencil from both sides by random well-conditioned integer matrices."""
    generator = np.random.default_rng(seed)
    left, right = (
        generator.integers(-1, 2, (size, size)) + 4.0 * np.eye(size)[generator.permutation(size)] for size in A.shape
    )
    return left @ A @ right, left @ E @ right


def together(*blocks: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Put pencils on a diagonal, non-square ones too."""
    rows = sum(block[0].shape[0] for block in blocks)
    columns = sum(block[0].shape[1] for block in blocks)
    A, E = np.zeros((rows, columns)), np.zeros((rows, columns))
    i = j = 0
    for a, e in blocks:
        A[i : i + a.shape[0], j : j + a.shape[1]] = a
        E[i : i + a.shape[0], j : j + a.shape[1]] = e
        i, j = i + a.shape[0], j + a.shape[1]
    return A, E


FINITE = (np.diag([-1.0, 2.0, -3.0]), np.eye(3))


@given(seed=st.integers(0, 2**32 - 1), sizes=st.lists(st.integers(1, 3), max_size=3))
def test_finite_eigenvalues_and_infinite_blocks_are_found(seed: int, sizes: list[int]) -> None:
    """Finite part -1, 2, -3 beside infinite Jordan blocks; step k takes one off each of size k or more."""
    A, E = hidden(*together(FINITE, *((np.eye(size), nilpotent(size)) for size in sizes)), seed)
    part = finite_part(A, E)
    assert part.is_regular
    infinite = infinite_part(A, E)
    assert infinite.blocks == tuple(sorted(sizes, reverse=True))
    assert infinite.steps == tuple(sum(size >= step for size in sizes) for step in range(1, max(sizes, default=0) + 1))
    assert_allclose(np.sort(part.eigenvalues.real), [-3.0, -1.0, 2.0], rtol=EIGENVALUES)
    assert_allclose(part.eigenvalues.imag, 0.0, rtol=0.0, atol=EIGENVALUES)


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(0, 2), columns=st.integers(0, 2))
def test_singular_pencils_are_known_and_keep_their_regular_part(seed: int, rows: int, columns: int) -> None:
    """Kronecker blocks L_2 and L_1^T, or both, beside a regular part: not regular, finite eigenvalues all the same."""
    wide = [(np.eye(2, 3), np.eye(2, 3, 1))] * columns
    tall = [(np.eye(2, 1), np.eye(2, 1, -1))] * rows
    A, E = hidden(*together(FINITE, *wide, *tall, (np.eye(2), nilpotent(2))), seed)
    part = finite_part(A, E)
    assert part.is_regular == (rows == columns == 0)
    assert part.is_certain
    assert_allclose(np.sort(part.eigenvalues.real), [-3.0, -1.0, 2.0], rtol=EIGENVALUES)


def test_zero_pencil_is_singular() -> None:
    """Nothing at all determines anything."""
    part = finite_part(np.zeros((2, 2)), np.zeros((2, 2)))
    assert not part.is_regular
    assert part.eigenvalues.size == 0


def test_empty_pencil_is_regular() -> None:
    """No unknowns, no eigenvalues."""
    part = finite_part(np.zeros((0, 0)), np.zeros((0, 0)))
    assert part.is_regular
    assert part.eigenvalues.size == 0


def test_algebraic_pencil_has_no_eigenvalues() -> None:
    """E = 0, A nonsingular: index one, nothing finite."""
    part = finite_part(np.array([[2.0, 1.0], [0.0, 1.0]]), np.zeros((2, 2)))
    assert (part.is_regular, part.eigenvalues.size) == (True, 0)
    assert infinite_part(np.array([[2.0, 1.0], [0.0, 1.0]]), np.zeros((2, 2))).blocks == (1, 1)


@given(seed=st.integers(0, 2**32 - 1), power=st.integers(0, 12))
def test_units_do_not_change_the_structure(seed: int, power: int) -> None:
    """Rows and columns multiplied by up to 10^+-12."""
    generator = np.random.default_rng(seed)
    A, E = hidden(*together(FINITE, (np.eye(2), nilpotent(2)), (np.eye(1), nilpotent(1))), 1)
    rows, columns = 10.0 ** generator.integers(-power, power + 1, (2, 6))
    A, E = rows[:, None] * A * columns, rows[:, None] * E * columns
    part = finite_part(A, E)
    assert infinite_part(A, E).blocks == (2, 1)
    assert_allclose(np.sort(part.eigenvalues.real), [-3.0, -1.0, 2.0], rtol=EIGENVALUES)


def test_complex_pencils_are_taken() -> None:
    """Structural damping makes A complex."""
    part = finite_part(np.diag([1j, 2.0, 1.0]), np.diag([1.0, 1.0, 0.0]))
    assert_allclose(np.sort_complex(part.eigenvalues), [1j, 2.0], rtol=EIGENVALUES)


def test_rank_gap_is_reported() -> None:
    """A singular value of 1e-16 beside 1 is called zero, and the gap says how clear that was."""
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    part = infinite_part(np.eye(3), turn @ np.diag([1.0, 2.0, 0.0]) @ turn.T)
    assert part.blocks == (1,)
    assert part.evidence.gap > 1e10


@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 200))
def test_scaling_powers_bring_maxima_near_one(seed: int, spread: int) -> None:
    """Rows and columns end between 1/8 and 8, by powers of two."""
    generator = np.random.default_rng(seed)
    matrix = generator.uniform(0.5, 2.0, (4, 5)) * 2.0 ** generator.integers(-spread, spread + 1, (4, 1))
    matrix *= 2.0 ** generator.integers(-spread, spread + 1, 5)
    rows, columns = scaling_powers(matrix)
    scaled = matrix * rows[:, None] * columns
    for maxima in (scaled.max(axis=0), scaled.max(axis=1)):
        assert (np.abs(np.log2(maxima)) <= 3.0).all()
    for factors in (rows, columns):
        assert_array_equal(np.frexp(factors)[0], np.full(factors.size, 0.5))


@pytest.mark.parametrize(("size", "power"), [(0.0, 1.0), (1.0, 0.5), (3.0, 0.25), (1e-300, 2.0**996)])
def test_powers_of_two_bring_sizes_below_one(size: float, power: float) -> None:
    """Between 1/2 and 1, and 1 for a zero."""
    assert_array_equal(powers_of_two(np.array([size])), [power])
