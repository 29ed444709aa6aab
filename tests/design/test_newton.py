"""Newton's method for many states, its starts and its judge, against closed forms and ball arithmetic."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel, lqr, mechss
from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.design.care_problem import CareProblem
from halfdof_ctrl.design.modal_basis import ModalBasis
from halfdof_ctrl.design.newton import solved_by_newton
from halfdof_ctrl.design.riccati import solved_care
from halfdof_ctrl.design.starts import STARTS_LARGE, starts
from halfdof_ctrl.reduction.energy.form import energy_form
from support.beams import beam_matrices
from support.riccati_truth import gain_of_structure

EXACT = 1e-12  # Newton's method on an extended residual leaves a few roundings
KNOWN = 1e-10  # of a beam's gain, whose stored stiffness spans ten decades
ELEMENTS = 20


def beam(*, clamped: bool, unit: float = 1.0) -> SecondOrderModel:
    """Give a beam with C = 0.2 M, driven at both ends or at the tip, forces in a unit of one's own."""
    M, K = beam_matrices(ELEMENTS, clamped=clamped)
    last = len(M) - 2
    ends = [f"F_q{last}"] if clamped else ["F_q0", f"F_q{last}"]
    return mechss(M / unit, 0.2 * M / unit, K / unit).select(ends, [end.removeprefix("F_") for end in ends])


@pytest.mark.parametrize("effort", [1e-12, 1.0])
@pytest.mark.parametrize("unit", [1e-9, 1.0])
@pytest.mark.parametrize("clamped", [True, False])
def test_gain_of_a_beam_is_that_of_its_matrices(clamped: bool, unit: float, effort: float) -> None:  # noqa: FBT001
    """M, C, K of 20 elements as they are stored, in ball arithmetic, have the gain that energy states lead to."""
    model = beam(clamped=clamped, unit=unit)
    feedback = lqr(
        model, displacement=dict.fromkeys(model.outputs, 1.0), effort=dict.fromkeys(model.inputs, effort * unit**2)
    )
    matrices = (model.M, model.C, model.K, model.B)
    to_energy = energy_form(model).T
    expected = gain_of_structure(matrices, feedback.cost.Q, feedback.cost.R, feedback.S, to_energy)
    assert_allclose(feedback.K, expected, rtol=0.0, atol=KNOWN * np.abs(expected).max())
    assert np.abs(feedback.K - expected).max() <= max(feedback.gain_error, EXACT) * np.abs(expected).max()
    assert feedback.gain_error < KNOWN


def chain_with_a_slow_mode(size: int, reach: float) -> tuple[CareProblem, FloatArray]:
    """Give fast stable states that nothing couples, and an integrator that the input reaches by little, weighted 1."""
    A = np.diag(-np.arange(1.0, size + 1.0))
    A[-1, -1] = 0.0
    B, Q = np.zeros((size, 1)), np.zeros((size, size))
    B[-1], Q[-1, -1] = reach, 1.0
    expected = np.zeros((1, size))
    expected[0, -1] = 1.0
    return CareProblem(A, B, Q, np.eye(1), np.zeros((size, 1))), expected


@pytest.mark.parametrize("size", [30, STARTS_LARGE + 4])
def test_mode_that_is_reached_by_little_has_its_gain(size: int) -> None:
    """For x' = b u and weights 1 the gain is 1, whatever b is; states that are not driven get none."""
    problem, expected = chain_with_a_slow_mode(size, 1e-7)
    found = solved_care(problem, "scipy")
    assert found is not None
    assert_allclose(found.K, expected, rtol=EXACT, atol=EXACT)


def test_start_far_off_is_followed_while_its_steps_halve() -> None:
    """From a gain of 1e8 for x' = u Newton's steps halve it 26 times, and end at 1."""
    problem = CareProblem(np.zeros((1, 1)), np.eye(1), np.eye(1), np.eye(1), np.zeros((1, 1)))
    found = solved_by_newton(problem, None, np.array([[1e8]]))
    assert found is not None
    assert_allclose(found.K, [[1.0]], rtol=EXACT)
    assert found.error < EXACT


def test_start_that_does_not_stabilize_is_none() -> None:
    """A gain of zero leaves an integrator, one that is not finite nothing."""
    problem = CareProblem(np.zeros((1, 1)), np.eye(1), np.eye(1), np.eye(1), np.zeros((1, 1)))
    assert solved_by_newton(problem, None, np.zeros((1, 1))) is None
    assert solved_by_newton(problem, None, np.full((1, 1), np.nan)) is None


def test_slowest_modes_give_the_first_start_of_many_states() -> None:
    """It stabilizes, and leaves the fast states to themselves."""
    problem, expected = chain_with_a_slow_mode(STARTS_LARGE + 4, 1.0)
    X, gain = next(iter(starts(problem, "scipy")))
    assert X is None
    assert_allclose(gain, expected, rtol=1e-6, atol=1e-12)


def test_modal_basis_solves_fast_and_slow_parts_alike() -> None:
    """F = [[-f, f], [0, -2]] and S = diag(s, t) lead to Y row by row, for f over 20 decades."""
    for f in (1e-10, 1.0, 1e10):
        s, t = 3.0 * f, 5.0
        basis = ModalBasis(np.array([[-f, f], [0.0, -2.0]]))
        found = basis.solution(basis.components(np.diag([s, t])))
        first = s / (2.0 * f)
        mixed = f * first / (2.0 + f)
        expected = [[first, mixed], [mixed, (t + 2.0 * f * mixed) / 4.0]]
        assert_allclose(found, expected, rtol=EXACT)
        assert basis.is_stable
        bound = basis.bound(np.eye(2), basis.components(np.diag([s, t])))
        assert (bound >= np.abs(found) * (1.0 - EXACT)).all()
