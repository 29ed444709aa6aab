"""Refined poles: isolated ones to the last digit, multiple ones with an honest bound."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.systems.refined_poles import refined_poles

LAST_DIGITS = 1e-14  # relative: eigenvalues known in closed form, computed with one correction


@given(
    values=st.lists(st.integers(-9, 9), min_size=1, max_size=4, unique=True),
    powers=st.lists(st.integers(-6, 6), min_size=4, max_size=4),
)
def test_units_of_states_change_nothing(values: list[int], powers: list[int]) -> None:
    """``S^-1 A S`` for a triangular A with distinct integers on its diagonal, S powers of ten."""
    n = len(values)
    A = np.diag(np.array(values, dtype=float)) + np.triu(np.ones((n, n)), 1)
    scale = 10.0 ** np.array(powers[:n])
    poles = refined_poles(A * scale / scale[:, None])
    found = np.sort(poles.values.real)
    assert np.abs(found - np.sort(values)).max() <= 1e-12 * max(1, np.abs(values).max())


def test_a_slow_pole_beside_a_fast_one_keeps_its_digits() -> None:
    """``[[-1e9, 1e5], [1, -1e-3]]``: the slow pole follows from the product of both, which is -det."""
    A = np.array([[-1e9, 1e5], [1.0, -1e-3]])
    poles = refined_poles(A)
    slow = poles.values[np.argmin(np.abs(poles.values))].real
    fast = poles.values[np.argmax(np.abs(poles.values))].real
    assert slow == pytest.approx((1e9 * 1e-3 - 1e5) / fast, rel=LAST_DIGITS * 100)
    assert poles.bounds[np.argmin(np.abs(poles.values))] < 1e-10 * abs(slow)


def test_a_double_pole_is_where_it_is_within_its_bound() -> None:
    """``(s + 1)^2`` in coordinates that mix it: both estimates are within the bound, which is no more than 1e-6."""
    turn = np.array([[3.0, -4.0], [4.0, 3.0]]) / 5.0
    poles = refined_poles(turn @ np.array([[-1.0, 1.0], [0.0, -1.0]]) @ turn.T)
    assert (np.abs(poles.values + 1.0) <= 16 * poles.bounds).all()
    assert poles.bounds.max() < 1e-6


def test_two_double_poles_are_not_mistaken_for_others() -> None:
    """``(s + 1)^4`` of two equal oscillators: the vectors of one are no vectors of the other."""
    block = np.array([[0.0, 1.0], [-1.0, -2.0]])
    poles = refined_poles(np.kron(np.eye(2), block))
    assert np.abs(poles.values + 1.0).max() < 1e-6


def test_an_integrator_is_at_the_origin() -> None:
    """A double pole at zero, and a mass that a slow spring holds is not."""
    assert refined_poles(np.array([[0.0, 1.0], [0.0, 0.0]])).at_origin.all()
    assert not refined_poles(np.array([[0.0, 1.0], [-1e-8, -1e-5]])).at_origin.any()


def test_no_states_have_no_poles() -> None:
    """Empty in, empty out."""
    assert refined_poles(np.zeros((0, 0))).values.size == 0
