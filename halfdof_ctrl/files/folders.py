"""The files of a model in a folder, or beside the one that was given, and the models of a folder."""

from collections.abc import Sequence
from pathlib import Path

from halfdof_ctrl.base.errors import FileFormatError, HalfdofError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.containers import ARRAY_ENDINGS, variables
from halfdof_ctrl.files.foreign import FOREIGN_ENDINGS
from halfdof_ctrl.files.formats.table import TABLE_HEAD, is_table
from halfdof_ctrl.files.roles import families, roles_in, siblings

MODEL_ENDINGS = (
    ".mtx", ".mm", ".matrix", ".hb", ".rsa", ".rua", ".op4", ".pch", ".dmig", ".mapping", ".sti", ".mas", ".dof",
)  #: of matrices of programs, which a folder is searched for  # fmt: skip
TABLES = (".txt", ".csv", ".tsv", ".dat", ".out", ".asc")  #: searched for under the names of matrices alone
LABEL_ENDINGS = (".mapping", ".dof")
SEVERAL = (".op4", ".pch", ".dmig")  #: that hold several matrices, whatever their names


def all_files(given: Sequence[Path], *, with_siblings: bool = False) -> list[Path]:
    """Resolve a folder, or add the siblings of a single file.

    Raises
    ------
    FileFormatError
        A folder without matrices or with several models in files of their own, or something that is no file.
    """
    if len(given) == 1 and given[0].is_dir() and given[0].suffix.lower() not in ARRAY_ENDINGS:
        return _in_folder(given[0])
    for path in given:
        if path.exists() and not path.is_file():
            msg = f"{path}: this is no file. Give a folder alone, or files."
            raise FileFormatError(msg, path=str(path))
    return [*given, *(siblings(given[0]) if with_siblings and len(given) == 1 else [])]


def models_in(folder: Path) -> list[list[Path]]:
    """Find the models of a folder: the files of each, which `load_model` takes as a list.

    Raises
    ------
    OSError
        The folder cannot be read.
    """
    files = [path for path in sorted(folder.iterdir()) if path.is_file()]
    matrices = _with_matrices(files)
    roles = roles_in(matrices)
    groups = [
        group
        for group in families([path for path in matrices if not _only_names_rows(path, matrices)])
        if any(path.suffix.lower() in SEVERAL or (path in roles and roles[path].letter == "K") for path in group)
    ]
    alone = [[path] for path in files if path not in matrices and _holds_stiffness(path)]
    return groups + alone


def _only_names_rows(path: Path, others: Sequence[Path]) -> bool:
    """Return whether a file names rows: a mapping, or the punch file beside an OUTPUT4 file."""
    suffix = path.suffix.lower()
    return suffix in LABEL_ENDINGS or (suffix == ".pch" and path.with_suffix(".op4") in others)


def several_models(folder: Path) -> str:
    """List the models of a folder for people, each with a file that leads to all of its own; empty if there is one."""
    models = models_in(folder) if folder.is_dir() else []
    if len(models) < 2:  # noqa: PLR2004  # one is no choice
        return ""
    lines = [f"  {_leading(files).name}: {listed([path.name for path in files])}" for files in models]
    return "\n".join([f"{len(models)} models in {folder}; give the file before the colon:", *lines])


def _leading(files: Sequence[Path]) -> Path:
    roles = roles_in(files)
    return next((path for path in files if path in roles and roles[path].letter == "K"), files[0])


def _in_folder(folder: Path) -> list[Path]:
    files = [path for path in sorted(folder.iterdir()) if path.is_file()]
    found = _with_matrices(files)
    if found:
        return found
    whole = [path for path in files if _holds_stiffness(path)]
    if len(whole) == 1:
        return whole
    known = f"It holds {listed([path.name for path in files])}. " if files else ""
    if whole:
        names = listed([path.name for path in whole])
        msg = f"{folder}: {len(whole)} models in it: {names}. Give the path of one of them."
    elif len(single := [path for path in files if path.suffix.lower() in ARRAY_ENDINGS]) == 1:
        return single
    else:
        suffixes = [path.suffix.lower() for path in files]
        foreign = next((FOREIGN_ENDINGS[suffix] for suffix in suffixes if suffix in FOREIGN_ENDINGS), None)
        hint = f" {foreign[0][0].upper()}{foreign[0][1:]} is not read. Instead: {foreign[1]}." if foreign else ""
        msg = (
            f"{folder}: this folder holds no file that ends in {', '.join(MODEL_ENDINGS)}, and no {', '.join(TABLES)}, "
            f"{', '.join(ARRAY_ENDINGS)} with the name of a matrix. {known}Give its files by name.{hint}"
        )
    raise FileFormatError(msg, path=str(folder))


def _with_matrices(files: Sequence[Path]) -> list[Path]:
    """Return the files of programs, and tables and arrays under the name of a matrix that these do not have."""
    found = [path for path in files if path.suffix.lower() in MODEL_ENDINGS]
    roles = roles_in([path for path in files if path.suffix.lower() in (*MODEL_ENDINGS, *TABLES, *ARRAY_ENDINGS)])
    if any(path.suffix.lower() in SEVERAL for path in found):
        return found
    had = {roles[path].letter for path in found if path in roles}
    others = [
        path
        for path in files
        if path in roles and path not in found and roles[path].letter not in had and _may_be_numbers(path)
    ]
    signals = [
        path for path in files if path.stem in {"B", "F", "G", "H"} and path.suffix.lower() in (*TABLES, *ARRAY_ENDINGS)
    ]
    return [*found, *others, *(signals if others else [])]


def _may_be_numbers(path: Path) -> bool:
    """Tell a table from notes about damping."""
    if path.suffix.lower() not in TABLES:
        return True
    with path.open("rb") as stream:
        return is_table(stream.read(TABLE_HEAD))


def _holds_stiffness(path: Path) -> bool:
    """Return whether a file with named variables has one called K that may be a matrix, and so is no state space."""
    if path.suffix.lower() not in ARRAY_ENDINGS:
        return False
    try:
        found = variables(path.read_bytes(), is_archive=path.suffix.lower() != ".mat")
    except (HalfdofError, OSError, ValueError, KeyError, EOFError, RuntimeError):
        return False
    except Exception:  # noqa: BLE001  # damaged bytes make the readers raise anything; such a file is no model
        return False
    names = {variable.name for variable in found}
    return "K" in names and not {"inputs", "states"} <= names
