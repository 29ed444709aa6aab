"""What all plots do alike: figures, given axes, grid, refusals."""

from collections.abc import Callable
from typing import Any

import control
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.testing import assert_array_equal

from halfdof_ctrl import hydromount, mech2ss
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.plots import bode_plot, pole_map_plot, step_plot
from support.figures import OMEGA, legend_texts, mount

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
