"""The digits that the numbers of a file carry, in words."""

SINGLE_ROUNDING = 2.0**-24  #: rounding of four-byte numbers
SLACK = 0.2  #: by which a rounding may exceed half a unit of the last digit


def digits_in_words(rounding: float) -> str:
    """Name a relative rounding by the digits that have it.

    >>> digits_in_words(5e-10), digits_in_words(SINGLE_ROUNDING)
    ('10 digits', 'single precision')
    """
    if rounding == SINGLE_ROUNDING:
        return "single precision"
    count = 1
    while 0.5 * 10.0 ** (1 - count) > rounding * (1.0 + SLACK):
        count += 1
    return f"{count} digits"
