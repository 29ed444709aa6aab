"""Degrees of polynomial matrices: how often equations are to be differentiated, against all permutations."""

from itertools import pairwise, permutations, product

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount
from halfdof_ctrl.reduction.deflation.offsets import ABSENT, irreducible_blocks, structural_offsets
from support import exact
from support.mechanisms import blade, derivatives, hanging_chain, rod

BoolArray = npt.NDArray[np.bool_]
SEEDS = st.integers(0, 2**32 - 1)


def coefficients(model: SecondOrderModel) -> npt.NDArray[np.float64]:
    """Give K, C, M."""
    return np.stack(model.quadratics.P)


def drawn(seed: int, size: int, powers: int = 3) -> BoolArray:
    """Draw which coefficients are present, about a third."""
    generator = np.random.default_rng(seed)
    return np.asarray(generator.random((powers, size, size)) < generator.choice([0.2, 0.35, 0.6]))


def degrees(present: BoolArray) -> npt.NDArray[np.int64]:
    """Give the degree of each entry, `ABSENT` for a zero."""
    highest = [np.flatnonzero(entry) for entry in present.reshape(len(present), -1).T]
    return np.array([found[-1] if found.size else ABSENT for found in highest]).reshape(present.shape[1:])


def best_matching(present: BoolArray) -> int:
    """Give the largest sum of degrees over all permutations."""
    degree = degrees(present)
    return max(sum(int(degree[i, j]) for i, j in enumerate(order)) for order in permutations(range(len(degree))))


@pytest.mark.parametrize(
    ("model", "equations", "unknowns"),
    [
        (rod(), [0, 0, 2], [2, 2, 0]),
        (blade(), [0, 0, 1], [2, 2, 0]),
        (hanging_chain(1), [0, 0, 2], [2, 2, 0]),
        (derivatives(3), [4, 2, 0], [4, 2, 0]),
        (derivatives(4), [6, 4, 2, 0], [6, 4, 2, 0]),
        (hydromount(), [0, 0, 0], [2, 1, 1]),
    ],
    ids=["rod", "blade", "pendulum", "three derivatives", "four derivatives", "mount"],
)
def test_mechanisms_have_the_offsets_found_by_hand(
    model: SecondOrderModel, equations: list[int], unknowns: list[int]
) -> None:
    """Constraints of displacements are differentiated twice, of velocities once, chains as often as they are long."""
    found = structural_offsets(coefficients(model) != 0.0)
    assert found is not None
    assert (found.equations.tolist(), found.unknowns.tolist()) == (equations, unknowns)
    assert found.degree_bound == sum(unknowns) - sum(equations)


@given(seed=SEEDS, size=st.integers(1, 5))
def test_bound_is_the_best_permutation(seed: int, size: int) -> None:
    """``sum d_j - sum c_i`` is the largest degree of a term of the determinant; without a term there is None."""
    present = drawn(seed, size)
    found, best = structural_offsets(present), best_matching(present)
    if found is None:
        assert best < 0
    else:
        assert found.degree_bound == best


@given(seed=SEEDS, size=st.integers(1, 7))
def test_offsets_are_tight_along_the_matching(seed: int, size: int) -> None:
    """Equation (15), with equality along a permutation."""
    present = drawn(seed, size)
    found = structural_offsets(present)
    if found is None:
        return
    degree = degrees(present)
    assert found.equations.min() >= 0
    assert (degree <= found.unknowns - found.equations[:, None]).all()
    assert sorted(found.matching) == list(range(size))
    matched = degree[np.arange(size), found.matching]
    assert_array_equal(matched, found.unknowns[found.matching] - found.equations)


@given(seed=SEEDS, size=st.integers(1, 3))
def test_offsets_are_the_smallest(seed: int, size: int) -> None:
    """No other offsets that satisfy (15) with the same bound have a smaller c_i anywhere."""
    present = drawn(seed, size)
    found = structural_offsets(present)
    if found is None:
        return
    degree = degrees(present)
    for given_c in product(range(int(found.equations.max()) + 2), repeat=size):
        c = np.array(given_c)
        d = (degree + c[:, None]).max(axis=0)
        if d.min() >= 0 and d.sum() - c.sum() == found.degree_bound:
            assert (c >= found.equations).all()


@given(seed=SEEDS, size=st.integers(1, 4))
def test_bound_is_met_if_and_only_if_the_tight_coefficients_are_nonsingular(seed: int, size: int) -> None:
    """``deg det = sum d - sum c`` exactly where ``det J`` does not vanish, in exact arithmetic."""
    generator = np.random.default_rng(seed)
    matrix = generator.integers(-2, 3, (3, size, size)).astype(float) * drawn(seed, size)
    found = structural_offsets(matrix != 0.0)
    degree = int(exact.polynomial_determinant(matrix).degree())
    if found is None:
        assert degree < 0
    else:
        J = exact.rational_matrix(found.tight(matrix))
        assert degree <= found.degree_bound
        assert (degree == found.degree_bound) == (J.det() != 0)


def test_tight_coefficients_of_the_rod() -> None:
    """J of two masses and their rod: accelerations, the force, and the constraint differentiated twice."""
    matrix = coefficients(rod())
    found = structural_offsets(matrix != 0.0)
    assert found is not None
    assert_array_equal(found.tight(matrix), [[2, 0, 1], [0, 1, -1], [1, -1, 0]])


def test_equation_without_an_unknown_of_its_own_has_no_offsets() -> None:
    """Two equations in one unknown leave no permutation."""
    assert structural_offsets(np.array([[[1, 0], [1, 0]]], dtype=bool)) is None
    assert structural_offsets(np.zeros((3, 1, 1), dtype=bool)) is None


@given(seed=SEEDS, sizes=st.lists(st.integers(1, 4), min_size=1, max_size=4))
def test_irreducible_blocks_of_a_shuffled_block_triangle(seed: int, sizes: list[int]) -> None:
    """Full diagonal blocks under any entries above them come back as they were, whatever the order of both sides."""
    generator = np.random.default_rng(seed)
    n, starts = sum(sizes), np.cumsum([0, *sizes])
    pattern = np.triu(generator.random((n, n)) < 0.4)
    for first, stop in pairwise(starts.tolist()):
        pattern[first:stop, first:stop] = True
        pattern[stop:, first:stop] = False
    rows, columns = generator.permutation(n), generator.permutation(n)
    matching = np.argsort(columns)[rows]  # the diagonal, which is a perfect matching
    found = irreducible_blocks(pattern[np.ix_(rows, columns)], matching)
    blocks = {frozenset(rows[block].tolist()) for block in found}
    assert blocks == {frozenset(range(first, stop)) for first, stop in pairwise(starts.tolist())}
