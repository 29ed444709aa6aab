"""Claims about triangles: filled in where the format says symmetric, told where it does not."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.raw_matrix import (
    Declared,
    RawMatrix,
    Triangle,
    assembled,
    completed,
    storage,
    with_triangle,
)

K = np.array([[2.0, -1.0, 0.0], [-1.0, 3.0, -2.0], [0.0, -2.0, 4.0]])
EITHER = np.array([[2.0, -1.0, 0.0], [0.0, 3.0, 0.0], [0.0, -2.0, 4.0]])  #: one entry of each pair, on either side


def raw(matrix: npt.NDArray[Any], declared: Declared = "unsaid") -> RawMatrix:
    """Make a matrix of its nonzero entries."""
    i, j = np.nonzero(matrix)
    return assembled(i, j, matrix[i, j], (matrix.shape[0], matrix.shape[1]), declared=declared, format="test")


@pytest.mark.parametrize(("half", "stored"), [(np.tril(K), "lower"), (np.triu(K), "upper"), (EITHER, "either")])
def test_a_half_is_completed_where_the_format_says_symmetric(half: npt.NDArray[np.float64], stored: str) -> None:
    """Whichever entry of a pair is stored, both are there afterwards, and the diagonal stays."""
    found = raw(half, "symmetric")
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    assert (found.stored, found.completed, found.is_half_stored) == (stored, True, False)


@pytest.mark.parametrize("declared", ["general", "unsaid"])
@pytest.mark.parametrize("half", [np.tril(K), np.triu(K), EITHER])
def test_a_half_is_told_and_left_alone_where_it_does_not(declared: Declared, half: npt.NDArray[np.float64]) -> None:
    """Nothing is guessed."""
    found = raw(half, declared)
    np.testing.assert_array_equal(found.matrix.toarray(), half)
    assert (found.completed, found.is_half_stored) == (False, True)


@pytest.mark.parametrize("matrix", [K, np.diag([1.0, 0.0, 2.0]), K + np.triu(K, 1), np.tril(np.ones((3, 2)))])
def test_full_diagonal_unsymmetric_and_rectangular_matrices_are_no_halves(matrix: npt.NDArray[np.float64]) -> None:
    """What has partners, or needs none, is whole."""
    assert not raw(matrix).is_half_stored


def test_both_triangles_under_a_symmetric_header_are_not_doubled() -> None:
    """A pair that is stored twice counts once if it is equal."""
    found = raw(K, "symmetric")
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    assert (found.stored, found.completed) == ("both", False)


def test_pairs_that_differ_under_a_symmetric_header_are_refused_with_their_place() -> None:
    """Either the header or an entry is wrong."""
    wrong = K.copy()
    wrong[1, 2] = -2.5
    with pytest.raises(FileFormatError, match=r"it is symmetric, but its entries \((2, 3|3, 2)\) and"):
        raw(wrong, "symmetric")


def test_a_skew_matrix_gets_the_other_sign() -> None:
    """The gyroscopic matrix of a rotor."""
    skew = np.array([[0.0, -3.0], [3.0, 0.0]])
    np.testing.assert_array_equal(raw(np.tril(skew), "skew-symmetric").matrix.toarray(), skew)
    with pytest.raises(FileFormatError, match=r"skew-symmetric, but its entries .* and minus"):
        raw(np.array([[0.0, 3.0], [3.0, 0.0]]), "skew-symmetric")


def test_entries_that_stand_twice_are_added_up_and_told() -> None:
    """As element matrices that nobody has assembled."""
    found = assembled(
        np.array([0, 0]), np.array([0, 0]), np.array([1.0, 2.0]), (1, 1), declared="unsaid", format="test"
    )
    assert found.matrix.toarray().tolist() == [[3.0]]
    assert found.doubts[0].startswith("has 1 entries at places that have one already, and they are added up")


def test_zeros_that_are_stored_are_no_entries() -> None:
    """A DOF whose mass is written as 0 has none."""
    found = assembled(
        np.array([0, 1]), np.array([0, 1]), np.array([1.0, 0.0]), (2, 2), declared="unsaid", format="test"
    )
    assert found.matrix.nnz == 1


@pytest.mark.parametrize(("row", "column"), [(3, 0), (0, 3), (-1, 0)])
def test_an_entry_outside_is_refused(row: int, column: int) -> None:
    """Before it can be written anywhere."""
    with pytest.raises(FileFormatError, match="outside the 3 x 3 matrix"):
        assembled(np.array([row]), np.array([column]), np.ones(1), (3, 3), declared="unsaid", format="test")


def test_a_rectangle_cannot_be_symmetric() -> None:
    """Its header is wrong."""
    with pytest.raises(FileFormatError, match="2 x 3 cannot be symmetric"):
        raw(np.ones((2, 3)), "symmetric")


def test_the_user_may_say_that_a_half_is_symmetric() -> None:
    """With the triangle that is there; what is whole stays."""
    np.testing.assert_array_equal(with_triangle(raw(np.tril(K)), "lower").matrix.toarray(), K)
    np.testing.assert_array_equal(with_triangle(raw(np.triu(K)), "upper").matrix.toarray(), K)
    np.testing.assert_array_equal(with_triangle(raw(K), "upper").matrix.toarray(), K)


@pytest.mark.parametrize(
    ("half", "given", "message"),
    [(np.tril(K), "upper", "in the lower triangle"), (EITHER, "lower", "on either side of the diagonal")],
)
def test_the_wrong_triangle_is_refused(half: npt.NDArray[np.float64], given: Triangle, message: str) -> None:
    """A user who looks at another file learns it."""
    with pytest.raises(FileFormatError, match=message):
        with_triangle(raw(half), given)


@given(seed=st.integers(0, 10**6))
def test_any_choice_of_one_entry_a_pair_gives_the_whole_matrix_back(seed: int) -> None:
    """Completion undoes what storing one entry of each pair loses."""
    rng = np.random.default_rng(seed)
    half = np.triu(np.where(rng.random((6, 6)) < 0.4, rng.normal(size=(6, 6)), 0.0))
    whole = half + np.triu(half, 1).T
    flip = np.triu(rng.random((6, 6)) < 0.5, 1)
    stored = np.where(flip, 0.0, half) + np.where(flip, half, 0.0).T
    found = raw(stored, "symmetric")
    np.testing.assert_array_equal(found.matrix.toarray(), whole)
    assert storage(found.matrix) in {"both", "diagonal"}
    assert completed(found).matrix.nnz == found.matrix.nnz


def doubts_of(matrix: npt.NDArray[Any], declared: Declared) -> tuple[str, ...]:
    """Assemble a matrix of its nonzero entries."""
    rows, columns = np.nonzero(matrix)
    size = (matrix.shape[0], matrix.shape[1])
    return assembled(rows, columns, matrix[rows, columns], size, declared=declared, format="test").doubts


@pytest.mark.parametrize("declared", ["symmetric", "unsaid"])
def test_pairs_of_which_some_lack_an_entry_are_doubted(declared: Declared) -> None:
    """A symmetric matrix with one place changed has a pair and lone entries; rounding in a full one is none."""
    matrix = np.array([[0.0, 0.0, 2.0, 0.0], [1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [0.0, 4.0, 5.0, 0.0]])
    found = doubts_of(matrix, declared)
    assert found[0].startswith("has 3 entries without their partner across the diagonal, and 2 with it")
    assert not doubts_of(np.array([[4.0, 1.0, 1e-12], [1.0, 4.0, 2.0], [0.0, 2.0, 4.0]]), declared)


def test_an_unsymmetric_matrix_may_lack_some_partners() -> None:
    """As that of a brake with friction; most pairs are whole."""
    assert not doubts_of(np.array([[4.0, 1.0, 7.0], [1.0, 4.0, 2.0], [0.0, 2.0, 4.0]]), "unsaid")
