"""The exact reduction against exact rational arithmetic, its invariances, and the way back to all DOFs."""

import control
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import ExactReduction, SecondOrderModel, exact_reduction, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    InconsistentStateError,
    MatrixError,
    ParameterError,
    SignalNameError,
    SingularLeadingMatrixError,
    SingularPencilError,
)
from halfdof_ctrl.reduction.dense.partition import DofPartition
from support import exact, outcome
from support.comparison import POINTS, assert_same_transfer, response
from support.structures import (
    Structure,
    damped_structures,
    gyroscopic,
    null_columns,
    on_axis,
    passive,
    rank_deficient,
    semidefinite,
    structures,
)

EPS = float(np.finfo(float).eps)
TRANSFER = 1e-10  # design, section 7: random structures, n <= 12, relative to the channel
LOSS = 64  # times eps / rcond(W): what the solve of (3) may lose where W is ill-conditioned
DERIVATIVES = 16  # times eps / rcond(W)^2: two derivatives of the input multiply by A twice, and cancel
METAMORPHIC = 1e-9  # the transformed model is rounded once more, in every entry
ROUNDOFF = 1e-12  # a few operations on well-conditioned small matrices
RESIDUAL = 1e-9  # of the equation of motion, relative to the largest force; python-control integrates by expm


def reduced(structure: Structure) -> ExactReduction:
    """Reduce, or drop the example after confirming exactly that the refusal is honest."""
    try:
        reduction = exact_reduction(structure.model())
    except SingularPencilError:
        assert exact.order(*structure.matrices) < 0, "the pencil is regular: a false refusal"
        assume(False)  # noqa: FBT003
        raise
    assert (reduction.method == "deflation") == exact.leading_matrix_is_singular(*structure.matrices)
    return reduction


def conditioning(reduction: ExactReduction) -> float:
    """Give what the evidence announces: rcond(W), or the spread of the singular values that count if that is worse."""
    spreads = [
        item.singular_values[item.rank - 1] / item.singular_values[0] for item in reduction.evidence if item.rank
    ]
    return float(min([reduction.rcond, *spreads]))


@given(structure=structures())
def test_order_is_the_degree_of_the_determinant(structure: Structure) -> None:
    """The number of states is ``deg det P(s)`` in exact arithmetic, or W is exactly singular."""
    assert reduced(structure).order == exact.order(*structure.matrices)


@given(structure=structures(rank_deficient, gyroscopic, null_columns, largest=3))
def test_order_of_small_structures_is_exact(structure: Structure) -> None:
    """With few DOFs and small integers W is often exactly singular, or nearly so by rounding: never accepted."""
    assert reduced(structure).order == exact.order(*structure.matrices)


@pytest.mark.parametrize(
    ("M", "C", "K"),
    [
        ([[0, 0], [-2, -2]], [[0, 0], [0, 0]], [[-2, -2], [-1, 1]]),
        ([[4, -4], [0, 0]], [[2, -2], [0, 0]], [[-4, 0], [-1, 1]]),
        ([[0, 0], [0, 0]], [[0, 0], [-2, 2]], [[-2, 2], [-4, -2]]),
        ([[2, -2], [0, 0]], [[0, 3], [6, -6]], [[-1, 0], [-2, -3]]),
        ([[-2, 2], [0, 0]], [[-1, 1], [1, -1]], [[-2, -4], [2, -2]]),
        ([[0, 0], [0, 0]], [[3, -3], [1, -1]], [[0, 0], [4, -4]]),
    ],
)
def test_rounding_in_null_vectors_does_not_hide_a_singular_leading_matrix(
    M: list[list[int]], C: list[list[int]], K: list[list[int]]
) -> None:
    """W is exactly singular; only rounding of C T_c or K T_k, scaled, makes it look regular."""
    assert exact.leading_matrix_is_singular(M, C, K)
    with pytest.raises(SingularLeadingMatrixError, match="singular to working precision"):
        exact_reduction(mechss(M, C, K), method="orthogonal")


@pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
@pytest.mark.filterwarnings(r"ignore:The model has \d+ free motion:halfdof_ctrl.errors.LostDigitsWarning")
@given(structure=structures())
def test_transfer_function_equals_exact_rational_arithmetic(structure: Structure) -> None:
    """Each channel of the state space is the exact ``P(s)^-1`` to 1e-10, or what rcond(W) announces."""
    reduction = reduced(structure)
    desired = exact.transfer(structure.model(), POINTS)
    assert_same_transfer(response(mech2ss(reduction)), desired, TRANSFER + LOSS * EPS / conditioning(reduction))


@given(structure=structures(passive))
def test_passive_pencil_is_regular_if_and_only_if_nothing_floats(structure: Structure) -> None:
    """Theorem: for semidefinite M, C, K, W is nonsingular iff null(M), null(C), null(K) share nothing."""
    nothing_floats = exact.rank(*structure.matrices) == structure.size
    assert (exact.order(*structure.matrices) >= 0) == nothing_floats
    assert exact.leading_matrix_is_singular(*structure.matrices) != nothing_floats
    if nothing_floats:
        assert exact_reduction(structure.model()).order == exact.order(*structure.matrices)
    else:
        with pytest.raises(SingularPencilError, match="The pencil is singular"):
            exact_reduction(structure.model())


@given(structure=structures(passive))
def test_passive_order_is_rank_m_plus_rank_m_c(structure: Structure) -> None:
    """Theorem: the order is ``rank M + rank [M C]``, and the receptance stays bounded (index at most one)."""
    assume(exact.rank(*structure.matrices) == structure.size)
    order = exact.rank(structure.M) + exact.rank(structure.M, structure.C)
    assert exact.order(*structure.matrices) == order
    reduction = outcome.reduced(structure.model())
    assert reduction.order == order
    assert reduction.index <= 1
    assert exact.growth(structure.model()).max() <= 0


@given(structure=structures(largest=6))
def test_both_methods_give_the_same_transfer_function(structure: Structure) -> None:
    """Where selection of DOFs suffices, orthonormal bases give the same order and transfer function."""
    reduction = reduced(structure)
    assume(reduction.method == "selection")
    mixed = exact_reduction(structure.model(), method="orthogonal")
    assert (mixed.method, mixed.order) == ("orthogonal", reduction.order)
    loss = LOSS * EPS / min(reduction.rcond, mixed.rcond)
    assert_same_transfer(response(mech2ss(mixed)), response(mech2ss(reduction)), TRANSFER + loss)


@pytest.mark.parametrize("dof", [0, 1])
def test_load_on_a_massless_dof_through_a_damper(dof: int) -> None:
    """Another package has a sign error here (neighbourhood 2.2): at rest ``K^-1 e``, elsewhere ``P(s)^-1 e``."""
    M, C, K = np.diag([1.0, 0.0]), np.array([[5.0, -5.0], [-5.0, 5.0]]), np.array([[2e3, -1e3], [-1e3, 3e3]])
    sys = mech2ss(M, C, K, np.eye(2)[:, [dof]])
    assert sys.nstates == 3
    assert_allclose(sys(0).ravel(), np.linalg.solve(K, np.eye(2)[:, dof]), rtol=ROUNDOFF)
    s = on_axis(np.geomspace(1e-2, 1e5, 50))
    exact_values = exact.transfer(mechss(M, C, K, np.eye(2)[:, [dof]]), s)
    assert_same_transfer(response(sys, s), exact_values, ROUNDOFF)


def test_load_on_a_massless_dof_has_the_published_static_answer() -> None:
    """``K^-1 e_2`` is (2e-4, 4e-4); the faulty package gives (-1e-3, 0)."""
    sys = mech2ss(np.diag([1.0, 0.0]), [[5, -5], [-5, 5]], [[2e3, -1e3], [-1e3, 3e3]], [[0], [1]])
    assert_allclose(sys.dcgain().ravel(), [2e-4, 4e-4], rtol=ROUNDOFF)


POWERS = st.lists(st.integers(-9, 9), min_size=8, max_size=8)


@pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
@given(structure=damped_structures(), columns=POWERS, rows=POWERS)
def test_units_of_dofs_and_equations_change_nothing(structure: Structure, columns: list[int], rows: list[int]) -> None:
    """DOFs in units of 10^k, equations multiplied by 10^l: same kinds of DOF, same transfer function."""
    n = structure.size
    S, R = np.diag(10.0 ** np.array(columns[:n])), np.diag(10.0 ** np.array(rows[:n]))
    scaled = mechss(*structure.transformed(R, S), R, S)
    plain, other = exact_reduction(structure.model()), exact_reduction(scaled)
    assert other.states == plain.states
    assert (other.order, other.method) == (plain.order, plain.method)
    assert_same_transfer(response(mech2ss(other)), response(mech2ss(plain)), METAMORPHIC)


@given(structure=structures(passive, largest=6), columns=POWERS, rows=POWERS)
def test_units_do_not_change_rank_decisions_of_mixed_coordinates(
    structure: Structure, columns: list[int], rows: list[int]
) -> None:
    """Orthonormal bases find the same counts of coordinates in any units."""
    plain = reduced(structure)
    n = structure.size
    S, R = np.diag(2.0 ** np.array(columns[:n])), np.diag(2.0 ** np.array(rows[:n]))
    scaled = mechss(*structure.transformed(R, S))
    assert exact_reduction(scaled, method="orthogonal").order == plain.order


@pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
@given(structure=damped_structures(), power=st.integers(-9, 9))
def test_unit_of_time_moves_only_the_frequency(structure: Structure, power: int) -> None:
    """``M tau^2, C tau`` has the transfer function of ``M, C`` at ``tau s``."""
    tau = 10.0**power
    M, C, K = structure.matrices
    sys, slow = mech2ss(M, C, K), mech2ss(M * tau**2, C * tau, K)
    assert_same_transfer(response(slow, np.asarray(POINTS / tau)), response(sys), METAMORPHIC)


@given(structure=damped_structures(), seed=st.integers(0, 2**32 - 1))
def test_congruence_changes_nothing(structure: Structure, seed: int) -> None:
    """``T^T M T`` with an integer T of determinant one has the order and, through T, the transfer function."""
    generator = np.random.default_rng(seed)
    n = structure.size
    T = np.eye(n)
    for _ in range(n):
        i, j = generator.integers(0, n, 2)
        T[i] += 0 if i == j else int(generator.integers(-1, 2)) * T[j]
    plain = exact_reduction(structure.model())
    mixed = exact_reduction(mechss(*structure.transformed(T.T, T), T.T, T))
    assert mixed.order == plain.order
    assert_same_transfer(response(mech2ss(mixed)), response(mech2ss(plain)), METAMORPHIC)


@given(structure=damped_structures(smallest=2), seed=st.integers(0, 2**32 - 1))
def test_order_of_dofs_and_signals_permutes_the_channels(structure: Structure, seed: int) -> None:
    """Permuted DOFs, inputs and outputs permute rows and columns of the transfer function."""
    generator = np.random.default_rng(seed)
    shuffle, causes, effects = (generator.permutation(structure.size) for _ in range(3))
    plain = response(mech2ss(structure.model()))
    unit = np.eye(structure.size)
    matrices = structure.transformed(unit[shuffle], unit[:, shuffle])
    permuted = mech2ss(*matrices, unit[shuffle][:, causes], unit[effects][:, shuffle])
    assert_same_transfer(response(permuted), plain[np.ix_(effects, causes)], METAMORPHIC)


@given(structure=damped_structures(), place=st.integers(0, 7), stiffness=st.integers(1, 1000))
def test_static_node_in_a_spring_changes_nothing(structure: Structure, place: int, stiffness: int) -> None:
    """A ground spring k split into two of 2k by a massless node gives the transfer function of the one spring."""
    n, i = structure.size, place % structure.size
    M, C, K = (np.pad(matrix, (0, 1)) for matrix in structure.matrices)
    K[i, i] += 2 * stiffness
    K[n, n] += 4 * stiffness
    K[i, n] = K[n, i] = -2 * stiffness
    split = mech2ss(M, C, K, np.eye(n + 1, n), np.eye(n, n + 1))
    whole = structure.K.copy()
    whole[i, i] += stiffness
    assert_same_transfer(response(split), response(mech2ss(structure.M, structure.C, whole)), METAMORPHIC)


@given(structure=damped_structures(), seed=st.integers(0, 2**32 - 1))
def test_response_at_rest_is_the_flexibility(structure: Structure, seed: int) -> None:
    """``H(0) = F K^-1 B + D``."""
    generator = np.random.default_rng(seed)
    B, F, D = (generator.integers(-3, 4, shape) for shape in ((structure.size, 2), (3, structure.size), (3, 2)))
    sys = mech2ss(*structure.matrices, B, F, D=D)
    desired = F @ np.linalg.solve(structure.K, B) + D
    assert_allclose(response(sys, on_axis([0.0]))[:, :, 0], desired, rtol=0.0, atol=METAMORPHIC * 10)


def prescribed(structure: Structure, dof: int) -> SecondOrderModel:
    """Make DOF g's motion the input: ``B(s) = -P_fg(s)``; outputs all free displacements and the reaction."""
    free = [i for i in range(structure.size) if i != dof]
    M, C, K = structure.matrices
    n = len(free)
    unit, zero = np.eye(n), np.zeros((n, n))
    return mechss(
        M[np.ix_(free, free)],
        C[np.ix_(free, free)],
        K[np.ix_(free, free)],
        -K[free, dof],
        np.vstack([unit, K[[dof]][:, free]]),
        np.vstack([zero, C[[dof]][:, free]]),
        H=np.vstack([zero, M[[dof]][:, free]]),
        Bv=-C[free, dof],
        Ba=-M[free, dof],
        D=[0] * n + [K[dof, dof]],
        Dv=[0] * n + [C[dof, dof]],
        Da=[0] * n + [M[dof, dof]],
    )


@pytest.mark.filterwarnings("ignore:The state space is exact")
@given(structure=structures(smallest=2, largest=7), dof=st.integers(0, 6))
def test_input_derivatives_are_absorbed_where_the_output_is_proper(structure: Structure, dof: int) -> None:
    """With Bv, Ba, Dv, Da the state space equals the exact model(s) on every proper channel."""
    model = prescribed(structure, dof % structure.size)
    assume(exact.order(model.M, model.C, model.K) >= 0)
    assume(not exact.leading_matrix_is_singular(model.M, model.C, model.K))
    proper = np.flatnonzero(exact.growth(model)[:, 0] <= 0)
    assume(proper.size > 0)
    model = model.select(outputs=[model.outputs[i] for i in proper])
    reduction = exact_reduction(model)
    desired = exact.transfer(model, POINTS)
    assert_same_transfer(
        response(mech2ss(reduction)), desired, TRANSFER + DERIVATIVES * EPS / conditioning(reduction) ** 2
    )


@given(structure=structures(smallest=2, largest=7), dof=st.integers(0, 6))
def test_reaction_to_a_prescribed_motion_is_the_inverse_receptance(structure: Structure, dof: int) -> None:
    """The dynamic stiffness at g from model(s) is one over the receptance at g, in exact arithmetic too."""
    g = dof % structure.size
    model = prescribed(structure, g)
    assume(exact.order(model.M, model.C, model.K) >= 0)
    assume(exact.order(*structure.matrices) >= 0)
    receptance = exact.transfer(structure.model(), POINTS)[g, g]
    reaction = exact.transfer(model, POINTS)[-1, 0]
    assert_allclose(reaction * receptance, np.ones(POINTS.size), rtol=ROUNDOFF)


def test_prescribed_motion_of_the_mount_has_the_published_dynamic_stiffness() -> None:
    """Errata: ``500 (39 s^2 + 455 s + 1050) / ((s + 10)(3 s + 10))``, from 5250 N/m to 6500 N/m."""
    mount = hydromount()
    structure = Structure("mount", *(np.asarray(matrix).astype(np.int64) for matrix in (mount.M, mount.C, mount.K)))
    model = prescribed(Structure("mount", 0 * structure.M, structure.C, structure.K), 0)
    sys = mech2ss(model.select(outputs=model.outputs[-1]))
    s = 1j * np.geomspace(1e-3, 1e5, 60)
    desired = 500 * (39 * s**2 + 455 * s + 1050) / ((s + 10) * (3 * s + 10))
    assert_allclose(sys(s), desired, rtol=ROUNDOFF)
    assert_allclose(float(sys.D[0, 0]), 6500.0, rtol=ROUNDOFF)


def test_shift_of_the_state_follows_equation_5() -> None:
    """A mass dragged by a prescribed motion through a damper: ``x = x~ + E_0 u`` with ``E_0 = (0, c/m)``."""
    reduction = exact_reduction(mechss([[2]], [[3]], [[5]], [0], Bv=[3]))
    assert len(reduction.shift) == 1
    assert_allclose(reduction.shift[0], [[0.0], [1.5]], rtol=ROUNDOFF)
    s = POINTS
    assert_allclose(mech2ss(reduction)(s), 3 * s / (2 * s**2 + 3 * s + 5), rtol=ROUNDOFF)


def test_structure_without_any_dynamics_has_no_states() -> None:
    """Springs alone: no states, and the flexibility as direct term."""
    K = np.array([[3.0, -1.0], [-1.0, 2.0]])
    reduction = exact_reduction(mechss(None, None, K))
    assert (reduction.order, reduction.n_infinite, reduction.index) == (0, 4, 1)
    assert_allclose(reduction.displacement.U[0], np.linalg.inv(K), rtol=ROUNDOFF)


def test_evidence_is_printed() -> None:
    """The repr tells the method, the count and the DOFs of each kind."""
    text = repr(exact_reduction(hydromount()))
    assert "by selection: 4 states, 2 infinite eigenvalues removed, index 0" in text
    assert "inertial: y\n" in text
    assert "half:     y1, y2\n" in text
    assert "static:   -" in text


def test_mixed_coordinates_are_named_and_recovered() -> None:
    """One mass moving with the mean of two DOFs: one mixed coordinate with mass, all DOFs recovered."""
    structure = Structure("bar", np.ones((2, 2), dtype=np.int64), np.eye(2, dtype=np.int64), 3 * np.eye(2, dtype=int))
    reduction = exact_reduction(structure.model())
    assert reduction.method == "orthogonal"
    assert reduction.states == ("mix0", "mix1", "mix0_dot")
    assert_same_transfer(response(mech2ss(reduction)), exact.transfer(structure.model(), POINTS), ROUNDOFF)


def test_alpha_and_gamma_are_rows_of_the_inverse_leading_matrix() -> None:
    """With mixed coordinates too, ``gamma M T_i = 1``, ``alpha C T_c = 1``, the other products zero."""
    generator = np.random.default_rng(3)
    M, C, K = semidefinite(generator, 5, 2), semidefinite(generator, 5, 4), semidefinite(generator, 5, 5)
    reduction = exact_reduction(mechss(M, C, K))
    part = reduction.partition
    assert isinstance(part, DofPartition)
    T_i, T_c = part.T[:, : part.n_inertial], part.T[:, part.n_inertial : part.n_inertial + part.n_half]
    assert_allclose(reduction.gamma @ M @ T_i, np.eye(part.n_inertial), rtol=0.0, atol=ROUNDOFF)
    assert_allclose(reduction.alpha @ C @ T_c, np.eye(part.n_half), rtol=0.0, atol=ROUNDOFF)
    assert_allclose(reduction.gamma @ C @ T_c, 0.0, rtol=0.0, atol=ROUNDOFF)
    assert_allclose(reduction.alpha @ M @ T_i, 0.0, rtol=0.0, atol=ROUNDOFF)


# --- initial states and the way back ---------------------------------------------------------------------------


@given(structure=damped_structures(), seed=st.integers(0, 2**32 - 1))
def test_state_is_found_again_from_its_displacements_and_velocities(structure: Structure, seed: int) -> None:
    """``state(q, v, u)`` of the q, v that a state and inputs give is that state."""
    generator = np.random.default_rng(seed)
    reduction = exact_reduction(structure.model())
    x, u = generator.standard_normal(reduction.order), generator.standard_normal(structure.size)
    q, v = reduction.motion(0), reduction.motion(1)
    q0, v0 = q.X @ x + q.direct(u.size) @ u, v.X @ x + v.direct(u.size) @ u
    assert_allclose(reduction.state(q0, v0, u), x, rtol=0.0, atol=METAMORPHIC)


@given(structure=damped_structures(), seed=st.integers(0, 2**32 - 1))
def test_wrong_displacement_of_a_static_dof_is_refused_by_name(structure: Structure, seed: int) -> None:
    """A static displacement off by a tenth contradicts its equation; the error holds both values."""
    reduction = exact_reduction(structure.model())
    assume(reduction.partition.static)
    x = np.random.default_rng(seed).standard_normal(reduction.order)
    q0 = reduction.displacement.X @ x
    place = structure.model().dofs.index(reduction.partition.static[0])
    wrong = q0.copy()
    wrong[place] += 0.1
    with pytest.raises(InconsistentStateError, match=rf"{reduction.partition.static[0]} = .* \(must be ") as refusal:
        reduction.state(wrong)
    assert refusal.value.names == (reduction.partition.static[0],)
    assert_allclose(refusal.value.given, wrong[[place]], rtol=ROUNDOFF)
    assert_allclose(refusal.value.required, q0[[place]], rtol=0.0, atol=METAMORPHIC)


def test_half_dof_velocity_follows_from_the_damper() -> None:
    """A damper 5 against a spring 10 at q = 1 must move at -2; -1 is refused."""
    reduction = exact_reduction(mechss([[0]], [[5]], [[10]], dofs="piston"))
    assert_allclose(reduction.state([1.0], [-2.0]), [1.0], rtol=ROUNDOFF)
    with pytest.raises(InconsistentStateError, match=r"piston_dot = -1 \(must be -2\)"):
        reduction.state([1.0], [-1.0])


def test_inputs_enter_the_consistency_of_initial_values() -> None:
    """The same piston under its holding force of 10 N stands still."""
    reduction = exact_reduction(mechss([[0]], [[5]], [[10]], dofs="piston"))
    assert_allclose(reduction.state([1.0], [0.0], u0=10.0), [1.0], rtol=ROUNDOFF)
    with pytest.raises(InconsistentStateError, match="or give u0"):
        reduction.state([1.0], [0.0])


def test_open_values_are_left_to_the_equations() -> None:
    """Missing names and NaN are zero where they are states and follow from the equations elsewhere."""
    reduction = exact_reduction(hydromount())
    assert_allclose(reduction.state({"y": 0.01}, {"y": -0.2}), [0.01, 0.0, 0.0, -0.2], rtol=ROUNDOFF)
    assert_allclose(reduction.state([0.01, np.nan, 0.002]), [0.01, 0.0, 0.002, 0.0], rtol=ROUNDOFF)


def test_state_of_a_model_with_shift_is_the_shifted_one() -> None:
    """``x~ = x - E_0 u``: the velocity state of the dragged mass is v - (c/m) u."""
    reduction = exact_reduction(mechss([[2]], [[3]], [[5]], [0], Bv=[3]))
    assert_allclose(reduction.state([0.1], [0.7], u0=[0.4]), [0.1, 0.7 - 1.5 * 0.4], rtol=ROUNDOFF)


def test_unknown_dof_in_initial_values_is_refused() -> None:
    """The error lists the DOFs that there are."""
    with pytest.raises(SignalNameError, match=r"no DOF 'z'. Known: y, y1, y2"):
        exact_reduction(hydromount()).state({"z": 1.0})


@pytest.mark.parametrize("tol", [float("nan"), -1.0, 2.0, float("inf"), "small"])
def test_tolerance_that_is_no_small_number_is_refused(tol: object) -> None:
    """With NaN or 2 every mass would count as none."""
    with pytest.raises(ParameterError, match="tol"):
        exact_reduction(hydromount(), tol=tol)  # type: ignore[arg-type]


def test_free_motion_is_recovered() -> None:
    """python-control's initial_response has no inputs in it; all DOFs follow all the same."""
    model = hydromount()
    reduction, time = exact_reduction(model), np.linspace(0, 1, 20)
    data = control.initial_response(mech2ss(model), time, reduction.state({"y": 0.01}))
    motion = reduction.recover(data)
    assert_allclose(motion.displacement, data.y, rtol=0.0, atol=ROUNDOFF)
    assert_allclose(motion["y1_dot"], -10 * data.x[1] + data.x[3], rtol=0.0, atol=ROUNDOFF)


@pytest.mark.parametrize("given_values", [[1.0], [1.0, 2.0], [[1.0, 0.0, 0.0]], 1.0])
def test_initial_values_of_wrong_shape_are_refused(given_values: object) -> None:
    """One value for each DOF, or names."""
    with pytest.raises(MatrixError, match="displacement must have one value for each of the 3 DOFs"):
        exact_reduction(hydromount()).state(given_values)  # type: ignore[arg-type]


@given(structure=damped_structures())
def test_recovered_motion_satisfies_the_equation_of_motion(structure: Structure) -> None:
    """``M q'' + C q' + K q = B u`` along a step response, for half and static DOFs too."""
    reduction = exact_reduction(structure.model())
    time = np.linspace(0.0, 2.0, 40)
    data = control.step_response(mech2ss(reduction), time, squeeze=False)
    motion = reduction.recover(data)
    n = structure.size
    x, u = np.asarray(data.x).reshape(reduction.order, n, time.size), np.asarray(data.u)
    acceleration = reduction.motion(2)
    a = np.tensordot(acceleration.X, x, axes=1) + np.tensordot(acceleration.direct(n), u, axes=1)
    M, C, K = structure.matrices
    forces = [np.tensordot(matrix, part, axes=1) for matrix, part in ((M, a), (K, motion.displacement))]
    forces.append(np.tensordot(C, motion.velocity, axes=1))
    size = max(1.0, *(float(np.abs(force).max()) for force in forces))
    assert_allclose(sum(forces) / size, u / size, rtol=0.0, atol=RESIDUAL)


def test_recovered_displacements_equal_the_outputs() -> None:
    """All displacements recovered from states and inputs are the outputs of the same simulation."""
    model = hydromount()
    data = control.forced_response(mech2ss(model), np.linspace(0, 3, 200), np.ones((3, 200)), return_states=True)
    motion = exact_reduction(model).recover(data)
    assert_allclose(motion.displacement, data.y, rtol=0.0, atol=ROUNDOFF)
    assert_allclose(motion["y1"], data.y[1], rtol=0.0, atol=ROUNDOFF)
    assert_allclose(motion["y_dot"], data.x[3], rtol=0.0, atol=ROUNDOFF)
    assert motion.dofs == model.dofs


def test_velocity_of_a_static_dof_follows_the_slope_of_the_input() -> None:
    """A spring of 4 N/m under a force ramp of 2 N/s moves at 0.5 m/s."""
    model = mechss([[0]], [[0]], [[4]])
    time = np.linspace(0.0, 1.0, 11)
    reduction = exact_reduction(model)
    data = control.forced_response(mech2ss(model), time, 2.0 * time, return_states=True)
    motion = reduction.recover(data)
    assert_allclose(motion["q0_dot"].ravel(), np.full(11, 0.5), rtol=ROUNDOFF)


def test_recovered_motion_of_an_unknown_name_is_refused() -> None:
    """Displacements and velocities are known by name, accelerations are not."""
    data = control.step_response(mech2ss(hydromount()), np.linspace(0, 1, 5))
    with pytest.raises(SignalNameError, match="no motion 'y_ddot'"):
        exact_reduction(hydromount()).recover(data)["y_ddot"]


def test_response_of_another_system_is_not_recovered() -> None:
    """Counts of states and inputs are compared."""
    data = control.step_response(mech2ss([[1]], [[1]], [[1]]), np.linspace(0, 1, 5))
    with pytest.raises(
        InconsistentStateError, match="The response has 2 states and 1 inputs, the reduced model 4 and 3"
    ):
        exact_reduction(hydromount()).recover(data)


# --- refusals --------------------------------------------------------------------------------------------------


def test_complex_model_is_refused_with_the_letters() -> None:
    """Structural damping has no real state space."""
    with pytest.raises(ComplexModelError, match="K has imaginary parts") as refusal:
        exact_reduction(mechss([[1]], [[0]], [[4 + 0.1j]]))
    assert refusal.value.matrices == ("K",)


def test_floating_node_is_refused_by_name() -> None:
    """A massless node that nothing holds makes the pencil singular; by a method of W it stands in the null vector."""
    model = mechss(np.diag([1, 0]), None, np.diag([1, 0]), dofs=["held", "loose"])
    with pytest.raises(SingularPencilError, match="loose") as refusal:
        exact_reduction(model)
    assert refusal.value.dofs == ("loose",)
    with pytest.raises(SingularLeadingMatrixError, match=r"DOFs loose\.") as by_method:
        exact_reduction(model, method="selection")
    assert by_method.value.dofs == ("loose",)
    assert by_method.value.rcond < 2 * EPS


def test_lagrange_multiplier_is_refused_by_a_method_of_the_leading_matrix() -> None:
    """Two masses tied by a rigid constraint: index 3, refused with the multiplier among the names."""
    M, K = np.diag([1, 1, 0]), np.array([[2, 0, 1], [0, 3, -1], [1, -1, 0]])
    model = mechss(M, None, K, dofs=["a", "b", "force"])
    with pytest.raises(SingularLeadingMatrixError, match="rigid constraint") as refusal:
        exact_reduction(model, method="orthogonal")
    assert "force" in refusal.value.dofs
    with pytest.raises(SingularLeadingMatrixError, match="rows of its inverse, do not exist"):
        _ = exact_reduction(model).alpha


def test_selection_alone_is_refused_where_mixing_is_needed() -> None:
    """Two massless nodes joined by a damper break the paper's formulas: only orthonormal bases help."""
    C, K = np.array([[1, -1], [-1, 1]]), np.diag([2, 3])
    model = mechss(None, C, K)
    with pytest.raises(SingularLeadingMatrixError, match="by selection"):
        exact_reduction(model, method="selection")
    reduction = exact_reduction(model)
    assert (reduction.method, reduction.order) == ("orthogonal", 1)
    assert_allclose(reduction.A, [[-1.2]], rtol=ROUNDOFF)  # springs 2 and 3 in series over the damper 1


def test_unknown_method_is_refused() -> None:
    """Only the three methods are known."""
    with pytest.raises(ParameterError, match="method must be 'selection', 'orthogonal', 'deflation' or None, not"):
        exact_reduction(hydromount(), method="magic")  # type: ignore[arg-type]


def test_arrays_of_a_reduction_are_read_only() -> None:
    """A result cannot be changed by accident."""
    reduction = exact_reduction(hydromount())
    for array in (reduction.A, reduction.B):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1.0


def test_exact_zeros_stay_exact_zeros() -> None:
    """A chain without coupling between its halves keeps zero blocks in A and B."""
    left, right = np.array([[3.7, -1.3], [-1.3, 1.3]]), np.array([[0.9]])
    K = np.block([[left, np.zeros((2, 1))], [np.zeros((1, 2)), right]])
    reduction = exact_reduction(mechss(np.diag([1.1, 0, 0]), np.diag([0, 0.3, 0.7]), K))
    assert_array_equal(reduction.A[2], [0.0, 0.0, reduction.A[2, 2], 0.0])
    assert_array_equal(reduction.B[2, :2], [0.0, 0.0])
