"""Solutions along directions in which the rounded sum of the terms of P(s) says nothing."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import SecondOrderModel, mechss
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.model.evaluation import data_limit
from halfdof_ctrl.model.weak_directions import Factors, WeakDirections, refined_along_weak, refined_at

EXACT = 1e-13  # relative, of a solution that is refined as far as it goes
GROUPS = 6  # pairs of masses


def pairs(link: float, groups: int = GROUPS, *, is_sparse: bool = False) -> SecondOrderModel:
    """Make a chain of pairs of 1 kg on links, which are powers of two, joined by springs and dampers of 1.

    Every entry is exact but for ``link + 1`` or ``link + 2``, which are doubles up to 2^52.
    """
    n = 2 * groups
    M, C, K = np.eye(n), np.zeros((n, n)), np.zeros((n, n))
    for group in range(groups):
        first, last = 2 * group, 2 * group + 1
        K[np.ix_([first, last], [first, last])] += link * np.array([[1.0, -1.0], [-1.0, 1.0]])
        joint = [first - 1, first] if group else [first]
        part = np.array([[1.0, -1.0], [-1.0, 1.0]]) if group else np.array([[1.0]])
        K[np.ix_(joint, joint)] += part
        C[np.ix_(joint, joint)] += part / 8.0
    matrices = [csc_array(part) if is_sparse else part for part in (M, C, K)]
    return mechss(*matrices).select("F_q1", ["q0", f"q{n - 1}"])


def stiffly_linked(omega: float, groups: int = GROUPS) -> list[complex]:
    """Give the response of the first and the last pair for rigid links: a chain of masses of 2 kg."""
    chain = 2.0 * np.eye(groups) - np.eye(groups, k=1) - np.eye(groups, k=-1)
    chain[-1, -1] = 1.0
    motion = np.linalg.inv((1.0 + 1j * omega / 8.0) * chain - 2.0 * omega**2 * np.eye(groups))
    return [motion[0, 0], motion[-1, 0]]


@pytest.mark.parametrize("is_sparse", [False, True])
@pytest.mark.parametrize("bits", [50, 51, 52])
def test_masses_on_links_that_swallow_springs_keep_their_response(bits: int, *, is_sparse: bool) -> None:
    """Six directions at once of which the rounded sum knows nothing; the softness of the links adds 1e-15."""
    omega = np.array([0.1, 0.3, 0.7])
    found = pairs(2.0**bits, is_sparse=is_sparse)(1j * omega)[:, 0]
    assert_allclose(found, np.transpose([stiffly_linked(w) for w in omega.tolist()]), rtol=EXACT)


@pytest.mark.parametrize("is_sparse", [False, True])
def test_a_sum_that_is_exactly_singular_is_no_pole(*, is_sparse: bool) -> None:
    """Two free masses on 2^60 N/m: the sum of spring and inertia is the spring, the response -1 / (2 w^2)."""
    K = 2.0**60 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    matrices = [csc_array(part) if is_sparse else part for part in (np.eye(2), K)]
    model = mechss(matrices[0], None, matrices[1], [1.0, 0.0], [0.0, 1.0])
    omega = np.array([1.0, 3.0])
    assert_allclose(model(1j * omega), -0.5 / omega**2, rtol=EXACT)


@pytest.mark.parametrize("is_sparse", [False, True])
def test_a_pole_on_the_grid_stays_one(*, is_sparse: bool) -> None:
    """P(2j) is exactly singular, P(2j (1 + 1e-12)) is not."""
    K = np.array([[5.0, -1.0], [-1.0, 5.0]])
    matrices = [csc_array(part) if is_sparse else part for part in (np.eye(2), K)]
    at, beside = mechss(matrices[0], None, matrices[1])(np.array([2j, 2j * (1.0 + 2.0**-40)]))[0, 0]
    assert np.isinf(at.real)
    assert_allclose(beside, -0.5 / (8.0 * 2.0**-40), rtol=1e-9)


def test_directions_of_a_neighbour_are_replaced_where_they_do_not_serve() -> None:
    """Directions of another matrix altogether: new ones are found."""
    model = pairs(2.0**52)
    P = [np.asarray(part) for part in model.quadratics.P]
    s, right = 0.3j, np.asarray(model.B, dtype=np.complex128)
    factors = Factors.of_dense(P[0] + s * P[1] + s**2 * P[2])
    assert factors is not None
    wrong = np.eye(len(P[0]), 2, dtype=np.complex128)
    given = WeakDirections(wrong, wrong)
    found = refined_along_weak(ExactPolynomial(P), s, factors.solve(right), right, factors, given)
    assert found.is_settled
    assert_allclose(found.solution[[0, -1], 0], stiffly_linked(0.3), rtol=EXACT)


def test_the_transpose_is_solved_with_the_same_directions() -> None:
    """An unsymmetric matrix ``2^56 u v^T`` plus what stands beside it: ``P^T y = c`` from the directions of P."""
    u, v = np.array([[1.0], [2.0], [-1.0]]), np.array([[1.0], [-1.0], [4.0]])
    K, C = 2.0**56 * u @ v.T, np.diag([1.0, 3.0, 2.0])
    right = np.array([[1.0 + 0j], [0j], [1.0 + 0j]])
    factors = Factors.of_dense(K + C + 0j)
    assert factors is not None
    forward = refined_at(ExactPolynomial([K, C]), 1.0, factors.solve(right), right, factors)
    back = refined_at(
        ExactPolynomial([K.T, C]),
        1.0,
        factors.solve_transposed(right),
        right,
        factors.transposed,
        None if forward.directions is None else forward.directions.transposed,
    )
    inner = np.linalg.inv(C)  # Sherman and Morrison, for an infinite factor: C^-1 - C^-1 u v^T C^-1 / (v^T C^-1 u)
    exact = inner - inner @ u @ v.T @ inner / (v.T @ inner @ u)
    assert_allclose(forward.solution, exact @ right, rtol=EXACT, atol=EXACT)
    assert_allclose(back.solution, exact.T @ right, rtol=EXACT, atol=EXACT)


def test_data_is_right_where_no_digit_of_a_plain_solution_is() -> None:
    """(DATA) of two masses on a link of 2^60 N/m: ``eps |y|^T |P| |x|``, with x and y -1 / (2 w^2) in every place."""
    link, omega = 2.0**60, 1.0
    K = link * np.array([[1.0, -1.0], [-1.0, 1.0]])
    one, zero = np.array([[1.0], [0.0]]), np.zeros((2, 1))
    limit = data_limit(
        [K, np.zeros((2, 2)), np.eye(2)],
        [one, zero, zero],
        [one.T, zero.T, zero.T],
        [np.zeros((1, 1))] * 3,
        np.array([1j * omega]),
    )
    assert_allclose(limit.data[0, 0, 0], np.finfo(float).eps * 4.0 * link / 4.0, rtol=1e-2)
