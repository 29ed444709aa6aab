"""DOFs are taken out with their rows, columns and signals: `SecondOrderModel.without`."""

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.base.errors import SignalNameError, SingularPencilError
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import LETTERS, SecondOrderModel
from halfdof_ctrl.parts.mounts import hydromount
from halfdof_ctrl.reduction.choose import exact_reduction

ROUNDING = 1e-14  #: of a solve with two DOFs


def loose() -> SecondOrderModel:
    """Two masses on springs, and two DOFs to which nothing is attached."""
    K = np.zeros((4, 4))
    K[:2, :2] = [[3.0, -1.0], [-1.0, 1.0]]
    return mechss([1.0, 2.0, 0.0, 0.0], None, K, dofs=["a", "b", "a_r", "b_r"])


def test_a_refusal_names_what_to_take_out_and_that_helps() -> None:
    """The names of the message, passed to `without`, leave a model with the states of the masses."""
    with pytest.raises(SingularPencilError, match=r"model\.without\(\['a_r', 'b_r'\]\)") as refusal:
        exact_reduction(loose())
    assert exact_reduction(loose().without(refusal.value.dofs)).order == 4


@pytest.mark.parametrize("sparse", [False, True])
def test_dofs_without_entries_leave_no_trace(sparse: bool) -> None:  # noqa: FBT001
    """Against the model that never had them."""
    model = loose()
    if sparse:
        M, K = (scipy.sparse.csr_array(matrix) for matrix in (model.M, model.K))
        model = mechss(M, None, K, dofs=model.dofs)
    small = model.without(["b_r", "a_r"])
    expected = mechss([1.0, 2.0], None, [[3.0, -1.0], [-1.0, 1.0]], dofs=["a", "b"])
    assert small.is_sparse == sparse
    assert (small.dofs, small.inputs, small.outputs) == (expected.dofs, expected.inputs, expected.outputs)
    for letter in LETTERS:
        assert_array_equal(getattr(small.as_dense(), letter), getattr(expected, letter))


@given(s=st.complex_numbers(min_magnitude=0.1, max_magnitude=10.0))
def test_what_is_tied_to_them_sees_them_held(s: complex) -> None:
    """H(s) of the mount without its second node against the same with its displacement prescribed as zero."""
    model = hydromount()
    held = model.prescribe_motion("y2", inputs=["F_y", "F_y1"], outputs=["y", "y1_dot"])
    taken = model.without("y2").select(["F_y", "F_y1"], ["y", "y1_dot"])
    assert_allclose(taken(s), held(s), rtol=ROUNDING * 1e3, atol=1e-300)


def test_signals_of_other_dofs_stay_less_their_part() -> None:
    """A relative displacement becomes an absolute one; a force on what is out is gone, a direct term stays."""
    model = mechss(
        np.eye(3), None, np.eye(3), [[1, 0, 0], [-1, 1, 0], [0, 0, 0]], [[1, -1, 0], [0, 1, 0], [0, 1, 0]],
        D=[[0, 0, 0], [0, 0, 0], [0, 0, 2]], dofs=["a", "b", "c"], inputs=["pair", "b alone", "nothing"],
        outputs=["between", "b", "fed"],
    )  # fmt: skip
    small = model.without("b")
    assert (small.inputs, small.outputs) == (("pair", "nothing"), ("between", "fed"))
    assert_array_equal(small.F, [[1.0, 0.0], [0.0, 0.0]])
    assert_array_equal(small.B, [[1.0, 0.0], [0.0, 0.0]])
    assert_array_equal(small.D, [[0.0, 0.0], [0.0, 2.0]])


REFUSALS: list[tuple[SecondOrderModel, object, str]] = [
    (hydromount(), "y3", r"The model has no DOF 'y3'.*Nearest: .*y2"),
    (hydromount(), ["y1", "y1"], "must differ, but y1 stands more than once"),
    (hydromount(), ["y", "y1", "y2"], "Without y, y1, y2 no DOF is left"),
    (hydromount().select("F_y", "y1"), "y", "Without y no input is left: F_y acts on nothing else"),
    (hydromount().select("F_y", "y1_dot"), "y1", "Without y1 no output is left: y1_dot shows nothing else"),
    (hydromount().prescribe_motion("y", "velocity"), "y", "The motion of y is prescribed"),
    (hydromount(), 5, r"not the number 5.* Give a list, such as \[5\]"),
]


@pytest.mark.parametrize(("model", "dofs", "words"), REFUSALS)
def test_what_cannot_be_taken_out_is_refused(model: SecondOrderModel, dofs: object, words: str) -> None:
    """Unknown, twice, all, the last signal, a prescribed motion, a single number."""
    with pytest.raises(SignalNameError, match=words):
        model.without(dofs)  # type: ignore[arg-type]
