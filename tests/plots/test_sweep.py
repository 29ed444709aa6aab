"""Plots of sweeps by the data in their lines, their colours and legends."""

from collections.abc import Iterator
from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, SweepResult, hydromount, mech2ss, mechss, sweep, sweep_plot
from halfdof_ctrl.base.errors import FailedCasesWarning, ParameterError, SignalNameError
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.systems.sampled_phase import continuous_phase

OMEGA = np.geomspace(1.0, 50.0, 9)
LAST_DIGITS = 1e-13  #: what is computed twice in the same way; processors differ in the last digits of other strides
ROUNDING = 1e-12  #: in degrees


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Keep small problems to one thread."""
    with limited_threads(1):
        yield


def damped(c: float, k: float = 1.0) -> SecondOrderModel:
    """Give a mass of 1 kg, of which the poles meet at ``c = 2 sqrt(k)``."""
    return mechss([[1]], [[c]], [[k]])


def mounts(**parameters: Any) -> SweepResult:  # noqa: ANN401
    """Sweep the receptance of the hydromount."""
    return sweep(hydromount, parameters, omega=OMEGA, inputs="F_y", outputs="y")


def legend_texts(cplt: Any) -> list[str]:  # noqa: ANN401  # control.ControlPlot
    """Give the entries of the legend."""
    return [] if cplt.legend is None else [text.get_text() for text in cplt.legend.get_texts()]


def colour_bar(cplt: Any) -> Any:  # noqa: ANN401
    """Give the axes of the colour bar, None where there is none."""
    others = [ax for ax in cplt.figure.axes if ax not in list(cplt.axes.flat)]
    return others[0] if others else None


# --- Bode curves


def test_each_case_is_a_curve_in_order() -> None:
    """Magnitude and phase of the response, to the last bit, with a legend for a few values."""
    result = mounts(C_h=[100, 300, 900])
    cplt = sweep_plot(result)
    response = np.asarray(result.response)[:, 0, 0]
    for place, (above, below) in enumerate(zip(cplt.lines[0, 0], cplt.lines[1, 0], strict=True)):
        assert_array_equal(above.get_xdata(), OMEGA)
        assert_allclose(above.get_ydata(), np.abs(response[place]), rtol=LAST_DIGITS)
        assert_allclose(below.get_ydata(), np.degrees(continuous_phase(response[place])), rtol=ROUNDING)
    assert legend_texts(cplt) == ["C_h = 100", "C_h = 300", "C_h = 900"]
    assert colour_bar(cplt) is None
    assert cplt.axes[0, 0].get_ylabel() == "|y/F_y| [m/N]"


def test_scales_and_units_are_those_of_a_bode_plot() -> None:
    """DB, Hz and rad; an angle has its moment; a parameter its unit at the colour bar."""
    result = sweep(hydromount, {"C_h": np.geomspace(10, 1000, 9)}, omega=OMEGA, inputs="F_y", outputs=["y", "y_dot"])
    cplt = sweep_plot(result, dB=True, Hz=True, deg=False, units={"y": "rad", "C_h": "N s/m"}, title="mount")
    assert_allclose(cplt.lines[0, 0][0].get_xdata(), OMEGA / (2 * np.pi))
    assert_allclose(cplt.lines[0, 0][3].get_ydata(), 20 * np.log10(np.abs(np.asarray(result.response)[3, 0, 0])))
    assert cplt.axes[2, 0].get_ylabel() == "|y_dot/F_y|\n[dB re 1 (rad/s)/(N m)]"
    assert cplt.axes[3, 0].get_ylabel() == "phase [rad]"
    assert colour_bar(cplt).get_ylabel() == "C_h [N s/m]"
    assert cplt.figure.get_suptitle() == "mount"


def test_signals_without_a_meaning_have_a_unit_on_request() -> None:
    """An output that is no motion of a DOF."""
    result = sweep(lambda k: mechss([[1]], [[1]], [[k]], F=[[2]], outputs="twice"), {"k": [1.0, 2.0]}, omega=OMEGA)
    assert sweep_plot(result).axes[0, 0].get_ylabel() == "|twice/F_q0|"
    assert sweep_plot(result, units={"twice": "mm"}).axes[0, 0].get_ylabel() == "|twice/F_q0| [mm/N]"


def test_many_values_are_coloured_by_their_size() -> None:
    """A colour bar instead of a legend, logarithmic over more than a decade and a half."""
    for values, logarithmic in ((np.linspace(100, 900, 9), False), (np.geomspace(10, 1000, 9), True)):
        result = mounts(C_h=values)
        cplt = sweep_plot(result)
        assert legend_texts(cplt) == []
        bar = colour_bar(cplt)
        assert_allclose(bar.get_ylim(), [values[0], values[-1]])
        assert (bar.get_yscale() == "log") is logarithmic
        colours = [line.get_color() for line in cplt.lines[0, 0]]
        assert len(set(map(tuple, colours))) == 9


def test_colours_follow_another_parameter_on_request() -> None:
    """Two axes: all cases are drawn, those with the same value in the same colour."""
    cplt = sweep_plot(mounts(C_h=[100, 300], K_v=[250, 500, 1000]), parameter="K_v")
    colours = [line.get_color() for line in cplt.lines[0, 0]]
    assert colours[:3] == colours[3:]
    assert len(set(map(tuple, colours))) == 3
    assert legend_texts(cplt) == ["K_v = 250", "K_v = 500", "K_v = 1000"]


def test_some_cases_are_picked_by_value() -> None:
    """Up to rounding; the colours are then those of the parameter that is left."""
    result = mounts(C_h=[0.1 + 0.2, 300], K_v=[250, 500, 1000])
    cplt = sweep_plot(result, at={"C_h": 0.3})
    assert legend_texts(cplt) == ["K_v = 250", "K_v = 500", "K_v = 1000"]
    assert_allclose(cplt.lines[0, 0][1].get_ydata(), np.abs(np.asarray(result.response)[0, 1, 0, 0]), rtol=LAST_DIGITS)


def test_values_that_are_no_numbers_have_a_legend() -> None:
    """In the order in which they were given, up to any number."""
    kinds = list("hgfedcba")
    result = sweep(lambda kind: hydromount(C_h=100 * (1 + ord(kind))), {"kind": kinds}, omega=OMEGA, outputs="y")
    assert legend_texts(sweep_plot(result)) == [f"kind = {kind}" for kind in kinds]
    assert len(sweep_plot(result, at={"kind": "e"}).lines[0, 0]) == 1


def test_failed_cases_are_left_out() -> None:
    """Of curves, colours and legend."""
    with pytest.warns(FailedCasesWarning, match="C_h = -1"):
        result = mounts(C_h=[100, -1, 300])
    cplt = sweep_plot(result)
    assert legend_texts(cplt) == ["C_h = 100", "C_h = 300"]
    with pytest.raises(ParameterError, match="No case is left to draw"):
        sweep_plot(result, at={"C_h": -1})


def test_one_model_is_one_curve_without_a_legend() -> None:
    """Nothing was varied."""
    cplt = sweep_plot(sweep(hydromount(), omega=OMEGA, inputs="F_y", outputs="y"))
    assert len(cplt.lines[0, 0]) == 1
    assert legend_texts(cplt) == []


def test_curves_go_on_given_axes() -> None:
    """With legend and title there."""
    _, axes = plt.subplots(2, 1)
    cplt = sweep_plot(mounts(C_h=[100, 300]), ax=axes, title="here")
    assert cplt.axes[0, 0] is axes[0]
    assert axes[0].get_title() == "here"
    assert axes[0].get_legend() is cplt.legend


def test_a_mass_at_its_own_force_keeps_its_side_on_a_coarse_grid() -> None:
    """Undamped chains, three frequencies: 0 or -180 degrees for the displacement, 180 more for the acceleration."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])

    def chain(k: float) -> SecondOrderModel:
        return mechss(np.eye(2), None, k * K)

    result = sweep(chain, {"k": [1.0, 3.0]}, omega=[0.1, 1.4, 9.0], inputs="F_q0", outputs=["q0", "q0_ddot", "q1"])
    cplt = sweep_plot(result)
    displacements = [line.get_ydata() for line in cplt.lines[1, 0]]
    assert_allclose(displacements[0], [0.0, -180.0, -180.0], atol=ROUNDING)
    for one, other in zip(displacements, cplt.lines[3, 0], strict=True):
        assert_allclose(other.get_ydata(), one + 180.0, atol=ROUNDING)
    plt.close(cplt.figure)


# --- poles


def test_poles_move_along_branches_from_cross_to_square() -> None:
    """Two poles meet at critical damping; each branch is in order of the damping."""
    damping = np.linspace(0.0, 4.0, 9)
    cplt = sweep_plot(sweep(damped, {"c": damping}))
    *cases, first, second = cplt.lines[0, 0]
    assert [line.get_marker() for line in cases] == ["x", *["o"] * 7, "s"]
    roots = -damping[:, None] / 2 + np.sqrt((damping[:, None] / 2 + 0j) ** 2 - 1) * [1, -1]
    for place, line in enumerate(cases):
        found = np.sort_complex(np.asarray(line.get_xdata()) + 1j * np.asarray(line.get_ydata()))
        assert_allclose(found, np.sort_complex(roots[place]), atol=1e-7)  # the double pole is known to sqrt(eps)
    ends = {complex(line.get_xdata()[-1], line.get_ydata()[-1]).real for line in (first, second)}
    assert_allclose(sorted(ends), [-2 - np.sqrt(3), -2 + np.sqrt(3)])
    assert legend_texts(cplt) == ["c = 0", "c = 4"]
    assert colour_bar(cplt) is not None


def test_arrows_point_the_way_that_poles_go() -> None:
    """One on each branch that is long enough to see."""
    cplt = sweep_plot(sweep(damped, {"c": [0.0, 0.5, 1.0]}))
    arrows = [text for text in cplt.axes[0, 0].texts if getattr(text, "arrow_patch", None) is not None]
    assert len(arrows) == 2
    for arrow in arrows:
        (x0, y0), (x1, y1) = arrow.xyann, arrow.xy
        assert x1 < x0  # to the left, towards more damping,
        assert abs(y1) < abs(y0)  # and to the real axis
    still = sweep_plot(sweep(damped, {"c": [0.0, 1e-6]}))
    assert not [text for text in still.axes[0, 0].texts if getattr(text, "arrow_patch", None) is not None]


def test_branches_run_along_the_parameter_of_the_colours() -> None:
    """For each value of the other one; a failed case between is passed over."""
    with pytest.warns(FailedCasesWarning, match="C_h = -1"):
        result = sweep(hydromount, {"K_v": [500.0, 1000.0], "C_h": [100.0, -1.0, 300.0]})
    cplt = sweep_plot(result, parameter="C_h")
    branches = [line for line in cplt.lines[0, 0] if line.get_linestyle() == "-"]
    assert len(branches) == 2 * 4
    assert all(len(line.get_xdata()) == 2 for line in branches)


def test_a_sample_is_a_cloud() -> None:
    """Without branches, since its cases have no order."""
    generator = np.random.default_rng(4)
    sample = {"c": generator.uniform(0.1, 0.3, 20), "k": generator.uniform(0.9, 1.1, 20)}
    cplt = sweep_plot(sweep(damped, sample, paired=True), parameter="k")
    assert len(cplt.lines[0, 0]) == 20
    assert {line.get_marker() for line in cplt.lines[0, 0]} == {"o"}
    assert legend_texts(cplt) == []
    assert colour_bar(cplt).get_ylabel() == "k"


def test_poles_of_sampled_systems_lie_in_the_unit_circle() -> None:
    """The plane is that of z."""
    result = sweep(lambda c: control.c2d(mech2ss(damped(c)), 0.1), {"c": [0.5, 1.0]})
    assert sweep_plot(result).axes[0, 0].get_xlabel() == "real part of z [-]"


# --- refusals


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"kind": "nyquist"}, "kind = 'nyquist', but a sweep is drawn as 'bode' or 'poles'"),
        ({"kind": "bode"}, "The result has no frequency response: give omega in sweep"),
        ({"parameter": "K_v"}, "The sweep varied no parameter 'K_v'. It varied: C_h"),
        ({"at": {"K_v": 500}}, "The sweep varied no parameter 'K_v'"),
        ({"at": {"C_h": 500}}, "no case has C_h = 500. There are 100, 300"),
        ({"ax": 3}, "ax must be matplotlib Axes"),
    ],
)
def test_what_cannot_be_drawn_is_refused(keywords: dict[str, Any], message: str) -> None:
    """With what there is."""
    result = sweep(hydromount, {"C_h": [100, 300]})
    with pytest.raises(ParameterError, match=message):
        sweep_plot(result, **keywords)


def test_a_result_without_poles_has_none_to_draw() -> None:
    """They were not asked for."""
    result = sweep(hydromount, {"C_h": [100, 300]}, omega=OMEGA, compute="response")
    with pytest.raises(ParameterError, match="has no poles: let compute have 'poles'"):
        sweep_plot(result, "poles")


def test_a_unit_for_nothing_is_refused() -> None:
    """Neither signal nor DOF nor parameter."""
    with pytest.raises(SignalNameError, match="no signal 'z'"):
        sweep_plot(mounts(C_h=[100, 300]), units={"z": "m"})


def test_values_that_are_not_there_are_printed_in_full() -> None:
    """150001 beside 150002 and 150003, all of which four digits call 1.5e+05."""
    result = mounts(C_h=[150002.0, 150003.0])
    with pytest.raises(ParameterError, match=r"no case has C_h = 150001\. There are 150002, 150003\."):
        sweep_plot(result, at={"C_h": 150001.0})
    assert legend_texts(sweep_plot(result)) == ["C_h = 150002", "C_h = 150003"]
    plt.close("all")
