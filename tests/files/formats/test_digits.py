"""Claims about digits: what formats of programs leave unknown, and what is exact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csc_array

from halfdof_ctrl import mechss
from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.base.definiteness import inertia
from halfdof_ctrl.base.digits import digits_in_words
from halfdof_ctrl.files.formats.digits import digits_of, known_to


@pytest.mark.parametrize("digits", range(6, 16))
@given(seed=st.integers(0, 1000))
def test_the_digits_of_random_numbers_are_found(digits: int, seed: int) -> None:
    """In fixed and in short notation, as C and Fortran write them."""
    numbers = np.random.default_rng(seed).standard_normal(40).tolist()
    for text in ("\n".join([f"{x:.{digits - 1}e}" for x in numbers]), " ".join([f"{x:.{digits}g}" for x in numbers])):
        assert digits_of(text.encode()) == digits
        assert digits_of(text.upper().replace("E", "D").encode()) == digits


def test_numbers_that_are_short_are_exact() -> None:
    """A stiffness typed in, whole numbers, round numbers in a long format."""
    for text in (b"50 -20 0.5", b"8.4e+08 3.2256e+07 4.032e+06 672000", b"1.000000000D+00 2.500000000D+00", b""):
        assert known_to(text) == EPS


def test_the_rounding_of_a_file_is_half_a_unit_of_its_last_digit() -> None:
    """Against the errors themselves: no entry is farther off."""
    numbers = np.random.default_rng(1).standard_normal(1000)
    text = "\n".join([f"{x:.9e}" for x in numbers])
    errors = np.abs(np.array([float(line) for line in text.split()]) / numbers - 1.0)
    assert errors.max() <= known_to(text.encode()) == 5e-10
    assert digits_in_words(5e-10) == "10 digits"


def test_rigid_body_motions_survive_the_rounding_of_a_file() -> None:
    """A free beam whose stiffness has ten digits has two eigenvalues within the rounding, of either sign."""
    element = np.array(
        [[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]]
    )
    stiffness = np.zeros((22, 22))
    for k in range(10):
        stiffness[2 * k : 2 * k + 4, 2 * k : 2 * k + 4] += element * np.pi
    rounded = csc_array(np.array([[float(f"{x:.9e}") for x in row] for row in stiffness]))
    assert inertia(rounded).zero < 2
    found = inertia(rounded, known_to=5e-10)
    assert (found.positive, found.negative, found.zero) == (20, 0, 2)


def test_the_model_keeps_what_its_entries_are_known_to() -> None:
    """Through selection and prescribed motion."""
    from dataclasses import replace  # noqa: PLC0415

    model = replace(mechss(np.eye(2), None, 2 * np.eye(2), dofs=["a", "b"]), known_to=5e-10)
    assert model.select("F_a", "b").known_to == model.prescribe_motion("a").known_to == 5e-10
    assert "known to 5e-10" in repr(model)


def test_a_number_without_an_end_is_looked_at_once() -> None:
    """Not from each of its digits on, which takes minutes."""
    assert digits_of(b"1" * 2**17) is None
    assert digits_of(b"3.14159 2.71828 1.41421 " + b"7" * 2**16) == 6
