"""Claims about the command: what it writes and prints, and how it refuses."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csc_array

from halfdof_ctrl import dynamic_stiffness, frequency_response, hydromount, mech2ss, mechss, transmissibility
from halfdof_ctrl.base.errors import HalfdofError
from halfdof_ctrl.cli import EXAMPLES, main
from halfdof_ctrl.design.lqr import lqr
from halfdof_ctrl.files.models import save_model
from halfdof_ctrl.files.systems import load_system
from halfdof_ctrl.model.sparse_evaluation import SparseTransfer
from halfdof_ctrl.systems.check_result import CrossCheck
from support.fe_files import C, K, M, abaqus, matrix_market
from support.fe_models import spring_grid

COMMAND = [sys.executable, "-c", "from halfdof_ctrl.cli import main; raise SystemExit(main())"]
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
MOUNT = hydromount().select("F_y", ["y", "y_dot"])
SAME = 1e-12  #: relative difference of numbers that went through a table and another grid


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let relative paths lead into a folder of the test."""
    monkeypatch.chdir(tmp_path)


def failing(check: CrossCheck) -> CrossCheck:
    """Let a check miss a state."""
    values = {key: getattr(check, key) for key in check.__slots__}
    return CrossCheck(**{**values, "n_finite": check.n_finite + 1, "count_grade": 2, "max_pole_error": float("inf")})


def table(path: str) -> list[list[str]]:
    """Read a csv."""
    return list(csv.reader(Path(path).read_text(encoding="utf-8").splitlines()))


def test_report_writes_the_folder_and_prints_the_papers_table(capsys: pytest.CaptureFixture[str]) -> None:
    """Eigenvalues before and after, with the infinite ones, and the check."""
    assert main(["report", "hydromount", "-o", "report"]) == 0
    printed = capsys.readouterr()
    for words in ("-0.6897 ± 17.7059j", "-8.7797", "-3.1742", "2 infinite eigenvalues", "Cross-check passed"):
        assert words in printed.out
    assert printed.out.count("infinite             none") == 2
    assert printed.err == ""
    assert Path("report/index.html").is_file()


@pytest.mark.parametrize(
    "arguments", [["poles", "hydromount", "-o", "a.png"], ["bode", "hydromount", "--hz", "--db", "-o", "a.svg"]]
)
def test_figures_have_the_format_of_their_ending(arguments: list[str]) -> None:
    """PNG and SVG by their first bytes."""
    assert main(arguments) == 0
    content = Path(arguments[-1]).read_bytes()
    assert content.startswith(b"\x89PNG") if arguments[-1].endswith("png") else b"<svg" in content


@pytest.mark.parametrize("command", ["step", "lqr"])
def test_pdf_figures_are_written(command: str) -> None:
    """The step response and the pole map with the regulator, without a display."""
    assert main([command, "hydromount", "--outputs", "y", "-o", "a.pdf"]) == 0
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")


def test_bode_numbers_are_those_of_frequency_response() -> None:
    """At the frequencies asked for, the limits being points."""
    assert main(["bode", "hydromount", "--omega-min", "1", "--omega-max", "100", "--points", "3", "-o", "a.csv"]) == 0
    rows = table("a.csv")
    assert [float(row[0]) for row in rows[1:]] == pytest.approx([1.0, 10.0, 100.0], rel=1e-14)
    exact = np.asarray(frequency_response(MOUNT, [float(row[0]) for row in rows[1:]]).frdata)[0, 0]
    np.testing.assert_array_equal([complex(float(row[2]), float(row[3])) for row in rows[1:]], exact)


def test_a_single_limit_keeps_the_other_one() -> None:
    """The default grid reaches from a tenth of the slowest to ten times the fastest pole."""
    assert main(["bode", "hydromount", "--omega-max", "5", "-o", "a.csv"]) == 0
    omega = [float(row[0]) for row in table("a.csv")[1:]]
    assert [omega[0], omega[-1]] == pytest.approx([0.3174, 5.0], rel=1e-3)


def test_stiffness_numbers_are_those_of_dynamic_stiffness() -> None:
    """Of the mount alone, from rest on evenly spread frequencies; with --log as bode spreads them."""
    mount = ["stiffness", "hydromount", "-p", "m=0", "--omega-max", "100", "--points", "3", "-o", "a.csv"]
    assert main(mount) == 0
    rows = table("a.csv")
    assert rows[0][2:] == ["R_y/y real", "R_y/y imag", "R_y/y magnitude", "R_y/y phase [deg]"]
    assert [float(row[0]) for row in rows[1:]] == [0.0, 50.0, 100.0]
    exact = dynamic_stiffness(hydromount(m=0), "y", [0.0, 50j, 100j])
    np.testing.assert_array_equal([complex(float(row[2]), float(row[3])) for row in rows[1:]], exact)
    assert main([*mount, "--log", "--omega-min", "1", "--dof", "y,y1"]) == 0
    rows = table("a.csv")
    assert [float(row[0]) for row in rows[1:]] == pytest.approx([1.0, 10.0, 100.0], rel=1e-14)
    assert rows[0][2] == "R_y+R_y1/y+y1 real"


@pytest.mark.parametrize("arguments", [[], ["--log", "--omega-max", "100"], ["--dof", "y1"]])
def test_stiffness_is_drawn(arguments: list[str]) -> None:
    """The loaded mount at y unless another DOF is asked for."""
    assert main(["stiffness", "hydromount", *arguments, "-o", "a.svg"]) == 0
    assert b"<svg" in Path("a.svg").read_bytes()


def test_stiffness_of_a_file_needs_a_dof_where_there_are_several(capsys: pytest.CaptureFixture[str]) -> None:
    """The only one is meant by itself."""
    save_model(mechss([[1.0]], None, [[1.0]]), "one.npz")
    save_model(hydromount(), "three.npz")
    assert main(["stiffness", "one.npz", "-o", "a.csv"]) == 0
    assert main(["stiffness", "three.npz", "-o", "b.csv"]) == 2
    assert "--dof must name the DOF whose dynamic stiffness is meant: y, y1, y2." in capsys.readouterr().err
    assert not Path("b.csv").exists()
    assert main(["stiffness", "three.npz", "--dof", "y", "-o", "b.csv"]) == 0


def test_step_numbers_include_the_recovered_half_dofs() -> None:
    """As the figure shows them; the last time is the one asked for."""
    assert main(["step", "hydromount", "--time", "2", "-o", "a.csv"]) == 0
    rows = table("a.csv")
    assert rows[0] == ["t [s]", "y/F_y", "y_dot/F_y", "y1/F_y", "y2/F_y"]
    exact = control.step_response(mech2ss(MOUNT), np.array([float(row[0]) for row in rows[1:]]), squeeze=False)
    assert float(rows[-1][0]) == 2.0
    np.testing.assert_allclose([float(row[1]) for row in rows[1:]], np.asarray(exact.y)[0, 0], rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_ss_writes_the_state_space_of_a_model_file(ending: str) -> None:
    """From one file to the other, in both formats."""
    model = mechss(np.diag([1.0, 0.0]), np.eye(2), [[3.0, -1.0], [-1.0, 2.0]], dofs=["101.1", "b"])
    save_model(model, f"model.{ending}")
    assert main(["ss", f"model.{ending}", "--outputs", "b,101.1_dot", "-o", f"sys.{ending}"]) == 0
    expected = mech2ss(model.select(outputs=["b", "101.1_dot"]))
    np.testing.assert_array_equal(load_system(f"sys.{ending}").C, expected.C)
    assert load_system(f"sys.{ending}").output_labels == ["b", "101:1_dot"]


def test_ss_and_info_print_what_python_prints(capsys: pytest.CaptureFixture[str]) -> None:
    """The state space with its labels; the model, its pencil and its reduction."""
    assert main(["ss", "hydromount"]) == 0
    assert main(["info", "hydromount"]) == 0
    printed = capsys.readouterr().out
    assert str(mech2ss(MOUNT)) in printed
    assert repr(MOUNT) in printed
    assert "Pencil: regular, 4 finite and 2 infinite eigenvalues, index 0" in printed
    assert "ExactReduction by selection: 4 states" in printed


def test_states_of_a_printed_state_space_can_be_chosen(capsys: pytest.CaptureFixture[str]) -> None:
    """--states takes what `mech2ss` takes."""
    assert main(["ss", "hydromount", "--states", "energy"]) == 0
    assert str(mech2ss(MOUNT, states="energy")) in capsys.readouterr().out


def test_info_counts_free_motions(capsys: pytest.CaptureFixture[str]) -> None:
    """Two masses that nothing ties to the ground: one motion, two poles at 0."""
    save_model(mechss(np.eye(2), None, [[1, -1], [-1, 1]]), "free.npz")
    assert main(["info", "free.npz"]) == 0
    assert "1 free motion: 2 poles at exactly 0" in capsys.readouterr().out


def test_info_says_why_a_model_has_no_state_space(capsys: pytest.CaptureFixture[str]) -> None:
    """To learn that is what info is for."""
    save_model(mechss([[1.0]], None, [[1.0 + 0.1j]]), "model.npz")
    assert main(["info", "model.npz"]) == 0
    assert "No state space: K has imaginary parts" in capsys.readouterr().out


def test_parameters_and_signals_of_the_mount_can_be_chosen(capsys: pytest.CaptureFixture[str]) -> None:
    """-p changes a parameter, repeatedly; --inputs and --outputs pick any signal."""
    assert main(["ss", "hydromount", "-p", "C_h=450", "-p", "m=10", "--inputs", "F_y,F_y2", "--outputs=y2"]) == 0
    expected = mech2ss(hydromount(C_h=450.0, m=10.0).select(["F_y", "F_y2"], "y2"))
    assert str(expected) in capsys.readouterr().out


def test_poles_prints_the_table_before_and_after(capsys: pytest.CaptureFixture[str]) -> None:
    """The paper's."""
    assert main(["poles", "hydromount"]) == 0
    assert "-0.6897 ± 17.7059j   -0.6897 ± 17.7059j" in capsys.readouterr().out


def test_lqr_prints_and_writes_the_gain_of_the_weights(capsys: pytest.CaptureFixture[str]) -> None:
    """Weights by physical quantity, several in one option or in several."""
    weights = ["--displacement", "y=1e6,y1=2", "--velocity", "y=3", "--acceleration", "y=4", "--effort", "F_y=1e-4"]
    assert main(["lqr", "hydromount", *weights, "--energy", "5", "-o", "gain.csv"]) == 0
    expected = lqr(
        MOUNT,
        displacement={"y": 1e6, "y1": 2.0},
        velocity={"y": 3.0},
        acceleration={"y": 4.0},
        effort={"F_y": 1e-4},
        energy=5.0,
    )
    assert [float(gain) for gain in table("gain.csv")[1][1:]] == expected.K[0].tolist()
    assert repr(expected) in capsys.readouterr().out


def test_lqr_without_weights_takes_the_default_design_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    """The one of the report."""
    assert main(["lqr", "hydromount"]) == 0
    assert "minimizes the integral of the mechanical energy [J] plus" in capsys.readouterr().out


def test_check_passes_and_writes_its_figures(capsys: pytest.CaptureFixture[str]) -> None:
    """As JSON."""
    assert main(["check", "hydromount", "-o", "check.json"]) == 0
    assert "Cross-check passed" in capsys.readouterr().out
    assert json.loads(Path("check.json").read_text(encoding="utf-8"))["n_infinite"] == 2


def test_a_failed_check_is_exit_code_one(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """With the files written, and numbers that JSON does not know as null."""
    from halfdof_ctrl import crosscheck  # noqa: PLC0415

    for module in ("commands", "report"):
        monkeypatch.setattr(f"halfdof_ctrl.{module}.crosscheck", lambda *given: failing(crosscheck(*given)))
    assert main(["check", "hydromount", "-o", "check.json"]) == 1
    assert main(["report", "hydromount", "--outputs", "y", "-o", "report"]) == 1
    assert "Cross-check FAILED" in capsys.readouterr().out
    assert json.loads(Path("check.json").read_text(encoding="utf-8"))["max_pole_error"] is None
    assert "Cross-check FAILED" in Path("report/index.html").read_text(encoding="utf-8")


REFUSALS = [
    ("info hydromunt", "hydromunt: neither a file nor a built-in model. Built in: hydromount."),
    ("info model.npz", "model.npz: No such file or directory"),
    ("info bad.npz", "bad.npz: this is no archive of arrays"),
    ("info bad.npz -p C_h=1", "-p changes parameters of built-in models (hydromount); bad.npz is a file."),
    ("bode hydromount -o a.gif", "a.gif: the ending .gif names no format for this. Use .png, .svg, .pdf, .csv."),
    ("ss hydromount -o a.csv", "a.csv: the ending .csv names no format for this. Use .npz, .mat."),
    ("check hydromount -o a.txt", "Use .json."),
    ("poles hydromount -o a.csv", "Use .png, .svg, .pdf."),
    ("bode hydromount -p C_h=a -o a.png", "-p C_h must be a number, not 'a'."),
    ("bode hydromount -p C_h -o a.png", "-p takes a name and a number, NAME=VALUE, not 'C_h'."),
    ("bode hydromount -p m=1 -p m=2 -o a.png", "-p gives m twice."),
    ("bode hydromount -p c=1 -o a.png", "hydromount has no parameter 'c'. Known: m, K_r"),
    ("bode hydromount -p m=-1 -o a.png", "the mass on the mount must be a number that is not negative"),
    ("bode hydromount -p m=nan -o a.png", "the mass on the mount must be a number that is not negative"),
    ("bode hydromount --inputs F_q -o a.png", "The model has no input 'F_q'. Known: F_y, F_y1, F_y2."),
    ("bode hydromount --outputs , -o a.png", "No output is selected"),
    ("bode hydromount --omega-min 5 --omega-max 1 -o a.csv", "must be positive and rise"),
    ("bode hydromount --omega-min nan -o a.csv", "must be positive and rise"),
    ("bode hydromount --points 1 -o a.csv", "--points 1, but a range of frequencies has 2 to 1000000 of them."),
    ("stiffness hydromount --dof q -o a.png", "The model has no DOF 'q'. Known: y, y1, y2."),
    ("stiffness hydromount --dof , -o a.csv", "No DOF is named"),
    ("stiffness hydromount --omega-min -1 -o a.csv", "must be positive and rise"),
    ("stiffness hydromount --log --omega-min 0 -o a.csv", "must be positive and rise"),
    ("stiffness hydromount -o a.npz", "Use .png, .svg, .pdf, .csv."),
    ("bode hydromount -o no/a.png", "no/a.png: No such file or directory"),
    ("bode hydromount -o bad.npz/a.png", "bad.npz/a.png: Not a directory"),
    ("step hydromount --time -1 -o a.png", "must be a positive number of seconds, not -1.0"),
    ("step hydromount --time nan -o a.csv", "must be a positive number of seconds"),
    ("lqr hydromount --energy 1", "The inputs F_y cost nothing"),
    ("lqr hydromount --displacement q=1 --effort F_y=1", "no DOF 'q'"),
    ("ss hydromount --inputs F_y1 --outputs y1_ddot", "y1_ddot from F_y1 (grows as s^1)"),
    ("report hydromount --inputs F_y1 --outputs y1_ddot -o report", "y1_ddot from F_y1 (grows as s^1)"),
    ("report hydromount -o bad.npz", "bad.npz: there is something of that name that is no report"),
]


@pytest.mark.parametrize(("line", "message"), REFUSALS)
def test_what_is_refused_gets_one_line_and_exit_code_two(
    line: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """On stderr, with nothing written and nothing printed."""
    Path("bad.npz").write_bytes(b"M = 1")
    assert main(line.split()) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.startswith("halfdof-ctrl: error: ")
    assert (printed.err.count("\n"), printed.out) == (1, "")
    assert [file.name for file in Path().iterdir()] == ["bad.npz"]


@pytest.mark.parametrize(
    "line",
    [
        "nonsense hydromount",
        "bode",
        "bode hydromount",
        "bode hydromount --points x -o a.png",
        "ss a --abc",
        "stiffness hydromount",
        "stiffness hydromount --outputs y -o a.png",
    ],
)
def test_what_the_parser_does_not_know_is_exit_code_two(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    """With the usage, by argparse."""
    with pytest.raises(SystemExit, match="2"):
        main(line.split())
    assert "usage: halfdof-ctrl" in capsys.readouterr().err


def test_a_warning_is_one_line_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    """A nearly massless DOF, once, and what python-control will lose for it, once."""
    save_model(mechss(np.diag([1.0, 1e-13]), np.eye(2), np.eye(2), dofs=["a", "b"]), "model.npz")
    assert main(["ss", "model.npz"]) == 0
    mass, *others = capsys.readouterr().err.splitlines()
    assert mass.startswith("halfdof-ctrl: warning: DOFs b have a mass of at most")
    assert len(others) <= 1
    assert all(line.startswith("halfdof-ctrl: warning: A, B, C and D are right, but python-control") for line in others)


def test_an_interrupt_is_silent_and_exit_code_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As shells report it."""

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("halfdof_ctrl.commands.mech2ss", interrupted)
    assert main(["ss", "hydromount"]) == 130
    assert capsys.readouterr() == ("", "")


def test_a_refusal_of_many_lines_is_printed_as_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever stands in a name or in a message of another library."""

    def refused(*_: object, **__: object) -> None:
        msg = "two\nlines"
        raise HalfdofError(msg)

    monkeypatch.setattr("halfdof_ctrl.commands.mech2ss", refused)
    assert main(["ss", "hydromount"]) == 2
    assert capsys.readouterr().err == "halfdof-ctrl: error: two lines\n"


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """That of the installed package."""
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out.startswith("halfdof-ctrl 0.")


def test_the_command_runs_as_a_process_of_its_own(tmp_path: Path) -> None:
    """A refusal, a terminal without ±, and a reader that goes away."""
    environment = {**ENVIRONMENT, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [*COMMAND, "poles", "hydromount"], env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert r"-0.6897 \xb1 17.7059j" in done.stdout
    with subprocess.Popen(
        [*COMMAND, "info", "hydromount"], env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141


def test_info_looks_at_exported_files_first(capsys: pytest.CaptureFixture[str]) -> None:
    """What was found in them, then the model; warnings on stderr."""
    Path("job_STIF1.mtx").write_text(abaqus(K))
    Path("job_MASS1.mtx").write_text(abaqus(M))
    assert main(["info", "job_STIF1.mtx", "--outputs", "n1_u1"]) == 0
    printed = capsys.readouterr()
    assert printed.out.startswith("ImportReport: 3 DOFs, named by node and component")
    assert "SecondOrderModel: 3 DOFs: 2 inertial, 0 half, 1 static" in printed.out
    assert "halfdof-ctrl: warning: job_STIF1.mtx: no damping C in" in printed.err


def test_info_takes_a_folder_and_no_time_for_large_pencils(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """QZ of thousands of DOFs takes hours."""
    monkeypatch.setattr("halfdof_ctrl.commands.LARGEST_PRINTED", 2)
    Path("exported").mkdir()
    Path("exported/K.mtx").write_text(matrix_market(K))
    assert main(["info", "exported"]) == 0
    assert "Pencil: not shown above 2 DOFs." in capsys.readouterr().out


def test_other_commands_take_exported_files(capsys: pytest.CaptureFixture[str]) -> None:
    """Signals are selected by the names of nodes."""
    for word, matrix in (("STIF", K), ("MASS", M), ("DMPV", C)):
        Path(f"job_{word}1.mtx").write_text(abaqus(matrix))
    assert main(["check", "job_STIF1.mtx", "--inputs", "F_n3_u1", "--outputs", "n1_u1,n3_u1"]) == 0
    assert "Cross-check passed" in capsys.readouterr().out


def net(masses: int, ending: str = "npz") -> str:
    """Save a sparse net of springs of 26 x 23 nodes, with damping where there is mass."""
    structure = spring_grid(26, 23, masses)
    damping = csc_array(1e-4 * structure.K + structure.M) if masses > 100 else csc_array(3.0 * structure.M)
    save_model(mechss(structure.M, damping, structure.K, name="net"), f"net.{ending}")
    return f"net.{ending}"


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_sparse_models_with_few_masses_go_all_the_way(ending: str, capsys: pytest.CaptureFixture[str]) -> None:
    """State space, step response and reduction of 598 DOFs with three masses."""
    path = net(3, ending)
    signals = ["--inputs", "F_q100", "--outputs", "q100,q7"]
    assert main(["ss", path, *signals, "-o", "net_ss.npz"]) == 0
    assert load_system("net_ss.npz").nstates == 6
    assert main(["step", path, *signals, "-o", "step.csv"]) == 0
    assert table("step.csv")[0] == ["t [s]", "q100/F_q100", "q7/F_q100"]
    assert main(["info", path]) == 0
    printed = capsys.readouterr().out
    assert "Pencil: not shown above 500 DOFs." in printed
    assert "ExactReduction by selection: 6 states" in printed


def test_sparse_models_with_many_states_get_a_bode_diagram_without_a_state_space() -> None:
    """1794 states: the descriptor form at the frequencies asked for, or at a few by default."""
    path = net(598)
    command = ["bode", path, "--inputs", "F_q100", "--outputs", "q7"]
    limits = ["--omega-min", "1", "--omega-max", "20", "--points", "5"]
    assert main([*command, *limits, "-o", "five.csv"]) == 0
    rows = table("five.csv")
    assert len(rows) == 6
    model = spring_grid(26, 23, 598)
    s = 20.0j
    P = (model.K * (1.0 + 1e-4 * s) + model.M * (s + s**2)).toarray()
    desired = np.linalg.solve(P, np.eye(598)[:, 100])[7]
    np.testing.assert_allclose([float(text) for text in rows[-1][2:4]], [desired.real, desired.imag], rtol=1e-8)
    assert main([*command, "-o", "default.csv"]) == 0
    assert len(table("default.csv")) == 201


def test_an_interrupted_bode_diagram_writes_what_is_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit code is that of an interrupt, the file is whole."""
    at, calls = SparseTransfer.at, []

    def evaluate(transfer: SparseTransfer, s: complex) -> np.ndarray:
        calls.append(s)
        if len(calls) > 3:
            raise KeyboardInterrupt
        return at(transfer, s)

    monkeypatch.setattr(SparseTransfer, "at", evaluate)
    command = ["bode", net(598), "--inputs", "F_q100", "--outputs", "q7", "--omega-min", "1", "--omega-max", "20"]
    assert main([*command, "-o", "part.csv"]) == 130
    assert len(table("part.csv")) == 4
    assert "warning: Interrupted after 3 of 200 frequencies" in capsys.readouterr().err


def numbers(path: str) -> np.ndarray:
    """Read a table without its header."""
    return np.loadtxt(path, delimiter=",", skiprows=1)


def test_the_bare_command_prints_help(capsys: pytest.CaptureFixture[str]) -> None:
    """With every command."""
    assert main([]) == 0
    printed = capsys.readouterr().out
    assert all(command in printed for command in EXAMPLES)


@pytest.mark.parametrize("command", list(EXAMPLES))
def test_each_help_has_an_example_that_runs(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """And the names of the parameters of built-in models."""
    with pytest.raises(SystemExit):
        main([command, "--help"])
    printed = " ".join(capsys.readouterr().out.split())
    assert f"Example: halfdof-ctrl {command} {EXAMPLES[command]}" in printed
    assert "m, K_r, K_rs, K_v, K_s, C_rs, C_h" in printed
    assert main([command, *EXAMPLES[command].split()]) == 0


def test_limits_may_be_given_in_hz(capsys: pytest.CaptureFixture[str]) -> None:
    """The second column of a table; the same limit in both units is refused."""
    command = ["bode", "hydromount", "--f-min", "0.5", "--f-max", "8", "--points", "5", "-o", "a.csv"]
    assert main(command) == 0
    assert_allclose(numbers("a.csv")[:, 1], [0.5, 1.0, 2.0, 4.0, 8.0], rtol=SAME)
    assert main([*command, "--omega-max", "9"]) == 2
    assert "--omega-max and --f-max are the same limit" in capsys.readouterr().err


def test_stiffness_of_the_built_in_model_is_that_of_the_mount_alone() -> None:
    """As on a test rig, unless a mass is asked for."""
    grid = ["--f-max", "20", "--f-min", "1", "--points", "3"]
    assert main(["stiffness", "hydromount", *grid, "-o", "a.csv"]) == 0
    s = 2j * np.pi * numbers("a.csv")[:, 1]
    assert_allclose(numbers("a.csv")[:, 4], np.abs(dynamic_stiffness(hydromount(m=0), "y", s)), rtol=SAME)
    assert main(["stiffness", "hydromount", "-p", "m=20", *grid, "-o", "b.csv"]) == 0
    assert_allclose(numbers("b.csv")[:, 4], np.abs(dynamic_stiffness(hydromount(m=20), "y", s)), rtol=SAME)


@pytest.mark.parametrize("force", [False, True])
def test_transmissibility_numbers_are_those_of_transmissibility(*, force: bool) -> None:
    """Of motion, and of force."""
    command = ["transmissibility", "hydromount", "--from", "y", "--to", "y2", "--points", "3", *["--force"] * force]
    assert main([*command, "-o", "a.csv"]) == 0
    s = 2j * np.pi * numbers("a.csv")[:, 1]
    exact = transmissibility(hydromount(), "y", "y2", s, kind="force" if force else "motion")
    assert_allclose(numbers("a.csv")[:, 4], np.abs(exact), rtol=SAME)
    assert main([*command, "--db", "-o", "a.svg"]) == 0


@pytest.mark.parametrize("target", ["a.csv", "a.png"])
def test_a_response_beyond_the_largest_number_is_refused(target: str, capsys: pytest.CaptureFixture[str]) -> None:
    """An unstable model, looked at for too long; nothing is written."""
    save_model(mechss([[1.0]], [[-1.0]], [[1.0]]), "unstable.npz")
    assert main(["step", "unstable.npz", "--time", "1e6", "-o", target]) == 2
    assert "beyond the largest number" in capsys.readouterr().err
    assert not Path(target).exists()


@pytest.mark.parametrize("option", ["--omega-min", "--f-max", "--points"])
def test_two_dashes_are_no_value(option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Argparse makes a list without entries of ``--points=--``."""
    with pytest.raises(SystemExit) as end:
        main(["bode", "hydromount", "-o", str(tmp_path / "b.csv"), f"{option}=--"])
    assert end.value.code == 2
    assert f"error: argument {option}: expected one argument" in capsys.readouterr().err
