"""Claims about which files make a model: folders, siblings, lists, mappings, and what is ambiguous."""

from pathlib import Path

import pytest

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.sources import Sources, find_sources
from support.fe_files import C, K, M, abaqus, dmig, harwell_boeing, mapping, matrix_market, output4_binary, output4_text


def laid(folder: Path, **files: str | bytes) -> Path:
    """Write files, the double underscore of a name standing for its full stop."""
    for name, content in files.items():
        path = folder / name.replace("__", ".")
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return folder


def found_in(sources: Sources) -> dict[str, str]:
    """Give the file of each matrix."""
    return {letter: source.words for letter, source in sources.matrices.items()}


def test_a_folder_of_matrix_market_files_is_a_model(tmp_path: Path) -> None:
    """M.mtx, C.mtx, K.mtx, and whatever else lies there."""
    laid(tmp_path, M__mtx=matrix_market(M), C__mtx=matrix_market(C), K__mtx=matrix_market(K), notes__txt="1")
    assert found_in(find_sources([tmp_path], {})) == {"M": "M.mtx", "C": "C.mtx", "K": "K.mtx"}


def test_the_siblings_of_an_abaqus_file_are_found(tmp_path: Path) -> None:
    """Of the same job and step, from any of them."""
    laid(
        tmp_path, job_STIF1__mtx=abaqus(K), job_MASS1__mtx=abaqus(M), job_DMPV1__mtx=abaqus(C), job_MASS2__mtx=abaqus(K)
    )
    expected = {"M": "job_MASS1.mtx", "C": "job_DMPV1.mtx", "K": "job_STIF1.mtx"}
    for name in expected.values():
        assert found_in(find_sources([tmp_path / name], {})) == expected


def test_structural_damping_has_a_letter_of_its_own(tmp_path: Path) -> None:
    """It is the imaginary part of the stiffness, not the damping C."""
    laid(tmp_path, job_STIF1__mtx=abaqus(K), job_DMPS1__mtx=abaqus(K))
    assert found_in(find_sources([tmp_path / "job_STIF1.mtx"], {})) == {"K": "job_STIF1.mtx", "S": "job_DMPS1.mtx"}


def test_titles_of_ansys_tell_more_than_names_of_files(tmp_path: Path) -> None:
    """In a list of files with names that say nothing; the mapping is found by its name."""
    mass = harwell_boeing(M, title="Mass matrix from ANSYS FULL file")
    laid(tmp_path, one__matrix=harwell_boeing(K), two__dat=mass, one__mapping=mapping())
    found = find_sources([tmp_path / "one.matrix", tmp_path / "two.dat"], {})
    assert found_in(found) == {"M": "two.dat", "K": "one.matrix"}
    assert [path.name for path in found.labels] == ["one.mapping"]


@pytest.mark.parametrize("layout", ["text", "binary", "punch"])
def test_files_of_nastran_hold_all_matrices(tmp_path: Path, layout: str) -> None:
    """By the names in them; a 1 x 1 zero stands for a matrix that there is not."""
    matrices = {"KAAX": K, "MAAX": M, "PA": K}
    content = {
        "text": output4_text({**matrices, "BAAX": K[2:, :1] * 0}, "sparse").encode(),
        "binary": output4_binary({**matrices, "BAAX": K[2:, :1] * 0}, "big"),
        "punch": dmig(matrices).encode(),
    }[layout]
    name = "a.pch" if layout == "punch" else "a.op4"
    (tmp_path / name).write_bytes(content)
    assert found_in(find_sources([tmp_path / name], {})) == {"M": f"{name}: maax", "K": f"{name}: kaax"}


def test_the_user_may_say_which_file_or_matrix_is_what(tmp_path: Path) -> None:
    """By path, or by the name within a file."""
    laid(
        tmp_path, x__mtx=matrix_market(K), y__mtx=matrix_market(M), z__op4=output4_binary({"KGG": K, "KAA": M}, "dense")
    )
    assert found_in(find_sources({"K": tmp_path / "x.mtx", "M": tmp_path / "y.mtx"}, {})) == {
        "M": "y.mtx",
        "K": "x.mtx",
    }
    both = {"K": "KGG", "M": "kaa"}
    assert found_in(find_sources([tmp_path / "z.op4"], both)) == {"M": "z.op4: kaa", "K": "z.op4: kgg"}
    mixed = find_sources({"K": tmp_path / "z.op4", "M": tmp_path / "y.mtx"}, {"K": "kgg"})
    assert found_in(mixed) == {"M": "y.mtx", "K": "z.op4: kgg"}


def test_one_file_for_two_letters_gives_each_its_own_matrix(tmp_path: Path) -> None:
    """By the names in it."""
    path = laid(tmp_path, z__op4=output4_binary({"KGG": K, "MGG": M}, "dense")) / "z.op4"
    assert found_in(find_sources({"K": path, "M": path}, {})) == {"M": "z.op4: mgg", "K": "z.op4: kgg"}


REFUSED = [
    ({}, r"this folder holds no file that ends in \.mtx"),
    (
        {"K__mtx": matrix_market(K), "stiff__mtx": matrix_market(K)},
        r"more than one matrix could be K: K\.mtx, stiff\.mtx",
    ),
    (
        {"job_STIF1__mtx": abaqus(K), "job_STIF2__mtx": abaqus(K)},
        r"2 models in it\. Give the file before the colon: job_STIF1\.mtx: job_STIF1\.mtx; job_STIF2",
    ),
    ({"a__mtx": matrix_market(K)}, r"nothing says which matrix is M, C or K: it holds a\.mtx"),
    ({"a__mapping": mapping()}, "it holds names of DOFs only"),
    ({"a__op4": output4_binary({"KGG": K, "KAA": M}, "dense")}, r"matrices=\{'K': name\}"),
    ({"K__mtx": "garbage"}, r"K\.mtx: the ending \.mtx names no format"),
    ({"a__op4": "garbage"}, r"a\.op4, line 1: .*name of a matrix belong here"),
]


@pytest.mark.parametrize(("files", "message"), REFUSED)
def test_a_folder_that_is_no_model_or_several_is_refused(
    tmp_path: Path, files: dict[str, str | bytes], message: str
) -> None:
    """With what is there and how to say what is meant."""
    with pytest.raises(FileFormatError, match=message) as caught:
        find_sources([laid(tmp_path, **files)], {})
    assert caught.value.path.startswith(str(tmp_path))


def test_letters_and_titles_that_do_not_exist_are_refused(tmp_path: Path) -> None:
    """Rather than passed over."""
    path = laid(tmp_path, z__op4=output4_binary({"KGG": K}, "dense"), x__mtx=matrix_market(K)) / "z.op4"
    with pytest.raises(FileFormatError, match="X is no matrix of a model"):
        find_sources({"X": path}, {})
    with pytest.raises(FileFormatError, match=r"no matrix 'kaa' for K\. Known: z\.op4: kgg"):
        find_sources([path], {"K": "kaa"})
    with pytest.raises(FileFormatError, match="nothing in it is known to be M"):
        find_sources({"K": path, "M": path}, {})
    with pytest.raises(FileFormatError, match="this is no file"):
        find_sources([path, tmp_path], {})


def test_a_file_that_is_not_there_is_an_os_error(tmp_path: Path) -> None:
    """With its name."""
    with pytest.raises(FileNotFoundError, match=r"nowhere\.mtx"):
        find_sources([tmp_path / "nowhere.mtx"], {})
