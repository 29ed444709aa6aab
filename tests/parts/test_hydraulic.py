"""The hydraulic mount against the closed form of Singh, Kim and Ravindra."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ParameterError

ROUNDOFF = 1e-10  # a solve with pressures and displacements over 17 decades
S = 2j * np.pi * np.geomspace(0.1, 300, 40)
OIL: dict[str, Any] = {"A": 2.5e-3, "I": 4.0e6, "R": 1.05e8, "C1": 3.0e-11, "C2": 2.6e-9}


def closed_form(k: float, c: float, decoupler: hd.Decoupler | None = None) -> np.ndarray:
    """``k + c s + A^2 (1/C1) (1/C2 + Z) / (1/C1 + 1/C2 + Z)``, Z the impedance of the ways side by side."""
    admittance = 1.0 / (OIL["I"] * S**2 + OIL["R"] * S)
    if decoupler is not None:
        admittance = admittance + 1.0 / (decoupler.I * S**2 + decoupler.R * S)
    Z, e1, e2 = 1.0 / admittance, 1.0 / OIL["C1"], 1.0 / OIL["C2"]
    return np.asarray(k + c * S + OIL["A"] ** 2 * e1 * (e2 + Z) / (e1 + e2 + Z))


@pytest.mark.parametrize("decoupler", [None, hd.Decoupler(I=2e5, R=1e7)])
def test_stiffness_is_the_closed_form(decoupler: hd.Decoupler | None) -> None:
    """Rubber beside two chambers that one or two ways join."""
    mount = hd.hydraulic_mount(k_r=2.25e5, c_r=1e3, **OIL, decoupler=decoupler)
    found = 1.0 / mount.prescribe_motion("bottom").select("F_top", "top")(S)
    assert_allclose(found, closed_form(2.25e5, 1e3, decoupler), rtol=ROUNDOFF)


def test_pressures_are_static_and_seen() -> None:
    """At rest both chambers have the pressure ``A x / (C1 + C2)`` of the volume that the top displaced."""
    mount = hd.hydraulic_mount(k_r=2.25e5, c_r=0, **OIL)
    held = mount.prescribe_motion("bottom").select("F_top", ["2", "3", "top"])
    assert not held.M[:, -2:].any()
    assert not held.C[:, -2:].any()
    p1, p2, x = held(0).real.ravel()
    assert_allclose([p1, p2], -x * OIL["A"] / (OIL["C1"] + OIL["C2"]), rtol=ROUNDOFF)


def test_fluid_acts_along_one_axis_of_three() -> None:
    """Rubber in three axes, oil along z."""
    k = {"x": 1e5, "y": 2e5, "z": 2.25e5}
    mount = hd.hydraulic_mount(k_r=k, c_r=10.0, **OIL)
    held = mount.prescribe_motion(["bottom_x", "bottom_y", "bottom_z"])
    for axis in "xy":
        found = 1.0 / held.select(f"F_top_{axis}", f"top_{axis}")(S)
        assert_allclose(found, k[axis] + 10.0 * S, rtol=ROUNDOFF)
    assert_allclose(1.0 / held.select("F_top_z", "top_z")(S), closed_form(2.25e5, 10.0), rtol=ROUNDOFF)


def test_constants_out_of_range_are_refused() -> None:
    """A chamber without compliance, oil that nothing holds, an axis without rubber."""
    with pytest.raises(ParameterError, match=r"C1 = 0 m\^5/N, but it must be a positive number"):
        hd.hydraulic_mount(k_r=1, c_r=0, **OIL | {"C1": 0})
    with pytest.raises(ParameterError, match="I and R are both 0"):
        hd.hydraulic_mount(k_r=1, c_r=0, **OIL | {"I": 0, "R": 0})
    with pytest.raises(ParameterError, match="fluid_axis = None, but the rubber has the axes x, y"):
        hd.hydraulic_mount(k_r=1, c_r=0, **OIL, axes="xy")
