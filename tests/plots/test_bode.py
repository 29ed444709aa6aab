"""The Bode diagram by the data in its lines, its labels and legend."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import DataLimitWarning, ParameterError, SignalNameError
from halfdof_ctrl.plots import bode_plot
from halfdof_ctrl.systems.frequency import descriptor_response, frequency_response
from halfdof_ctrl.systems.sampled_phase import continuous_phase
from support.figures import OMEGA, curve_of, legend_texts, mount

LAST_DIGITS = 1e-13  #: what is computed twice in the same way; processors differ in the last digits
ROUNDING = 1e-12  #: curve and markers come by different routes; both are exact to a few digits less than that


def test_bode_curve_is_the_frequency_response() -> None:
    """Magnitude and phase of the curve are those of `frequency_response`, to the last bit."""
    cplt = bode_plot(mount(), OMEGA)
    exact = frequency_response(mount(), OMEGA)
    omega, magnitude = curve_of(cplt.lines[0, 0])
    assert_array_equal(omega, OMEGA)
    assert_allclose(magnitude, np.abs(exact.complex), rtol=LAST_DIGITS)
    assert_allclose(curve_of(cplt.lines[1, 0])[1], np.degrees(np.angle(exact.complex)), rtol=0, atol=1e-12)


def test_bode_markers_are_the_descriptor_response() -> None:
    """The markers are `descriptor_response` at a part of the frequencies, and lie on the curve."""
    cplt = bode_plot(hydromount())
    exact = descriptor_response(hydromount(), curve_of(cplt.lines[0, 0], 1)[0])
    for i, j in np.ndindex(3, 3):
        omega, magnitude = curve_of(cplt.lines[2 * i, j], 1)
        assert_allclose(magnitude, np.abs(exact.complex[i, j]), rtol=LAST_DIGITS)
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
    assert_allclose(curve_of(cplt.lines[0, 0])[1], np.abs(exact[0, 0]), rtol=LAST_DIGITS)


def test_units_of_a_bode_plot_follow_the_arguments() -> None:
    """DB, Hz and rad change the data and the labels together."""
    cplt = bode_plot(mount(), OMEGA, dB=True, Hz=True, deg=False)
    exact = frequency_response(mount(), OMEGA).complex
    frequency, magnitude = curve_of(cplt.lines[0, 0])
    assert_array_equal(frequency, OMEGA / (2 * np.pi))
    assert_allclose(magnitude, 20 * np.log10(np.abs(exact)), rtol=LAST_DIGITS)
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


def test_needles_and_notches_of_undamped_structures_leave_the_axis() -> None:
    """Peaks of 1e10 times what lies between them: the axis shows the rest, curve and markers stay on 0 and -180."""
    K = 2.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    cplt = bode_plot(mechss(np.eye(6), None, K).select("F_q0", "q0"))
    low, high = cplt.axes[0, 0].get_ylim()
    assert high < 1e6
    assert low > 1e-12
    for line in cplt.lines[1, 0]:
        phase = np.asarray(line.get_ydata(), dtype=float)
        phase = phase[np.isfinite(phase)]
        assert (np.abs(phase + 90.0) <= 90.0 + 1e-6).all()


def test_curve_and_marks_warn_once_of_what_entries_determine() -> None:
    """A mass on a link of 1e12 N/m, whose node stands on 1 N/m: one cause, one warning."""
    model = mechss(np.diag([0.0, 1.0]), np.diag([0.1, 0.0]), [[1e12 + 1, -1e12], [-1e12, 1e12]]).select("F_q1", "q1")
    with pytest.warns(DataLimitWarning, match="determine the response of q1 to F_q1") as told:
        bode_plot(model, [0.1, 0.7, 2.0])
    assert len(told) == 1
