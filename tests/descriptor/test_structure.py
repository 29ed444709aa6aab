"""The oracle itself: eigenvalues, structure and zeros of the descriptor form against exact answers."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import exact_reduction, hydromount, mechss, pencil_structure, zeros
from halfdof_ctrl.base.errors import SingularPencilError
from halfdof_ctrl.descriptor.regularity import require_regular
from support import exact
from support.comparison import paired
from support.structures import Structure, damped_structures, structures

ROUNDOFF = 1e-11  # eigenvalues of a few well-conditioned unknowns by QZ
COMPARED = 1e-7  # random structures have eigenvalues of condition up to 1e8
MULTIPLE = 1e-3  # an eigenvalue of multiplicity k is known to eps^(1/k)


@given(structure=structures())
def test_count_of_finite_eigenvalues_is_exact(structure: Structure) -> None:
    """Their number is ``deg det P(s)``, the rest of 2n is infinite; a singular pencil is known as such."""
    order = exact.order(*structure.matrices)
    found = pencil_structure(structure.model())
    assert found.is_regular == (order >= 0)
    if order >= 0:
        assert found.finite_eigenvalues.size == order
        assert found.n_infinite == 2 * structure.size - order


@given(structure=structures())
def test_regularity_is_exact(structure: Structure) -> None:
    """`require_regular` refuses if and only if the determinant vanishes identically."""
    if exact.order(*structure.matrices) >= 0:
        require_regular(structure.model())
    else:
        with pytest.raises(SingularPencilError, match="The pencil is singular: det P") as refusal:
            require_regular(structure.model())
        assert refusal.value.dofs


@given(structure=damped_structures())
def test_eigenvalues_are_those_of_the_reduction(structure: Structure) -> None:
    """The sums of the eigenvalues and of their inverses agree with the trace of A and of its inverse."""
    A = exact_reduction(structure.model()).A
    found = pencil_structure(structure.model()).finite_eigenvalues
    assert found.size == A.shape[0]
    assume(found.size > 0)
    assert_allclose(found.sum(), np.trace(A), rtol=0.0, atol=COMPARED * np.abs(found).max())
    inverse = np.trace(np.linalg.inv(A))
    assert_allclose((1 / found).sum(), inverse, rtol=0.0, atol=COMPARED * np.abs(1 / found).max())


def test_eigenvalues_come_in_order_of_size() -> None:
    """By size, conjugates with the positive imaginary part first, in whatever units."""
    mount = hydromount()
    for factor in (1.0, 1e-3, 1e7):
        for rows in (np.ones(3), np.array([1.0, 1.0, 100.0])):
            M, C, K = (rows[:, None] * matrix for matrix in (mount.M, mount.C / factor, mount.K))
            found = pencil_structure(mechss(M / factor**2, C, K)).finite_eigenvalues / factor
            assert (np.diff(np.abs(found).round(9)) >= 0).all()
            assert found[2].imag > 0 > found[3].imag


@pytest.mark.parametrize(
    ("M", "C", "K", "index", "order"),
    [
        (np.eye(1), None, None, 0, 2),
        (None, np.eye(1), np.eye(1), 0, 1),
        (None, None, np.eye(1), 1, 0),
        (np.diag([1.0, 0.0]), None, np.array([[1.0, 1.0], [-1.0, 0.0]]), 3, 0),
        (np.diag([1.0, 1.0, 0.0]), None, np.array([[2.0, 0, 1], [0, 3, -1], [1, -1, 0]]), 3, 2),
        (np.diag([1.0, 0.0]), np.array([[0.0, 0.0], [-1.0, 0.0]]), np.array([[1.0, 1.0], [0.0, 0.0]]), 2, 1),
    ],
    ids=["mass", "damper", "spring", "held by a multiplier", "two masses tied", "velocity held by a multiplier"],
)
def test_known_structures_have_their_index(
    M: np.ndarray | None, C: np.ndarray | None, K: np.ndarray, index: int, order: int
) -> None:
    """Position constraints have index three, velocity constraints two, springs alone one."""
    found = pencil_structure(mechss(M, C, K))
    assert (found.index, found.finite_eigenvalues.size, found.is_regular) == (index, order, True)


def test_constraint_keeps_the_motion_that_it_leaves() -> None:
    """Masses 1 and 2 tied by a multiplier, springs 2 and 4: one oscillator with ``w^2 = 6/3``."""
    M, K = np.diag([1.0, 2.0, 0.0]), np.array([[2.0, 0.0, 1.0], [0.0, 4.0, -1.0], [1.0, -1.0, 0.0]])
    found = pencil_structure(mechss(M, None, K)).finite_eigenvalues
    assert_allclose(found, [np.sqrt(2) * 1j, -np.sqrt(2) * 1j], rtol=ROUNDOFF, atol=ROUNDOFF)


def test_rigid_bodies_have_double_eigenvalues_at_the_origin() -> None:
    """A free mass: two zeros, none infinite."""
    found = pencil_structure(mechss([[3.0]], None, None))
    assert_allclose(found.finite_eigenvalues, 0.0, rtol=0.0, atol=ROUNDOFF)
    assert (found.n_infinite, found.index) == (0, 0)


def test_structural_damping_moves_the_eigenvalues_off_the_conjugates() -> None:
    """``s^2 + 4 (1 + i eta) = 0``."""
    found = pencil_structure(mechss([[1]], None, [[4 + 0.8j]])).finite_eigenvalues
    assert_allclose(found**2, -4 - 0.8j, rtol=ROUNDOFF)


def test_rank_gap_of_the_mount_is_clear() -> None:
    """No rank decision of the mount is in doubt."""
    assert pencil_structure(hydromount()).gap > 1e10


@given(powers=st.lists(st.integers(-9, 9), min_size=7, max_size=7))
def test_structure_does_not_depend_on_units(powers: list[int]) -> None:
    """The mount with DOFs, equations and time in units of 10^k."""
    mount, tau = hydromount(), 10.0 ** powers[6]
    S, R = np.diag(10.0 ** np.array(powers[:3])), np.diag(10.0 ** np.array(powers[3:6]))
    found = pencil_structure(mechss(R @ mount.M @ S * tau**2, R @ mount.C @ S * tau, R @ mount.K @ S))
    plain = pencil_structure(mount)
    assert (found.n_infinite, found.index, found.is_regular) == (2, 0, True)
    desired = plain.finite_eigenvalues
    assert_allclose(paired(found.finite_eigenvalues * tau, desired), desired, rtol=COMPARED)


@given(powers=st.lists(st.integers(-9, 9), min_size=6, max_size=6))
def test_index_three_does_not_depend_on_units(powers: list[int]) -> None:
    """Two masses tied by a multiplier, in any units."""
    M, K = np.diag([1.0, 1.0, 0.0]), np.array([[2.0, 0, 1], [0, 3, -1], [1, -1, 0]])
    S, R = np.diag(10.0 ** np.array(powers[:3])), np.diag(10.0 ** np.array(powers[3:]))
    found = pencil_structure(mechss(R @ M @ S, None, R @ K @ S))
    assert (found.index, found.finite_eigenvalues.size, found.is_regular) == (3, 2, True)


# --- zeros -----------------------------------------------------------------------------------------------------


def chain(n: int, k: float = 3.0, c: float = 0.5, m: float = 2.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give n equal masses in a row, tied to each other and the first to the ground."""
    laplacian = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    laplacian[-1, -1] = 1.0
    return m * np.eye(n), c * laplacian, k * laplacian


@pytest.mark.parametrize("n", [2, 3, 4])
def test_short_chain_has_one_multiple_zero(n: int) -> None:
    """From a force on one end to the motion of the other: ``(c s + k)^(n-1)`` over the determinant."""
    found = zeros(mechss(*chain(n), np.eye(n)[:, 0], np.eye(n)[n - 1]))
    assert found.size == n - 1
    assert_allclose(found, np.full(n - 1, -6.0), rtol=MULTIPLE * 10)


@pytest.mark.parametrize("n", [5, 10, 30, 50])
def test_long_chain_keeps_the_count_of_its_zeros(n: int) -> None:
    """``(c s + k)^(n-1)``: the count is exact where the values of a multiple zero are not."""
    assert zeros(mechss(*chain(n), np.eye(n)[:, 0], np.eye(n)[n - 1])).size == n - 1


def test_undamped_chain_has_no_finite_zeros() -> None:
    """``k^(n-1)`` has no roots."""
    M, _, K = chain(4)
    assert zeros(mechss(M, None, K, np.eye(4)[:, 0], np.eye(4)[3])).size == 0


def test_zeros_of_the_mount_are_those_of_its_receptance() -> None:
    """Errata: the numerator is ``3 s^2 + 40 s + 100``."""
    found = zeros(hydromount().select(inputs="F_y", outputs="y"))
    assert_allclose(np.sort(found.real), [-10.0, -10.0 / 3.0], rtol=ROUNDOFF)
    assert_allclose(found.imag, 0.0, rtol=0.0, atol=ROUNDOFF)


def test_collocated_zeros_are_the_poles_of_the_fixed_structure() -> None:
    """Driving point: the zeros are the eigenvalues with that DOF held (an undamped chain of two)."""
    M, K = np.diag([1.0, 2.0]), np.array([[5.0, -3.0], [-3.0, 8.0]])
    found = zeros(mechss(M, None, K, [1, 0], [1, 0]))
    assert_allclose(found, [2j, -2j], rtol=ROUNDOFF, atol=ROUNDOFF)


def test_velocity_adds_a_zero_at_the_origin_and_acceleration_two() -> None:
    """``s`` and ``s^2`` times the displacement."""
    model = mechss([[1]], [[2]], [[3]])
    assert_allclose(zeros(model.select(outputs="q0_dot")), [0.0], rtol=0.0, atol=ROUNDOFF)
    assert_allclose(zeros(model.select(outputs="q0_ddot")), [0.0, 0.0], rtol=0.0, atol=MULTIPLE)


def test_square_system_with_all_signals_has_no_zeros() -> None:
    """``P(s)^-1`` never loses rank."""
    assert zeros(hydromount()).size == 0


def test_unreached_motion_stands_among_the_zeros() -> None:
    """A second oscillator that no input reaches: its poles are zeros too."""
    found = zeros(mechss(np.eye(2), None, np.diag([1.0, 9.0]), [1, 0], [1, 0]))
    assert_allclose(found, [3j, -3j], rtol=ROUNDOFF, atol=ROUNDOFF)


def test_zeros_of_a_model_with_more_outputs_are_common_ones() -> None:
    """Velocity and acceleration share the zero at the origin, with the displacement beside them none is left."""
    model = mechss([[1]], [[2]], [[3]])
    assert_allclose(zeros(model.select(outputs=["q0_dot", "q0_ddot"])), [0.0], rtol=0.0, atol=ROUNDOFF)
    assert zeros(model.select(outputs=["q0", "q0_dot"])).size == 0


def test_direct_term_moves_the_zeros() -> None:
    """``1/(s^2 + 2 s + 3) + 1/4`` is zero where ``s^2 + 2 s + 7 = 0``."""
    found = zeros(mechss([[1]], [[2]], [[3]], [[1]], [[1]], D=[[0.25]]))
    assert_allclose(found, [-1 + np.sqrt(6) * 1j, -1 - np.sqrt(6) * 1j], rtol=ROUNDOFF)


@given(structure=damped_structures(largest=5), seed=st.integers(0, 2**32 - 1))
def test_transfer_function_vanishes_at_its_zeros(structure: Structure, seed: int) -> None:
    """At a zero that is no pole, the exact transfer function is small against its surroundings."""
    i, j = np.random.default_rng(seed).integers(0, structure.size, 2)
    model = structure.model()
    model = model.select(inputs=model.inputs[int(j)], outputs=model.outputs[int(i)])
    found = zeros(model)
    poles = pencil_structure(model).finite_eigenvalues
    for zero in found:
        others = np.concatenate([poles, found[found != zero]])
        distance = np.abs(others - zero).min(initial=1.0)
        if distance < 1e-2 * (1.0 + abs(zero)):
            continue
        value, near = np.abs(exact.transfer(model, [zero, zero + 0.1 * distance]))[0, 0]
        assert value <= 1e-6 * near


# --- refusals --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("M", "K", "dofs", "words"),
    [
        (np.diag([1.0, 0.0]), np.diag([1.0, 0.0]), ("b",), "DOF b can move in any way .* nothing is attached to b"),
        (
            np.zeros((2, 2)),
            np.array([[1.0, -1.0], [-1.0, 1.0]]),
            ("a", "b"),
            "DOFs a, b can move together .* a, b float as one body",
        ),
    ],
    ids=["loose node", "massless body"],
)
def test_singular_pencil_is_refused_with_the_dofs_that_float(
    M: np.ndarray, K: np.ndarray, dofs: tuple[str, ...], words: str
) -> None:
    """Whatever floats is named."""
    model = mechss(M, None, K, dofs=["a", "b"])
    with pytest.raises(SingularPencilError, match=words) as refusal:
        zeros(model)
    assert refusal.value.dofs == refusal.value.equations == dofs
    assert not pencil_structure(model).is_regular


def test_redundant_constraint_is_a_singular_pencil() -> None:
    """The same multiplier twice: the constraint forces are undetermined."""
    M = np.diag([1.0, 1.0, 0.0, 0.0])
    K = np.zeros((4, 4))
    K[:2, :2] = np.eye(2)
    K[0, 2:] = K[2:, 0] = 1.0
    with pytest.raises(SingularPencilError, match="a constraint that stands twice") as refusal:
        require_regular(mechss(M, None, K, dofs=["a", "b", "force1", "force2"]))
    assert refusal.value.dofs == ("force1", "force2")


def test_dependent_inputs_and_outputs_count_once() -> None:
    """Two forces on and two displacements of one mass have no zero more than one force and one displacement."""
    model = mechss([[1.0, 0.0], [0.0, 0.0]], None, [[2.0, 0.0], [0.0, 1.0]], [[1, 2], [0, 0]], [[1, 0], [3, 0]])
    assert zeros(model).size == 0


def test_what_does_not_respond_keeps_its_hidden_motion_as_a_zero() -> None:
    """A mount that falls in two: y does not feel F_y1, and y2 on 500 N/m and 300 N s/m is neither driven nor seen."""
    found = zeros(hydromount(C_rs=0.0, K_v=0.0).select("F_y1", "y"))
    assert_allclose(found, [-500.0 / 300.0], rtol=ROUNDOFF)
