"""Splitting the DOFs: null columns, orthonormal bases, tiny masses, and the evidence."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csc_array

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import HalfdofWarning, NearlyMasslessWarning
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.method.evidence import RankDecision
from halfdof_ctrl.reduction.method.masses import mass_ratios, without_light_masses
from support import exact
from support.anykinds import Kind, chain, constrained, drawn_models, in_units
from support.structures import Structure, structures

ORTHOGONAL = 1e-12  # products of orthonormal vectors with small integer matrices, n <= 12
THERE_AND_BACK = 1e-10  # T of up to 12 mixed columns, scaled by powers of two, has a condition of up to 1e5
ROUNDOFF = 1e-12  # small well-conditioned matrices
WEAK_TIE = 1e-6  # a mass of 2^-27 costs eight digits of A, of sixteen
SAME = 1e-6  # the same number in other units; the scaling behind it is iterated


@given(structure=structures())
def test_selection_follows_the_null_columns(structure: Structure) -> None:
    """A column in M: inertial; none in M, one in C: half; none in both: static. Each in the model's order."""
    part = select_columns(structure.model())
    mass, damping = structure.M.any(axis=0), structure.C.any(axis=0)
    kind = np.where(mass, 0, np.where(damping, 1, 2))
    names = np.array(structure.model().dofs)
    assert part.inertial == tuple(names[kind == 0])
    assert part.half == tuple(names[kind == 1])
    assert part.static == tuple(names[kind == 2])
    assert part.evidence == ()


@given(structure=structures())
def test_bases_span_the_null_spaces(structure: Structure) -> None:
    """``M [T_c T_k] = 0``, ``C T_k = 0``, T nonsingular, and the dimensions are the exact ones."""
    part = orthonormal_bases(structure.model())
    T, moving = part.T, part.n_inertial + part.n_half
    scale = np.abs(T).max(axis=0)
    assert_allclose(structure.M @ T[:, part.n_inertial :] / scale[part.n_inertial :], 0.0, rtol=0.0, atol=ORTHOGONAL)
    assert_allclose(structure.C @ T[:, moving:] / scale[moving:], 0.0, rtol=0.0, atol=ORTHOGONAL)
    assert np.linalg.matrix_rank(T / scale) == structure.size
    assert part.n_inertial == exact.rank(structure.M)
    static = structure.size - exact.rank(structure.M.T, structure.C.T)
    assert part.n_static == static


@given(structure=structures(), seed=st.integers(0, 2**32 - 1))
def test_coordinates_go_there_and_back(structure: Structure, seed: int) -> None:
    """``q = T p`` and ``p = T^-1 q`` undo each other by both methods, and T's columns multiply matrices alike."""
    q = np.random.default_rng(seed).standard_normal((structure.size, 3))
    model = structure.model()
    for part in (select_columns(model), orthonormal_bases(model)):
        assert_allclose(part.T @ part.to_coordinates(q), q, rtol=0.0, atol=THERE_AND_BACK)
        product = part.times_basis(model.K, 0, None)  # less what is rounding of zero
        assert_allclose(product, model.K @ part.T, rtol=0.0, atol=THERE_AND_BACK * np.abs(model.K).max())


def test_what_needs_no_mixing_keeps_its_name() -> None:
    """A rank-deficient mass of two DOFs is mixed; the damped and the static DOF beside it stay."""
    M = np.zeros((4, 4))
    M[:2, :2] = 1.0
    part = orthonormal_bases(mechss(M, np.diag([0, 0, 3, 0]), np.eye(4), dofs=["a", "b", "c", "d"]))
    assert part.inertial == ("mix0",)
    assert part.half == ("c",)
    assert set(part.static) == {"mix1", "d"}
    first = part.evidence[0]
    assert (first.matrix, first.dofs, first.rank) == ("M", ("a", "b"), 1)


def test_names_of_mixtures_are_clear_of_the_dofs() -> None:
    """A DOF called mix0 pushes the mixtures to another prefix."""
    part = orthonormal_bases(mechss(np.ones((2, 2)), None, np.eye(2), dofs=["mix0", "b"]))
    assert part.coordinates == ("mix_0", "mix_1")


def test_names_of_states_never_clash() -> None:
    """DOFs named after mixtures, their velocities, or with the prefix still give distinct state labels."""
    model = mechss(np.ones((3, 3)), None, np.diag([1, 2, 3]), dofs=["mix0_dot", "mix_", "b"])
    states = exact_reduction(model).states
    assert len(set(states)) == len(states)
    assert len(set(mech2ss(model).state_labels)) == len(states)


@pytest.mark.parametrize(
    ("values", "rank", "gap"),
    [
        ([4.0, 1.0, 1e-16], 2, 1e16),
        ([4.0, 1.0, 1e-16], 3, 1e-16 / 1e-14),
        ([0.0, 0.0], 0, np.inf),
        ([1.0, 0.0], 1, np.inf),
    ],
)
def test_gap_of_a_rank_decision(values: list[float], rank: int, gap: float) -> None:
    """Smallest singular value that counts over the largest that does not, or over the bound where all count."""
    decision = RankDecision(matrix="M", dofs=("a",), singular_values=np.array(values), rank=rank, bound=1e-14)
    assert_allclose(decision.gap, gap, rtol=ROUNDOFF)


@pytest.mark.parametrize("rank", [1, 2, 3])
def test_evidence_shows_how_clear_the_rank_is(rank: int) -> None:
    """An exactly rank-deficient mass leaves a gap of more than ten decades."""
    vectors = np.random.default_rng(rank).integers(-3, 4, (rank, 4))
    part = orthonormal_bases(mechss(vectors.T @ vectors, None, np.eye(4)))
    assert [decision.rank for decision in part.evidence if decision.matrix == "M"] == [rank]
    assert min(decision.gap for decision in part.evidence) > 1e10


# --- tiny masses -----------------------------------------------------------------------------------------------


def light_and_heavy(light: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two masses in a chain of springs with dampers to the ground."""
    return np.diag([1.0, light]), np.diag([0.3, 2.0]), np.array([[3.0, -1.0], [-1.0, 2.0]])


def test_nearly_massless_dof_is_warned_of_by_name_with_the_tolerance() -> None:
    """The warning tells the ratio and the `tol` that would take it as massless."""
    model = mechss(*light_and_heavy(1e-13), dofs=["wheel", "speck"])
    with pytest.warns(NearlyMasslessWarning, match=r"DOFs speck have a mass of at most .* pass tol=") as caught:
        assert exact_reduction(model).order == 4
    tol = float(str(caught[0].message).split("tol=")[1].rstrip("."))
    with warnings.catch_warnings():
        warnings.simplefilter("error", HalfdofWarning)
        assert exact_reduction(model, tol=tol).partition.half == ("speck",)


@pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
def test_warning_points_at_the_callers_line() -> None:
    """Both doors, `exact_reduction` and `mech2ss`, put the warning where the user called them."""
    model = mechss(*light_and_heavy(1e-13))
    for call in (exact_reduction, mech2ss):
        with pytest.warns(NearlyMasslessWarning) as caught:
            call(model)
        assert caught[0].filename == __file__


@pytest.mark.parametrize("light", [0.0, 1e-6, 1.0])
def test_ordinary_masses_give_no_warning(light: float) -> None:
    """Zero is massless, and a millionth is a small mass like any other."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", HalfdofWarning)
        exact_reduction(mechss(*light_and_heavy(light)))


@given(powers=st.lists(st.integers(-9, 9), min_size=5, max_size=5))
def test_warning_does_not_depend_on_units(powers: list[int]) -> None:
    """DOFs, equations and time in other units: the speck warns, the ordinary mount does not."""
    S, R, tau = np.diag(10.0 ** np.array(powers[:2])), np.diag(10.0 ** np.array(powers[2:4])), 10.0 ** powers[4]
    for light, warned in ((1e-14, True), (1e-2, False)):
        M, C, K = light_and_heavy(light)
        model = mechss(R @ M @ S * tau**2, R @ C @ S * tau, R @ K @ S)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            exact_reduction(model)
        assert bool(caught) == warned


@given(powers=st.lists(st.integers(-9, 9), min_size=5, max_size=5))
def test_mass_ratios_do_not_depend_on_units(powers: list[int]) -> None:
    """DOFs, equations and time in units of 10^k: the same ratios, and the same masses below `tol`."""
    S, R, tau = np.diag(10.0 ** np.array(powers[:2])), np.diag(10.0 ** np.array(powers[2:4])), 10.0 ** powers[4]
    M, C, K = light_and_heavy(1e-6)
    model = mechss(R @ M @ S * tau**2, R @ C @ S * tau, R @ K @ S)
    ratio = mass_ratios(model)
    assert_allclose(ratio, mass_ratios(mechss(M, C, K)), rtol=SAME)
    assert 1e-7 < ratio.min() < 1e-5
    for tol, light in ((0.5 * ratio.min(), ()), (2.0 * ratio.min(), ("q1",))):
        assert select_columns(model, tol).half == light
        assert without_light_masses(model, tol).M[1, 1].any() != bool(light)


POWERS = st.lists(st.integers(-9, 9), min_size=12, max_size=12)


@pytest.mark.parametrize("base", [8.0, 10.0])
@given(case=drawn_models(), columns=POWERS, rows=POWERS, time=st.integers(-9, 9))
def test_mass_ratios_of_any_model_do_not_depend_on_units(
    base: float, case: tuple[Structure, SecondOrderModel], columns: list[int], rows: list[int], time: int
) -> None:
    """Small integers, whatever their pattern, never look like light masses, in no units."""
    structure, model = case
    n = structure.size
    ratio = mass_ratios(model)
    scaled = in_units(model, base ** np.array(columns[:n]), base ** np.array(rows[:n]), base**time)
    assert_allclose(mass_ratios(scaled), ratio, rtol=SAME)
    assert ratio[structure.M.any(axis=0)].min(initial=1.0) > 1e-4


@pytest.mark.parametrize(("kind", "size", "seed"), [(chain, 9, 131000956), (constrained, 11, 131001575)])
def test_constrained_models_give_no_false_warning(kind: Kind, size: int, seed: int) -> None:
    """Masses and stiffness that hardly share equations: even maxima left their scale open by ten decades."""
    generator = np.random.default_rng([seed, size])
    structure = kind(generator, size)
    generator = np.random.default_rng([seed, 8])
    columns, rows = 8.0 ** generator.integers(-9, 10, (2, size))
    model = in_units(structure.model(), columns, rows, 8.0 ** int(generator.integers(-9, 10)))
    with warnings.catch_warnings():
        warnings.simplefilter("error", NearlyMasslessWarning)
        assert select_columns(model).light is None
        exact_reduction(model)


def test_mass_ratios_without_own_frequencies_do_not_depend_on_time() -> None:
    """Two DOFs whose equations are exchanged: no mass meets its own spring, and the ratios are those of the pair."""
    M, K = np.array([[0.0, 1.0], [1e-6, 0.0]]), np.array([[2.0, 0.0], [0.0, 3.0]])
    for tau in (1e-5, 1.0, 1e7):
        assert_allclose(mass_ratios(mechss(M * tau**2, None, K)), [1.0, 1.0], rtol=SAME)


def test_slow_dof_and_light_dof_are_the_same_in_other_units() -> None:
    """Masses 1 and 1e-12 on springs of 1 are masses 1 on springs of 1 and 1e12, the second equation in other units.

    At the slow frequency of 1 rad/s the inertia is a half of what acts on the first DOF, 1e-12 on the second.
    """
    light = mechss(np.diag([1.0, 1e-12]), None, np.eye(2))
    slow = mechss(np.eye(2), None, np.diag([1.0, 1e12]))
    assert_allclose(mass_ratios(light), [1.0, 2e-12], rtol=SAME)
    assert_allclose(mass_ratios(slow), mass_ratios(light), rtol=SAME)


def test_mass_ratios_of_a_massless_model_are_zero() -> None:
    """No division by zero."""
    assert_array_equal(mass_ratios(mechss(None, np.eye(2), np.eye(2))), np.zeros(2))


@pytest.mark.parametrize("tol", [0.0, 1e-3])
def test_tolerance_at_and_above_zero(tol: float) -> None:
    """A tolerance below every mass changes nothing in the mount."""
    assert exact_reduction(hydromount(), tol=tol).order == 4


def test_tolerance_decides_ranks_of_mixed_blocks() -> None:
    """A singular value of 1e-9 counts by default and is dropped with tol=1e-6."""
    rotation = np.array([[3.0, -4.0], [4.0, 3.0]]) / 5.0
    model = mechss(rotation @ np.diag([1.0, 1e-9]) @ rotation.T, np.eye(2), np.eye(2))
    assert orthonormal_bases(model).n_inertial == 2
    assert orthonormal_bases(model, tol=1e-6).n_inertial == 1


@pytest.mark.parametrize("stored", ["dense", "sparse"])
def test_a_weak_tie_to_a_null_direction_is_no_rounding(stored: str) -> None:
    """A static direction beside a mass of 2^-27, tied to a mass by 2^-20 N/m: what comes through."""
    mixed = np.eye(4)
    mixed[:3, :3] = [[1, 1, 2], [2, 3, 5], [1, 2, 4]]
    M, K = np.diag([1.0, 2.0**-27, 0.0, 1.0]), np.diag([2.0, 3 * 2.0**-27, 1.0, 4.0])
    K[0, 3] = K[3, 0] = 1.0
    K[2, 3] = K[3, 2] = 2.0**-20
    M, K = (mixed.T @ matrix @ mixed for matrix in (M, K))
    model = mechss(M, None, K, mixed.T[:, [2]], mixed[[3]])
    given = mechss(csc_array(M), None, csc_array(K), mixed.T[:, [2]], mixed[[3]]) if stored == "sparse" else model
    points = np.array([0.5j, 3.0j])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HalfdofWarning)  # the light mass costs digits
        reduction = exact_reduction(given)
    unit, X, D = np.eye(reduction.order), reduction.output.X, reduction.output.direct(1)
    found = [(X @ np.linalg.solve(s * unit - reduction.A, reduction.B + 0j) + D)[0, 0] for s in points]
    assert_allclose(found, exact.transfer(model, points)[0, 0], rtol=WEAK_TIE)
