"""Claims about models whose entries have the digits of a file: what these leave open is said, and nothing else."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import exact_reduction, mechss
from halfdof_ctrl.base.errors import CloseDecisionWarning, DataLimitWarning
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.file_digits import undetermined

TEN = 5e-10  # what ten digits leave unknown


def rounded(matrix: np.ndarray, digits: int = 10) -> np.ndarray:
    """Write a matrix with so many digits and read it back."""
    return np.array([[float(f"{value:.{digits - 1}e}") for value in row] for row in matrix.tolist()])


def chain(n: int, *, ground: float) -> np.ndarray:
    """Stiffness of a row of springs of uneven strength, its first point held by another one [N/m]."""
    K = np.zeros((n, n))
    for i, k in enumerate((1.0 + np.random.default_rng(n).random(n - 1)).tolist()):
        K[i : i + 2, i : i + 2] += [[k, -k], [-k, k]]
    K[0, 0] += ground
    return K


def from_file(M: np.ndarray, K: np.ndarray, digits: int = 10) -> SecondOrderModel:
    """Make a model of matrices as a file with so many digits has them."""
    return replace(
        mechss(rounded(M, digits), 1e-3 * np.eye(len(K)), rounded(K, digits)), known_to=0.5 * 10.0 ** (1 - digits)
    )


@given(n=st.integers(2, 30), digits=st.sampled_from([6, 8, 10]))
def test_rigid_body_motion_of_a_rounded_file_is_found(n: int, digits: int) -> None:
    """One direction, all points alike: the motion that the unrounded matrix leaves free."""
    found = undetermined(rounded(chain(n, ground=0.0), digits), 0.5 * 10.0 ** (1 - digits))
    if found is None:  # the roundings add up to nothing, so that in first order the motion is free as it stands
        assert abs(rounded(chain(n, ground=0.0), digits).sum()) < 1e-12
    else:
        assert found.vectors.shape == (n, 1)
        motion = found.vectors[:, 0] / found.vectors[0, 0]
        assert_allclose(motion, 1.0, rtol=n**2 * 10.0 ** (2 - digits))


@given(n=st.integers(2, 30))
def test_what_is_held_is_not_called_free(n: int) -> None:
    """A ground spring of a hundredth is seven decades above the rounding of ten digits."""
    assert undetermined(rounded(chain(n, ground=1e-2)), TEN) is None


def test_free_body_is_announced_with_the_reach_of_its_poles() -> None:
    """A pole on either side of zero within what the message says, no matter which side rounding chose."""
    model = from_file(np.eye(12), chain(12, ground=0.0))
    words = r"1 eigenvalues of K are .*rounding of a file with 10 digits .*rigid-body motions"
    with pytest.warns(DataLimitWarning, match=words) as given_warnings:
        poles = np.linalg.eigvals(exact_reduction(replace(model, C=np.zeros((12, 12)))).A)
    (reach,) = re.findall(r"Poles up to ([\d.e+-]+) rad/s", str(given_warnings[0].message))
    assert np.sort(np.abs(poles))[1] < float(reach) < 1e-3


def test_masses_that_cancel_to_the_digits_of_the_file_are_announced() -> None:
    """Of rank one as computed, of rank two as written: its second direction has no mass, or none that is known."""
    arm = np.array([1.0, 0.7123456789012])
    model = from_file(np.outer(arm, arm) / 3.0, np.eye(2))
    with pytest.warns(CloseDecisionWarning, match=r"1 eigenvalues of M are within .* file with 10 digits .*tol=5e-09"):
        exact_reduction(model)


def test_sound_models_of_any_digits_are_left_alone() -> None:
    """Also what is singular as it stands: a free body whose rows add up to zero exactly."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exact_reduction(from_file(np.eye(9), chain(9, ground=0.5), 6))
        exact_reduction(from_file(np.eye(3), np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])))
        exact_reduction(from_file(np.diag([1.0, 0.0, 2.0]), chain(3, ground=0.5)))
