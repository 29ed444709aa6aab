"""Measured points of a dynamic stiffness and the springs and dampers that follow them."""

from typing import cast

import control
import numpy as np

from halfdof_ctrl.base.doors import require_switches, require_texts
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.parts.prony import PronyFit, counted
from halfdof_ctrl.plots.axes import AxesLike, draw_grid, draw_legend, draw_title, label_y, no_lines, prepared_axes

CURVE_POINTS = 400  #: frequencies of the curves


def prony_plot(
    fit: PronyFit, *, ax: AxesLike = None, grid: bool = True, title: str | None = None, unit: str = "N/m"
) -> control.ControlPlot:
    """Draw the measured storage and loss stiffness, the fitted series, and the fluid column where there is one.

    Parameters
    ----------
    fit : PronyFit
        What `fit_prony` returned.
    ax : (2,) array_like of Axes, optional
        For the real and for the imaginary part; a new figure by default.
    grid : bool
        Draw grid lines.
    title : str, optional
        Above the figure; by default the number of branches and the rms.
    unit : str
        Of the stiffness, such as ``"Pa"`` for a modulus.

    Returns
    -------
    control.ControlPlot
        ``lines`` has the shape of the axes, (2, 1): measured points, the series, and the fluid column beside a series.

    Raises
    ------
    ParameterError
        Something that is no fit, or axes of the wrong shape.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> from halfdof_ctrl.parts.prony import fit_prony
    >>> f = np.geomspace(1, 100, 9)
    >>> cplt = prony_plot(fit_prony(f, 1000 + 5j * f / (1 + 0.1j * f)))
    >>> [axes.get_ylabel() for axes in cplt.axes[:, 0]]
    ["K' [N/m]", "K'' [N/m]"]
    >>> plt.close(cplt.figure)
    """
    if not isinstance(cast("object", fit), PronyFit):
        msg = f"prony_plot draws what fit_prony returned, not a {type(fit).__name__}."
        raise ParameterError(msg, parameter="fit", value=fit)
    require_texts(title=title, unit=unit)
    require_switches(grid=grid)
    axes = prepared_axes(ax, (2, 1), "real and imaginary part in rows", height=4.2)
    f = np.geomspace(fit.frequency[0], fit.frequency[-1], CURVE_POINTS)
    curves = [(counted(fit.k.size), fit(f), "-")]
    if fit.fluid is not None:
        values = fit.fluid.part.prescribe_motion("bottom").select("F_top", "top")(2j * np.pi * f)
        curves.append((f"with fluid at {fit.fluid.frequency:.3g} Hz", 1.0 / values, "--"))
    lines = no_lines(axes)
    for row, part in enumerate((np.real, np.imag)):
        panel = axes[row, 0]
        drawn = panel.semilogx(fit.frequency, part(fit.stiffness), "ko", markerfacecolor="none", label="measured")
        for label, values, style in curves:
            drawn += panel.semilogx(f, part(values), style, label=label)
        lines[row, 0] = drawn
        label_y(panel, f"K{chr(39) * (row + 1)} [{unit}]")
        panel.ticklabel_format(axis="y", style="sci", scilimits=(-2, 5), useMathText=True)
        panel.yaxis.get_offset_text().set_fontsize("small")
    axes[1, 0].set_xlabel("frequency [Hz]")
    draw_grid(axes[:, 0], on=grid)
    legend = draw_legend(axes, own=ax is None)
    draw_title(axes, f"{counted(fit.k.size)}, rms {fit.rms:.1e}" if title is None else title, own=ax is None)
    return control.ControlPlot(lines, axes, axes[0, 0].figure, legend=legend)
