"""What a terminal obeys instead of showing it, and how it is written so that it does not."""

import unicodedata

UNPRINTED = ("Cc", "Cf", "Cs", "Zl", "Zp")  #: categories of Unicode that a terminal or a table obeys instead of showing


def printable(text: str) -> str:
    r"""Write control characters other than line ends and tabs as escapes, so that a terminal obeys none of them.

    >>> printable("a\x1b[31m")
    'a\\x1b[31m'
    """
    if text.isprintable():
        return text
    return "".join(
        letter.encode("unicode_escape").decode()
        if letter not in "\n\t" and unicodedata.category(letter) in UNPRINTED
        else letter
        for letter in text
    )
