"""Models to draw, and what stands in the lines and the legend of a figure."""

from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from halfdof_ctrl import SecondOrderModel, hydromount, mechss

OMEGA = np.geomspace(0.5, 100.0, 60)  #: [rad/s] around the hydromount's modes


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
