"""mech2nlsys: against the linear reduction, and linearized analytically."""

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl import Damper, Law, Spring, laws, mech2nlsys, mech2ss, mechss, nlmechss
from halfdof_ctrl.errors import ImproperError, LawError
from support.mounts_with_laws import oil_mount

LINEAR = 1e-12  #: a linear law through the nonlinear way, of the largest entry
SLOPE = 1e-9  #: analytic slopes against closed forms


def laws_of(c: float) -> list[Law | float]:
    """Give one linear law in many dresses."""
    return [
        c,
        laws.quadratic(0, c),
        laws.bilinear(c, c),
        laws.cubic(0, c),
        Law(lambda v: c * v),
        Law(lambda v: c * v, lambda v: c + 0 * v, lambda f: f / c),
    ]


@pytest.mark.parametrize("which", range(6))
def test_a_linear_law_gives_the_linear_reduction(which: int) -> None:
    """A, B, C, D of `mech2ss` come back through the nonlinear way, states in the same order."""
    outputs = ["y", "y1", "y2", "y_ddot", "y2_dot"]
    linear = mech2ss(hd.hydromount().select(["F_y", "F_y2"], outputs))
    model = nlmechss(hd.hydromount(C_h=0).select(["F_y", "F_y2"], outputs), Damper("y2", law=laws_of(300.0)[which]))
    system = mech2nlsys(model)
    assert system.state_labels == linear.state_labels
    assert (system.input_labels, system.output_labels) == (linear.input_labels, linear.output_labels)
    x = np.array([0.1, -0.2, 0.3, 0.7])
    found = control.linearize(system, x, [1.0, 2.0])
    for ours, theirs in zip(
        (found.A, found.B, found.C, found.D), (linear.A, linear.B, linear.C, linear.D), strict=True
    ):
        assert_allclose(ours, theirs, rtol=0.0, atol=(LINEAR if which != 4 else 1e-9) * np.abs(theirs).max())
    u = np.array([1.0, 2.0])
    expected = linear.A @ x + linear.B @ u
    assert_allclose(system.dynamics(0.0, x, u), expected, rtol=0.0, atol=LINEAR * np.abs(expected).max())


@given(c1=st.floats(0.0, 100.0), x=st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4), u=st.floats(-100.0, 100.0))
def test_the_rate_of_the_oil_answers_its_force(c1: float, x: list[float], u: float) -> None:
    """``c1 v + c2 |v| v = K_v (y - y2) - K_s y2`` for v = y2', to rounding of the difference."""
    system = mech2nlsys(oil_mount(laws.quadratic(1e4, c1)))
    v = system.dynamics(0.0, x, [u])[2]
    force = 500.0 * x[0] - 1000.0 * x[2]
    size = 500.0 * abs(x[0]) + 1000.0 * abs(x[2])
    assert_allclose(c1 * v + 1e4 * abs(v) * v, force, rtol=1e-12, atol=1e-13 * size)


@pytest.mark.parametrize("c1", [30.0, 1.0, 1e-3])
def test_linearize_takes_the_slope_of_the_law(c1: float) -> None:
    """At rest y2' answers with 1/c1, where a fixed step of 1e-6 is off by 1 % at 30 and 73 % at 1."""
    system = mech2nlsys(oil_mount(laws.quadratic(1e4, c1)))
    found = control.linearize(system, np.zeros(4), [0.0], name="small")
    assert_allclose(found.A[2], [500.0 / c1, 0.0, -1000.0 / c1, 0.0], rtol=SLOPE, atol=0.0)
    assert found.name == "small"
    copied = control.linearize(system, 0, 0, copy_names=True)
    assert copied.state_labels == system.state_labels


def test_linearize_where_it_moves_is_the_derivative_of_the_dynamics() -> None:
    """Central differences of the dynamics at a moving state."""
    system = mech2nlsys(oil_mount(laws.quadratic(1e4, 0.5)))
    x = np.array([0.02, 0.01, -0.03, 0.5])
    found = control.linearize(system, x, [3.0])
    step = 1e-6
    columns = [
        (system.dynamics(0.0, x + e, [3.0]) - system.dynamics(0.0, x - e, [3.0])) / (2 * step) for e in step * np.eye(4)
    ]
    assert_allclose(found.A, np.array(columns).T, rtol=1e-7, atol=1e-7)


def test_an_infinite_slope_is_refused_by_the_dof() -> None:
    """A pure square law at rest: the slope of its inverse is infinite."""
    with pytest.raises(LawError, match=r"damper 1 \(quadratic\) acts on y2, and its slope there is zero") as caught:
        control.linearize(mech2nlsys(oil_mount(laws.quadratic(1e4))), np.zeros(4), [0.0])
    assert caught.value.dofs == ("y2",)
    root = nlmechss(mechss([[1.0]], None, [[1.0]]), Damper("q0", law=laws.power(1, 0.5)))
    with pytest.raises(LawError, match=r"acts on q0, and its slope there is infinite"):
        control.linearize(mech2nlsys(root), np.zeros(2), [0.0])
    two = mechss(None, None, [[2.0, -1.0], [-1.0, 2.0]])
    both = nlmechss(two, [Damper("q0", "q1", laws.quadratic(1)), Damper("q1", law=laws.quadratic(1))])
    with pytest.raises(LawError, match=r"together they have a slope of zero|its slope there is zero"):
        control.linearize(mech2nlsys(both), np.zeros(2), np.zeros(2))


def test_elements_on_states_are_explicit() -> None:
    """A stop on y and friction on its rate add to the force on y alone."""
    base = hd.hydromount().select("F_y")
    model = nlmechss(base, [Spring("y", law=laws.gap(1e5, 0.01)), Damper("y", law=laws.coulomb(4, 0.1))])
    x, u = np.array([0.03, 0.0, 0.02, 0.3]), np.array([5.0])
    linear = mech2ss(base)
    extra = 1e5 * 0.02 + 4 * 0.3 / np.hypot(0.3, 0.1)
    assert_allclose(mech2nlsys(model).dynamics(0.0, x, u), linear.A @ x + linear.B @ (u - extra), rtol=1e-13)


def test_motion_may_be_prescribed_before() -> None:
    """Base excitation through a square damper: its force acts on the mass, and shows in the reaction."""
    model = mechss(np.diag([2.0, 1.0]), None, [[8.0, -8.0], [-8.0, 8.0]], dofs=["mass", "base"])
    moved = model.prescribe_motion("base", "acceleration", outputs=["mass_ddot", "R_base"])
    system = mech2nlsys(nlmechss(moved, Damper("mass", "base", laws.quadratic(3.0))))
    x = dict(zip(system.state_labels, [0.5, 0.1, 2.0, -1.0], strict=True))
    assert x == {"mass": 0.5, "base": 0.1, "mass_dot": 2.0, "base_dot": -1.0}
    pull = 8.0 * (0.5 - 0.1) + 3.0 * 9.0
    rates = system.dynamics(0.0, list(x.values()), [7.0])
    assert_allclose(rates, [2.0, -1.0, -pull / 2.0, 7.0], rtol=1e-13)
    assert_allclose(system.output(0.0, list(x.values()), [7.0]), [-pull / 2.0, 7.0 - pull], rtol=1e-13)


def test_a_prescribed_velocity_reaches_a_damper_at_once() -> None:
    """With ``base' = u`` the rate of the damper contains the input, and nothing is solved for."""
    model = mechss(np.diag([2.0, 1.0]), None, [[8.0, -8.0], [-8.0, 8.0]], dofs=["mass", "base"])
    moved = model.prescribe_motion("base", "velocity", outputs=["mass", "R_base"])
    nonlinear = nlmechss(moved.select(outputs="mass"), Damper("mass", "base", laws.quadratic(3.0)))
    system = mech2nlsys(nonlinear)
    assert system.state_labels == ["mass", "base", "mass_dot"]
    assert_allclose(system.dynamics(0.0, [0.0, 0.0, 2.0], [-1.0]), [2.0, -1.0, -13.5], rtol=1e-12)


def test_the_system_is_a_pure_function() -> None:
    """The same arguments give the same bits whatever was asked before."""
    system = mech2nlsys(oil_mount(laws.table([-1, 0, 1], [-40, 0, 70], extend="linear")))
    x, u = np.array([0.01, 0.0, 0.02, 0.1]), [1.0]
    first = system.dynamics(0.0, x, u)
    system.dynamics(0.0, 100.0 * x, u)
    assert system.dynamics(0.0, x, u).tolist() == first.tolist()


def test_what_follows_a_derivative_is_refused() -> None:
    """The acceleration of the half DOF would be the derivative of what its law answers."""
    with pytest.raises(ImproperError, match=r"No state space gives y2_ddot from") as caught:
        mech2nlsys(oil_mount(outputs=("y2_ddot",)))
    assert ("damper 1 (quadratic)", "y2_ddot", 1) in caught.value.pairs
    moved = hd.hydromount(C_h=0).prescribe_motion("y", outputs=["y2"])
    with pytest.raises(ImproperError, match=r"follows the derivative of an input"):
        nlmechss(moved, Damper("y1", law=laws.quadratic(1.0)))
