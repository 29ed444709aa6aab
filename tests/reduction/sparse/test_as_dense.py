"""Claims that a sparse model is reduced as its dense copy is: order, states, warnings, digits."""

import warnings

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.sparse import csc_array

from halfdof_ctrl import ExactReduction, HalfdofError, SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.reduction.sparse import method
from support import exact
from support.anykinds import drawn_models
from support.structures import Structure, structures

POINTS = np.array([0.3j, 1.1j, 0.6 + 0.2j])  # [rad/s]
FACTOR = 10.0  # between the errors of the two
FLOOR = 1e-13  # of the largest entry: errors below are not compared

FloatArray = npt.NDArray[np.float64]


def nearly_one_mass(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return two DOFs that share their mass but for a part, beside an ordinary third one."""
    M = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + share, 0.0], [0.0, 0.0, 1.0]])
    return M, np.diag([1.0, 2.0, 0.5]), np.array([[3.0, 0.0, -1.0], [0.0, 4.0, 0.0], [-1.0, 0.0, 5.0]])


def told(model: SecondOrderModel) -> tuple[ExactReduction | str, list[str]]:
    """Reduce, and give the kinds of what was said: warnings, or the refusal."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            answer: ExactReduction | str = exact_reduction(model)
        except HalfdofError as refusal:
            answer = type(refusal).__name__
    return answer, sorted(warning.category.__name__ for warning in said)


def error(reduction: ExactReduction, desired: npt.NDArray[np.complex128]) -> float:
    """Return the largest error of all displacements, relative to the largest entry at each point."""
    worst, unit = 0.0, np.eye(reduction.order)
    q = reduction.displacement
    for s, value in zip(POINTS, desired, strict=True):
        found = q.X @ np.linalg.solve(s * unit - reduction.A, reduction.B + 0j)
        found = found + sum((s**power * part for power, part in enumerate(q.U)), np.zeros_like(found))
        worst = max(worst, float(np.abs(found - value).max() / np.abs(value).max()))
    return worst


def compare(matrices: tuple[FloatArray, FloatArray, FloatArray]) -> None:
    """Reduce both and compare everything that a user sees."""
    dense, words = told(mechss(*matrices))
    sparse, same_words = told(mechss(*[csc_array(matrix) for matrix in matrices]))
    assert same_words == words
    if isinstance(dense, str) or isinstance(sparse, str):
        assert sparse == dense
        return
    assert sparse.states == dense.states
    assert sparse.partition.static == dense.partition.static
    desired = np.moveaxis(exact.transfer(mechss(*matrices), POINTS), 2, 0)
    assert error(sparse, desired) <= FACTOR * error(dense, desired) + FLOOR


@pytest.mark.parametrize("share", [1e-8, 1e-10, 1e-12, 1e-13, 1e-15])
def test_masses_that_nearly_share_a_motion_are_reduced_alike(share: float) -> None:
    """The constant vector cannot see that W is nearly singular; where dense coordinates mix, sparse ones do."""
    compare(nearly_one_mass(share))


@given(structure=structures(largest=8), power=st.integers(4, 44), place=st.integers(0, 63))
def test_any_model_with_one_entry_off_is_reduced_alike(structure: Structure, power: int, place: int) -> None:
    """A mass or a damper that is moved by 2^-k, so that ranks are high by hardly more than rounding."""
    M, C, K = (matrix.astype(float) for matrix in structure.matrices)
    n = structure.size
    (M if place % 2 else C)[place // 2 % n, place // 2 % n] += 2.0**-power
    compare((M, C, K))


@given(case=drawn_models(largest=9))
def test_sparse_methods_alone_give_the_order_of_the_dense_ones(case: tuple[Structure, SecondOrderModel]) -> None:
    """As for models too large for a dense copy: the null spaces are split in the same way, and so are the states."""
    structure, _ = case
    matrices = tuple(matrix.astype(float) for matrix in structure.matrices)
    dense, _ = told(mechss(*matrices))
    assume(isinstance(dense, ExactReduction) and dense.method != "deflation")
    assert isinstance(dense, ExactReduction)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(method, "DENSE_COPY_DOFS", 0)
        sparse, _ = told(mechss(*[csc_array(matrix) for matrix in matrices]))
    assert isinstance(sparse, ExactReduction)
    assert sparse.states == dense.states
