"""The tangent model and the equilibrium."""

import warnings

import control
import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl import Damper, Force, Spring, laws, mech2nlsys, mech2ss, mechss, nlmechss
from halfdof_ctrl.errors import LawError, LostStateWarning, MatrixError, SignalNameError
from support.mounts_with_laws import oil_mount

DIGITS = 1e-10  #: of the largest entry, tangent against linearization


def test_the_tangent_is_the_linearization() -> None:
    """`mech2ss` of the tangent against `control.linearize` of the system, where it moves."""
    model = oil_mount()
    x = model.state({"y": 0.02, "y2": -0.03, "y_dot": 0.4}, 3.0)
    small = mech2ss(model.tangent(x, 3.0))
    found = control.linearize(mech2nlsys(model), x, [3.0])
    for ours, theirs in zip((small.A, small.B, small.C, small.D), (found.A, found.B, found.C, found.D), strict=True):
        assert_allclose(ours, theirs, rtol=0.0, atol=DIGITS * max(1.0, np.abs(theirs).max()))
    assert small.state_labels == found.state_labels or found.nstates == small.nstates


def test_the_tangent_takes_a_regulator() -> None:
    """`lqr` designed on the tangent stabilizes it."""
    feedback = hd.lqr(oil_mount(outputs=("y",)).tangent(), displacement={"y": 1e8}, effort={"F_y": 1.0})
    assert (feedback.poles.real < 0.0).all()


def test_a_slope_of_zero_loses_a_state_with_a_warning_that_names_the_dof() -> None:
    """The paper's mount with a pure square law at y2: 4 states, its tangent at rest 3."""
    model = oil_mount(laws.quadratic(1e4))
    with pytest.warns(
        LostStateWarning, match=r"The slope of damper 1 \(quadratic\) is zero .* tangent of y2 is without the state y2"
    ):
        tangent = model.tangent()
    assert (len(model.states), mech2ss(tangent).nstates) == (4, 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert mech2ss(model.tangent({"y2": 0.01})).nstates == 4


def test_an_infinite_slope_has_no_tangent() -> None:
    """By the DOF."""
    model = nlmechss(mechss([[1.0]], None, [[1.0]]), Damper("q0", law=laws.power(1, 0.5)))
    with pytest.raises(LawError, match=r"acts on q0, and its slope there is infinite"):
        model.tangent()


def test_the_equilibrium_answers_the_load() -> None:
    """``k1 e + k3 e³`` beside the mount's springs, by a scalar equation of its own."""
    base = hd.hydromount().select("F_y")
    model = nlmechss(base, [Spring("y", law=laws.cubic(1e7, 100)), Damper("y2", law=laws.quadratic(1e4))])
    rest = model.equilibrium(400.0)
    stiffness = 5500.0 - 500.0**2 / 1000.0
    y = scipy.optimize.brentq(lambda e: stiffness * e + 100 * e + 1e7 * e**3 - 400.0, 0.0, 1.0, xtol=1e-15)
    assert_allclose([rest.displacement["y"], rest.displacement["y2"]], [y, y / 2.0], rtol=1e-11)
    assert_allclose(mech2nlsys(model).dynamics(0.0, rest.state, rest.inputs), np.zeros(4), atol=1e-9)
    assert_allclose(model.tangent(rest).K[0, 0], 5600.0 + 3e7 * y**2, rtol=1e-9)
    named = model.equilibrium({"F_y": 400.0})
    assert_allclose(named.state, rest.state, rtol=1e-12)


def test_a_load_closes_a_gap() -> None:
    """Nothing holds the mass inside the gap, so it rests at the stop: ``way + F / k``."""
    model = nlmechss(mechss([[1.0]], None, [[0.0]]), Spring("q0", law=laws.gap(50.0, 0.2)))
    assert_allclose(model.equilibrium(10.0).displacement["q0"], 0.4, rtol=1e-12)
    with pytest.raises(LawError, match=r"Nothing holds q0 at rest"):
        model.equilibrium()


def test_a_load_that_nothing_answers_is_told() -> None:
    """A saturating force, and an accelerated base."""
    bounded = nlmechss(mechss([[1.0]], None, [[0.0]]), Force(lambda q, v, t: np.tanh(q), "q0"))  # noqa: ARG005
    with pytest.raises(LawError, match=r"No equilibrium was found|Nothing holds q0"):
        bounded.equilibrium(2.0)
    base = mechss(np.diag([1.0, 1.0]), None, [[1.0, -1.0], [-1.0, 1.0]]).prescribe_motion("q1", "acceleration")
    moved = nlmechss(base, Spring("q0", "q1", laws.cubic(1.0)))
    with pytest.raises(LawError, match=r"The motion of q1 is prescribed and does not rest"):
        moved.equilibrium(1.0)
    assert moved.equilibrium().displacement == {"q0": 0.0, "q1": 0.0}


def test_states_are_given_by_name() -> None:
    """And wrong ones are refused."""
    model = oil_mount()
    assert model.state({"y": 1.0, "y_dot": 2.0}).tolist() == [1.0, 0.0, 0.0, 2.0]
    assert model.state([1, 2, 3, 4]).tolist() == [1.0, 2.0, 3.0, 4.0]
    with pytest.raises(SignalNameError, match=r"no displacement or velocity 'x'"):
        model.state({"x": 1.0})
    with pytest.raises(MatrixError, match=r"must be finite numbers"):
        model.state({"y": np.inf})
    with pytest.raises(SignalNameError, match=r"no input 'x'"):
        model.state({}, {"x": 1.0})
    with pytest.raises(MatrixError, match=r"inputs must be a number, or one for each"):
        model.state({}, [1.0, 2.0])
    with pytest.raises(MatrixError, match=r"inputs must be finite numbers"):
        model.state({}, np.nan)
