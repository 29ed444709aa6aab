"""The factor of the mass as a triangle or a diagonal, and sums of few terms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl.reduction.energy.mass import MassFactor, product

ROUNDING = 1e-14  #: relative, of a few operations


@pytest.mark.parametrize("off", [0.0, 0.5])
def test_every_use_of_the_factor_is_a_solve_with_it(off: float) -> None:
    """Against solves with the full matrix, for a diagonal factor and a triangular one."""
    R = np.diag([2.0, 3.0, 5.0]) + off * np.eye(3, k=1)
    mass, X = MassFactor(R), np.arange(1.0, 10.0).reshape(3, 3)
    assert (mass.diagonal is None) == (off != 0.0)
    assert_allclose(mass.over(X) @ R, X, rtol=ROUNDING)
    assert_allclose(R.T @ mass.under(X), X, rtol=ROUNDING)
    assert_allclose(R @ mass.inverse(), np.eye(3), atol=ROUNDING)


def test_products_of_sparse_and_of_zero_matrices_are_the_plain_ones() -> None:
    """However few entries a matrix has."""
    X = np.arange(1.0, 101.0).reshape(50, 2)
    for matrix in (np.zeros((50, 50)), np.eye(50, k=1), np.ones((50, 50))):
        assert_allclose(product(matrix, X), matrix @ X, rtol=ROUNDING)
