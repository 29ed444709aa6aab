"""From a model to `control.StateSpace`: labels, outputs with direct terms, improper pairs by name."""

import copy

import control
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import exact_reduction, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    ImproperError,
    MatrixError,
    SignalNameError,
    SingularPencilError,
    UncertainRankError,
)
from halfdof_ctrl.systems import state_space
from halfdof_ctrl.systems.state_map import States
from support import exact
from support.comparison import POINTS, assert_same_transfer, response
from support.structures import Structure, assembly, damped_structures, null_columns, passive, structures

EPS = float(np.finfo(float).eps)
TRANSFER = 1e-10  # design, section 7
LOSS = 1e3  # times eps / rcond(W): two derivatives multiply by A twice
ROUNDOFF = 1e-12  # small well-conditioned models
EVERY = ("", "_dot", "_ddot")


def test_result_is_a_plain_state_space_with_physical_labels() -> None:
    """No subclass; states, inputs, outputs and the name come from the model."""
    sys = mech2ss(hydromount())
    assert type(sys) is control.StateSpace
    assert sys.state_labels == ["y", "y1", "y2", "y_dot"]
    assert sys.input_labels == ["F_y", "F_y1", "F_y2"]
    assert sys.output_labels == ["y", "y1", "y2"]
    assert sys.name == "hydromount"
    assert sys.isctime(strict=True)


def test_matrices_may_be_given_directly() -> None:
    """`mech2ss` takes the arguments of `mechss`."""
    M, C, K = np.eye(2), np.eye(2), 2 * np.eye(2)
    options = {"F": [[1, 0]], "G": [[0, 1]], "H": [[1, 1]], "D": [[5]], "dofs": ["a", "b"], "outputs": ["sum"]}
    sys = mech2ss(M, C, K, [1, 2], name="direct", **options)  # type: ignore[arg-type]
    model = mechss(M, C, K, [1, 2], name="direct", **options)  # type: ignore[arg-type]
    assert sys.output_labels == ["sum"]
    assert sys.name == "direct"
    assert_allclose(sys(POINTS), model(POINTS), rtol=ROUNDOFF)


def test_reduction_may_be_given_instead_of_the_model() -> None:
    """What was computed is not computed again, tolerance and method included."""
    model = mechss(np.diag([1.0, 1e-13]), np.eye(2), np.eye(2))
    assert mech2ss(exact_reduction(model, tol=1e-6)).nstates == 3


@pytest.mark.parametrize(
    ("option", "value"),
    [(option, np.eye(3)) for option in "CKBFGHD"]
    + [("dofs", ["a", "b", "c"]), ("inputs", ["a", "b", "c"]), ("outputs", ["a", "b", "c"]), ("name", "other")],
)
def test_model_brings_its_own_matrices_and_names(option: str, value: object) -> None:
    """Anything beside a model is refused instead of ignored."""
    with pytest.raises(SignalNameError, match="A model brings its matrices and names with it"):
        mech2ss(hydromount(), **{option: value})  # type: ignore[arg-type]


def test_acceleration_of_a_mass_has_its_direct_term() -> None:
    """``y'' = (F - ...) / m``: D is 1/m, for the half DOF's force too, through the damper."""
    sys = mech2ss(hydromount().select(outputs="y_ddot"))
    assert_allclose(sys.D, [[1 / 20, 1 / 20, 0]], rtol=ROUNDOFF)
    assert_allclose(sys.C, [[-275, -50, 25, 0]], rtol=ROUNDOFF)


@given(structure=damped_structures(), seed=st.integers(0, 2**32 - 1))
def test_proper_outputs_of_any_derivative_are_exact(structure: Structure, seed: int) -> None:
    """Displacements, velocities and accelerations of all DOFs from all forces, wherever they are proper."""
    model = structure.model()
    names = [dof + suffix for dof in model.dofs for suffix in EVERY]
    model = model.select(outputs=names)
    growth = exact.growth(model)
    cause = int(np.random.default_rng(seed).integers(0, structure.size))
    proper = np.flatnonzero(growth[:, cause] <= 0)
    assume(proper.size > 0)
    model = model.select(inputs=model.inputs[cause], outputs=[names[i] for i in proper])
    reduction = exact_reduction(model)
    desired = exact.transfer(model, POINTS)
    assert_same_transfer(response(mech2ss(reduction)), desired, TRANSFER + LOSS * EPS / reduction.rcond)


@given(structure=structures(assembly, null_columns, passive, largest=6))
def test_improper_pairs_are_exactly_those_that_grow(structure: Structure) -> None:
    """The refusal lists each (input, output, order of growth) of exact arithmetic, and no other."""
    model = structure.model()
    assume(exact.order(*structure.matrices) >= 0)
    assume(not exact.leading_matrix_is_singular(*structure.matrices))
    model = model.select(outputs=[dof + suffix for dof in model.dofs for suffix in EVERY])
    growth = exact.growth(model)
    expected = {(model.inputs[j], model.outputs[i], int(growth[i, j])) for i, j in np.argwhere(growth > 0).tolist()}
    if not expected:
        assert mech2ss(model).nstates == exact.order(*structure.matrices)
        return
    with pytest.raises(ImproperError, match="No state space has the improper transfer functions") as refusal:
        mech2ss(model)
    assert set(refusal.value.pairs) == expected


def test_improper_pair_is_named_with_its_order() -> None:
    """The velocity of a static DOF under its own force grows as s, its acceleration as s^2."""
    model = mechss(np.diag([1, 0]), None, [[2, -1], [-1, 1]], dofs=["mass", "tip"])
    with pytest.raises(ImproperError, match=r"tip_dot from F_tip \(grows as s\^1\), tip_ddot from F_tip") as refusal:
        mech2ss(model.select(outputs=["tip", "tip_dot", "tip_ddot"]))
    assert refusal.value.pairs == (("F_tip", "tip_dot", 1), ("F_tip", "tip_ddot", 2))
    assert mech2ss(model.select(inputs="F_mass", outputs="tip_ddot")).nstates == 2


def test_derivative_of_an_input_in_the_output_is_improper() -> None:
    """Dv and Da alone make a channel grow."""
    with pytest.raises(ImproperError, match=r"y\[0\] from F_q0 \(grows as s\^2\)"):
        mech2ss(mechss([[1]], [[1]], [[1]], F=[[1]], Dv=[[3]], Da=[[2]]))


def test_direct_derivatives_that_cancel_are_proper() -> None:
    """The transmitted force ``c (u' - q') + k (u - q)`` at a spring and damper without mass is zero."""
    model = mechss([[0]], [[3]], [[5]], [[5]], [[-5]], [[-3]], Bv=[[3]], D=[[5]], Dv=[[3]])
    assert_allclose(response(mech2ss(model)), 0.0, rtol=0.0, atol=ROUNDOFF)


def test_complex_model_is_refused_and_told_where_to_go() -> None:
    """Structural damping: the descriptor form computes it, a real state space cannot."""
    with pytest.raises(ComplexModelError, match="descriptor_response computes such a model exactly"):
        mech2ss([[1]], [[0]], [[1 + 0.1j]])


@pytest.mark.parametrize("letter", ["B", "F", "G", "H", "D"])
def test_complex_signals_are_refused_by_letter(letter: str) -> None:
    """Imaginary parts anywhere."""
    with pytest.raises(ComplexModelError, match=f"{letter} has imaginary parts"):
        mech2ss([[1]], [[0]], [[1]], **{letter: [[1j]]})  # type: ignore[arg-type]


def test_bad_matrices_are_refused_at_the_same_door() -> None:
    """What `mechss` refuses, `mech2ss` refuses."""
    with pytest.raises(MatrixError, match="K must be 2 x 2"):
        mech2ss(np.eye(2), np.eye(2), np.eye(3))
    with pytest.raises(SingularPencilError, match="The pencil is singular"):
        mech2ss(np.zeros((2, 2)), None, np.diag([1, 0]))


def test_massless_springs_become_a_static_gain() -> None:
    """No states, D is the flexibility, and no warning on the way, which would fail as any does."""
    sys = mech2ss(None, None, [[4]])
    assert sys.nstates == 0
    assert_array_equal(sys.D, [[0.25]])


def test_no_state_is_dropped_silently() -> None:
    """A mass that nothing acts on or measures keeps its states."""
    assert mech2ss(np.eye(2), None, np.eye(2), [1, 0], [1, 0]).nstates == 4


def test_system_can_be_copied_and_its_matrices_changed() -> None:
    """The StateSpace is the user's own: changing it does not reach the reduction."""
    reduction = exact_reduction(hydromount())
    sys = copy.deepcopy(mech2ss(reduction))
    before = reduction.A.copy()
    sys.A[0, 0] = 5.0
    assert_array_equal(reduction.A, before)


@pytest.mark.parametrize("power", [-150, -40, 40, 150])
def test_extreme_units_of_force_keep_the_poles(power: int) -> None:
    """M, C, K times 10^k: the same poles, the receptance divided."""
    mount = hydromount()
    factor = 10.0**power
    sys = mech2ss(mount.M * factor, mount.C * factor, mount.K * factor)
    assert_allclose(sys.A, mech2ss(mount).A, rtol=ROUNDOFF, atol=1e-13)
    assert_allclose(sys.D * factor, np.zeros((3, 3)), rtol=0.0, atol=ROUNDOFF)
    assert_allclose(sys.B * factor, mech2ss(mount).B, rtol=ROUNDOFF)


class Unsure:
    """A structure that rounding left in doubt, with the pairs that the oracle finds."""

    is_certain = False
    uncertainty = ("2 of 4 eigenvalues are in doubt",)

    def __init__(self, *pairs: tuple[str, str, int]) -> None:
        self.improper_pairs = pairs


def test_improper_pairs_that_the_oracle_does_not_find_are_uncertain(monkeypatch: pytest.MonkeyPatch) -> None:
    """A velocity of a static DOF grows; where the pencil of rounded numbers does not say so, that cannot be told."""
    model = mechss(np.diag([0.1, 0]), None, [[3, -1], [-1, 1]], dofs=["y", "tip"]).select("F_tip", "tip_dot")
    monkeypatch.setattr(state_space, "pencil_structure", lambda _: Unsure(("F_tip", "tip_dot", 1)))
    with pytest.raises(ImproperError, match="grows as s"):
        mech2ss(model)
    monkeypatch.setattr(state_space, "pencil_structure", lambda _: Unsure())
    with pytest.raises(UncertainRankError, match=r"tip_dot from F_tip grow with frequency cannot be told.*none do"):
        mech2ss(model)


@pytest.mark.parametrize("states", ["energy", "modal"])
@pytest.mark.parametrize("seed", range(4))
def test_direct_terms_that_are_zero_are_zero_in_all_states(states: States, seed: int) -> None:
    """Accelerations of undriven masses between springs, some with half DOFs: no force acts on them at once."""
    generator = np.random.default_rng(seed)
    springs = np.append(10.0 ** generator.uniform(0.0, 6.0, 8), 0.0)
    K = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    M = np.diag(generator.uniform(1.0, 50.0, 8) * np.array([1, 1, 0, 1, 1, 0, 1, 1]))
    C = np.diag(np.where(np.diagonal(M) == 0.0, generator.uniform(1.0, 50.0, 8), 0.0))
    model = mechss(M, C, K).select(["F_q0", "F_q2"], ["q1_ddot", "q4_ddot", "q7_ddot"])
    assert_array_equal(mech2ss(model, states=states).D, np.zeros((3, 2)))
