"""Singular pencils of sparse models are found by the oracle, and only those."""

import numpy as np
import pytest
from hypothesis import given
from scipy.sparse import block_array, block_diag, coo_array, csc_array, diags_array

from halfdof_ctrl import mechss
from halfdof_ctrl.base.errors import SingularPencilError, UncertainRankError
from halfdof_ctrl.descriptor.regularity import require_regular
from support import exact
from support.fe_models import space_frame, spring_grid
from support.structures import Structure, structures


@given(structure=structures(largest=8))
def test_singular_is_what_has_no_determinant(structure: Structure) -> None:
    """``det P(s)`` vanishes in exact arithmetic."""
    M, C, K = (csc_array(matrix.astype(float)) for matrix in structure.matrices)
    model = mechss(M, C, K)
    if exact.order(*structure.matrices) >= 0:
        require_regular(model)
    else:
        with pytest.raises(SingularPencilError, match="det P"):
            require_regular(model)


@pytest.mark.parametrize("structure", [space_frame(2, 2, 60, 5, parts=2), spring_grid(50, 50, 5)])
def test_frames_and_grids_are_regular(structure: object) -> None:
    """Also slender ones, whose condition is bad."""
    require_regular(structure.model())  # type: ignore[attr-defined]


def test_what_floats_is_named() -> None:
    """A net that is held nowhere and has no mass, beside one that is held."""
    held, loose = spring_grid(12, 12, 2), spring_grid(10, 10, 0)
    M = block_diag([held.M, loose.M], format="csc")
    K = block_diag([held.K, loose.K - diags_array(loose.K.sum(axis=1))], format="csc")
    with pytest.raises(SingularPencilError, match="can move together") as caught:
        require_regular(mechss(M, None, K))
    assert caught.value.dofs == tuple(f"q{k}" for k in range(144, 244))


def test_an_empty_equation_is_named() -> None:
    """Exactly singular: SuperLU has no pivot, in any units that `mechss` takes."""
    for scale in (1e-130, 1.0, 1e130):
        with pytest.raises(SingularPencilError, match="DOFs q1 can move"):
            require_regular(mechss(None, None, csc_array(scale * np.diag([1.0, 0.0, 3.0]))))


def test_a_free_mass_is_no_reason_to_refuse() -> None:
    """Without springs its receptance is ``1 / (m s^2)``, and so with a damper alone."""
    unit = csc_array(np.eye(3))
    require_regular(mechss(unit, None, None))
    require_regular(mechss(None, unit, None))
    require_regular(mechss(unit, unit, None))
    require_regular(mechss(None, unit, unit))


@pytest.mark.parametrize("apart", [1e-8, 2.0**-40])
def test_a_constraint_that_stands_nearly_twice_is_regular(apart: float) -> None:
    """The smallest singular value is below rounding, but no rounding of an entry makes it zero: as for dense models."""
    rows = csc_array(np.array([[1.0, -1.0] + [0.0] * 8, [1.0, -1.0 + apart] + [0.0] * 8]))
    K = block_array([[diags_array(np.full(10, 2.0)), rows.T], [rows, None]], format="csc")
    M = block_diag([diags_array(np.ones(10)), csc_array((2, 2))], format="csc")
    require_regular(mechss(M, None, K))
    require_regular(mechss(M.toarray(), None, K.toarray()))


def test_a_constraint_that_stands_twice_but_for_rounding_is_undecided() -> None:
    """Neither singular nor safe, as for dense models."""
    rows = csc_array(np.array([[1.0, -1.0] + [0.0] * 8, [1.0, -1.0 + 2.0**-50] + [0.0] * 8]))
    K = block_array([[diags_array(np.full(10, 2.0)), rows.T], [rows, None]], format="csc")
    M = block_diag([diags_array(np.ones(10)), csc_array((2, 2))], format="csc")
    with pytest.raises(UncertainRankError, match="cannot be told"):
        require_regular(mechss(M, None, K))


def test_a_beam_of_thousands_of_elements_is_regular() -> None:
    """Its stiffness is singular to rounding, too large for a dense copy, and no column of it depends on others."""
    n = 6000
    places = 2 * np.arange(n)[:, None] + np.arange(4)
    element = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    at = np.repeat(places, 4, axis=1).ravel(), np.tile(places, (1, 4)).ravel()
    K = csc_array(coo_array((np.tile(element.ravel(), n), at), shape=(2 * n + 2, 2 * n + 2)))[2:, 2:]
    M = csc_array(([1.0], ([2 * n - 2], [2 * n - 2])), shape=K.shape)
    require_regular(mechss(M, None, csc_array(K)))
