"""Errors of resonances that cluster, against dense eigenvalue solvers."""

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import SecondOrderModel, mechss, truncate_modes
from halfdof_ctrl.base.arrays import as_dense
from support.beams import beam_matrices


def rail_on_its_foundation(elements: int, length: float) -> SecondOrderModel:
    """Give a free rail (UIC 60, 0.06 t/m, 6.4 kN m^2) on a bed of 100 kN/m per m that clusters modes at 205 Hz."""
    M, K = beam_matrices(elements, clamped=False)
    rotations = np.tile([1.0, length], elements + 1)
    M = 60.21 * length * M * rotations * rotations[:, None]
    K = 6.4e6 / length**3 * K * rotations * rotations[:, None]
    bed = 1e8 / 60.21 * M
    middle = 2 * (elements // 2)
    return mechss(csc_array(M), None, csc_array(K + bed)).select(f"F_q{middle}", [f"q{middle}", f"q{middle // 2}"])


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.TruncationWarning")
def test_errors_of_clustered_modes_are_those_of_the_dense_solver() -> None:
    """A rail on a bed: modes that lie closer than their shift, which mix, and those beside them, to a tenth.

    The frequency of each mode, and the sum of the residues of those that are not told apart.
    """
    model = rail_on_its_foundation(100, 90.0)
    small = truncate_modes(model, f_max=230.0, points=3)
    found = small.resonances
    squares, shapes = scipy.linalg.eigh(as_dense(model.K), as_dense(model.M))
    full = np.sqrt(squares[: found.frequencies.size])
    assert found.in_band == found.frequencies.size == np.count_nonzero(np.sqrt(squares) < 2.0 * np.pi * 230.0) > 30
    shift = np.abs(2.0 * np.pi * found.frequencies / full - 1.0)
    assert np.diff(full).min() < 20.0 * (shift * full).max()
    told = shift > 100.0 * found.floor
    assert told.sum() > 20
    assert_allclose(found.frequency_shift[told], shift[told], rtol=0.1)
    _, own = scipy.linalg.eigh(small.K, small.M)
    first = np.count_nonzero(found.height == found.height[0])
    assert first > 2
    F, B = as_dense(model.F), as_dense(model.B)
    desired = (F @ shapes * (B.T @ shapes))[:, :first].sum(axis=1)
    sums = (small.F @ own * (small.B.T @ own))[:, :first].sum(axis=1)
    change = float(np.abs(sums / desired - 1.0).max())
    assert 0.1 * change < found.height[0] < 10.0 * change
