"""Complex numbers in words: one notation, python-control's `j`."""

import pytest

from halfdof_ctrl.base.words import complex_in_words, eigenvalue_in_words


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-2.5, "-2.5000"),
        (0.0, "0.0000"),
        (-1e-17 + 2j, "0.0000 + 2.0000j"),
        (-2j, "0.0000 - 2.0000j"),
        (-1.5e-7, "-1.5000e-07"),
        (2.5e9j, "0.0000e+00 + 2.5000e+09j"),
    ],
)
def test_eigenvalues_are_written_with_four_decimals_or_digits(value: complex, text: str) -> None:
    """Four decimals where they show the size, an exponent where they do not, and no minus zero."""
    assert eigenvalue_in_words(value) == text


@pytest.mark.parametrize(
    ("value", "pair", "text"),
    [
        (-2.5, False, "-2.5"),
        (0j, False, "0"),
        (complex(-0.0, 0.0), False, "0"),
        (17.7059j, False, "17.71j"),
        (-17.7059j, False, "-17.71j"),
        (17.7059j, True, "0 ± 17.71j"),
        (0.618034 - 0.207107j, False, "0.618 - 0.2071j"),
        (-48.41 - 51.66j, True, "-48.41 ± 51.66j"),
        (-3.0, True, "-3"),
    ],
)
def test_numbers_in_messages_have_four_digits(value: complex, pair: bool, text: str) -> None:  # noqa: FBT001
    """Zero parts are left out, but a pair keeps its real part: ± alone would look like a tolerance."""
    assert complex_in_words(value, pair=pair) == text
