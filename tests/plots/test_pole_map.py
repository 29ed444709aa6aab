"""The pole map by the data in its lines, its labels and legend."""

import itertools

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mech2ss, mechss, pencil_structure, zeros
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.design.lqr import lqr
from halfdof_ctrl.plots import pole_map_plot
from support.figures import legend_texts, marked, mount, stiff

LAST_DIGITS = 1e-13  #: what is computed twice in the same way; processors differ in the last digits


def test_pole_map_shows_poles_eigenvalues_and_zeros() -> None:
    """Crosses are the poles of the state space, circles the finite eigenvalues of the pencil, diamonds `zeros`."""
    cplt = pole_map_plot(mount())
    lines = cplt.lines[0, 0]
    poles = marked(lines, "poles of A")
    assert_allclose(
        np.sort_complex(poles), np.sort_complex(np.linalg.eigvals(exact_reduction(mount()).A)), rtol=LAST_DIGITS
    )
    assert_allclose(marked(lines, "finite eigenvalues"), pencil_structure(mount()).finite_eigenvalues, rtol=LAST_DIGITS)
    assert_allclose(marked(lines, "zeros"), zeros(mount()), rtol=LAST_DIGITS)


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
    assert_allclose(marked(lines, "poles with feedback"), feedback.poles, rtol=LAST_DIGITS)
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


def test_zeros_far_out_of_the_unit_circle_are_told_in_words_and_leave_it_its_room() -> None:
    """A zero at -30 of ``(z + 30) / ((z - 0.5) (z - 0.9))``."""
    sampled = control.ss([[0.5, 1.0], [0.0, 0.9]], [[0.0], [1.0]], [[30.5, 1.0]], [[0.0]], 0.1)
    cplt = pole_map_plot(sampled)
    plane = cplt.axes[0, 0]
    assert plane.get_xlim()[0] > -2.0
    assert [text.get_text() for text in plane.texts if "beyond" in text.get_text()] == ["zeros beyond: -30"]
    plt.close(cplt.figure)


@pytest.mark.parametrize("width", [3.5, 6.0, 14.0])
def test_powers_of_ten_on_an_axis_have_room(width: float) -> None:
    """Poles from 1 to 1e12 rad/s, on axes of any width: numbers do not overlap, and the largest decade has one."""
    figure, ax = plt.subplots(figsize=(width, 3.0), layout="constrained")
    pole_map_plot(control.ss(np.diag([-1.0, -1e12]), [[1.0], [1.0]], [[1.0, 1.0]], [[0.0]]), ax=ax)
    figure.canvas.draw()
    low, high = ax.get_xlim()
    labels = [label for label in ax.get_xticklabels() if low <= label.get_position()[0] <= high]
    boxes = [label.get_window_extent() for label in labels]
    assert len(boxes) > 2
    assert all(one.x1 <= other.x0 for one, other in itertools.pairwise(boxes))
    assert ax.get_xticks().min() == -1e12
    plt.close(figure)
