"""Eigenvalues with bounds, against rational roots."""

import numpy as np
import numpy.typing as npt
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import linear_sum_assignment

from halfdof_ctrl import exact_reduction, frequency_response, mech2ss, mechss
from halfdof_ctrl.systems.origin import poles_of_model
from halfdof_ctrl.systems.pencil_poles import pencil_poles
from halfdof_ctrl.systems.pole_bounds import BoundedPoles, bounded_poles

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


def unimodular(n: int, seed: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Draw a matrix of small integers and its inverse, which are integers too."""
    generator = np.random.default_rng(seed)
    lower = np.eye(n) + np.tril(generator.integers(-1, 2, (n, n)).astype(float), -1)
    upper = np.eye(n) + np.triu(generator.integers(-1, 2, (n, n)).astype(float), 1)
    inverse = np.linalg.inv(upper).round() @ np.linalg.inv(lower).round()
    turn = np.asarray(lower @ upper)
    assert (turn @ inverse == np.eye(n)).all()
    return turn, inverse


def worst(found: BoundedPoles, exact: npt.ArrayLike) -> float:
    """Return the largest error of an eigenvalue over its bound, in the best pairing."""
    error = np.abs(found.values[:, None] - np.asarray(exact))
    places, partners = linear_sum_assignment(error)
    return float((error[places, partners] / found.bounds[places]).max())


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_equal_critically_damped_oscillators_are_within_their_bounds(count: int, seed: int) -> None:
    """``(s + 1)^2`` as often as there are oscillators, in coordinates of integers that mix these, or mix all states.

    The matrices are exact, and the errors of the double poles the root of rounding, however many are equal.
    """
    zero, unit = np.zeros((count, count)), np.eye(count)
    plain = np.block([[zero, unit], [-unit, -2.0 * unit]])
    turn, inverse = unimodular(count, seed)
    both, back = np.kron(np.eye(2), turn), np.kron(np.eye(2), inverse)
    whole, whole_back = unimodular(2 * count, seed)
    for A in (plain, both @ plain @ back, whole @ plain @ whole_back):
        poles = bounded_poles(np.asarray(A))
        assert worst(poles, -np.ones(2 * count)) <= 1.0
        assert poles.bounds.max() < 1e-3
        assert not poles.at_origin.any()


@pytest.mark.parametrize(("length", "copies"), [(2, 2), (3, 1), (3, 2), (4, 1), (4, 2)])
@pytest.mark.parametrize("seed", range(4))
def test_chains_of_eigenvalues_are_within_their_bounds(length: int, copies: int, seed: int) -> None:
    """Jordan blocks of -1 beside poles of -3, -64 and -2 +- 5j, in coordinates of integers: all is exact."""
    chain = np.diag(np.ones(length - 1), 1) - np.eye(length)
    others = scipy.linalg.block_diag(np.diag([-3.0, -64.0]), np.array([[-2.0, 5.0], [-5.0, -2.0]]))
    J = scipy.linalg.block_diag(*[chain] * copies, others)
    turn, inverse = unimodular(len(J), seed)
    poles = bounded_poles(turn @ J @ inverse)
    assert worst(poles, [*[-1.0] * (length * copies), -3.0, -64.0, -2.0 + 5.0j, -2.0 - 5.0j]) <= 1.0
    assert poles.bounds.max() < 0.1


def test_equal_undamped_oscillators_keep_their_digits() -> None:
    """Three equal pairs that are no chain: rounding moves them by itself, not by a root."""
    turn, inverse = unimodular(6, 1)
    poles = bounded_poles(turn @ np.kron(np.eye(3), [[0.0, 1.0], [-1.0, 0.0]]) @ inverse)
    assert worst(poles, [1j, 1j, 1j, -1j, -1j, -1j]) <= 1.0
    assert poles.bounds.max() < 1e-10


def test_poles_that_a_state_matrix_loses_beside_a_fast_one_come_from_the_pencil() -> None:
    """A damper of 1e-12 N s/m at a massless node makes a pole of 4e17 rad/s; a mode of 61 rad/s is below its rounding.

    In exact arithmetic the masses swing at 8.679 and at 60.996 rad/s.
    """
    k, s, g = 55.91377692982338, 656227.6245830412, 2.4745626933873e-3
    model = mechss(
        np.diag([0.03404259257474761, 0.0, 0.4018830082009365]),
        [[2.240882217262969e-06, -1.5e-12, 0.0], [-1.5e-12, 1.5e-12, 0.0], [0.0, 0.0, 0.0]],
        [[124.48713971650548, -k, 0.0], [-k, s + k, -s], [0.0, -s, s + g]],
    )
    poles = pencil_poles(model)
    assert_allclose(np.sort(np.abs(poles.values))[:4], [8.679, 8.679, 60.996, 60.996], rtol=1e-3)
    assert poles.bounds[np.abs(poles.values) < 100.0].max() < 1e-6
    omega = np.asarray(frequency_response(model.select("F_q1", "q0")).omega)
    mode = np.sort(np.abs(poles.values))[3]
    assert np.abs(omega / mode - 1.0).min() < 1e-6


def test_large_clusters_near_zero_have_a_bound() -> None:
    """Forty poles at 0, two of them a chain of 1e-12: powers of the bound go below all numbers."""
    A = np.zeros((40, 40))
    A[0, 1] = 1e-12
    poles = bounded_poles(A)
    assert_allclose(poles.values, 0.0, atol=0.0)
    assert (poles.bounds < 1e-12).all()
