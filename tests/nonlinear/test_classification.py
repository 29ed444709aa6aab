"""Classification by the whole equation: which DOFs the elements make half or static."""

import numpy as np
import pytest

import halfdof_ctrl as hd
from halfdof_ctrl import Damper, Force, Spring, exact_reduction, laws, mechss, nlmechss
from halfdof_ctrl.errors import SingularPencilError, UncertainRankError
from halfdof_ctrl.nonlinear import classification as module

CHAIN = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
SQUARE = laws.quadratic(1.0)


@pytest.mark.parametrize(
    ("elements", "half", "static"),
    [
        ([], (), ("q1", "q2")),
        ([Damper("q1", law=SQUARE)], ("q1",), ("q2",)),
        ([Damper("q1", "q2", SQUARE)], ("q1", "q2"), ()),
        ([Damper("q0", law=SQUARE)], (), ("q1", "q2")),
        ([Spring("q2", law=laws.cubic(1.0))], (), ("q1", "q2")),
        ([Force(lambda q, v, t: np.array([q[0] * v[0], v[0]]), "q0", "q2")], ("q2",), ("q1",)),  # noqa: ARG005
        ([Damper("q1", law=3.0)], ("q1",), ("q2",)),
    ],
)
def test_an_element_counts_as_if_its_slope_were_generic(
    elements: list[hd.Spring | hd.Damper | hd.Force], half: tuple[str, ...], static: tuple[str, ...]
) -> None:
    """A mass and two nodes without; a damper makes those half that it holds, two tied ones share a state."""
    model = nlmechss(mechss(np.diag([1.0, 0.0, 0.0]), None, CHAIN), elements)
    if len(half) == 2:  # damped against each other only: one state, as the linear reduction has it
        linear = exact_reduction(mechss(np.diag([1.0, 0.0, 0.0]), [[0, 0, 0], [0, 1, -1], [0, -1, 1]], CHAIN))
        assert model.states == linear.states
        return
    assert (model.partition.half, model.partition.static) == (half, static)


def test_print_tells_what_the_elements_made() -> None:
    """A static DOF that a spring alone holds, a half one by two elements, and nothing of DOFs that were so before."""
    K = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]
    elements = [
        Spring("q0", "q1", laws.cubic(1.0, 2.0)),
        Spring("q1", law=laws.cubic(3.0)),
        Damper("q2", law=SQUARE),
        Damper("q2", law=laws.coulomb(1, 1)),
    ]
    text = repr(nlmechss(mechss(np.diag([1.0, 0.0, 0.0]), None, K), elements))
    assert "q1: static, by spring 1 (cubic), spring 2 (cubic); its column of K is null" in text
    assert "q2: half, by damper 1 (quadratic) and damper 2 (coulomb); its column of C is null" in text
    assert "q0:" not in text


def test_a_motion_that_nothing_resists_is_named() -> None:
    """The linear package's own refusal comes through."""
    with pytest.raises(SingularPencilError, match=r"q1"):
        nlmechss(mechss([[1.0, 0.0], [0.0, 0.0]], None, [[1.0, 0.0], [0.0, 0.0]]), Damper("q0", law=SQUARE))


def test_two_draws_must_decide_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where they do not, the order of the model cannot be told."""
    real, calls = module.generic_slopes, []

    def sometimes_zero(*arguments: object) -> list[np.ndarray]:
        calls.append(arguments)
        return [0.0 * G if len(calls) == 2 else G for G in real(*arguments)]  # type: ignore[arg-type]

    monkeypatch.setattr(module, "generic_slopes", sometimes_zero)
    with pytest.raises(UncertainRankError, match=r"Two draws of generic slopes of the elements on y2 give states"):
        nlmechss(hd.hydromount(C_h=0), Damper("y2", law=SQUARE))
