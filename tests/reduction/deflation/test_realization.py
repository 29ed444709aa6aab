"""State space of any regular pencil, level by level, against closed forms and exact rational arithmetic."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.reduction.deflation.realization import in_model_units, rounding_in_model_units
from halfdof_ctrl.reduction.method.signals import StateEquations
from support.mechanisms import JERK, SNAP, blade, derivatives, hanging_chain, rod
from support.rational import rational_transfer
from support.row_systems import POINTS, SEEDS, drawn, realization, response

ComplexArray = npt.NDArray[np.complex128]
ROUNDOFF = 1e-12  # small well-conditioned models
FREQUENCIES = 1e-11  # of up to eight links, whose tensions differ by a factor of eight
TRANSFER = 1e-8  # random integer models, some of them hardly solvable: relative to the largest entry
PLENTY = np.full(12, 1e9)  # the response to each input where errors shall count by what was followed


def solved(model: SecondOrderModel) -> tuple[tuple[tuple[int, int], ...], StateEquations]:
    """Give (DOF, derivative) of the states, and the state equations in the model's units."""
    found, units = realization(model)
    return found.states, in_model_units(found, units)


def frequencies(A: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Give the sizes of the eigenvalues, sorted."""
    return np.asarray(np.sort(np.abs(np.linalg.eigvals(A))))


def test_rod_has_the_states_and_matrices_found_by_hand() -> None:
    """``3 a'' + 90 a = F_a + F_b``; the length u of the rod shifts the velocity, and drives its force by ``u''``."""
    states, equations = solved(rod())
    assert states == ((0, 0), (0, 1))
    assert_allclose(equations.A, [[0, 1], [-30, 0]], rtol=ROUNDOFF)
    assert_allclose(equations.B, np.array([[0, 0, 0], [1, 1, 30]]) / 3, rtol=ROUNDOFF)
    assert_allclose(equations.displacement.X, [[1, 0], [1, 0], [30, 0]], rtol=ROUNDOFF)
    assert_allclose(np.stack([part[2] for part in equations.displacement.U])[:, 2] * 3, [-90, 0, -2], rtol=ROUNDOFF)


@pytest.mark.parametrize("links", [1, 2, 5, 8])
def test_hanging_chain_has_the_frequencies_of_laguerre(links: int) -> None:
    """Squares of the eigenfrequencies are the zeros of the Laguerre polynomial; the states are the swings x."""
    states, equations = solved(hanging_chain(links))
    assert states == tuple((j, order) for order in (0, 1) for j in range(links))
    squares = np.polynomial.laguerre.lagroots([0] * links + [1])
    assert_allclose(frequencies(equations.A)[::2] ** 2, np.sort(squares), rtol=FREQUENCIES)


def test_velocity_constraint_leaves_the_difference_of_positions() -> None:
    """Both positions and one velocity are states; the eigenvalues are 0 and +-2j."""
    states, equations = solved(blade())
    assert states == ((0, 0), (1, 0), (0, 1))
    assert_allclose(frequencies(equations.A), [0, 2, 2], rtol=ROUNDOFF, atol=ROUNDOFF)
    assert_array_equal(equations.A[:2], [[0, 0, 1], [0, 0, 1]])


@pytest.mark.parametrize("length", [2, 3, 4, 9])
def test_chain_of_derivatives_is_a_polynomial(length: int) -> None:
    """``q_i = s^(2 i) u``: no state, one coefficient each."""
    states, equations = solved(derivatives(length))
    assert states == ()
    U = np.stack(equations.displacement.U)[:, :, 0]
    assert_array_equal(
        U, np.eye(length)[np.arange(2 * length - 1) // 2] * (np.arange(2 * length - 1) % 2 == 0)[:, None]
    )


@pytest.mark.parametrize(
    ("matrices", "places"),
    [
        (JERK, ((0, 0), (1, 0), (0, 1), (0, 2))),
        (SNAP, ((0, 0), (2, 0), (0, 1), (2, 1), (0, 2), (0, 3))),
    ],
    ids=["jerk", "snap"],
)
def test_higher_derivatives_become_states_where_they_must(
    matrices: tuple[npt.NDArray[np.float64], ...], places: tuple[tuple[int, int], ...]
) -> None:
    """Each derivative of a state is the next one, and the transfer function is the exact one."""
    model = mechss(*matrices)
    states, equations = solved(model)
    assert states == places
    for index, (j, order) in enumerate(states):
        if (j, order + 1) in states:
            assert_array_equal(equations.A[index], np.eye(len(states))[states.index((j, order + 1))])
    assert_allclose(response(equations), rational_transfer(model).at(POINTS), rtol=0.0, atol=1e-10)


@given(seed=SEEDS, size=st.integers(2, 5))
def test_transfer_function_is_exact(seed: int, size: int) -> None:
    """``q = X x + U_0 u + U_1 u' + ...`` is ``P(s)^-1`` of rational arithmetic, for any hidden constraints."""
    K, C, M = drawn(seed, size)
    exact = rational_transfer(mechss(M, C, K))
    assume(exact.order >= 0)
    states, equations = solved(mechss(M, C, K))
    assert len(states) == len(equations.A) == exact.order
    desired = exact.at(POINTS)
    assert_allclose(response(equations), desired, rtol=0.0, atol=TRANSFER * np.abs(desired).max())


@given(seed=SEEDS, size=st.integers(2, 5))
def test_errors_stay_within_what_was_followed(seed: int, size: int) -> None:
    """Every coefficient of u, u', ... differs from the exact one by no more than its bound of rounding."""
    K, C, M = drawn(seed, size)
    exact = rational_transfer(mechss(M, C, K))
    assume(exact.order >= 0)
    found, units = realization(mechss(M, C, K))
    rounding = rounding_in_model_units(found, units, PLENTY[:size], 1e-14)
    parts = exact.polynomial_part()
    bounds = rounding.displacement.U[1:]
    for k, part in enumerate(in_model_units(found, units).displacement.U[1:]):
        wanted = parts[k] if k < len(parts) else np.zeros_like(part)
        assert (np.abs(part - wanted) <= 1e-14 * bounds[k]).all()


@given(seed=SEEDS, size=st.integers(1, 5))
def test_regular_mass_needs_no_deflation(seed: int, size: int) -> None:
    """The same A, B and names as by selection: (18) is (3)."""
    generator = np.random.default_rng(seed)
    C, K = generator.integers(-3, 4, (2, size, size))
    M = np.diag(generator.integers(1, 6, size)) + np.triu(generator.integers(-2, 3, (size, size)), 1)
    states, equations = solved(mechss(M, C, K))
    selected = exact_reduction(mechss(M, C, K), method="selection")
    assert states == tuple((j, order) for order in (0, 1) for j in range(size))
    scale = np.abs(selected.A).max()
    assert_allclose(equations.A, selected.A, rtol=0.0, atol=ROUNDOFF * scale)
    assert_allclose(equations.B, selected.B, rtol=0.0, atol=ROUNDOFF * scale)


def test_first_dofs_stay_states() -> None:
    """Four equal masses in one rigid body: the first one's motion is the state, whatever the order of constraints."""
    for order in ([0, 1, 2], [2, 0, 1]):
        M, K = np.diag([1.0] * 4 + [0.0] * 3), np.diag([1.0] * 4 + [0.0] * 3)
        for row, i in enumerate(order, start=4):
            K[row, i] = K[i, row] = 1.0
            K[row, i + 1] = K[i + 1, row] = -1.0
        states, equations = solved(mechss(M, None, K))
        assert states == ((0, 0), (0, 1))
        assert_allclose(equations.A, [[0, 1], [-1, 0]], rtol=ROUNDOFF)


@pytest.mark.parametrize("share", [1e-3, 1e-6, 1e-9, 1e-12])
def test_dof_that_a_constraint_hardly_contains_stays_a_state(share: float) -> None:
    """``q0 + q1 + share q2 = 0``: to follow q2 from the others would divide by the share and lose as many digits."""
    M, K = (
        np.diag([1.0, 1, 1, 0]),
        np.array([[2, -0.3, 0.1, 1], [-0.3, 3, 0.2, 1], [0.1, 0.2, 4, share], [1, 1, share, 0]]),
    )
    model = mechss(M, None, K)
    states, equations = solved(model)
    assert states == ((0, 0), (2, 0), (0, 1), (2, 1))
    desired = rational_transfer(model).at(POINTS)
    assert_allclose(response(equations), desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max())


def test_what_is_not_connected_stays_exactly_apart() -> None:
    """Two rods side by side keep zero blocks in A, B and the way back."""
    one, M, K = rod(), np.zeros((6, 6)), np.zeros((6, 6))
    for first in (0, 3):
        M[first : first + 3, first : first + 3] = one.M * (0.3 + first)
        K[first : first + 3, first : first + 3] = one.K
    states, equations = solved(mechss(M, None, K))
    assert states == ((0, 0), (3, 0), (0, 1), (3, 1))
    assert_array_equal(equations.A[::2, 1::2], 0.0)
    assert_array_equal(equations.A[1::2, ::2], 0.0)
    assert_array_equal(equations.B[::2, 3:], 0.0)
    assert_array_equal(equations.displacement.X[:3, 1::2], 0.0)


@pytest.mark.parametrize("power", [-60, -20, 20, 60])
def test_far_units_of_time_and_inputs_are_undone(power: int) -> None:
    """Seconds of 1e-60 to 1e60, inputs of up to 1e150: the rod keeps its closed form, without an overflow."""
    tau, size, one = float(10.0**power), float(10.0 ** (5 * abs(power) // 2)), rod()
    states, equations = solved(mechss(one.M * tau**2, None, one.K, np.eye(3) * size))
    assert states == ((0, 0), (0, 1))
    assert_allclose(equations.A, np.array([[0, 1], [-30 / tau**2, 0]]), rtol=ROUNDOFF)
    assert_allclose(equations.displacement.U[2][2] / size / tau**2, [0, 0, -2 / 3], rtol=ROUNDOFF)


def test_condition_of_the_levels_is_reported() -> None:
    """``rcond`` is the smallest of the systems that were solved: here that of the constraints, nearly dependent."""
    M, K = np.diag([1.0, 1, 1, 0, 0]), np.zeros((5, 5))
    K[3:, :3] = np.array([[1, -1, 0], [1, -1, 1e-4]])
    K[:3, 3:] = K[3:, :3].T
    assert 1e-10 < realization(mechss(M, None, K + np.diag([1.0, 2, 3, 0, 0])))[0].rcond < 1e-7
    assert realization(rod())[0].rcond > 0.01
