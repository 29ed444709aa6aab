"""Claims about names of files: what they say of their content, and which belong together."""

from pathlib import Path

import pytest

from halfdof_ctrl.files.roles import matrices_of_labels, nastran_letter, role_of, roles_in, siblings, with_labels


@pytest.mark.parametrize(
    ("name", "letter"),
    [
        ("job_STIF1.mtx", "K"),
        ("my_job_MASS12.mtx", "M"),
        ("job_DMPV1.mtx", "C"),
        ("job_DMPS1.mtx", "S"),
        ("bcsstk13.mtx", "K"),
        ("bcsstm13.mtx", "M"),
        ("K.mtx", "K"),
        ("m.mtx", "M"),
        ("bracket_mass.matrix", "M"),
        ("bracket-damping.matrix", "C"),
        ("Stiffness_mat.dat", "K"),
        ("stiff.matrix", "K"),
        ("K_bracket.mtx", "K"),
        ("plate K2.mtx", "K"),
    ],
)
def test_the_name_tells_the_matrix(name: str, letter: str) -> None:
    """In the ways that programs and people write it."""
    role = role_of(Path(name))
    assert role is not None
    assert role.letter == letter


@pytest.mark.parametrize(
    "name", ["job.mtx", "truck.mtx", "mount.mtx", "kicks.mtx", "massive.mtx", "job_LOAD1.mtx", "1.mtx"]
)
def test_a_name_that_only_sounds_alike_tells_nothing(name: str) -> None:
    """Words count whole."""
    assert role_of(Path(name)) is None


@pytest.mark.parametrize(
    ("title", "letter"),
    [
        ("KAAX", "K"),
        ("kgg", "K"),
        ("k2gg", "K"),
        ("maax", "M"),
        ("mxx", "M"),
        ("BAAX", "C"),
        ("bxx1", "C"),
        ("k4aax", "S"),
    ],
)
def test_names_of_nastran_tell_kind_and_set(title: str, letter: str) -> None:
    """K, M, B and K4 with the letters of a set."""
    assert nastran_letter(title) == letter


@pytest.mark.parametrize("title", ["mug1", "mes1o", "px", "va", "ll", "dd", "k", "maxx", "gpxx"])
def test_other_names_of_nastran_are_none(title: str) -> None:
    """Loads, recovery matrices, factors."""
    assert nastran_letter(title) is None


def test_siblings_share_all_but_the_word(tmp_path: Path) -> None:
    """Other jobs, steps and endings do not belong."""
    for name in (
        "job_STIF1.mtx",
        "job_MASS1.mtx",
        "job_DMPV1.mtx",
        "job_MASS2.mtx",
        "jab_MASS1.mtx",
        "job_DMPS1.txt",
        "a",
    ):
        (tmp_path / name).touch()
    (tmp_path / "job_DMPS1.mtx").mkdir()
    assert [path.name for path in siblings(tmp_path / "job_STIF1.mtx")] == ["job_DMPV1.mtx", "job_MASS1.mtx"]
    assert siblings(tmp_path / "a") == []
    assert siblings(tmp_path / "nowhere" / "K.mtx") == []


def test_label_files_have_the_same_name(tmp_path: Path) -> None:
    """A mapping of ANSYS, in any capitals; the punch file of an OUTPUT4 file."""
    for name in ("stiff.matrix", "STIFF.MAPPING", "mass.mapping", "se.op4", "se.pch"):
        (tmp_path / name).touch()
    found = with_labels([tmp_path / "stiff.matrix", tmp_path / "se.op4"])
    assert [path.name for path in found] == ["stiff.matrix", "se.op4", "STIFF.MAPPING", "se.pch"]
    assert with_labels([tmp_path / "nowhere" / "a.mtx"]) == [tmp_path / "nowhere" / "a.mtx"]


@pytest.mark.parametrize(
    ("name", "letter"), [("KMatrixTMD.mtx", "K"), ("MMatrixTMD.mtx", "M"), ("rotorDiscSTIF1.mtx", "K"), ("b.mas", "M")]
)
def test_a_word_of_its_own_in_capitals_tells_the_matrix(name: str, letter: str) -> None:
    """Wherever in the name it stands."""
    role = role_of(Path(name))
    assert role is not None
    assert role.letter == letter


@pytest.mark.parametrize(
    "names",
    [
        ("KMatrixTMD.mtx", "MMatrixTMD.mtx", "CMatrixTMD.mtx"),
        ("rotorDiscSTIF1.mtx", "rotorDiscMASS1.mtx", "rotorDiscDMPV1.mtx"),
        ("beamstiffness.txt", "beammass.txt", "beamdamping.txt"),
        ("2Stiffness_of_car.csv", "2Mass_of_car.csv", "2Damping_of_car.csv"),
        ("MassSpring_K.mtx", "MassSpring_M.mtx", "MassSpring_C.mtx"),
    ],
)
def test_names_that_differ_in_the_word_alone_are_siblings(tmp_path: Path, names: tuple[str, ...]) -> None:
    """From each of them, beside others."""
    for name in (*names, "KMatrixABC.mtx", "othermass.txt", "massive.csv"):
        (tmp_path / name).touch()
    for name in names:
        assert sorted(path.name for path in siblings(tmp_path / name)) == sorted(set(names) - {name})
    roles = roles_in([tmp_path / name for name in names])
    assert [role.letter for role in roles.values()] == ["K", "M", "C"]


def test_a_punch_file_finds_its_output4_file(tmp_path: Path) -> None:
    """And the names of CalculiX their matrices, whatever the capitals."""
    for name in ("se.pch", "SE.OP4", "other.op4", "job.dof", "job.sti", "job.mas"):
        (tmp_path / name).touch()
    assert [path.name for path in matrices_of_labels(tmp_path / "se.pch")] == ["SE.OP4"]
    assert [path.name for path in matrices_of_labels(tmp_path / "job.dof")] == ["job.mas", "job.sti"]
    assert matrices_of_labels(tmp_path / "job.sti") == []
