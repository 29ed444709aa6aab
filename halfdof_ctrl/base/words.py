"""Numbers as a person reads them: eigenvalues, counts and complex numbers in one notation."""

FIXED = (1e-2, 1e6)  #: sizes that four decimals show well


def in_words(s: complex) -> str:
    """Write a complex frequency with four digits."""
    if s.imag == 0.0:
        return f"{s.real:.4g}"
    return f"{s.real:.4g}{s.imag:+.4g}j" if s.real != 0.0 else f"{s.imag:.4g}j"


def eigenvalue_in_words(value: complex, *, pair: bool = False) -> str:
    """Write an eigenvalue with four decimals, a conjugate pair as one.

    >>> eigenvalue_in_words(-0.5 + 2j, pair=True)
    '-0.5000 ± 2.0000i'
    """
    kind = "f" if FIXED[0] <= abs(value) < FIXED[1] or value == 0 else "e"
    real = _without_minus_zero(f"{value.real:.4{kind}}")
    if value.imag == 0.0:
        return real
    sign = "±" if pair else "+-"[value.imag < 0.0]
    return f"{real} {sign} {abs(value.imag):.4{kind}}i"


def _without_minus_zero(text: str) -> str:
    return text[1:] if text.startswith("-") and float(text) == 0.0 else text
