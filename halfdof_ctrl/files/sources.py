"""Which files make a model, what format each has, and which matrix is mass, damping, stiffness.

The format of a file is told by its content. What a matrix is comes from the user, else from the file's own words
(ANSYS titles, Nastran names, names of variables), else from the name of the file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.containers import MATRIX_ENDINGS
from halfdof_ctrl.files.folders import LABEL_ENDINGS, all_files, several_models
from halfdof_ctrl.files.foreign import OCTAVE, foreign_kind
from halfdof_ctrl.files.formats import abaqus, calculix, dmig, harwell_boeing, matrix_market, output4, table
from halfdof_ctrl.files.formats.npy import is_npy, is_npz
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, most_rows
from halfdof_ctrl.files.formats.text_blocks import is_cut_short
from halfdof_ctrl.files.formats.variables import Variable
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.files.roles import FileRole, matrices_of_labels, nastran_letter, roles_in, with_labels
from halfdof_ctrl.files.workspace import SIGNALS, Workspace, listing, read_workspace

NO_LAST_LINE_END = "does not end with a line end: its last number may be cut short"
FEM_MATRICES = ("M", "C", "K", "S")  #: S: structural damping, the imaginary part of K
Titles = Mapping[str, str | None]


@dataclass(frozen=True, slots=True)
class Source:
    """A matrix and where it stands."""

    path: Path
    letter: str | None  #: what it is, None if nothing says so
    raw: RawMatrix
    number: int = 0  #: which of the matrices of that name in the file, from one on; 0 if there is one

    @property
    def name(self) -> str:
        """Its name in the file, with its number if there are several of that name."""
        return f"{self.raw.title}#{self.number}" if self.number else self.raw.title

    @property
    def words(self) -> str:
        """The file, and the name of the matrix in it if the file may hold several."""
        is_plain = not self.raw.named or (self.raw.title == self.letter and not self.number)
        return self.path.name if is_plain else f"{self.path.name}: {self.name}"


@dataclass(frozen=True, slots=True)
class Sources:
    """What stands in the files of a model."""

    files: tuple[Path, ...]
    matrices: Mapping[str, Source]  #: M, C, K, S
    signals: Mapping[str, Source]  #: B, F, G, H, D and their kin
    unused: tuple[Source, ...]
    left: Mapping[Path, tuple[Variable, ...]]  #: variables that were not read, by the file
    labels: Mapping[Path, tuple[str, ...]]  #: names of rows, by the file that tells them
    texts: Mapping[str, Any]  #: names of signals and of the model
    own_layout: bool  #: whether it is one file with all that save_model writes

    @property
    def doubts(self) -> tuple[str, ...]:
        """What may be wrong with signals."""
        return tuple([f"{source.words} {doubt}" for source in self.signals.values() for doubt in source.raw.doubts])

    @property
    def holds(self) -> str:
        """What the files with named variables hold beside what is used, with the argument that says which is which."""
        said = [source for source in self.matrices.values() if source.raw.named]
        shown = [f"{source.name} ({' x '.join(map(str, source.raw.matrix.shape))})" for source in said]
        also = f"besides {listed(shown)} " if shown else ""
        signals = [_as_variable(source.raw) for source in self.signals.values() if source.raw.named]
        every = [*signals, *[variable for variables in self.left.values() for variable in variables]]
        return f"{also}{listing(every, tuple(self.matrices))}" if every else ""


def _as_variable(raw: RawMatrix) -> Variable:
    rows, columns = raw.matrix.shape
    return Variable(name=raw.title, kind="matrix", shape=(rows, columns), read=lambda: raw.matrix)


def find_sources(given: Sequence[Path] | Mapping[str, Path], titles: Titles) -> Sources:
    """Read all matrices of a model.

    Parameters
    ----------
    given : sequence of Path or mapping from letter to Path
        A single folder; a single file, whose siblings are looked for; several files; or a file for each letter.
    titles : mapping from letter to str or None
        Names of the matrices to take from files that hold several, ``maa#2`` for the second of that name; None for
        a matrix that is not to be taken.

    Raises
    ------
    FileFormatError
        A file of no known kind or damaged, no matrix at all, two matrices for one letter, an unknown letter or title.
    OSError
        A file is not there or cannot be read.
    """
    told = dict(given) if isinstance(given, Mapping) else {}
    _require_letters((*told, *titles))
    asked = list(dict.fromkeys(told.values())) if told else [Path(path) for path in given]
    every = asked if told else all_files(asked, with_siblings=True)
    reading = _Reading(titles, told, most_rows(sum(path.stat().st_size for path in every if path.is_file())))
    for path in asked if told else all_files(asked):
        reading.add(path)
    if not told and len(asked) == 1 and not asked[0].is_dir() and not reading.is_whole:
        for path in all_files(asked, with_siblings=True):
            reading.add(path)
    for path in with_labels(list(reading.files)):
        reading.add_labels(path)
    return reading.result() if told else reading.all_of_one([Path(path) for path in given])


def _require_letters(letters: Sequence[str]) -> None:
    unknown = [str(letter) for letter in letters if letter not in (*FEM_MATRICES, *SIGNALS)]
    if unknown:
        msg = (
            f"{listed(unknown)} is no matrix of a model. Known: {', '.join(FEM_MATRICES)} (structural damping) and "
            f"{', '.join(SIGNALS)}."
        )
        raise FileFormatError(msg, path="")


class _Reading:
    """Files that are read one after the other, and what was found in them."""

    def __init__(self, titles: Titles, told: Mapping[str, Path], room: int) -> None:
        self.titles, self.told, self.room = titles, told, room
        self.files: dict[Path, None] = {}
        self.raws: dict[Path, list[RawMatrix]] = {}
        self.labels: dict[Path, tuple[str, ...]] = {}
        self.left: dict[Path, tuple[Variable, ...]] = {}
        self.texts: dict[str, Any] = {}
        self.own_layout = False

    @property
    def is_whole(self) -> bool:
        """Whether the files hold more than one matrix that says what it is, so that no siblings are looked for."""
        raws = [raw for found in self.raws.values() for raw in found]
        return len({raw.letter for raw in raws if raw.named and raw.letter in FEM_MATRICES}) > 1 or any(
            raw.format.startswith("Nastran") for raw in raws
        )

    def add(self, path: Path) -> None:
        """Read a file, once."""
        if path in self.files:
            return
        if path.exists() and not path.is_file():
            msg = f"{path}: this is no file. Give a folder alone, or files."
            raise FileFormatError(msg, path=str(path))
        content = path.read_bytes()
        self.files[path] = None
        with naming_the_file(path):
            found = self._read(path, content)
        if isinstance(found, Workspace):
            self.raws[path] = list(found.matrices)
            self.left[path] = found.left
            self.texts.update(found.texts)
            self.own_layout = found.own_layout
        elif isinstance(found, tuple):
            self.labels[path] = found
            if not self.told and len(self.files) == 1:
                for other in matrices_of_labels(path):
                    self.add(other)
        else:
            self.raws[path] = found

    def add_labels(self, path: Path) -> None:
        """Read a file that was not asked for, for the names in it alone."""
        if path in self.files:
            return
        content = path.read_bytes()
        if path.suffix.lower() == ".pch" and not dmig.has_extrn(content):
            return
        self.files[path] = None
        with naming_the_file(path):
            self.labels[path] = _read_labels(path, content)

    def _read(self, path: Path, content: bytes) -> list[RawMatrix] | tuple[str, ...] | Workspace:
        told = [letter for letter, file in self.told.items() if file == path]
        is_signal = any(letter in SIGNALS for letter in told) or (not told and path.stem in SIGNALS)
        is_matlab = path.suffix.lower() == ".mat"
        if is_matlab and (content.startswith(OCTAVE) or table.is_table(content)):  # save -ascii, and Octave's own
            return _read(path, content, self.room, is_signal=is_signal)
        if is_npy(content) or is_npz(content) or path.suffix.lower() in MATRIX_ENDINGS:
            return read_workspace(content, self.titles, self.room, is_archive=not is_matlab)
        return _read(path, content, self.room, is_signal=is_signal)

    def result(self) -> Sources:
        roles = roles_in(list(self.raws))
        sources: list[Source] = []
        for path, raws in self.raws.items():
            sources += _numbered([Source(path, _letter(path, raw, roles.get(path)), raw) for raw in raws])
        chosen = _chosen(sources, self.told, self.titles, self.left)
        taken = {id(source) for source in chosen.values()}
        unused = tuple([source for source in sources if id(source) not in taken])
        square = {letter: source for letter, source in chosen.items() if letter in FEM_MATRICES}
        signals = {letter: source for letter, source in chosen.items() if letter in SIGNALS}
        found = Sources(
            tuple(self.files),
            square,
            signals,
            unused,
            self.left,
            self.labels,
            self.texts,
            own_layout=self.own_layout and len(self.raws) == 1,
        )
        if not square:
            held = [source.words for source in (*signals.values(), *unused)]
            what = f"it holds {listed(held)}" if held else "it holds names of DOFs only"
            where = listed([str(path) for path in self.files])
            remedy = found.holds or f"{what}. Pass {{'K': path, 'M': path}}"
            msg = f"{where}: nothing says which matrix is M, C or K: {remedy}."
            raise FileFormatError(msg, path=str(next(iter(self.files))))
        return found

    def all_of_one(self, given: Sequence[Path]) -> Sources:
        """Give the result; for a folder whose files do not make one model, refuse with the models that they make."""
        try:
            return self.result()
        except FileFormatError as refusal:
            several = several_models(given[0]) if len(given) == 1 else ""
            if not several:
                raise
            models = [line.strip() for line in several.splitlines()[1:]]
            msg = f"{given[0]}: {len(models)} models in it. Give the file before the colon: {'; '.join(models)}."
            raise FileFormatError(msg, path=str(given[0])) from refusal


def _numbered(sources: list[Source]) -> list[Source]:
    """Count the matrices of one file that have the same name."""
    names = [source.raw.title.lower() for source in sources]
    twice = {name for name in names if names.count(name) > 1} if len(names) > len(set(names)) else set()
    counts = dict.fromkeys(twice, 0)
    found = []
    for source, name in zip(sources, names, strict=True):
        if name in twice and source.raw.named:
            counts[name] += 1
            found.append(replace(source, number=counts[name]))
        else:
            found.append(source)
    return found


def _read(path: Path, content: bytes, room: int, *, is_signal: bool) -> list[RawMatrix] | tuple[str, ...]:
    """Read the matrices of a file, or the names of rows, by what its content is."""
    if is_cut_short(content):
        msg = "the last number has fewer digits than those before it. The file is cut short: write or copy it anew."
        raise FileFormatError(msg, path="")
    doubts = () if content.endswith((b"\n", b"\r")) else (NO_LAST_LINE_END,)
    names_rows = path.suffix.lower() in LABEL_ENDINGS
    if names_rows or (_may_be_deck(content) and not dmig.has_dmig(content) and dmig.has_extrn(content)):
        return _read_labels(path, content)
    if output4.is_binary_output4(content) or output4.is_text_output4(content) or path.suffix.lower() == ".op4":
        return output4.read_output4(content, room)
    raws = _read_text(path, content, room, is_signal=is_signal)
    return [replace(raw, doubts=(*raw.doubts, *doubts)) for raw in raws]


def _read_text(path: Path, content: bytes, room: int, *, is_signal: bool) -> list[RawMatrix]:
    suffix = path.suffix.lower()
    if matrix_market.is_matrix_market(content):
        return [matrix_market.read_matrix_market(content, room)]
    if harwell_boeing.is_harwell_boeing(content):
        return [harwell_boeing.read_harwell_boeing(content)]
    foreign = foreign_kind(path, content)
    if foreign is None and suffix in calculix.KIND_BY_ENDING and table.is_table(content):
        return [calculix.read_calculix(content, suffix, room)]
    if _may_be_deck(content) and dmig.has_dmig(content):
        return dmig.read_dmig(content)
    if content.lstrip().startswith(b"*") and abaqus.data_columns(content):
        return [abaqus.read_abaqus(content, room)]
    if foreign is None and table.is_table(content):
        return [table.read_table(content, dense=is_signal, most_rows=room)]
    msg = foreign or (
        f"the ending {suffix or '(none)'} names no format for this. Use .npz, .npy, .mat, or what Abaqus (*MATRIX "
        "OUTPUT), ANSYS (HBMAT, ASCII), CalculiX (MATRIXSTORAGE) or Nastran (OUTPUT4, DMIG) writes, Matrix Market, or "
        "a table of numbers. The file is none of these, or damaged at its start."
    )
    raise FileFormatError(msg, path="")


def _may_be_deck(content: bytes) -> bool:
    """Return whether entries of Nastran may stand somewhere, which a large table need not be searched for."""
    return not (
        abaqus.data_columns(content)
        or harwell_boeing.is_harwell_boeing(content)
        or matrix_market.is_matrix_market(content)
        or output4.is_binary_output4(content)
        or output4.is_text_output4(content)
    )


def _read_labels(path: Path, content: bytes) -> tuple[str, ...]:
    suffix = path.suffix.lower()
    if suffix == calculix.DOFS:
        return calculix.read_dofs(content)
    return harwell_boeing.read_mapping(content) if suffix == ".mapping" else dmig.read_extrn(content)


def _letter(path: Path, raw: RawMatrix, role: FileRole | None) -> str | None:
    """Tell what a matrix is by the file's own words, then by the file's name."""
    if raw.format.startswith("Nastran"):
        return None if raw.rectangular else nastran_letter(raw.title)
    if raw.letter is not None:
        return raw.letter
    if path.stem in SIGNALS:
        return path.stem
    return None if role is None else role.letter


def _chosen(
    sources: Sequence[Source],
    told: Mapping[str, Path],
    titles: Titles,
    left: Mapping[Path, tuple[Variable, ...]],
) -> dict[str, Source]:
    """Find the one matrix for each letter."""
    chosen = {}
    for letter in (*FEM_MATRICES, *SIGNALS):
        if letter in titles and titles[letter] is None:
            continue
        candidates = _candidates(letter, sources, told, titles, left)
        if len(candidates) > 1:
            found = listed([source.words for source in candidates])
            name = candidates[-1].name if candidates[-1].number else "name"
            msg = (
                f"{candidates[0].path}: more than one matrix could be {letter}: {found}. Pass "
                f"{{{letter!r}: path}}, or matrices={{{letter!r}: {name if name == 'name' else repr(name)}}} for files "
                "with several."
            )
            raise FileFormatError(msg, path=str(candidates[0].path))
        if candidates:
            chosen[letter] = candidates[0]
    return chosen


def _candidates(
    letter: str,
    sources: Sequence[Source],
    told: Mapping[str, Path],
    titles: Titles,
    left: Mapping[Path, tuple[Variable, ...]],
) -> list[Source]:
    """Return the matrices that a letter may stand for, by the user's word or by their own."""
    own = [source for source in sources if letter not in told or source.path == told[letter]]
    title = titles.get(letter)
    if title is not None:
        exact = [source for source in own if title in {source.raw.title, source.name}]
        found = exact or [source for source in own if title.lower() in {source.raw.title.lower(), source.name.lower()}]
        if not found:
            path = told.get(letter) or (sources[0].path if sources else next(iter(left), ""))
            known = [source.words for source in own] + [variable.words for part in left.values() for variable in part]
            msg = f"{path}: no matrix {title!r} for {letter}. Known: {listed(known, most=24) or 'none'}."
            raise FileFormatError(msg, path=str(path))
        return found
    if letter in told:
        if len(own) == 1 and list(told.values()).count(told[letter]) == 1:
            return own
        found = [source for source in own if source.letter == letter and not _is_placeholder(source)]
        if not found:
            known = [part.words for part in own] + [variable.words for variable in left.get(told[letter], ())]
            msg = (
                f"{told[letter]}: nothing in it is known to be {letter}: {listed(known, most=24) or 'it is empty'}. "
                f"Say matrices={{{letter!r}: name}}."
            )
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
