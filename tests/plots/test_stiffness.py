"""Dynamic stiffness and transmissibility plots by the data in their lines, their labels and legends."""

from collections.abc import Callable
from functools import partial
from typing import Any

import control
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.lines import Line2D
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import (
    SecondOrderModel,
    dynamic_stiffness,
    dynamic_stiffness_plot,
    hydromount,
    mech2ss,
    mechss,
    transmissibility,
    transmissibility_plot,
)
from halfdof_ctrl.base.errors import ParameterError, SignalNameError
from halfdof_ctrl.systems.stiffness import motion_frequencies

OMEGA = np.linspace(0.0, 100.0, 50)  #: [rad/s] around the hydromount's modes
LAST_DIGITS = 1e-13  #: what is computed twice in the same way; processors differ in the last digits of other strides
Plot = Callable[..., Any]
STIFFNESS: Plot = partial(dynamic_stiffness_plot, dof="y")
TRANSMISSIBILITY: Plot = partial(transmissibility_plot, from_="y", to="y2")
PLOTS = pytest.mark.parametrize("plot", [STIFFNESS, TRANSMISSIBILITY], ids=["stiffness", "transmissibility"])


def mount(C_h: float = 300.0) -> SecondOrderModel:
    """Give the hydromount without its mass."""
    return hydromount(m=0, C_h=C_h)


def undamped() -> SecondOrderModel:
    """Give three masses in a row without damping."""
    return mechss(np.eye(3), None, [[2, -1, 0], [-1, 2, -1], [0, -1, 1]], dofs=["a", "b", "c"])


def ordinates(cplt: Any, row: int, which: int = 0) -> Any:  # noqa: ANN401
    """Give what a curve shows."""
    return np.asarray(cplt.lines[row, 0][which].get_ydata())


def legend_texts(cplt: Any) -> list[str]:  # noqa: ANN401
    """Give the entries of the legend."""
    return [text.get_text() for text in cplt.legend.get_texts()]


def test_stiffness_is_drawn_as_modulus_and_loss_angle_over_hertz() -> None:
    """Modulus [N/m], angle [deg] and frequency [Hz] of `dynamic_stiffness`, on linear axes."""
    cplt = dynamic_stiffness_plot(mount(), "y", OMEGA)
    values = dynamic_stiffness(mount(), "y", 1j * OMEGA)
    assert_array_equal(np.asarray(cplt.lines[0, 0][0].get_xdata()), OMEGA / (2 * np.pi))
    assert_allclose(ordinates(cplt, 0), np.abs(values), rtol=LAST_DIGITS)
    assert_allclose(ordinates(cplt, 1), np.degrees(np.angle(values)), atol=1e-12)
    above, below = cplt.axes[:, 0]
    assert (above.get_xscale(), above.get_yscale(), below.get_xscale()) == ("linear",) * 3
    assert [above.get_ylabel(), below.get_ylabel()] == ["dynamic stiffness\nat y [N/m]", "loss angle [deg]"]
    assert below.get_xlabel() == "frequency [Hz]"
    assert cplt.figure.get_suptitle() == "hydromount: dynamic stiffness at y"
    assert cplt.legend is None


def test_transmissibility_is_drawn_on_logarithmic_axes() -> None:
    """Modulus and phase of `transmissibility`, of motion and of force."""
    omega = np.geomspace(0.1, 100.0, 30)
    model = hydromount()
    cplt = transmissibility_plot(model, "y", "y2", omega, Hz=False)
    assert_allclose(ordinates(cplt, 0), np.abs(transmissibility(model, "y", "y2", 1j * omega)), rtol=LAST_DIGITS)
    above, below = cplt.axes[:, 0]
    assert (above.get_xscale(), above.get_yscale(), below.get_xscale()) == ("log", "log", "log")
    assert [above.get_ylabel(), below.get_ylabel()] == ["transmissibility\n|y2/y| [-]", "phase [deg]"]
    assert below.get_xlabel() == "frequency [rad/s]"
    cplt = transmissibility_plot(model, "y", ["y1", "y2"], omega, kind="force")
    force = transmissibility(model, "y", ["y1", "y2"], 1j * omega, kind="force")
    assert_allclose(ordinates(cplt, 0), np.abs(force), rtol=LAST_DIGITS)
    assert cplt.axes[0, 0].get_ylabel() == "transmissibility\n|R_y1+R_y2/F_y| [-]"
    assert cplt.figure.get_suptitle() == "hydromount: transmissibility of force from y to y1+y2"


def test_scales_can_be_chosen() -> None:
    """Frequencies of the default grid follow the axis."""
    cplt = dynamic_stiffness_plot(mount(), "y", xscale="log", yscale="log")
    assert {ax.get_xscale() for ax in cplt.axes.flat} == {"log"}
    assert cplt.axes[0, 0].get_yscale() == "log"
    grid = motion_frequencies([mount()], "y", free=True)
    assert_array_equal(np.asarray(cplt.lines[0, 0][0].get_xdata()), grid / (2 * np.pi))
    cplt = transmissibility_plot(hydromount(), "y", "y2", xscale="linear", yscale="linear")
    assert {ax.get_xscale() for ax in cplt.axes.flat} == {"linear"}
    assert np.asarray(cplt.lines[0, 0][0].get_xdata())[0] == 0.0


@PLOTS
def test_several_models_are_compared_on_the_same_frequencies(plot: Plot) -> None:
    """A parameter study: a curve and an entry of the legend for each."""
    values = [100.0, 300.0, 900.0]
    cplt = plot([mount(C_h) for C_h in values], label=[f"{C_h} N s/m" for C_h in values])
    assert legend_texts(cplt) == ["100.0 N s/m", "300.0 N s/m", "900.0 N s/m"]
    for row in range(2):
        lines = cplt.lines[row, 0]
        assert len({line.get_color() for line in lines}) == 3
        for line in lines:
            assert_array_equal(np.asarray(line.get_xdata()), np.asarray(lines[0].get_xdata()))


def test_models_stand_in_the_legend_by_name() -> None:
    """Numbered where they share it, and where they have none."""
    bare = mechss(None, hydromount().C, hydromount().K, dofs=["y", "y1", "y2"])
    cplt = dynamic_stiffness_plot([mount(), bare, hydromount()], "y")
    assert legend_texts(cplt) == ["hydromount 1", "model", "hydromount 3"]
    assert cplt.figure.get_suptitle() == "dynamic stiffness at y"


def test_unit_follows_the_dof() -> None:
    """An angle has a stiffness in N m/rad; DOFs of different units that move together have none."""
    shaft = mechss(np.eye(2), None, [[2, -1], [-1, 2]], dofs=["phi", "x"])
    label = dynamic_stiffness_plot(shaft, "phi", units={"phi": "rad"}).axes[0, 0].get_ylabel()
    assert label == "dynamic stiffness\nat phi [(N m)/rad]"
    label = dynamic_stiffness_plot(shaft, ["phi", "x"], units={"phi": "rad"}).axes[0, 0].get_ylabel()
    assert label == "dynamic stiffness\nat phi+x"
    label = transmissibility_plot(shaft, "phi", "x", units={"phi": "rad"}).axes[0, 0].get_ylabel()
    assert label == "transmissibility\n|x/phi| [m/rad]"
    plt.close("all")
    with pytest.raises(SignalNameError, match="no signal 'psi'"):
        dynamic_stiffness_plot(shaft, "phi", units={"psi": "rad"})
    assert plt.get_fignums() == []


@PLOTS
def test_plots_return_a_control_plot_and_open_one_figure(plot: Plot) -> None:
    """The result holds lines, axes and figure; no setting of matplotlib changes; nothing warns when saved."""
    before = dict(mpl.rcParams)
    cplt = plot(mount(), title="Mount")
    assert isinstance(cplt, control.ControlPlot)
    assert cplt.lines.shape == cplt.axes.shape == (2, 1)
    assert all(len(lines) == 1 and isinstance(lines[0], Line2D) for lines in cplt.lines.flat)
    assert plt.get_fignums() == [cplt.figure.number]
    assert cplt.figure.get_suptitle() == "Mount"
    cplt.figure.canvas.draw()
    assert dict(mpl.rcParams) == before


@PLOTS
def test_plots_draw_on_given_axes(plot: Plot) -> None:
    """With `ax` no figure is opened, and a second call adds to the first."""
    figure, axes = plt.subplots(2)
    plot(mount(), ax=axes, label="300", title="Mount")
    cplt = plot(mount(900.0), ax=axes, label="900")
    assert cplt.figure is figure
    assert axes[0].get_title() == "Mount"
    assert legend_texts(cplt) == ["300", "900"]
    assert plt.get_fignums() == [figure.number]
    figure.canvas.draw()


@pytest.mark.parametrize("yscale", ["linear", "log"])
def test_undamped_resonances_do_not_flatten_the_rest(yscale: Any) -> None:  # noqa: ANN401
    """An infinite peak leaves the axes at the top; below zero there is nothing."""
    for cplt in (
        dynamic_stiffness_plot(undamped(), "a", yscale=yscale),
        transmissibility_plot(undamped(), "a", "c", yscale=yscale),
    ):
        cplt.figure.canvas.draw()
        low, high = cplt.axes[0, 0].get_ylim()
        assert low >= 0.0
        assert high < 1e5


@pytest.mark.parametrize("omega", [[0.0], [1.0], [0.0, 1.0], None])
def test_constant_stiffness_is_drawn_without_a_warning(omega: list[float] | None) -> None:
    """A spring alone, and few frequencies, as they are."""
    for scale in ("linear", "log"):
        cplt = dynamic_stiffness_plot(mechss(None, None, [[3]]), "q0", omega, xscale=scale, yscale=scale)
        cplt.figure.canvas.draw()
        assert set(ordinates(cplt, 0)) == {3.0}
        low, high = cplt.axes[0, 0].get_ylim()
        assert low < 2.0
        assert high > 4.0


def test_dof_that_does_not_follow_is_drawn_without_a_warning() -> None:
    """Zero at all frequencies, on logarithmic axes too."""
    cplt = transmissibility_plot(mechss(np.eye(2), np.eye(2), np.eye(2)), "q0", "q1")
    cplt.figure.canvas.draw()
    assert not ordinates(cplt, 0).any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sysdata": mech2ss(hydromount())}, "sysdata must be a SecondOrderModel or a list of some, not StateSpace"),
        ({"sysdata": []}, "sysdata must be a SecondOrderModel"),
        ({"sysdata": [mount(), 3]}, "sysdata must be a SecondOrderModel"),
        ({"label": ["a", "b"]}, "label must give a text for each of 1 models, not 2: a, b"),
        ({"xscale": "symlog"}, "xscale must be linear or log, not 'symlog'"),
        ({"yscale": None}, "yscale must be linear or log, not None"),
        ({"ax": "here"}, "ax must be matplotlib Axes"),
    ],
)
@PLOTS
def test_wrong_arguments_are_refused(plot: Plot, options: dict[str, object], words: str) -> None:
    """By name, before anything is drawn."""
    with pytest.raises(ParameterError, match=words):
        plot(**({"sysdata": mount()} | options))
    assert plt.get_fignums() == []


def test_axes_of_the_wrong_shape_are_refused() -> None:
    """The message says which shape is needed."""
    _, axes = plt.subplots(3, 2)
    with pytest.raises(ParameterError, match=r"shape \(3, 2\), but this plot needs axes of shape \(2, 1\)"):
        dynamic_stiffness_plot(mount(), "y", ax=axes)
    with pytest.raises(SignalNameError, match="no DOF 'z'"):
        dynamic_stiffness_plot(mount(), "z")
    assert not any(ax.has_data() for ax in axes.flat)
