"""Simulation: against closed forms, an independent integration, energy balances, and what stops a run."""

# ruff: noqa: ARG005  # forces have three arguments whatever they use
import control
import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose
from scipy.special import ellipk

import halfdof_ctrl as hd
from halfdof_ctrl import Damper, Force, Law, Spring, laws, mechss, nlmechss, nonlinear_response
from halfdof_ctrl.errors import (
    ImproperError,
    InconsistentStateError,
    InterruptedResponseWarning,
    MatrixError,
    NoAnswerError,
    ParameterError,
    SignalNameError,
)
from halfdof_ctrl.nonlinear import response as module
from support.descriptor_integration import Element, integrated
from support.mounts_with_laws import inputs, oil_mount

PROMISED = 1e-6  #: of the largest value of each DOF, at the default tolerance
CLOSED = 1e-8  #: of the largest displacement, against closed forms
ENERGY = 1e-6  #: of the energy that went in


@pytest.mark.parametrize("kind", ["step", "sweep", "road"])
@pytest.mark.parametrize("law", [laws.quadratic(1e4), laws.quadratic(1e4, 30), laws.coulomb(5, 0.002, 20)], ids=repr)
def test_the_mount_moves_as_its_descriptor_form(kind: str, law: Law) -> None:
    """Equation (N3) by LSODA against (N1) by IDA, fully implicit; the same piecewise linear force for both."""
    times, u = inputs(kind, 2.0)
    model = oil_mount(law)
    ours = nonlinear_response(model, times, u).outputs
    damper = Element("damper", np.array([0.0, 0.0, 1.0]), lambda v: float(law.force(v)), lambda v: float(law.slope(v)))
    base = model.linear
    theirs = integrated((base.M, base.C, base.K, base.B), [damper], times, lambda t: np.interp(t, times, u), 1e-2)
    size = np.abs(theirs).max(axis=1, keepdims=True)
    assert_allclose(ours / size, theirs / size, rtol=0.0, atol=PROMISED)


def test_a_square_damper_in_series_dies_out_in_finite_time() -> None:
    """``x = x0 (1 - t / T)²`` until ``T = 2 √(x0 c2 / k)``, and zero from then on, without crawling."""
    k, c2, x_0 = 3.0, 7.0, 0.02
    end = 2.0 * np.sqrt(x_0 * c2 / k)
    times = np.linspace(0.0, 40.0 * end, 401)
    node = nlmechss(mechss(None, None, [[k]]), Damper("q0", law=laws.quadratic(c2)))
    for rtol in (1e-6, 1e-8, 1e-10):
        x = nonlinear_response(node, times, initial={"q0": x_0}, rtol=rtol).outputs
        assert_allclose(x, x_0 * np.maximum(1.0 - times / end, 0.0) ** 2, rtol=0.0, atol=rtol * x_0)


def test_any_power_in_series_dies_out_by_its_own_law() -> None:
    """``c |v|^p = k x`` gives ``x^(1 - 1/p) = x0^(1 - 1/p) - (1 - 1/p)(k/c)^(1/p) t``."""
    k, c, p, x_0 = 5.0, 2.0, 3.0, 0.1
    a = 1.0 - 1.0 / p
    times = np.linspace(0.0, 2.0, 101)
    node = nlmechss(mechss(None, None, [[k]]), Damper("q0", law=laws.power(c, p)))
    x = nonlinear_response(node, times, initial={"q0": x_0}).outputs
    left = np.maximum(x_0**a - a * (k / c) ** (1.0 / p) * times, 0.0)
    assert_allclose(x, left ** (1.0 / a), rtol=0.0, atol=CLOSED * x_0)


def test_the_duffing_oscillator_keeps_its_period() -> None:
    """``m q'' + k1 q + k3 q³ = 0`` from rest at X: ``T = 4 K(m) / √((k1 + k3 X²) / m)``, energy kept."""
    k1, k3, X = 4.0, 30.0, 0.7
    model = nlmechss(mechss([[2.0]], None, [[k1]], outputs="q0"), Spring("q0", law=laws.cubic(k3)))
    modulus = k3 * X**2 / (2.0 * (k1 + k3 * X**2))
    period = 4.0 * ellipk(modulus) / np.sqrt((k1 + k3 * X**2) / 2.0)
    x = nonlinear_response(model, [0.0, period / 2, period, 10.0 * period], initial={"q0": X}).outputs
    assert_allclose(x, [X, -X, X, X], rtol=0.0, atol=1e-6 * X)


def test_a_bilinear_spring_has_two_half_periods() -> None:
    """``π √(m / k+)`` on one side and ``π √(m / k-)`` on the other, with amplitudes of equal energy."""
    low, high, m, v = 20.0, 500.0, 1.5, 0.3
    model = nlmechss(mechss([[m]], None, [[0.0]]), Spring("q0", law=laws.bilinear(low, high)))
    up, down = np.pi * np.sqrt(m / high), np.pi * np.sqrt(m / low)
    times = [0.0, up / 2, up, up + down / 2, up + down]
    x = nonlinear_response(model, times, initial={"q0_dot": v}).outputs
    expected = [0.0, v * np.sqrt(m / high), 0.0, -v * np.sqrt(m / low), 0.0]
    assert_allclose(x, expected, rtol=0.0, atol=CLOSED * v * np.sqrt(m / low))


def test_friction_takes_its_force_times_the_way_in_every_cycle() -> None:
    """A prescribed motion far faster than v0: the loop of `coulomb` holds 4 F X, of its viscous part π c ω X²."""
    F, v_0, c, X, omega = 5.0, 1e-3, 2.0, 0.1, 3.0
    base = mechss([[1.0]], None, [[0.0]]).prescribe_motion("q0", "acceleration")
    model = nlmechss(base.select(outputs=["q0", "q0_dot"]), Damper("q0", law=laws.coulomb(F, v_0, c)))
    period = 2.0 * np.pi / omega
    times = np.linspace(0.0, period, 4001)
    response = nonlinear_response(
        model, times, lambda t: -(omega**2) * X * np.sin(omega * t), initial={"q0_dot": omega * X}
    )
    v = response.outputs[1]
    loop = np.trapezoid(laws.coulomb(F, v_0, c).force(v) * v, times)
    rounded = _loop_of_rounded_friction(F, X, v_0 / (omega * X))
    assert_allclose(loop, rounded + np.pi * c * omega * X**2, rtol=1e-6)


def _loop_of_rounded_friction(F: float, X: float, a: float) -> float:
    """Integrate ``F v²/√(v² + v0²)`` over a cycle of ``v = ω X cos``, by a quadrature of its own."""
    angle = np.linspace(0.0, 2.0 * np.pi, 400001)
    cosine = np.cos(angle)
    return float(F * X * np.trapezoid(cosine**2 / np.hypot(cosine, a), angle))


@pytest.mark.parametrize("law", [laws.quadratic(1e4, 30), laws.coulomb(5, 0.01, 20), laws.power(300, 1.3)], ids=repr)
def test_the_energy_of_passive_laws_balances(law: Law) -> None:
    """Work of the force = kinetic and elastic energy + what damper and law have taken."""
    times = np.linspace(0.0, 3.0, 30001)
    model = oil_mount(law)
    response = nonlinear_response(model, times, lambda t: 60.0 * np.sin(7.0 * t), rtol=1e-10)
    motion = model.recover(response)
    q, v, base = motion.displacement, motion.velocity, model.linear
    power = 60.0 * np.sin(7.0 * times) * v[0]
    lost = np.einsum("ik,ij,jk->k", v, base.C, v) + law.force(v[2]) * v[2]
    stored = 0.5 * (np.einsum("ik,ij,jk->k", v, base.M, v) + np.einsum("ik,ij,jk->k", q, base.K, q))
    left = np.trapezoid(power - lost, times) - (stored[-1] - stored[0])
    assert abs(left) < ENERGY * np.trapezoid(np.abs(power), times)


def test_a_stop_catches_a_mass_as_a_spring_does() -> None:
    """Free flight to the gap, half a sine of ``v √(m/k)`` inside the stop, free flight back."""
    m, k, way, v = 2.0, 800.0, 0.1, 0.5
    model = nlmechss(mechss([[m]], None, [[0.0]]), Spring("q0", law=laws.gap(k, way, np.inf)))
    reach, contact = way / v, np.pi * np.sqrt(m / k)
    x = nonlinear_response(model, [0.0, reach, reach + contact / 2, 2 * reach + contact], initial={"q0_dot": v}).outputs
    assert_allclose(x, [0.0, way, way + v * np.sqrt(m / k), 0.0], rtol=0.0, atol=1e-7 * way)


def test_two_springs_in_series_meet_where_their_forces_are_equal() -> None:
    """A node without mass or damping between a cubic spring and a linear one is static, and solved at every time."""
    model = mechss([[1, 0], [0, 0]], None, [[6.0, -6.0], [-6.0, 6.0]], dofs=["mass", "node"])
    nonlinear = nlmechss(model.select("F_mass"), Spring("node", law=laws.cubic(900.0, 2.0)))
    assert nonlinear.partition.static == ("node",)
    response = nonlinear_response(nonlinear, np.linspace(0, 3, 31), 4.0)
    mass, node = response.outputs
    roots = [scipy.optimize.brentq(lambda e, y=y: 900 * e**3 + 8 * e - 6 * y, -5, 5, xtol=1e-14) for y in mass]
    assert_allclose(node, roots, rtol=0.0, atol=1e-12)
    motion = nonlinear.recover(response)
    slope = 6.0 / (8.0 + 2700.0 * node**2)
    assert_allclose(motion["node_dot"], slope * motion["mass_dot"], rtol=1e-10)


def test_several_elements_are_solved_for_together() -> None:
    """Three half DOFs tied by square and friction dampers against the descriptor form."""
    K = np.array([[30.0, -10, 0, 0], [-10, 25, -5, 0], [0, -5, 12, -4], [0, 0, -4, 9]])
    model = mechss(np.diag([1.0, 0, 0, 0]), None, K).select("F_q0")
    found = [
        Damper("q1", "q2", laws.quadratic(3.0)),
        Damper("q2", "q3", laws.quadratic(2.0, 0.5)),
        Damper("q3", law=laws.coulomb(0.2, 0.05, 1.0)),
        Damper("q1", law=laws.power(2.0, 1.5)),
    ]
    nonlinear = nlmechss(model, found)
    times = np.linspace(0.0, 0.5, 51)
    u = 5.0 * np.sin(4.0 * times)
    ours = nonlinear_response(nonlinear, times, u).outputs
    directions = np.array([[0, 1, -1, 0], [0, 0, 1, -1], [0, 0, 0, 1], [0, 1, 0, 0]], dtype=float)
    elements = [Element("damper", e, d.law.force, d.law.slope) for e, d in zip(directions, found, strict=True)]  # type: ignore[union-attr]
    force = lambda t: np.interp(t, times, u)  # noqa: E731
    theirs = integrated((model.M, model.C, model.K, model.B), elements, times, force, 0.1)
    size = np.abs(theirs).max(axis=1, keepdims=True)
    assert_allclose(ours / size, theirs / size, rtol=0.0, atol=PROMISED)


def test_a_force_of_the_user_is_a_pendulum() -> None:
    """``q'' + g sin q = 0``: energy is kept, and the period is an elliptic integral."""
    g, start = 9.81, 1.2
    free = mechss([[1.0]], None, [[0.0]])
    model = nlmechss(free, Force(lambda q, v, t: g * np.sin(q), displacements="q0"))
    period = 4.0 * ellipk(np.sin(start / 2) ** 2) / np.sqrt(g)
    x = nonlinear_response(model, [0, period / 2, period], initial={"q0": start}).outputs
    assert_allclose(x, [start, -start, start], rtol=1e-7)


def test_a_force_on_the_rate_of_a_half_dof_is_solved_for() -> None:
    """The square damper once as `Damper` and once as `Force`."""
    times, u = inputs("road", 0.2)
    oil = Force(
        lambda q, v, t: 1e4 * np.abs(v) * v + 30 * v,
        velocities="y2",
        jacobian=lambda q, v, t: (np.zeros((1, 0)), np.diag(2e4 * abs(v) + 30)),
    )
    by_force = nlmechss(hd.hydromount(C_h=0).select("F_y", ["y", "y2"]), oil)
    ours = nonlinear_response(by_force, times, u).outputs
    by_law = nonlinear_response(oil_mount(outputs=("y", "y2")), times, u).outputs
    assert_allclose(ours, by_law, rtol=0.0, atol=PROMISED * np.abs(by_law).max(axis=1).min())


def test_inputs_may_be_numbers_samples_functions_and_names() -> None:
    """All ways to say the same force."""
    times = np.linspace(0.0, 1.0, 51)
    model = oil_mount().select(["F_y", "F_y1"])
    ramp = 10.0 * times
    reference = nonlinear_response(model, times, np.array([ramp, 0 * ramp + 2.0])).outputs
    for given in ({"F_y": ramp, "F_y1": 2.0}, [lambda t: 10.0 * t, 2.0], lambda t: [10.0 * t, 2.0]):
        assert_allclose(nonlinear_response(model, times, given).outputs, reference, rtol=0.0, atol=1e-9)
    held = nonlinear_response(oil_mount(), times, 3.0)
    assert_allclose(held.inputs, 3.0)
    assert isinstance(held, control.TimeResponseData)


def test_a_pulse_after_a_long_rest_is_not_stepped_over() -> None:
    """Half a second of force after 100 s of nothing leaves the impulse in the free mass."""
    times = np.linspace(0.0, 200.0, 2001)
    u = np.where((times > 100.0) & (times < 100.55), 2.0, 0.0)
    free = nlmechss(mechss([[1.0]], None, [[0.0]]).select(outputs="q0_dot"), Damper("q0", law=laws.quadratic(1e-12)))
    response = nonlinear_response(free, times, u)
    assert_allclose(response.outputs[-1], np.trapezoid(u, times), rtol=1e-6)


def test_two_times_are_two_times() -> None:
    """And one is the initial state."""
    assert nonlinear_response(oil_mount(), [0.0, 0.3], 1.0).time.tolist() == [0.0, 0.3]
    assert nonlinear_response(oil_mount(), [0.2], initial={"y": 0.1}).states[0].tolist() == [0.1]


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        (([0, 0],), MatrixError, r"that rise from one to the next"),
        ((["a"],), ParameterError, r"timepts must be rising numbers"),
        (([0, 1], [1, 2, 3]), MatrixError, r"inputs have the shape \(3,\), but there are 1 inputs and 2 times"),
        (([0, 1], [1, np.nan]), MatrixError, r"inputs hold NaN or Inf \(F_y\)"),
        (([0, 1], {"F": 1}), SignalNameError, r"no input 'F'"),
        (([0, 1], lambda t: t / 0.0 if t else np.inf), ParameterError, r"inputs\(t\) gives"),
        (([0, 1], 0.0, {"z": 1}), SignalNameError, r"no displacement or velocity 'z'"),
        (([0, 1], 0.0, {"y2_dot": 1}), InconsistentStateError, r"y2_dot = 1 \(must be 0\)"),
        (([0, 1], 0.0, [1, 2]), MatrixError, r"A state of this model has 4 finite numbers"),
    ],
)
def test_arguments_that_cannot_be_are_refused(
    arguments: tuple[object, ...], kind: type[Exception], message: str
) -> None:
    """By name."""
    with pytest.raises(kind, match=message):
        nonlinear_response(oil_mount(), *arguments)  # type: ignore[arg-type]


def test_options_that_cannot_be_are_refused() -> None:
    """Methods and tolerances."""
    with pytest.raises(ParameterError, match=r"method must be one of LSODA"):
        nonlinear_response(oil_mount(), [0, 1], method="Euler")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"rtol = 2, but a relative tolerance"):
        nonlinear_response(oil_mount(), [0, 1], rtol=2)
    with pytest.raises(ImproperError, match=r"y2_ddot from damper 1 \(quadratic\)"):
        nonlinear_response(oil_mount(outputs=("y2_ddot",)), [0, 1])


def test_a_law_that_ends_stops_the_run_with_time_dof_force_and_state() -> None:
    """A table that was measured to 0.05 m/s only."""
    model = nlmechss(hd.hydromount().select("F_y", "y"), Damper("y", law=laws.table([-0.05, 0.05], [-10, 10])))
    with pytest.raises(
        NoAnswerError, match=r"At t = 0\.\d+ s damper 1 \(table\) on y stops the run: its law gives NaN"
    ) as caught:
        nonlinear_response(model, [0, 1], 500.0)
    assert caught.value.dofs == ("y",)
    assert 0.0 < caught.value.time < 1.0
    assert len(caught.value.state) == 4


def test_a_bounded_law_that_claims_more_stops_the_run() -> None:
    """The user says that the law is onto; it is not, and the force that finds no answer is told."""
    sly = oil_mount(Law(lambda v: 5 * v / (abs(v) + 1e-2), bounds=(-np.inf, np.inf)))
    with pytest.raises(
        NoAnswerError, match=r"damper 1 \(lambda\) on y2 stops the run: a force of [-\d.]+ N has no answering"
    ) as caught:
        nonlinear_response(sly, [0, 5], 200.0)
    assert abs(caught.value.force) >= 5.0


def test_ctrl_c_keeps_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """The response ends at the last time that was reached, with a warning."""
    runs: list[object] = []  # the first one only measures sizes
    real = module._Run.of

    def interrupted(*args: object) -> object:
        run = real(*args)  # type: ignore[arg-type]
        runs.append(run)

        def rate(t: float, x: np.ndarray) -> np.ndarray:
            if t > 0.5 and len(runs) > 1:
                raise KeyboardInterrupt
            return run.rate(t, x)

        return module._Run(reduction=run.reduction, rate=rate, times=run.times, kinks=run.kinks, longest=run.longest)

    monkeypatch.setattr(module._Run, "of", interrupted)
    times, u = inputs("sweep", 2.0)
    with pytest.warns(InterruptedResponseWarning, match=r"The simulation was stopped at t = "):
        response = nonlinear_response(oil_mount(), times, u)
    assert 1 < response.time.size < times.size
    assert np.isfinite(response.states).all()


def test_ctrl_c_before_anything_is_done_stops_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the coarse run there is nothing to keep."""

    def interrupted(t: float, x: np.ndarray) -> np.ndarray:  # noqa: ARG001
        raise KeyboardInterrupt

    real = module._Run.of

    def of(*args: object) -> object:
        run = real(*args)  # type: ignore[arg-type]
        return module._Run(reduction=run.reduction, rate=interrupted, times=run.times, kinks=(), longest=1.0)

    monkeypatch.setattr(module._Run, "of", of)
    with pytest.raises(KeyboardInterrupt):
        nonlinear_response(oil_mount(), [0.0, 1.0], 1.0)
