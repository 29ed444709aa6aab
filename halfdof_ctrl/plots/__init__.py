"""Plots: Bode diagram, step response, pole map; dynamic stiffness and transmissibility; sweeps.

The first three show the state space and the descriptor form together, the others the descriptor form alone. All
return `control.ControlPlot` and draw on a new figure or on the axes given as `ax`; they never show a window and
change no setting of matplotlib. What comes of the state space is a line or a cross in colour, what the descriptor form
says of it is an open black circle; where the descriptor form stands alone it is a line.
"""

from halfdof_ctrl.plots.bode import bode_plot
from halfdof_ctrl.plots.pole_map import pole_map_plot
from halfdof_ctrl.plots.prony import prony_plot
from halfdof_ctrl.plots.step import step_plot
from halfdof_ctrl.plots.stiffness import dynamic_stiffness_plot, transmissibility_plot
from halfdof_ctrl.plots.sweep import sweep_plot

__all__ = [
    "bode_plot",
    "dynamic_stiffness_plot",
    "pole_map_plot",
    "prony_plot",
    "step_plot",
    "sweep_plot",
    "transmissibility_plot",
]
