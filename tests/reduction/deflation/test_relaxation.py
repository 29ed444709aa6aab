"""Row operations that bring hidden constraints to light, against exact determinants."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount
from halfdof_ctrl.reduction.algebra.blocks import RANK_TOLERANCE
from halfdof_ctrl.reduction.deflation.offsets import structural_offsets
from halfdof_ctrl.reduction.deflation.relaxation import UNCLEAR_TIGHT_RANK, Relaxed, independent_rows, relaxed
from halfdof_ctrl.reduction.deflation.row_system import Caution, RowSystem, level_scaled, unit_free
from halfdof_ctrl.reduction.method.units import Units, scaled_rows
from support import exact
from support.mechanisms import blade, derivatives, hanging_chain, rod
from support.row_systems import SEEDS, USUAL, drawn, rational_coefficients, system_of

FloatArray = npt.NDArray[np.float64]
ROUNDOFF = 1e-12  # a few operations on small well-conditioned matrices
DETERMINANT = 1e-9  # of integer matrices up to 5 x 5 after a few row operations, relative to the largest coefficient


def relaxed_model(model: SecondOrderModel) -> tuple[RowSystem, Relaxed]:
    """Relax a model's equations."""
    system = system_of(np.stack(model.quadratics.P))
    return system, relaxed(system, USUAL)


@pytest.mark.parametrize("model", [rod(), blade(), hanging_chain(3), derivatives(4), hydromount()])
def test_structure_alone_suffices_where_rows_are_independent(model: SecondOrderModel) -> None:
    """Nothing is changed, and the bound of the degree is that of the exact determinant."""
    system, result = relaxed_model(model)
    assert result.system is system
    assert result.offsets is not None
    assert result.offsets.degree_bound == exact.order(model.M, model.C, model.K)


def test_hidden_constraint_of_two_equal_rows_by_hand() -> None:
    """``q0'' + q1'' + q0 = f0`` less ``q0'' + q1'' + 2 q1 = f1`` leaves ``q0 - 2 q1 = f0 - f1``, a constraint."""
    result = relaxed(system_of([np.diag([1, 2]), np.zeros((2, 2)), np.ones((2, 2))]), USUAL)
    left = result.system.coefficients[0, 1] / result.system.coefficients[0, 1, 0]
    before = system_of([np.diag([1, 2]), np.zeros((2, 2)), np.ones((2, 2))]).coefficients
    assert result.offsets is not None
    assert result.offsets.equations.tolist() == [0, 2]
    assert_allclose(left[1], -before[0, 1, 1] / before[0, 0, 0], rtol=ROUNDOFF)
    assert_array_equal(result.system.coefficients[1:, 1], 0.0)
    assert [decision.rank for decision in result.decisions] == [1, 2]


@given(seed=SEEDS, size=st.integers(2, 4), power=st.integers(-3, 3), gap=st.integers(0, 2))
def test_row_operation_keeps_the_determinant_exactly(seed: int, size: int, power: int, gap: int) -> None:
    """Rows that are a power of two of each other: (17) rounds nothing, so not one digit of ``det P(s)`` changes."""
    generator = np.random.default_rng(seed)
    P = generator.integers(-3, 4, (3, size, size)).astype(float)
    P[2, 0] = 0.0 if gap else P[2, 0]
    P[1, 0] = 0.0 if gap == 2 else P[1, 0]
    P[2, 1] = 2.0**power * P[2 - gap, 0]
    assume(P[2].any(axis=0).all())  # else J takes columns of C or K, in which the rows differ
    system = system_of(P)
    result = relaxed(system, USUAL)
    assume(sum(decision.unknowns.size - decision.rank for decision in result.decisions) == 1)  # nothing else hidden
    assume(result.offsets is not None)
    before, after = (rational_coefficients(part.matrix) for part in (system, result.system))
    assert len(before) == len(after)
    ratios = {b / a for a, b in zip(before, after, strict=True) if a}  # type: ignore[operator]
    assert len(ratios) == 1
    assert np.frexp(float(ratios.pop()))[0] in {0.5, -0.5}  # rows are scaled by powers of two


@given(seed=SEEDS, size=st.integers(2, 5))
def test_row_operations_end_at_the_degree_of_the_determinant(seed: int, size: int) -> None:
    """The bound is met, the tight coefficients are nonsingular, and the determinant is the same up to a factor."""
    system = system_of(drawn(seed, size))
    result = relaxed(system, USUAL)
    before = rational_coefficients(system.matrix)
    if result.offsets is None:
        assert before == []
        return
    assert result.offsets.degree_bound == len(before) - 1
    assert np.linalg.matrix_rank(result.offsets.tight(result.system.matrix)) == size
    after = np.array(rational_coefficients(result.system.matrix)[: len(before)], dtype=float)
    desired = np.array(before, dtype=float)
    place = int(np.abs(desired).argmax())
    assert_allclose(after / after[place], desired / desired[place], rtol=0.0, atol=DETERMINANT)


@given(seed=SEEDS, size=st.integers(2, 5))
def test_equations_keep_their_solutions(seed: int, size: int) -> None:
    """Unknowns that satisfy ``P(s) q = B u`` satisfy the relaxed equations: B takes part in (17)."""
    system = system_of(drawn(seed, size))
    result = relaxed(system, USUAL)
    assume(result.offsets is not None)
    s = 0.7 + 1.3j
    before, after = (
        np.tensordot(s ** np.arange(len(part.coefficients)), part.coefficients, axes=1)
        for part in (system, result.system)
    )
    q, solution = (np.linalg.solve(part[:, :size], part[:, size:]) for part in (before, after))
    assert_allclose(solution, q, rtol=0.0, atol=DETERMINANT * np.abs(q).max() * np.linalg.cond(before[:, :size]))


def test_only_dependent_rows_are_touched() -> None:
    """A third DOF that hangs on the first keeps its equation bit for bit, exact zeros and all."""
    M = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 0.3]])
    K = np.array([[1.0, 0, -0.1], [0, 2, 0], [-0.1, 0, 0.7]])
    system = system_of([K, np.zeros((3, 3)), M])
    result = relaxed(system, USUAL)
    assert result.system is not system
    assert_array_equal(result.system.coefficients[:3, [0, 2]], system.coefficients[:, [0, 2]])


def test_equation_of_which_nothing_is_left_ends_in_a_singular_pencil() -> None:
    """Twice the same equation."""
    result = relaxed(system_of([[[1, 2], [2, 4]], [[0, 0], [0, 0]], [[1, 1], [2, 2]]]), USUAL)
    assert result.offsets is None
    assert not result.system.matrix[:, 1].any()


@pytest.mark.parametrize(("tol", "rank"), [(None, 2), (1e-9, 2), (1e-7, 2), (1e-5, 1)])
def test_tolerance_says_which_singular_values_count(tol: float | None, rank: int) -> None:
    """Rows that are equal to 1e-6 are independent, unless `tol` is larger; nothing is in doubt where it is given."""
    P = np.array([np.diag([1.0, 2.0]), np.zeros((2, 2)), [[1, 1], [1, 1 + 1e-6]]])
    decision = relaxed(system_of(P), USUAL, tol).decisions[0]
    assert decision.rank == rank
    assert decision.singular_values[1] < 1e-5


def test_singular_values_in_doubt_are_parted_at_the_widest_gap() -> None:
    """Up to a hundred times what rounding makes: those near rounding go with the zeros, those far from it count."""
    rotation = np.linalg.qr(np.random.default_rng(1).standard_normal((4, 4)))[0]
    rounding = 4 * RANK_TOLERANCE
    for doubtful, rank in ((2 * rounding, 2), (15 * rounding, 4)):
        M = rotation @ np.diag([1.0, 0.1, doubtful, 0.75 * doubtful]) @ rotation.T
        decision = relaxed(system_of([np.eye(4), np.zeros((4, 4)), M]), Caution(24.0, 0.0)).decisions[0]
        assert decision.singular_values[2] < UNCLEAR_TIGHT_RANK * rounding * decision.singular_values[0]
        assert decision.rank == rank


POWERS = st.lists(st.integers(-9, 9), min_size=9, max_size=9)


@given(seed=SEEDS, size=st.integers(2, 4), powers=POWERS)
def test_decisions_are_the_same_in_any_units(seed: int, size: int, powers: list[int]) -> None:
    """Powers of ten on unknowns, equations and time change neither offsets nor ranks nor the singular values."""
    P = drawn(seed, size)
    columns, rows = 10.0 ** np.array(powers[:size]), 10.0 ** np.array(powers[4 : 4 + size])
    speed = (10.0 ** powers[8]) ** np.arange(3.0)
    one, other = (
        relaxed(system_of(P), USUAL),
        relaxed(system_of(P * columns * rows[:, None] * speed[:, None, None]), USUAL),
    )
    assert (one.offsets is None) == (other.offsets is None)
    if one.offsets is None or other.offsets is None:
        return
    assert_array_equal(other.offsets.equations, one.offsets.equations)
    assert_array_equal(other.offsets.unknowns, one.offsets.unknowns)
    assert [decision.rank for decision in other.decisions] == [decision.rank for decision in one.decisions]
    for mine, theirs in zip(one.decisions, other.decisions, strict=True):
        assert_allclose(theirs.singular_values, mine.singular_values, rtol=0.0, atol=DETERMINANT)


@given(seed=SEEDS, size=st.integers(1, 4), powers=POWERS)
def test_unit_free_scaling_is_the_same_in_any_units(seed: int, size: int, powers: list[int]) -> None:
    """What rows, columns and time still lack makes J the same, level or not."""
    P = drawn(seed, size)
    columns, rows = 10.0 ** np.array(powers[:size]), 10.0 ** np.array(powers[4 : 4 + size])
    speed = (10.0 ** powers[8]) ** np.arange(3.0)
    every = np.arange(size)
    found = structural_offsets(P != 0.0)
    assume(found is not None)
    assert found is not None
    systems = system_of(P), system_of(P * columns * rows[:, None] * speed[:, None, None])
    for scaling in (unit_free, level_scaled):
        one, other = (scaling(part, found, found.tight(part.matrix), every, every) for part in systems)
        assert_allclose(other.matrix, one.matrix, rtol=DETERMINANT)
        assert_allclose(one.matrix, found.tight(systems[0].matrix) * one.rows[:, None] * one.columns, rtol=ROUNDOFF)


@given(seed=SEEDS, size=st.integers(1, 4), powers=POWERS)
def test_scaling_is_undone_exactly(seed: int, size: int, powers: list[int]) -> None:
    """Powers of two: scaled unknowns, inputs and time give back the coefficients to the last bit."""
    P = drawn(seed, size) * 10.0 ** np.array(powers[:size])
    B = np.random.default_rng(seed).standard_normal((3, size, 2)) * 10.0 ** np.array(powers[4:6])
    system, units = scaled_rows(P, B)
    speed = units.time ** np.arange(3.0)[:, None, None]
    back = system.coefficients / speed / np.concatenate([units.columns, units.inputs])
    rows = np.abs(back).max(axis=(0, 2)) / np.abs(np.concatenate([P, B], axis=2)).max(axis=(0, 2))
    assert_array_equal(back / rows[:, None], np.concatenate([P, B], axis=2))
    assert_array_equal(np.frexp(rows)[0], 0.5)
    largest = np.abs(system.coefficients[:, :, size:]).max(axis=(0, 1))
    assert ((largest >= 0.5) & (largest < 1.0)).all()


def test_inputs_of_any_size_are_scaled() -> None:
    """Also those that act on nothing, and those that would overflow with the scale of their equation."""
    B = np.zeros((3, 1, 3))
    B[0, 0] = 0.0, 1e300, 1e-300
    system, units = scaled_rows(np.array([[[1e-200]], [[0.0]], [[1e-200]]]), B)
    assert system.coefficients[0, 0, 1] == 0.0
    assert ((system.coefficients[0, 0, 2:] >= 0.5) & (system.coefficients[0, 0, 2:] < 1.0)).all()
    assert units.inputs[0] == 1.0


def test_powers_of_the_time_scale_do_not_overflow() -> None:
    """``1e-300 time^4`` at time = 2^400 is a float although time^4 is none."""
    units = Units(columns=np.ones(1), inputs=np.ones(1), time=2.0**400)
    assert_array_equal(units.by_time(np.array([2.0**-1000]), 4), [2.0**600])
    assert_array_equal(units.by_time(np.array([3.0, 0.0]), [-2, -9]), [3.0 * 2.0**-800, 0.0])


@given(seed=SEEDS, rows=st.integers(1, 7), columns=st.integers(1, 5), taken=st.integers(0, 3))
def test_picked_rows_complete_a_basis(seed: int, rows: int, columns: int, taken: int) -> None:
    """As many as asked for, independent of the given ones and of each other."""
    generator = np.random.default_rng(seed)
    given_rows = np.linalg.qr(generator.standard_normal((columns, columns)))[0][: min(taken, columns)]
    matrix = generator.integers(-2, 3, (rows, columns)).astype(float)
    rank = int(np.linalg.matrix_rank(np.vstack([given_rows, matrix])))
    picked = independent_rows(matrix, given_rows, rank - len(given_rows), share=0.5)
    assert len(set(picked.tolist())) == rank - len(given_rows)
    basis = np.vstack([given_rows, matrix[picked]])
    assert (np.linalg.matrix_rank(basis) if basis.size else 0) == rank


@pytest.mark.parametrize(("share", "first"), [(0.3, 0), (0.9, 1)])
def test_early_rows_come_first_where_they_are_about_as_good(share: float, first: int) -> None:
    """A row half as long as the longest one is taken only if half is enough."""
    assert independent_rows(np.array([[1.0, 0.0], [2.0, 0.0], [0.0, 1.5]]), np.zeros((0, 2)), 2, share)[0] == first
