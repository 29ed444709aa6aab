"""What is called singular, and what is called uncertain, near rounding."""

import re

import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.base.errors import CloseDecisionWarning, SingularPencilError, UncertainRankError
from support.rational import rational_transfer

BETWEEN = (0.1, 1.0)  # of the entry that tells two constraints apart: five entries change to take its place


def held_twice(share: float) -> SecondOrderModel:
    """Hold the difference of two masses twice, the second time with a share of a third one, all in tenths."""
    M, K = np.diag([0.1, 0.1, 0.1, 0.0, 0.0]), np.diag([0.1, 0.2, 0.3, 0.0, 0.0])
    K[3:, :3] = np.array([[0.1, -0.1, 0.0], [0.1, -0.1, 0.1 * share]])
    K[:3, 3:] = K[3:, :3].T
    return mechss(M, None, K)


@pytest.mark.parametrize("share", [1e-14, 1e-13])
def test_a_soft_part_above_rounding_is_no_proof_of_a_singular_pencil(share: float) -> None:
    """A constraint that differs from another one by an entry of its own, however small, is no copy of it."""
    with pytest.raises(UncertainRankError, match="Whether the pencil is singular cannot be told") as refusal:
        exact_reduction(held_twice(share))
    told = re.search(r"no change of each entry by less than (\S+) of itself", str(refusal.value))
    assert told is not None
    assert BETWEEN[0] * share <= float(told[1]) <= BETWEEN[1] * share
    assert set(refusal.value.dofs) == {"q3", "q4"}


@pytest.mark.parametrize("share", [1e-10, 1e-9, 1e-8])
def test_constraints_that_differ_by_more_than_rounding_are_two(share: float) -> None:
    """The third mass is held, though a direct solve, which squares the share, takes the constraints for one."""
    model = held_twice(share)
    with pytest.warns(CloseDecisionWarning, match="nearly the same"):
        reduction = exact_reduction(model)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(reduction.A).imag), [-(1.5**0.5), 1.5**0.5], rtol=1e-14)
    exact = rational_transfer(model).at([0.7j, 2.0j])
    output = reduction.output
    forces = slice(3)  # reactions to offsets of constraints are 1 / share^2: rounding of the entries leaves nothing
    for k, s in enumerate([0.7j, 2.0j]):
        H = output.X @ np.linalg.solve(s * np.eye(2) - reduction.A, reduction.B) + output.direct(len(model.inputs))
        value = exact[:3, forces, k]
        np.testing.assert_allclose(H[:3, forces], value, rtol=1e-12, atol=1e-12 * abs(value).max())


@pytest.mark.parametrize("seed", range(12))
def test_a_redundant_constraint_stays_singular_in_other_coordinates(seed: int) -> None:
    """Rotated, mixed, in other units: rounding makes the stored numbers regular, and they are not taken for it."""
    generator = np.random.default_rng(seed)
    n, c = 5, 3
    M, K = np.zeros((2, n + c, n + c))
    M[:n, :n], K[:n, :n] = np.diag([0.1, 0.2, 0.3, 0.4, 0.5]), np.diag([0.3, 0.7, 1.1, 0.9, 0.1])
    G = np.round(generator.standard_normal((c, n)), 1)
    G[2] = 0.3 * G[0] - G[1] / 3.0
    T = np.zeros((n + c, n + c))
    T[:n, :n] = np.linalg.qr(generator.standard_normal((n, n)))[0]
    T[n:, n:] = generator.standard_normal((c, c)) * 10.0 ** generator.integers(-2, 3)
    K[n:, :n], K[:n, n:] = G, G.T
    with pytest.raises((SingularPencilError, UncertainRankError)):
        exact_reduction(mechss(T.T @ M @ T, None, T.T @ K @ T))


@pytest.mark.parametrize("factor", [0.3, 0.7, 1.1])
def test_a_redundant_constraint_in_decimals_stays_singular(factor: float) -> None:
    """A row that is a multiple of another one, each entry rounded: no part of it stands above rounding."""
    M, K = np.diag([0.1, 0.1, 0.1, 0.0, 0.0]), np.diag([0.1, 0.2, 0.3, 0.0, 0.0])
    row = np.array([0.1, -0.3, 0.7])
    K[3, :3], K[4, :3] = row, row * factor
    K[:3, 3:] = K[3:, :3].T
    with pytest.raises(SingularPencilError, match="redundant"):
        exact_reduction(mechss(M, None, K))
