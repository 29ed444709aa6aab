"""Units in which a matrix polynomial is even, and its logarithmic derivative."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import hydromount
from halfdof_ctrl.descriptor.contours import contour
from halfdof_ctrl.descriptor.scaled_polynomial import ScaledPolynomial, mean_frequency

ROUNDOFF = 1e-12  # a few unknowns, solved directly
SIMPLE = ([[6.0]], [[5.0]], [[1.0]])  # (s + 2)(s + 3)


def polynomial() -> ScaledPolynomial:
    """Give ``s^2 + 5 s + 6``."""
    return ScaledPolynomial.of([np.array(part) for part in SIMPLE])


@given(powers=st.lists(st.integers(-100, 100), min_size=7, max_size=7))
def test_mean_frequency_follows_the_unit_of_time_alone(powers: list[int]) -> None:
    """The mount with rows, columns and time in units of powers of two."""
    mount = hydromount()
    rows, columns, tau = 2.0 ** np.array(powers[:3]), 2.0 ** np.array(powers[3:6]), 2.0 ** powers[6]
    scale = rows[:, None] * columns
    found = mean_frequency([mount.K * scale, mount.C * scale * tau, mount.M * scale * tau**2])
    assert found == mean_frequency([mount.K, mount.C, mount.M]) / tau


def test_mean_frequency_is_one_without_eigenvalues() -> None:
    """Springs alone have no time."""
    none = np.zeros((2, 2))
    assert mean_frequency([np.diag([3.0, 1e9]), none, none]) == 1.0


def test_logarithmic_derivative_is_that_of_the_determinant() -> None:
    """``(2 s + 5) / ((s + 2)(s + 3))``, in the unit of the polynomial."""
    scaled = polynomial()
    s = np.array([1.0 + 2.0j, -7.0 + 0.5j])
    found = scaled.logarithmic_derivative(s / scaled.unit) / scaled.unit
    assert_allclose(found, (2.0 * s + 5.0) / ((s + 2.0) * (s + 3.0)), rtol=ROUNDOFF)


def test_logarithmic_derivative_has_no_value_where_the_matrix_is_singular() -> None:
    """At s = 0 of a free mass; the points beside it keep theirs, 2/s."""
    scaled = ScaledPolynomial.of([np.zeros((1, 1)), np.zeros((1, 1)), np.eye(1)])
    found = scaled.logarithmic_derivative(np.array([1.0 + 0j, 0j, 2.0 + 0j]))
    assert np.isnan(found[1])
    assert_allclose(found[[0, 2]], [2.0, 1.0], rtol=ROUNDOFF)


def test_circle_counts_the_eigenvalues_within_and_sums_them() -> None:
    """Around -2 alone one, around both two with mean -2.5, and none where there are none."""
    scaled = polynomial()
    unit = scaled.unit
    assert contour(scaled, -2.0 / unit, 0.3 / unit).count == 1
    both = contour(scaled, -2.5 / unit, 3.0 / unit)
    assert both.count == 2
    assert abs(both.moments[1]) < 1e-8  # twelve points, eigenvalues at a sixth of the radius
    assert contour(scaled, 5.0 / unit, 1.0 / unit).count == 0


def test_circle_through_an_eigenvalue_counts_nothing() -> None:
    """The mean over a circle through -2 is one half, which is no number."""
    scaled = polynomial()
    assert contour(scaled, 0.0, 2.0 / scaled.unit).count is None
