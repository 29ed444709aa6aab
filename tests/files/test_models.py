"""Claims about files: exact round trips, one clear refusal, and nothing half-written."""

import csv
import io
import os
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import control
import numpy as np
import numpy.typing as npt
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import HalfdofError, SecondOrderModel, frequency_response, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import FileFormatError, MatrixError, ParameterError, SignalNameError
from halfdof_ctrl.base.names import motion_names
from halfdof_ctrl.design.lqr import lqr
from halfdof_ctrl.files.models import inspect_files, load_model, save_model
from halfdof_ctrl.files.systems import load_system, save_system
from halfdof_ctrl.files.tables import save_gain, save_response
from halfdof_ctrl.files.writing import replacing
from halfdof_ctrl.model.motion import KINDS, MotionKind
from halfdof_ctrl.model.second_order import LETTERS
from support.fe_models import spring_grid

ENDINGS = pytest.mark.parametrize("ending", [".npz", ".mat"])
MOUNT = hydromount()
K = np.array([[3.0, -1.0], [-1.0, 2.0]])


def same(one: SecondOrderModel, other: SecondOrderModel) -> bool:
    """Tell whether two models agree to the last bit and letter."""
    dense = one.as_dense(), other.as_dense()
    pairs = [tuple(getattr(model, letter) for model in dense) for letter in LETTERS]
    matrices = all((a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()) for a, b in pairs)
    keys = ("dofs", "inputs", "outputs", "name", "prescribed")
    return matrices and all(getattr(one, key) == getattr(other, key) for key in keys)


def random_model(seed: int) -> SecondOrderModel:
    """Make a model with every matrix in use, complex stiffness, entries over many decades, and awkward names."""
    rng = np.random.default_rng(seed)

    def matrix(rows: int, columns: int) -> npt.NDArray[np.float64]:
        decades = np.ldexp(1.0, rng.integers(-400, 400, (rows, columns)))
        return np.asarray(rng.normal(size=(rows, columns)) * decades * (rng.random((rows, columns)) < 0.8))

    return mechss(
        matrix(3, 3),
        matrix(3, 3),
        matrix(3, 3) * (1 + 0.1j),
        **{letter: matrix(3, 2) for letter in ("B", "Bv", "Ba")},
        **{letter: matrix(4, 3) for letter in ("F", "G", "H")},
        **{letter: matrix(4, 2) for letter in ("D", "Dv", "Da")},
        dofs=["101.1", "ü 漢", "🔩"],
        inputs=["a:b", "100%"],
        outputs=["one", "two words", "[3]", "'"],
        name=f"model {seed}.1",
    )


def written_npz(path: Path, **arrays: Any) -> Path:  # noqa: ANN401
    """Let numpy write a file."""
    np.savez(path, **arrays)
    return path


def written_mat(path: Path, variables: dict[str, Any]) -> Path:
    """Let scipy write a file."""
    scipy.io.savemat(str(path), variables)
    return path


@ENDINGS
@pytest.mark.parametrize("seed", range(5))
def test_a_model_comes_back_to_the_last_bit(tmp_path: Path, ending: str, seed: int) -> None:
    """Matrices of all decades, complex ones, derivatives of inputs and names such as 101.1 survive."""
    model = random_model(seed)
    save_model(model, tmp_path / f"model{ending}")
    assert same(load_model(tmp_path / f"model{ending}"), model)


@ENDINGS
@pytest.mark.parametrize("model", [MOUNT, MOUNT.select("F_y", ["y", "y1_dot"]), mechss([[1]], None, [[2]])])
def test_the_model_without_its_name_or_with_its_defaults_comes_back(
    tmp_path: Path, ending: str, model: SecondOrderModel
) -> None:
    """Single DOFs, selected signals and a missing name are kept as they are."""
    save_model(model, str(tmp_path / f"model{ending}"))
    assert same(load_model(str(tmp_path / f"model{ending}")), model)


@ENDINGS
@pytest.mark.parametrize("kind", KINDS)
def test_a_prescribed_motion_comes_back(tmp_path: Path, ending: str, kind: MotionKind) -> None:
    """With names of the force on the DOF and of its motion where these are direct terms, and without."""
    full = {"inputs": ["F_y", motion_names(("y",), KINDS.index(kind))[0]], "outputs": ["y_dot", "y_ddot", "y2", "R_y"]}
    options: list[dict[str, Any]] = [{}, full]
    for signals in options:
        model = MOUNT.prescribe_motion("y", kind, **signals)
        save_model(model, tmp_path / f"model{ending}")
        assert same(load_model(tmp_path / f"model{ending}"), model)
    with pytest.raises(SignalNameError, match="The motion of y is prescribed already"):
        load_model(tmp_path / f"model{ending}").prescribe_motion("y")


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
def test_a_prescribed_model_without_signal_names_gets_the_usual_ones(tmp_path: Path) -> None:
    """As in mechss."""
    path = written_npz(tmp_path / "model.npz", K=K, dofs=np.array(["a", "b"]), prescribed=np.array(["b"]))
    assert (load_model(path).inputs, load_model(path).prescribed) == (("F_a", "F_b"), ("b",))


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
@pytest.mark.parametrize("missing", [(), ("M",), ("C",), ("M", "C")])
def test_a_file_with_the_stiffness_alone_is_a_model(tmp_path: Path, missing: tuple[str, ...]) -> None:
    """What is missing is as in mechss: no mass, no damping, a force on and the displacement of every DOF."""
    matrices = {letter: K for letter in ("M", "C", "K") if letter not in missing}
    model = load_model(written_npz(tmp_path / "model.npz", **matrices))
    given: list[Any] = [matrices.get(letter) for letter in ("M", "C", "K")]
    assert same(model, mechss(*given))


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
def test_a_matlab_file_may_hold_sparse_matrices_padded_names_and_other_variables(tmp_path: Path) -> None:
    """What MATLAB users have in a workspace is read: sparse K, char rows for names, a struct beside."""
    variables = {
        "M": scipy.sparse.csc_array(np.diag([2.0, 0.0])),
        "K": scipy.sparse.csc_array(K),
        "B": np.array([[1], [0]], dtype=np.uint8),
        "dofs": np.array(["y ", "y1"]),
        "inputs": "F_y",
        "options": {"solver": "care"},
    }
    model = load_model(written_mat(tmp_path / "model.mat", variables))
    assert same(model, mechss(np.diag([2.0, 0.0]), None, K, [[1.0], [0.0]], dofs=["y", "y1"], inputs=["F_y"]))


@ENDINGS
def test_a_state_space_comes_back_with_its_labels(tmp_path: Path, ending: str) -> None:
    """Which pickle cannot do."""
    sys = mech2ss(mechss([[1.0]], [[0.1]], [[3.0]], dofs=["101.1"], name="101"))
    save_system(sys, tmp_path / f"sys{ending}")
    back = load_system(tmp_path / f"sys{ending}")
    for letter in "ABCD":
        np.testing.assert_array_equal(getattr(back, letter), getattr(sys, letter))
    assert (back.state_labels, back.input_labels, back.output_labels) == (
        sys.state_labels,
        sys.input_labels,
        sys.output_labels,
    )
    assert (back.name, back.dt) == (sys.name, sys.dt)


@ENDINGS
@pytest.mark.parametrize("dt", [0, 0.1, True])
def test_the_sampling_period_of_a_state_space_is_kept(tmp_path: Path, ending: str, *, dt: float | bool) -> None:
    """Continuous, sampled, and sampled with unknown period."""
    save_system(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], dt), tmp_path / f"sys{ending}")
    assert load_system(tmp_path / f"sys{ending}").dt == dt


def test_a_state_space_is_no_model_and_a_model_no_state_space(tmp_path: Path) -> None:
    """Both hold matrices called B, C and D, so the others decide."""
    save_system(mech2ss(MOUNT), tmp_path / "sys.npz")
    save_model(MOUNT, tmp_path / "model.npz")
    with pytest.raises(FileFormatError, match=r"sys\.npz: no stiffness K in the file"):
        load_model(tmp_path / "sys.npz")
    with pytest.raises(FileFormatError, match=r"model\.npz: A not in the file"):
        load_system(tmp_path / "model.npz")


def test_a_state_space_with_clashing_labels_is_refused(tmp_path: Path) -> None:
    """python-control would merge two states of one name silently."""
    arrays = {"A": np.eye(2), "B": np.ones((2, 1)), "C": np.ones((1, 2)), "D": [[0.0]], "states": ["x", "x"]}
    with pytest.raises(FileFormatError, match=r"sys\.npz: Names of states must differ, but x"):
        load_system(written_npz(tmp_path / "sys.npz", **arrays))


def test_a_gain_is_a_labelled_table(tmp_path: Path) -> None:
    """The csv has states in its header, an input a row and every digit; npz has K and the names."""
    feedback = lqr(MOUNT.select("F_y", "y"), energy=1.0, effort={"F_y": 1e-4})
    save_gain(feedback, tmp_path / "gain.csv")
    save_gain(feedback, tmp_path / "gain.npz")
    header, row = list(csv.reader((tmp_path / "gain.csv").read_text().splitlines()))
    assert header == ["input", "y", "y1", "y2", "y_dot"]
    assert (row[0], [float(gain) for gain in row[1:]]) == ("F_y", feedback.K[0].tolist())
    with np.load(tmp_path / "gain.npz") as content:
        np.testing.assert_array_equal(content["K"], feedback.K)
        assert content["states"].tolist() == ["y", "y1", "y2", "y_dot"]


def test_a_frequency_table_has_every_channel_four_times(tmp_path: Path) -> None:
    """Real and imaginary part to the last digit, magnitude, and a phase without jumps in degrees."""
    omega = np.array([1.0, 17.7, 300.0])
    data = frequency_response(MOUNT.select("F_y", ["y", "y_ddot"]), omega)
    save_response(data, tmp_path / "bode.csv")
    with (tmp_path / "bode.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0])[:6] == [
        "omega [rad/s]",
        "f [Hz]",
        *(f"y/F_y {part}" for part in ("real", "imag", "magnitude", "phase [deg]")),
    ]
    values = [complex(float(row["y_ddot/F_y real"]), float(row["y_ddot/F_y imag"])) for row in rows]
    np.testing.assert_array_equal(values, np.asarray(data.frdata)[1, 0])
    np.testing.assert_array_equal([float(row["omega [rad/s]"]) for row in rows], omega)
    assert float(rows[2]["y/F_y phase [deg]"]) == pytest.approx(-180.0, abs=1.0)


def test_a_frequency_table_says_inf_at_a_pole_and_unwraps_around_it(tmp_path: Path) -> None:
    """A free mass at zero frequency has no finite response, which is no reason to lose the rest."""
    save_response(frequency_response(mechss([[1.0]], None, [[0.0]]), [0.0, 1.0]), tmp_path / "bode.csv")
    rows = list(csv.reader((tmp_path / "bode.csv").read_text().splitlines()))
    assert rows[1][4] == "inf"
    assert abs(float(rows[2][5])) == 180.0


def test_a_time_table_names_output_and_input(tmp_path: Path) -> None:
    """A step response of several inputs has a column a channel, a forced one a column an output."""
    sys = mech2ss(mechss(np.eye(2), np.eye(2), K, dofs=["101.1", "b"]))
    time = np.linspace(0.0, 1.0, 3)
    step = control.step_response(sys, time)
    save_response(step, tmp_path / "step.csv")
    save_response(control.forced_response(sys, time, np.ones((2, 3))), tmp_path / "forced.csv")
    rows = list(csv.reader((tmp_path / "step.csv").read_text().splitlines()))
    assert rows[0] == ["t [s]", "101.1/F_101.1", "101.1/F_b", "b/F_101.1", "b/F_b"]
    assert [float(row[2]) for row in rows[1:]] == np.asarray(step.y)[0, 1].tolist()
    assert (tmp_path / "forced.csv").read_text().splitlines()[0] == "t [s],101.1,b"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.txt", b"", r"the ending \.txt names no format for this. Use \.npz, \.npy, \.mat"),
        ("a", b"", r"the ending \(none\) names no format"),
        ("a.npz", b"", "no archive of arrays"),
        ("a.npz", b"\x80\x04N.", "no archive of arrays"),
        ("a.npz", b"PK\x03\x04 but no more", "damaged or of another kind"),
        ("a.mat", b"M = [1 2]", "no MATLAB version 5 file"),
        ("a.mat", b"MATLAB 7.3 MAT-file".ljust(600), "Save it with  save"),
    ],
)
def test_a_file_of_another_kind_is_refused_by_name(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    """The message starts with the file and says what to do."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FileFormatError, match=message) as caught:
        load_model(tmp_path / name)
    assert str(caught.value).startswith(str(tmp_path / name))
    assert caught.value.path == str(tmp_path / name)


def test_objects_are_not_unpickled(tmp_path: Path) -> None:
    """An object array in a file could run anything."""
    content = io.BytesIO()
    np.save(content, np.array([open], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("K.npy", content.getvalue())
    with pytest.raises(FileFormatError, match="allow_pickle=False"):
        load_model(tmp_path / "a.npz")


@pytest.mark.parametrize(
    ("arrays", "message", "cause"),
    [
        ({"K": [[np.nan]]}, r"K\[0, 0\] is nan", MatrixError),
        ({"K": [["a"]]}, "K holds entries of type <U1", MatrixError),
        ({"K": K, "M": K, "C": [[1.0]]}, r"differ in size \(M 2 x 2, C 1 x 1, K 2 x 2\)", type(None)),
        ({"K": K, "dofs": ["y", "y"]}, "Names of DOFs must differ", SignalNameError),
        ({"K": K, "dofs": [1.5, 2.0]}, "dofs must be names, but it holds entries of type float64", FileFormatError),
        (
            {"K": K, "M": np.eye(2), "C": np.eye(2), "name": ["a", "b"]},
            "name must be one text, but it has 2",
            FileFormatError,
        ),
    ],
)
def test_a_model_that_mechss_refuses_is_refused_with_the_file(
    tmp_path: Path, arrays: dict[str, Any], message: str, cause: type[Exception]
) -> None:
    """The refusal of the model stays visible as the cause."""
    with pytest.raises(FileFormatError, match=rf"a\.npz: .*{message}") as caught:
        load_model(written_npz(tmp_path / "a.npz", **arrays))
    assert isinstance(caught.value.__cause__, cause)


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
def test_names_in_bytes_are_read_as_text(tmp_path: Path) -> None:
    """Files of other programs hold names as bytes."""
    assert load_model(written_npz(tmp_path / "a.npz", K=K, dofs=np.array([b"y", b"z"]))).dofs == ("y", "z")


def test_a_matrix_too_large_to_be_held_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small archive may claim to hold any size."""
    monkeypatch.setattr("halfdof_ctrl.files.formats.variables.FREE_BYTES", 2e4)
    np.savez_compressed(tmp_path / "a.npz", K=np.ones((100, 100)))
    with pytest.raises(FileFormatError, match=r"K would take 80000 bytes, more than are unpacked from"):
        load_model(tmp_path / "a.npz")


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    """Neither to read nor to replace."""
    (tmp_path / "a.npz").mkdir()
    with pytest.raises(FileFormatError, match="this is no file"):
        load_model(tmp_path / "a.npz")
    with pytest.raises(FileFormatError, match="something of that name that is no file"):
        save_model(MOUNT, tmp_path / "a.npz")


def test_names_that_files_do_not_keep_are_refused(tmp_path: Path) -> None:
    """NumPy drops a null character at the end of a text."""
    with pytest.raises(FileFormatError, match="holds a control character"):
        save_model(mechss([[1.0]], None, [[1.0]], name="y\0"), tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    """Files are written beside their target, which is replaced at the end."""
    target = tmp_path / "a.csv"
    target.write_text("old")
    with pytest.raises(RuntimeError, match="on purpose"), replacing(target) as stream:  # noqa: PT012
        stream.write(b"half")
        msg = "on purpose"
        raise RuntimeError(msg)
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]
    assert target.read_text() == "old"


def test_a_file_is_replaced_whole_with_the_usual_permissions_and_through_links(tmp_path: Path) -> None:
    """A link stays a link, and others may read what the umask lets them."""
    (tmp_path / "link.npz").symlink_to(tmp_path / "a.npz")
    save_model(MOUNT, tmp_path / "link.npz")
    (tmp_path / "plain").touch()
    assert (tmp_path / "link.npz").is_symlink()
    assert (tmp_path / "a.npz").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_missing_folder_is_named_and_not_a_temporary_file(tmp_path: Path) -> None:
    """The user knows the target's name, not ours."""
    with pytest.raises(FileNotFoundError, match=r"b/a\.npz"):
        save_model(MOUNT, tmp_path / "b" / "a.npz")


def valid_files(folder: Path) -> list[Path]:
    """Write a model in every format."""
    paths = [folder / f"a{ending}" for ending in (".npz", ".mat")]
    for path in paths:
        save_model(random_model(1), path)
    sparse = {"C": scipy.sparse.csc_array(K), "dofs": np.array(["y ", "y1"]), "K": scipy.sparse.csc_array(K)}
    return [*paths, written_mat(folder / "sparse.mat", sparse)]


def test_no_beginning_of_a_file_passes_for_a_model(tmp_path: Path) -> None:
    """Cut at every length, a file that we wrote is refused, and by HalfdofError alone."""
    for path in valid_files(tmp_path)[:2]:
        content = path.read_bytes()
        for length in range(0, len(content), 1 if len(content) < 2000 else 7):
            path.write_bytes(content[:length])
            with pytest.raises(HalfdofError, match=path.name):
                load_model(path)


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
@given(data=st.data())
def test_a_damaged_file_loads_or_is_refused_by_name(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Bytes changed at random never raise anything else, hang or crash."""
    folder = tmp_path_factory.getbasetemp() / f"damaged{os.getpid()}"
    folder.mkdir(exist_ok=True)
    path = data.draw(st.sampled_from(valid_files(folder)))
    content = bytearray(path.read_bytes())
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=3)):
        content[place] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    try:
        load_model(path)
        refusal = f"{path}: none"
    except HalfdofError as caught:
        refusal = str(caught)
    assert refusal.startswith(str(path))
    assert "\n" not in refusal


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_sparse_models_stay_sparse_in_files(ending: str, tmp_path: Path) -> None:
    """All matrices and names come back, with complex stiffness and prescribed motion too."""
    structure = spring_grid(9, 7, 5, dampers=2)
    model = mechss(structure.M, structure.C, structure.K * (1.0 + 0.05j), name="net").select(
        ["F_q3"], ["q5_ddot", "q6"]
    )
    for saved in (model, model.prescribe_motion("q11", outputs=["R_q11", "q5_ddot"])):
        save_model(saved, tmp_path / f"net.{ending}")
        loaded = load_model(tmp_path / f"net.{ending}")
        assert loaded.is_sparse
        for letter in LETTERS:
            np.testing.assert_array_equal(getattr(loaded, letter).toarray(), getattr(saved, letter).toarray())
        for key in ("dofs", "inputs", "outputs", "prescribed", "name"):
            assert getattr(loaded, key) == getattr(saved, key)


class Broken(Mapping[str, str]):
    """A mapping that fails when it is read."""

    def __getitem__(self, key: str) -> str:
        """Fail."""
        msg = "out of order"
        raise RuntimeError(msg)

    def __iter__(self) -> Iterator[str]:
        """Promise a stiffness."""
        return iter(["K"])

    def __len__(self) -> int:
        """Promise one matrix."""
        return 1


def test_a_mapping_that_fails_is_refused_by_the_name_of_its_argument() -> None:
    """Of paths and of matrices, with what it raised."""
    with pytest.raises(ParameterError, match=r"path is called as a mapping.*RuntimeError: out of order"):
        load_model(Broken())
    with pytest.raises(ParameterError, match=r"matrices is called as a mapping.*RuntimeError: out of order"):
        inspect_files("model.npz", matrices=Broken())


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
@pytest.mark.parametrize("numbers", [np.array([101, 20002]), np.array([[101.0], [20002.0]])])
@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_numbers_of_nodes_are_names_of_dofs(tmp_path: Path, ending: str, numbers: np.ndarray) -> None:
    """As `mechss` takes whole numbers in a list; MATLAB has them as doubles."""
    path = tmp_path / f"a.{ending}"
    if ending == "npz":
        np.savez(path, K=K, M=np.eye(2), dofs=numbers)
    else:
        scipy.io.savemat(path, {"K": K, "M": np.eye(2), "dofs": numbers})
    model = load_model(path)
    assert (model.dofs, model.inputs) == (("101", "20002"), ("F_101", "F_20002"))
    assert load_model(path).select("F_101", "20002").outputs == ("20002",)
