"""Counts modulo primes against rational arithmetic."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import SecondOrderModel
from halfdof_ctrl.descriptor.exact_counts import exact_counts, normal_rank
from support import exact, rational
from support.anykinds import drawn_models
from support.structures import Structure


def zeros_at_origin(structure: Structure) -> int:
    """Count the roots at zero of det P."""
    coefficients = exact.determinant(*structure.matrices).coeffs()
    return next(power for power, value in enumerate(coefficients) if value != 0)


@given(case=drawn_models())
def test_counts_are_those_of_the_determinant(case: tuple[Structure, SecondOrderModel]) -> None:
    """Regularity, degree, zeros at the origin and index of any pencil."""
    M, C, K = (np.asarray(matrix, dtype=float) for matrix in case[0].matrices)
    counts, order = exact_counts((K, C, M)), exact.order(M, C, K)
    assert counts.is_regular == (order >= 0)
    if order >= 0:
        assert (counts.degree, counts.at_origin) == (order, zeros_at_origin(case[0]))
        assert max(counts.blocks, default=0) == rational.pencil_index(M, C, K)
        assert counts.degree + sum(counts.blocks) == counts.dimension


@given(case=drawn_models(), seed=st.integers(0, 2**32 - 1))
def test_counts_do_not_depend_on_units_that_are_powers_of_two(
    case: tuple[Structure, SecondOrderModel], seed: int
) -> None:
    """There is no threshold that units of 2^+-200 could pass."""
    M, C, K = (np.asarray(matrix, dtype=float) for matrix in case[0].matrices)
    rows, columns = 2.0 ** np.random.default_rng(seed).integers(-200, 201, (2, len(M)))
    plain = exact_counts((K, C, M))
    scaled = exact_counts([rows[:, None] * matrix * columns for matrix in (K, C, M)])
    assert (scaled.rank, scaled.degree, scaled.at_origin, scaled.steps) == (
        plain.rank,
        plain.degree,
        plain.at_origin,
        plain.steps,
    )


def test_last_digits_count() -> None:
    """``M = [1, 1; 1, 1 + 2^-52]`` is nonsingular, however nearly: four eigenvalues, not three or two."""
    M = np.array([[1.0, 1.0], [1.0, 1.0 + 2.0**-52]])
    assert exact_counts((np.eye(2), np.zeros((2, 2)), M)).degree == 4
    assert exact_counts((np.eye(2), np.zeros((2, 2)), np.ones((2, 2)))).degree == 2


def test_complex_coefficients_have_residues() -> None:
    """``[1, j; j, -1]`` is singular, ``[1, j; j, 1]`` is not."""
    none = np.zeros((2, 2))
    assert not exact_counts((np.array([[1.0, 1j], [1j, -1.0]]), none, none)).is_regular
    assert exact_counts((np.array([[1.0, 1j], [1j, 1.0]]), none, none)).is_regular


def test_normal_rank_is_that_at_almost_every_point() -> None:
    """``(s, s^2; 1, s)`` has rank one everywhere, and a row more does not change that of ``(1, s)``."""
    K, C, M = np.array([[0.0, 0], [1, 0]]), np.array([[1.0, 0], [0, 1]]), np.array([[0.0, 1], [0, 0]])
    assert normal_rank((K, C, M)) == 1
    assert normal_rank((K[1:], C[1:], M[1:])) == 1
