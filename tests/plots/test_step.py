"""The step response by the data in its lines, its labels and legend."""

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import exact_reduction, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import ImproperError, ParameterError
from halfdof_ctrl.plots import step_plot
from halfdof_ctrl.systems.step_times import step_times
from support.figures import curve_of, legend_texts, mount, stiff

OTHER_STATES = 1e-11  #: of the largest value: rounding of 2000 steps in energy coordinates and in DOF states


def test_step_curves_are_the_step_response() -> None:
    """Each output's line is `control.step_response` at the plotted times, here in other states."""
    model = hydromount().select(outputs=["y", "y_ddot"])
    cplt = step_plot(model)
    time, _ = curve_of(cplt.lines[0, 0])
    exact = control.step_response(mech2ss(model), time)
    for i, j in np.ndindex(2, 3):
        assert_array_equal(curve_of(cplt.lines[i, j])[0], time)
        size = np.abs(exact.outputs[i, j]).max()
        assert_allclose(curve_of(cplt.lines[i, j])[1], exact.outputs[i, j], rtol=0, atol=OTHER_STATES * size)


def test_step_recovers_the_half_dofs_of_the_mount() -> None:
    """Below the output stand y1 and y2 as `ExactReduction.recover` gives them; y2 ends at F/K of the springs."""
    cplt = step_plot(mount(), np.linspace(0.0, 20.0, 2001))
    time, _ = curve_of(cplt.lines[0, 0])
    motion = exact_reduction(mount()).recover(control.step_response(mech2ss(mount()), time, squeeze=False))
    lines = cplt.lines[1, 0]
    assert [line.get_label() for line in lines] == ["y1 (half DOF)", "y2 (half DOF)"]
    for k, dof in enumerate(("y1", "y2")):
        size = np.abs(motion[dof]).max()
        assert_allclose(curve_of(lines, k)[1], motion[dof][0], rtol=0, atol=OTHER_STATES * size)
    assert_allclose(curve_of(lines, 1)[1][-1], 500.0 / (5500.0 * 1000.0 - 500.0**2), rtol=1e-4)
    assert cplt.axes[1, 0].get_ylabel() == "displacement [m]"


def test_static_dof_jumps_with_the_force() -> None:
    """A node between springs of 3 and 6 N/m follows a force at once: 1/9 m at all times."""
    cplt = step_plot(mechss(None, None, [[9]], dofs="node"))
    assert legend_texts(cplt) == ["outputs", "node (static DOF)"]
    assert_allclose(curve_of(cplt.lines[1, 0])[1], 1.0 / 9.0)


def test_recovered_dofs_are_grouped_by_their_unit() -> None:
    """A half DOF in rad gets axes of its own below those in m."""
    model = mechss(np.diag([1.0, 0, 0]), np.eye(3), np.eye(3), dofs=["x", "y", "phi"]).select("F_x", "x")
    cplt = step_plot(model, units={"phi": "rad"})
    assert [ax.get_ylabel() for ax in cplt.axes[:, 0]] == ["x [m]", "y [m]", "phi [rad]"]


def test_legend_names_eight_of_many_recovered_dofs() -> None:
    """Of twelve half DOFs seven are named and the others counted."""
    cplt = step_plot(mechss(None, np.eye(12), np.eye(12)).select("F_q0", "q0"))
    assert len(cplt.lines[1, 0]) == 12
    assert legend_texts(cplt)[-2:] == ["q6 (half DOF)", "5 more"]


def test_step_of_a_state_space_has_its_outputs_alone() -> None:
    """A StateSpace has no DOFs to recover; its signals get no unit but the time."""
    cplt = step_plot(mech2ss(mount()), 3.0)
    assert cplt.axes.shape == (1, 1)
    assert cplt.axes[0, 0].get_ylabel() == "y"
    assert cplt.axes[0, 0].get_xlabel() == "time after the step F_y = 1 [s]"
    assert curve_of(cplt.lines[0, 0])[0][-1] == 3.0


def test_step_of_a_sampled_system_keeps_its_samples() -> None:
    """A discrete-time system is drawn at its own sampling times."""
    cplt = step_plot(mech2ss(mount()).sample(0.05), 2.0)
    assert_allclose(np.diff(curve_of(cplt.lines[0, 0])[0]), 0.05)


@pytest.mark.parametrize("times", [[0.0, 1.0, 3.0], [0.0], [1.0, 0.0], [[0.0, 1.0]], [0.0, np.nan]])
def test_uneven_times_are_refused(times: list[float]) -> None:
    """Times that python-control cannot simulate on are refused before it is asked."""
    with pytest.raises(ParameterError, match="equidistant"):
        step_plot(mount(), times)


def test_improper_step_is_refused_by_name() -> None:
    """A model without state space has no step response here."""
    with pytest.raises(ImproperError, match="q0_ddot from F_q0"):
        step_plot(mechss(None, [[1]], [[1]]).select(outputs="q0_ddot"))


# --- times


def test_stiff_model_is_followed_until_its_slow_mode_settles() -> None:
    """Poles -1e5 and -0.85: five time constants of the slow one, not of the fast one, in few points."""
    time, response = curve_of(step_plot(stiff()).lines[0, 0])
    assert_allclose(time[-1], 5.0 / 0.85, rtol=1e-6)
    assert time.size < 2000
    assert_allclose(response[-1], 1e-5 + (1 - np.exp(-5.0)) / 0.85, rtol=1e-6)


def test_mode_that_no_output_shows_does_not_stretch_the_time() -> None:
    """The slow mode of the stiff model is left out where only the fast DOF is driven and seen."""
    sys = mech2ss(stiff().select("F_a", "a"))
    assert_allclose(curve_of(step_plot(sys).lines[0, 0])[0][-1], 5e-5, rtol=1e-6)


def test_rounding_in_the_equations_of_a_free_body_does_not_make_it_a_vibration() -> None:
    """A rigid body motion whose stiffness is 2e-17 instead of zero has no period of 1e9 s."""
    time, _ = curve_of(step_plot(mechss([[1, -2], [-2, 4]], [[1, -1], [-1, 1]], [[1, -1], [-1, 1]])).lines[0, 0])
    assert_allclose(time[-1], 5.0, rtol=1e-9)


def test_meaningless_horizon_and_poles_are_refused() -> None:
    """A horizon must be a positive number, poles must be numbers."""
    with pytest.raises(ParameterError, match="positive number of seconds, not -1"):
        step_plot(mount(), -1.0)
    with pytest.raises(ParameterError, match="poles must be finite"):
        step_times([np.nan])
