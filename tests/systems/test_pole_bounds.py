"""Eigenvalues with bounds, against rational roots."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import exact_reduction, mech2ss, mechss
from halfdof_ctrl.systems.origin import poles_of_model
from halfdof_ctrl.systems.pencil_poles import pencil_poles
from halfdof_ctrl.systems.pole_bounds import bounded_poles

DIGITS = 1e-13  # of a simple, well conditioned eigenvalue


@given(st.lists(st.floats(-12.0, 12.0), min_size=2, max_size=5, unique_by=round), st.integers(0, 99))
def test_triangles_over_many_decades_keep_every_eigenvalue(powers: list[float], seed: int) -> None:
    """A graded triangle: its diagonal comes back, each entry to its own digits."""
    generator = np.random.default_rng(seed)
    diagonal = -(10.0 ** np.array(powers))
    A = np.diag(diagonal) + np.triu(generator.uniform(-1.0, 1.0, (len(powers),) * 2), 1) * np.abs(diagonal)
    poles = bounded_poles(A)
    found = poles.values[np.argsort(np.abs(poles.values))]
    assert_allclose(found.real, np.sort(np.abs(diagonal)) * -1.0, rtol=1e-9)


def test_integrators_are_exact_zeros() -> None:
    """A triple integrator, whose eigenvalue an eigenvalue solver finds at 1e-5."""
    A = np.diag([1.0, 1.0], 1)
    turn = np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + np.eye(3))[0]
    assert bounded_poles(turn @ A @ turn.T).at_origin.all()


@pytest.mark.parametrize("stiffness", [0.0, 1e-6])
def test_nearly_free_is_not_free(stiffness: float) -> None:
    """A soft spring to the ground makes a mode of 7e-4 rad/s, and no zero."""
    K = np.array([[100.0 + stiffness, -100.0], [-100.0, 100.0]])
    model = mechss(np.eye(2), None, K)
    expected = 2 if stiffness == 0.0 else 0
    for poles in (pencil_poles(model), poles_of_model(model, mech2ss(model).A)):
        assert int(poles.at_origin.sum()) == expected


def test_poles_without_energy_coordinates_come_from_the_pencil() -> None:
    """A follower force makes K unsymmetric: both ways to the poles agree."""
    model = mechss(np.eye(2), 0.1 * np.eye(2), [[2.0, 1.0], [-1.0, 3.0]])
    one, other = (
        np.sort_complex(poles.values) for poles in (pencil_poles(model), bounded_poles(exact_reduction(model).A))
    )
    assert_allclose(one, other, rtol=DIGITS)
