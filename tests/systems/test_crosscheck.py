"""The cross-check: it passes what is right, fails what is wrong by 1e-6, and raises no false alarm."""

from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import (
    CrossCheck,
    SecondOrderModel,
    crosscheck,
    exact_reduction,
    hydromount,
    mech2ss,
    mechss,
    pencil_structure,
)
from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.base.errors import (
    CloseDecisionWarning,
    ComplexModelError,
    HalfdofError,
    ImproperError,
    MatrixError,
    SingularPencilError,
    recording_warnings,
)
from halfdof_ctrl.descriptor import radau
from halfdof_ctrl.systems import step_check, transfer_check
from halfdof_ctrl.systems.check_points import check_points
from halfdof_ctrl.systems.judged import Grade
from halfdof_ctrl.systems.pole_check import compare_poles
from halfdof_ctrl.systems.refined_poles import refined_poles
from halfdof_ctrl.systems.state_space import system_of_model
from halfdof_ctrl.systems.transfer_check import DOUBTED
from support.beams import cantilever
from support.benchmark_circuits import hinged_beam, rotor_in_rigid_bearing, two_track_mount
from support.benchmark_mechanisms import gear_train, seven_body_mechanism
from support.benchmark_problems import intersection, mobile_manipulator, qep_with_two_infinite_eigenvalues
from support.slycot_marks import needs_slycot
from support.structures import Structure, assembly, damped_structures, null_columns, structures

#: the check itself measures what python-control's evaluation loses
pytestmark = pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
FEWER = max(10, settings().max_examples // 5)  # each example integrates step responses of all inputs
CHANGE = 1e-6  # a broken entry must be found

OUTPUTS: dict[str, list[str]] = {
    "displacements": ["y", "y1", "y2"],
    "mass": ["y"],
    "half": ["y2"],
    "velocities": ["y_dot"],
    "acceleration": ["y_ddot", "y1"],
}


def mount(outputs: str) -> SecondOrderModel:
    """Give the mount with one of the choices of outputs, driven at the mass."""
    return hydromount().select(inputs=["F_y"], outputs=OUTPUTS[outputs])


@pytest.mark.parametrize("outputs", OUTPUTS)
def test_mount_passes(outputs: str) -> None:
    """Every choice of outputs, with errors near rounding."""
    check = crosscheck(mount(outputs), mech2ss(mount(outputs)))
    assert check.passed, check
    assert check.verdict == "ok"
    assert check.max_transfer_error < 1e-12
    assert check.max_pole_error < 1e-13
    assert check.max_step_error < 1e-11
    assert (check.order, check.n_finite, check.n_infinite) == (4, 4, 2)


@pytest.mark.parametrize("outputs", OUTPUTS)
@pytest.mark.parametrize("letter", "ABCD")
def test_any_entry_broken_by_a_millionth_fails(outputs: str, letter: str) -> None:
    """Every entry times 1 + 1e-6, and every zero entry moved by 1e-6 of its matrix (a zero D: of the response)."""
    model = mount(outputs)
    sys = mech2ss(model)
    matrix = np.asarray(getattr(sys, letter))
    for i, j in np.ndindex(*matrix.shape):
        change = CHANGE * (abs(matrix[i, j]) or np.abs(matrix).max(initial=0.0) or np.abs(sys(17.7j)).max())
        matrices = {name: np.array(getattr(sys, name)) for name in "ABCD"}
        matrices[letter][i, j] += change
        check = crosscheck(model, control.ss(*matrices.values()))
        assert not check.passed, f"{letter}[{i}, {j}] changed by {change:.1e}:\n{check}"


@settings(max_examples=FEWER)
@given(structure=damped_structures())
def test_right_systems_pass(structure: Structure) -> None:
    """Random assemblies with all kinds of DOF raise no false alarm."""
    check = crosscheck(structure.model(), mech2ss(structure.model()))
    assert check.passed, check


@settings(max_examples=FEWER)
@given(structure=structures(assembly, null_columns, largest=6))
def test_undamped_rigid_and_unstable_systems_pass(structure: Structure) -> None:
    """Whatever the reduction accepts, with poles anywhere, raises no false alarm where W is well-conditioned."""
    try:
        reduction = exact_reduction(structure.model())
    except SingularPencilError:
        return
    if reduction.rcond < 1e-3 or reduction.polynomial_part:
        return
    check = crosscheck(structure.model(), mech2ss(reduction))
    assert check.passed, check


def rotated_double_pole() -> SecondOrderModel:
    """Two critically damped oscillators with the same pole, coupled through a rotation."""
    turn = np.array([[3.0, -4.0], [4.0, 3.0]]) / 5.0
    return mechss(np.eye(2), turn @ np.diag([2.0, 2.0]) @ turn.T, turn @ np.diag([1.0, 1.0]) @ turn.T)


DELICATE: dict[str, Callable[[], SecondOrderModel]] = {
    "double pole": lambda: mechss([[1]], [[2]], [[1]]),
    "two double poles": rotated_double_pole,
    "rigid body": lambda: mechss([[3]], None, None),
    "rigid body of three": lambda: mechss(
        np.diag([1.0, 2.0, 3.0]), None, np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    ),
    "rigid damped": lambda: mechss([[1]], [[1]], None),
    "undamped": lambda: mechss(np.eye(2), None, np.array([[2.0, -1.0], [-1.0, 2.0]])),
    "equal oscillators": lambda: mechss(np.eye(3), None, 4.0 * np.eye(3)),
    "stiff": lambda: mechss(np.diag([1.0, 0.0]), np.diag([0.0, 1e-5]), np.array([[2.0, -1.0], [-1.0, 1.0]])),
    "stiff undamped": lambda: mechss(np.diag([1.0, 1e-10]), None, np.array([[2.0, -1.0], [-1.0, 2.0]])),
    "sharp resonance": lambda: mechss([[1]], [[1e-7]], [[1]]),
    "no states": lambda: mechss(None, None, np.array([[2.0, -1.0], [-1.0, 2.0]])),
    "integrator": lambda: mechss(None, [[2]], None),
    "unstable": lambda: mechss([[1]], [[-1]], [[4]]),
    "chain of equal links": lambda: mechss(
        np.eye(12), None, 2 * np.eye(12) - np.eye(12, k=1) - np.eye(12, k=-1), np.eye(12)[:, 0], np.eye(12)[11]
    ),
    "output that is zero": lambda: mechss(np.eye(2), None, np.eye(2), [1, 0], [0, 1]),
    "static beside dynamic": lambda: mechss(np.diag([1.0, 0.0]), None, np.diag([1.0, 1e6])),
    "slow unit of time": lambda: _in_units_of_time(1e8),
    "fast unit of time": lambda: _in_units_of_time(1e-8),
    "free pair": lambda: mechss(np.diag([2, 3]), [[4, -4], [-4, 4]], [[12, -12], [-12, 12]]),
    "free body with inertial coupling": lambda: mechss([[1, -1], [-1, 2]], [[0, 0], [0, 1]], [[0, 0], [0, 4]]),
    "channel that cancels": lambda: mechss(None, [[-1, 0], [-1, 0]], [[3, -4], [1, 0]]),
    "channel that cancels at rest": lambda: mechss(None, None, [[4, -3], [1, 0]]),
    "motion without stiffness": lambda: mechss([[4, 0], [0, 4]], [[1, 0], [4, 4]], None),
    "pole at the origin alone": lambda: mechss(
        None, [[4, 0, 4], [0, 0, 0], [4, 0, 4]], [[1, 2, 1], [2, 4, 2], [1, 2, 2]]
    ),
    "free bar in mixed coordinates": lambda: mechss([[1, 1], [1, 1]], None, [[1, 0], [0, 0]]),
    "unstable channel that cancels": lambda: mechss(None, [[4, 0], [-2, 0]], [[3, -1], [4, 0]]),
    "tiny unit of force": lambda: _in_units_of_force(1e-30),
    "huge unit of force": lambda: _in_units_of_force(1e30),
}


def _in_units_of_time(tau: float) -> SecondOrderModel:
    plain = hydromount()
    return mechss(plain.M * tau**2, plain.C * tau, plain.K)


def _in_units_of_force(factor: float) -> SecondOrderModel:
    plain = hydromount()
    return mechss(plain.M * factor, plain.C * factor, plain.K * factor)


@pytest.mark.parametrize("case", DELICATE)
def test_delicate_systems_raise_no_false_alarm(case: str) -> None:
    """Double poles, rigid bodies, no damping, poles 1e5 apart, no states, other units."""
    model = DELICATE[case]()
    check = crosscheck(model, mech2ss(model))
    assert check.passed, check


BREAKABLE = {
    "double pole": "ABC",
    "undamped": "ABC",
    "stiff": "ABC",
    "rigid damped": "ABC",
    "no states": "D",
    "integrator": "BC",
}


@pytest.mark.parametrize(("case", "letter"), [(case, letter) for case in BREAKABLE for letter in BREAKABLE[case]])
def test_delicate_systems_are_not_let_off(case: str, letter: str) -> None:
    """The allowance for rounding does not hide an error of 1e-5 in the largest entry."""
    model = DELICATE[case]()
    sys = mech2ss(model)
    matrices = {name: np.array(getattr(sys, name)) for name in "ABCD"}
    place = np.unravel_index(np.argmax(np.abs(matrices[letter])), matrices[letter].shape)
    matrices[letter][place] *= 1.0 + 1e-5
    check = crosscheck(model, control.StateSpace(*matrices.values()))
    assert not check.passed, check


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.NearlyMasslessWarning")
def test_a_mode_beside_a_slow_drift_is_not_let_off() -> None:
    """A drift of 1e-5 rad/s is 1e12 times as large at rest as a mode of 100 rad/s at its peak: that is no roll-off."""
    model = mechss(np.eye(2), np.diag([1e-5, 1.0]), np.diag([1e-10, 1e4]), [1, 1], [1, 1])
    sys = mech2ss(model)
    assert crosscheck(model, sys).verdict == "ok"
    sys.C[0, 1] *= 1.0 + CHANGE
    check = crosscheck(model, sys)
    assert "transfer" in check.failed
    assert 1e-9 < check.max_transfer_error < 1e-5


@pytest.mark.parametrize("change", [CHANGE, 1.0])
def test_a_weak_coupling_is_checked_by_its_own_value(change: float) -> None:
    """A spring of 1e-14 between two oscillators: its channel is no rounding where both sides hold its digits."""
    model = mechss(np.eye(2), 0.1 * np.eye(2), [[1.0, -1e-14], [-1e-14, 2.0]])
    sys = mech2ss(model)
    assert crosscheck(model, sys).verdict == "ok"
    sys.A[3, 0] *= 1.0 + change
    check = crosscheck(model, sys)
    assert check.failed == ("transfer", "step")
    assert check.transfer_worst.startswith("q1 from F_q0 at s = ")
    assert_allclose(check.max_transfer_error, change, rtol=1e-6)


def test_wrong_order_fails_and_is_told() -> None:
    """A system with a state too many, or too few, has another count of poles."""
    model = mount("mass")
    sys = mech2ss(model)
    longer = control.ss(
        np.block([[sys.A, np.zeros((4, 1))], [np.zeros((1, 4)), -np.eye(1)]]),
        np.vstack([sys.B, [[0.0]]]),
        np.hstack([sys.C, [[0.0]]]),
        sys.D,
    )
    for other, order in ((longer, 5), (control.ss(sys.A[:3, :3], sys.B[:3], sys.C[:, :3], sys.D), 3)):
        check = crosscheck(model, other)
        assert not check.passed
        assert check.pole_worst == f"{order} poles for 4 finite eigenvalues"
        assert "FAILED" in repr(check)


def test_verdict_prints_as_a_table() -> None:
    """Four figures with a verdict and the place of the worst error, and five that decide nothing; 80 columns."""
    text = repr(crosscheck(hydromount(), mech2ss(hydromount())))
    lines = text.splitlines()
    assert lines[0] == "Cross-check passed"
    what = ["states", "transfer", "poles", "step", "data", "doubles", "sys(s)", "ct.step", "slycot"]
    assert [line.split()[0] for line in lines[2:] if not line.startswith(" ")] == what
    assert "4 finite, 2 infinite" in text
    assert max(map(len, lines)) < 80


def test_a_failure_says_what_failed_where_in_full() -> None:
    """Long names are not cut: output, input and frequency of the worst error can all be read."""
    names = ["displacement_of_the_left_engine_mount", "displacement_of_the_right_engine_mount"]
    model = mechss(np.eye(2), 0.1 * np.eye(2), [[3.0, -1.0], [-1.0, 2.0]], dofs=names).select(f"F_{names[0]}", names[1])
    sys = mech2ss(model)
    sys.C[0, 1] *= 1.0 + 1e-6
    check = crosscheck(model, sys)
    text = repr(check)
    assert check.failed == ("transfer", "step")
    assert text.splitlines()[0] == "Cross-check FAILED: transfer, step"
    assert check.transfer_worst.startswith(f"{names[1]} from F_{names[0]} at s = ")
    assert check.transfer_worst in " ".join(text.split())
    assert max(map(len, text.splitlines())) < 80


def test_worst_place_is_named() -> None:
    """A wrong C entry shows up at that output."""
    model = hydromount()
    sys = mech2ss(model)
    sys.C[1, 1] *= 1.001
    check = crosscheck(model, sys)
    assert check.transfer_worst.startswith("y1 from F_")
    assert check.step_worst.startswith("y1 from F_")
    assert not check.passed


def test_figures_are_plain_numbers_for_files() -> None:
    """`as_dict` holds the verdict and JSON types alone."""
    facts = crosscheck(hydromount(), mech2ss(hydromount())).as_dict()
    assert facts["passed"] is True
    assert facts["verdict"] == "ok"
    assert {type(value) for value in facts.values()} <= {bool, int, float, str, list}
    assert set(facts) == {"passed", "verdict", *CrossCheck.__dataclass_fields__}


def test_another_number_of_signals_is_refused() -> None:
    """The system must be one of this model."""
    with pytest.raises(MatrixError, match="The system has 1 outputs and 3 inputs, the model 3 and 3"):
        crosscheck(hydromount(), mech2ss(hydromount().select(outputs="y")))


def test_complex_model_is_refused() -> None:
    """There is no real state space to compare."""
    with pytest.raises(ComplexModelError, match="K has imaginary parts"):
        crosscheck(mechss([[1]], None, [[1 + 0.1j]]), control.ss([[0, 1], [-1, 0]], [[0], [1]], [[1, 0]], [[0]]))


def test_singular_pencil_is_refused_by_name() -> None:
    """A node that floats has no transfer function."""
    with pytest.raises(SingularPencilError, match="DOF b can move"):
        crosscheck(
            mechss(np.diag([1, 0]), None, np.diag([1, 0]), [1, 0], [1, 0], dofs=["a", "b"]),
            control.ss([[0, 1], [-1, 0]], [[0], [1]], [[1, 0]], [[0]]),
        )


def test_discrete_system_does_not_pass() -> None:
    """A sampled system is no exact state space of the model: refused or failed, never passed."""
    model = mount("mass")
    sampled = control.sample_system(mech2ss(model), 1e-3)
    try:
        assert not crosscheck(model, sampled).passed
    except HalfdofError as refusal:
        assert "discrete" in str(refusal)  # noqa: PT017  # either of the two is right


def test_prescribed_motion_is_checked_too() -> None:
    """Bv and Ba: the mount's foot moves; the step response follows the motion, not a force."""
    model = mechss([[2]], [[3]], [[5]], [[5]], Bv=[[3]])
    check = crosscheck(model, mech2ss(model))
    assert check.passed, check


def test_state_coordinates_do_not_matter() -> None:
    """Any similarity transformation of the right system passes."""
    model = hydromount()
    T = np.random.default_rng(1).standard_normal((4, 4)) + 3 * np.eye(4)
    assert crosscheck(model, control.similarity_transform(mech2ss(model), T)).passed


def test_nan_in_the_system_does_not_pass() -> None:
    """NaN must not slip through comparisons."""
    model = mount("mass")
    sys = mech2ss(model)
    sys.D[0, 0] = np.nan
    try:
        passed = crosscheck(model, sys).passed
    except ValueError:
        passed = False
    assert not passed


def test_improper_model_has_nothing_to_compare() -> None:
    """`mech2ss` refuses first; a made-up system for it fails."""
    model = mechss(None, None, [[4]], G=[[1]])
    with pytest.raises(ImproperError, match="q0_dot from F_q0"):
        mech2ss(model)
    assert not crosscheck(model, control.ss([], [], [], [[0.0]])).passed


HELD = [mobile_manipulator, seven_body_mechanism, two_track_mount, rotor_in_rigid_bearing, hinged_beam, gear_train]


@pytest.mark.parametrize("problem", HELD, ids=lambda problem: problem.__name__)
def test_constrained_models_raise_no_false_alarm(problem: Callable[[], SecondOrderModel]) -> None:
    """Index 2 and 3: channels of DOFs that constraints hold are zero here and rounding there."""
    model = problem()
    improper = {output for _, output, _ in pencil_structure(model).improper_pairs}
    proper = [output for output in model.outputs if output not in improper]
    model = model.select(outputs=proper or model.outputs[:1])
    check = crosscheck(model, mech2ss(model))
    assert check.passed, check


@pytest.mark.parametrize("letter", ["A", "B", "C", "D"])
def test_wrong_systems_of_constrained_models_fail(letter: str) -> None:
    """A rod between two masses, one entry off by 1e-6."""
    M, K = np.diag([2.0, 1, 0]), np.array([[30.0, 0, 1], [0, 60, -1], [1, -1, 0]])
    model = mechss(M, None, K, dofs=["a", "b", "f"]).select("F_a", ["a", "f"])
    sys = mech2ss(model)
    matrices = {name: np.array(getattr(sys, name)) for name in "ABCD"}
    assert crosscheck(model, control.ss(*matrices.values())).passed
    matrices[letter][-1, 0] += 1e-6 * max(1.0, abs(matrices[letter][-1, 0]))
    assert not crosscheck(model, control.ss(*matrices.values())).passed


@pytest.mark.parametrize("problem", [qep_with_two_infinite_eigenvalues, intersection])
@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.LostDigitsWarning")
@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.CloseDecisionWarning")
def test_eigenvalues_that_rounding_moves_raise_no_alarm(problem: Callable[[], SecondOrderModel]) -> None:
    """A defective double eigenvalue, and two that differ by 1e-8 beside some of 1e9: the pencil is singular between."""
    model = problem()
    improper = {int(i) for part in exact_reduction(model).polynomial_part for i in np.flatnonzero(part.any(axis=1))}
    model = model.select(outputs=[name for i, name in enumerate(model.outputs) if i not in improper])
    assert crosscheck(model, mech2ss(model)).passed


def test_a_pair_that_hardly_swings_asks_for_no_point_of_its_own() -> None:
    """``-1 +- 1e-30j``, a double pole as rounding splits it: the slowest point lies a decade below the pole."""
    points = check_points(np.array([-1.0 + 1e-30j, -1.0 - 1e-30j, -0.01 + 5j, -0.01 - 5j]), 1000)
    assert_allclose(np.abs(points).min(), 0.1)
    assert np.any(points == 5j)


@pytest.mark.parametrize("change", [1e-6, -1e-6])
def test_simple_pole_beside_its_eigenvalue_is_an_error(change: float) -> None:
    """Where P(s) is far from singular at the pole, nothing excuses it."""
    model = mechss([[1]], [[3]], [[2]])
    poles = refined_poles(np.array([[-1.0 - change, 0.0], [0.0, -2.0]]))
    judged = compare_poles(model, poles, np.array([-1.0, -2.0], dtype=complex), np.zeros(2), 1.0)
    assert 0.4e-6 < judged.error < 2e-6
    assert judged.grade == Grade.FAILED
    assert judged.where.startswith("pole -1")


def test_double_eigenvalue_split_by_rounding_is_none() -> None:
    """``(s + 1)^2`` with poles -1 +- 1e-8: as near as rounding of M, C, K allows; with +- 1e-6 it is an error."""
    model = mechss([[1]], [[2]], [[1]])
    twice = np.array([-1.0, -1.0], dtype=complex)
    for split, passes in ((1e-8, True), (1e-6, False)):
        poles = refined_poles(np.diag([-1.0 - split, -1.0 + split]))
        assert (compare_poles(model, poles, twice, np.zeros(2), 1.0).grade != Grade.FAILED) is passes


@needs_slycot
def test_three_things_are_told_apart_on_a_beam() -> None:
    """40 elements: the state space is right to what its doubles allow, python-control's evaluation of it is not."""
    model = cantilever(40)
    check = crosscheck(model, system_of_model(model))
    assert check.verdict.startswith("ok within what the numbers allow (")
    assert 1e-10 < check.max_transfer_error <= check.transfer_allowed
    assert check.evaluation_error > 1e3 * check.max_transfer_error
    assert check.passed


def test_energy_states_of_a_beam_are_ok_without_allowance() -> None:
    """The same beam in states that keep the digits."""
    model = cantilever(20)
    assert crosscheck(model, mech2ss(model, states="energy")).verdict.startswith("ok")


def test_a_wrong_step_response_of_python_control_decides_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is measured as it is."""
    right = control.forced_response

    def off(*given: object, **options: object) -> control.TimeResponseData:
        response = right(*given, **options)
        response.y = response.y * (1.0 + 1e-6)
        return response

    monkeypatch.setattr(control, "forced_response", off)
    check = crosscheck(mount("mass"), mech2ss(mount("mass")))
    assert check.verdict == "ok"
    assert check.step_evaluation_error == pytest.approx(1e-6, rel=1e-3)


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_outputs_that_are_zero_for_every_input_raise_no_alarm(unit: float) -> None:
    """A mass that nothing drives, a DOF that a constraint holds, and a difference that is always zero."""
    M, K = np.diag([2.0, 1.0, 3.0, 0.0]), np.diag([7.0, 5.0, 11.0, 0.0])
    K[2, 3] = K[3, 2] = unit
    F = np.array([[0.0, unit, 0.0, 0.0], [0.0, 0.0, unit, 0.0], [1.0, 0.0, 0.0, 0.0]])
    model = mechss(M, 0.1 * M, K, [1.0, 0, 0, 0], F)
    check = crosscheck(model, mech2ss(model))
    assert check.verdict == "ok", check
    sys = mech2ss(model)
    C = np.array(sys.C)
    C[0, 0] = 1e-6 * np.abs(C).max()
    assert not crosscheck(model, control.ss(sys.A, sys.B, C, sys.D)).passed


def test_entries_with_six_digits_allow_what_six_digits_determine() -> None:
    """The same error of 1e-8 in A is a fault of a model of doubles, and within what a file with six digits says."""
    model = mount("mass")
    sys = mech2ss(model)
    A = np.array(sys.A)
    A[3, 0] *= 1.0 + 1e-8
    wrong = control.ss(A, sys.B, sys.C, sys.D)
    assert crosscheck(model, wrong).verdict == "failed"
    rough = crosscheck(replace(model, known_to=5e-7), wrong)
    assert rough.verdict.startswith("ok within what the numbers allow (")
    assert rough.data_limit > 1e-7
    assert "known to 5.0e-07" in repr(rough)


@pytest.mark.parametrize("power", [40, 42, 44, 46, 48, 50])
def test_a_rank_near_rounding_is_announced_by_both_sides(power: int) -> None:
    """A last mass of 1 + 2^-power: four states, where the stored numbers have five; both sides say so by themselves."""
    M = np.ones((3, 3))
    M[2, 2] += 2.0**-power
    model = mechss(M, np.diag([3.0, 1, 2]), [[15, -5, -5], [-5, 10, -2], [-5, -2, 18]])
    with recording_warnings() as caught:
        structure = pencil_structure(model)
    assert structure.uncertainty
    assert structure.fewest_finite == 4
    assert structure.most_finite == 5
    assert [warning.category for warning in caught] == [CloseDecisionWarning]
    with recording_warnings() as caught:
        sys = system_of_model(model)
    assert [warning.category for warning in caught] == [CloseDecisionWarning]
    with recording_warnings() as caught:
        check = crosscheck(model, sys)
    assert [warning.category for warning in caught] == [CloseDecisionWarning]
    assert sys.nstates == 4
    assert check.verdict == "ok within what the numbers allow (the count of states)"
    assert check.max_transfer_error < 1e-9


def test_long_names_leave_the_table_readable() -> None:
    """Names of forty letters are shortened in the table and whole in the attributes."""
    names = [f"displacement_of_the_engine_at_its_mount_{k}" for k in range(2)]
    model = mechss(np.eye(2), np.eye(2), 2 * np.eye(2), dofs=names)
    check = crosscheck(model, mech2ss(model))
    assert max(map(len, repr(check).splitlines())) < 80
    assert check.transfer_worst.startswith("displacement_of_the_engine_at_its_mount_")


def both_ways(model: SecondOrderModel, sys: control.StateSpace) -> tuple[CrossCheck, CrossCheck]:
    """Check with every value refined, and as models with many values are checked."""
    every = crosscheck(model, sys)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(transfer_check, "FEW_VALUES", 0)
        return every, crosscheck(model, sys)


@settings(max_examples=FEWER)
@given(structure=damped_structures())
def test_refining_where_the_sides_differ_says_what_refining_all_says(structure: Structure) -> None:
    """Verdict and figures of right systems; errors below a hundredth of the tolerance may be those of the solves."""
    model = structure.model()
    every, some = both_ways(model, system_of_model(model))
    assert some.verdict.split("(")[0] == every.verdict.split("(")[0]
    assert some.transfer_grade == every.transfer_grade
    assert some.max_transfer_error <= max(every.max_transfer_error, DOUBTED) * (1.0 + CHANGE)
    assert_allclose([some.data_limit, some.double_limit], [every.data_limit, every.double_limit], rtol=CHANGE)


@settings(max_examples=FEWER)
@given(structure=damped_structures(), share=st.sampled_from([1e-6, 1e-9, 3e-10, 1e-11]))
def test_refining_where_the_sides_differ_lets_no_wrong_system_off(structure: Structure, share: float) -> None:
    """Every grade of an output matrix that is off, down to an error below the tolerance, is the same both ways."""
    model = structure.model()
    sys = system_of_model(model)
    broken = control.StateSpace(sys.A, sys.B, sys.C * (1.0 + share), sys.D * (1.0 + share))
    every, some = both_ways(model, broken)
    assert some.transfer_grade == every.transfer_grade
    assert some.max_transfer_error == pytest.approx(every.max_transfer_error, rel=CHANGE)
    assert some.transfer_worst == every.transfer_worst


@pytest.mark.parametrize("grown", [np.inf, 1e30])
def test_an_integration_that_rounding_runs_away_with_is_not_followed(
    monkeypatch: pytest.MonkeyPatch, grown: float
) -> None:
    """Steps that one more rounding of M, C, K changes by more than the response say nothing, and it is said."""
    model = hydromount()
    stiffness = float(model.K.sum())

    def run_away(model: SecondOrderModel, plan: tuple[radau.Segment, ...]) -> FloatArray:
        exact = radau.descriptor_step_response(model, plan)
        exact[:, :, -1] += grown * (float(model.K.sum()) / stiffness - 1.0 + EPS)
        return exact

    sys = system_of_model(model)
    monkeypatch.setattr(step_check, "descriptor_step_response", run_away)
    check = crosscheck(model, sys)
    assert check.verdict == "ok"
    assert check.step_worst == "not followed: rounding of M, C, K grows in its steps"
    assert "not followed" in repr(check)
    wrong = control.StateSpace(sys.A * (1 + 1e-6), sys.B, sys.C, sys.D)
    assert crosscheck(model, wrong).verdict == "failed"


def test_slow_motion_is_looked_at_beside_a_half_dof_that_is_fast_beyond_all_digits() -> None:
    """Poles near 1.4 rad/s beside one of 2e13, of which A says no more than that they are small."""
    model = mechss(np.diag([1.0, 0, 0]), np.diag([0.1, 1e-13, 0.5]), [[3, -1, -1], [-1, 2, 0], [-1, 0, 2]])
    sys = mech2ss(model)
    A = np.array(sys.A)
    A[tuple(np.argwhere(np.isclose(A, -3.0))[0])] *= 1.001
    check = crosscheck(model, control.ss(A, sys.B, sys.C, sys.D))
    assert crosscheck(model, sys).passed
    assert check.transfer_grade == Grade.FAILED
