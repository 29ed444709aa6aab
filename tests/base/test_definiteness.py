"""Claims about inertia: the signs of the eigenvalues of dense linear algebra, for any size of component."""

import numpy as np
import numpy.typing as npt
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import block_diag, csc_array, diags_array, eye_array, kron

from halfdof_ctrl.base.definiteness import DENSE_SIZE, Inertia, inertia


def counts(found: Inertia) -> tuple[int, int, int, int]:
    """Positive, negative, zero, unknown."""
    return found.positive, found.negative, found.zero, found.unknown


def chain(n: int, ground: float) -> csc_array:
    """Make a row of n masses with springs of 1 between them, the first one grounded by another spring."""
    diagonal = np.full(n, 2.0)
    diagonal[[0, -1]] = 1.0
    diagonal[0] += ground
    off = [-1.0] * (n - 1)
    return csc_array(diags_array([diagonal.tolist(), off, off], offsets=[0, 1, -1]))


@given(
    signs=st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=1, max_size=6),
    seed=st.integers(0, 10**6),
    decades=st.integers(-9, 9),
)
def test_congruence_keeps_the_signs(signs: list[float], seed: int, decades: int) -> None:
    """Sylvester: T^T D T has the signs of D, in any unit."""
    n = len(signs)
    transformation = np.eye(n) + 0.3 * np.random.default_rng(seed).uniform(-1, 1, (n, n)) / n
    matrix = transformation.T @ np.diag(signs) @ transformation * 10.0**decades
    expected = tuple(signs.count(sign) for sign in (1.0, -1.0, 0.0))
    assert counts(inertia(csc_array(matrix)))[:3] == expected


@pytest.mark.parametrize("n", [1, 2, 50, DENSE_SIZE, DENSE_SIZE + 1, 2000])
def test_a_chain_has_one_rigid_motion_until_it_is_held(n: int) -> None:
    """Free: semidefinite of rank n - 1. Held at one end: definite. Pushed there by a negative spring: indefinite."""
    assert counts(inertia(chain(n, 0.0) if n > 1 else csc_array((1, 1)))) == (n - 1, 0, 1, 0)
    assert counts(inertia(chain(n, 1.0) if n > 1 else csc_array([[1.0]]))) == (n, 0, 0, 0)
    if n > 1:
        assert counts(inertia(chain(n, -0.3))) == (n - 1, 1, 0, 0)


def test_a_grid_with_its_rigid_motion_is_semidefinite() -> None:
    """20 x 20 x 5 masses between springs."""
    parts = [chain(n, 0.0) for n in (20, 20, 5)]
    unit = [eye_array(n) for n in (20, 20, 5)]
    grid = (
        kron(kron(parts[0], unit[1]), unit[2])
        + kron(kron(unit[0], parts[1]), unit[2])
        + kron(kron(unit[0], unit[1]), parts[2])
    )
    assert counts(inertia(csc_array(grid))) == (1999, 0, 1, 0)


def test_many_small_blocks_are_counted_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lumped mass has a block for each node, of any size, in any order; batches do not matter."""
    monkeypatch.setattr("halfdof_ctrl.base.definiteness.BATCH", 20)
    rng = np.random.default_rng(5)
    blocks: list[npt.NDArray[np.float64]] = [np.ones((k, k)) for k in rng.integers(1, 5, 60)]
    blocks += [np.zeros((3, 3)), -np.ones((2, 2))]
    matrix = csc_array(block_diag([csc_array(block) for block in blocks], format="csc"))
    shuffled = rng.permutation(matrix.shape[0])
    found = inertia(csc_array(csc_array(matrix[shuffled])[:, shuffled]))
    assert counts(found) == (60, 1, matrix.shape[0] - 61, 0)
    assert found.rank == 61


def test_components_above_the_limit_stay_unknown() -> None:
    """And say so, rather than taking long."""
    found = inertia(csc_array(block_diag([chain(400, 1.0), eye_array(2)], format="csc")), largest=399)
    assert counts(found) == (2, 0, 0, 400)
    assert (found.rank, found.in_words) == (None, "not determined")


def test_pivots_that_would_need_an_exchange_are_not_believed() -> None:
    """A component with an empty diagonal has no triangular factors without exchanges, or they are checked."""
    n = DENSE_SIZE + 2
    matrix = np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)
    found = inertia(csc_array(matrix))
    values = scipy.linalg.eigvalsh(matrix)
    assert counts(found) in {((values > 0).sum(), (values < 0).sum(), 0, 0), (0, 0, 0, n)}


@pytest.mark.parametrize(
    ("diagonal", "words"),
    [
        ([1.0, 2.0], "positive definite"),
        ([1.0, 0.0], "positive semidefinite"),
        ([1.0, -2.0], "indefinite"),
        ([0.0, -2.0], "negative semidefinite"),
        ([-1.0, -2.0], "negative definite"),
        ([0.0, 0.0], "zero"),
    ],
)
def test_signs_have_words(diagonal: list[float], words: str) -> None:
    """As textbooks have them."""
    assert inertia(csc_array(np.diag(diagonal))).in_words == words


def test_only_the_symmetric_part_counts() -> None:
    """A gyroscopic part does no work."""
    assert counts(inertia(csc_array([[1.0, 5.0], [-5.0, 1.0]]))) == (2, 0, 0, 0)


def test_numbers_that_cannot_be_scaled_leave_the_signs_unknown() -> None:
    """A diagonal of 1e-300 beside entries of 1e300, as damaged bytes are; sums of 1e308 do not overflow."""
    found = inertia(csc_array(np.array([[1e-300, 1e300], [1e300, 1.0]])))
    assert (found.unknown, found.in_words) == (2, "not determined")
    assert inertia(csc_array(np.array([[1.5e308, 0.0], [0.0, 1.0]]))).positive == 2
