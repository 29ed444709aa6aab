"""Which channels grow, and where that is not told."""

import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, mechss
from halfdof_ctrl.base.errors import UncertainRankError
from halfdof_ctrl.descriptor.growth import improper_pairs


def tied() -> SecondOrderModel:
    """Give two masses tied by a rigid link, whose force is a multiplier."""
    return mechss(np.diag([1.0, 1, 0]), None, [[2, 0, 1], [0, 3, -1], [1, -1, 0]])


def test_without_finite_eigenvalues_to_go_by_growth_is_not_told() -> None:
    """A circle around what is finite needs to know what is: P(s)^-1 of index three may grow."""
    with pytest.raises(UncertainRankError, match=r"F_q0 to q0 grows.*hide which eigenvalues") as refusal:
        improper_pairs(tied(), None, 3)
    assert refusal.value.dofs == ("F_q0", "q0")


def test_without_finite_eigenvalues_index_one_settles_displacements() -> None:
    """P(s)^-1 of index one does not grow, whatever is finite."""
    assert improper_pairs(tied(), None, 1) == ()


def test_with_them_the_link_grows() -> None:
    """A prescribed length takes forces that grow as s^2."""
    assert improper_pairs(tied(), np.array([1.58j, -1.58j]), 3) == (("F_q2", "q2", 2),)
