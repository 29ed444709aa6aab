"""What the measurement of the loss itself does with states that do not move."""

import warnings

import numpy as np
import pytest

from halfdof_ctrl.reduction.method.loss import StateSolver, loss_points


def test_a_point_that_is_an_eigenvalue_is_an_error_and_no_warning_of_another_package() -> None:
    """``s I - A`` is exactly singular at s = 0 for two states that stand still."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(np.linalg.LinAlgError, match="s is an eigenvalue"):
            StateSolver(np.zeros((2, 2)), 0.0)


def test_free_motions_of_many_states_are_no_points_and_no_warnings() -> None:
    """A free mass among swinging ones: the points lie beside the slowest of these, 2 rad/s."""
    swinging = np.kron(np.diag(np.arange(2.0, 40.0)), np.array([[0.0, 1.0], [-1.0, 0.0]]))
    A = np.zeros((len(swinging) + 2, len(swinging) + 2))
    A[2:, 2:], A[0, 1] = swinging, 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = np.abs(loss_points(A))
    assert np.min(np.abs(points - 2.0)) < 0.02
