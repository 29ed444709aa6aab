"""Published benchmark problems: right count, right transfer function, right refusal; beside a peer in the roll-off."""

import warnings

import numpy as np
import numpy.typing as npt
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import mech2ss, mechss
from halfdof_ctrl.base.errors import HalfdofWarning, ImproperError, SingularPencilError
from support import benchmark_mechanisms as mechanisms
from support import benchmark_problems as problems
from support.benchmark_cases import REGULAR, SINGULAR
from support.benchmark_problems import Problem
from support.descriptor_peers import conversions
from support.outcome import pairs, reduced
from support.rational import pencil_index, rational_transfer
from support.verdict import Improved, characteristic_error, polynomial_at, polynomial_error, transfer_errors

#: systems are evaluated by plain solves here, and what python-control's evaluation loses is another matter
pytestmark = pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
TRANSFER = 1e-8  # relative to the largest entry at each frequency
DEEP = 1e-2  # of the largest entry at any frequency: below it, digits are counted against that
ROLL_OFF = 1e-10  # relative to the largest entry at any frequency
PEER = 100.0  # times the error of slycot.sb10jd on its best form, plus rounding
ROUNDING = 1e-14
DATA = 1e-20  # coefficients below this part of the largest of their power come of rounded data
ROUNDOFF = 1e-12  # closed forms of a few numbers
CHARACTERISTIC = 1e-8
ROUNDING_UNIT = float(np.finfo(float).eps)  # over the condition of the solved equations: what no solve can keep


def band(A: npt.NDArray[np.float64]) -> npt.NDArray[np.complex128]:
    """Give points j omega from a tenth of the slowest to a hundred times the fastest eigenvalue, one off the axis."""
    speeds = np.abs(np.linalg.eigvals(A))
    speeds = speeds[speeds > 1e-6 * speeds.max(initial=0.0)]
    speeds = speeds if speeds.size else np.ones(1)
    omega = np.geomspace(0.1 * speeds.min(), 100.0 * speeds.max(), 15)
    middle = float(np.sqrt(speeds.min() * speeds.max()))
    return np.asarray([*(1j * omega), middle * (0.4 + 0.9j)])


@pytest.mark.parametrize(("problem", "order", "index"), REGULAR, ids=lambda value: getattr(value, "__name__", None))
def test_order_and_index_are_those_of_exact_arithmetic(problem: Problem, order: int, index: int) -> None:
    """The count of finite eigenvalues is the exact degree of the determinant of the floats that are given."""
    model = problem()
    assert rational_transfer(model).order == order
    assert pencil_index(model.M, model.C, model.K) == index
    reduction = reduced(model)
    assert (reduction.order, reduction.index) == (order, index)


@pytest.mark.parametrize(("problem", "order", "index"), REGULAR, ids=lambda value: getattr(value, "__name__", None))
def test_transfer_function_is_that_of_the_descriptor_form(problem: Problem, order: int, index: int) -> None:
    """A plain solve with A, B, C, D and the polynomial part, at each frequency; deep in the roll-off against a peer."""
    model = problem()
    reduction, exact = reduced(model), rational_transfer(model)
    system = Improved.of(mech2ss(reduction, improper="drop"), reduction.polynomial_part)
    points = band(system.A)
    actual, desired = system.at(points), exact.at(points)
    polynomial = polynomial_at(exact.polynomial_part(), points, system.D.shape)
    size = np.maximum(np.abs(desired), np.abs(polynomial)).max(axis=(0, 1))
    deep = (size < DEEP * size.max()) & (reduction.method != "selection")
    assert transfer_errors(actual, desired, polynomial)[~deep].max() <= TRANSFER
    assert (np.abs(actual - desired)[:, :, deep] <= ROLL_OFF * size.max()).all()
    if deep.any():
        peers = [transfer_errors(peer.at(points), desired)[deep].max() for peer in conversions(model).values()]
        assert transfer_errors(actual, desired)[deep].max() <= PEER * min(peers, default=np.inf) + ROUNDING
    assert index >= 0
    assert order == len(system.A)
    assert characteristic_error(system.A, exact, points) <= CHARACTERISTIC + ROUNDING_UNIT / reduction.rcond


@pytest.mark.parametrize(("problem", "order", "index"), REGULAR, ids=lambda value: getattr(value, "__name__", None))
def test_improper_pairs_are_refused_by_name(problem: Problem, order: int, index: int) -> None:
    """With unit forces on all equations and all unknowns as outputs, the pairs that grow are the exact ones.

    Coefficients that are rounding of sines and cosines in the data do not count.
    """
    model = problem()
    full = mechss(model.M, model.C, model.K)
    desired = rational_transfer(full).polynomial_part()
    reduction = reduced(full)
    growth = np.zeros((len(model.dofs), len(model.dofs)), dtype=int)
    for power, part in enumerate(desired, 1):
        growth[np.abs(part) > DATA * np.abs(part).max()] = power
    assert pairs(reduction) == {(j, i, int(growth[i, j])) for i, j in np.argwhere(growth > 0).tolist()}
    assert (growth.max() > 0) == (index > 1)
    assert order == reduction.order
    assert polynomial_error(reduction.polynomial_part, desired) <= TRANSFER


@pytest.mark.parametrize("problem", SINGULAR, ids=lambda value: value.__name__)
def test_singular_problems_are_refused(problem: Problem) -> None:
    """Their determinant vanishes exactly."""
    model = problem()
    assert rational_transfer(model).order == -1
    with pytest.raises(SingularPencilError, match="pencil is singular") as refusal:
        reduced(model)
    assert refusal.value.dofs


def test_constraint_that_almost_repeats_another_is_not_taken_silently() -> None:
    """Cranks at an angle whose sine is no float: redundant but for rounding, refused or said to be close."""
    angle = 0.7
    rise = np.array([np.cos(angle), np.sin(angle), 0.0])
    G = [rise - (0.0, 0.0, arm * np.sin(angle)) for arm in (-0.3, 0.0, 0.3)]
    model = mechss(*problems.bordered(np.diag([2.0, 2.0, 0.1]), np.zeros((3, 3)), np.diag([40.0, 0.0, 0.0]), G))
    with warnings.catch_warnings():
        warnings.simplefilter("error", HalfdofWarning)
        try:
            order = mech2ss(model.select(outputs="q0")).nstates
        except (SingularPencilError, HalfdofWarning):
            return
        except ImproperError:
            order = -2
    assert order == rational_transfer(model).order


def test_sleigh_has_the_eigenvalue_of_its_closed_form() -> None:
    """``-m v b / (I + m b^2)`` and two zeros for the free motion along the line."""
    found = np.linalg.eigvals(reduced(mechanisms.sleigh()).A)
    desired = -2.0 * 1.5 * 0.4 / (0.3 + 2.0 * 0.4**2)
    assert_allclose(np.sort(found.real), [desired, 0.0, 0.0], rtol=ROUNDOFF, atol=1e-7)


def test_servo_force_is_the_closed_form_polynomial() -> None:
    """``F = m1 m2 / k y'''' + (m1 + m2) y''`` moves the second mass as told."""
    reduction = reduced(mechanisms.servo_constraint())
    coefficients = [part[2, 0] for part in reduction.polynomial_part]
    assert_allclose(coefficients, [0.0, 3.0, 0.0, 0.4], rtol=ROUNDOFF, atol=ROUNDOFF)


def test_mobile_manipulator_has_the_published_eigenvalues() -> None:
    """``-5.1616e-2 +- 2.2435e-1 j``, N. J. Higham, F. Tisseur, Linear Algebra Appl. 351-352 (2002)."""
    found = np.linalg.eigvals(reduced(problems.mobile_manipulator()).A)
    assert_allclose(np.abs(found.real), 5.1616e-2, rtol=1e-4)
    assert_allclose(np.abs(found.imag), 2.2435e-1, rtol=1e-4)


def test_rigid_link_is_the_limit_of_a_stiff_one() -> None:
    """At low frequency multiplier and penalty agree to the inverse of the penalty."""
    s = 1j * np.array([0.1, 1.0, 2.0])
    rigid, stiff = (Improved.of(mech2ss(problem())) for problem in (mechanisms.rigid_link, mechanisms.stiff_link))
    assert_allclose(rigid.at(s), stiff.at(s), rtol=1e-6)


def test_seven_bodies_are_assembled_in_the_published_position() -> None:
    """The loops close to the last digit, and each linearized loop is the slope of the loop that it is of."""
    position = np.array(mechanisms.SEVEN_BODY_POSITION)
    assert_allclose(loops(position), 0.0, atol=1e-16)
    step = 1e-6 * np.eye(7)
    slopes = np.array([(loops(position + h) - loops(position - h)) / 2e-6 for h in step]).T
    assert_allclose(mechanisms.seven_body_mechanism().K[7:, :7], slopes, rtol=0.0, atol=1e-10)


def loops(angles: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Close the three loops of Andrews' mechanism: Hairer and Wanner, equation (VII.7.7) with its data."""
    beta, theta, gamma, phi, delta, omega, epsilon = angles
    x = 7e-3 * np.cos(beta) - 28e-3 * np.cos(beta + theta)
    y = 7e-3 * np.sin(beta) - 28e-3 * np.sin(beta + theta)
    return np.array(
        [
            x - 35e-3 * np.sin(gamma) + 0.03635,
            y + 35e-3 * np.cos(gamma) - 0.03273,
            x - 2e-2 * np.sin(phi + delta) - 4e-2 * np.cos(delta) + 0.06934,
            y + 2e-2 * np.cos(phi + delta) - 4e-2 * np.sin(delta) + 0.00227,
            x - 2e-2 * np.cos(omega + epsilon) - 4e-2 * np.sin(epsilon) + 0.06934,
            y - 2e-2 * np.sin(omega + epsilon) + 4e-2 * np.cos(epsilon) + 0.00227,
        ]
    )
