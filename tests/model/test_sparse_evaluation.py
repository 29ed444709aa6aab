"""Equation (1) of sparse models, point by point: the values of the dense evaluation."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import mechss
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.base.sparse_factors import PIVOTINGS
from halfdof_ctrl.model import sparse_evaluation
from halfdof_ctrl.model.evaluation import quadratic_transfer
from halfdof_ctrl.model.sparse_evaluation import SparseTransfer
from support.fe_models import space_frame
from support.structures import Structure, on_axis, structures

ROUNDOFF = 1e-10  # small integer matrices, away from poles but for chance
POINTS: npt.NDArray[np.complex128] = np.array([0.37j, 1.13j, 0.6 + 0.2j])  # [rad/s]


@given(structure=structures(largest=8), seed=st.integers(0, 2**32 - 1), loss_factor=st.sampled_from([0.0, 0.1]))
def test_values_are_those_of_the_dense_model(structure: Structure, seed: int, loss_factor: float) -> None:
    """Any structure, real or with structural damping, more inputs or more outputs, every kind of signal."""
    generator = np.random.default_rng(seed)
    n, m, p = structure.size, int(generator.integers(1, 4)), int(generator.integers(1, 4))
    shapes = {"B": (n, m), "Ba": (n, m), "F": (p, n), "G": (p, n), "Dv": (p, m)}
    signals: Any = {letter: generator.integers(-2, 3, shape).astype(float) for letter, shape in shapes.items()}
    M, C, K = (matrix.astype(float) for matrix in structure.matrices)
    K = K * (1.0 + 1j * loss_factor) if loss_factor else K
    dense, sparse = mechss(M, C, K, **signals), mechss(csc_array(M), csc_array(C), K, **signals)
    desired, found = dense(POINTS, squeeze=False), sparse(POINTS, squeeze=False)
    known = np.isfinite(desired) & (np.abs(desired) < 1e8)
    scale = max(1.0, float(np.abs(desired[known]).max(initial=0.0)))
    assert_allclose(found[known], desired[known], rtol=0.0, atol=ROUNDOFF * scale**2)


def test_a_pole_is_infinite_and_the_next_point_is_not() -> None:
    """Undamped modes at 1 and 2 rad/s; shapes as for dense models."""
    model = mechss(csc_array(np.eye(2)), None, np.diag([1.0, 4.0]))
    values = model(on_axis([0.5, 1.0, 2.0]))
    assert values.shape == (2, 2, 3)
    assert np.isinf(values.real).any(axis=(0, 1)).tolist() == [False, True, True]
    assert_allclose(values[1, 1, 0], 1.0 / 3.75)
    assert model.select("F_q0", "q0")(0.0).shape == ()


def test_the_order_is_found_once_and_kept() -> None:
    """After the first point the pencil is in order, and SuperLU takes it as it is."""
    structure = space_frame(3, 3, 3, 4, parts=2)
    model = structure.model().select("F_q0", ["q0", "q9"])
    transfer = SparseTransfer(model.quadratics.P, (model.B,) * 3, model.quadratics.F, model.quadratics.D)
    first = transfer.pencils[0]
    assert not first.is_ordered
    transfer.at(3j)
    assert transfer.pencils[0].is_ordered
    fill = [transfer._factorized(s, 0).lu.nnz for s in (3j, 40j)]
    assert fill[0] == fill[1]
    assert fill[0] <= 1.2 * sparse_evaluation.PointFactors.of(first, 3j, "MMD_AT_PLUS_A", 0.0).lu.nnz


@pytest.mark.parametrize("way", range(3))
def test_every_way_of_pivoting_gives_the_values(way: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the first way would have done."""
    model = space_frame(3, 2, 3, 2).model().select(["F_q0", "F_q3"], ["q0", "q9"])
    desired = model.as_dense()(POINTS)
    monkeypatch.setattr(sparse_evaluation, "PIVOTINGS", PIVOTINGS[way:])
    assert_allclose(model(POINTS), desired, rtol=1e-9)


def test_vanishing_pivots_are_noticed() -> None:
    """``P(j) = [[1e-19, 1], [1, ...]]``: pivots on the diagonal lose everything, stricter ones do not."""
    M, K = np.diag([1.0, 1.0, 0.0]), np.array([[1.0 + 1e-16, 1.0, 0.0], [1.0, 3.0, 1.0], [0.0, 1.0, 5.0]])
    model = mechss(csc_array(M), None, K)
    assert_allclose(model(1j), np.linalg.inv(K - M), rtol=1e-12)


def test_points_may_be_many_but_not_all_signals_with_them() -> None:
    """A response of 500 000 inputs and outputs has no room."""
    n = 50_000
    diagonal = csc_array((np.ones(n), (range(n), range(n))))
    with pytest.raises(ModelSizeError, match=r"50000 outputs to 50000 inputs at 1 points would take 40 GB"):
        mechss(diagonal, None, diagonal)(1.0)


def test_dense_signals_beside_a_sparse_pencil_are_taken() -> None:
    """As the dynamic stiffness does."""
    P = tuple(csc_array(matrix) for matrix in (np.diag([2.0, 3.0]), np.zeros((2, 2)), np.eye(2)))
    signal, zero = np.array([[1.0], [0.0]]), np.zeros((1, 1))
    values = quadratic_transfer(P, (signal,) * 3, (signal.T,) * 3, (zero,) * 3, POINTS)
    factor = 1.0 + POINTS + POINTS**2
    assert_allclose(values[0, 0], factor**2 / (2.0 + POINTS**2), rtol=1e-12)
