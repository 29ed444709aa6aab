"""Rubber mounts against the formulas of their chains."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ParameterError

ROUNDOFF = 1e-9  # k + k1 rounded, of springs over six decades: the softer one keeps so many digits
S = 2j * np.pi * np.geomspace(0.01, 1e4, 25)
POSITIVE = st.floats(1e-1, 1e5)


def stiffness(part: hd.SecondOrderModel, axis: str = "") -> np.ndarray:
    """Dynamic stiffness between top and bottom: force on the top while the bottom is held."""
    return np.asarray(1.0 / part.prescribe_motion(f"bottom{axis}").select(f"F_top{axis}", f"top{axis}")(S))


@given(k=POSITIVE, k1=POSITIVE, c1=POSITIVE)
def test_zener_is_a_spring_beside_a_branch(k: float, k1: float, c1: float) -> None:
    """``k + k1 c1 s / (k1 + c1 s)``."""
    assert_allclose(stiffness(hd.zener(k, k1, c1)), k + k1 * c1 * S / (k1 + c1 * S), rtol=ROUNDOFF)


@given(k=POSITIVE, c=POSITIVE)
def test_kelvin_voigt_and_maxwell_are_sum_and_harmonic_sum(k: float, c: float) -> None:
    """``k + c s`` side by side, ``1 / (1/k + 1/(c s))`` in series."""
    assert_allclose(stiffness(hd.kelvin_voigt(k, c)), k + c * S, rtol=ROUNDOFF)
    assert_allclose(stiffness(hd.maxwell(k, c)), 1.0 / (1.0 / k + 1.0 / (c * S)), rtol=ROUNDOFF)


def test_generalized_maxwell_adds_its_branches() -> None:
    """``k + c s + sum of k_i c_i s / (k_i + c_i s)``, with a half DOF for each branch."""
    part = hd.generalized_maxwell(10.0, [(3.0, 0.5), (7.0, 0.02)], c=0.1)
    desired = 10.0 + 0.1 * S + 1.5 * S / (3.0 + 0.5 * S) + 0.14 * S / (7.0 + 0.02 * S)
    assert_allclose(stiffness(part), desired, rtol=ROUNDOFF)
    assert part.dofs == ("top", "bottom", "1", "2")


def test_inerter_is_a_mass_between_two_terminals() -> None:
    """``b s^2``, and a mass matrix of rank one without a null column."""
    assert_array_equal(hd.inerter(5.0).M, [[5, -5], [-5, 5]])
    assert_allclose(stiffness(hd.inerter(5.0)), 5.0 * S**2, rtol=ROUNDOFF)


@pytest.mark.parametrize(
    "part",
    [hd.kelvin_voigt(2, 3), hd.maxwell(2, 3), hd.zener(1, 2, 3), hd.inerter(2), hd.generalized_maxwell(1, [(2, 3)])],
)
def test_motion_of_both_ends_takes_no_force(part: hd.SecondOrderModel) -> None:
    """Rows of M, C, K sum up to zero: a part hangs between its ports and on nothing else."""
    for matrix in (part.M, part.C, part.K):
        assert_array_equal(matrix.sum(axis=1), np.zeros(len(part.dofs)))


def test_axes_have_constants_of_their_own() -> None:
    """Three axes, each as the part with its constants."""
    k = {"x": 1.0, "y": 2.0, "z": 3.0}
    part = hd.zener(k, k1=4.0, c1={"x": 5.0, "y": 6.0, "z": 7.0})
    assert part.dofs == ("top_x", "top_y", "top_z", "bottom_x", "bottom_y", "bottom_z", "1_x", "1_y", "1_z")
    for axis, c1 in zip("xyz", (5.0, 6.0, 7.0), strict=True):
        held = part.prescribe_motion([f"bottom_{a}" for a in "xyz"]).select(f"F_top_{axis}", f"top_{axis}")
        assert_allclose(1.0 / held(S), stiffness(hd.zener(k[axis], 4.0, c1)), rtol=ROUNDOFF)


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, 0.0, "2", None, True])
def test_constants_out_of_range_are_refused(value: object) -> None:
    """A branch without spring or damper would leave its node loose."""
    with pytest.raises(ParameterError, match=r"c1 = .* must be a positive number") as refusal:
        hd.zener(1.0, 2.0, value)  # type: ignore[arg-type]
    assert refusal.value.parameter == "c1"


def test_axes_that_do_not_fit_are_refused() -> None:
    """Unknown, twice, or other than those of a constant."""
    with pytest.raises(ParameterError, match="each must be one of x, y, z"):
        hd.kelvin_voigt(1, 2, axes="xw")
    with pytest.raises(ParameterError, match="stand once"):
        hd.kelvin_voigt(1, 2, axes="xx")
    with pytest.raises(ParameterError, match="c is given for x, but the part has the axes x, y"):
        hd.kelvin_voigt({"x": 1, "y": 2}, {"x": 1})
    with pytest.raises(ParameterError, match="Branch 1 is 3, but each must be a pair"):
        hd.generalized_maxwell(1.0, [3])  # type: ignore[list-item]
