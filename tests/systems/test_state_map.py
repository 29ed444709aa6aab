"""The way between states and DOFs."""

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csc_array

from halfdof_ctrl import exact_reduction, hydromount, lqr, mech2ss, mechss, state_map
from halfdof_ctrl.errors import (
    CloseDecisionWarning,
    EnergyFormError,
    ImproperError,
    InconsistentStateError,
    ParameterError,
)
from halfdof_ctrl.systems.state_map import STATE_KINDS, States

ROUNDING = 1e-12  #: relative, of responses of the mount in other states
TIME = np.linspace(0.0, 2.0, 201)


@pytest.mark.parametrize("kind", STATE_KINDS)
def test_transfer_function_does_not_depend_on_the_states(kind: States) -> None:
    """Displacements, velocities and accelerations of all DOFs, where these are proper."""
    model = hydromount().select("F_y", ["y", "y_dot", "y_ddot", "y1", "y1_dot", "y2"])
    sys = mech2ss(model, states=kind)
    for s in (0.5, 3.0j, 17.0j, 200.0j):
        assert_allclose(sys(s), model(s), rtol=ROUNDING)
    assert sys.output_labels == list(model.outputs)


@pytest.mark.parametrize("kind", STATE_KINDS)
def test_initial_state_and_recovered_motion_are_those_of_dof_states(kind: States) -> None:
    """`state` and `recover` give the same free motion, half DOFs and their velocities included."""
    model = hydromount().select("F_y", "y")
    reduction, states = exact_reduction(model), state_map(model, kind)
    given = {"y": 0.01, "y1": -0.002}, {"y": 0.3}
    x0 = states.state(*given)
    assert_allclose(states.to_dofs(x0), reduction.state(*given), rtol=0, atol=ROUNDING)
    assert_allclose(states.from_dofs(reduction.state(*given)), x0, rtol=0, atol=ROUNDING)
    motions = [
        map_.recover(control.initial_response(sys, TIME, x, return_states=True))
        for map_, sys, x in (
            (states, mech2ss(model, states=kind), x0),
            (reduction, mech2ss(model), reduction.state(*given)),
        )
    ]
    for name in ("y", "y1", "y2", "y_dot", "y1_dot", "y2_dot"):
        size = np.abs(motions[1][name]).max()
        assert_allclose(motions[0][name], motions[1][name], rtol=0, atol=ROUNDING * size)


@pytest.mark.parametrize("kind", STATE_KINDS)
def test_static_dofs_follow_the_input(kind: States) -> None:
    """A massless node under a ramp: displacement at once, velocity by the slope of the input."""
    model = mechss(np.diag([1.0, 0]), np.diag([0.5, 0]), [[3, -1], [-1, 2]], dofs=["mass", "node"]).select(
        "F_node", "mass"
    )
    sys = mech2ss(model, states=kind)
    motion = state_map(model, kind).recover(control.forced_response(sys, TIME, TIME, return_states=True))
    assert_allclose(motion["node"], (TIME + motion["mass"]) / 2.0, rtol=ROUNDING, atol=ROUNDING)
    assert_allclose(motion["node_dot"], (1.0 + motion["mass_dot"]) / 2.0, rtol=ROUNDING)


@pytest.mark.parametrize("kind", STATE_KINDS)
def test_gains_and_weights_follow(kind: States) -> None:
    """`control.lqr` in any states, carried back, is the gain on DOF states."""
    model = hydromount().select("F_y", "y")
    states, dofs = state_map(model, kind), exact_reduction(model)
    Q = np.diag([100.0, 1.0, 2.0, 3.0])
    gain = control.lqr(states.A, states.B, states.weight_from_dofs(Q), [[1e-4]], method="scipy")[0]
    exact = lqr(model, Q, [[1e-4]]).K
    assert_allclose(states.gain_on_dofs(gain), exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    assert states.dof_states == dofs.states


@pytest.mark.parametrize("kind", STATE_KINDS)
def test_states_of_a_prescribed_motion_contain_the_input(kind: States) -> None:
    """A base that is displaced at the start: the state needs u0, and the mass is where it was said to be."""
    model = hydromount().prescribe_motion("y2", outputs=["y", "R_y2"])
    states = state_map(model, kind)
    x0 = states.state({"y": 0.01, "y1": 0.0}, {"y": 0.2}, u0=0.003)
    motion = states.displacement
    assert_allclose((motion.X @ x0 + motion.direct(1) @ [0.003])[:2], [0.01, 0.0], rtol=0, atol=1e-15)
    assert_allclose(
        mech2ss(model, states=kind, improper="drop")(3j), mech2ss(model, improper="drop")(3j), rtol=ROUNDING
    )


def test_contradicting_initial_values_are_refused() -> None:
    """A half DOF whose velocity is given otherwise than its damper requires."""
    with pytest.raises(InconsistentStateError, match="y1_dot"):
        state_map(hydromount(), "energy").state({"y": 0.01}, {"y1": 5.0})


def test_response_of_another_system_is_not_recovered() -> None:
    """The number of states differs."""
    response = control.step_response(mech2ss(mechss([[1]], [[1]], [[1]])), TIME, return_states=True)
    with pytest.raises(InconsistentStateError, match="The response has 2 states"):
        state_map(hydromount(), "energy").recover(response)


def test_states_in_mixed_coordinates_are_mapped() -> None:
    """Where the reduction mixes DOFs, energy states do not exist, and scaled ones keep its names."""
    model = mechss([[1, 1], [1, 1]], np.eye(2), [[3, 0], [0, 5]])
    assert [name.partition("/")[0] for name in state_map(model, "scaled").states] == list(exact_reduction(model).states)
    with pytest.raises(EnergyFormError, match="has no inertia"):
        state_map(model, "energy")


def test_sparse_models_have_the_same_states() -> None:
    """A sparse copy of the mount, dense inside."""
    mount = hydromount()
    sparse = mechss(csc_array(mount.M), csc_array(mount.C), csc_array(mount.K), dofs=mount.dofs).select("F_y", "y")
    for kind in STATE_KINDS:
        assert_allclose(mech2ss(sparse, states=kind)(2j), mount.select("F_y", "y")(2j), rtol=ROUNDING)
        assert_allclose(
            state_map(sparse, kind).state({"y": 1.0}), state_map(mount, kind).state({"y": 1.0}), rtol=ROUNDING
        )


def test_improper_models_are_refused_in_all_states() -> None:
    """The velocity of a static DOF under its own force."""
    model = mechss(None, None, [[2]], dofs="node").select(outputs="node_dot")
    for kind in ("scaled", "energy"):
        with pytest.raises(ImproperError, match="node_dot from F_node"):
            mech2ss(model, states=kind)


def test_unknown_states_are_refused() -> None:
    """A word that is none of the four."""
    for function in (mech2ss, state_map):
        with pytest.raises(ParameterError, match="states must be one of 'dofs', 'scaled', 'energy', 'modal'"):
            function(hydromount(), states="canonical")  # type: ignore[arg-type]


def test_small_masses_taken_as_none_have_no_energy_states() -> None:
    """A reduction with tol has fewer states than M, C, K as they stand."""
    model = mechss(np.diag([1.0, 1e-13]), np.eye(2), [[2, -1], [-1, 2]])
    with pytest.raises(EnergyFormError, match="it has 3 states where M, C, K as they stand have 4"):
        mech2ss(exact_reduction(model, tol=1e-12), states="energy")


def test_nearly_free_motion_is_kept_and_warned_of() -> None:
    """A ground spring of 4e-15 of the coupling is no free motion, but its digits are not in the numbers."""
    K = np.array([[1.0 + 2.0**-48, -1.0], [-1.0, 1.0]])
    with pytest.warns(CloseDecisionWarning, match="nearly leaves a motion free"):
        sys = mech2ss(mechss(np.eye(2), None, K), states="energy")
    assert np.count_nonzero(sys.poles() == 0.0) == 0


def test_map_says_what_it_is() -> None:
    """Kind and size in one line."""
    assert repr(state_map(hydromount(), "energy")) == "StateMap: 4 states of kind 'energy' for 3 DOFs"
    assert_array_equal(state_map(hydromount(), "dofs").T, np.eye(4))
