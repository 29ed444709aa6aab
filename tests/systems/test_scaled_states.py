"""Units of states, powers of two."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import exact_reduction, hydromount, mech2ss, mechss
from halfdof_ctrl.systems.scaled_states import unit_exponents
from support.beams import FIRST_MODES, ball_transfer, cantilever

#: what is compared here with python-control's own evaluation is what the warning is about
pytestmark = pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
BALANCED = 1e-6  #: relative, of what python-control evaluates at resonances of 10 to 40 elements, 1e-3 without scaling


def test_labels_say_the_units_and_no_digit_is_rounded() -> None:
    """The label says x / 2^e in place of x: A, B and C are those of DOF states, moved by powers of two exactly."""
    dofs, scaled = mech2ss(cantilever(10)), mech2ss(cantilever(10), states="scaled")
    unit = np.array([2.0 ** int(label.partition("/2^")[2] or 0) for label in scaled.state_labels])
    assert [label.partition("/")[0] for label in scaled.state_labels] == dofs.state_labels
    assert_array_equal(scaled.A * unit[:, None] / unit, dofs.A)
    assert_array_equal(scaled.B * unit[:, None], dofs.B)
    assert_array_equal(scaled.C / unit, dofs.C)


def test_one_power_of_two_stands_for_time() -> None:
    """Every velocity is measured in the unit of its displacement times the same power of two."""
    n = 20
    A = mech2ss(cantilever(10), states="scaled").A[:n, n:]
    assert_array_equal(A, A[0, 0] * np.eye(n))
    assert np.log2(A[0, 0]) % 1 == 0.0


def test_python_control_evaluates_scaled_beams_well() -> None:
    """`sys(s)` at the first resonances of 20 and 40 elements, against ball arithmetic."""
    s = 1j * np.array(FIRST_MODES[:2])
    for elements in (20, 40):
        model = cantilever(elements)
        assert_allclose(mech2ss(model, states="scaled")(s), ball_transfer(model, s), rtol=BALANCED)


@given(st.lists(st.integers(-40, 40), min_size=3, max_size=3))
def test_units_of_dofs_do_not_matter(powers: list[int]) -> None:
    """A mount in other units of its DOFs gets the same scaled A, up to factors of two in each state."""
    mount = hydromount()
    unit = 2.0 ** np.array(powers)
    M, C, K = (unit[:, None] * X * unit for X in (mount.M, mount.C, mount.K))
    A, other = (mech2ss(model, states="scaled").A for model in (mount, mechss(M, C, K)))
    present = A != 0.0
    assert_array_equal(other != 0.0, present)
    assert (np.abs(np.log2(np.abs(other[present] / A[present]))) <= 2.0).all()


def test_model_without_states_has_no_units() -> None:
    """An empty A gives no exponents."""
    exponents, time = unit_exponents(np.zeros((0, 0)), np.zeros(0, int), np.zeros(0, int))
    assert exponents.size == 0
    assert time == 0
    assert mech2ss(mechss(None, None, [[3]]), states="scaled").nstates == 0


def test_constrained_models_are_scaled_too() -> None:
    """A pendulum of index 3 keeps its states, by deflation, in other units."""
    K = np.array([[4e8, 0, 1], [0, 1, -1], [1, -1, 0]])
    model = mechss(np.diag([1.0, 1, 0]), None, K, dofs=["x", "y", "multiplier"]).select("F_x", "x")
    assert exact_reduction(model).method == "deflation"
    assert_allclose(mech2ss(model, states="scaled")(3j), model(3j), rtol=1e-12)
