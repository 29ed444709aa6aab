"""Wrong command lines: one named error on stderr, exit code 2, nothing on stdout, nothing written."""

import errno
import io
import os
import shlex
from pathlib import Path

import numpy as np
import pytest

from halfdof_ctrl import hydromount, mechss, save_model
from halfdof_ctrl.cli import main

WRONG = r"""
poles nofile
poles folder
poles empty.npz
poles text.txt
poles junk.mat
poles bad.npz
poles shape.npz
poles floating.npz
poles complex.npz
poles loop
poles hydromount --nope
poles hydromount -o p.csv
poles hydromount -o p
poles hydromount --outputs y_ddot_dot
check mount.npz -o check.txt
check mount.npz -o folder
check mount.npz -o nofolder/check.json
check complex.npz
info
info hydromount -p C_h=-1
info hydromount -p C_h=abc
info hydromount -p C_h
info hydromount -p nope=3
info hydromount -p C_h=nan
info hydromount -p C_h=1 -p C_h=2
info mount.npz -p C_h=1
info hydromount --matrix C=D
info hydromount --triangle middle
info hydromount --element
info hydromount --element 'damper nope quadratic(1,2)'
info hydromount extra
bode
bode hydromount
bode hydromount -o
bode hydromount -o b.xyz
bode hydromount -o .png
bode hydromount -o folder
bode hydromount -o one.csv -o two.csv
bode hydromount -o b.csv --f-min 10 --f-max 1
bode hydromount -o b.csv --f-min nan
bode hydromount -o b.csv --f-min abc
bode hydromount -o b.csv --f-min 1 --f-min 2
bode hydromount -o b.csv --f-min 1 --omega-min 1
bode hydromount -o b.csv --points 0
bode hydromount -o b.csv --points 99999999999
bode hydromount -o b.csv --inputs nope
bode hydromount -o b.csv --outputs y,y
bode hydromount -o b.csv --inputs F_ÿ
bode hydromount -o b.png --f-min 1e-320 --f-max 1e300
step hydromount -o s.csv --time -1
step hydromount -o s.csv --time nan
step hydromount -o s.csv --amplitude 2
step unstable.npz -o s.csv --time 1e6
step unstable.npz -o s.png --time 1e6
stiffness hydromount -o k.csv --dof nope
stiffness mount.npz -o k.csv
transmissibility hydromount --from y -o t.csv
transmissibility hydromount --from y --to nope -o t.csv
lqr hydromount --displacement y=-1
lqr hydromount --displacement y=abc
lqr hydromount --displacement nope=1 --effort F_y=1
lqr hydromount -o k.xyz
ss hydromount -o ss.csv
ss hydromount --states nope
ss hydromount --states modal --states dofs
report hydromount
report hydromount -o text.txt
report hydromount -o foreign
report floating.npz -o report
nope
nope hydromount
--nope
"--nope\033[31m"
"poles\033" hydromount
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder with models that are sound, wrong, and none."""
    path = tmp_path_factory.mktemp("models")
    (path / "folder").mkdir()
    (path / "foreign").mkdir()
    (path / "foreign/index.html").write_text("<p>mine")
    (path / "text.txt").write_text("hello\n")
    (path / "empty.npz").write_bytes(b"")
    (path / "junk.mat").write_bytes(np.random.default_rng(0).bytes(200))
    (path / "loop").symlink_to("loop")
    np.savez(path / "bad.npz", M=np.array([[1.0, np.nan], [0.0, 1.0]]), K=np.eye(2))
    np.savez(path / "shape.npz", M=np.eye(2), K=np.eye(3))
    save_model(hydromount(), path / "mount.npz")
    save_model(mechss([[1, 0], [0, 0]], None, [[1, 0], [0, 0]]), path / "floating.npz")
    save_model(mechss([[1.0]], [[-1.0]], [[1.0]]), path / "unstable.npz")
    save_model(mechss([[1.0]], None, [[1 + 0.1j]]), path / "complex.npz")
    return path


@pytest.mark.parametrize("line", WRONG.strip().splitlines())
def test_a_wrong_command_line_is_one_error(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    """And leaves the folder as it was."""
    monkeypatch.chdir(folder)
    before = {path: path.lstat().st_mtime_ns for path in folder.rglob("*")}
    try:
        code: object = main([text.replace("\\033", "\033") for text in shlex.split(line)])
    except SystemExit as end:
        code = end.code
    out, err = capsys.readouterr()
    assert code == 2
    assert out == ""
    lines = [text for text in err.splitlines() if ": warning: " not in text]
    assert len(lines) == 1
    assert lines[0].startswith("halfdof-ctrl: error: ")
    assert "\033" not in err
    assert {path: path.lstat().st_mtime_ns for path in folder.rglob("*")} == before


class Full(io.StringIO):
    """A stream on a full disk."""

    def flush(self) -> None:
        """Refuse."""
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "standard output")


@pytest.mark.parametrize("line", [["--help"], ["--version"], ["bode", "--help"], []])
def test_help_that_cannot_be_printed_is_an_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: list[str]
) -> None:
    """A full disk behind stdout, which argparse would not tell of."""
    with monkeypatch.context() as patched:
        patched.setattr("sys.stdout", Full())
        assert main(line) == 2
    assert capsys.readouterr().err.startswith("halfdof-ctrl: error: standard output: No space left on device")
