"""The whole method for any regular pencil: names, evidence, refusals, and the same answers in any units."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mechss
from halfdof_ctrl.base.errors import CloseDecisionWarning, SingularPencilError, UncertainRankError
from halfdof_ctrl.reduction.deflation import method
from halfdof_ctrl.reduction.deflation.method import CAUTIONS, deflated
from halfdof_ctrl.reduction.deflation.row_system import Caution
from halfdof_ctrl.reduction.deflation.states import StateSelection
from halfdof_ctrl.reduction.method.proof import has_spectrum, in_scaled_units
from halfdof_ctrl.reduction.method.signals import StateEquations
from support.mechanisms import JERK, SNAP, blade, derivatives, hanging_chain, in_units, rod
from support.row_systems import POINTS, dense, response

FloatArray = npt.NDArray[np.float64]
ROUNDOFF = 1e-12  # small well-conditioned models
UNITS = 1e-9  # the model in other units is rounded once more, in every entry, and A multiplies by itself
ABSURD = Caution(1e30, 1e30)  # takes everything for rounding
POWERS = st.lists(st.integers(-9, 9), min_size=13, max_size=13)


def loss(model: SecondOrderModel, equations: StateEquations) -> float:
    """Return what state equations lose against direct solves, of the outputs."""
    pencil, scaled = in_scaled_units(model, equations)
    return pencil.losses(scaled).worst


def test_selection_tells_states_and_kinds_by_name() -> None:
    """Of the blade both positions and one velocity are states: x is inertial, y half, the force static."""
    assert deflated(blade()).name == "deflation"
    found = deflated(blade()).coordinates
    assert found.states == ("x", "y", "x_dot")
    assert (found.inertial, found.half, found.static) == (("x",), ("y",), ("f",))
    assert found.kinds_of(("x", "y", "f")) == {"y": "half", "f": "static"}
    assert found.differentiations == {"f": 1}


def test_higher_derivatives_have_names() -> None:
    """q0'' and q0''' are q0_ddot and q0_d3."""
    assert deflated(mechss(*JERK)).coordinates.states == ("q0", "q1", "q0_dot", "q0_ddot")
    assert deflated(mechss(*SNAP)).coordinates.states == ("q0", "q2", "q0_dot", "q2_dot", "q0_ddot", "q0_d3")


@pytest.mark.parametrize(("matrices", "orders"), [(JERK, 3), (SNAP, 4)], ids=["jerk", "snap"])
def test_states_are_picked_from_the_derivatives(matrices: tuple[FloatArray, ...], orders: int) -> None:
    """``x = L_q q + L_v q' + L_a q'' + ...``: one unit entry a row, as many maps as there are derivatives."""
    selection = deflated(mechss(*matrices)).coordinates
    maps = selection.state_maps()
    assert len(maps) == orders
    for index, (j, order) in enumerate(selection.places):
        for k, each in enumerate(maps):
            assert_array_equal(each[index], np.eye(each.shape[1])[j] * (k == order))


def test_states_of_displacements_alone_still_have_two_maps() -> None:
    """L_v is zero without states, or with displacements alone."""
    for model in (derivatives(3), mechss([[0, 0], [0, 0]], [[1, 0], [0, 0]], [[0, 1], [1, 0]])):
        maps = deflated(model).coordinates.state_maps()
        assert len(maps) == 2
        assert not maps[1].any()


def test_evidence_lists_blocks_of_the_tight_coefficients() -> None:
    """The rod is one block of J with three singular values that all count."""
    (decision,) = deflated(rod()).decisions()
    assert (decision.matrix, decision.dofs, decision.rank) == ("J", ("a", "b", "f"), 3)
    assert decision.singular_values[2] > 0.1
    assert decision.gap > 1e10


def test_hidden_constraint_leaves_its_evidence() -> None:
    """Two equal rows of a mass without null columns: rank 1 of 2, then 2 of 2 once they are separated."""
    found = deflated(mechss(np.ones((2, 2)), None, np.diag([1, 2]), dofs=["p", "q"]))
    assert [(decision.dofs, decision.rank) for decision in found.decisions()] == [(("p", "q"), 1), (("p", "q"), 2)]
    assert found.coordinates.differentiations == {"q": 2}


# --- units -----------------------------------------------------------------------------------------------------

MECHANISMS: list[Callable[[], SecondOrderModel]] = [
    rod,
    blade,
    lambda: hanging_chain(2),
    lambda: derivatives(4),
    lambda: mechss(*JERK),
    lambda: mechss(np.ones((2, 2)), None, np.diag([1, 2])),
]


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.LostDigitsWarning")  # powers of ten round what cancels
@given(which=st.integers(0, len(MECHANISMS) - 1), powers=POWERS)
def test_units_change_nothing_but_the_numbers(which: int, powers: list[int]) -> None:
    """DOFs, equations and time in units of 10^k: same states, index and improper pairs, and scaled answers."""
    model = MECHANISMS[which]()
    n, tau = len(model.dofs), 10.0 ** powers[12]
    other, factors = in_units(model, 10.0 ** np.array(powers[:n]), 10.0 ** np.array(powers[6 : 6 + n]), tau)
    plain = exact_reduction(mechss(model.M, model.C, model.K, dofs=model.dofs), method="deflation")
    scaled = exact_reduction(other, method="deflation")
    assert scaled.states == plain.states
    assert scaled.index == plain.index
    assert len(scaled.polynomial_part) == len(plain.polynomial_part)
    for one, two in zip(plain.polynomial_part, scaled.polynomial_part, strict=True):
        assert_array_equal(two != 0.0, one != 0.0)
    desired, actual = response(dense(plain)), response(dense(scaled), np.asarray(POINTS * tau))
    largest = np.abs(desired).max(axis=(0, 1))
    assert_allclose(actual / factors[:, :, None] / largest, desired / largest, rtol=0.0, atol=UNITS)


# --- refusals --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "dofs", "equations", "reason"),
    [
        (
            mechss(
                np.diag([1.0, 2, 0, 0]),
                None,
                [[3, 0, 1, 1], [0, 4, -1, -1], [1, -1, 0, 0], [1, -1, 0, 0]],
                dofs=["a", "b", "force1", "force2"],
            ),
            ("force1", "force2"),
            ("force1", "force2"),
            "the constraints of the multipliers force1, force2 are redundant",
        ),
        (
            mechss(np.diag([1, 0]), None, np.diag([1, 0]), dofs=["held", "loose"]),
            ("loose",),
            ("loose",),
            "nothing is attached to loose",
        ),
        (
            mechss([[1, 0, 0], [1, 0, 0], [0, 0, 1]], None, [[0, 2, 0], [0, 2, 0], [0, 0, 5]], dofs=["p", "q", "r"]),
            ("p", "q"),
            ("p", "q"),
            "the equations of p, q are identical",
        ),
        (
            mechss(None, [[1, -1, 0], [-1, 1, 0], [0, 0, 0]], np.diag([0, 0, 4]), dofs=["in", "out", "tip"]),
            ("in", "out"),
            ("in", "out"),
            "in, out float as one body",
        ),
        (mechss([[0]], None, [[0]], dofs="it"), ("it",), ("it",), "nothing is attached to it"),
    ],
    ids=["constraint that stands twice", "loose node", "two equal equations", "damper afloat", "nothing at all"],
)
def test_singular_pencil_is_refused_with_exactly_the_free_dofs(
    model: SecondOrderModel, dofs: tuple[str, ...], equations: tuple[str, ...], reason: str
) -> None:
    """What can move without a force, and which equations depend on each other; nobody else is named."""
    with pytest.raises(SingularPencilError, match=rf"to working precision.*{reason}") as refusal:
        deflated(model)
    assert refusal.value.dofs == dofs
    assert refusal.value.equations == equations


def nearly_dependent(share: float) -> SecondOrderModel:
    """Hold the difference of two masses twice, the second time with a share of a third one."""
    M, K = np.diag([1.0, 1, 1, 0, 0]), np.diag([1.0, 2, 3, 0, 0])
    K[3:, :3] = np.array([[1, -1, 0], [1, -1, share]])
    K[:3, 3:] = K[3:, :3].T
    return mechss(M, None, K)


def test_model_that_is_singular_to_rounding_is_refused() -> None:
    """A constraint that differs from another one by 1e-15 cannot be told from one that stands twice."""
    with pytest.raises(SingularPencilError, match=r"vanishes at every s \(to working precision\)") as refusal:
        deflated(nearly_dependent(1e-15))
    assert set(refusal.value.dofs) == {"q3", "q4"}


def test_tolerance_that_leaves_nothing_of_an_equation_is_refused() -> None:
    """The constraints differ by 1e-3, their forces by 1e-6: with a larger tol one of them vanishes, P(s) does not."""
    assert len(deflated(nearly_dependent(1e-3)).equations.A) == 2
    with pytest.raises(UncertainRankError, match=r"with tol=1e-05 nothing is left of an equation.*pass another tol"):
        deflated(nearly_dependent(1e-3), tol=1e-5)


def test_tolerance_that_changes_the_spectrum_is_not_certified() -> None:
    """Masses that share an acceleration to 1 %: with tol=0.1 that is taken for all of it, and two states go."""
    model = mechss([[1.0, 1.0], [1.0, 1.02]], None, np.diag([1, 2]))
    exact, other = deflated(model), deflated(model, tol=0.1)
    assert (len(exact.equations.A), exact.evidence.altered) == (4, False)
    assert (len(other.equations.A), other.evidence.altered) == (2, True)
    assert not deflated(model, tol=1e-6).evidence.altered


def test_decisions_are_taken_again_where_the_first_do_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all entries count as rounding nothing is left; the next caution gives the answer."""
    M, K = np.ones((2, 2)), np.diag([1, 2])
    desired = deflated(mechss(M, None, K)).equations
    monkeypatch.setattr(method, "CAUTIONS", (ABSURD, *CAUTIONS))
    assert_array_equal(deflated(mechss(M, None, K)).equations.A, desired.A)
    monkeypatch.setattr(method, "CAUTIONS", (ABSURD,))
    monkeypatch.setattr(method, "AS_GIVEN", ABSURD)
    with pytest.raises(UncertainRankError, match="No decision about ranks gives state equations"):
        deflated(mechss(M, None, K))
    with pytest.raises(SingularPencilError, match="The pencil is singular"):
        deflated(mechss(M, None, np.diag([0, 0])))


# --- judging other methods -------------------------------------------------------------------------------------


def test_spectrum_of_other_methods_is_judged_in_the_models_units() -> None:
    """The mount's A passes, in seconds and in microseconds; with a pole moved or missing it does not."""
    for tau in (1.0, 1e-6):
        mount = hydromount()
        model = mechss(mount.M * tau**2, mount.C * tau, mount.K)
        A = exact_reduction(model).A
        assert has_spectrum(model, A)
        assert not has_spectrum(model, A[:-1, :-1])
        assert not has_spectrum(model, A * 1.5)


@pytest.mark.parametrize("disturbance", [0.0, 1e-6, 0.01])
def test_lost_digits_of_other_methods_are_measured(disturbance: float) -> None:
    """The mount's equations lose nothing; with a wrong B they lose as much as it is wrong."""
    model = hydromount().select(inputs="F_y", outputs=["y", "y_ddot"])
    right = dense(exact_reduction(model))
    wrong = StateEquations(A=right.A, B=right.B * (1.0 + disturbance), displacement=right.displacement, shift=())
    assert_allclose(loss(model, wrong), disturbance, rtol=0.5, atol=1e-13)


def test_static_model_loses_nothing() -> None:
    """No states, a flexibility of 1/4 m/N."""
    model = mechss(None, None, [[4]])
    assert loss(model, dense(exact_reduction(model))) < ROUNDOFF


def test_state_selection_without_states() -> None:
    """No places, no names."""
    selection = StateSelection(dofs=("a",), places=(), differentiations={})
    assert (selection.states, selection.static) == ((), ("a",))
    assert selection.state_maps()[0].shape == (0, 1)


def test_zeros_that_stand_above_rounding_are_announced() -> None:
    """A mass that is singular but for 4e-13, unsymmetric stiffness: four states, and a warning of two more."""
    v = np.array([1.0, 1.0, -2.0])
    M = np.array([[5.0, 3, 3], [3, 2, 1], [3, 1, 5]]) + 2.0**-39 * np.outer(v, v)
    C = np.array([[0.0, -1, -3], [1, 0, 2], [3, -2, 0]])
    K = np.array([[5.0, -4, -3], [0, 4, 5], [-7, -1, 5]])
    with pytest.warns(CloseDecisionWarning, match="its next singular value, .* is taken as zero, though rounding"):
        assert exact_reduction(mechss(M, C, K)).order == 4
