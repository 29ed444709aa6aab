"""Dynamic stiffness and transmissibility against closed forms, reciprocity, and the free model."""

from fractions import Fraction

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csc_array

from halfdof_ctrl import (
    SecondOrderModel,
    descriptor_response,
    dynamic_stiffness,
    hydromount,
    mechss,
    pencil_structure,
    transmissibility,
)
from halfdof_ctrl.base.errors import ParameterError, SignalNameError, SingularPencilError
from halfdof_ctrl.systems.phase import response_phase
from halfdof_ctrl.systems.stiffness import (
    TransmissibilityKind,
    dynamic_stiffness_response,
    motion_frequencies,
    transmissibility_response,
)
from support import exact
from support.structures import Structure, assembly, damped_structures, on_axis, passive, structures

ROUNDOFF = 1e-12  # direct solves of small matrices with small integer entries
EXACT = 1e-10  # the same with n <= 8 and conditions up to 1e6
POINTS = np.array([0.3j, 1.1j, 4.7j, 0.6 + 0.2j])
RIG = np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 200)])  #: [rad/s], far beyond what a test rig does
SEEDS = st.integers(0, 2**32 - 1)


def on_a_foot(m: float = 2.0, c: float = 3.0, k: float = 8.0) -> SecondOrderModel:
    """Give a mass on a massless foot, by a spring beside a damper."""
    return mechss(np.diag([m, 0]), [[c, -c], [-c, c]], [[k, -k], [-k, k]], dofs=["mass", "foot"])


def mount(s: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
    """Give the dynamic stiffness of the paper's mount without its mass, by hand."""
    return np.asarray(500 * (39 * s**2 + 455 * s + 1050) / ((s + 10) * (3 * s + 10)))


# --- closed forms ----------------------------------------------------------------------------------------------


def test_mount_without_mass_has_its_closed_form() -> None:
    """``500 (39 s^2 + 455 s + 1050) / ((s + 10)(3 s + 10))`` on both axes, from M, C, K and from hydromount."""
    full = hydromount()
    for model in (hydromount(m=0), mechss(None, full.C, full.K, dofs=full.dofs)):
        for s in (on_axis(RIG), RIG + 0j):
            assert_allclose(dynamic_stiffness(model, "y", s), mount(s), rtol=ROUNDOFF)


def test_mount_is_5250_at_rest_and_6500_at_high_frequency() -> None:
    """The springs K_v and K_s in series beside K_r; K_r, K_rs and K_v side by side."""
    assert complex(dynamic_stiffness(hydromount(m=0), "y", 0)) == 5250.0
    assert_allclose(dynamic_stiffness(hydromount(m=0), "y", 1e5j), 6500.0, rtol=1e-3)


def test_mass_on_the_mount_adds_m_s_squared() -> None:
    """The stiffness of the loaded mount is that of the mount plus ``20 s^2``."""
    assert_allclose(dynamic_stiffness(hydromount(), "y", POINTS), mount(POINTS) + 20 * POINTS**2, rtol=ROUNDOFF)


def test_single_dof_has_the_stiffness_of_its_matrices() -> None:
    """``K + C s + M s^2``, where no other DOF is left; several DOFs that move together have the sum of P(s)."""
    assert_allclose(dynamic_stiffness(mechss([[2]], [[3]], [[5]]), "q0", POINTS), 2 * POINTS**2 + 3 * POINTS + 5)
    model = hydromount()
    total = sum((matrix.sum() * POINTS**power for power, matrix in enumerate(model.quadratics.P)), start=0j)
    assert_allclose(dynamic_stiffness(model, ["y", "y1", "y2"], POINTS), total, rtol=ROUNDOFF)


@given(m=st.integers(1, 9), c=st.integers(0, 9), k=st.integers(1, 9))
def test_base_excitation_has_the_textbook_transmissibility(m: int, c: int, k: int) -> None:
    """``(c s + k) / (m s^2 + c s + k)``, of motion from the foot up and of force from the mass down."""
    desired = (c * POINTS + k) / (m * POINTS**2 + c * POINTS + k)
    model = on_a_foot(m, c, k)
    assert_allclose(transmissibility(model, "foot", "mass", POINTS), desired, rtol=ROUNDOFF)
    assert_allclose(transmissibility(model, "mass", "foot", POINTS, kind="force"), desired, rtol=ROUNDOFF)


def test_structural_damping_is_evaluated_as_it_is() -> None:
    """A spring ``k (1 + i eta)`` has the loss angle ``atan eta`` at every frequency."""
    model = mechss(None, None, [[100 * (1 + 0.2j)]])
    assert_allclose(np.angle(dynamic_stiffness(model, "q0", POINTS)), np.arctan(0.2), rtol=ROUNDOFF)


def test_two_feet_that_move_together_carry_the_mass_in_parallel() -> None:
    """Springs of 3 and 5 N/m to two feet: the mass follows by ``8 / (2 s^2 + 8)``."""
    K = [[8, -3, -5], [-3, 3, 0], [-5, 0, 5]]
    model = mechss(np.diag([2, 0, 0]), None, K, dofs=["mass", "left", "right"])
    desired = 8 / (2 * POINTS**2 + 8)
    assert_allclose(transmissibility(model, ["left", "right"], "mass", POINTS), desired, rtol=ROUNDOFF)
    assert_allclose(transmissibility(model, "mass", ["left", "right"], POINTS, kind="force"), desired, rtol=ROUNDOFF)
    stiffness = dynamic_stiffness(model, ["left", "right"], POINTS)
    assert_allclose(stiffness, desired * 2 * POINTS**2, rtol=ROUNDOFF)


def test_dof_follows_itself() -> None:
    """Motion of a DOF per motion of it, and the force on a held DOF, are 1."""
    assert_array_equal(transmissibility(hydromount(), "y", "y", POINTS), np.ones(4))
    assert_array_equal(transmissibility(hydromount(), "y", "y", POINTS, kind="force"), np.ones(4))


def test_undamped_resonance_of_the_others_is_infinite() -> None:
    """``inf + nan j`` there alone, as in the transfer function: an absorber of 1 kg on 4 N/m at 2 rad/s."""
    model = mechss(np.eye(2), None, [[8, -4], [-4, 4]], dofs=["a", "absorber"])
    values = dynamic_stiffness(model, "a", [1j, 2j, 3j])
    assert np.isinf(values.real).tolist() == [False, True, False]
    assert_allclose(values[[0, 2]], [8 - 1 - 16 / 3, 8 - 9 + 16 / 5], rtol=ROUNDOFF)


# --- properties ------------------------------------------------------------------------------------------------


@given(structure=damped_structures(), seed=SEEDS)
def test_receptance_times_dynamic_stiffness_is_one(structure: Structure, seed: int) -> None:
    """Driving one DOF by its reaction makes the prescribed motion: ``(q/F) K* = 1``."""
    model = structure.model()
    dof = model.dofs[seed % len(model.dofs)]
    receptance = model.select(f"F_{dof}", dof)(POINTS)
    assert_allclose(dynamic_stiffness(model, dof, POINTS) * receptance, np.ones(4), rtol=EXACT)


@given(structure=structures(smallest=2, largest=6), seed=SEEDS)
def test_values_equal_exact_rational_arithmetic(structure: Structure, seed: int) -> None:
    """Both against the prescribed model at exact points, relative to the terms that they are summed of."""
    model = structure.model()
    dof, other = (model.dofs[(seed + k) % len(model.dofs)] for k in range(2))
    new = model.prescribe_motion(dof, outputs=[f"R_{dof}", other])
    assume(exact.order(new.M, new.C, new.K) >= 0)
    desired = exact.transfer(new, POINTS)[:, 0]
    size = np.maximum(np.abs(desired), np.abs(new.D + POINTS * new.Dv + POINTS**2 * new.Da))
    assert (np.abs(dynamic_stiffness(model, dof, POINTS) - desired[0]) <= EXACT * size.max()).all()
    assert (np.abs(transmissibility(model, dof, other, POINTS) - desired[1]) <= EXACT * size.max()).all()


@given(structure=structures(passive, assembly, smallest=2, largest=6), seed=SEEDS)
def test_force_and_motion_are_reciprocal(structure: Structure, seed: int) -> None:
    """For symmetric M, C, K the force that arrives at b of one on a is the motion that a makes of one of b."""
    model = structure.model()
    a, b = (model.dofs[(seed + k) % len(model.dofs)] for k in range(2))
    held = model.prescribe_motion(b)
    assume(exact.order(held.M, held.C, held.K) >= 0)
    motion = transmissibility(model, b, a, POINTS)
    force = transmissibility(model, a, b, POINTS, kind="force")
    size = max(1.0, np.abs(motion).max())  # a ratio that is zero comes of terms that cancel
    assert_allclose(force, motion, rtol=0.0, atol=EXACT * size)


@given(structure=damped_structures(smallest=3), kind=st.sampled_from(["displacement", "velocity", "acceleration"]))
def test_prescribed_motions_are_held_at_rest(structure: Structure, kind: str) -> None:
    """With q0 prescribed the others have the stiffness of the model without q0, whatever the input is."""
    model = structure.model()
    held = mechss(*(matrix[1:, 1:] for matrix in structure.matrices), dofs=model.dofs[1:])
    moved = model.prescribe_motion("q0", kind)  # type: ignore[arg-type]
    desired = dynamic_stiffness(held, "q1", POINTS)
    assert_allclose(dynamic_stiffness(moved, "q1", POINTS), desired, rtol=ROUNDOFF)
    assert_allclose(motion_frequencies([moved], "q1", free=True), motion_frequencies([held], "q1", free=True))


@given(powers=st.lists(st.integers(-9, 9), min_size=3, max_size=3))
def test_units_of_other_dofs_do_not_matter(powers: list[int]) -> None:
    """In units of 10^k of each DOF and its force the stiffness has the units of its own DOF alone."""
    S = np.diag(10.0 ** np.array(powers))
    mount = hydromount()
    scaled = mechss(S @ mount.M @ S, S @ mount.C @ S, S @ mount.K @ S, dofs=mount.dofs)
    desired = dynamic_stiffness(mount, "y", POINTS) * 10.0 ** (2 * powers[0])
    assert_allclose(dynamic_stiffness(scaled, "y", POINTS), desired, rtol=ROUNDOFF)


@pytest.mark.parametrize("s", [1j, 0, [1j], [1j, 2j], np.zeros(0)])
def test_values_have_the_shape_of_the_points(s: npt.ArrayLike) -> None:
    """A number for a number, as of a transfer function with one input and output."""
    reference = np.shape(hydromount().select("F_y", "y")(s))
    assert np.shape(dynamic_stiffness(hydromount(), "y", s)) == reference
    assert np.shape(transmissibility(hydromount(), "y", "y1", s)) == reference


# --- responses and frequencies ---------------------------------------------------------------------------------


def test_responses_carry_names_and_values() -> None:
    """From the motion to the reaction; full stops as python-control takes them; several DOFs joined."""
    model = mechss(np.eye(2), None, [[2, -1], [-1, 1]], dofs=["101.1", "b"], name="frame.v2")
    response = dynamic_stiffness_response(model, "101.1", RIG)
    assert (response.input_labels, response.output_labels, response.name) == (["101:1"], ["R_101:1"], "frame:v2")
    assert_array_equal(response.omega, RIG)
    assert_array_equal(np.asarray(response.frdata)[0, 0], dynamic_stiffness(model, "101.1", 1j * RIG))
    response = transmissibility_response(model, "b", "101.1", [1.0, 2.0])
    assert (response.input_labels, response.output_labels) == (["b"], ["101:1"])
    response = transmissibility_response(model, "b", ["101.1"], [1.0, 2.0], kind="force")
    assert (response.input_labels, response.output_labels) == (["F_b"], ["R_101:1"])
    assert dynamic_stiffness_response(model, ["101.1", "b"], [1.0]).input_labels == ["101:1+b"]


def test_response_is_that_of_the_prescribed_model() -> None:
    """The same as `descriptor_response` of `prescribe_motion`."""
    desired = np.asarray(descriptor_response(hydromount().prescribe_motion("y"), RIG).frdata)
    assert_allclose(np.asarray(dynamic_stiffness_response(hydromount(), "y", RIG).frdata), desired, rtol=ROUNDOFF)


def test_frequencies_show_the_modes_of_all_models() -> None:
    """A tenth to ten times the modes with the DOF held, and with `free` those of the free models; linear from 0."""
    models = [hydromount(C_h=c) for c in (300.0, 3.0)]  # with y held: -10 and -1000 / C_h
    grid = motion_frequencies(models, "y")
    assert_allclose(grid[[0, -1]], [1 / 3, 10 * 1000 / 3], rtol=ROUNDOFF)
    sizes = np.abs(np.concatenate([pencil_structure(model).finite_eigenvalues for model in models]))
    assert_allclose(motion_frequencies(models, "y", free=True)[0], sizes.min() / 10, rtol=ROUNDOFF)
    even = motion_frequencies(models, "y", linear=True)
    assert_allclose(even[[0, -1]], [0.0, 4 * 1000 / 3], rtol=ROUNDOFF)


def test_frequencies_of_default_responses_are_these() -> None:
    """With the free modes for the stiffness, without them for the transmissibility, of motion and of force."""
    model = on_a_foot()
    free = motion_frequencies([model], "mass", free=True)
    assert_array_equal(dynamic_stiffness_response(model, "mass").omega, free)
    up, down = (
        transmissibility_response(model, "foot", "mass"),
        transmissibility_response(model, "mass", "foot", kind="force"),
    )
    assert_array_equal(up.omega, motion_frequencies([model], "foot", other="mass"))
    assert_array_equal(down.omega, up.omega)


# --- refusals --------------------------------------------------------------------------------------------------


def test_others_that_float_free_are_refused_by_name() -> None:
    """With a held, nothing resists b; with b held nothing floats, and b has no stiffness."""
    model = mechss(np.diag([1, 0]), None, np.diag([3, 0]), dofs=["a", "b"])
    with pytest.raises(SingularPencilError, match="The pencil is singular") as refusal:
        dynamic_stiffness(model, "a", 1j)
    assert refusal.value.dofs == ("b",)
    with pytest.raises(SingularPencilError, match="DOF b can move"):
        transmissibility(model, "a", "b", 1j)
    assert complex(dynamic_stiffness(model, "b", 1j)) == 0.0


@pytest.mark.parametrize(
    ("from_", "to", "kind", "error", "words"),
    [
        ("z", "y", "motion", SignalNameError, "no DOF 'z'"),
        ("y", "z", "motion", SignalNameError, "no DOF 'z'"),
        ("y", "z", "force", SignalNameError, "no DOF 'z'"),
        (["y", "y"], "y1", "motion", SignalNameError, "y stands more than once"),
        ("y", ["y1", "y2"], "motion", ParameterError, "to must be a single DOF for the transmissibility of motion"),
        (["y", "y1"], "y2", "force", ParameterError, "from_ must be a single DOF for the transmissibility of force"),
        ("y", "y1", "power", ParameterError, "kind must be motion or force, not 'power'"),
    ],
)
def test_wrong_transmissibilities_are_refused(
    from_: str, to: str, kind: str, error: type[ValueError], words: str
) -> None:
    """Unknown DOFs, and several where there can be but one."""
    with pytest.raises(error, match=words):
        transmissibility(hydromount(), from_, to, 1j, kind=kind)  # type: ignore[arg-type]


def test_wrong_points_and_dofs_are_refused() -> None:
    """Prescribed already, unknown, two dimensions, negative frequencies."""
    with pytest.raises(SignalNameError, match="The motion of y is prescribed already"):
        dynamic_stiffness(hydromount().prescribe_motion("y"), "y", 1j)
    with pytest.raises(SignalNameError, match="no DOF 'q'"):
        dynamic_stiffness(hydromount(), "q", 1j)
    with pytest.raises(ValueError, match="s must be a number or a 1D array"):
        dynamic_stiffness(hydromount(), "y", [[1j]])
    with pytest.raises(ParameterError, match="omega must be"):
        dynamic_stiffness_response(hydromount(), "y", [-1.0])


def test_reciprocal_of_the_static_receptance_at_an_exact_point() -> None:
    """At s = 1/2 of the loaded mount, against the determinant quotient in rational arithmetic."""
    model, s = hydromount(), Fraction(1, 2)
    desired = 1 / exact.transfer(model.select("F_y", "y"), float(s))[0, 0, 0]
    assert_allclose(dynamic_stiffness(model, "y", float(s)), desired, rtol=ROUNDOFF)


@pytest.mark.parametrize("kind", ["motion", "force"])
def test_sparse_models_have_the_transmissibility_and_phase_of_dense_ones(kind: TransmissibilityKind) -> None:
    """A chain of four masses on dampers as sparse matrices: values, and the branch of the phase, whichever is moved."""
    K = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    dense = mechss(np.diag([1.0, 2.0, 0.0, 1.0]), 0.02 * K, K)
    sparse = mechss(*map(csc_array, (dense.M, dense.C, dense.K)))
    assert sparse.is_sparse
    one, other = (
        transmissibility_response(model, "q0", "q3", [0.01, 0.7, 1.3, 40.0], kind=kind) for model in (sparse, dense)
    )
    assert_allclose(one.frdata, other.frdata, rtol=EXACT)
    assert_allclose(response_phase(one), response_phase(other), atol=1e-9)
    assert (one.input_labels, one.output_labels) == (other.input_labels, other.output_labels)
    stiff, desired = (dynamic_stiffness_response(model, "q0", [0.01, 0.7, 40.0]) for model in (sparse, dense))
    assert_allclose(stiff.frdata, desired.frdata, rtol=EXACT)
    assert_allclose(response_phase(stiff), response_phase(desired), atol=1e-9)
