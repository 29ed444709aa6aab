"""Point masses and rigid bodies against the kinematics of small rotations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ParameterError

ROUNDOFF = 1e-14  # two products and a sum
PLACE = st.tuples(*[st.floats(-2, 2, allow_subnormal=False)] * 3)


@given(place=PLACE, turn=PLACE, shift=PLACE)
def test_points_move_with_the_body(place: tuple[float, ...], turn: tuple[float, ...], shift: tuple[float, ...]) -> None:
    """``u = c + r x p``."""
    body = hd.rigid_body(3.0, [1, 2, 2.5], {"p": place})
    rows = body.F[[body.outputs.index(f"p_{axis}") for axis in "xyz"]]
    desired = np.array(shift) + np.cross(turn, place)
    assert_allclose(rows @ np.concatenate([shift, turn]), desired, atol=8 * ROUNDOFF)


def test_force_at_a_point_turns_the_body() -> None:
    """A force F_z at x = 0.5 m acts with the moment -0.5 F about y: inputs are the transpose of outputs."""
    body = hd.rigid_body(3.0, [1, 2, 2.5], {"p": (0.5, 0, 0)})
    assert_array_equal(body.B, body.F.T)
    assert_array_equal(body.B[:, body.inputs.index("F_p_z")], [0, 0, 1, 0, -0.5, 0])


def test_points_with_six_axes_turn_as_the_body() -> None:
    """With rotations=True, to clamp something to a point."""
    body = hd.rigid_body(3.0, [1, 2, 2.5], {"p": (0.5, 0, 0)}, rotations=True)
    assert body.outputs[-3:] == ("p_rx", "p_ry", "p_rz")
    assert_array_equal(body.F[-3:, 3:], np.eye(3))


def test_mass_matrix_holds_mass_and_tensor() -> None:
    """With products of inertia."""
    tensor = [[2.0, -0.3, 0.1], [-0.3, 3.0, 0.0], [0.1, 0.0, 4.0]]
    assert_array_equal(hd.rigid_body(7.0, tensor).M[3:, 3:], tensor)
    assert_array_equal(hd.point_mass(4.0, "xyz").M, 4.0 * np.eye(3))


@pytest.mark.parametrize(
    ("inertia", "words"),
    [
        ([1, 1, 3], "none exceeds the sum of the others"),
        ([0, 1, 1], "each is positive"),
        ([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]], "is not a real symmetric tensor"),
    ],
)
def test_inertia_of_no_body_is_refused(inertia: object, words: str) -> None:
    """Principal moments obey the triangle inequality."""
    with pytest.raises(ParameterError, match=words):
        hd.rigid_body(1.0, inertia)  # type: ignore[arg-type]


def test_other_bad_input_is_refused() -> None:
    """Places that are none, masses that are none, rotations of a point."""
    with pytest.raises(ParameterError, match=r"Point 'p' is at .* three numbers"):
        hd.rigid_body(1.0, [1, 1, 1], {"p": (1, 2)})
    with pytest.raises(ParameterError, match="every coordinate must be a finite number"):
        hd.rigid_body(1.0, [1, 1, 1], {"p": (1, 2, np.nan)})
    with pytest.raises(ParameterError, match="m = 0 kg, but it must be a positive number"):
        hd.point_mass(0)
    with pytest.raises(ParameterError, match="a point mass moves along x, y, z alone"):
        hd.point_mass(1.0, "rx")
