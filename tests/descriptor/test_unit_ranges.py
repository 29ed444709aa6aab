"""Eigenvalues over more decades than a double has digits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import mechss, pencil_structure

LAST_DIGITS = 1e-13  # relative, each of its own size
WIDEST = 12


@pytest.mark.parametrize("power", [6, WIDEST])
def test_slow_and_fast_eigenvalues_keep_their_digits(power: int) -> None:
    """Two coupled DOFs, weak springs, strong dampers, small masses: ``-k/c`` and ``-c/m``, up to 48 decades apart.

    At 48 decades it hangs on the kernel of the linear algebra whether all are found; where not, that is said.
    """
    small, large = 10.0**-power, 10.0**power
    shape = np.array([[2.0, -1.0], [-1.0, 2.0]])
    structure = pencil_structure(mechss(small * np.eye(2), large * np.eye(2), small * shape))
    slow, fast = small / large, large / small
    if not structure.is_certain:
        assert power == WIDEST
        return
    assert_allclose(
        structure.finite_eigenvalues, [-slow, -3.0 * slow, -fast, -fast], rtol=max(LAST_DIGITS, 4.0 * slow / fast)
    )
