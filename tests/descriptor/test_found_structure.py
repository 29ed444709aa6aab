"""Structure of a circuit of index 2 with entries over twelve decades, exact and in rounded coordinates."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import mechss, pencil_structure
from halfdof_ctrl.descriptor.found_structure import found_structure
from support.circuits import partial_element_circuit, rotated

SAME = 1e-12  # relative: eigenvalues of one circuit in two sets of coordinates
CELLS = 30


def test_circuit_of_index_two_is_told_exactly() -> None:
    """As many eigenvalues as capacitances and inductances less bare nodes; two blocks of size two for each of these."""
    (E, A), finite = partial_element_circuit(CELLS)
    found = pencil_structure(mechss(None, E, -A))
    assert (found.finite_eigenvalues.size, found.most_finite, found.index) == (finite, finite, 2)
    assert found.is_certain
    assert (found.finite_eigenvalues.real < 0.0).all()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rounded_circuit_keeps_what_was_meant_and_says_what_rounding_made(seed: int) -> None:
    """In rotated coordinates no entry is zero: the stored numbers have full rank, by parts of 1e-16."""
    (E, A), finite = partial_element_circuit(CELLS)
    plain = pencil_structure(mechss(None, E, -A)).finite_eigenvalues
    E, A = rotated((E, A), seed)
    found = pencil_structure(mechss(None, E, -A))
    assert (found.finite_eigenvalues.size, found.index) == (finite, 2)
    assert found.most_finite == len(E)
    assert not found.is_certain
    assert any("an exact model would have at infinity" in words for words in found.uncertainty)
    assert_allclose(np.abs(found.finite_eigenvalues) * 2.0**33, np.abs(plain), rtol=SAME)


def test_no_unknowns_have_no_structure() -> None:
    """Nothing is regular."""
    found = found_structure([np.zeros((0, 0))] * 3)
    assert (found.is_regular, found.values.size, found.blocks) == (True, 0, ())


def test_singular_pencil_is_so_exactly() -> None:
    """The last digit tells: two equal rows are singular, rows that differ by 2^-52 are not, and that is said."""
    none = np.zeros((2, 2))
    assert not found_structure([np.ones((2, 2)), none, none]).is_regular
    nearly = found_structure([np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-52]]), none, none])
    assert nearly.is_regular
    assert any("vanish identically, and rounding is" in words for words in nearly.doubts)
