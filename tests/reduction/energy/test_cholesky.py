"""The corrected Cholesky factor."""

import mpmath  # type: ignore[import-untyped]
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.reduction.energy.cholesky import corrected_factor
from support.beams import beam_matrices

STORED = 1e-14  #: relative, of each entry of the factor: a few roundings, where the plain one has lost digits


def test_factor_of_a_beam_is_right_to_its_last_digits() -> None:
    """Against Cholesky with 300 bits, for a stiffness whose plain factor has lost eight digits."""
    _, K = beam_matrices(30)
    U = corrected_factor(K)
    assert U is not None
    with mpmath.workprec(300):
        exact = np.array(mpmath.cholesky(mpmath.matrix(K.tolist())).tolist(), dtype=float).T
    assert_allclose(U, exact, rtol=STORED, atol=1e-25)  # of entries up to 1e3; some are zero but for rounding of K
    plain = np.linalg.cholesky(K).T
    assert (np.abs(plain - exact) > 1e3 * STORED * np.abs(exact)).any()


def test_zeros_above_the_envelope_stay_exact_zeros() -> None:
    """The correction does not fill a banded factor with roundings."""
    _, K = beam_matrices(12)
    U = corrected_factor(K)
    assert U is not None
    assert_array_equal(U[np.triu(K == 0.0, 4)], 0.0)


@given(st.lists(st.integers(-30, 30), min_size=4, max_size=4))
def test_factor_follows_the_units_exactly(powers: list[int]) -> None:
    """Powers of two in the DOFs multiply the columns of the factor and change no digit."""
    K = np.array([[4.0, 1, 0, 0.3], [1, 5, 2, 0], [0, 2, 6, 1], [0.3, 0, 1, 3]])
    unit = 2.0 ** np.array(powers)
    U = corrected_factor(K)
    assert U is not None
    assert_array_equal(corrected_factor(unit[:, None] * K * unit), U * unit)


def test_no_factor_of_what_is_not_definite() -> None:
    """A zero, a negative diagonal and an indefinite matrix have none."""
    for K in ([[0.0]], [[-1.0]], [[1.0, 2.0], [2.0, 1.0]]):
        assert corrected_factor(np.array(K)) is None
