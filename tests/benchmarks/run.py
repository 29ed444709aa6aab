"""Measure what the package promises about speed, as ratios of times within one run.

Run ``python tests/benchmarks/run.py`` on a quiet machine, with its default threads; large sparse models are measured
by `large.py`, the readers of files by `imports.py`. Each row is the smallest of several runs of both sides,
taken in turns, so that a disturbance meets both. Nothing is asserted: times depend on the machine.
"""

import subprocess
import sys
import time
from collections.abc import Callable

import control
import numpy as np
import scipy.linalg

import halfdof_ctrl as hd
from halfdof_ctrl.reduction.energy.form import energy_form

POINTS = 1000
DENSE_DOFS = 600
STATE_COUNTS = (4, 20, 100, 200, 400)


def smallest_times(*works: Callable[[], object], rounds: int = 5, repeats: int = 1) -> list[float]:
    """Time each work several times in turns [s]."""
    best = [float("inf")] * len(works)
    for _ in range(rounds):
        for index, work in enumerate(works):
            start = time.perf_counter()
            for _ in range(repeats):
                work()
            best[index] = min(best[index], (time.perf_counter() - start) / repeats)
    return best


def half_massless(n: int, seed: int = 0) -> hd.SecondOrderModel:
    """Make a dense model of n DOFs of which the second half has no mass."""
    generator = np.random.default_rng(seed)
    damping, stiffness = (generator.standard_normal((n, n)) for _ in range(2))
    mass = np.zeros((n, n))
    mass[: n // 2, : n // 2] = np.diag(generator.uniform(1.0, 3.0, n // 2)) + 0.01
    return hd.mechss(mass, damping @ damping.T / n + np.eye(n), stiffness @ stiffness.T / n + np.eye(n))


def chain(states: int, far_end: bool = False) -> control.StateSpace:  # noqa: FBT001, FBT002
    """Make a damped chain, a force on its first mass and its displacement, or that of the last; some nodes massless."""
    half = states // 5 + (states // 5 + states) % 2
    n = (states + half) // 2
    massive = np.ones(n)
    massive[1 : 2 * half : 2] = 0.0
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    model = hd.mechss(np.diag(massive), 0.05 * stiffness + 0.01 * np.eye(n), 100.0 * stiffness)
    return hd.mech2ss(model.select(inputs="F_q0", outputs=f"q{n - 1}" if far_end else "q0"))


def companion(model: hd.SecondOrderModel) -> tuple[np.ndarray, np.ndarray]:
    """Give A and E of the companion pencil ``A - s E``."""
    n = len(model.dofs)
    zero, unit = np.zeros((n, n)), np.eye(n)
    return np.block([[zero, unit], [-model.K, -model.C]]), np.block([[unit, zero], [zero, model.M]])


def report(work: str, ours: float, other: float, name: str, target: str) -> None:
    """Print one row: our time, the other's, and the ratio in the direction of the target."""
    ratio = f"{ours / other:7.2f} x {name}" if "<=" in target else f"{other / ours:7.1f} x faster than {name}"
    print(f"{work:60} {1e3 * ours:10.3f} ms {1e3 * other:10.3f} ms  {ratio:52} target {target}")


def with_masses(n: int, masses: int, spread: float = 1.0, *, damped: bool = False) -> hd.SecondOrderModel:
    """Make a chain of n DOFs, so many of them with mass, springs over `spread`; dampers everywhere or at masses."""
    places = np.linspace(0, n - 1, masses).astype(int)
    springs = 100.0 * spread ** np.random.default_rng(0).uniform(0.0, 1.0, n + 1)
    stiffness = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    mass = np.zeros((n, n))
    mass[places, places] = 1.0
    return hd.mechss(mass, 5e-4 * stiffness if damped else 0.1 * mass, stiffness)


def single_solve(model: hd.SecondOrderModel) -> Callable[[], object]:
    """Give the one solve of (3), with the columns of W and the right-hand side ready."""
    massive, damped = model.M.any(axis=0), model.C.any(axis=0) & ~model.M.any(axis=0)
    static = ~massive & ~damped
    W = np.hstack([model.M[:, massive], model.C[:, damped], model.K[:, static]])
    right = np.hstack([model.B, model.C[:, massive], model.K[:, massive], model.K[:, damped]])
    return lambda: np.linalg.solve(W, right)


def measure_reduction() -> None:
    """Dense reduction against one solve, QZ and slycot's descriptor conversion; energy coordinates against it."""
    model = half_massless(DENSE_DOFS)
    cases = {
        f"dense, n = {DENSE_DOFS}, half massless": model,
        "chain of 1000, 10 masses": with_masses(1000, 10),
        "chain of 1000, 10 masses, dampers": with_masses(1000, 10, damped=True),
        "chain of 600, 300 masses": with_masses(600, 300),
        "chain of 600, 300 masses, springs over 1e4": with_masses(600, 300, 1e4),
        "chain of 600, 300 masses, dampers": with_masses(600, 300, damped=True),
    }
    for what, case in cases.items():
        ours, solve = smallest_times(lambda case=case: hd.exact_reduction(case), single_solve(case), rounds=15)  # type: ignore[misc]
        report(f"exact_reduction, {what}", ours, solve, "numpy.linalg.solve of (3)", "<= 1.2")
    for what, case in cases.items():
        energy, plain = smallest_times(
            lambda case=case: energy_form(case),  # type: ignore[misc]
            lambda case=case: hd.exact_reduction(case),  # type: ignore[misc]
        )
        report(f"energy coordinates, {what}", energy, plain, "exact_reduction", "<= 2")
    name = f"exact_reduction, dense, n = {DENSE_DOFS}"
    (ours,) = smallest_times(lambda: hd.exact_reduction(model), rounds=15)
    A, E = companion(model)
    (qz,) = smallest_times(lambda: scipy.linalg.eigvals(A, E), rounds=1)
    report(name, ours, qz, "scipy.linalg.eigvals(A, E)", ">= 30")
    try:
        import slycot  # noqa: PLC0415  # optional here
    except ImportError:
        print("slycot is not installed: no comparison with sb10jd")
        return
    n, N = DENSE_DOFS, 2 * DENSE_DOFS
    B, C = np.vstack([np.zeros((n, n)), np.eye(n)]), np.hstack([np.eye(n), np.zeros((n, n))])

    def convert() -> object:
        return slycot.sb10jd(N, n, n, A.copy(), B.copy(), C.copy(), np.zeros((n, n)), E.copy())

    (sb10jd,) = smallest_times(convert, rounds=1)
    report(name, ours, sb10jd, "slycot.sb10jd", ">= 15")


def measure_mount() -> None:
    """Compare the mount's way into python-control with python-control's own constructor."""
    system = hd.mech2ss(hd.hydromount())
    A, B, C, D = system.A, system.B, system.C, system.D
    ours, plain = smallest_times(
        lambda: hd.mech2ss(hd.hydromount()), lambda: control.ss(A, B, C, D), rounds=2000, repeats=3
    )
    report("mech2ss(hydromount())", ours, plain, "control.ss(A, B, C, D)", "<= 3")


def measure_frequency_response() -> None:
    """1000 points of a chain with massless nodes, and how far both are from a direct solve.

    From one end to the other the response rolls off below anything that a plot shows; digits there are worth
    the time that they take.
    """
    for states, far_end in [(states, False) for states in STATE_COUNTS] + [(100, True)]:
        system = chain(states, far_end)
        size = np.abs(system.poles())
        omega = np.geomspace(size.min() / 2.0, size.max() * (1.0 if far_end else 2.0), POINTS)
        ours, theirs = smallest_times(
            lambda system=system, omega=omega: hd.frequency_response(system, omega),  # type: ignore[misc]
            lambda system=system, omega=omega: control.frequency_response(system, omega),  # type: ignore[misc]
            rounds=3,
        )
        what = f"frequency_response, {states} states" + (", deep roll-off" if far_end else "")
        report(what, ours, theirs, "control.frequency_response", "(none)" if far_end else ">= 5")
        if far_end:  # a plain solve is no reference there; tests/systems/test_hessenberg.py has one in many digits
            continue
        few = omega[:: POINTS // 20]
        unit = np.eye(system.nstates)
        exact = np.array([(system.C @ np.linalg.solve(1j * w * unit - system.A, system.B))[0, 0] for w in few])
        errors = [
            np.abs(compute(system, few).frdata[0, 0] - exact).max() / np.abs(exact).max()
            for compute in (hd.frequency_response, control.frequency_response)
        ]
        print(f"{'':60} error against direct solves: {errors[0]:.1e} (ours) {errors[1]:.1e} (control)")


def measure_nonlinear() -> None:
    """Simulate the mount with turbulent oil, beside the linear state space in python-control's own simulator."""
    times = np.arange(2001) / 200.0
    road = np.cumsum(np.random.default_rng(14).standard_normal(times.size)) * (50.0 / np.sqrt(200.0))
    inputs = {
        "step": np.minimum(200.0 * times, 1.0) * 100.0,
        "sweep": 50.0 * np.sin(2.0 * np.pi * (0.5 * times + 0.25 * times**2)),
        "road": road - road[0],
    }
    linear = hd.mech2ss(hd.hydromount().select("F_y", "y"))
    mount = hd.hydromount(C_h=0).select("F_y", "y")
    for law in (hd.laws.quadratic(1e4), hd.laws.quadratic(1e4, 30)):
        model = hd.nlmechss(mount, hd.Damper("y2", law=law))
        for name, u in inputs.items():
            size = np.abs(hd.nonlinear_response(model, times, u).states).max(axis=1)
            options = {"method": "LSODA", "rtol": 1e-8, "atol": 1e-8 * size}
            ours, theirs = smallest_times(
                lambda model=model, u=u: hd.nonlinear_response(model, times, u),  # type: ignore[misc]
                lambda u=u, options=options: control.input_output_response(  # type: ignore[misc]
                    linear, times, u, solve_ivp_kwargs=options
                ),
                rounds=3,
            )
            target = "<= 4" if name == "step" else "<= 2"
            report(f"nonlinear_response, {law}, {name}", ours, theirs, "linear input_output_response", target)


def measure_import() -> None:
    """Import time in fresh processes."""

    def imports(name: str) -> Callable[[], object]:
        return lambda: subprocess.run([sys.executable, "-c", f"import {name}"], check=True)

    ours, theirs = smallest_times(imports("halfdof_ctrl"), imports("control"), rounds=7)
    report("import halfdof_ctrl", ours, theirs, "import control", "<= 1.05")


def main() -> None:
    """Print all rows."""
    print(f"{'work':60} {'ours':>13} {'other':>13}  ratio")
    measure_mount()
    measure_import()
    measure_nonlinear()
    measure_frequency_response()
    measure_reduction()


if __name__ == "__main__":
    main()
