"""Refined transfer functions of the cross-check against exact arithmetic, and (DATA) against what rounding does."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import hydromount, mechss
from halfdof_ctrl.descriptor.refined_response import refined_response
from support.anykinds import Kind, holonomic, in_units, mixed, signals
from support.rational import rational_transfer
from support.structures import passive

EXACT = 4 * np.finfo(float).eps  # one solve whose solution is right to the last digit, and one product


def test_it_is_the_transfer_function_of_the_model() -> None:
    """``F(s) P(s)^-1 B(s) + D(s)`` of the mount, against the model's own evaluation."""
    model = hydromount().select(outputs=["y", "y_dot", "y2_ddot"])
    points = np.array([0.3j, 17.7j, 1.0 + 200.0j])
    found = refined_response(*model.quadratics, points)
    assert_allclose(found.values, model(points, squeeze=False), rtol=1e-13)


def test_a_soft_spring_behind_a_stiff_one_keeps_its_digits() -> None:
    """``(a + b) (b + c) - b^2`` cancels where b = 2^50 joins a and c: the sum of the terms is exact all the same."""
    a, b, c = 3.0, 2.0**50, 5.0
    K = np.array([[a + b, -b], [-b, b + c]])
    found = refined_response([K], [np.eye(2)], [np.eye(2)], [np.zeros((2, 2))], np.array([0j]))
    determinant = Fraction(a + b) * Fraction(b + c) - Fraction(b) ** 2
    right = np.array([[float(Fraction(entry) / determinant) for entry in row] for row in ((b + c, b), (b, a + b))])
    assert_allclose(found.values[:, :, 0].real, right, rtol=EXACT)


def test_data_bounds_what_rounding_of_an_entry_changes() -> None:
    """Every entry of K and M times 1 + 2^-40, one at a time: the changes add up to 2^-40 / eps times (DATA)."""
    model = mechss(np.diag([1.0, 2.0]), [[0.1, 0.0], [0.0, 0.2]], [[7.0, -3.0], [-3.0, 5.0]])
    points = np.array([1.9j])
    base = refined_response(*model.quadratics, points)
    total = np.zeros((2, 2))
    share = 2.0**-20
    for power in range(3):
        for place in np.argwhere(model.quadratics.P[power] != 0.0).tolist():
            P = [np.array(part) for part in model.quadratics.P]
            P[power][tuple(place)] *= 1.0 + share
            moved = refined_response(P, *model.quadratics[1:], points).values - base.values
            total += np.abs(moved[:, :, 0])
    beside = np.finfo(float).eps * 2.0 * np.abs(base.values[:, :, 0])  # B and F are entries too
    assert_allclose(total / share, (base.data[:, :, 0] - beside) / np.finfo(float).eps, rtol=1e-4)


def test_slope_is_the_derivative() -> None:
    """``s dH/ds`` of 1 / (s^2 + 2 s + 5) at s = 1j, by hand ``-2 (s + 1) s / (s^2 + 2 s + 5)^2``."""
    model = mechss([[1]], [[2]], [[5]])
    found = refined_response(*model.quadratics, np.array([1j]))
    assert found.slope[0, 0, 0] == pytest.approx(abs(2 * (1 + 1j) * 1j / (4 + 2j) ** 2), rel=1e-12)


def test_a_point_at_which_the_matrix_is_singular_has_no_value() -> None:
    """NaN, and the other points keep theirs."""
    model = mechss([[1]], None, [[4]])
    found = refined_response(*model.quadratics, np.array([2j, 1j]))
    assert np.isnan(found.values[0, 0, 0])
    assert found.values[0, 0, 1].real == pytest.approx(1 / 3)


def test_no_unknowns_leave_the_direct_term() -> None:
    """A state space without states."""
    none = np.zeros((0, 0))
    found = refined_response(
        [none, none], [np.zeros((0, 1))], [np.zeros((1, 0))], [np.array([[3.0]])], np.array([1j]), exact_powers=(1,)
    )
    assert found.values.tolist() == [[[3.0]]]


def accelerance(s: complex) -> complex:
    """``s^2 / (s^2 + s / 2 + 4)``, each term exact where s is a power of two times j."""
    return s**2 / (s**2 + 0.5 * s + 4.0)


@pytest.mark.parametrize("power", [-10, -25, -40])
def test_an_acceleration_far_below_the_mode_keeps_its_digits(power: int) -> None:
    """``y = -4 x_1 - x_2 / 2 + u``, whose terms cancel to 4^power: no error of the sum is one of A, B, C, D."""
    A, B = np.array([[0.0, 1.0], [-4.0, -0.5]]), np.array([[0.0], [1.0]])
    s = 2.0**power * 1j
    found = refined_response([-A, np.eye(2)], [B], [A[1:]], [np.eye(1)], np.array([s]), exact_powers=(1,))
    assert_allclose(found.values[0, 0, 0], accelerance(s), rtol=EXACT)


@pytest.mark.parametrize("power", [-10, -25, -40])
def test_a_stretch_under_prescribed_motion_keeps_its_digits(power: int) -> None:
    """``q - u`` of a mass on a moving foot is ``-s^2 / (s^2 + s / 2 + 4)``; q is u but for that."""
    model = mechss([[1]], [[0.5]], [[4]], [[4]], [[1]], D=[[-1]], Bv=[[0.5]])
    s = 2.0**power * 1j
    found = refined_response(*model.quadratics, np.array([s]))
    assert_allclose(found.values[0, 0, 0], -accelerance(s), rtol=EXACT)


@pytest.mark.parametrize("kind", [passive, holonomic, mixed])
@pytest.mark.parametrize("seed", range(4))
def test_values_are_right_to_the_last_digit_in_any_units(kind: Kind, seed: int) -> None:
    """Units of DOFs, equations and time from 8^-9 to 8^9, against exact arithmetic, relative to what inputs do."""
    generator = np.random.default_rng([seed, 7])
    plain = signals(generator, kind(generator, 8))
    columns, rows = 8.0 ** generator.integers(-9, 10, (2, len(plain.dofs)))
    tau = 8.0 ** int(generator.integers(-9, 10))
    model = in_units(plain, columns, rows, tau)
    exact = rational_transfer(model)
    if exact.order < 0:
        pytest.skip("a singular pencil")
    points = np.asarray(np.array([0.01j, 0.7j, 1.0 + 3.0j, 40j]) / tau, dtype=np.complex128)
    found, right = refined_response(*model.quadratics, points).values, exact.at(points)
    assert_allclose(np.abs(found - right), 0.0, atol=EXACT * np.abs(right).max())
