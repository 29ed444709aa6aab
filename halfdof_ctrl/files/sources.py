"""Which files make a model, what format each has, and which matrix is mass, damping, stiffness.

The format of a file is told by its content. What a matrix is comes from the user, else from the file's own words
(ANSYS titles, Nastran names), else from the name of the file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.formats import abaqus, dmig, harwell_boeing, matrix_market, output4
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix
from halfdof_ctrl.files.formats.text_blocks import is_cut_short
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.files.roles import nastran_letter, role_of, siblings, with_labels

ENDINGS = (".mtx", ".mm", ".matrix", ".hb", ".rsa", ".rua", ".op4", ".pch", ".dmig", ".mapping")  #: in a folder
NO_LAST_LINE_END = "does not end with a line end: its last number may be cut short"
FEM_MATRICES = ("M", "C", "K", "S")  #: S: structural damping, the imaginary part of K
SIGNALS = ("B", "F", "G", "H")  #: that a file of that very name may hold


@dataclass(frozen=True, slots=True)
class Source:
    """A matrix and where it stands."""

    path: Path
    letter: str | None  #: what it is, None if nothing says so
    raw: RawMatrix

    @property
    def words(self) -> str:
        """The file, and the name of the matrix in it if the file may hold several."""
        return f"{self.path.name}: {self.raw.title}" if self.raw.format.startswith("Nastran") else self.path.name


@dataclass(frozen=True, slots=True)
class Sources:
    """What stands in the files of a model."""

    files: tuple[Path, ...]
    matrices: Mapping[str, Source]  #: by letter
    unused: tuple[Source, ...]
    labels: Mapping[Path, tuple[str, ...]]  #: names of rows, by the file that tells them


def find_sources(given: Sequence[Path] | Mapping[str, Path], titles: Mapping[str, str]) -> Sources:
    """Read all matrices of a model.

    Parameters
    ----------
    given : sequence of Path or mapping from letter to Path
        A single folder; a single file, whose siblings are looked for; several files; or a file for each letter.
    titles : mapping from letter to str
        Names of the matrices to take from files that hold several.

    Raises
    ------
    FileFormatError
        A file of no known kind or damaged, no matrix at all, two matrices for one letter, an unknown letter or title.
    OSError
        A file is not there or cannot be read.
    """
    told = dict(given) if isinstance(given, Mapping) else {}
    unknown = [letter for letter in (*told, *titles) if letter not in FEM_MATRICES]
    if unknown:
        msg = f"{listed(unknown)} is no matrix of a model. Known: M, C, K and S (structural damping)."
        raise FileFormatError(msg, path="")
    files = with_labels(list(dict.fromkeys(told.values()))) if told else _all_files([Path(path) for path in given])
    sources: list[Source] = []
    labels: dict[Path, tuple[str, ...]] = {}
    for path in files:
        with naming_the_file(path):
            found = _read(path)
        if isinstance(found, tuple):
            labels[path] = found
        else:
            sources += [Source(path, _letter(path, raw), raw) for raw in found]
    chosen = _chosen(sources, told, titles)
    taken = {id(source) for source in chosen.values()}
    unused = tuple(source for source in sources if id(source) not in taken)
    if not chosen:
        what = f"it holds {listed([source.words for source in unused])}" if unused else "it holds names of DOFs only"
        where = listed([str(path) for path in files])
        msg = f"{where}: nothing says which matrix is M, C or K ({what}). Pass {{'K': path, 'M': path}}."
        raise FileFormatError(msg, path=str(files[0]))
    return Sources(tuple(files), chosen, unused, labels)


def _all_files(given: list[Path]) -> list[Path]:
    """Resolve a folder, or add the siblings of a single file, and the files with labels."""
    if len(given) == 1 and given[0].is_dir():
        files = [path for path in sorted(given[0].iterdir()) if path.suffix.lower() in ENDINGS and path.is_file()]
        if not files:
            msg = f"{given[0]}: this folder holds no file that ends in {', '.join(ENDINGS)}."
            raise FileFormatError(msg, path=str(given[0]))
        return files
    for path in given:
        if path.exists() and not path.is_file():
            msg = f"{path}: this is no file. Give a folder alone, or files."
            raise FileFormatError(msg, path=str(path))
    return with_labels([*given, *(siblings(given[0]) if len(given) == 1 else [])])


def _read(path: Path) -> list[RawMatrix] | tuple[str, ...]:  # noqa: PLR0911  # one return a format
    """Read the matrices of a file, or the names of rows, by what its content is."""
    content = path.read_bytes()
    if is_cut_short(content):
        msg = "the last number has fewer digits than those before it. The file is cut short: write or copy it anew."
        raise FileFormatError(msg, path="")
    doubts = () if content.endswith((b"\n", b"\r")) else (NO_LAST_LINE_END,)
    if matrix_market.is_matrix_market(content):
        return [replace(matrix_market.read_matrix_market(content), doubts=doubts)]
    if path.suffix.lower() == ".mapping":
        return harwell_boeing.read_mapping(content)
    if harwell_boeing.is_harwell_boeing(content):
        return [replace(harwell_boeing.read_harwell_boeing(content), doubts=doubts)]
    if output4.is_binary_output4(content) or output4.is_text_output4(content) or path.suffix.lower() == ".op4":
        return output4.read_output4(content)
    if abaqus.data_columns(content):
        return [replace(abaqus.read_abaqus(content), doubts=doubts)]
    if dmig.has_dmig(content):
        return [replace(raw, doubts=doubts) for raw in dmig.read_dmig(content)]
    if dmig.has_extrn(content):
        return dmig.read_extrn(content)
    msg = (
        f"the ending {path.suffix or '(none)'} names no format for this. Use .npz, .mat, or what Abaqus (*MATRIX "
        "OUTPUT), ANSYS (HBMAT, ASCII) or Nastran (OUTPUT4, DMIG) writes, or Matrix Market. The file is none of these, "
        "or damaged at its start."
    )
    raise FileFormatError(msg, path="")


def _letter(path: Path, raw: RawMatrix) -> str | None:
    """Tell what a matrix is by the file's own words, then by the file's name."""
    if raw.format.startswith("Nastran"):
        return nastran_letter(raw.title)
    if raw.letter is not None:
        return raw.letter
    role = role_of(path)
    return None if role is None else role.letter


def _chosen(sources: Sequence[Source], told: Mapping[str, Path], titles: Mapping[str, str]) -> dict[str, Source]:
    """Find the one matrix for each letter."""
    chosen = {}
    for letter in FEM_MATRICES:
        candidates = _candidates(letter, sources, told, titles)
        if len(candidates) > 1:
            found = listed([source.words for source in candidates])
            msg = (
                f"{candidates[0].path}: more than one matrix could be {letter}: {found}. Pass "
                f"{{{letter!r}: path}}, or matrices={{{letter!r}: name}} for files with several."
            )
            raise FileFormatError(msg, path=str(candidates[0].path))
        if candidates:
            chosen[letter] = candidates[0]
    return chosen


def _candidates(
    letter: str, sources: Sequence[Source], told: Mapping[str, Path], titles: Mapping[str, str]
) -> list[Source]:
    """Return the matrices that a letter may stand for, by the user's word or by their own."""
    own = [source for source in sources if letter not in told or source.path == told[letter]]
    if letter in titles:
        found = [source for source in own if source.raw.title.lower() == titles[letter].lower()]
        if not found:
            path = str(told.get(letter, sources[0].path if sources else ""))
            known = listed([source.words for source in own]) or "none"
            msg = f"{path}: no matrix {titles[letter]!r} for {letter}. Known: {known}."
            raise FileFormatError(msg, path=path)
        return found
    if letter in told:
        if len(own) == 1 and list(told.values()).count(told[letter]) == 1:
            return own
        found = [source for source in own if source.letter == letter and not _is_placeholder(source)]
        if not found:
            msg = f"{told[letter]}: nothing in it is known to be {letter}: {listed([part.words for part in own])}."
            raise FileFormatError(msg, path=str(told[letter]))
        return found
    claimed = set(told.values())
    return [
        source
        for source in own
        if source.letter == letter and not _is_placeholder(source) and source.path not in claimed
    ]


def _is_placeholder(source: Source) -> bool:
    """Return whether it is the 1 x 1 matrix of zero that Nastran writes for a matrix that there is not."""
    return source.raw.format.startswith("Nastran") and source.raw.matrix.shape == (1, 1) and not source.raw.matrix.nnz
