"""Row operations without rounding: exact where the numbers are, honest where they are not."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.reduction.algebra.integers import as_floats
from halfdof_ctrl.reduction.deflation import exact_solution
from halfdof_ctrl.reduction.deflation.exact_rows import ExactRows
from halfdof_ctrl.reduction.deflation.exact_solution import solved_without_rounding
from halfdof_ctrl.reduction.deflation.realization import realized
from halfdof_ctrl.reduction.deflation.relaxation import relaxed
from halfdof_ctrl.reduction.deflation.row_system import Caution
from support import exact
from support.anykinds import mixed
from support.row_systems import SEEDS, USUAL, drawn, rational_coefficients, system_of

ROUNDOFF = 1e-12  # a few operations on small well-conditioned matrices


def exactly_relaxed(P: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> tuple[ExactRows, int]:
    """Relax coefficients and give the rows and the degree that they show, -1 for a singular pencil."""
    result = relaxed(ExactRows.of(system_of(P)), USUAL)
    assert isinstance(result.system, ExactRows)
    return result.system, -1 if result.offsets is None else result.offsets.degree_bound


@given(seed=SEEDS, size=st.integers(2, 5))
def test_degree_is_that_of_the_exact_determinant(seed: int, size: int) -> None:
    """The bound of the relaxed rows is ``deg det P``; integer data are never in doubt."""
    P = drawn(seed, size)
    rows, degree = exactly_relaxed(P)
    desired = exact.order(P[2], P[1], P[0])
    assert degree == (desired if desired >= 0 else -1)
    assert rows.exact


@given(seed=SEEDS, size=st.integers(2, 5))
def test_rows_are_the_given_ones_times_their_operations(seed: int, size: int) -> None:
    """Equation (21): ``L(s) [P B]_given(s)`` gives the coefficients, which are the integers over powers of two."""
    rows, _ = exactly_relaxed(drawn(seed, size))
    product = np.zeros((len(rows.operations) + len(rows.given) - 1, *rows.given.shape[1:]))
    for k, weights in enumerate(rows.operations):
        product[k : k + len(rows.given)] += weights @ rows.given
    length = len(rows.coefficients)
    scale = np.abs(product).max()
    assert_allclose(product[:length], rows.coefficients, atol=ROUNDOFF * scale)
    assert_allclose(product[length:], 0.0, atol=ROUNDOFF * scale)
    for i, power in enumerate(rows.powers):
        integers = rows.integers[:, i]
        image = as_floats(integers << max(-power, 0), 1 << max(power, 0))
        assert_array_equal(image, rows.coefficients[:, i])


@given(seed=SEEDS, size=st.integers(2, 4))
def test_determinant_changes_by_a_factor_only(seed: int, size: int) -> None:
    """Row operations are unimodular: the coefficients of the determinants are proportional."""
    P = drawn(seed, size)
    assume(exact.order(P[2], P[1], P[0]) >= 0)
    rows, _ = exactly_relaxed(P)
    before, after = (
        np.array(rational_coefficients(matrix), dtype=float) for matrix in (system_of(P).matrix, rows.matrix)
    )
    assert_allclose(after[: len(before)] / after[len(before) - 1], before / before[-1], rtol=1e-9)
    assert_allclose(after[len(before) :] / after[len(before) - 1], 0.0, atol=1e-9)


def test_decimal_numbers_are_told_to_cancel() -> None:
    """0.1 + 0.2 is not 0.3 in binary, but a constraint that says so stands twice: what is left is rounding, (22)."""
    P = np.zeros((3, 4, 4))
    P[2, :2, :2] = np.eye(2)
    P[0, 2, :2], P[0, 3, :2] = (0.1 + 0.2, 0.7), (0.3, 0.7)
    P[0, :2, 2:] = P[0, 2:, :2].T
    rows, degree = exactly_relaxed(P)
    assert degree == -1
    assert not rows.exact


def test_numbers_as_given_keep_what_rounding_may_have_left() -> None:
    """With no caution at all the last digit decides: one constraint more, and no state is left."""
    P = np.zeros((3, 4, 4))
    P[2, :2, :2] = np.eye(2)
    P[0, 2, :2], P[0, 3, :2] = (0.3, 0.7), (0.3 + 2.0**-53, 0.7)
    P[0, :2, 2:] = P[0, 2:, :2].T
    result = relaxed(ExactRows.of(system_of(P)), Caution(0.0, 0.0), tol=0.0)
    assert result.offsets is not None
    assert result.offsets.degree_bound == 0


def test_long_numbers_are_rounded_to_a_bounded_length() -> None:
    """Decimal entries of a dense pencil of high index: integers stay short enough to go on with."""
    generator = np.random.default_rng(5)
    structure = mixed(np.random.default_rng(12), 12)
    factors = generator.random((2, 12)) + 0.5
    P = np.stack([matrix * factors[0][:, None] * factors[1] for matrix in structure.matrices[::-1]])
    rows, _ = exactly_relaxed(P)
    assert max(int(value).bit_length() for value in rows.integers.ravel()) <= 320
    assert not rows.exact


def test_systems_too_large_for_fractions_keep_floating_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the effort that is worth it the realization comes back as it was."""
    P = drawn(3, 4)
    result = relaxed(ExactRows.of(system_of(P)), USUAL)
    assert result.offsets is not None
    assert isinstance(result.system, ExactRows)
    realization = realized(result.system, result.offsets, USUAL)
    exactly = solved_without_rounding(realization, result.system)
    assert_allclose(exactly.equations.A, realization.equations.A, atol=1e-9)
    monkeypatch.setattr(exact_solution, "LARGEST_EFFORT", 0.0)
    assert solved_without_rounding(realization, result.system) is realization


@given(seed=SEEDS, size=st.integers(1, 8))
def test_long_denominators_are_rounded_without_harm(seed: int, size: int) -> None:
    """Fractions cut to 200 bits after every level give the same A to rounding as those kept whole."""
    structure = mixed(np.random.default_rng(seed), size)
    P = np.stack(structure.matrices[::-1]).astype(float)
    result = relaxed(ExactRows.of(system_of(P)), USUAL)
    assume(result.offsets is not None)
    assert result.offsets is not None
    assert isinstance(result.system, ExactRows)
    realization = realized(result.system, result.offsets, USUAL)
    whole = solved_without_rounding(realization, result.system).equations
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exact_solution, "LONGEST_DENOMINATOR", 1)
        cut = solved_without_rounding(realization, result.system).equations
    assert_allclose(cut.A, whole.A, rtol=1e-14, atol=1e-30)
