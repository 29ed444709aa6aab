"""The nonlinear model: what it is made of, how it prints, and what it refuses before anything is computed."""

# ruff: noqa: ARG005  # forces have three arguments whatever they use
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.sparse import eye_array

import halfdof_ctrl as hd
from halfdof_ctrl import Damper, Force, Law, Spring, laws, nlmechss
from halfdof_ctrl.errors import (
    ComplexModelError,
    HalfdofError,
    LawError,
    ModelSizeError,
    ParameterError,
    SignalNameError,
)
from halfdof_ctrl.model.elements import Element

MOUNT = hd.hydromount(C_h=0)


def test_the_mount_with_oil_prints_what_an_element_made_of_its_dofs() -> None:
    """The paper's mount with turbulent oil in place of C_h keeps four states."""
    model = nlmechss(MOUNT.select("F_y", "y"), [Damper("y2", law=laws.quadratic(1e4))], name="oil")
    lines = repr(model).splitlines()
    assert lines[0] == "NonlinearModel 'oil': 3 DOFs: 1 inertial, 2 half, 0 static; 4 states"
    assert 'damper 1: Damper("y2", law=quadratic(1e4))' in lines[-2]
    assert lines[-1] == "  y2: half, by damper 1 (quadratic); its column of C is null"
    assert model.states == ("y", "y1", "y2", "y_dot")


CHAIN = hd.mechss(np.diag([3.0, 2.0, 1.0]), None, 5.0 * np.eye(3), dofs=["a", "b", "c"])


def test_without_a_dof_its_elements_end_at_the_ground() -> None:
    """What held at rest means for each: the far end becomes the ground, a number is turned round, two ends vanish."""
    cubic = laws.cubic(7.0)
    elements: list[Element] = [
        Spring("a", "b", cubic),
        Damper("c", "b", 2.0),
        Damper("b", "c", laws.quadratic(3.0)),
        Spring("c", None, cubic),
    ]
    left = nlmechss(CHAIN, elements).without("c")
    assert left.dofs == ("a", "b")
    assert list(map(repr, left.elements)) == [
        'Spring("a", "b", law=cubic(7))',
        'Damper("b", law=2)',
        'Damper("b", law=quadratic(3))',
    ]
    np.testing.assert_array_equal(left.with_linear_elements.C, np.diag([0.0, 2.0]))
    np.testing.assert_array_equal(left.linear.K, CHAIN.without("c").K)


def test_without_a_dof_the_tangent_is_that_with_the_dof_at_rest() -> None:
    """A cubic spring of 4 and 7 from b to c, b at 0.7: 5 + 4 + 3 7 0.49 N/m at b, whether c is at rest or left out."""
    model = nlmechss(CHAIN, [Spring("b", "c", laws.cubic(7.0, 4.0)), Damper("b", None, 0.5)])
    whole, left = model.tangent({"b": 0.7}), model.without(["a", "c"]).tangent({"b": 0.7})
    assert whole.K[1, 1] == pytest.approx(5.0 + 4.0 + 21.0 * 0.49, rel=1e-14)
    np.testing.assert_array_equal(left.K, whole.K[1:2, 1:2])
    np.testing.assert_array_equal(left.C, [[0.5]])


def test_an_element_that_cannot_lose_its_dof_is_named() -> None:
    """A law that begins at the DOF may differ the other way round; a force knows what it is a function of."""
    with pytest.raises(SignalNameError, match=r"spring 1 \(gap\) begins at c, which is taken out.*from b to c"):
        nlmechss(CHAIN, Spring("c", "b", laws.gap(1.0, 0.1))).without("c")
    with pytest.raises(SignalNameError, match=r"force 1 .* knows c, which cannot be taken out"):
        nlmechss(CHAIN, Force(lambda q, v, t: q, ["b", "c"])).without("c")
    with pytest.raises(SignalNameError, match="The model has no DOF 'd'"):
        nlmechss(CHAIN, Spring("c", "b", 1.0)).without("d")


def test_select_keeps_the_elements() -> None:
    """Signals by name as in the linear model."""
    model = nlmechss(MOUNT, Damper("y2", law=laws.quadratic(1e4)))
    small = model.select("F_y", ["y", "y_dot"])
    assert (small.inputs, small.outputs, small.elements) == (("F_y",), ("y", "y_dot"), model.elements)


def test_a_linear_element_goes_into_the_matrices() -> None:
    """C_h as a damper is C_h as a parameter."""
    model = nlmechss(MOUNT, [Damper("y2", law=300), Spring("y", "y2", 7)])
    whole = hd.hydromount(C_h=300)
    assert model.with_linear_elements.C.tolist() == whole.C.tolist()
    assert (model.with_linear_elements.K - whole.K).tolist() == [[7, 0, -7], [0, 0, 0], [-7, 0, 7]]


def falling(v: Any) -> Any:  # noqa: ANN401
    """Return a force that falls between its two humps."""
    return v**3 - v


BAD: list[tuple[Callable[[], Any], type[HalfdofError], str]] = [
    (lambda: nlmechss(MOUNT, Damper("z", law=1)), SignalNameError, r"no DOF for damper 1 \(linear\): 'z'"),
    (lambda: nlmechss(MOUNT, [3]), ParameterError, r"Elements are Spring, Damper and Force"),  # type: ignore[list-item]
    (lambda: nlmechss(np.eye(2), []), ParameterError, r"takes a model made by mechss"),  # type: ignore[arg-type]
    (
        lambda: nlmechss(MOUNT.prescribe_motion("y"), Spring("y", "y2", laws.cubic(1))),
        SignalNameError,
        r'has left the model. Prescribe its motion by model.prescribe_motion\("y", "acceleration"\)',
    ),
    (lambda: nlmechss(hd.mechss(None, None, [[1j]]), []), ComplexModelError, r"imaginary parts"),
    (
        lambda: nlmechss(hd.mechss(None, None, eye_array(3)), []),
        ModelSizeError,
        r"dense and have up to 500 DOFs; this one is sparse",
    ),
    (lambda: nlmechss(hd.mechss(np.eye(501), None, None), []), ModelSizeError, r"this one is dense and has 501"),
    (
        lambda: nlmechss(MOUNT, Damper("y2", law=Law(np.sum))),
        LawError,
        r"returns the shape \(\) for values of shape \(3,\)",
    ),
    (lambda: nlmechss(MOUNT, Damper("y2", law=Law(lambda v: v * 1j))), LawError, r"returns complex numbers"),
    (lambda: nlmechss(MOUNT, Damper("y2", law=Law(lambda v: v / v))), LawError, r"gives nan at zero"),
    (lambda: nlmechss(MOUNT, Damper("y2", law=Law(lambda v: v.nothing))), LawError, r"cannot be called with an array"),
    (
        lambda: nlmechss(MOUNT, Damper("y2", law=Law(lambda v: np.array(["a"] * np.size(v))))),
        LawError,
        r"numbers are needed",
    ),
    (lambda: nlmechss(MOUNT, Damper("y2", law=Law(falling))), LawError, r"several velocities answer the same force"),
    (
        lambda: nlmechss(MOUNT, Damper("y2", law=laws.cubic(1, -1))),
        LawError,
        r"several velocities answer the same force",
    ),
    (
        lambda: nlmechss(MOUNT, Damper("y2", law=laws.coulomb(5, 0.01))),
        LawError,
        r"a force above 5 N has no answering velocity; add a viscous part",
    ),
    (
        lambda: nlmechss(MOUNT, Damper("y2", law=Law(lambda v: 5 * np.tanh(v)))),
        LawError,
        r"a force above 5 N has no answering velocity",
    ),
    (lambda: nlmechss(MOUNT, Damper("y2", law=Law(np.tanh, bounds=(-1, 1)))), LawError, r"a force above 1 N has no"),
    (
        lambda: nlmechss(MOUNT, [Damper("y2", law=laws.coulomb(5, 0.01)), Damper("y2", law=laws.coulomb(3, 0.1))]),
        LawError,
        r"damper 1 \(coulomb\) and damper 2 \(coulomb\) alone holds y2, without mass: a force above 8 N",
    ),
    (lambda: nlmechss(MOUNT, Damper("y2", law=laws.gap(1e4, 0.1))), LawError, r"inside a gap nothing holds y2"),
    (
        lambda: nlmechss(hd.mechss([[1, 0], [0, 0]], None, np.zeros((2, 2))), Spring("q0", "q1", laws.gap(1e4, 0.1))),
        LawError,
        r"inside a gap nothing holds q1",
    ),
    (
        lambda: nlmechss(MOUNT, Force(lambda q, v, t: np.zeros(2), "y")),
        LawError,
        r"returns the shape \(2,\) for values of shape \(1,\)",
    ),
    (lambda: nlmechss(MOUNT, Force(lambda q, v, t: q * np.nan, "y")), LawError, r"gives \[nan\] at zero"),
    (
        lambda: nlmechss(MOUNT, Force(lambda q, v, t: q, "y", jacobian=lambda q, v, t: (1.0, 0.0))),
        LawError,
        r"The jacobian of force 1 \(lambda\) returns arrays of shapes",
    ),
    (
        lambda: nlmechss(hd.mechss([[1, 0], [0, 0]], None, [[1, 1], [1, 0]]), Spring("q0", law=laws.cubic(1))),
        LawError,
        r"The model is of index 3 whatever the slopes of spring 1 \(cubic\) are",
    ),
]


@pytest.mark.parametrize(("make", "kind", "message"), BAD, ids=[message[:40] for _, _, message in BAD])
def test_what_cannot_be_is_refused_before_anything_is_computed(
    make: Callable[[], Any], kind: type[HalfdofError], message: str
) -> None:
    """With the element, the DOF and what to do."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of the user's own function at 0/0
        with pytest.raises(kind, match=message):
            make()


def test_a_bounded_law_is_welcome_beside_a_viscous_part() -> None:
    """Friction and a linear damper together answer every force, in one element or in two."""
    nlmechss(MOUNT, Damper("y2", law=laws.coulomb(5, 0.01, 3)))
    nlmechss(hd.hydromount(), Damper("y2", law=laws.coulomb(5, 0.01)))
    nlmechss(MOUNT, [Damper("y2", law=laws.coulomb(5, 0.01)), Damper("y2", law=laws.quadratic(1e4))])
