"""The names nearest to one that is unknown, found among any number of them in a fraction of a second."""

import difflib
from collections.abc import Collection, Sequence

CLOSE = 0.6  #: likeness from which a name is offered in place of an unknown one, as difflib has it
CLOSE_SHORT = 0.5  #: the same for up to three letters, of which a single one may be another
SHORT = 3
MOST_OFFERED = 3  #: names in a message
MOST_COMPARED = 2000  #: names that difflib compares, at some ten microseconds each
MOST_LETTERS = 60  #: of a name whose slips are looked up one by one


def nearest_names(name: str, known: Collection[str]) -> list[str]:
    """Return up to three known names that are like an unknown one, the likest first.

    Of more names than can be compared one by one, those are: names that differ by case alone, by one letter that
    is missing, too many, another or exchanged with its neighbour; then those with the same beginning or end.

    Examples
    --------
    >>> nearest_names("nod_57", ["node_56", "node_57", "base"])
    ['node_57', 'node_56']
    """
    wanted = name[: 2 * MOST_LETTERS]
    if len(known) > MOST_COMPARED:
        known = _candidates(wanted, known)
    folded = _folded(wanted)
    same = [other for other in known if _folded(other) == folded][:MOST_OFFERED]
    near = difflib.get_close_matches(
        wanted, known, n=MOST_OFFERED, cutoff=CLOSE_SHORT if len(wanted) <= SHORT else CLOSE
    )
    return list(dict.fromkeys((*same, *near)))[:MOST_OFFERED]


def _candidates(name: str, known: Collection[str]) -> Sequence[str]:
    """Choose the names of a long list that are worth comparing."""
    lower = name.lower()
    found = [other for other in known if other.lower() == lower]
    if len(name) <= MOST_LETTERS:
        found += sorted(_slips(name, known))
    if len(found) < MOST_OFFERED:
        half = (len(name) + 1) // 2
        start, end = name[:half], name[-half:]
        like = [other for other in known if other.startswith(start) or other.endswith(end)]
        like.sort(key=lambda other: abs(len(other) - len(name)))
        found += like[: MOST_COMPARED // 2]
    return list(dict.fromkeys(found))[:MOST_COMPARED]


def _slips(name: str, known: Collection[str]) -> set[str]:
    """Return the known names that are one slip of the keyboard away."""
    letters = set(name).union(*list(known)[:MOST_COMPARED], *list(known)[-MOST_COMPARED:])
    cuts = [(name[:place], name[place:]) for place in range(len(name) + 1)]
    slips = {before + after[1:] for before, after in cuts if after}
    slips |= {before + after[1] + after[0] + after[2:] for before, after in cuts if len(after) > 1}
    slips |= {before + letter + after[1:] for before, after in cuts if after for letter in letters}
    slips |= {before + letter + after for before, after in cuts for letter in letters}
    return slips.intersection(known)


def _folded(name: str) -> str:
    """Write a name without what people take for one another: case, blanks, dots and lines."""
    return name.casefold().translate({ord(letter): None for letter in " ._-:"})
