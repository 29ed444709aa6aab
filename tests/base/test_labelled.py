"""Labelled matrices are aligned by label, or refused: `halfdof_ctrl.base.labelled`."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.base.errors import MatrixError, SignalNameError
from halfdof_ctrl.model.descriptor_system import dss
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import LETTERS
from support.labelled_frames import Columns, Frame, OldFrame, Series

M = np.diag([2.0, 0.0, 1.0])
K = np.array([[9.0, -1.0, -2.0], [-1.0, 5.0, 0.0], [-2.0, 0.0, 7.0]])
LABELS = ("m", "h", "k")


@given(order=st.permutations(range(3)), columns=st.permutations(range(3)))
def test_rows_and_columns_in_any_order_give_the_same_model(order: list[int], columns: list[int]) -> None:
    """K with rows and columns permuted, labels with them, against K in the order of M."""
    rows, width = [LABELS[i] for i in order], [LABELS[i] for i in columns]
    labelled: Any = Frame(K[np.ix_(order, columns)], rows, width)
    first: Any = Frame(M, LABELS, LABELS)
    model = mechss(first, None, labelled)
    assert model.dofs == LABELS
    assert_array_equal(model.K, K)


@given(order=st.permutations(range(3)))
def test_signals_are_aligned_and_named_by_their_labels(order: list[int]) -> None:
    """B, F and D of labelled rows and columns against plain matrices with names."""
    names = [LABELS[i] for i in order]
    B, F, D = np.array([[1.0, 0.0], [0.0, 2.0], [3.0, 0.0]]), np.array([[4.0, 5.0, 6.0]]), np.array([[7.0, 8.0]])
    frames: Any = {
        "B": Frame(B[order], names, ["pull", "twist"]),
        "F": Frame(F[:, order], ["sensor"], names),
        "D": Frame(D[:, ::-1], ["sensor"], ["twist", "pull"]),
    }
    plain = mechss(M, None, K, B, F, D=D, dofs=LABELS, inputs=["pull", "twist"], outputs="sensor")
    model = mechss(M, None, K, **frames, dofs=LABELS)
    assert (model.inputs, model.outputs) == (plain.inputs, plain.outputs)
    for letter in LETTERS:
        assert_array_equal(getattr(model, letter), getattr(plain, letter))


def test_names_that_are_given_decide_the_order() -> None:
    """Not the labels of the first matrix."""
    frame: Any = OldFrame(K, LABELS)
    model = mechss(None, None, frame, dofs=["k", "m", "h"])
    assert model.dofs == ("k", "m", "h")
    assert_array_equal(model.K, K[np.ix_([2, 0, 1], [2, 0, 1])])


def test_rows_that_are_but_counted_have_no_names() -> None:
    """A frame that nobody labelled is an array, also under names that are given beside it."""
    first: Any = Frame(M)
    second: Any = Frame(K)
    assert mechss(first, None, second).dofs == ("q0", "q1", "q2")
    assert mechss(first, None, second, dofs=LABELS).dofs == LABELS


def test_node_numbers_are_labels() -> None:
    """Whole numbers that do not count from 0 on name the DOFs, and are aligned."""
    first: Any = Frame(M, [101, 102, 103], [101, 102, 103])
    second: Any = Frame(K[::-1, ::-1], [103, 102, 101], [103, 102, 101])
    model = mechss(first, None, second)
    assert model.dofs == ("101", "102", "103")
    assert_array_equal(model.K, K)


def test_a_labelled_vector_is_a_diagonal_or_a_single_signal() -> None:
    """Aligned as a matrix is."""
    mass: Any = Series([0.0, 2.0, 1.0], ["h", "m", "k"])
    force: Any = Series([5.0, 4.0, 6.0], ["h", "m", "k"])
    model = mechss(mass, None, K, force, force, dofs=LABELS)
    assert_array_equal(model.M, M)
    assert_array_equal(model.B[:, 0], [4.0, 5.0, 6.0])
    assert_array_equal(model.F[0], [4.0, 5.0, 6.0])


def test_the_variables_of_a_descriptor_system_are_aligned() -> None:
    """E in another order than A."""
    A: Any = Frame([[0.0, 1.0], [-1.0, -2.0]], ["voltage", "current"], ["voltage", "current"])
    E: Any = Frame([[0.0, 0.0], [0.0, 3.0]], ["current", "voltage"], ["current", "voltage"])
    system = dss(A, [0.0, 1.0], [1.0, 0.0], 0, E)
    assert system.dofs == ("voltage", "current")
    assert_array_equal(system.C, [[3.0, 0.0], [0.0, 0.0]])


REFUSALS: list[tuple[dict[str, Any], str]] = [
    (
        {"K": Frame(K, ["m", "h", "x"], ["m", "h", "x"])},
        "rows of K are labelled m, h, x, and the rows of M are m, h, k",
    ),
    ({"K": Frame(K, LABELS, ["m", "h", "x"])}, "columns of K are labelled m, h, x"),
    ({"K": Frame(K)}, r"rows of K are labelled 0, 1, 2.*K\.to_numpy\(\)"),
    ({"K": Frame(K[:2, :2], LABELS[:2], LABELS[:2])}, "k stands in one of them alone"),
    ({"dofs": ["m", "h", "x"]}, "and the names given for DOFs are m, h, x"),
    ({"K": Frame(K, [(1, "x"), (1, "y"), (2, "x")], LABELS)}, "several levels.*'1.x'"),
    ({"K": Frame(K, ["m", "m", "h"], LABELS)}, "Names of the rows of K must differ, but m stands more than once"),
    ({"K": Frame(K, [0.5, 1.5, 2.5], LABELS)}, "rows of K must be non-empty text.*not a float"),
    ({"B": Frame(np.ones((1, 3)), ["pull"], LABELS)}, "rows of B are labelled pull"),
]


@pytest.mark.parametrize(("arguments", "words"), REFUSALS)
def test_labels_that_do_not_match_are_refused(arguments: dict[str, Any], words: str) -> None:
    """Combined by position they would give another model without a sign of it."""
    labelled: dict[str, Any] = {"M": Frame(M, LABELS, LABELS), "C": None, "K": Frame(K, LABELS, LABELS)} | arguments
    with pytest.raises(SignalNameError, match=words):
        mechss(**labelled)


def test_a_table_without_labels_of_rows_is_refused() -> None:
    """Its columns might stand in another order than those of the other matrices."""
    table: Any = Columns(K, LABELS)
    with pytest.raises(MatrixError, match=r"K is a .*Columns, whose rows have no labels.*K\.to_numpy\(\)"):
        mechss(None, None, table)


def test_labels_of_more_dimensions_are_refused() -> None:
    """A matrix has two."""
    cube: Any = OldFrame(np.zeros((2, 2, 2)), ["a", "b"])
    with pytest.raises(MatrixError, match="K has labels and 3 dimensions"):
        mechss(None, None, cube)


def test_text_in_a_labelled_matrix_is_refused() -> None:
    """As in any other."""
    frame: Any = Frame([["1"]], ["a"], ["a"])
    with pytest.raises(MatrixError, match="K holds entries of type"):
        mechss(None, None, frame)
