"""Finite eigenvalues with their bounds, against exact arithmetic and closed forms."""

from typing import Any

import flint
import numpy as np
import pytest
import scipy.optimize
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel
from halfdof_ctrl.descriptor.exact_counts import exact_counts
from halfdof_ctrl.descriptor.finite_spectrum import FiniteSpectrum, finite_spectrum
from support import exact
from support.anykinds import drawn_models
from support.structures import Structure

BOUNDS = 3.0  # errors stay within so many bounds: a tenth of one in the middle
LAST_DIGIT = 1e-15  # relative: below, an error is none
MULTIPLE = 1e-7  # relative: the mean of a multiple eigenvalue
BEAM = 3.516015268783892 / 100.0 * np.sqrt(2.1e11 * 0.05**2 / 12.0 / 7850.0)  # first of a clamped beam of 10 m [rad/s]


def found(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> FiniteSpectrum:
    """Find the eigenvalues of floats."""
    coefficients = [np.asarray(matrix, dtype=float) for matrix in (K, C, M)]
    return finite_spectrum(coefficients, exact_counts(coefficients))


@given(case=drawn_models())
def test_eigenvalues_are_within_their_bounds(case: tuple[Structure, SecondOrderModel]) -> None:
    """Any regular pencil of small integers: all of them, nothing in doubt, each where exact arithmetic has it."""
    matrices = case[0].matrices
    determinant = exact.determinant(*matrices)
    assume(determinant.degree() >= 0)
    spectrum = found(*matrices)
    assert spectrum.values.size == spectrum.most == determinant.degree()
    assert not spectrum.doubts
    numerator: Any = flint.fmpz_poly([int(c) for c in determinant.numer().coeffs()])
    roots = numerator.complex_roots() if determinant.degree() else []
    values = np.array([complex(root) for root, times in roots for _ in range(times)], dtype=np.complex128)
    times = np.array([times for _, times in roots for _ in range(times)])
    rows, columns = scipy.optimize.linear_sum_assignment(np.abs(values[:, None] - spectrum.values))
    error = np.abs(values[rows] - spectrum.values[columns])
    allowed = np.where(times[rows] == 1, BOUNDS * spectrum.bounds[columns], MULTIPLE * np.abs(values[rows]))
    assert (error <= allowed + LAST_DIGIT * np.abs(values[rows])).all()


@pytest.mark.parametrize("n", [5, 12, 30])
def test_multiple_eigenvalue_has_its_number_and_its_mean(n: int) -> None:
    """``(s + 2)^n`` in one Jordan block, which QZ spreads over a ring."""
    spectrum = found(np.zeros((n, n)), np.eye(n), 2.0 * np.eye(n) - np.eye(n, k=1))
    assert_allclose(spectrum.values, np.full(n, -2.0), rtol=MULTIPLE)
    full = np.random.default_rng(n).integers(-1, 2, (n, n)) * np.tri(n, k=-1) + np.eye(n)
    turned = [full @ part for part in (np.zeros((n, n)), np.eye(n), 2.0 * np.eye(n) - np.eye(n, k=1))]
    spectrum = found(*turned)
    assert spectrum.values.size == n
    assert_allclose(spectrum.values, np.full(n, -2.0), rtol=MULTIPLE)


def test_repeated_eigenvalues_that_are_not_defective_are_kept() -> None:
    """Stiffness-proportional damping without mass: -1/beta as often as there are DOFs."""
    generator = np.random.default_rng(1)
    n = 30
    root = generator.integers(-2, 3, (n, n)) + 5.0 * np.eye(n)
    K = root @ root.T
    spectrum = found(np.zeros((n, n)), 0.25 * K, K)
    assert spectrum.values.size == n
    assert_allclose(spectrum.values, np.full(n, -4.0), rtol=1e-9)


def clamped_beam(elements: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut a steel beam of 10 m, 5 cm square, into elements with lumped masses."""
    h = 10.0 / elements
    bending = 2.1e11 * 0.05**4 / 12.0 / h**3
    element = bending * np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h**2, -6 * h, 2 * h**2],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h**2, -6 * h, 4 * h**2],
        ]
    )
    K, M = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for first in range(0, 2 * elements, 2):
        K[first : first + 4, first : first + 4] += element
        M[[first, first + 2], [first, first + 2]] += 7850.0 * 0.05**2 * h / 2.0
    return M[2:, 2:], np.zeros_like(K[2:, 2:]), K[2:, 2:]


def test_first_frequency_of_a_beam_is_as_good_as_its_bound() -> None:
    """60 elements, frequencies over four decades: the discretization error ``~ 1 / n^2`` and no more."""
    fine, coarse = (found(*clamped_beam(n)) for n in (60, 30))
    first = [float(np.abs(spectrum.values).min()) for spectrum in (fine, coarse)]
    extrapolated = (4.0 * first[0] - first[1]) / 3.0
    assert_allclose(extrapolated, BEAM, rtol=1e-6)  # errors of order 1/n^4 are left
    smallest = int(np.abs(fine.values).argmin())
    assert fine.bounds[smallest] < 1e-8 * abs(fine.values[smallest])
    assert not fine.doubts


@given(seed=st.integers(0, 2**32 - 1))
def test_free_bodies_in_rounded_numbers_are_called_so(seed: int) -> None:
    """A free chain in rotated coordinates: two zeros are meant, and what rounding made of them is announced."""
    n = 5
    laplacian = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    laplacian[0, 0] = laplacian[-1, -1] = 1.0
    turn = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
    spectrum = found(np.eye(n), np.zeros((n, n)), turn.T @ laplacian @ turn)
    at_origin = spectrum.values == 0.0
    assert np.count_nonzero(at_origin) == 2
    assert any("not told from zero" in doubt for doubt in spectrum.doubts)
    assert 0.0 < spectrum.bounds[at_origin].max() < 1e-6
    others = np.sort(np.abs(spectrum.values[~at_origin]))
    desired = np.sort(np.repeat(2.0 * np.sin(np.arange(1, n) * np.pi / (2 * n)), 2))
    assert_allclose(others, desired, rtol=1e-13)
