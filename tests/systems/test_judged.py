"""Grades of errors by a tolerance and by what the numbers allow on top of it."""

import numpy as np

from halfdof_ctrl.systems.judged import Grade, graded, safety


def test_the_worst_grade_decides_and_the_largest_error_of_it_is_given() -> None:
    """An error of 1e-3 that is allowed is less of a fault than one of 1e-9 that is not."""
    errors, allowed = np.array([[1e-12, 1e-3], [1e-9, 2e-9]]), np.array([[0.0, 1e-2], [0.0, 0.0]])
    assert graded(errors, allowed, 1e-10) == (Grade.FAILED, 3)
    assert graded(errors[:1], allowed[:1], 1e-10) == (Grade.WITHIN, 1)
    assert graded(errors[:1, :1], allowed[:1, :1], 1e-10) == (Grade.OK, 0)


def test_what_is_no_number_has_failed() -> None:
    """NaN and Inf never slip through a comparison; an allowance that is NaN allows nothing."""
    for error in (np.nan, np.inf):
        assert graded(np.array([error]), np.array([1.0]), 1e-10)[0] == Grade.FAILED
    assert graded(np.array([1e-9]), np.array([np.nan]), 1e-10)[0] == Grade.FAILED


def test_allowances_grow_by_the_root_of_the_size() -> None:
    """Sums of n roundings at random."""
    assert safety(400) == 20.0 * safety(1)
