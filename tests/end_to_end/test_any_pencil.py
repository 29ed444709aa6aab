"""Any square M, C, K against exact rational arithmetic: the right state space, or the right refusal.

Structures of all kinds (`anykinds`): constraints with multipliers, algebraic loops, chains of derivatives up to index
seven, and mixtures of them, some of them singular pencils. ``HYPOTHESIS_PROFILE=wide`` draws 2000 of each.
"""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from halfdof_ctrl import ExactReduction, SecondOrderModel, exact_reduction, mech2ss
from halfdof_ctrl.base.errors import ImproperError, LostDigitsWarning, SingularPencilError
from support.anykinds import (
    ANY_KIND,
    Kind,
    chain,
    combined,
    constrained,
    drawn_models,
    floating,
    holonomic,
    in_units,
    massless_nodes,
    mixed,
    redundant,
    signals,
)
from support.outcome import pairs, reduced, reduced_aloud
from support.rational import RationalTransfer, free_dofs, pencil_index, rational_transfer
from support.structures import Structure, gyroscopic, passive, rank_deficient, structures
from support.verdict import (
    Improved,
    characteristic_error,
    eigenvalue_error,
    polynomial_at,
    polynomial_error,
    roll_off_error,
    transfer_errors,
)

#: systems are evaluated by plain solves here, and what python-control's evaluation loses is another matter
pytestmark = pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
TRANSFER = 1e-8  # relative to the largest entry at each frequency
LOST = 1e-6  # the same where LostDigitsWarning was given
FAR = 1e-10  # in the roll-off, relative to the largest entry at any frequency
COEFFICIENT = 1e-8  # of the polynomial part, relative to the largest of the same power of s
CHARACTERISTIC = 1e-8  # det(sI - A), relative
EIGENVALUE = 1e-8  # to the power of the multiplicity, relative to the size of A
UNITS = 1e-8  # answers in other units, relative to the largest entry at each frequency

POINTS: npt.NDArray[np.complex128] = np.array([0.3j, 1.1j, 4.7j, 0.618034 + 0.207107j])  # [rad/s]
ROLL_OFF: npt.NDArray[np.complex128] = np.array([0.3j, 1.1j, 4.7j, 1e2j, 1e3j])  # [rad/s]

DEFAULT = settings().max_examples
AS_DRAWN = (Phase.explicit, Phase.generate)  # a smaller seed is no simpler model
SOME = settings(phases=AS_DRAWN)
THOUSANDS = settings(max_examples=DEFAULT if DEFAULT < 1000 else max(DEFAULT, 2000), phases=AS_DRAWN)


def regular(model: SecondOrderModel) -> tuple[ExactReduction, RationalTransfer]:
    """Reduce a model and find its exact transfer function; drop singular pencils."""
    exact = rational_transfer(model)
    assume(exact.order >= 0)
    return reduced(model), exact


def errors(
    system: Improved, exact: RationalTransfer, points: npt.NDArray[np.complex128] = POINTS, tau: float = 1.0
) -> npt.NDArray[np.float64]:
    """Compare a system in units of time of its own with H(s) at each point."""
    polynomial = polynomial_at(exact.polynomial_part(), points, system.D.shape)
    return transfer_errors(system.at(points / tau), exact.at(points), polynomial)


def complete(reduction: ExactReduction) -> Improved:
    """Give the proper part with the polynomial beside it."""
    return Improved.of(mech2ss(reduction, improper="drop"), reduction.polynomial_part)


@THOUSANDS
@given(structure=structures(*ANY_KIND))
def test_order_is_exact_or_the_pencil_is_singular(structure: Structure) -> None:
    """A refusal is given if and only if ``det P(s)`` vanishes; else the number of states is its degree."""
    check_order(structure)


def check_order(structure: Structure) -> None:
    """Compare the order, or the refusal, with the exact determinant."""
    model = structure.model()
    order = rational_transfer(model).order
    if order < 0:
        with pytest.raises(SingularPencilError, match="pencil is singular"):
            reduced(model)
    else:
        reduction = reduced(model)
        assert (reduction.order, reduction.n_infinite) == (order, 2 * structure.size - order)
        assert len(reduction.A) == order


@THOUSANDS
@given(structure=structures(*ANY_KIND, largest=4))
def test_order_of_small_structures_is_exact_or_the_pencil_is_singular(structure: Structure) -> None:
    """Few DOFs and small integers make many coincidences: each of them is decided right."""
    check_order(structure)


@SOME
@given(structure=structures(*ANY_KIND, largest=9))
def test_index_is_exact(structure: Structure) -> None:
    """The index is one more than the degree to which the exact resolvent of the first-order pencil grows."""
    reduction, _ = regular(structure.model())
    assert reduction.index == pencil_index(*structure.matrices)


@SOME
@given(structure=structures(redundant, floating, holonomic, constrained, combined))
def test_refusal_names_dofs_that_can_move_freely(structure: Structure) -> None:
    """The named DOFs take part in an exact motion ``P(s) q(s) = 0``."""
    model = structure.model()
    assume(rational_transfer(model).order < 0)
    with pytest.raises(SingularPencilError, match="pencil is singular") as refusal:
        reduced(model)
    free = [dof for dof, is_free in zip(model.dofs, free_dofs(*structure.matrices), strict=True) if is_free]
    assert refusal.value.dofs
    assert set(refusal.value.dofs) <= set(free)


@THOUSANDS
@given(case=drawn_models())
def test_transfer_function_is_exact_at_each_frequency(case: tuple[Structure, SecondOrderModel]) -> None:
    """State space and polynomial part together are H(s), to 1e-8 of the largest entry at each point.

    What two huge parts of an improper H(s) leave of each other is compared with these parts. A model so ill
    conditioned that A and B in double precision lose more must be announced as such, and have some digits.
    """
    exact = rational_transfer(case[1])
    assume(exact.order >= 0)
    reduction, lost = reduced_aloud(case[1])
    assert errors(complete(reduction), exact).max() <= (LOST if lost else TRANSFER)


@THOUSANDS
@given(case=drawn_models())
def test_proper_channels_are_exact_on_their_own(case: tuple[Structure, SecondOrderModel]) -> None:
    """What is delivered without its polynomial part: the proper channels, into their roll-off."""
    exact = rational_transfer(case[1])
    proper = exact.growth <= 0 if exact.order >= 0 else np.zeros(1, dtype=bool)
    assume(proper.any())
    reduction, lost = reduced_aloud(case[1])
    assume(not lost)
    system = Improved.of(mech2ss(reduction, improper="drop"))
    near, far = system.at(POINTS)[proper][None], system.at(ROLL_OFF)[proper]
    assert transfer_errors(near, exact.at(POINTS)[proper][None]).max() <= TRANSFER
    assert roll_off_error(far, exact.at(ROLL_OFF)[proper]) <= FAR


@THOUSANDS
@given(case=drawn_models())
def test_improper_pairs_and_their_polynomials_are_exact(case: tuple[Structure, SecondOrderModel]) -> None:
    """Refused are the pairs whose exact numerator is of higher degree, by name and with the difference of degrees."""
    model = case[1]
    reduction, exact = regular(model)
    growth = exact.growth
    improper = {(model.inputs[j], model.outputs[i], int(growth[i, j])) for i, j in np.argwhere(growth > 0).tolist()}
    assert polynomial_error(reduction.polynomial_part, exact.polynomial_part()) <= COEFFICIENT
    if improper:
        with pytest.raises(ImproperError, match="improper") as refusal:
            mech2ss(reduction)
        assert set(refusal.value.pairs) == improper
    else:
        assert mech2ss(reduction).nstates == exact.order


@THOUSANDS
@given(structure=structures(*ANY_KIND))
def test_eigenvalues_are_those_of_the_exact_determinant(structure: Structure) -> None:
    """``det(sI - A)`` is the monic ``det P(s)``; single eigenvalues agree with the certified ones."""
    reduction, exact = regular(structure.model())
    assert characteristic_error(reduction.A, exact, POINTS) <= CHARACTERISTIC
    assert eigenvalue_error(reduction.A, exact) <= EIGENVALUE


HARD = (  # dense blocks of several steps, or far out ill conditioned: floating point alone cannot tell
    (rank_deficient, 12, 81008307),
    (mixed, 4, 81003631),
    (mixed, 11, 62000735),
    (mixed, 11, 71000783),
    (mixed, 12, 71001311),
    (mixed, 21, 95000767),
)


@pytest.mark.parametrize(("kind", "size", "seed"), HARD)
def test_hard_models_are_neither_refused_nor_wrong(kind: Kind, size: int, seed: int) -> None:
    """Order, transfer function, polynomial part and improper pairs of models found by search."""
    generator = np.random.default_rng([seed, size])
    model = signals(generator, kind(generator, size))
    exact, (reduction, _) = rational_transfer(model), reduced_aloud(model)
    assert reduction.order == exact.order
    assert errors(complete(reduction), exact).max() <= TRANSFER
    assert polynomial_error(reduction.polynomial_part, exact.polynomial_part()) <= COEFFICIENT
    growth = exact.growth
    assert pairs(reduction) == {(j, i, int(growth[i, j])) for i, j in np.argwhere(growth > 0).tolist()}


ILL_CONDITIONED = (  # M is regular, but nearly singular in some direction across DOFs
    (passive, 4, 10189397),
    (passive, 7, 34000512),
    (passive, 8, 81008272),
    (gyroscopic, 9, 71000164),
    (floating, 5, 51000411),
)


@pytest.mark.parametrize(("kind", "size", "seed"), ILL_CONDITIONED)
def test_directions_of_little_mass_get_coordinates_of_their_own(kind: Kind, size: int, seed: int) -> None:
    """States that are DOFs lose up to six digits of H(s) there, or are none; the default ones say what they lose."""
    generator = np.random.default_rng([seed, size])
    model = signals(generator, kind(generator, size))
    exact, (reduction, _) = rational_transfer(model), reduced_aloud(model)
    assert reduction.method == "orthogonal"
    told = reduction.solution.evidence.loss.value
    assert told < 1e-6
    assert errors(complete(reduction), exact).max() <= max(1e-9, 10.0 * told)


def test_asking_for_a_method_keeps_its_coordinates() -> None:
    """With ``method="selection"`` the states are DOFs, and the lost digits are told."""
    generator = np.random.default_rng([34000512, 7])
    model = signals(generator, passive(generator, 7))
    with pytest.warns(LostDigitsWarning, match="lose"):
        reduction = exact_reduction(model, method="selection")
    assert set(reduction.partition.inertial) <= set(model.dofs)


def test_singular_pencil_that_floating_point_cannot_tell_is_refused_as_such() -> None:
    """An exactly singular dense model is called singular, not uncertain."""
    generator = np.random.default_rng([34000831, 11])
    with pytest.raises(SingularPencilError, match="The pencil is singular"):
        reduced(mixed(generator, 11).model())


POWERS = st.lists(st.integers(-9, 9), min_size=12, max_size=12)


@THOUSANDS
@given(case=drawn_models(), columns=POWERS, rows=POWERS, time=st.integers(-9, 9))
def test_units_change_no_decision(
    case: tuple[Structure, SecondOrderModel], columns: list[int], rows: list[int], time: int
) -> None:
    """DOFs and equations in units of 2^3k and time in another: same order, index, method, states and improper pairs.

    Powers of eight round nothing, so that the scaled model is exactly the same in other units.
    """
    structure, model = case
    reduction, exact = regular(model)
    n = structure.size
    other = in_units(model, 8.0 ** np.array(columns[:n]), 8.0 ** np.array(rows[:n]), 8.0**time)
    found = reduced(other)
    assert (found.order, found.index, found.method) == (reduction.order, reduction.index, reduction.method)
    assert found.states == reduction.states
    assert pairs(found) == pairs(reduction)
    tau = 8.0**time
    assert errors(complete(found).balanced(), exact, tau=tau).max() <= UNITS


@THOUSANDS
@given(case=drawn_models(), columns=POWERS, rows=POWERS, time=st.integers(-9, 9))
def test_decimal_units_change_no_decision(
    case: tuple[Structure, SecondOrderModel], columns: list[int], rows: list[int], time: int
) -> None:
    """The same with powers of ten, where entries are rounded: the exact order of the rounded model is not asked."""
    structure, model = case
    n = structure.size
    tau = 10.0**time
    other = in_units(model, 10.0 ** np.array(columns[:n]), 10.0 ** np.array(rows[:n]), tau)
    try:
        reduction, exact = reduced(model), rational_transfer(model)
    except SingularPencilError:
        with pytest.raises(SingularPencilError, match="pencil is singular"):
            reduced(other)
        return
    found = reduced(other)
    assert (found.order, found.index, found.method) == (reduction.order, reduction.index, reduction.method)
    assert found.states == reduction.states
    assert pairs(found) == pairs(reduction)
    assert errors(complete(found).balanced(), exact, tau=tau).max() <= UNITS


@pytest.mark.parametrize(
    ("kind", "size", "seed", "base", "columns", "rows", "time"),
    [
        (
            massless_nodes,
            *(11, 2191312, 8.0),
            [-7, 2, -8, 8, 8, 9, -2, 2, -9, -7, -3],
            [5, 5, -6, 0, -7, 9, -5, 6, -5, 7, -7],
            -6,
        ),
        (
            constrained,
            *(10, 952, 10.0),
            [3, -9, -5, 7, 3, -5, 4, 9, -6, -9],
            [-8, 1, 3, -2, -9, -9, -6, 1, 4, -2],
            5,
        ),
    ],
)
def test_leading_matrix_with_even_maxima_is_not_called_singular(
    kind: Kind, size: int, seed: int, base: float, columns: list[int], rows: list[int], time: int
) -> None:
    """Regular by far in plain units, with rcond 1e-15 after its maxima were made even in these: the same method."""
    generator = np.random.default_rng(seed)
    model = signals(generator, kind(generator, size))
    other = in_units(model, base ** np.array(columns), base ** np.array(rows), base**time)
    plain, found = reduced(model), reduced(other)
    assert plain.method != "deflation"
    assert (found.method, found.order, found.states) == (plain.method, plain.order, plain.states)
    assert min(plain.rcond, found.rcond) > 1e-3
    assert exact_reduction(other, method=plain.method).order == plain.order


@SOME
@given(case=drawn_models((chain,)))
def test_chains_of_derivatives_reach_their_index(case: tuple[Structure, SecondOrderModel]) -> None:
    """Chains up to index seven, their polynomials included."""
    structure, model = case
    reduction, exact = regular(model)
    assert reduction.index == pencil_index(*structure.matrices)
    assert polynomial_error(reduction.polynomial_part, exact.polynomial_part()) <= COEFFICIENT
    assert errors(complete(reduction), exact).max() <= TRANSFER
