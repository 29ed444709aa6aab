"""Equation (3), one solve for everything, by hand and against exact rational arithmetic."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mechss
from halfdof_ctrl.reduction.algebra.leading_matrix import LeadingMatrix
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.dense.single_solve import leading_columns, rounding_of_solve, solved_at_once
from halfdof_ctrl.reduction.method.signals import Rounding, StateEquations
from support import exact
from support.anykinds import mixed, signals
from support.rational import rational_transfer
from support.row_systems import POINTS, response
from support.structures import Structure, structures

FloatArray = npt.NDArray[np.float64]
ROUNDOFF = 1e-13  # the mount
TRANSFER = 1e-10  # design, section 7, beside what rcond(W) announces
EPS = float(np.finfo(float).eps)
LOSS = 64  # times eps / rcond(W): what the solve of (3) may lose where W is ill-conditioned


def solve(model: SecondOrderModel, partition: DofPartition) -> tuple[LeadingMatrix, StateEquations]:
    """Factorize W and solve (3)."""
    leading = LeadingMatrix.factorized(leading_columns(model, partition))
    return leading, solved_at_once(model, partition, leading)


def bound(model: SecondOrderModel) -> tuple[StateEquations, Rounding]:
    """Give the equations by selection and what they are known to."""
    partition = select_columns(model)
    leading, equations = solve(model, partition)
    return equations, rounding_of_solve(model, partition, leading, equations)


def test_mount_by_hand() -> None:
    """W, A, B and the way back of the documentation's example: y inertial, y1 and y2 half."""
    model = hydromount().select(inputs=["F_y", "F_y1", "F_y2"])
    partition = select_columns(model)
    assert_array_equal(leading_columns(model, partition), [[20, -100, 0], [0, 100, 0], [0, 0, 300]])
    equations = solve(model, partition)[1]
    A = np.array([[0, 0, 0, 1], [0, -10, 0, 1], [5 / 3, 0, -10 / 3, 0], [-275, -50, 25, 0]])
    B = np.array([[0, 0, 0], [0, 0.01, 0], [0, 0, 1 / 300], [0.05, 0.05, 0]])
    assert_allclose(equations.A, A, rtol=ROUNDOFF)
    assert_allclose(equations.B, B, rtol=ROUNDOFF)
    assert_array_equal(equations.displacement.X, np.eye(3, 4))
    assert equations.displacement.U == ()
    assert equations.shift == ()


def test_static_dof_follows_force_and_neighbour() -> None:
    """``q1 = (4 q0 + F) / 5`` between springs of 4 and 1 N/m, kappa of the documentation."""
    model = mechss(np.diag([1, 0]), None, [[4, -4], [-4, 5]])
    equations = solve(model, select_columns(model))[1]
    assert_allclose(equations.displacement.X, np.array([[1, 0], [0.8, 0]]), rtol=ROUNDOFF)
    assert_allclose(equations.displacement.U[0], np.array([[0, 0], [0, 0.2]]), rtol=ROUNDOFF)
    assert_allclose(equations.A, np.array([[0, 1], [-0.8, 0]]), rtol=ROUNDOFF)


@pytest.mark.parametrize("size", [3, 40])
def test_what_inputs_do_at_once_has_no_negative_zeros(size: int) -> None:
    """Static DOFs of negative stiffness, as pressures are, answer the forces on others by 0, not by -0."""
    stiffness = -np.eye(size)
    stiffness[0, 0] = 5.0
    output = exact_reduction(mechss(np.diag([1.0] + [0.0] * (size - 1)), None, stiffness)).output
    assert_array_equal(output.direct(size), np.diag([0.0] + [-1.0] * (size - 1)))
    assert not np.signbit(output.direct(size)[output.direct(size) == 0.0]).any()
    assert not np.signbit(output.X[output.X == 0.0]).any()


@pytest.mark.parametrize("kind", ["Bv", "Ba"])
def test_derivatives_of_inputs_are_absorbed(kind: str) -> None:
    """``2 q'' + 3 q' + 5 q`` under u' or u'': (5) shifts the state by E_0, and by E_1 for u''."""
    model = mechss([[2]], [[3]], [[5]], [0], **{kind: [1]})  # type: ignore[arg-type]
    equations = solve(model, select_columns(model))[1]
    shifts = [[[0.0, 0.5]], [[0.5, -0.75], [0.0, 0.5]]][kind == "Ba"]
    B = [[0.5, -0.75], [-0.75, 9 / 8 - 5 / 4]][kind == "Ba"]
    assert_allclose(np.stack(equations.shift)[:, :, 0], shifts, rtol=ROUNDOFF)
    assert_allclose(equations.B[:, 0], B, rtol=ROUNDOFF)
    s = POINTS
    desired = s ** (1 if kind == "Bv" else 2) / (2 * s**2 + 3 * s + 5)
    assert_allclose(response(equations)[0, 0], desired, rtol=ROUNDOFF)


@given(structure=structures(largest=6), mixed=st.booleans())
def test_transfer_function_is_exact(structure: Structure, mixed: bool) -> None:  # noqa: FBT001
    """``q = X (s I - A)^-1 B + U_0`` is ``P(s)^-1``, with selected DOFs and with mixed coordinates."""
    assume(not exact.leading_matrix_is_singular(*structure.matrices))
    model = structure.model()
    partition = orthonormal_bases(model) if mixed else select_columns(model)
    assume(not LeadingMatrix.factorized(leading_columns(model, partition)).is_singular)
    leading, equations = solve(model, partition)
    desired = rational_transfer(model).at(POINTS)
    allowed = TRANSFER + LOSS * EPS / leading.rcond
    assert_allclose(response(equations), desired, rtol=0.0, atol=allowed * np.abs(desired).max())


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 4))
def test_rounding_bound_covers_the_exact_answer(seed: int, size: int) -> None:
    """With inputs and their first and second derivatives, B differs from the exact one of (5) by less."""
    generator = np.random.default_rng(seed)
    C, K = generator.integers(-3, 4, (2, size, size))
    B = generator.integers(-3, 4, (3, size, 2))
    M = np.diag(generator.integers(1, 6, size)) + np.triu(generator.integers(-2, 3, (size, size)), 1)
    model = mechss(M, C, K, B[0], Bv=B[1], Ba=B[2])
    equations, rounding = bound(model)
    inverse, damping, stiffness = (exact.rational_matrix(matrix) for matrix in (M, C, K))
    inverse = inverse.inv()
    force, drag, push = (inverse * exact.rational_matrix(part) for part in B)
    upper = drag - inverse * damping * push  # the rows of q and of q' in B of the state space, by (5)
    lower = force - inverse * stiffness * push - inverse * damping * upper
    for wanted, rows in ((upper, slice(None, size)), (lower, slice(size, None))):
        values = [[float(exact.fraction(wanted[i, j])) for j in range(2)] for i in range(size)]
        assert (np.abs(equations.B[rows] - values) <= rounding.relative * rounding.B[rows]).all()


def test_rounding_grows_with_the_condition_of_the_leading_matrix() -> None:
    """Masses that share an acceleration to 1e-6: a force on one is known to 1e-6 of eps less."""
    masses = [np.array([[1.0, 1.0], [1.0, 1.0 + share]]) for share in (1.0, 1e-6)]
    rounding = [bound(mechss(M, np.eye(2), np.eye(2), np.eye(2)))[1] for M in masses]
    assert rounding[1].B[2:].max() > 1e5 * rounding[0].B[2:].max()


@given(powers=st.lists(st.integers(-9, 9), min_size=6, max_size=6))
def test_rounding_is_the_same_in_any_units(powers: list[int]) -> None:
    """DOFs and equations in units of 10^k: the bounds are those of the model, scaled, to a factor of four."""
    mount = hydromount().select(inputs=["F_y", "F_y1", "F_y2"])
    columns, rows = 10.0 ** np.array(powers[:3]), 10.0 ** np.array(powers[3:])
    scaled = [rows[:, None] * matrix * columns for matrix in (mount.M, mount.C, mount.K)]
    plain, other = bound(mount)[1], bound(mechss(scaled[0], scaled[1], scaled[2], np.diag(rows)))[1]
    states = columns[[0, 1, 2, 0]]
    known = plain.B > 0.0  # y2 stands alone in W, and has no rounding errors in common with the others
    assert_array_equal(other.B > 0.0, known)
    assert known.any(axis=1).tolist() == [False, True, True, True]
    ratio = (other.B * states[:, None])[known] / plain.B[known]
    assert 0.25 <= ratio.min() <= ratio.max() <= 4.0


def test_parts_that_the_leading_matrix_does_not_connect_share_no_errors() -> None:
    """A force of 1e9 N on one mass and of 1 N on another, by one input: each acceleration is known by itself."""
    rounding = bound(mechss(np.diag([1.0, 2.0]), None, np.eye(2), [[1e9], [1.0]]))[1]
    assert_allclose(rounding.B[2:, 0], [1e9, 0.5], rtol=1e-12)


def test_rounding_of_the_way_back_counts() -> None:
    """``q1`` is static and follows nothing but q0; what it follows is as large as that, whatever cancels."""
    model = mechss(np.diag([1.0, 0.0]), None, [[4.0, -4.0], [-4.0, 5.0]])
    partition = select_columns(model)
    leading, equations = solve(model, partition)
    rounding = rounding_of_solve(model, partition, leading, equations)
    assert (np.abs(equations.displacement.X) <= rounding.displacement.X).all()
    assert rounding.displacement.X[1, 0] >= 0.8


def test_coefficient_that_cancels_in_the_way_back_is_dropped() -> None:
    """Accelerations of dense equations in which a multiplier follows exactly no velocity: no channel is improper."""
    generator = np.random.default_rng([140000655, 11])
    structure = mixed(generator, 11)
    model = signals(generator, structure)
    reduction = exact_reduction(model, method="selection")
    assert not rational_transfer(model).polynomial_part()
    assert reduction.polynomial_part == ()
