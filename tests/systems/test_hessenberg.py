"""Evaluation of a state space at many points: as exact as a solve a point, in roll-off and with defective A."""

import mpmath  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import mech2ss
from halfdof_ctrl.systems import hessenberg
from halfdof_ctrl.systems.hessenberg import ShiftedSolver, bounded_response, state_space_response
from halfdof_ctrl.systems.state_space_data import StateSpaceData
from support.beams import cantilever
from support.structures import on_axis

FloatArray = npt.NDArray[np.float64]

ROUNDOFF = 1e-11  # random stable systems of up to 20 states, on the imaginary axis
POINTWISE = 1e-10  # deep roll-off, each value relative to itself (design: as exact as a good peer)
DIGITS = 60  # of the multiple-precision reference


def reference(A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, s: complex) -> npt.NDArray[np.complex128]:
    """Evaluate ``C (s I - A)^-1 B + D`` in 60 digits."""
    with mpmath.workdps(DIGITS):
        shifted = mpmath.mpc(s) * mpmath.eye(A.shape[0]) - mpmath.matrix(A.tolist())
        solution = mpmath.lu_solve(shifted, mpmath.matrix(B.tolist())) if B.shape[1] == 1 else shifted**-1 * B
        value = mpmath.matrix(C.tolist()) * solution + mpmath.matrix(D.tolist())
        return np.array(value.tolist(), dtype=np.complex128)


def chain_receptance(n: int, damping: float, s: complex) -> complex:
    """Give ``(c s + 1)^(n-1) / det P(s)`` of a chain of n masses between two walls, det P by its recursion."""
    with mpmath.workdps(DIGITS):
        link = mpmath.mpf(damping) * s + 1
        diagonal = mpmath.mpc(s) ** 2 + 2 * link
        before, determinant = mpmath.mpf(1), diagonal
        for _ in range(n - 1):
            before, determinant = determinant, diagonal * determinant - link**2 * before
        return complex(link ** (n - 1) / determinant)


def stable(generator: np.random.Generator, states: int) -> FloatArray:
    """Draw a matrix with eigenvalues well in the left half plane."""
    return np.asarray(generator.standard_normal((states, states)) - 3.0 * np.sqrt(states) * np.eye(states))


@given(
    seed=st.integers(0, 2**32 - 1),
    states=st.integers(1, 20),
    inputs=st.integers(1, 4),
    outputs=st.integers(1, 4),
)
def test_values_equal_a_solve_at_each_point(seed: int, states: int, inputs: int, outputs: int) -> None:
    """Wide and tall systems against numpy's solve."""
    generator = np.random.default_rng(seed)
    A, B = stable(generator, states), generator.standard_normal((states, inputs))
    C, D = generator.standard_normal((outputs, states)), generator.standard_normal((outputs, inputs))
    points = on_axis(generator.uniform(0.0, 20.0, 7))
    values = state_space_response(A, B, C, D, points)
    for k, s in enumerate(points):
        desired = C @ np.linalg.solve(s * np.eye(states) - A, B) + D
        assert_allclose(values[:, :, k], desired, rtol=0.0, atol=ROUNDOFF * max(1.0, np.abs(desired).max()))


@pytest.mark.parametrize("size", [2, 5, 12, 13, 30])
@pytest.mark.parametrize("pole", [0.0, -1.0, -1e-3])
def test_jordan_block_is_evaluated_to_rounding(size: int, pole: float) -> None:
    """One defective eigenvalue: from the last state to the first, ``1/(s - a)^n``."""
    A = pole * np.eye(size) + np.eye(size, k=1)
    B, C = np.eye(size)[:, [-1]], np.eye(size)[[0]]
    points = on_axis(np.geomspace(0.1, 100.0, 60))
    values = state_space_response(A, B, C, np.zeros((1, 1)), points)[0, 0]
    assert_allclose(values, (points - pole) ** -float(size), rtol=POINTWISE)


@pytest.mark.parametrize("size", [6, 12])
def test_hidden_jordan_block_is_evaluated_like_by_a_solve(size: int) -> None:
    """The same block behind an orthogonal transformation, relative to its largest value."""
    turn = np.linalg.qr(np.random.default_rng(size).standard_normal((size, size)))[0]
    A = turn @ (-np.eye(size) + np.eye(size, k=1)) @ turn.T
    B, C = turn[:, [-1]], turn[:, [0]].T
    points = on_axis(np.geomspace(0.1, 10.0, 30))
    values = state_space_response(A, B, C, np.zeros((1, 1)), points)[0, 0]
    desired = np.array([reference(A, B, C, np.zeros((1, 1)), s)[0, 0] for s in points])
    assert_allclose(values, desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max())


@pytest.mark.parametrize("states", [10, 30, 60])
def test_deep_roll_off_keeps_its_digits(states: int) -> None:
    """A chain of masses, force on one end, motion of the other, far above its modes: each value to 1e-10."""
    n = states // 2
    laplacian = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-laplacian, -0.05 * laplacian]])
    B, C, D = np.eye(states)[:, [n]], np.eye(states)[[n - 1]], np.zeros((1, 1))
    points = on_axis(np.geomspace(0.01, 30.0, 12))
    values = state_space_response(A, B, C, D, points)[0, 0]
    desired = np.array([chain_receptance(n, 0.05, s) for s in points])
    assert_allclose(values, desired, rtol=POINTWISE)


@pytest.mark.parametrize("damping", [1e-3, 1e-6])
def test_resonance_is_as_sharp_as_it_is(damping: float) -> None:
    """At and beside a lightly damped pole the error is rounding over the damping."""
    A, B, C = np.array([[0.0, 1.0], [-1.0, -2.0 * damping]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    points = on_axis(1.0 + damping * np.linspace(-3.0, 3.0, 13))
    values = state_space_response(A, B, C, np.zeros((1, 1)), points)[0, 0]
    desired = 1.0 / (points**2 + 2.0 * damping * points + 1.0)
    assert_allclose(values, desired, rtol=1e-14 / damping)


def test_states_in_units_far_apart_are_balanced() -> None:
    """A system whose states are scaled by 2^(+-40) has the values of the plain one, to the last digits."""
    generator = np.random.default_rng(5)
    A, B, C = stable(generator, 8), generator.standard_normal((8, 1)), generator.standard_normal((1, 8))
    S = 2.0 ** generator.integers(-40, 41, 8)
    points = on_axis(np.geomspace(0.1, 100.0, 20))
    plain = state_space_response(A, B, C, np.zeros((1, 1)), points)
    scaled = state_space_response(A / S[:, None] * S, B / S[:, None], C * S, np.zeros((1, 1)), points)
    assert_allclose(scaled, plain, rtol=ROUNDOFF)


@pytest.mark.parametrize("inputs", [1, 3])
def test_pole_on_the_axis_is_infinite(inputs: int) -> None:
    """``inf + nan j`` at the pole, plain values beside it, wide or not."""
    A = np.array([[0.0, 1.0], [-4.0, 0.0]])
    B, C = np.array([[0.0], [1.0]]) @ np.ones((1, inputs)), np.array([[1.0, 0.0]])
    values = state_space_response(A, B, C, np.zeros((1, inputs)), on_axis([1.0, 2.0, 3.0]))
    assert np.isinf(values[:, :, 1].real).all()
    assert np.isnan(values[:, :, 1].imag).all()
    assert_allclose(values[0, 0, [0, 2]], [1 / 3, -1 / 5], rtol=ROUNDOFF)


def test_integrator_is_infinite_at_rest() -> None:
    """A pole at the origin, a single state and a double one."""
    one = state_space_response(np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)), np.zeros((1, 1)), on_axis([0.0]))
    assert np.isinf(one[0, 0, 0].real)
    A = np.array([[0.0, 1.0], [0.0, 0.0]])
    two = state_space_response(A, np.eye(2)[:, [1]], np.eye(2)[[0]], np.zeros((1, 1)), np.array([0j, 2j]))[0, 0]
    assert np.isinf(two[0].real)
    assert_allclose(two[1], -0.25, rtol=ROUNDOFF)


def test_states_that_no_input_reaches_do_not_matter() -> None:
    """Uncontrollable and unobservable parts, unstable ones among them."""
    A = np.diag([-1.0, 5.0, 0.0, -2.0])
    A[3, 1] = 7.0  # an unreached state drives a reached one
    B, C = np.array([[1.0], [0.0], [0.0], [1.0]]), np.array([[1.0, 1.0, 1.0, 1.0]])
    points = np.array([0.5j, 3j, 4.0 + 0j])
    values = state_space_response(A, B, C, np.zeros((1, 1)), points)[0, 0]
    assert_allclose(values, 1 / (points + 1) + 1 / (points + 2), rtol=ROUNDOFF)
    unseen = state_space_response(A.T, C.T, B.T, np.zeros((1, 1)), points)[0, 0]
    assert_allclose(unseen, 1 / (points + 1) + 1 / (points + 2), rtol=ROUNDOFF)


@pytest.mark.parametrize(("inputs", "outputs"), [(1, 1), (1, 2), (2, 1), (3, 3)])
def test_zero_inputs_or_outputs_give_the_direct_term(inputs: int, outputs: int) -> None:
    """B = 0 or C = 0, and no states at all."""
    D = np.arange(1.0, 1.0 + inputs * outputs).reshape(outputs, inputs)
    points = np.array([0j, 1j, 1e6j])
    for states in (0, 3):
        A = np.diag(np.full(states, -1.0))
        for B, C in (
            (np.zeros((states, inputs)), np.ones((outputs, states))),
            (np.ones((states, inputs)), np.zeros((outputs, states))),
        ):
            values = state_space_response(A, B, C, D, points)
            assert_allclose(values, np.repeat(D[:, :, None], 3, axis=2), rtol=ROUNDOFF)


def test_huge_solutions_are_scaled_down_on_the_way() -> None:
    """150 weakly linked states grow beyond the range of floats in the substitution, not in the result."""
    n = 150
    A = -np.eye(n) + np.diag(np.full(n - 1, 1e-3), -1)
    A[0, -1] = 1e-3
    B, C = np.eye(n)[:, [0]], np.eye(n)[[0]]
    points = on_axis(np.geomspace(1e-2, 1e6, 15))
    values = state_space_response(A, B, C, np.zeros((1, 1)), points)[0, 0]
    assert np.isfinite(values).all()
    assert_allclose(values, 1 / (points + 1), rtol=ROUNDOFF)


def test_batches_join_without_a_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    """Points in several batches give the values of one."""
    generator = np.random.default_rng(2)
    A, B, C = stable(generator, 6), generator.standard_normal((6, 2)), generator.standard_normal((2, 6))
    points = on_axis(np.linspace(0.0, 30.0, 41))
    whole = state_space_response(A, B, C, np.zeros((2, 2)), points)
    monkeypatch.setattr(hessenberg, "POINT_ENTRIES", 50)
    assert_allclose(state_space_response(A, B, C, np.zeros((2, 2)), points), whole, rtol=ROUNDOFF)


@given(seed=st.integers(0, 2**32 - 1), states=st.integers(1, 30))
def test_shifted_solver_solves_the_shifted_system(seed: int, states: int) -> None:
    """``Q x = (s I - A)^-1 b`` for one b and several s."""
    generator = np.random.default_rng(seed)
    A, b = stable(generator, states), generator.standard_normal(states)
    solver = ShiftedSolver(A, b)
    points = on_axis(generator.uniform(0.0, 30.0, 4))
    states_found = solver.Q @ solver.solve(points)
    for k, s in enumerate(points):
        desired = np.linalg.solve(s * np.eye(states) - A, b.astype(complex))
        assert_allclose(states_found[:, k], desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max())


@pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
@pytest.mark.parametrize("elements", [2, 6, 12])
def test_bound_is_never_below_the_error(elements: int) -> None:
    """The tip of a beam, on and beside its modes and between them: against 60 digits of the stored A, B, C."""
    data = StateSpaceData.of(mech2ss(cantilever(elements)))
    points = on_axis(np.array([0.3, 3.516, 11.0, 22.03, 61.7]))
    found = bounded_response(*data, points)
    exact = np.array([reference(*data, s)[0, 0] for s in points])
    error = float(np.abs(found.values[0, 0] / exact - 1.0).max())
    assert 1e-15 < error < found.bound < 1e4 * error


def test_growth_within_a_block_does_not_overflow() -> None:
    """States joined by 1e-40 each: (s I - A)^-1 b falls by 40 decades a state, the substitution grows by as many."""
    n = 30
    A = -np.eye(n) + 1e-40 * np.eye(n, k=-1)
    b, c = np.eye(n)[:, :1], np.eye(n)[1:2]
    values = ShiftedSolver(A, b[:, 0])
    assert_allclose((c @ values.Q @ values.solve(np.array([1j])))[0, 0], 1e-40 / (1.0 + 1j) ** 2, rtol=1e-13)


def test_what_d_cancels_is_no_part_of_a_bound() -> None:
    """The acceleration of a mass towards rest is what C x leaves of D = 1: values are off by as much as is admitted."""
    A, B = np.array([[0.0, 1.0], [-4.0, -0.5]]), np.array([[0.0], [1.0]])
    C, D = A[1:], np.ones((1, 1))
    for omega in (1e-3, 1e-5, 1e-6):
        found = bounded_response(A, B, C, D, np.array([1j * omega]))
        right = -(omega**2) / (4.0 - omega**2 + 0.5j * omega)
        assert abs(found.values[0, 0, 0] - right) <= found.bound * abs(right)
    assert bounded_response(A, B, C, D, np.array([1j])).bound < POINTWISE


def far_from(desired: npt.NDArray[np.complex128], values: npt.NDArray[np.complex128]) -> float:
    """Give the largest error, each relative to its value."""
    return float(np.abs(values / desired - 1.0).max())


@pytest.mark.parametrize("seed", [5, 9, 43])
def test_chains_that_act_one_way_keep_their_digits(seed: int) -> None:
    """Links of 1e-3 to 1e3 one way and much weaker ones back: reciprocity says far too little of the adjoint."""
    generator, n = np.random.default_rng(seed), 16
    A = -np.diag(10.0 ** generator.uniform(-2, 2, n)) + np.diag(10.0 ** generator.uniform(-3, 3, n - 1), 1)
    A += np.diag(10.0 ** generator.uniform(-6, 0, n - 1), -1)
    B, C = (np.where(generator.random(shape) < 0.3, 1.0, 0.0) for shape in ((n, 1), (1, n)))
    D, points = np.zeros((1, 1)), on_axis(np.geomspace(1e-4, 1e4, 20))
    desired = np.array([reference(A, B, C, D, s)[0, 0] for s in points])
    assert far_from(desired, state_space_response(A, B, C, D, points)[0, 0]) < POINTWISE


@pytest.mark.parametrize("states", [12, 16, 20])
def test_entries_over_many_decades_keep_their_digits(states: int) -> None:
    """Rows and columns that fall by 8 a state: far below the fast ones both x and y are too poor to be corrected."""
    place = np.arange(states)
    A = np.random.default_rng(states).standard_normal((states, states)) * 8.0 ** -np.add.outer(place, place)
    B, C, D = np.ones((states, 1)), np.ones((1, states)), np.zeros((1, 1))
    points = on_axis(np.geomspace(1e-18, 1e2, 20))
    desired = np.array([reference(A, B, C, D, s)[0, 0] for s in points])
    assert far_from(desired, state_space_response(A, B, C, D, points)[0, 0]) < POINTWISE
