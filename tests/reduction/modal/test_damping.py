"""Proportional damping is told from dampers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.sparse import csc_array, diags_array

from halfdof_ctrl.reduction.modal.damping import lumped_damping
from support.fe_models import space_frame


@given(alpha=st.floats(0.0, 10.0), beta=st.floats(0.0, 0.1), seed=st.integers(0, 2**32 - 1))
def test_dampers_are_left_of_proportional_damping(alpha: float, beta: float, seed: int) -> None:
    """``alpha M + beta K`` goes to the last entry, whatever its units; two dampers stay to nine digits."""
    structure = space_frame(2, 2, 3, 2, dampers=2, seed=seed % 1000)
    units = diags_array(10.0 ** np.random.default_rng(seed).integers(-3, 4, structure.size).astype(float))
    M = csc_array(units @ (structure.M + 2.0 * diags_array(np.ones(structure.size))) @ units)
    C, K = (csc_array(units @ matrix @ units) for matrix in (structure.C, structure.K))
    rest = lumped_damping(M, csc_array(alpha * M + beta * K + C), K)
    if alpha or beta:
        assert set(rest.indices.tolist()) == set(C.indices.tolist())
    size = float(abs(alpha * M + beta * K + C).max())
    assert_allclose(rest.toarray(), C.toarray(), rtol=1e-6, atol=1e-9 * size)


@pytest.mark.parametrize("kind", ["mass", "stiffness"])
def test_one_of_the_two_is_enough(kind: str) -> None:
    """No stiffness, or no mass."""
    matrix, none = csc_array(np.array([[2.0, -1.0], [-1.0, 3.0]])), csc_array((2, 2))
    M, K = (matrix, none) if kind == "mass" else (none, matrix)
    assert lumped_damping(M, csc_array(0.3 * matrix), K).nnz == 0


def test_mass_and_stiffness_may_be_proportional() -> None:
    """Then alpha and beta are not unique, and nothing is left all the same."""
    K = csc_array(np.array([[2.0, -1.0], [-1.0, 3.0]]))
    assert lumped_damping(csc_array(0.5 * K), csc_array(0.1 * K), K).nnz == 0


def test_dampers_alone_stay_as_they_are() -> None:
    """Five equal dampers at equal nodes are no proportional damping of the whole."""
    structure = space_frame(3, 2, 3, 2, dampers=3)
    assert lumped_damping(structure.M, structure.C, structure.K) is structure.C
    none = csc_array(structure.C.shape)
    assert lumped_damping(structure.M, none, structure.K) is none
