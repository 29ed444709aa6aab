"""Prescribed motion: the three kinds agree, reactions balance, names stay unique, refusals name the DOF."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, crosscheck, exact_reduction, hydromount, lqr, mech2ss, mechss
from halfdof_ctrl.base.errors import (
    ImproperError,
    ParameterError,
    SignalNameError,
    SingularLeadingMatrixError,
    WeightError,
)
from halfdof_ctrl.model.motion import KINDS, MotionKind
from halfdof_ctrl.plots.units import known_units
from support import exact
from support.structures import Structure, damped_structures, structures

ROUNDOFF = 1e-12  # direct solves of small matrices with small integer entries
EXACT = 1e-10  # the same with n <= 8 and conditions up to 1e6
POINTS = np.array([0.3j, 1.1j, 4.7j, 0.6 + 0.2j])
ORDERS: dict[MotionKind, int] = {"displacement": 0, "velocity": 1, "acceleration": 2}
SUFFIXES = ("", "_dot", "_ddot")
SEEDS = st.integers(0, 2**32 - 1)


def chain() -> SecondOrderModel:
    """Give a mass of 2 kg on a foot, by a spring of 8 N/m beside a damper of 3 N s/m; the foot weighs 5 kg."""
    return mechss(np.diag([2, 5]), [[3, -3], [-3, 3]], [[8, -8], [-8, 8]], dofs=["mass", "foot"])


def everything(model: SecondOrderModel, driven: list[str], kind: MotionKind) -> SecondOrderModel:
    """Prescribe a motion and show all displacements and the reactions, with the forces on all DOFs beside it."""
    inputs = [f"F_{dof}" for dof in model.dofs] + [dof + SUFFIXES[ORDERS[kind]] for dof in driven]
    outputs = [*model.dofs, *[f"R_{dof}" for dof in driven]]
    return model.prescribe_motion(driven, kind, inputs=inputs, outputs=outputs)


def some_dofs(model: SecondOrderModel, seed: int) -> list[str]:
    """Draw DOFs to be driven, not all."""
    generator = np.random.default_rng(seed)
    count = int(generator.integers(1, len(model.dofs)))
    return [str(name) for name in generator.choice(model.dofs, size=count, replace=False)]


def state_space(model: SecondOrderModel) -> tuple[Any, set[tuple[str, str, int]] | None]:
    """Give the state space and the improper pairs, of which there are none if there is one; None if W is singular."""
    try:
        return mech2ss(model), set()
    except ImproperError as refusal:
        return None, set(refusal.pairs)
    except SingularLeadingMatrixError:
        return None, None


# --- closed forms ----------------------------------------------------------------------------------------------


def test_base_excitation_has_the_textbook_transfer_functions() -> None:
    """Mass on a moved foot: ``q = (c s + k) / (m s^2 + c s + k) u``, reaction ``m s^2 q + m_foot s^2 u``."""
    model = chain().prescribe_motion("foot", outputs=["mass", "mass_ddot", "R_foot"])
    ratio = (3 * POINTS + 8) / (2 * POINTS**2 + 3 * POINTS + 8)
    desired = [ratio, POINTS**2 * ratio, 2 * POINTS**2 * ratio + 5 * POINTS**2]
    assert model.dofs == ("mass",)
    assert_allclose(model(POINTS)[:, 0], desired, rtol=ROUNDOFF)


def test_plain_call_goes_from_the_motion_to_its_reaction() -> None:
    """Of forces and motions, which `select` brings back, none is left; the matrices are those of the rest."""
    model = hydromount().prescribe_motion("y")
    assert (model.dofs, model.inputs, model.outputs) == (("y1", "y2"), ("y",), ("R_y",))
    assert (model.name, model.prescribed) == ("hydromount", ("y",))
    assert_array_equal(model.K, [[1000, 0], [0, 1000]])
    assert_array_equal(model.B, [[0], [500]])
    assert_array_equal(model.Bv, [[100], [0]])
    assert_array_equal(model.quadratics.D, [[[5500]], [[100]], [[20]]])
    assert "motion prescribed: y" in repr(model)
    assert model.select(["y", "F_y1"], ["y2_dot", "R_y"]).inputs == ("y", "F_y1")


@pytest.mark.parametrize(("kind", "inputs"), [("velocity", ("y_dot",)), ("acceleration", ("y_ddot",))])
def test_integrators_keep_the_dof(kind: MotionKind, inputs: tuple[str, ...]) -> None:
    """The DOF's own equation becomes ``q' = u`` or ``q'' = u``, and no other equation has that derivative."""
    model = hydromount().prescribe_motion("y", kind)
    assert (model.dofs, model.inputs, model.outputs) == (("y", "y1", "y2"), inputs, ("R_y",))
    order = ORDERS[kind]
    for power, matrix in enumerate(model.quadratics.P):
        assert_array_equal(matrix[0], [float(power == order), 0, 0])
        if power >= order:
            assert_array_equal(matrix[1:, 0], [0, 0])


def test_acceleration_gives_a_state_space_where_displacement_cannot() -> None:
    """The reaction of a mass follows the second derivative: improper by order 2, 1, and proper."""
    for kind, growth in (("displacement", 2), ("velocity", 1)):
        with pytest.raises(ImproperError, match="prescribe the acceleration instead") as refusal:
            mech2ss(hydromount().prescribe_motion("y", kind))  # type: ignore[arg-type]
        assert refusal.value.pairs[0][2] == growth
    model = hydromount().prescribe_motion("y", "acceleration")
    sys = mech2ss(model)
    assert sys.state_labels == ["y", "y1", "y2", "y_dot"]
    assert sys.D.item() == 20.0
    assert crosscheck(model, sys).passed


def test_mount_without_mass_needs_no_integrator() -> None:
    """``500 (39 s^2 + 455 s + 1050) / ((s + 10)(3 s + 10))``: two states, 6500 N/m at once, poles -10 and -10/3."""
    sys = mech2ss(hydromount(m=0).prescribe_motion("y"))
    assert_allclose(np.sort(np.linalg.eigvals(sys.A)), [-10, -10 / 3], rtol=ROUNDOFF)
    s = POINTS[:, None, None]
    values = sys.C @ np.linalg.solve(s * np.eye(2) - sys.A, np.broadcast_to(sys.B, (4, 2, 1))) + sys.D
    desired = 500 * (39 * POINTS**2 + 455 * POINTS + 1050) / ((POINTS + 10) * (3 * POINTS + 10))
    assert_allclose(values[:, 0, 0], desired, rtol=ROUNDOFF)


def test_motion_of_a_removed_dof_is_a_direct_term() -> None:
    """Displacement, velocity and acceleration of the moved DOF are 1, s and s^2 times it."""
    model = chain().prescribe_motion("foot", outputs=["foot", "foot_dot", "foot_ddot"])
    assert_array_equal(model.D[:, 0] + 2 * model.Dv[:, 0] + 3 * model.Da[:, 0], [1, 2, 3])


def test_force_on_a_moved_dof_goes_into_its_reaction() -> None:
    """``r = ... - F``, at every frequency; it moves nothing."""
    model = chain().prescribe_motion("foot", inputs="F_foot", outputs=["R_foot", "mass"])
    assert_array_equal(model(POINTS)[:, 0], [[-1.0] * 4, [0.0] * 4])


# --- properties ------------------------------------------------------------------------------------------------


@given(structure=structures(smallest=2, largest=5), seed=SEEDS)
def test_velocity_and_acceleration_are_displacement_times_s(structure: Structure, seed: int) -> None:
    """At exact rational points: ``H_displacement = s H_velocity = s^2 H_acceleration``, with forces unchanged."""
    model = structure.model()
    driven = some_dofs(model, seed)
    by_kind: dict[MotionKind, SecondOrderModel] = {kind: everything(model, driven, kind) for kind in KINDS}
    displaced = by_kind["displacement"]
    if exact.order(displaced.M, displaced.C, displaced.K) < 0:
        return
    s = Fraction(3, 8)  # a float too
    desired = exact.transfer(displaced, float(s))[:, :, 0]
    for kind, power in ORDERS.items():
        actual = exact.transfer(by_kind[kind], float(s))[:, :, 0]
        actual[:, len(model.dofs) :] *= float(s) ** power
        assert_allclose(actual, desired, rtol=4 * np.finfo(float).eps)  # rounded once on either side


@given(structure=structures(smallest=2, largest=6), seed=SEEDS, kind=st.sampled_from(KINDS))
def test_reaction_as_a_force_makes_the_prescribed_motion(structure: Structure, seed: int, kind: MotionKind) -> None:
    """All DOFs move as in the free model under ``F + R``: ``P q = F + R``, with q as prescribed."""
    model = structure.model()
    driven = some_dofs(model, seed)
    new = everything(model, driven, kind)
    if exact.order(new.M, new.C, new.K) < 0:
        return
    n, places = len(model.dofs), [model.dofs.index(dof) for dof in driven]
    for s in POINTS:
        values = exact.transfer(new, s)[:, :, 0]
        q, reaction = values[:n], values[n:]
        forces = np.hstack([np.eye(n), np.zeros((n, len(driven)))]) + np.eye(n)[:, places] @ reaction
        P = model.K + s * model.C + s**2 * model.M
        size = np.abs(P) @ np.abs(q) + np.abs(forces)
        assert (np.abs(P @ q - forces) <= EXACT * size).all()
        prescribed = np.hstack([np.zeros((len(driven), n)), np.eye(len(driven)) / s ** ORDERS[kind]])
        assert_allclose(q[places], prescribed, rtol=ROUNDOFF, atol=ROUNDOFF)


@given(structure=structures(smallest=2, largest=6), seed=SEEDS, kind=st.sampled_from(KINDS))
def test_evaluation_and_state_space_equal_exact_arithmetic(structure: Structure, seed: int, kind: MotionKind) -> None:
    """``model(s)``, and the state space where `mech2ss` gives one; improper pairs are those of the exact growth."""
    model = everything(structure.model(), some_dofs(structure.model(), seed), kind)
    if exact.order(model.M, model.C, model.K) < 0:
        return
    desired = exact.transfer(model, POINTS)
    size = np.abs(desired).max()
    assert_allclose(model(POINTS, squeeze=False), desired, rtol=0.0, atol=EXACT * size)
    sys, pairs = state_space(model)
    growth = exact.growth(model)
    if pairs is not None:
        assert pairs == {(model.inputs[j], model.outputs[i], growth[i, j]) for i, j in np.argwhere(growth > 0).tolist()}
    if sys is None:
        return
    for k, s in enumerate(POINTS):
        values = sys.C @ np.linalg.solve(s * np.eye(sys.nstates) - sys.A, sys.B) + sys.D
        assert_allclose(values, desired[:, :, k], rtol=0.0, atol=EXACT * size)


@given(structure=damped_structures(smallest=2), seed=SEEDS, kind=st.sampled_from(KINDS[1:]))
def test_integrators_add_one_or_two_states_a_dof(structure: Structure, seed: int, kind: MotionKind) -> None:
    """The order is that of the model with the DOFs held, plus one or two for each of them."""
    model = structure.model()
    driven = some_dofs(model, seed)
    held = exact_reduction(model.prescribe_motion(driven)).order
    assert exact_reduction(model.prescribe_motion(driven, kind)).order == held + ORDERS[kind] * len(driven)


@given(structure=structures(smallest=3, largest=5), kinds=st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)))
def test_one_after_the_other_is_both_at_once(structure: Structure, kinds: tuple[MotionKind, MotionKind]) -> None:
    """Prescribing q0 and then q1 keeps the input and the reaction of q0, whatever the kinds."""
    model = structure.model()
    both = model.prescribe_motion(["q0", "q1"])
    if exact.order(both.M, both.C, both.K) < 0:
        return
    turns = model.prescribe_motion("q0", kinds[0]).prescribe_motion("q1", kinds[1])
    assert turns.inputs == ("q0" + SUFFIXES[ORDERS[kinds[0]]], "q1" + SUFFIXES[ORDERS[kinds[1]]])
    assert turns.outputs == ("R_q0", "R_q1")
    s = 0.375
    times = [s ** ORDERS[kind] for kind in kinds]
    assert_allclose(
        exact.transfer(turns, s)[:, :, 0] * times, exact.transfer(both, s)[:, :, 0], rtol=4 * np.finfo(float).eps
    )


@given(seed=SEEDS, kind=st.sampled_from(KINDS), damping=st.booleans())
def test_all_twelve_matrices_are_carried_over(seed: int, kind: MotionKind, *, damping: bool) -> None:
    """Own inputs with derivatives, own outputs with accelerations and direct terms, structural damping."""
    generator = np.random.default_rng(seed)
    M, C, K = (generator.integers(-3, 4, (4, 4)) + 9 * np.eye(4) for _ in range(3))
    B, Bv, Ba = generator.integers(-3, 4, (3, 4, 2))
    F, G, H = generator.integers(-3, 4, (3, 2, 4))
    D, Dv, Da = generator.integers(-3, 4, (3, 2, 2))
    stiffness = np.asarray(K * (1 + 0.25j) if damping else K)
    model = mechss(
        M, C, stiffness, B, F, G, H=H, D=D, Bv=Bv, Ba=Ba, Dv=Dv, Da=Da, inputs=["a", "b"], outputs=["c", "d"]
    )
    new = model.prescribe_motion("q2", kind)
    assert (new.inputs, new.outputs) == (("a", "b", "q2" + SUFFIXES[ORDERS[kind]]), ("c", "d", "R_q2"))
    s = POINTS[3]
    P, Bs, Fs, Ds = (
        part[0] + s * part[1] + s**2 * part[2] for part in ((stiffness, C, M), (B, Bv, Ba), (F, G, H), (D, Dv, Da))
    )
    f, g = [0, 1, 3], [2]
    unit = np.eye(3)[:, 2:] / s ** ORDERS[kind]  # of the displacement, per (a, b, motion)
    q = np.zeros((4, 3), dtype=complex)
    q[g] = unit.T
    forces = np.hstack([Bs, np.zeros((4, 1))])
    q[f] = np.linalg.solve(P[np.ix_(f, f)], forces[f] - P[np.ix_(f, g)] @ q[g])
    desired = np.vstack([Fs @ q + np.hstack([Ds, np.zeros((2, 1))]), P[g] @ q - forces[g]])
    assert_allclose(new(s), desired, rtol=0.0, atol=EXACT * np.abs(desired).max())


def test_model_stays_real_where_the_rest_is() -> None:
    """Structural damping between the moved DOF and the ground leaves real M, C, K, B and a complex D."""
    model = mechss(np.eye(2), None, np.array([[2, -1], [-1, 3 + 0.5j]])).prescribe_motion("q1")
    assert model.complex_matrices == ("D",)


# --- what else takes such models -------------------------------------------------------------------------------


def test_units_of_a_prescribed_motion_are_those_of_its_dof() -> None:
    """Also of a removed DOF, and its reaction's."""
    units = known_units(chain().prescribe_motion("foot"), {"foot": "rad"})
    assert (units["foot"], units["foot_ddot"], units["R_foot"], units["F_mass"]) == ("rad", "rad/s^2", "N m", "N")
    assert "R_mass" not in units


def test_energy_of_a_moved_model_is_no_weight() -> None:
    """It depends on the motion, not on the states alone."""
    with pytest.raises(WeightError, match="The motion of foot is prescribed"):
        lqr(chain().prescribe_motion("foot", "acceleration", outputs="mass"), energy=1.0, effort={"foot_ddot": 1.0})


# --- refusals --------------------------------------------------------------------------------------------------

REFUSALS = [
    ({"dof": "y3"}, "The model has no DOF 'y3'. Known: y, y1, y2"),
    ({"dof": ["y", "y"]}, "Names of DOFs must differ, but y stands more than once"),
    ({"dof": []}, "No DOF is named"),
    ({"dof": ["y", 1]}, "The model has no DOF '1'"),
    ({"dof": ["y", 1.0]}, "Names of DOFs must be non-empty text"),
    ({"dof": ["y", "y1", "y2"]}, "With the displacement of y, y1, y2 prescribed no DOF is left"),
    ({"dof": "y", "inputs": "F_z"}, "The model has no input 'F_z'"),
    ({"dof": "y", "outputs": "z"}, "The model has no output 'z'"),
    ({"dof": "y", "inputs": []}, "No input is selected"),
    ({"dof": "y", "outputs": ["R_y", "R_y"]}, "Names of outputs must differ"),
]


@pytest.mark.parametrize(("options", "words"), REFUSALS)
def test_wrong_names_are_refused(options: dict[str, object], words: str) -> None:
    """Unknown, twice, none, all."""
    with pytest.raises(SignalNameError, match=words):
        hydromount().prescribe_motion(**options)  # type: ignore[arg-type]


def test_unknown_kind_is_refused() -> None:
    """With the three that there are."""
    with pytest.raises(ParameterError, match="kind must be one of displacement, velocity, acceleration, not 'speed'"):
        hydromount().prescribe_motion("y", "speed")  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", KINDS)
def test_dof_has_one_motion_and_no_force(kind: MotionKind) -> None:
    """Once prescribed it can be neither prescribed again nor pushed."""
    model = hydromount().prescribe_motion("y", kind)
    with pytest.raises(SignalNameError, match="The motion of y is prescribed already"):
        model.prescribe_motion("y")
    with pytest.raises(SignalNameError, match="F_y acts on a DOF whose motion is prescribed"):
        model.select(inputs="F_y")
    kept = hydromount().prescribe_motion("y", kind, inputs=["F_y", "y" + SUFFIXES[ORDERS[kind]]])
    assert kept.select(inputs="F_y").inputs == ("F_y",)


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (mechss(np.eye(2), None, np.eye(2), dofs=["x", "R_x"]), "The new output would be called R_x"),
        (mechss(np.eye(2), None, np.eye(2), dofs=["a", "F_a"]), "The new input would be called F_a"),
        (
            mechss(np.eye(2), None, np.eye(2), [[2], [1]], dofs=["x", "z"], inputs="x"),
            "The new input would be called x",
        ),
    ],
)
def test_taken_names_are_refused(model: SecondOrderModel, words: str) -> None:
    """A DOF called like a reaction or a force, an input called like the motion."""
    with pytest.raises(SignalNameError, match=words):
        model.prescribe_motion(model.dofs[1] if model.dofs[1].startswith("F_") else model.dofs[0])


def test_original_model_is_unchanged() -> None:
    """Frozen, with arrays that are locked in the new one too."""
    model = hydromount()
    new = model.prescribe_motion("y", "velocity")
    assert model.inputs == ("F_y", "F_y1", "F_y2")
    with pytest.raises(ValueError, match="read-only"):
        new.K[0, 0] = 1.0
    assert replace(new, name=None).prescribed == ("y",)
