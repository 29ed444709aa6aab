"""Poles sorted into branches over a parameter."""

import hypothesis.strategies as st
import numpy as np
from hypothesis import given
from numpy.testing import assert_array_equal

from halfdof_ctrl.plots.branches import followed

STEPS = 25


@given(order=st.lists(st.permutations(range(4)), min_size=STEPS, max_size=STEPS))
def test_shuffled_poles_are_sorted_into_smooth_branches(order: list[list[int]]) -> None:
    """Four poles that move slowly, shuffled anew at every value, come out as they were at the first."""
    way = np.linspace(0.0, 1.0, STEPS)
    smooth = np.stack([-1 - way, -10 + way, -2 + (5 + way) * 1j, -2 - (5 + way) * 1j], axis=1)
    shuffled = np.take_along_axis(smooth, np.array([list(range(4)), *order[1:]]), axis=1)
    assert_array_equal(followed(shuffled), smooth)


def test_slow_poles_are_told_apart_beside_fast_ones() -> None:
    """Distances are relative: a slow pole that doubles is not taken for the other because a fast one moves farther."""
    poles = np.array([[-1.0, -3.0, -1e6], [-1.1e6, -2.8, -1.2]], dtype=complex)
    assert followed(poles)[1].real.tolist() == [-1.2, -2.8, -1.1e6]


def test_a_pole_that_comes_later_has_a_branch_of_its_own() -> None:
    """NaN until then, also between two values."""
    poles = np.array([[-1.0, np.nan], [-20.0, -1.1], [-1.2, np.nan], [-1.3, -21.0]], dtype=complex)
    assert_array_equal(followed(poles).real, [[-1, np.nan], [-1.1, -20], [-1.2, np.nan], [-1.3, -21]])


def test_poles_at_the_origin_stay_there() -> None:
    """Nothing is divided by zero."""
    assert followed(np.array([[0.0, -1.0], [-1.1, 0.0]], dtype=complex))[1].tolist() == [0.0, -1.1]
