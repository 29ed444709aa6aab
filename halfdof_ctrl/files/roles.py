"""What a file or a matrix is, by its name: mass, damping, stiffness; and the files that belong to it.

| written by | names |
|---|---|
| Abaqus | ``job_STIF1``, ``job_MASS1``, ``job_DMPV1``, ``job_DMPS1`` (structural damping) |
| Nastran | ``kaax``, ``maax``, ``baax``, ``k4aax`` and the like for other sets |
| by hand | ``K``, ``M``, ``C``, ``stiffness``, ``mass``, ``damping``, alone or at the end or start of a name |
| Harwell-Boeing collection | ``bcsstk01``, ``bcsstm01`` |
"""

import re
from dataclasses import dataclass
from pathlib import Path

ROLE_WORDS = {
    "stif": "K", "stiff": "K", "stiffness": "K", "k": "K",
    "mass": "M", "m": "M",
    "dmpv": "C", "damp": "C", "damping": "C", "c": "C",
    "dmps": "S",
}  # fmt: skip
_ANY = "|".join(sorted(ROLE_WORDS, key=len, reverse=True))
PATTERNS = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"(?P<before>.*_)(?P<word>stif|mass|dmpv|dmps)(?P<after>\d+)",
        r"(?P<before>bcsst)(?P<word>[kmc])(?P<after>\d+)",
        rf"(?P<before>|.*[_\-. ])(?P<word>{_ANY})(?P<after>|[_\-. ]?\d+|[_\-. ]?mat(rix)?)",
        rf"(?P<before>)(?P<word>{_ANY})(?P<after>[_\-. ].*)",
    )
)
LABELS = {".op4": ".pch"}  #: ending of the file with the names of rows; .mapping for any other
SETS = "gg|aa|ff|ll|nn|oo|tt|pp|dd|hh|jj|xx"
NASTRAN = re.compile(rf"(?P<kind>k4|k2?|m2?|b2?)({SETS})x?\d*", re.IGNORECASE)
NASTRAN_LETTERS = {"k4": "S", "k": "K", "k2": "K", "m": "M", "m2": "M", "b": "C", "b2": "C"}


@dataclass(frozen=True, slots=True)
class FileRole:
    """What the name of a file says."""

    letter: str  #: M, C, K or S (structural damping)
    family: tuple[str, str]  #: what stands before and after the word that says so


def role_of(path: Path) -> FileRole | None:
    """Read the role of a file from its name, None if it says nothing.

    >>> role_of(Path("job_STIF1.mtx")).letter, role_of(Path("bracket_mass.matrix")).letter, role_of(Path("a.mtx"))
    ('K', 'M', None)
    """
    for pattern in PATTERNS:
        match = pattern.fullmatch(path.stem)
        if match is not None:
            return FileRole(ROLE_WORDS[match["word"].lower()], (match["before"].lower(), match["after"].lower()))
    return None


def siblings(path: Path) -> list[Path]:
    """Find the files beside it that hold the other matrices of the same model, by their names."""
    role = role_of(path)
    if role is None or not path.is_file():
        return []
    found = []
    for other in sorted(path.parent.iterdir()):
        if other.suffix.lower() == path.suffix.lower() and other.name != path.name and other.is_file():
            its = role_of(other)
            if its is not None and its.family == role.family and its.letter != role.letter:
                found.append(other)
    return found


def with_labels(files: list[Path]) -> list[Path]:
    """Add the files of the same name that tell the names of rows, whatever their capitals."""
    found = dict.fromkeys(files)
    for path in files:
        ending = LABELS.get(path.suffix.lower(), ".mapping")
        wanted = (path.stem + ending).lower()
        for other in sorted(path.parent.iterdir()) if path.parent.is_dir() else ():
            if other.name.lower() == wanted and other.is_file():
                found[other] = None
    return list(found)


def nastran_letter(title: str) -> str | None:
    """Read what a matrix of Nastran is from its name.

    >>> nastran_letter("kaax"), nastran_letter("K4GG"), nastran_letter("mug1")
    ('K', 'S', None)
    """
    match = NASTRAN.fullmatch(title)
    return None if match is None else NASTRAN_LETTERS[match["kind"].lower()]
