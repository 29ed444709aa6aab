"""Plots by the data in their lines, their labels and legends; and the times of a step response."""

from collections.abc import Callable, Iterator
from typing import Any

import control
import hypothesis.strategies as st
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mech2ss, mechss, pencil_structure, zeros
from halfdof_ctrl.base.errors import ImproperError, ParameterError, SignalNameError
from halfdof_ctrl.design.lqr import lqr
from halfdof_ctrl.plots import bode_plot, pole_map_plot, step_plot
from halfdof_ctrl.plots.phase import continuous_phase
from halfdof_ctrl.systems.frequency import descriptor_response, frequency_response
from halfdof_ctrl.systems.step_times import MOST_STEPS, relevant_poles, step_times

ROUNDING = 1e-12  #: curve and markers come by different routes; both are exact to a few digits less than that
OMEGA = np.geomspace(0.5, 100.0, 60)  #: [rad/s] around the hydromount's modes


@pytest.fixture(autouse=True)
def _no_figures_left() -> Iterator[None]:
    """Close what a test drew."""
    yield
    plt.close("all")


def mount() -> SecondOrderModel:
    """Give the hydromount with one input and one output."""
    return hydromount().select(inputs="F_y", outputs="y")


def stiff() -> SecondOrderModel:
    """Give two half DOFs with poles 1e5 apart, -1e5 and -0.85."""
    C = np.diag([1.0, 1.0])
    return mechss(None, C, np.diag([1e5, 0.85]), [[1.0], [1.0]], [[1.0, 1.0]], dofs=["a", "b"])


def curve_of(lines: list[Line2D], which: int = 0) -> tuple[Any, Any]:
    """Give the coordinates of a line."""
    return np.asarray(lines[which].get_xdata()), np.asarray(lines[which].get_ydata())


def marked(lines: list[Line2D], text: str) -> Any:  # noqa: ANN401  # complex ndarray
    """Give the positions in the s-plane of the line whose label starts with a text."""
    line = next(line for line in lines if str(line.get_label()).startswith(text))
    return np.asarray(line.get_xdata()) + 1j * np.asarray(line.get_ydata())


def legend_texts(cplt: Any) -> list[str]:  # noqa: ANN401  # control.ControlPlot
    """Give the entries of the legend."""
    return [text.get_text() for text in cplt.legend.get_texts()]


# --- bode_plot


def test_bode_curve_is_the_frequency_response() -> None:
    """Magnitude and phase of the curve are those of `frequency_response`, to the last bit."""
    cplt = bode_plot(mount(), OMEGA)
    exact = frequency_response(mount(), OMEGA)
    omega, magnitude = curve_of(cplt.lines[0, 0])
    assert_array_equal(omega, OMEGA)
    assert_array_equal(magnitude, np.abs(exact.complex))
    assert_allclose(curve_of(cplt.lines[1, 0])[1], np.degrees(np.angle(exact.complex)), rtol=0, atol=1e-12)


def test_bode_markers_are_the_descriptor_response() -> None:
    """The markers are `descriptor_response` at a part of the frequencies, and lie on the curve."""
    cplt = bode_plot(hydromount())
    exact = descriptor_response(hydromount(), curve_of(cplt.lines[0, 0], 1)[0])
    for i, j in np.ndindex(3, 3):
        omega, magnitude = curve_of(cplt.lines[2 * i, j], 1)
        assert_array_equal(magnitude, np.abs(exact.complex[i, j]))
        for row in (2 * i, 2 * i + 1):
            on_curve = np.isin(curve_of(cplt.lines[row, j])[0], omega)
            values = curve_of(cplt.lines[row, j])[1][on_curve]
            assert_allclose(curve_of(cplt.lines[row, j], 1)[1], values, rtol=ROUNDING, atol=1e-9)


def test_a_marker_stands_on_every_resonance() -> None:
    """About 25 markers spread over the grid, one on the highest point of the curve."""
    cplt = bode_plot(mount())
    omega, magnitude = curve_of(cplt.lines[0, 0])
    marks = curve_of(cplt.lines[0, 0], 1)[0]
    assert 18 <= marks.size <= 26
    assert omega[magnitude.argmax()] in marks
    assert marks[0] == omega[0]
    assert marks[-1] == omega[-1]


def test_state_space_has_markers_only_with_a_reference() -> None:
    """A plain StateSpace is a curve alone; `reference` adds the descriptor form of a model."""
    sys = mech2ss(mount())
    assert len(bode_plot(sys, OMEGA).lines[0, 0]) == 1
    cplt = bode_plot(sys, OMEGA, reference=mount())
    assert legend_texts(cplt) == ["state space", "descriptor form"]
    assert cplt.axes[0, 0].get_ylabel() == "|y/F_y| [m/N]"


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        (mechss([[1]], None, [[100 + 5j]]), "model is complex"),
        (mechss(None, [[1]], [[1]]).select(outputs="q0_ddot"), "improper"),
        (mechss(np.diag([1.0, 0.0]), None, [[1, 1], [1, 0]]), "improper"),
    ],
    ids=["complex", "improper", "prescribed"],
)
def test_model_without_state_space_is_drawn_from_its_descriptor_form(model: SecondOrderModel, reason: str) -> None:
    """Where no state space exists the curve is `descriptor_response`, and the legend says why."""
    cplt = bode_plot(model, OMEGA)
    assert legend_texts(cplt) == [f"descriptor form (no state space: {reason})"]
    exact = np.asarray(descriptor_response(model, OMEGA).frdata)
    assert_array_equal(curve_of(cplt.lines[0, 0])[1], np.abs(exact[0, 0]))


def test_units_of_a_bode_plot_follow_the_arguments() -> None:
    """DB, Hz and rad change the data and the labels together."""
    cplt = bode_plot(mount(), OMEGA, dB=True, Hz=True, deg=False)
    exact = frequency_response(mount(), OMEGA).complex
    frequency, magnitude = curve_of(cplt.lines[0, 0])
    assert_array_equal(frequency, OMEGA / (2 * np.pi))
    assert_array_equal(magnitude, 20 * np.log10(np.abs(exact)))
    assert_allclose(curve_of(cplt.lines[1, 0])[1], np.angle(exact), rtol=ROUNDING)
    labels = [cplt.axes[0, 0].get_ylabel(), cplt.axes[1, 0].get_ylabel(), cplt.axes[1, 0].get_xlabel()]
    assert labels == ["|y/F_y| [dB re 1 m/N]", "phase [rad]", "frequency [Hz]"]


def test_every_axis_of_a_mimo_bode_plot_carries_its_unit() -> None:
    """Displacement, velocity and acceleration per force are m/N, (m/s)/N and (m/s²)/N."""
    model = hydromount().select(inputs=["F_y", "F_y1"], outputs=["y", "y_dot", "y_ddot"])
    cplt = bode_plot(model, OMEGA)
    assert cplt.axes.shape == (6, 2)
    assert [ax.get_ylabel().split("\n")[1] for ax in cplt.axes[::2, 1]] == ["[m/N]", "[(m/s)/N]", "[(m/s²)/N]"]
    assert {ax.get_ylabel() for ax in cplt.axes[1::2].flat} == {"phase [deg]"}
    assert {ax.get_xlabel() for ax in cplt.axes[-1]} == {"frequency [rad/s]"}


def test_unit_of_a_dof_carries_over_to_its_velocity_and_moment() -> None:
    """With phi in rad its velocity is in rad/s and the moment on it in N m."""
    shaft = mechss([[1]], [[1]], [[1]], G=[[1]], dofs="phi")
    label = bode_plot(shaft, OMEGA, units={"phi": "rad"}).axes[0, 0].get_ylabel()
    assert label == "|phi_dot/F_phi| [(rad/s)/(N m)]"


def test_no_unit_is_claimed_for_unknown_signals() -> None:
    """A signal that is no motion or force of the model has its name alone, until `units` names its unit."""
    model = mechss([[1]], [[1]], [[1]], [[2]], inputs="voltage")
    assert bode_plot(model, OMEGA).axes[0, 0].get_ylabel() == "|q0/voltage|"
    assert bode_plot(mech2ss(mount()), OMEGA).axes[0, 0].get_ylabel() == "|y/F_y|"
    assert bode_plot(model, OMEGA, units={"voltage": "V"}).axes[0, 0].get_ylabel() == "|q0/voltage| [m/V]"
    with pytest.raises(SignalNameError, match="no signal 'volts'"):
        bode_plot(model, OMEGA, units={"volts": "V"})


def test_finite_element_names_come_back_in_labels() -> None:
    """A DOF called 101.1 is written so, not as python-control's 101:1; a dollar sign starts no formula."""
    model = mechss([[1, 0], [0, 1]], None, [[2, -1], [-1, 2]], dofs=["101.1", "a$b$"])
    cplt = bode_plot(model.select("F_101.1", ["101.1", "a$b$"]), OMEGA)
    cplt.figure.canvas.draw()
    assert cplt.axes[0, 0].get_ylabel().startswith("|101.1/F_101.1|")


def test_a_decoupled_channel_is_drawn_without_a_warning() -> None:
    """A channel that is zero at all frequencies says so instead of failing on a logarithmic axis."""
    for dB in (False, True):
        cplt = bode_plot(mechss(np.eye(2), np.eye(2), np.eye(2)), OMEGA, dB=dB)
        cplt.figure.canvas.draw()
        assert [text.get_text() for text in cplt.axes[0, 1].texts] == ["q0 does not respond"]


@pytest.mark.parametrize("omega", [[0.0], [0.0, 1.0], [2.0]])
def test_few_frequencies_are_drawn_as_given(omega: list[float]) -> None:
    """Zero, one and two frequencies are points, also at a pole of the system."""
    cplt = bode_plot(mechss([[2]], None, None), omega)
    cplt.figure.canvas.draw()
    assert_array_equal(curve_of(cplt.lines[0, 0])[0], omega)


def test_phase_of_an_undamped_chain_falls_at_poles_and_rises_at_zeros() -> None:
    """Collocated receptance without damping: 0 and -180 degrees in turns, accelerance 180 and 0."""
    chain = mechss(np.eye(2), None, [[2, -1], [-1, 2]], dofs=["a", "b"])
    omega = np.array([0.5, 0.9, 1.2, 1.3, 1.5, 1.7, 2.0])  # poles at 1 and sqrt 3, zero at sqrt 2
    cplt = bode_plot(chain.select("F_a", ["a", "a_ddot"]), omega)
    receptance = [0, 0, -180, -180, 0, 0, -180]
    assert_allclose(curve_of(cplt.lines[1, 0])[1], receptance, atol=1e-9)
    assert_allclose(curve_of(cplt.lines[3, 0])[1], np.add(receptance, 180), atol=1e-9)


def test_phase_of_a_free_mass_is_minus_a_half_turn() -> None:
    """1/(m s^2) has the phase -180 degrees."""
    assert_allclose(curve_of(bode_plot(mechss([[2]], None, None)).lines[1, 0])[1], -180.0)


@given(st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=40))
def test_continuous_phase_takes_no_jump_above_half_a_turn(steps: list[float]) -> None:
    """Unwrapping gives back a phase with steps below pi, up to whole turns."""
    angle = np.cumsum(steps)
    phase = continuous_phase(np.exp(1j * angle))
    assert_allclose(np.diff(phase), np.diff(angle), atol=1e-9)
    turns = (phase - angle) / (2 * np.pi)
    assert_allclose(turns, np.round(turns), atol=1e-9)


def test_constant_magnitude_is_drawn_without_a_warning() -> None:
    """Values that differ in the last bit alone get limits of their own."""
    cplt = bode_plot(mechss(None, None, [[0, 3, 1], [0, -3, 4], [2, 3, 0]]))
    cplt.figure.canvas.draw()
    low, high = cplt.axes[0, 0].get_ylim()
    assert high / low > 10.0


def test_undamped_resonance_does_not_flatten_the_rest() -> None:
    """An infinite peak leaves the axes, whose range is that of the curve around it."""
    ax = bode_plot(mechss([[1]], None, [[1]])).axes[0, 0]
    assert ax.get_ylim()[1] < 1e6


def test_reference_of_another_size_is_refused() -> None:
    """A reference must have the inputs and outputs of the system."""
    with pytest.raises(ParameterError, match="1 outputs and 1 inputs"):
        bode_plot(mech2ss(mount()), reference=hydromount())


# --- step_plot


def test_step_curves_are_the_step_response() -> None:
    """Each output's line is `control.step_response` at the plotted times."""
    model = hydromount().select(outputs=["y", "y_ddot"])
    cplt = step_plot(model)
    time, _ = curve_of(cplt.lines[0, 0])
    exact = control.step_response(mech2ss(model), time)
    for i, j in np.ndindex(2, 3):
        assert_array_equal(curve_of(cplt.lines[i, j])[0], time)
        assert_array_equal(curve_of(cplt.lines[i, j])[1], exact.outputs[i, j])


def test_step_recovers_the_half_dofs_of_the_mount() -> None:
    """Below the output stand y1 and y2 as `ExactReduction.recover` gives them; y2 ends at F/K of the springs."""
    cplt = step_plot(mount(), np.linspace(0.0, 20.0, 2001))
    time, _ = curve_of(cplt.lines[0, 0])
    motion = exact_reduction(mount()).recover(control.step_response(mech2ss(mount()), time, squeeze=False))
    lines = cplt.lines[1, 0]
    assert [line.get_label() for line in lines] == ["y1 (half DOF)", "y2 (half DOF)"]
    assert_array_equal(curve_of(lines, 0)[1], motion["y1"][0])
    assert_array_equal(curve_of(lines, 1)[1], motion["y2"][0])
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


@pytest.mark.parametrize(
    ("poles", "horizon"),
    [
        ([-2.0], 2.5),
        ([-1e5, -0.5], 10.0),
        ([2j, -2j], 20 * np.pi),
        ([-0.01 + 2j, -0.01 - 2j], 20 * np.pi),
        ([0.0, 0.0], 1.0),
        ([], 1.0),
        ([0.0, -2.0], 2.5),
        ([0.5, -0.001], 10.0),
    ],
    ids=["lag", "stiff", "undamped", "lightly damped", "free mass", "static", "motor", "unstable"],
)
def test_horizon_follows_from_the_slowest_mode(poles: list[complex], horizon: float) -> None:
    """Five time constants, twenty periods, growth by exp(5), or one second where there is no scale."""
    time = step_times(poles)
    assert_allclose(time[-1], horizon, rtol=ROUNDING)
    assert_allclose(np.diff(time), time[1], rtol=1e-9)


def test_oscillation_that_lasts_is_resolved_beside_a_slow_mode() -> None:
    """An undamped mode beside a slow one gets 31 points a period while the cap allows, never below 6."""
    time = step_times([-1.0, 200j, -200j])
    assert time[1] * 200.0 <= 0.2 + 1e-12
    time = step_times([-1.0, 1e5j, -1e5j])
    assert time.size == MOST_STEPS + 1
    assert time[1] * 1e5 <= 1.0 + 1e-12


def test_rounded_poles_of_a_free_body_count_as_integrators() -> None:
    """Two masses on a spring, floating free: the double pole at the origin is exact, the horizon 20 periods."""
    sys = mech2ss(mechss(np.diag([1.0, 3.0]), None, [[7, -7], [-7, 7]]))
    poles = relevant_poles(sys.A, sys.B, sys.C, sys.D)
    assert np.count_nonzero(poles == 0.0) == 2
    assert_allclose(step_times(poles)[-1], 20 * 2 * np.pi / np.sqrt(7.0 * 4.0 / 3.0), rtol=1e-9)


def test_rounding_in_the_equations_of_a_free_body_does_not_make_it_a_vibration() -> None:
    """A rigid body motion whose stiffness is 2e-17 instead of zero has no period of 1e9 s."""
    time, _ = curve_of(step_plot(mechss([[1, -2], [-2, 4]], [[1, -1], [-1, 1]], [[1, -1], [-1, 1]])).lines[0, 0])
    assert_allclose(time[-1], 5.0, rtol=1e-9)


@given(
    st.lists(
        st.complex_numbers(min_magnitude=1e-6, max_magnitude=1e6, allow_nan=False, allow_infinity=False), max_size=6
    )
)
def test_times_are_always_finite_and_few(poles: list[complex]) -> None:
    """Any poles give 500 to 10000 equal steps of positive length."""
    time = step_times(poles)
    assert 501 <= time.size <= MOST_STEPS + 1
    assert np.isfinite(time).all()
    assert time[1] > 0.0


def test_meaningless_horizon_and_poles_are_refused() -> None:
    """A horizon must be a positive number, poles must be numbers."""
    with pytest.raises(ParameterError, match="positive number of seconds, not -1"):
        step_plot(mount(), -1.0)
    with pytest.raises(ParameterError, match="poles must be finite"):
        step_times([np.nan])


# --- pole_map_plot


def test_pole_map_shows_poles_eigenvalues_and_zeros() -> None:
    """Crosses are eig(A), circles the finite eigenvalues of the pencil, diamonds `zeros` of the model."""
    cplt = pole_map_plot(mount())
    lines = cplt.lines[0, 0]
    poles = marked(lines, "poles of A")
    assert_array_equal(np.sort_complex(poles), np.sort_complex(np.linalg.eigvals(exact_reduction(mount()).A)))
    assert_array_equal(marked(lines, "finite eigenvalues"), pencil_structure(mount()).finite_eigenvalues)
    assert_array_equal(marked(lines, "zeros"), zeros(mount()))


@pytest.mark.parametrize(
    ("model", "text"),
    [
        (hydromount(), "2 infinite eigenvalues deflated"),
        (mechss(np.diag([1, 0]), np.eye(2), np.eye(2)), "1 infinite eigenvalue deflated"),
        (mechss([[1]], None, [[1]]), "0 infinite eigenvalues deflated"),
    ],
    ids=["two", "one", "none"],
)
def test_legend_counts_the_deflated_eigenvalues(model: SecondOrderModel, text: str) -> None:
    """The number of infinite eigenvalues stands in the legend."""
    assert legend_texts(pole_map_plot(model))[-1] == text


def test_open_and_closed_loop_stand_together_in_different_colours() -> None:
    """With a feedback its poles are drawn beside those of the open loop."""
    feedback = lqr(mount(), displacement={"y": 1e8}, effort={"F_y": 1e-4})
    cplt = pole_map_plot(mount(), feedback=feedback)
    lines = cplt.lines[0, 0]
    assert_array_equal(marked(lines, "poles with feedback"), feedback.poles)
    assert lines[0].get_label() == "poles of A (open loop)"
    assert lines[0].get_color() != lines[1].get_color()
    with pytest.raises(ParameterError, match="as lqr"):
        pole_map_plot(mount(), feedback=feedback.K)  # type: ignore[arg-type]


def test_map_of_a_state_space_has_the_same_poles_and_zeros() -> None:
    """A plain StateSpace gives crosses and diamonds where the model has them, and no circles."""
    lines = pole_map_plot(mech2ss(mount())).lines[0, 0]
    assert_allclose(np.sort_complex(marked(lines, "zeros")), np.sort_complex(zeros(mount())), rtol=1e-9)
    assert [line.get_label() for line in lines] == ["poles of A", "zeros"]


def test_map_of_a_complex_model_has_circles_alone() -> None:
    """Without a real A the finite eigenvalues of the pencil stand alone."""
    lines = pole_map_plot(mechss([[1]], None, [[100 + 5j]])).lines[0, 0]
    assert str(lines[0].get_label()).startswith("finite eigenvalues")


def test_poles_far_apart_get_logarithmic_axes() -> None:
    """More than three decades between the poles: symlog; else linear; all poles within the limits."""
    wide, near = pole_map_plot(stiff()).axes[0, 0], pole_map_plot(mount()).axes[0, 0]
    assert (wide.get_xscale(), near.get_xscale()) == ("symlog", "linear")
    assert wide.get_xlim()[0] < -1e5
    assert near.get_ylim()[1] > 17.8


def test_rounded_poles_of_a_free_body_do_not_stretch_the_map() -> None:
    """A rigid body motion rounded off the origin beside a vibration leaves the axes linear."""
    cplt = pole_map_plot(mechss(np.diag([6, 7]), None, [[1, -1], [-1, 1]]))
    cplt.figure.canvas.draw()
    assert cplt.axes[0, 0].get_xscale() == "linear"


def test_coincident_poles_are_counted() -> None:
    """The double pole of a free mass is marked so."""
    texts = [text.get_text() for text in pole_map_plot(mechss([[2]], None, None), grid=False).axes[0, 0].texts]
    assert texts == ["2x"]


def test_grid_lines_have_the_damping_ratio_they_are_labelled_with() -> None:
    """Every grid line keeps either s's damping ratio or its modulus."""
    ax = pole_map_plot(mount()).axes[0, 0]
    lines = [line for line in ax.get_lines() if line.get_label() == "_grid"]
    assert len(lines) > 10
    for line in lines:
        s = np.asarray(line.get_xdata()) + 1j * np.asarray(line.get_ydata())
        assert min(np.ptp(s.real / np.abs(s)), np.ptp(np.abs(s)) / np.abs(s).max()) < 1e-9
    assert any("ζ = 0.1" in text.get_text() for text in ax.texts)


def test_axes_of_a_pole_map_carry_units() -> None:
    """Both axes are in rad/s; the z-plane of a sampled system has none."""
    ax = pole_map_plot(mount()).axes[0, 0]
    assert "[rad/s]" in ax.get_xlabel()
    assert "[rad/s]" in ax.get_ylabel()
    sampled = pole_map_plot(mech2ss(mount()).sample(0.02)).axes[0, 0]
    assert sampled.get_xlabel() == "real part of z [-]"


# --- all

Plot = Callable[..., Any]
PLOTS = pytest.mark.parametrize(("plot", "shape"), [(bode_plot, (2, 1)), (step_plot, (2, 1)), (pole_map_plot, (1, 1))])


@PLOTS
def test_plots_return_a_control_plot_and_open_one_figure(plot: Plot, shape: tuple[int, int]) -> None:
    """The result holds lines, axes, figure and legend; no setting of matplotlib changes; nothing warns when saved."""
    before = dict(mpl.rcParams)
    cplt = plot(mount(), title="Mount")
    assert isinstance(cplt, control.ControlPlot)
    assert cplt.lines.shape == cplt.axes.shape == shape
    assert all(len(lines) >= 1 and isinstance(lines[0], Line2D) for lines in cplt.lines.flat)
    assert plt.get_fignums() == [cplt.figure.number]
    assert cplt.figure.get_suptitle() == "Mount"
    cplt.figure.canvas.draw()
    assert dict(mpl.rcParams) == before


@PLOTS
def test_plots_draw_on_given_axes(plot: Plot, shape: tuple[int, int]) -> None:
    """With `ax` no figure is opened and the title goes to the first axes."""
    figure, axes = plt.subplots(*shape)
    cplt = plot(mount(), ax=axes, title="Mount")
    assert cplt.figure is figure
    assert_array_equal(cplt.axes.flat, np.atleast_1d(axes))
    assert cplt.axes[0, 0].get_title() == "Mount"
    assert isinstance(cplt.legend.axes, Axes)
    assert plt.get_fignums() == [figure.number]
    figure.canvas.draw()


@pytest.mark.parametrize("plot", [bode_plot, step_plot])
def test_grid_lines_can_be_left_out(plot: Plot) -> None:
    """Without a word from matplotlib, and taken away where they were."""
    axes = plot(mount()).axes
    assert all(line.get_visible() for ax in axes.flat for line in ax.get_xgridlines())
    plot(mount(), ax=axes, grid=False)
    assert not any(line.get_visible() for ax in axes.flat for line in ax.get_xgridlines())


@PLOTS
def test_axes_of_the_wrong_shape_are_refused(plot: Plot, shape: tuple[int, int]) -> None:
    """The message says which shape is needed, and nothing is drawn before."""
    _, axes = plt.subplots(3, 2)
    with pytest.raises(ParameterError, match=rf"shape \(3, 2\), but this plot needs axes of shape \({shape[0]}, "):
        plot(mount(), ax=axes)
    with pytest.raises(ParameterError, match="must be matplotlib Axes"):
        plot(mount(), ax=["here"])
    assert not any(ax.has_data() for ax in axes.flat)


@PLOTS
def test_other_systems_are_refused(plot: Plot, shape: tuple[int, int]) -> None:
    """A transfer function must be converted first."""
    del shape
    with pytest.raises(ParameterError, match="not TransferFunction"):
        plot(control.tf([1], [1, 1]))


@PLOTS
def test_two_systems_share_axes_and_one_legend(plot: Plot, shape: tuple[int, int]) -> None:
    """Drawing again on the axes of a plot adds lines, keeps units and replaces the legend."""
    del shape
    first = plot(mount(), label="300")
    labels = [ax.get_ylabel() for ax in first.axes.flat]
    second = plot(hydromount(C_h=900.0).select("F_y", "y"), ax=first.axes, label="900")
    assert second.figure.legends == [second.legend]
    assert {text.split(":")[0] for text in legend_texts(second)} == {"300", "900"}
    assert [ax.get_ylabel() for ax in first.axes.flat] == labels


def test_state_space_over_a_model_keeps_the_units() -> None:
    """A StateSpace knows no units; drawn over a model it leaves the label that does."""
    cplt = bode_plot(mount(), OMEGA)
    bode_plot(mech2ss(mount()), OMEGA, ax=cplt.axes)
    assert cplt.axes[0, 0].get_ylabel() == "|y/F_y| [m/N]"


def test_grid_can_be_left_out() -> None:
    """Without grid the pole map has no lines of equal damping."""
    ax = pole_map_plot(mount(), grid=False).axes[0, 0]
    assert not [line for line in ax.get_lines() if line.get_label() == "_grid"]
