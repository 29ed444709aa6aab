r"""How many digits the numbers of a text carry, and what that says of the matrices.

A punch file has ten digits, CalculiX writes fourteen, ``%.6g`` six: each entry is known to half a unit of its last
digit. A file in which hardly any number uses as many digits as the longest one was written exactly, as
``3.2256e+07``.
"""

import re

from halfdof_ctrl.base.arrays import EPS

SAMPLE = 2**16  #: bytes at the start and at the end that are looked at; a file has one format
NUMBER = re.compile(rb"((?<!\d)\d+\.\d*|\.\d+)(?:[EeDdQq][+-]?\d+|[+-]\d{2,3})?|(?<!\d)(\d+)[EeDdQq][+-]?\d+")
FULL_DIGITS = 16  #: digits from which numbers are as good as float64
DIGITS_SURE = 6  #: digits from which few numbers of full length tell a format
DIGITS_FEW, SHARE = 2, 0.2  #: numbers of full length, and their share, that it takes then
FEWEST_DIGITS = 4  #: digits of the shortest format that is believed,
MANY, MOST = 8, 0.5  #: and numbers of full length, and their share, that it takes


def digits_of(content: bytes) -> int | None:
    r"""Tell to how many digits the numbers of a text were rounded, None if they seem to be written exactly.

    Examples
    --------
    >>> digits_of(b"3.14159 2.71828 1.41421 1 0.5"), digits_of(b"1.5 0.25 3"), digits_of(b"1.2340000D+01 5.678D+00")
    (6, None, None)
    """
    sample = content if len(content) <= 2 * SAMPLE else content[:SAMPLE] + b" " + content[-SAMPLE:]
    mantissas = {(real or whole).replace(b".", b"").strip(b"0") for real, whole in NUMBER.findall(sample)}
    lengths = [len(mantissa) for mantissa in mantissas if mantissa]
    longest = max(lengths, default=0)
    full = lengths.count(longest)
    sure = longest >= DIGITS_SURE and full >= max(DIGITS_FEW, SHARE * len(lengths))
    likely = longest >= FEWEST_DIGITS and full >= max(MANY, MOST * len(lengths))
    return longest if (sure or likely) and longest < FULL_DIGITS else None


def known_to(content: bytes) -> float:
    """Return the relative rounding of the numbers of a text: half a unit in the last digit of 1, at least `EPS`."""
    digits = digits_of(content)
    return EPS if digits is None else max(EPS, 0.5 * 10.0 ** (1 - digits))
