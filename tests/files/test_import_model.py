"""Claims about models from files of finite-element programs: the right frequencies, the right words, one refusal."""

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import scipy.linalg
import scipy.sparse.linalg
from scipy.sparse import csc_array

from halfdof_ctrl import HalfdofError, SecondOrderModel, descriptor_response, inspect_files, load_model, mech2ss, mechss
from halfdof_ctrl.base.errors import FileFormatError, HalfdofWarning, ImportedModelWarning
from support import exported_files as exported
from support.fe_files import (
    CHAIN,
    NAMES,
    C,
    K,
    M,
    abaqus,
    dmig,
    harwell_boeing,
    mapping,
    matrix_market,
    output4_binary,
    output4_text,
)

SAME = 1e-9  #: relative, of frequencies; the files have 10 to 16 digits and both sides read all of them


def dense(matrix: object) -> npt.NDArray[np.float64]:
    """Expand a model's matrix, dense or sparse."""
    return np.asarray(csc_array(matrix).toarray())  # type: ignore[call-overload]


def lowest(M: npt.NDArray[np.float64], K: npt.NDArray[np.float64], count: int = 10) -> npt.NDArray[np.float64]:
    """Give them for more DOFs: K by Cholesky, then Lanczos on L^-1 M L^-T, all dense."""
    lower = scipy.linalg.cholesky(K, lower=True)

    def applied(x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        y = M @ scipy.linalg.solve_triangular(lower, x, lower=True, trans="T")
        return np.asarray(scipy.linalg.solve_triangular(lower, y, lower=True))

    operator = scipy.sparse.linalg.LinearOperator(K.shape, matvec=applied, dtype=np.float64)
    start = np.ones(len(K))
    return np.asarray(
        1.0 / np.sort(scipy.sparse.linalg.eigsh(operator, count, v0=start, return_eigenvectors=False))[::-1]
    )


def squared_frequencies(
    M: npt.NDArray[np.float64], K: npt.NDArray[np.float64], count: int = 10
) -> npt.NDArray[np.float64]:
    """Give the lowest eigenvalues of K q = w2 M q with singular M, as the largest of M q = 1/w2 K q."""
    inverse = scipy.linalg.eigh(M, K, eigvals_only=True)[::-1][:count]
    return np.asarray(1.0 / inverse)


@contextmanager
def in_folder(folder: Path) -> Iterator[None]:
    """Work in a folder."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@pytest.mark.parametrize("number", ["01", "03", "12", "13"])
def test_structures_have_the_frequencies_of_an_independent_solver(tmp_path: Path, number: str) -> None:
    """Dense linear algebra, with what scipy was given to write, against the model and a sparse solver: ten of them."""
    with pytest.warns(ImportedModelWarning, match="no damping C in"):
        model = load_model(exported.write_structure(tmp_path, number)[0])
    structure = exported.STRUCTURES[number]
    stiffness, mass = dense(structure.K), dense(structure.M)
    np.testing.assert_array_equal(dense(model.M), mass)
    np.testing.assert_array_equal(dense(model.K), stiffness)
    found = scipy.sparse.linalg.eigsh(
        csc_array(model.K), 10, csc_array(model.M), sigma=0.0, v0=np.ones(len(model.dofs)), return_eigenvectors=False
    )
    expected = squared_frequencies(mass, stiffness) if len(model.dofs) < 200 else lowest(mass, stiffness)
    np.testing.assert_allclose(np.sort(found), expected, rtol=SAME)


@pytest.mark.parametrize("number", ["01", "03"])
def test_state_spaces_of_structures_have_these_frequencies(tmp_path: Path, number: str) -> None:
    """The poles of the reduced model, 24 and 40 DOFs being without mass, are i times the roots of the eigenvalues."""
    model = load_model(dict(zip("KM", exported.write_structure(tmp_path, number), strict=True)))
    poles = np.sort(np.abs(mech2ss(model.select(model.inputs[0], model.outputs[0])).poles()))[::2][:10]
    np.testing.assert_allclose(poles, np.sqrt(squared_frequencies(dense(model.M), dense(model.K))), rtol=1e-7)


@pytest.mark.parametrize(
    ("number", "inertial", "static"), [("01", 24, 24), ("03", 72, 40), ("12", 420, 0), ("13", 90, 342)]
)
def test_reports_on_structures_count_what_is_known_of_them(
    tmp_path: Path, number: str, inertial: int, static: int
) -> None:
    """DOFs without mass as they were built; stiffness definite, mass semidefinite."""
    report = inspect_files(exported.write_structure(tmp_path, number)[0])
    assert (report.n_inertial, report.n_half, report.n_static) == (inertial, 0, static)
    mass, stiffness = report.matrices
    assert (mass.inertia.rank, stiffness.inertia.rank) == (inertial, report.n_dofs)
    assert stiffness.rank.startswith("positive definite")
    assert report.warnings == ()


def test_a_superelement_has_named_dofs_and_the_frequencies_of_its_op4_file() -> None:
    """OUTPUT4 with the names of its punch file: 32 DOFs, six rigid motions, the rest as the matrices written give."""
    path = exported.DATA / "superelement.op4"
    with pytest.warns(ImportedModelWarning, match="no damping C"):
        model = load_model(path)
    assert model.dofs[:6] == ("n3_u1", "n3_u2", "n3_u3", "n3_r1", "n3_r2", "n3_r3")
    assert model.dofs == exported.SUPERELEMENT_DOFS
    theirs = exported.superelement()
    ours = np.sort(scipy.linalg.eigvalsh(dense(model.K), dense(model.M) + 1e-9 * np.eye(32)))[6:16]
    other = np.sort(scipy.linalg.eigvalsh(theirs["kxx"], theirs["mxx"] + 1e-9 * np.eye(32)))[6:16]
    np.testing.assert_allclose(ours, other, rtol=SAME)
    assert inspect_files(path).matrices[1].inertia.zero == 6


WRITERS: dict[str, Callable[[Path], Path]] = {}


def writer(function: Callable[[Path], Path]) -> Callable[[Path], Path]:
    """Collect ways to write the chain."""
    WRITERS[function.__name__] = function
    return function


@writer
def market(folder: Path) -> Path:
    """Write three files of Matrix Market."""
    for letter, matrix in CHAIN.items():
        (folder / f"{letter}.mtx").write_text(matrix_market(matrix))
    return folder / "K.mtx"


@writer
def abaqus_text(folder: Path) -> Path:
    """Write three files of Abaqus."""
    for word, matrix in (("MASS", M), ("DMPV", C), ("STIF", K)):
        (folder / f"job_{word}1.mtx").write_text(abaqus(matrix))
    return folder / "job_STIF1.mtx"


@writer
def ansys_text(folder: Path) -> Path:
    """Write three files of ANSYS and a mapping."""
    for word, matrix in (("mass", M), ("damping", C), ("stiffness", K)):
        (folder / f"{word}.matrix").write_text(
            harwell_boeing(matrix, title=f"{word.title()} matrix from ANSYS FULL file")
        )
    (folder / "stiffness.mapping").write_text(mapping())
    return folder / "stiffness.matrix"


@writer
def punch(folder: Path) -> Path:
    """Write a punch file of Nastran."""
    (folder / "a.pch").write_text(dmig({"KAAX": K, "MAAX": M, "BAAX": C}))
    return folder / "a.pch"


@writer
def op4_text(folder: Path) -> Path:
    """Write a text file of OUTPUT4."""
    (folder / "a.op4").write_text(output4_text({"KAA": K, "MAA": M, "BAA": C}, "sparse"))
    return folder / "a.op4"


@writer
def op4_binary(folder: Path) -> Path:
    """Write a binary file of OUTPUT4."""
    (folder / "a.op4").write_bytes(output4_binary({"KAA": K, "MAA": M, "BAA": C}, "big"))
    return folder / "a.op4"


EVERY_FORMAT = pytest.mark.parametrize("name", sorted(WRITERS))


@EVERY_FORMAT
def test_every_format_gives_the_same_model(tmp_path: Path, name: str) -> None:
    """The chain of three nodes, by its response to a force on the massless end; five states."""
    model = load_model(str(WRITERS[name](tmp_path)))
    expected = mechss(M, C, K, dofs=model.dofs)
    omega = np.array([0.3, 1.1, 4.0])
    np.testing.assert_allclose(
        np.asarray(descriptor_response(model, omega).frdata),
        np.asarray(descriptor_response(expected, omega).frdata),
        rtol=1e-13,
    )
    assert mech2ss(model).nstates == 5
    assert model.dofs == (NAMES if name in {"abaqus_text", "ansys_text", "punch"} else ("q0", "q1", "q2"))


def test_a_list_a_folder_and_a_mapping_are_the_same(tmp_path: Path) -> None:
    """Three ways to name files."""
    market(tmp_path)
    paths = {letter: tmp_path / f"{letter}.mtx" for letter in CHAIN}
    for given in (tmp_path, list(paths.values()), paths, [str(path) for path in paths.values()]):
        np.testing.assert_array_equal(dense(load_model(given).K), K)


def test_input_and_output_matrices_beside_them_are_taken(tmp_path: Path) -> None:
    """B.mtx and F.mtx, as mechss takes them."""
    market(tmp_path)
    (tmp_path / "B.mtx").write_text("%%MatrixMarket matrix array real general\n3 1\n0\n0\n1\n")
    (tmp_path / "F.mtx").write_text("%%MatrixMarket matrix array real general\n1 3\n1\n0\n0\n")
    model = load_model(tmp_path)
    assert (model.inputs, model.outputs) == (("F_q2",), ("q0",))


def test_missing_damping_is_said_unless_the_files_were_chosen_by_hand(tmp_path: Path) -> None:
    """A file that was forgotten looks like an undamped model."""
    market(tmp_path)
    (tmp_path / "C.mtx").unlink()
    with pytest.warns(ImportedModelWarning, match=r"K\.mtx: no damping C in K\.mtx, M\.mtx, so it is taken as zero"):
        load_model(tmp_path / "K.mtx")
    with warnings.catch_warnings():
        warnings.simplefilter("error", HalfdofWarning)
        load_model([tmp_path / "K.mtx", tmp_path / "M.mtx"])


def test_warnings_of_the_report_are_given_on_loading(tmp_path: Path) -> None:
    """A half without a word of symmetry, and the remedy."""
    (tmp_path / "K.mtx").write_text(matrix_market(K, "coordinate real general"))
    given = {"K": tmp_path / "K.mtx"}
    with pytest.warns(ImportedModelWarning, match="half of it seems to be missing.*triangle='lower'"):
        assert not np.array_equal(dense(load_model(given).K), K)
    np.testing.assert_array_equal(dense(load_model(given, triangle="lower").K), K)


def test_a_half_in_a_container_is_completed_on_request(tmp_path: Path) -> None:
    """Dense or sparse; without the request it is taken as it is, and told."""
    np.savez(tmp_path / "a.npz", M=M, C=C, K=np.tril(K))
    with pytest.warns(ImportedModelWarning, match="half of it seems to be missing"):
        load_model(tmp_path / "a.npz")
    warnings.simplefilter("ignore", ImportedModelWarning)
    np.testing.assert_array_equal(dense(load_model(tmp_path / "a.npz").K), np.tril(K))
    np.testing.assert_array_equal(dense(load_model(tmp_path / "a.npz", triangle="lower").K), K)
    with pytest.raises(FileFormatError, match=r"a\.npz: triangle='upper'"):
        load_model(tmp_path / "a.npz", triangle="upper")


def test_structural_damping_makes_a_complex_model(tmp_path: Path) -> None:
    """Which has a response, and no real state space."""
    (tmp_path / "job_STIF1.mtx").write_text(abaqus(K))
    (tmp_path / "job_DMPS1.mtx").write_text(abaqus(0.1 * K))
    model = load_model([tmp_path / "job_STIF1.mtx", tmp_path / "job_DMPS1.mtx"])
    assert model.complex_matrices == ("K",)
    np.testing.assert_allclose(model(0)[..., 0, 0], np.linalg.inv(K * (1 + 0.1j))[0, 0], rtol=1e-13)


@pytest.mark.parametrize(
    ("names", "message"), [(["job_MASS1.mtx"], "no stiffness K in job_MASS1.mtx"), ([], "No file is given")]
)
def test_no_stiffness_and_no_file_are_refused(tmp_path: Path, names: list[str], message: str) -> None:
    """A model needs a stiffness."""
    (tmp_path / "job_MASS1.mtx").write_text(abaqus(M))
    with pytest.raises(FileFormatError, match=message):
        load_model([tmp_path / name for name in names])


def loaded(path: Path) -> SecondOrderModel | str:
    """Load a model, or give its refusal or the word that something is missing, and let nothing else happen."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", HalfdofWarning)
        warnings.filterwarnings("ignore", "(?!.*(last number|no mass|no damping))", ImportedModelWarning)
        try:
            return load_model(path)
        except ImportedModelWarning as doubt:
            return str(doubt)
        except HalfdofError as refusal:
            words = str(refusal)
    assert str(path.parent) in words
    assert "\n" not in words
    return words


@EVERY_FORMAT
def test_the_beginning_of_a_file_never_does_more_than_be_refused(tmp_path: Path, name: str) -> None:
    """Cut anywhere, each file is refused, or, where the format counts its entries, something is told to be missing."""
    path = WRITERS[name](tmp_path)
    content = path.read_bytes()
    counted = name not in {"abaqus_text", "punch"}
    meaningless = 26 if name == "op4_text" else 2  # the line after the last column, the last line end
    for length in range(0, len(content) - meaningless, max(1, len(content) // 150)):
        path.write_bytes(content[:length])
        assert isinstance(loaded(path), str) or not counted


@EVERY_FORMAT
def test_a_damaged_file_loads_or_is_refused(tmp_path: Path, name: str) -> None:
    """Bytes changed at random, 200 times, never raise anything else, warn of anything else or hang."""
    path = WRITERS[name](tmp_path)
    content = path.read_bytes()
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(200):
        damaged = bytearray(content)
        for place in rng.integers(0, len(content), rng.integers(1, 4)).tolist():
            damaged[place] = int(rng.choice([rng.integers(0, 256), damaged[place] ^ 1, ord("9"), ord("-"), 10, 32]))
        path.write_bytes(bytes(damaged))
        refused += isinstance(loaded(path), str)
    assert refused > 20


@pytest.mark.parametrize(
    "name",
    ["bcsstk01.mtx", "superelement.op4", "single_text.op4", "single_binary.op4", "forms.pch", "superelement.pch"],
)
def test_files_of_other_programs_that_are_damaged_are_refused_or_read(tmp_path: Path, name: str) -> None:
    """Cut and changed at random, 60 times each, in a seeded loop."""
    content = exported.content(name, tmp_path)
    path = tmp_path / "damaged" / name
    path.parent.mkdir()
    rng = np.random.default_rng(8)
    for _ in range(60):
        damaged = bytearray(content)
        if rng.random() < 0.5:
            damaged = damaged[: rng.integers(0, len(content))]
        for place in rng.integers(0, max(len(damaged), 1), 3).tolist():
            if place < len(damaged):
                damaged[place] = int(rng.integers(0, 256))
        path.write_bytes(bytes(damaged))
        loaded(path)


def test_a_file_without_a_last_line_end_is_doubted(tmp_path: Path) -> None:
    """1.25 cut to 1.2 is a number like any other."""
    (tmp_path / "job_STIF1.mtx").write_text(abaqus(K)[:-1])
    with pytest.warns(ImportedModelWarning, match=r"job_STIF1\.mtx does not end with a line end"):
        load_model({"K": tmp_path / "job_STIF1.mtx"})


def test_a_last_number_with_fewer_digits_than_the_others_is_refused(tmp_path: Path) -> None:
    """All numbers of a format have one length, so a shorter last one without a line end was cut."""
    rows = [f"{row},1, {row},1, {2.0e4 * row:.14e}" for row in range(1, 6)]
    whole = "\n".join(rows)
    for end in range(1, 12):
        (tmp_path / "job_STIF1.mtx").write_text(whole[:-end])
        with pytest.raises(FileFormatError, match="fewer digits than those before it"):
            load_model({"K": tmp_path / "job_STIF1.mtx"})
