"""What prony_plot draws, by the data of its lines."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ParameterError

F = np.geomspace(1.0, 100.0, 40)


def test_points_and_series_are_drawn() -> None:
    """Measured points as circles, the series as a line through them."""
    s = 2j * np.pi * F
    fit = hd.fit_prony(F, 1e3 + 5e2 * s / (s + 60))
    drawn = hd.prony_plot(fit)
    for row, part in enumerate((np.real, np.imag)):
        points, line = drawn.lines[row, 0]
        assert_allclose(points.get_xydata().T, [F, part(fit.stiffness)])
        assert_allclose(line.get_ydata(), part(fit(line.get_xdata())))
    assert drawn.axes[1, 0].get_xlabel() == "frequency [Hz]"
    plt.close(drawn.figure)


def test_fluid_column_is_drawn_where_no_series_follows() -> None:
    """A third line, on axes that are given."""
    u = F / 10.0
    moved = -(u**2) + 0.5j * u
    fit = hd.fit_prony(F, 2e5 + 1.5e5 * moved / (1 + moved))
    _, ax = plt.subplots(2, 1)
    drawn = hd.prony_plot(fit, ax=ax, unit="Pa", title="mount")
    assert len(drawn.lines[0, 0]) == 3
    assert ax[0].get_ylabel() == "K' [Pa]"
    assert ax[0].get_title() == "mount"
    plt.close(drawn.figure)


def test_what_is_no_fit_is_refused() -> None:
    """By its type."""
    with pytest.raises(ParameterError, match="not a float"):
        hd.prony_plot(3.0)  # type: ignore[arg-type]
