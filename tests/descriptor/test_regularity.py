"""Singular pencils of sparse models are found by the oracle, and only those."""

import numpy as np
import pytest
from hypothesis import given
from scipy.sparse import block_diag, csc_array, diags_array

from halfdof_ctrl import mechss
from halfdof_ctrl.base.errors import SingularPencilError
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
