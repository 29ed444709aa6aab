"""What is called singular, and what is called uncertain, near rounding."""

import re

import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.base.errors import SingularPencilError, UncertainRankError

BETWEEN = (0.1, 1.0)  # of the entry that tells two constraints apart: five entries change to take its place


def held_twice(share: float) -> SecondOrderModel:
    """Hold the difference of two masses twice, the second time with a share of a third one, all in tenths."""
    M, K = np.diag([0.1, 0.1, 0.1, 0.0, 0.0]), np.diag([0.1, 0.2, 0.3, 0.0, 0.0])
    K[3:, :3] = np.array([[0.1, -0.1, 0.0], [0.1, -0.1, 0.1 * share]])
    K[:3, 3:] = K[3:, :3].T
    return mechss(M, None, K)


@pytest.mark.parametrize("share", [1e-14, 1e-12, 1e-10])
def test_a_soft_part_above_rounding_is_no_proof_of_a_singular_pencil(share: float) -> None:
    """A constraint that differs from another one by an entry of its own, however small, is no copy of it."""
    with pytest.raises(UncertainRankError, match="Whether the pencil is singular cannot be told") as refusal:
        exact_reduction(held_twice(share))
    told = re.search(r"no change of each entry by less than (\S+) of itself", str(refusal.value))
    assert told is not None
    assert BETWEEN[0] * share <= float(told[1]) <= BETWEEN[1] * share
    assert set(refusal.value.dofs) == {"q3", "q4"}


@pytest.mark.parametrize("factor", [0.3, 0.7, 1.1])
def test_a_redundant_constraint_in_decimals_stays_singular(factor: float) -> None:
    """A row that is a multiple of another one, each entry rounded: no part of it stands above rounding."""
    M, K = np.diag([0.1, 0.1, 0.1, 0.0, 0.0]), np.diag([0.1, 0.2, 0.3, 0.0, 0.0])
    row = np.array([0.1, -0.3, 0.7])
    K[3, :3], K[4, :3] = row, row * factor
    K[:3, 3:] = K[3:, :3].T
    with pytest.raises(SingularPencilError, match="redundant"):
        exact_reduction(mechss(M, None, K))
