"""Figures as files, and drawing where there is no display: all that the report and the command ask of matplotlib."""

from pathlib import Path

import control
import matplotlib.pyplot as plt

from halfdof_ctrl.files.containers import PathLike
from halfdof_ctrl.files.writing import replacing

DPI = 200  #: of PNG figures


def save_figure(cplt: control.ControlPlot, path: PathLike) -> None:
    """Write a plot to a file whose ending is the format, and close it."""
    kind = Path(path).suffix[1:].lower()
    try:
        with replacing(path) as stream:
            cplt.figure.savefig(stream, format=kind, dpi=DPI)
    finally:
        close_figure(cplt)


def close_figure(cplt: control.ControlPlot) -> None:
    """Let go of a plot that is not to be shown."""
    plt.close(cplt.figure)


def without_windows() -> None:
    """Let matplotlib draw without a display from now on."""
    plt.switch_backend("Agg")
