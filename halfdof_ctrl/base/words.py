"""Complex numbers as a person reads them, in one notation: `j` as python-control writes it, a conjugate pair as ±."""

from collections.abc import Callable

FIXED = (1e-2, 1e6)  #: sizes that four decimals show well
NOTHING = 1e-13  #: of the size: a part below this is rounding, and written as zero


def complex_in_words(value: complex, *, pair: bool = False) -> str:
    """Write a complex number with four digits, a conjugate pair as one; a part that is zero is left out.

    >>> complex_in_words(0.6 - 0.2j), complex_in_words(17.7059j), complex_in_words(-3 + 0j)
    ('0.6 - 0.2j', '17.71j', '-3')
    >>> complex_in_words(-0.5 + 2j, pair=True)
    '-0.5 ± 2j'
    """
    if value.real == 0.0 and value.imag != 0.0 and not pair:
        return f"{value.imag:.4g}j"
    return _written(value, lambda part: f"{part:.4g}", pair=pair)


def eigenvalue_in_words(value: complex, *, pair: bool = False) -> str:
    """Write an eigenvalue with four decimals, so that those below each other can be compared, each part for itself.

    >>> eigenvalue_in_words(-0.5 + 2j, pair=True)
    '-0.5000 ± 2.0000j'
    >>> eigenvalue_in_words(-1.5e-5 + 200j, pair=True)
    '-1.5000e-05 ± 200.0000j'
    """

    def number(part: float) -> str:
        shown = part if abs(part) > NOTHING * abs(value) else 0.0
        size = abs(shown or value)  # a zero is written like the part beside it
        kind = "f" if FIXED[0] <= size < FIXED[1] or size == 0.0 else "e"
        return f"{shown:.4{kind}}"

    return _written(value, number, pair=pair)


def _written(value: complex, number: Callable[[float], str], *, pair: bool) -> str:
    """Put the parts together: the one place where a complex number becomes text."""
    real = _without_minus_zero(number(value.real))
    if value.imag == 0.0:
        return real
    sign = "±" if pair else "-" if value.imag < 0.0 else "+"
    return f"{real} {sign} {number(abs(value.imag))}j"


def _without_minus_zero(text: str) -> str:
    return text[1:] if text.startswith("-") and float(text) == 0.0 else text
