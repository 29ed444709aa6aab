"""Linear algebra modulo a prime against python-flint and against exact integers."""

import flint
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from halfdof_ctrl.descriptor.residues import (
    PRIMES,
    characteristic,
    common_divisor,
    multiplicity,
    product,
    rank,
    reduced,
    residues,
)

P = PRIMES[0]


def drawn(seed: int, rows: int, columns: int, p: int = P) -> np.ndarray:
    """Draw residues."""
    return np.random.default_rng(seed).integers(0, p, (rows, columns))


def in_flint(matrix: np.ndarray) -> flint.nmod_mat:
    """Hand a matrix of residues to flint."""
    rows, columns = matrix.shape
    return flint.nmod_mat(rows, columns, [int(entry) for entry in matrix.ravel()], P)


@pytest.mark.parametrize("p", PRIMES)
def test_moduli_are_primes_with_a_root_of_minus_one(p: int) -> None:
    """The residue of j squared is -1."""
    assert flint.fmpz(p).is_prime()
    assert p % 4 == 1
    unit = residues(np.array([[1j]]), p)
    assert_array_equal(product(unit, unit, p), [[p - 1]])


@given(value=st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=True))
def test_residue_of_a_double_is_that_of_its_fraction(value: float) -> None:
    """Numerator times the inverse of the denominator."""
    top, bottom = value.as_integer_ratio()
    assert int(residues(np.array([[value]]), P)[0, 0]) == top * pow(bottom, -1, P) % P


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 70), k=st.integers(0, 40))
def test_products_are_exact(seed: int, n: int, k: int) -> None:
    """Against integers of any size."""
    left, right = drawn(seed, n, k), drawn(seed + 1, k, 5)
    assert_array_equal(product(left, right, P), (left.astype(object) @ right.astype(object)) % P)


@given(seed=st.integers(0, 2**32 - 1), r=st.integers(0, 60))
def test_echelon_form_spans_the_rows(seed: int, r: int) -> None:
    """A product of rank r, beyond one panel of columns, is its pivot columns times its echelon form."""
    matrix = product(drawn(seed, 75, r), drawn(seed + 1, r, 90), P)
    rows, places = reduced(matrix, P)
    assert places.size == rank(matrix, P) == in_flint(matrix).rank() == r
    assert_array_equal(product(matrix[:, places], rows, P), matrix)
    assert_array_equal(rows[:, places], np.eye(r, dtype=np.int64))


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 12), zeros=st.integers(0, 3))
def test_characteristic_polynomial_is_that_of_flint(seed: int, n: int, zeros: int) -> None:
    """With columns of zeros, which give a Hessenberg form zeros below its diagonal."""
    matrix = drawn(seed, n, n)
    matrix[:, :zeros] = 0
    desired = [int(coefficient) for coefficient in in_flint(matrix).charpoly().coeffs()][::-1] if n else [1]
    assert characteristic(matrix, P).tolist() == desired


@given(common=st.lists(st.integers(1, 9), max_size=4), first=st.integers(10, 99), second=st.integers(100, 999))
def test_common_divisor_has_the_common_roots(common: list[int], first: int, second: int) -> None:
    """``prod (x - root)`` with one root more in each."""

    def polynomial(roots: list[int]) -> np.ndarray:
        return np.round(np.poly(roots)).astype(np.int64) % P if roots else np.array([1], dtype=np.int64)

    found = common_divisor(polynomial([*common, first]), polynomial([*common, second]), P)
    assert_array_equal(found, polynomial(common))
    assert all(multiplicity(found, root, P) == common.count(root) for root in set(common))
