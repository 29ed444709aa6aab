"""The paper's mount with laws in place of its hydraulic damper, and inputs to try it with."""

import numpy as np

from halfdof_ctrl import Damper, NonlinearModel, hydromount, laws, nlmechss
from halfdof_ctrl.model.law import Law

RATE = 200.0  #: samples a second


def oil_mount(law: Law | None = None, outputs: tuple[str, ...] = ("y", "y1", "y2")) -> NonlinearModel:
    """Give the mount with a law on the rate of y2, by default turbulent oil with a laminar part."""
    return nlmechss(hydromount(C_h=0).select("F_y", outputs), Damper("y2", law=law or laws.quadratic(1e4, 30)))


def inputs(kind: str, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Give times and a force [N]: a ramp to a step, a sweep from 0.5 to 5.5 Hz in 10 s, a random road."""
    times = np.arange(int(seconds * RATE) + 1) / RATE
    if kind == "step":
        return times, np.minimum(times * RATE, 1.0) * 100.0
    if kind == "sweep":
        return times, 50.0 * np.sin(2.0 * np.pi * (0.5 * times + 0.25 * times**2))
    steps = np.random.default_rng(14).standard_normal(times.size) / np.sqrt(RATE)
    return times, 50.0 * (np.cumsum(steps) - steps[0])
