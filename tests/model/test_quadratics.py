"""The coefficients that a model hands out, in the order of equation (1)."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import mechss
from halfdof_ctrl.base.sparse_arrays import as_sparse

ROUNDING = 1e-13
POINT = 0.3 + 1.7j


@pytest.mark.parametrize("is_sparse", [False, True])
def test_quadratics_give_the_transfer_function(is_sparse: bool) -> None:  # noqa: FBT001
    """``F(s) P(s)^-1 B(s) + D(s)`` with a motion as input and all derivatives in use, against the model's own value."""
    M, C, K = [[2, 1], [1, 3]], [[1, -2], [1, 2]], [[5, -1], [2, 4]]
    model = mechss(csc_array(M) if is_sparse else M, C, K)
    model = model.prescribe_motion("q1", inputs=["q1", "F_q0"], outputs=["R_q1", "q0_dot", "q0_ddot"])
    P, B, F, D = (
        np.tensordot(POINT ** np.arange(3), np.stack([as_sparse(part).toarray() for part in parts]), axes=1)
        for parts in model.quadratics
    )
    assert_allclose(F @ np.linalg.solve(P, B) + D, model(POINT), rtol=ROUNDING)
