"""Decimal matrices against closed forms, to more digits than doubles have."""

import decimal
from decimal import Decimal

import numpy as np
import pytest

from halfdof_ctrl.design.digits import decimals, doubles, inverse, lyapunov, many_digits, matrix_sign

DIGITS = 60
SMALL = Decimal("1e-50")  # of sixty digits a few are lost


def test_decimals_hold_doubles_exactly() -> None:
    """The double of 1/10 is 3602879701896397 / 2^55, and numbers come back as they went in."""
    with many_digits(DIGITS):
        assert decimals(np.array([[0.1]]))[0, 0] == Decimal(3602879701896397) / Decimal(2**55)
    values = np.array([[1e-300, -3.5], [2.0**60, 0.0]])
    with many_digits(DIGITS):
        assert np.array_equal(doubles(decimals(values)), values)


def test_context_of_the_caller_is_left_alone() -> None:
    """Precision and rounding are those from before."""
    before = decimal.getcontext().prec
    with many_digits(DIGITS):
        assert decimal.getcontext().prec == DIGITS
    assert decimal.getcontext().prec == before


def test_inverse_of_a_hilbert_matrix_is_that_of_exact_arithmetic() -> None:
    """Of 1/(i + j + 1), 3 by 3, the inverse is [[9, -36, 30], [-36, 192, -180], [30, -180, 180]], det 1/2160."""
    with many_digits(DIGITS):
        hilbert = np.array([[Decimal(1) / (i + j + 1) for j in range(3)] for i in range(3)], dtype=object)
        found, size = inverse(hilbert)
        expected = decimals(np.array([[9.0, -36.0, 30.0], [-36.0, 192.0, -180.0], [30.0, -180.0, 180.0]]))
        assert np.abs(found - expected).max() < SMALL
    assert size == pytest.approx(-np.log10(2160.0))


def test_singular_matrix_has_no_inverse() -> None:
    """A row of zeros, or one twice another, leaves no pivot."""
    with many_digits(DIGITS), pytest.raises(ZeroDivisionError, match="singular"):
        inverse(decimals(np.array([[1.0, 2.0], [2.0, 4.0]])))


def test_sign_of_a_triangle_is_known() -> None:
    """The sign of [[a, b], [0, -c]] is [[1, 2 b/(a + c)], [0, -1]], over thirty decades."""
    a, b, c = 1e15, 3.0, 1e-15
    with many_digits(DIGITS):
        found = matrix_sign(decimals(np.array([[a, b], [0.0, -c]])))
        assert found is not None
        expected = 2 * Decimal(b) / (Decimal(a) + Decimal(c))
        assert abs(found[0, 1] / expected - 1) < SMALL
        assert found[0, 0] == 1
        assert found[1, 1] == -1


@pytest.mark.parametrize("matrix", [[[0.0, 1.0], [-1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]])
def test_eigenvalues_on_the_axis_have_no_sign(matrix: list[list[float]]) -> None:
    """An oscillator and an integrator are neither left nor right."""
    with many_digits(DIGITS):
        assert matrix_sign(decimals(np.array(matrix))) is None


def test_lyapunov_solves_what_is_stable_and_nothing_else() -> None:
    """F = [[-1, 1], [0, -2]] and S = 1 give Y = [[1/2, 1/6], [1/6, 1/3]]."""
    F = np.array([[-1.0, 1.0], [0.0, -2.0]])
    with many_digits(DIGITS):
        found = lyapunov(decimals(F), [decimals(np.eye(2)), decimals(2.0 * np.eye(2))])
        assert found is not None
        expected = np.array([[Decimal(1) / 2, Decimal(1) / 6], [Decimal(1) / 6, Decimal(1) / 3]], dtype=object)
        assert np.abs(found[0] - expected).max() < SMALL
        assert np.abs(found[1] - 2 * expected).max() < SMALL
        assert lyapunov(decimals(-F), [decimals(np.eye(2))]) is None
        assert lyapunov(decimals(np.zeros((1, 1))), [decimals(np.eye(1))]) is None
