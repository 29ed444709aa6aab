"""The phase from poles and zeros: right on any grid, the same in plots and tables."""

import csv
from pathlib import Path

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import (
    SecondOrderModel,
    bode_plot,
    dynamic_stiffness_response,
    frequency_response,
    hydromount,
    mech2ss,
    mechss,
    save_response,
    transmissibility_response,
)
from halfdof_ctrl.systems import phase, phase_sources
from halfdof_ctrl.systems.phase import response_phase
from support.structures import Structure, damped_structures

DEGREES = 1e-6  # of exact multiples of 90


def chain(masses: int, damping: float = 0.0) -> SecondOrderModel:
    """Give masses of 1 kg on springs of 1 N/m, both ends held."""
    K = 2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    return mechss(np.eye(masses), damping * np.eye(masses), K)


def degrees(data: control.FrequencyResponseData) -> np.ndarray:
    """Give the phase of the first channel."""
    return np.asarray(np.degrees(response_phase(data))[0, 0])


@given(st.lists(st.floats(0.01, 100.0), min_size=1, max_size=8, unique=True), st.integers(0, 5))
def test_an_undamped_collocated_receptance_stays_between_0_and_minus_180(omega: list[float], place: int) -> None:
    """Resonances and antiresonances alternate, so the phase is 0 or -180 on any grid, of any few points."""
    model = chain(6).select(f"F_q{place}", f"q{place}")
    found = degrees(frequency_response(model, np.sort(omega)))
    known = np.isfinite(found)
    assert (np.abs(found[known] + 90.0) <= 90.0 + DEGREES).all()
    assert_allclose(np.abs(found[known] + 90.0), 90.0, rtol=DEGREES)


def test_end_to_end_each_resonance_takes_180_degrees() -> None:
    """Six poles and no zero: -1080 degrees beyond all of them, from two points."""
    model = chain(6).select("F_q0", "q5")
    assert_allclose(degrees(frequency_response(model, [0.01, 100.0])), [0.0, -1080.0], atol=DEGREES)
    assert_allclose(degrees(frequency_response(mech2ss(model), [0.01, 100.0])), [0.0, -1080.0], atol=DEGREES)


@given(structure=damped_structures(), seed=st.integers(0, 2**32 - 1))
def test_a_coarse_grid_has_the_phase_of_a_fine_one(structure: Structure, seed: int) -> None:
    """Six random frequencies beside the default grid: the same branch with it and without it."""
    generator = np.random.default_rng(seed)
    model = structure.model()
    model = model.select(model.inputs[generator.integers(len(model.inputs))], model.dofs[0])
    grid = np.asarray(frequency_response(model).omega)
    few = np.sort(generator.choice(grid, 6, replace=False))
    fine, coarse = degrees(frequency_response(model, grid)), degrees(frequency_response(model, few))
    assert_allclose(coarse, fine[np.searchsorted(grid, few)], atol=1e-3)


def test_half_circles_agree_with_poles_and_zeros() -> None:
    """The way through the right half plane, which knows of no zero, gives the same phase of a transfer receptance."""
    model = chain(5, 0.05).select("F_q0", "q3")
    data = frequency_response(model, [0.1, 0.9, 1.3, 1.9, 7.0])
    source = getattr(data, phase_sources.SOURCE)
    arguments = (source, source.poles(), (0, 0), np.asarray(data.omega), np.asarray(data.frdata)[0, 0])
    by_roots, by_circles = phase._by_roots(*arguments), phase._along_half_circles(*arguments)
    assert by_roots is not None
    assert by_circles is not None
    assert_allclose(by_circles, by_roots, atol=1e-9)


def test_wrong_zeros_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without its zeros the phase of a receptance disagrees with its values, and half circles take over."""
    model = chain(5, 0.05).select("F_q0", "q1")
    data = frequency_response(model, np.geomspace(0.1, 10.0, 15))
    desired = degrees(data)
    monkeypatch.setattr(phase_sources, "descriptor_zeros", lambda *_: np.zeros(0, dtype=complex))
    assert_allclose(degrees(data), desired, atol=1e-9)


def test_stiffness_and_transmissibility_are_on_their_branch() -> None:
    """Three masses: a driving point stiffness rises from 0 to 180, what arrives two masses on falls to -360."""
    model = chain(3)
    omega = [0.01, 1.2, 100.0]
    assert_allclose(degrees(dynamic_stiffness_response(model, "q0", omega))[[0, -1]], [0.0, 180.0], atol=DEGREES)
    for kind in ("motion", "force"):
        data = transmissibility_response(model, "q0", "q2", omega, kind=kind)
        assert_allclose(degrees(data)[[0, -1]], [0.0, -360.0], atol=DEGREES)


@pytest.mark.parametrize("omega", [[5.0, 20.0, 50.0], np.geomspace(0.1, 100.0, 300)])
def test_plot_and_table_say_the_same(omega: list[float], tmp_path: Path) -> None:
    """The last column of a table is the lower curve of the plot."""
    for model in (mechss([[1.0]], None, [[100.0]]), hydromount().select("F_y", "y_ddot")):
        path = tmp_path / "response.csv"
        save_response(frequency_response(model, omega), path)
        with path.open() as stream:
            table = [float(row[-1]) for row in list(csv.reader(stream))[1:]]
        cplt = bode_plot(model, omega)
        assert_allclose(table, cplt.lines[1, 0][0].get_ydata(), atol=DEGREES)
        plt.close(cplt.figure)


def test_a_negative_gain_starts_at_minus_180() -> None:
    """A spring that pulls the wrong way; an integrator twice starts there too."""
    lag = control.ss([[-1.0]], [[1.0]], [[-2.0]], [[0.0]])
    assert_allclose(degrees(frequency_response(lag, [1e-3]))[0], -180.0, atol=0.1)
    assert_allclose(degrees(frequency_response(mechss([[1.0]], None, None), [1e-3, 1.0])), -180.0, atol=DEGREES)


@given(st.lists(st.floats(0.01, 100.0), min_size=1, max_size=6, unique=True), st.integers(0, 5))
def test_undamped_receptances_keep_their_side_however_they_are_given(omega: list[float], place: int) -> None:
    """As state space in DOF and energy states, as sparse model, and where one frequency is a resonance exactly."""
    model = chain(6).select(f"F_q{place}", f"q{place}")
    resonance = 2.0 * np.sin(np.pi * 3.0 / 14.0)
    points = np.unique([*omega, resonance])
    sparse = mechss(csc_array(model.M), csc_array(model.C), csc_array(model.K)).select(f"F_q{place}", f"q{place}")
    for one in (model, sparse, mech2ss(model), mech2ss(model, states="energy")):
        found = degrees(frequency_response(one, points))
        known = np.isfinite(found)
        assert (np.abs(found[known] + 90.0) <= 90.0 + DEGREES).all()


@pytest.mark.parametrize("loss", [1e-4, 0.05, 0.5])
def test_structural_damping_keeps_a_receptance_between_0_and_minus_180(loss: float) -> None:
    """Complex stiffness, poles and zeros right of the axis among them; from five points and from five hundred."""
    model = chain(4)
    model = mechss(model.M, None, np.asarray(model.K) * (1.0 + 1j * loss))
    few = np.array([0.02, 0.7, 1.3, 1.8, 30.0])
    many = np.unique([*few, *np.geomspace(0.01, 100.0, 500)])
    for output in ("q0", "q3"):
        fine = degrees(frequency_response(model.select("F_q0", output), many))
        coarse = degrees(frequency_response(model.select("F_q0", output), few))
        assert_allclose(coarse, fine[np.searchsorted(many, few)], atol=DEGREES)
        assert_allclose(fine[0], -np.degrees(np.arctan(loss)), rtol=0.05)
    driven = degrees(frequency_response(model.select("F_q0", "q0"), many))
    assert (np.abs(driven + 90.0) <= 90.0 + DEGREES).all()
    assert_allclose(fine[-1], -720.0 + 3.0 * np.degrees(np.arctan(loss)), atol=1.0)  # k^3 (1 + j loss)^3 / (m w^2)^4


@given(step=st.floats(0.02, 0.9), damping=st.sampled_from([0.0, 0.05]), seed=st.integers(0, 2**32 - 1))
def test_sampled_systems_have_one_phase_on_any_grid(step: float, damping: float, seed: int) -> None:
    """A chain sampled by a zero-order hold: five frequencies of the default grid, alone and among all."""
    generator = np.random.default_rng(seed)
    sampled = control.sample_system(mech2ss(chain(3, damping).select("F_q0", "q0")), step, "zoh")
    grid = np.asarray(frequency_response(sampled).omega)
    few = np.sort(generator.choice(grid, 5, replace=False))
    fine, coarse = degrees(frequency_response(sampled, grid)), degrees(frequency_response(sampled, few))
    assert_allclose(coarse, fine[np.searchsorted(grid, few)], atol=1e-3)
    assert_allclose(fine[0], 0.0, atol=3.0)


def test_integrators_start_at_minus_90_in_the_z_plane() -> None:
    """A sampled integrator and a sampled free mass: -90 and -180 degrees at low frequency."""
    for model, start in ((mechss([[0.0]], [[1.0]], [[0.0]]), -90.0), (mechss([[1.0]], None, None), -180.0)):
        sampled = control.sample_system(mech2ss(model), 0.1, "zoh")
        assert_allclose(degrees(frequency_response(sampled, [1e-3, 1.0]))[0], start, atol=0.1)


def test_work_tells_the_phase_where_nothing_else_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without roots and half circles: displacement, velocity and acceleration at the force, from three points each."""
    monkeypatch.setattr(phase, "PHASE_ZERO_EFFORT", 0.0)
    monkeypatch.setattr(phase, "CIRCLE_EFFORT", 0.0)
    model = chain(4, 1e-3)
    for output, middle in (("q1", -90.0), ("q1_dot", 0.0), ("q1_ddot", 90.0)):
        found = degrees(frequency_response(model.select("F_q1", output), [0.3, 1.0, 5.0]))
        assert (np.abs(found - middle) <= 90.0 + DEGREES).all()


@pytest.mark.parametrize("step", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("output", [0, 3, 4, 5])
def test_sampled_undamped_channels_keep_their_phase_deep_in_roll_off(step: float, output: int) -> None:
    """End to end of six masses a sampled response falls by forty decades: one phase on a coarse grid and on a fine one.

    180 degrees for each mass on the way, and 90 more at the Nyquist frequency for the hold.
    """
    sampled = control.sample_system(mech2ss(chain(6).select("F_q0", f"q{output}")), step, "zoh")
    data = frequency_response(sampled)
    grid, fine = np.asarray(data.omega), degrees(data)
    few = grid[np.linspace(0, grid.size - 1, 7).astype(int)]
    assert_allclose(degrees(frequency_response(sampled, few))[[0, -1]], fine[[0, -1]], atol=1e-3)
    assert_allclose(fine[-1], -180.0 * (output + 1) - 90.0, atol=0.5)
    assert_allclose(np.interp(0.2, grid, fine), -np.degrees(0.1 * step), atol=0.5)  # half a step late


def test_zeros_that_rounding_puts_to_the_origin_are_found_out_on_a_coarse_grid() -> None:
    """A weak damper beside stiff springs: four zeros at 0 in the place of two pairs would add 360 degrees.

    Six points above all resonances, where four zeros at the origin turn the angle by nothing: work done on the
    structure keeps its phase between 0 and -180.
    """
    a, b, c = 8.390263365242013e-11, 7.323344703441913e-06, 6.66616143230613e-10
    p, q, r = 0.012590395654810672, 204544.09983366603, 12.791100221293235
    model = mechss(
        np.diag([0.0, 0.02357046078500336, 0.0, 9.48770854684601]),
        [[a, -a, 0.0, 0.0], [-a, a + b, -b, 0.0], [0.0, -b, b + c, -c], [0.0, 0.0, -c, c]],
        [[2.695043942927987, -p, 0.0, 0.0], [-p, p + q, -q, 0.0], [0.0, -q, q + r, -r], [0.0, 0.0, -r, 162.87518680]],
    ).select("F_q0", "q0")
    assert_allclose(degrees(frequency_response(model, [0.657, 183.0, 16258.0, 2e5, 2.3e6])), 0.0, atol=1e-2)


def test_single_values_of_rounding_do_not_speak_against_the_roots() -> None:
    """Of a hundred values one or two side by side may be garbled; three of them, the last ones or many are a fault."""
    grown = np.zeros(100)
    for places, told in (([7], 1), ([7, 8, 40], 3), ([7, 8, 9], 0), ([98, 99], 0), (range(0, 100, 9), 0)):
        changed = grown.copy()
        changed[list(places)] = 30.0
        assert phase._garbled(changed).sum() == told
