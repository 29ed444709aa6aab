"""The reference models."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import exact_reduction, frequency_response, hydromount, mech2ss
from halfdof_ctrl.base.errors import ParameterError

ROUNDOFF = 1e-10  # springs over six decades in series and parallel; python-control's own dcgain loses to 1e-8 here
POSITIVE = st.floats(1e-1, 1e5)


def test_hydromount_has_the_papers_matrices() -> None:
    """Equation (33) with the data of section 3."""
    model = hydromount()
    assert_array_equal(model.M, np.diag([20, 0, 0]))
    assert_array_equal(model.C, [[100, -100, 0], [-100, 100, 0], [0, 0, 300]])
    assert_array_equal(model.K, [[5500, 0, -500], [0, 1000, 0], [-500, 0, 1000]])
    assert (model.dofs, model.name) == (("y", "y1", "y2"), "hydromount")


@given(K_r=POSITIVE, K_v=POSITIVE, K_s=POSITIVE, C_h=POSITIVE)
def test_stiffness_at_rest_is_the_rubber_beside_two_springs_in_series(
    K_r: float, K_v: float, K_s: float, C_h: float
) -> None:
    """At rest the damper C_h carries nothing: ``K_r + K_v K_s / (K_v + K_s)``."""
    model = hydromount(K_r=K_r, K_v=K_v, K_s=K_s, C_h=C_h).select(inputs="F_y", outputs="y")
    desired = K_r + K_v * K_s / (K_v + K_s)
    assert_allclose(1.0 / frequency_response(model, 0.0).magnitude.item(), desired, rtol=ROUNDOFF)


def test_removed_damper_makes_a_static_dof() -> None:
    """Without C_h the oil's node carries springs alone."""
    assert mech2ss(hydromount(C_h=0.0)).state_labels == ["y", "y1", "y_dot"]


def test_mount_alone_is_a_model_of_two_states() -> None:
    """Without the mass y and y1 are damped against each other only: one static combination, and no mass at all."""
    model = hydromount(m=0)
    assert not model.M.any()
    assert exact_reduction(model).order == 2
    assert_allclose(model.select("F_y", "y")(0), 1 / 5250, rtol=ROUNDOFF)


@pytest.mark.parametrize("m", [-1.0, math.nan, math.inf])
def test_mass_must_not_be_negative(m: float) -> None:
    """The refusal names the parameter and its value."""
    with pytest.raises(
        ParameterError, match=r"m = .* kg, but the mass on the mount must be a number that is not neg"
    ) as refusal:
        hydromount(m=m)
    assert refusal.value.parameter == "m"


@pytest.mark.parametrize("symbol", ["K_r", "K_rs", "K_v", "K_s", "C_rs", "C_h"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_stiffness_and_damping_must_not_be_negative(symbol: str, value: float) -> None:
    """Negative damping is refused like any other."""
    with pytest.raises(ParameterError, match=f"{symbol} = {value}, but a stiffness") as refusal:
        hydromount(**{symbol: value})
    assert refusal.value.parameter == symbol
