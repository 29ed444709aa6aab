"""The partition of sparse models against the dense one, block by block."""

import numpy as np
import pytest
from hypothesis import assume, given
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import block_diag, csc_array

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.base.errors import ModelSizeError, NearlyMasslessWarning
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.method.masses import mass_ratios
from halfdof_ctrl.reduction.sparse import bases
from halfdof_ctrl.reduction.sparse import partition as sparse_partition
from halfdof_ctrl.reduction.sparse.bases import sparse_bases
from halfdof_ctrl.reduction.sparse.selection import _mass_ratios, select_sparse_columns
from support.anykinds import drawn_models
from support.fe_models import spring_grid
from support.structures import Structure, rank_deficient, structures

SETTLED = 1e-2  # the sparse scaling is iterated to a hundredth of a power of two
ROUNDOFF = 1e-12  # products of small integer matrices with orthonormal blocks


def sparse(structure: Structure) -> tuple[csc_array, csc_array, csc_array]:
    """Give M, C, K sparse."""
    M, C, K = (csc_array(matrix.astype(float)) for matrix in structure.matrices)
    return M, C, K


@given(structure=structures())
def test_null_columns_give_the_dense_selection(structure: Structure) -> None:
    """The same DOFs in the same order."""
    mine, dense = select_sparse_columns(mechss(*sparse(structure))), select_columns(structure.model())
    assert mine.coordinates == dense.coordinates
    assert (mine.inertial, mine.half, mine.static) == (dense.inertial, dense.half, dense.static)
    assert_array_equal(mine.order, dense.order)
    assert_array_equal(mine.T, dense.T)


@given(structure=structures(largest=9))
def test_bases_equal_the_dense_ones(structure: Structure) -> None:
    """The same counts; ``M [T_c T_k] = 0`` and ``C T_k = 0``, exactly where the entries are rounding of zero."""
    model = mechss(*sparse(structure))
    mine, dense = sparse_bases(model), orthonormal_bases(structure.model())
    assert (mine.n_inertial, mine.n_half, mine.n_static) == (dense.n_inertial, dense.n_half, dense.n_static)
    M, C, _ = structure.matrices
    size = max(1, np.abs(structure.matrices).max()) * np.abs(mine.T).max()
    assert_allclose(M @ mine.T[:, mine.n_inertial :], 0.0, atol=ROUNDOFF * size)
    assert_allclose(C @ mine.T[:, mine.n_inertial + mine.n_half :], 0.0, atol=ROUNDOFF * size)
    assert mine.mapped(model.M)[:, mine.of_kind(sparse_partition.STATIC)].nnz == 0  # type: ignore[arg-type]
    q = np.random.default_rng(0).standard_normal((structure.size, 2))
    assert_allclose(mine.T @ mine.to_coordinates(q), q, atol=ROUNDOFF * 100)


@given(structure=structures(rank_deficient, smallest=2, largest=6))
def test_every_mixed_block_tells_its_singular_values(structure: Structure) -> None:
    """Blocks and ranks are those of the dense partition; that scales the whole model first, so the values differ."""
    mine, dense = sparse_bases(mechss(*sparse(structure))), orthonormal_bases(structure.model())
    several = [decision for decision in dense.evidence if decision.singular_values.size > 1]
    assume(several)
    first = [decision for decision in several if decision.matrix == "M"]
    for mine_one, dense_one in zip([one for one in mine.evidence if one.matrix == "M"], first, strict=True):
        assert mine_one.dofs == dense_one.dofs
        assert mine_one.rank == dense_one.rank
        assert mine_one.singular_values.shape == dense_one.singular_values.shape
        assert mine_one.gap > 1e6


def test_only_what_needs_it_is_mixed() -> None:
    """A pair of DOFs that share a mass, beside a net of springs: all DOFs but the pair keep name and place."""
    pair = csc_array([[2.0, 2.0], [2.0, 2.0]])
    net = spring_grid(4, 4, 3)
    M = block_diag([pair, net.M], format="csc")
    K = block_diag([csc_array([[3.0, -1.0], [-1.0, 2.0]]), net.K], format="csc")
    partition = sparse_bases(mechss(M, None, K))
    assert (partition.n_inertial, partition.n_half, partition.n_static) == (4, 0, 14)
    mixed = [name for name in partition.coordinates if name.startswith("mix")]
    assert mixed == ["mix0", "mix1"]
    assert partition.inertial[0] == "mix0"
    assert set(partition.coordinates) - set(mixed) == {f"q{k}" for k in range(2, 18)}


def test_a_tiny_mass_is_warned_of_and_may_be_left_out() -> None:
    """As in the dense partition, with the same ratio in the message."""
    M, K = np.diag([1.0, 1e-13, 0.0]), np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    with pytest.warns(NearlyMasslessWarning, match="DOFs q1 have a mass of at most") as mine:
        exact_reduction(mechss(csc_array(M), None, K))
    with pytest.warns(NearlyMasslessWarning, match="DOFs q1 have a mass of at most") as dense:
        exact_reduction(mechss(M, None, K))
    assert select_sparse_columns(mechss(csc_array(M), None, K)).light == select_columns(mechss(M, None, K)).light
    assert str(mine[0].message) == str(dense[0].message)
    partition = select_sparse_columns(mechss(csc_array(M), np.diag([0.0, 4.0, 0.0]), K), tol=1e-9)
    assert (partition.inertial, partition.half, partition.static) == (("q0",), ("q1",), ("q2",))


@given(case=drawn_models(largest=9))
def test_mass_ratios_are_the_dense_ones(case: tuple[Structure, SecondOrderModel]) -> None:
    """The same column scales, so that the same masses are warned of and `tol` leaves out the same."""
    structure, model = case
    assume(structure.M.any())
    mine, dense = _mass_ratios(mechss(*sparse(structure))), mass_ratios(model)
    assert_allclose(mine, dense, rtol=SETTLED)


def test_a_large_connected_mass_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """No singular value decomposition of the whole structure."""
    monkeypatch.setattr(bases, "LARGEST_MIXED", 3)
    M = csc_array(np.ones((4, 4)))
    with pytest.raises(ModelSizeError, match=r"M connects 4 DOFs \(q0, q1, q2, q3\)") as caught:
        sparse_bases(mechss(M, None, csc_array(np.eye(4))))
    assert (caught.value.size, caught.value.limit) == (4, 3)


def test_a_large_basis_is_not_made_dense(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is there as `columns`."""
    monkeypatch.setattr(sparse_partition, "LARGEST_BASIS", 3)
    partition = select_sparse_columns(mechss(csc_array(np.eye(4)), None, np.eye(4)))
    with pytest.raises(ModelSizeError, match="T of 4 DOFs would take"):
        _ = partition.T
