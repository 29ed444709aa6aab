"""What is measured of the loss: as much as exact arithmetic says, and nothing of states that do not move."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import exact_reduction, mechss
from halfdof_ctrl.base.errors import CloseDecisionWarning, HalfdofWarning, LostDigitsWarning
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.exact_order import exact_order
from halfdof_ctrl.reduction.method.loss_points import loss_points
from halfdof_ctrl.reduction.method.refined_answers import StateSolver
from support.anykinds import Kind, chain, in_units, massless_nodes, mixed, nearly_singular, signals
from support.beams import ball_transfer, beam_matrices, cantilever
from support.rational import rational_transfer
from support.structures import assembly, gyroscopic, null_columns, passive, rank_deficient
from support.verdict import Improved

SIZE = 1.5  # what is lost is measured to a digit
LOSING: tuple[tuple[Kind, int, int], ...] = (  # kinds, sizes and seeds of `hunt.py --near`, by each of the methods
    (null_columns, 5, 2),
    (assembly, 2, 65),
    (gyroscopic, 4, 84),
    (massless_nodes, 4, 25),
    (rank_deficient, 3, 195),
    (mixed, 2, 207),
    (mixed, 4, 31),
    (mixed, 5, 143),
    (null_columns, 4, 92002978),  # a derivative of an input far below the only mode
    (passive, 7, 92002912),  # free motions drift up to where the model works
    (chain, 2, 92002476),
)


def test_a_point_that_is_an_eigenvalue_is_an_error_and_no_warning_of_another_package() -> None:
    """``s I - A`` is exactly singular at s = 0 for two states that stand still."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(np.linalg.LinAlgError, match="s is an eigenvalue"):
            StateSolver(np.zeros((2, 2)), 0.0)


def test_free_motions_of_many_states_are_no_points_and_no_warnings() -> None:
    """A free mass among swinging ones: the points lie beside the slowest of these, 2 rad/s."""
    swinging = np.kron(np.diag(np.arange(2.0, 40.0)), np.array([[0.0, 1.0], [-1.0, 0.0]]))
    A = np.zeros((len(swinging) + 2, len(swinging) + 2))
    A[2:, 2:], A[0, 1] = swinging, 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = np.abs(loss_points(A))
    assert np.min(np.abs(points - 2.0)) < 0.02


def lost(model: SecondOrderModel) -> tuple[float, float]:
    """Give what is said to be lost of a channel, and what exact arithmetic says of it at that frequency."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HalfdofWarning)
        reduction = exact_reduction(model)
    loss, output = reduction.solution.evidence.loss, reduction.output
    stored = Improved(reduction.A, reduction.B, output.X, output.direct(len(model.inputs)), output.U[1:])
    channel = model.outputs.index(loss.output), model.inputs.index(loss.source), 0
    exact = rational_transfer(model).at(1j * loss.omega)[channel]
    grown = sum(abs(part[channel[:2]]) * loss.omega**k for k, part in enumerate(output.U[1:], 1))
    return loss.there, abs(stored.exactly_at(1j * loss.omega)[channel] - exact) / max(abs(exact), grown)


@pytest.mark.parametrize(("kind", "size", "seed"), LOSING)
@pytest.mark.parametrize("odd_units", [False, True])
def test_what_is_lost_is_what_exact_arithmetic_says(kind: Kind, size: int, seed: int, odd_units: bool) -> None:  # noqa: FBT001
    """Against 600 bits, for the stored numbers and for M, C, K, at the frequency and in the channel that are named."""
    generator = np.random.default_rng([seed, size])
    model = signals(generator, nearly_singular(generator, kind(generator, size)))
    columns, rows = np.exp2(np.arange(-12.0, 12.0, 3.0)[:size]), np.exp2(np.arange(9.0, -15.0, -3.0)[:size])
    measured, exact = lost(in_units(model, columns, rows, 8.0**5) if odd_units else model)
    assert measured > 1e-9
    assert_allclose(measured, exact, rtol=SIZE - 1.0)


def test_the_warning_names_the_channel_the_size_and_the_cause() -> None:
    """Two DOFs that move together but for a mass of 3e-9: W looks sound, what follows from it is not."""
    generator = np.random.default_rng([65, 2])
    model = signals(generator, nearly_singular(generator, assembly(generator, 2)))
    said = r"lose \d\.\de[+-]\d\d of y\[\d\] from u\[\d\] at .* far faster than others"
    with pytest.warns(LostDigitsWarning, match=said):
        exact_reduction(model)


@pytest.mark.parametrize("power", [26, 27, 30, 33, 36])
def test_null_vectors_beside_a_small_mass_are_as_good_as_the_entries(power: int) -> None:
    """A mass that three DOFs share but for a part of 2^-power: nothing of any channel is lost, and no word said."""
    M = np.ones((3, 3))
    M[2, 2] += 2.0**-power
    model = mechss(M, np.diag([3, 1, 2]), [[15, -5, -5], [-5, 10, -2], [-5, -2, 18]])
    reduction, points = exact_reduction(model), np.array([0.3j, 1.4j, 5j, 100j])
    stored = Improved(reduction.A, reduction.B, reduction.output.X, reduction.output.direct(3))
    assert_allclose(stored.exactly_at(points), rational_transfer(model).at(points), rtol=1e-13)


def test_a_beam_loses_no_more_than_its_entries_leave_open() -> None:
    """Rounding of M and K changes as much of a cantilever's response as A, B, C and D lose: no fault of theirs."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", LostDigitsWarning)
        exact_reduction(cantilever(20))


@pytest.mark.parametrize("elements", [8, 40])
def test_accelerations_are_looked_at_below_all_modes(elements: int) -> None:
    """That of the rotation of a lumped beam's tip, which has no mass: as s^2 of its displacement falls, digits go."""
    M, K = beam_matrices(elements)
    lumped = np.diag(np.tile([1.0 / elements, 0.0], elements))
    tip, n = 2 * elements - 2, len(M)
    model = mechss(lumped, 1e-5 * K, K, np.eye(n)[:, [tip]], F=None, H=np.eye(n)[[tip + 1]])
    with pytest.warns(LostDigitsWarning, match="lose"):
        reduction = exact_reduction(model)
    loss, output = reduction.solution.evidence.loss, reduction.output
    slowest = np.abs(np.linalg.eigvals(reduction.A)).min()
    assert 0.05 * slowest < loss.omega < 0.2 * slowest
    s = 1j * loss.omega
    exact = s**2 * ball_transfer(mechss(lumped, 1e-5 * K, K).select(f"F_q{tip}", f"q{tip + 1}"), s)[0]
    stored = Improved(reduction.A, reduction.B, output.X, output.direct(1), output.U[1:])
    assert_allclose(loss.there, abs(stored.exactly_at(s)[0, 0, 0] / exact - 1.0), rtol=SIZE - 1.0)


def test_states_that_rank_decisions_hide_are_told() -> None:
    """A mass of 2^-44 beside a zero: the entries are no rounded ones, so they have a state more than is given."""
    M = np.array([[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 3.0]])
    M[0, 0] += 2.0**-44
    with pytest.warns(CloseDecisionWarning, match="so few digits that they were not rounded"):
        assert exact_reduction(mechss(M, np.diag([1, 2, 1]), [[15, -5, -5], [-5, 10, -2], [-5, -2, 18]])).order == 5


def test_a_pencil_that_is_regular_by_a_last_digit_is_not_called_singular() -> None:
    """Two DOFs with one mass and one spring but for a part of 2^-50: by that 2 states, which rest on it."""
    mass = np.array([[1.0, 1.0], [1.0, 1.0]])
    model = mechss(mass, None, mass + np.diag([0.0, 2.0**-50]))
    with pytest.warns(CloseDecisionWarning, match="vanishes at every s to working precision"):
        reduction = exact_reduction(model)
    assert reduction.order == 2
    assert_allclose(reduction.A, [[0.0, 1.0], [-1.0, 0.0]])


def test_states_are_counted_in_models_of_fifty_dofs() -> None:
    """A mass of 2^-44 beside a zero, among masses on springs of their own: two states for each DOF."""
    M, K = np.diag(np.full(50, 2.0)), np.diag(np.full(50, 3.0))
    M[:2, :2] = [[4.0 + 2.0**-44, 2.0], [2.0, 1.0]]
    assert exact_order(mechss(M, None, K)) == 100
    M[0, 0] = 4.0
    assert exact_order(mechss(M, None, K)) == 98


def soft_ground_chain(n: int) -> SecondOrderModel:
    """Make a free chain but for a soft spring, each fourth node without mass, seen by acceleration and displacement."""
    k = 1e5 * (1.0 + 0.3 * np.cos(np.arange(n)))
    k[0] = 0.03
    c = 0.7 + 0.1 * np.sin(np.arange(n))
    K, C = (np.diag(part + np.append(part[1:], 0.0)) - np.diag(part[1:], 1) - np.diag(part[1:], -1) for part in (k, c))
    M = np.diag(np.where(np.arange(n) % 4 == 2, 0.0, 1.1))
    return mechss(M, C, K).select(inputs="F_q5", outputs=["q8_ddot", "q22_ddot", "q22"])


def test_accelerations_of_massless_dofs_are_looked_at_among_many_states() -> None:
    """At the slowest mode: as much is told as balls of many digits say; of those of a mass nothing is said."""
    model = soft_ground_chain(90)
    with pytest.warns(LostDigitsWarning, match="of q22_ddot from F_q5"):
        reduction = exact_reduction(model)
    loss, output = reduction.solution.evidence.loss, reduction.output
    stored = Improved(reduction.A, reduction.B, output.X, output.direct(1))
    s = 1j * loss.omega
    exact = s**2 * ball_transfer(model.select("F_q5", "q22"), s)[0]
    found = stored.exactly_at(s)[1, 0, 0]
    assert loss.there / SIZE <= abs(found / exact - 1.0) <= loss.there * SIZE
    with warnings.catch_warnings():
        warnings.simplefilter("error", LostDigitsWarning)
        exact_reduction(model.select("F_q5", ["q8_ddot", "q22"]))
