"""Plots: Bode diagram, step response, pole map; dynamic stiffness and transmissibility.

The first three show the state space and the descriptor form together, the others the descriptor form alone. All
return `control.ControlPlot` and draw on a new figure or on the axes given as `ax`; they never show a window and
change no setting of matplotlib. What comes of the state space is a line or a cross in colour, what the descriptor form
says of it is an open black circle; where the descriptor form stands alone it is a line.
"""

from halfdof_ctrl.bodeplot import bode_plot
from halfdof_ctrl.polemap import pole_map_plot
from halfdof_ctrl.stepplot import step_plot
from halfdof_ctrl.stiffnessplot import dynamic_stiffness_plot, transmissibility_plot

__all__ = ["bode_plot", "dynamic_stiffness_plot", "pole_map_plot", "step_plot", "transmissibility_plot"]
