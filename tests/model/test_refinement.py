"""Refined solutions where the sum of the terms of P(s) loses digits, and what the entries determine."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import SecondOrderModel, mechss
from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.model.evaluation import data_limit, quadratic_transfer, transfer_and_growth
from halfdof_ctrl.model.refinement import refined

SPRING = 1.0  # N/m
LINK = 2.0**40  # N/m: a link so stiff that the sum of link and spring loses twelve digits
EXACT = 1e-14  # relative, of a refined response
DATA = 3.0  # two ways to compute (DATA) agree within this factor


def linked(*, is_sparse: bool) -> SecondOrderModel:
    """Tie two masses over a massless node by stiff links; only the sum of all three moves at low frequency.

    With ``K = soft + LINK * integers`` every entry is exact, and the response of the second mass to a force on the
    first is, to 1e-11, that of one body: the softness of the links adds 2 / LINK.
    """
    soft = np.diag([SPRING, 0.0, SPRING])
    links = LINK * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    M = np.diag([1.0, 0.0, 1.0])
    K = soft + links  # exact: one bit in 41
    matrices = [csc_array(part) if is_sparse else part for part in (M, K)]
    return mechss(matrices[0], None, matrices[1], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])


def exact_response(omega: float) -> float:
    """Solve the three equations by hand: two equal masses and springs, a link of LINK/2 between them."""
    own = SPRING - omega**2
    return (LINK / 2.0) / (own * (own + LINK))


@pytest.mark.parametrize("is_sparse", [False, True])
def test_soft_masses_over_stiff_links_keep_their_digits(*, is_sparse: bool) -> None:
    """``(k - m w^2)`` beside a link 2^40 times stiffer, at frequencies whose squares are no short numbers."""
    omega = np.array([0.1, 0.3, 0.7, 1.3, 5.0])
    found = linked(is_sparse=is_sparse)(1j * omega)
    assert_allclose(found, [exact_response(w) for w in omega.tolist()], rtol=EXACT)


def test_growth_is_small_where_nothing_is_lost() -> None:
    """A mount of ordinary numbers asks for no refinement."""
    model = mechss(np.eye(2), None, [[2.0, -1.0], [-1.0, 2.0]])
    values, growth = transfer_and_growth(*model.quadratics, np.array([0.1j, 0.5j]))
    assert growth.max() < 100.0
    assert_allclose(values, quadratic_transfer(*model.quadratics, np.array([0.1j, 0.5j])), rtol=0.0, atol=0.0)


def test_data_and_slope_of_an_oscillator_are_those_of_the_formula() -> None:
    """``eps (|k| + w^2 |m|) / |k - w^2 m|^2`` (B and F add 2 / |k - w^2 m|), and ``2 w^2 m / (k - w^2 m)^2``."""
    one, zero = np.array([[1.0]]), np.array([[0.0]])
    k, m, w = 4.0, 1.0, 1.5
    none = [zero, zero]
    limit = data_limit([k * one, zero, m * one], [one, *none], [one, *none], [zero, *none], np.array([1j * w]))
    stiffness = k - w**2 * m
    desired = np.finfo(float).eps * ((k + w**2 * m) / stiffness**2 + 2.0 / stiffness)
    assert desired / DATA < limit.data[0, 0, 0] < desired * DATA
    assert_allclose(limit.slope, 2.0 * w**2 * m / stiffness**2, rtol=1e-14)


def test_columns_are_refined_each_by_itself() -> None:
    """Two points side by side, P singular to rounding at one of them: the other is refined to the last digit."""
    exact = ExactPolynomial([np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-30]]), np.eye(2) * 2.0**-60])
    points, right = np.array([0.0j, 1j]), np.array([[0j, 0j], [1.0 + 0j, 1.0 + 0j]])
    inverse = np.array([[2.0**30 + 1.0, -(2.0**30)], [-(2.0**30), 2.0**30]])
    wrong = 1.5e-3 * np.eye(2)

    def solve(residual: ComplexArray) -> ComplexArray:
        return np.hstack([(inverse + wrong) @ residual[:, :1], 1e9 * residual[:, 1:]])

    found, _ = refined(exact, points, solve(right), right, solve)
    assert_allclose(found[:, 0], [-(2.0**30), 2.0**30], rtol=1e-15)
    assert_allclose(found[:, 1], solve(right)[:, 1])
