"""How near a model is to a singular one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import mechss
from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.base.errors import UncertainRankError
from halfdof_ctrl.descriptor.nearness import UNDECIDED, share_of_rounding
from halfdof_ctrl.descriptor.regularity import require_regular
from support import exact
from support.structures import Structure, structures

NONE = np.zeros((2, 2))


@given(structure=structures())
def test_a_small_share_of_rounding_proves_a_pencil_regular(structure: Structure) -> None:
    """Small integers are far from singular or singular."""
    M, C, K = (np.asarray(matrix, dtype=float) for matrix in structure.matrices)
    assert (share_of_rounding((K, C, M)) < UNDECIDED) == (exact.order(M, C, K) >= 0)


@given(powers=st.lists(st.integers(-300, 300), min_size=4, max_size=4))
def test_share_does_not_depend_on_units(powers: list[int]) -> None:
    """``[2, 1; 1, 2]`` has the spectral radius 3 in units of its entries, whatever their units."""
    scale = 2.0 ** np.array(powers[:2])[:, None] * 2.0 ** np.array(powers[2:])
    share = share_of_rounding((np.array([[2.0, 1.0], [1.0, 2.0]]) * scale, NONE, NONE))
    assert share == pytest.approx(3.0 * EPS, rel=1e-6)


def test_model_that_is_regular_by_rounding_alone_is_refused_as_undecided() -> None:
    """Two constraints that differ by 2^-50: neither singular nor safe, with the size of the part against rounding."""
    K = np.array([[1.0, 0.0, 1.0, 1.0], [0.0, 1.0, 1.0, 1.0 + 2.0**-50], [1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]])
    K[3, 1] = 1.0 + 2.0**-50
    model = mechss(np.diag([1.0, 1.0, 0.0, 0.0]), None, K, dofs=["a", "b", "force1", "force2"])
    with pytest.raises(
        UncertainRankError, match=r"cannot be told: the stored numbers are regular.* rounding"
    ) as refusal:
        require_regular(model)
    assert {"force1", "force2"} <= set(refusal.value.dofs)
