"""Solutions that keep the zeros of A: chains whose far end answers 1e-100 of the near one, dense and singular ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl.systems.sparse_elimination import SPARSE_STATES, sparse_response

COMPARED = 1e-12  # two elimination orders on matrices of moderate condition


def ladder(size: int) -> np.ndarray:
    """Give a tridiagonal A, an RC ladder with unit elements."""
    return np.diag(np.full(size - 1, 1.0), 1) + np.diag(np.full(size - 1, 1.0), -1) - 2.0 * np.eye(size)


def test_far_end_of_a_ladder_has_its_digits() -> None:
    """From one end to the other ``(s I - A)^-1`` is one over the determinant, by its recursion."""
    size, points = 60, np.asarray(1j * np.geomspace(0.1, 1e3, 40), dtype=np.complex128)
    previous, determinant = np.ones_like(points), points + 2.0
    for _ in range(size - 1):
        previous, determinant = determinant, (points + 2.0) * determinant - previous
    values = sparse_response(ladder(size), np.eye(size)[0], np.eye(size)[-1], points)
    assert np.abs(values).min() < 1e-150
    assert_allclose(values, 1.0 / determinant, rtol=COMPARED)


def test_factors_that_fill_up_are_made_point_by_point() -> None:
    """A dense A gives what numpy's solve gives."""
    A = np.random.default_rng(0).standard_normal((50, 50))
    b, c, points = np.ones(50), np.arange(50.0), 1j * np.array([0.3, 2.0, 50.0])
    expected = [c @ np.linalg.solve(s * np.eye(50) - A, b) for s in points]
    assert_allclose(sparse_response(A, b, c, points), expected, rtol=COMPARED)


def test_pivots_that_do_not_suit_a_point_are_chosen_anew() -> None:
    """A 1e-20 on the diagonal at one point is no pivot there, though it is one at the others."""
    A = np.array([[-1e-20, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, -1.0]])
    points = np.array([0.0, 1e3, 1e4], dtype=complex)
    expected = [np.linalg.solve(s * np.eye(3) - A, np.ones(3))[0] for s in points]
    assert_allclose(sparse_response(A, np.ones(3), np.eye(3)[0], points), expected, rtol=COMPARED)


@pytest.mark.parametrize("size", [SPARSE_STATES - 1, SPARSE_STATES + 1])
def test_pivots_are_chosen_anew_among_many_states(size: int) -> None:
    """The same three states beside a ladder that they do not touch: sparse factors, of few states full ones."""
    A, b, points = ladder(size), np.zeros(size), np.array([0.0, 1e3, 1e4], dtype=complex)
    A[:4, :4], b[:3] = np.diag([0.0, 0.0, 0.0, -2.0]), 1.0
    A[:3, :3] = [[-1e-20, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, -1.0]]
    expected = [np.linalg.solve(s * np.eye(3) - A[:3, :3], np.ones(3))[0] for s in points]
    assert_allclose(sparse_response(A, b, np.eye(size)[0], points), expected, rtol=COMPARED)


def test_pole_is_infinite() -> None:
    """``inf + nan j`` where s I - A is exactly singular, also if that is the point in the middle."""
    values = sparse_response(np.diag([0.0, -1.0]), np.ones(2), np.ones(2), np.array([1j, 0.0, 2j]))
    assert np.isinf(values[1].real)
    assert_allclose(values[[0, 2]], [1 / 1j + 1 / (1 + 1j), 1 / 2j + 1 / (1 + 2j)], rtol=COMPARED)
