"""Plots: Bode diagram, step response, pole map, each with state space and descriptor form together; and sweeps.

All return `control.ControlPlot` and draw on a new figure or on the axes given as `ax`; they never show a
window and change no setting of matplotlib. What comes of the state space is a line or a cross in colour, what the
descriptor form says of it is an open black circle.
"""

from halfdof_ctrl.bodeplot import bode_plot
from halfdof_ctrl.polemap import pole_map_plot
from halfdof_ctrl.stepplot import step_plot
from halfdof_ctrl.sweepplot import sweep_plot

__all__ = ["bode_plot", "pole_map_plot", "step_plot", "sweep_plot"]
