"""What a file or a matrix is, by its name: mass, damping, stiffness; and the files that belong to it.

| written by | names |
|---|---|
| Abaqus | ``job_STIF1``, ``job_MASS1``, ``job_DMPV1``, ``job_DMPS1`` (structural damping) |
| Nastran | ``kaax``, ``maax``, ``baax``, ``k4aax`` and the like for other sets |
| CalculiX | ``job.sti``, ``job.mas`` |
| by hand | ``K``, ``M``, ``C``, ``stiffness``, ``mass``, ``damping``, alone or at the end or start of a name |
| by hand | the same as a word of its own in capitals and small letters: ``KMatrixTMD``, ``rotorDiscSTIF1`` |
| Harwell-Boeing collection | ``bcsstk01``, ``bcsstm01`` |

Files whose names differ in that word alone belong together, wherever in the name it stands: of ``beamstiffness`` and
``beammass`` neither would say anything by itself.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from halfdof_ctrl.files.formats import calculix

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
LONG_WORDS = tuple(word for word in sorted(ROLE_WORDS, key=len, reverse=True) if len(word) > 1)
LABEL_FILE = {
    ".op4": ".pch",
    ".sti": ".dof",
    ".mas": ".dof",
}  #: ending of the file with names of rows; else .mapping
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
    >>> role_of(Path("KMatrixTMD.mtx")).letter, role_of(Path("beam.mas")).letter
    ('K', 'M')
    """
    return next(_plain_roles(path), None)


def roles_in(files: Iterable[Path]) -> dict[Path, FileRole]:
    """Read the roles of files from their names together: what several names allow is what makes most of them siblings.

    >>> found = roles_in([Path("beamstiffness.txt"), Path("beammass.txt")])
    >>> [role.letter for role in found.values()]
    ['K', 'M']
    """
    files = list(files)
    candidates = {path: [*_plain_roles(path), *_loose_roles(path)] for path in files}
    letters: dict[tuple[str, ...], set[str]] = {}
    for path, roles in candidates.items():
        for role in roles:
            letters.setdefault((str(path.parent), *role.family), set()).add(role.letter)
    found = {}
    for path, roles in candidates.items():
        sizes = [len(letters[(str(path.parent), *role.family)]) for role in roles]
        plain = role_of(path)
        if roles and max(sizes) > 1:
            found[path] = roles[sizes.index(max(sizes))]
        elif plain is not None:
            found[path] = plain
    return found


def _plain_roles(path: Path) -> Iterator[FileRole]:
    """Return what a name says by itself."""
    if path.suffix.lower() in calculix.KIND_BY_ENDING:
        yield FileRole(calculix.KIND_BY_ENDING[path.suffix.lower()], (path.stem.lower(), ""))
    for pattern in PATTERNS:
        match = pattern.fullmatch(path.stem)
        if match is not None:
            yield FileRole(ROLE_WORDS[match["word"].lower()], (match["before"].lower(), match["after"].lower()))
            break
    name = path.stem
    for start, word in _words_in(name):
        stop = start + len(word)
        before, after = name[:start], name[stop:]
        capital = word[0].isupper()
        begins = not before[-1:].isalpha() or (capital and before[-1:].islower())
        ends = not after[:1].isalpha() or (after[:1].isupper() and (len(word) > 1 or after[1:2].islower()))
        if begins and ends and (len(word) > 1 or capital):
            yield FileRole(ROLE_WORDS[word.lower()], (before.lower(), after.lower()))


def _loose_roles(path: Path) -> Iterator[FileRole]:
    """Return what a name says only beside a sibling: a word within others."""
    for start, word in _words_in(path.stem):
        if len(word) > 1:
            before, after = path.stem[:start], path.stem[start + len(word) :]
            yield FileRole(ROLE_WORDS[word.lower()], (before.lower(), after.lower()))


def _words_in(name: str) -> Iterator[tuple[int, str]]:
    """Return the places of words for matrices in a name, long ones first."""
    lower = name.lower()
    for word in (*LONG_WORDS, "k", "m", "c"):
        for match in re.finditer(word, lower):
            yield match.start(), name[match.start() : match.end()]


def siblings(path: Path) -> list[Path]:
    """Find the files beside it that hold the other matrices of the same model, by their names."""
    if not path.is_file() or not [*_plain_roles(path), *_loose_roles(path)]:
        return []
    endings = set(calculix.KIND_BY_ENDING) if path.suffix.lower() in calculix.KIND_BY_ENDING else {path.suffix.lower()}
    others = [
        other
        for other in sorted(path.parent.iterdir())
        if other.suffix.lower() in endings and other.name != path.name and other.is_file()
    ]
    roles = roles_in([path, *others])
    role = roles.get(path)
    if role is None:
        return []
    return [
        other
        for other in others
        if other in roles and roles[other].family == role.family and roles[other].letter != role.letter
    ]


def with_labels(files: list[Path]) -> list[Path]:
    """Add the files of the same name that tell the names of rows, whatever their capitals."""
    found = dict.fromkeys(files)
    for path in files:
        ending = LABEL_FILE.get(path.suffix.lower(), ".mapping")
        wanted = (path.stem + ending).lower()
        for other in sorted(path.parent.iterdir()) if path.parent.is_dir() else ():
            if other.name.lower() == wanted and other.is_file():
                found[other] = None
    return list(found)


def matrices_of_labels(path: Path) -> list[Path]:
    """Find the files whose rows a file names: OUTPUT4 beside a punch file, the matrices of CalculiX."""
    endings = [ending for ending, labels in LABEL_FILE.items() if labels == path.suffix.lower()]
    wanted = [f"{path.stem}{ending}".lower() for ending in endings]
    if not wanted or not path.parent.is_dir():
        return []
    return [other for other in sorted(path.parent.iterdir()) if other.name.lower() in wanted and other.is_file()]


def families(files: Sequence[Path]) -> list[list[Path]]:
    """Sort the files of a folder into models: siblings together, any other file for itself.

    >>> [[path.name for path in group] for group in families([Path("a_K.mtx"), Path("b_K.mtx"), Path("a_M.mtx")])]
    [['a_K.mtx', 'a_M.mtx'], ['b_K.mtx']]
    """
    roles = roles_in(files)
    groups: dict[tuple[str, ...], list[Path]] = {}
    for path in files:
        key: tuple[str, ...] = (path.suffix.lower() if path.suffix.lower() not in calculix.KIND_BY_ENDING else ".sti",)
        key += roles[path].family if path in roles else ("", path.name, "")
        groups.setdefault(key, []).append(path)
    return list(groups.values())


def nastran_letter(title: str) -> str | None:
    """Read what a matrix of Nastran is from its name.

    >>> nastran_letter("kaax"), nastran_letter("K4GG"), nastran_letter("mug1")
    ('K', 'S', None)
    """
    match = NASTRAN.fullmatch(title)
    return None if match is None else NASTRAN_LETTERS[match["kind"].lower()]
