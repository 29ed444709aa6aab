"""Sizes of adjoint solutions at the ends of a list of points, against solves with the transpose."""

import numpy as np
import numpy.typing as npt
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl.systems.adjoint_sizes import FULL_STATES, beyond_reciprocity

COMPARED = 1e-9  # two ways to eliminate


def hessenberg(size: int, seed: int) -> npt.NDArray[np.float64]:
    """Draw an upper Hessenberg matrix that is far from singular."""
    full = np.random.default_rng(seed).standard_normal((size, size)) - 3.0 * np.sqrt(size) * np.eye(size)
    return np.asarray(np.triu(full, -1))


@pytest.mark.parametrize("size", [2, 7, FULL_STATES, FULL_STATES + 1, 90])
def test_ratio_is_that_of_solves_with_the_transpose(size: int) -> None:
    """``|y| |b| / (|x| |c|)`` of three outputs, the larger of two points, or 1."""
    H, outputs = hessenberg(size, size), np.random.default_rng(1).standard_normal((3, size))
    b, points = 3.0 * np.eye(size)[0], np.array([0.2j, 1j, 40j])
    x, y = (
        [np.linalg.solve(s * np.eye(size) - matrix, right) for s in points]
        for matrix, right in ((H, b), (H.T, outputs.T))
    )
    lengths, sizes = np.linalg.norm(outputs, axis=1), np.linalg.norm(x, axis=1)
    desired = [np.linalg.norm(y[k], axis=0) * 3.0 / (sizes[k] * lengths) for k in (0, -1)]
    found = beyond_reciprocity(H, 3.0, outputs, lengths, points, sizes)
    assert_allclose(found, np.maximum(np.max(desired, axis=0), 1.0), rtol=COMPARED)


@pytest.mark.parametrize("size", [2, FULL_STATES + 1])
def test_a_pole_says_nothing(size: int) -> None:
    """At an eigenvalue there is no solution, and what the other point says counts; nor of an output that is none."""
    H = np.diag(np.ones(size - 1), -1)
    found = beyond_reciprocity(
        H, 1.0, np.eye(size)[:2], np.array([1.0, 0.0]), np.array([0j, 2j]), np.array([np.inf, 0.5])
    )
    assert_allclose(found, [1.0, 1.0])
