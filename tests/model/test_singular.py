"""Null spaces of singular pencils, and the words for their causes."""

import numpy as np
import numpy.typing as npt
from hypothesis import assume, given
from hypothesis import strategies as st

from halfdof_ctrl.model.singular import NullSpaces, causes, null_spaces
from support import exact

SEEDS = st.integers(0, 2**32 - 1)


def supports(found: NullSpaces) -> tuple[list[int], list[int]]:
    """Give the equations and unknowns that take part."""
    equations, unknowns = (sorted(frozenset[int]().union(*groups)) for groups in (found.equations, found.unknowns))
    return equations, unknowns


def at_seven(P: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Evaluate ``P_0 + P_1 s + P_2 s^2``."""
    return np.asarray(P[0] + 7 * P[1] + 49 * P[2], dtype=float)


def test_null_spaces_name_equations_and_unknowns_apart() -> None:
    """Equations 0 and 1 are one and the same; unknown 2 stands in none of them, 3 follows it no more than it must."""
    M, K = np.zeros((4, 4)), np.zeros((4, 4))
    M[0, 0] = M[1, 0] = 1.0
    K[0, 1] = K[1, 1] = 2.0
    K[2, 0], K[3, 1], K[3, 3], K[2, 1] = 1.0, 1.0, 5.0, 4.0
    found = null_spaces(K + 3.0 * M)
    assert supports(found) == ([0, 1], [2])
    told = causes(found, (K, np.zeros((4, 4)), M), "abcd")
    assert [(cause.kind, cause.names) for cause in told] == [("unused", ("c",)), ("identical", ("a", "b"))]


@given(seed=SEEDS, size=st.integers(2, 5))
def test_free_unknowns_are_those_of_the_exact_null_space(seed: int, size: int) -> None:
    """The unknowns with an entry in the rational null vectors of P(s) at a generic point; likewise the equations."""
    generator = np.random.default_rng(seed)
    factor = generator.integers(-2, 3, (3, size, size - 1)) * (generator.random((3, size, size - 1)) < 0.6)
    P = factor @ (generator.integers(-2, 3, (size - 1, size)) * (generator.random((size - 1, size)) < 0.6))
    value = at_seven(P)
    assume(value.any())
    for found, matrix in zip(supports(null_spaces(value)), (value.T, value), strict=True):
        basis = exact.null_space(exact.rational_matrix(matrix))
        assert found == [i for i in range(size) if any(basis[i, k] != 0 for k in range(basis.ncols()))]
