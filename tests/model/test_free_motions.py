"""Motions that the stiffness leaves free are counted, and bodies on soft springs are not among them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import mechss
from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.model.free_motions import _improved, free_motion_count
from support.beams import beam_matrices


def body(seed: int, points: int) -> FloatArray:
    """Give the stiffness of points in a plane, each joined to each by a spring of random size."""
    generator = np.random.default_rng(seed)
    places = 3.0 * generator.standard_normal((points, 2))
    K = np.zeros((2 * points, 2 * points))
    for i in range(points):
        for j in range(i):
            along = (places[i] - places[j]) / np.linalg.norm(places[i] - places[j])
            across = np.zeros(2 * points)
            across[2 * i : 2 * i + 2], across[2 * j : 2 * j + 2] = along, -along
            K += 10.0 ** generator.uniform(2.0, 5.0) * np.outer(across, across)
    return (K + K.T) / 2.0


@given(st.integers(0, 2**32 - 1), st.integers(3, 8), st.integers(9, 14))
def test_a_body_in_a_plane_has_three_free_motions_and_none_on_soft_ground(seed: int, points: int, power: int) -> None:
    """Two translations and a rotation, whose entries are rounded; a spring 1e-9 to 1e-14 as stiff ends it."""
    K = body(seed, points)
    M, C = np.eye(len(K)), 1e-3 * K
    found = free_motion_count(M, C, K)
    assert found is not None
    assert (found.motions, found.poles) == (3, 6)
    assert free_motion_count(M, C, K + 10.0**-power * np.abs(K).max() * np.eye(len(K))) is None


@pytest.mark.parametrize("elements", [2, 10, 40, 80, 200])
def test_beams_float_by_two_motions_or_by_none(elements: int) -> None:
    """Free ones by translation and rotation, one pole each where dampers stand on the ground; clamped ones not."""
    M, K = beam_matrices(elements, clamped=False)
    for C, poles in ((0.0 * K, 4), (1e-3 * K, 4), (0.1 * M, 2)):
        found = free_motion_count(M, C, K)
        assert found is not None
        assert (found.motions, found.poles) == (2, poles)
    M, K = beam_matrices(elements)
    assert free_motion_count(M, 0.1 * M, K) is None


def test_a_beam_from_a_file_with_ten_digits_floats_to_its_rounding() -> None:
    """Entries of ten digits give the rotation an energy of 1e-10: known to more, it were a spring."""
    M, K = beam_matrices(7, clamped=False)
    rounded = np.vectorize(lambda value: float(f"{value / 3.0:.9e}"))(K)
    exact = free_motion_count(M, 0.0 * K, rounded)
    assert exact is not None
    assert exact.motions == 1
    found = free_motion_count(M, 0.0 * K, rounded, 5e-10)
    assert found is not None
    assert found.in_words().startswith("2 free motions (to the rounding of the entries, 5e-10): 4 poles at exactly 0")


def test_repr_says_what_floats() -> None:
    """Two bodies joined by springs, with a node without mass between them."""
    model = mechss(np.diag([2.0, 0.0, 1.0]), None, [[100, -100, 0], [-100, 300, -200], [0, -200, 200]])
    assert "1 free motion: 2 poles at exactly 0, so that the response at rest is infinite" in repr(model)
    assert "free" not in repr(mechss([[1.0]], None, [[1e-12]]))


def test_what_moves_without_mass_and_damping_is_not_counted() -> None:
    """A DOF with nothing at all makes the pencil singular: it has no poles."""
    assert free_motion_count(np.diag([1.0, 0.0]), np.zeros((2, 2)), np.diag([1.0, 0.0])) is None


@pytest.mark.parametrize(
    "K",
    [np.array([[1.0, 2.0], [0.0, 1.0]]), -np.eye(2), np.array([[1j, 0], [0, 0]]), np.array([[1.0, 2.0], [2.0, 1.0]])],
)
def test_nothing_is_said_of_what_is_not_semidefinite(K: FloatArray) -> None:
    """Unsymmetric, negative, complex and indefinite stiffness."""
    assert free_motion_count(np.eye(2), np.zeros((2, 2)), K) is None


def test_another_motion_that_rounding_has_moved_to_zero_is_no_division_by_zero() -> None:
    """Two eigenvalues of exactly 0, of which one vector counts as free: it stays what it is."""
    motion = _improved(np.diag([0.0, 0.0, 3.0]), np.array([0.0, 0.0, 3.0]), np.eye(3), np.array([0]))
    assert motion.tolist() == [[1.0], [0.0], [0.0]]
