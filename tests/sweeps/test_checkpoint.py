"""Checkpoints of sweeps: what they keep to the last bit, what they leave out, and whose they are."""

import base64
import errno
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from numpy.testing import assert_array_equal

from halfdof_ctrl import SweepResult, hydromount, mechss, sweep
from halfdof_ctrl.base.errors import CheckpointError, CheckpointWarning, FailedCasesWarning, ParameterError
from halfdof_ctrl.sweeps.fingerprint import fingerprint
from support import sweepcases

OMEGA = np.geomspace(1.0, 50.0, 7)
MOUNTS: dict[str, Any] = {"C_h": [100.0, 300.0, 0.0], "K_v": [250.0, 500.0]}  # without damping there is a state less


def mounts(path: Path | str | None = None, **more: Any) -> SweepResult:  # noqa: ANN401
    """Sweep the hydromount."""
    asked: dict[str, Any] = {"omega": OMEGA, "inputs": "F_y", "outputs": "y", "checkpoint": path} | more
    return sweep(asked.pop("function", hydromount), asked.pop("parameters", MOUNTS), **asked)


def same(one: SweepResult, other: SweepResult) -> None:
    """Compare all that two results hold, to the last bit."""
    for name in ("poles", "response", "values"):
        first, second = getattr(one, name), getattr(other, name)
        assert (first is None) == (second is None)
        if first is not None:
            assert_array_equal(first, second)
            assert first.dtype == second.dtype
    for name in ("inputs", "outputs", "dofs", "discrete", "shape"):
        assert getattr(one, name) == getattr(other, name)


def squares(folder: Path, path: Path, count: int = 6) -> np.ndarray:
    """Sweep a function that leaves a mark each time that it is called."""
    return np.asarray(
        sweep(sweepcases.marked_square, {"x": range(count), "folder": str(folder)}, checkpoint=path).values
    )


# --- what is kept


def test_a_second_run_gives_the_same_to_the_last_bit(tmp_path: Path) -> None:
    """Poles, response and names come from the file; one line a case, and one before."""
    path, whole = tmp_path / "sweep.jsonl", mounts()
    same(mounts(path), whole)
    content = path.read_bytes()
    assert content.count(b"\n") == 7
    again = mounts(path)
    same(again, whole)
    assert again.ran.endswith("6 of 6 cases taken from the checkpoint")
    assert path.read_bytes() == content


def test_any_part_of_a_file_is_continued(tmp_path: Path) -> None:
    """Cut at whatever byte, as a killed process leaves it; the rest is done again."""
    path, whole = tmp_path / "sweep.jsonl", mounts()
    mounts(path)
    content = path.read_bytes()
    for cut in np.linspace(0, len(content), 23).astype(int).tolist():
        path.write_bytes(content[:cut])
        same(mounts(path), whole)
        assert path.read_bytes() == content


def test_a_damaged_line_costs_its_case_alone(tmp_path: Path) -> None:
    """Each other case is taken as it is."""
    folder, path = tmp_path / "marks", tmp_path / "sweep.jsonl"
    folder.mkdir()
    squares(folder, path)
    lines = path.read_bytes().split(b"\n")
    lines[3] = lines[3].replace(b'"case":2', b'"case":1')
    path.write_bytes(b"\n".join(lines))
    assert squares(folder, path).tolist() == [0, 1, 4, 9, 16, 25]
    assert sorted(path.name.split("-")[1] for path in folder.glob("begun-*")) == list("0122345")


def test_a_failed_case_is_tried_again(tmp_path: Path) -> None:
    """The file has finished cases alone."""
    path = tmp_path / "sweep.jsonl"
    for _ in range(2):
        with pytest.warns(FailedCasesWarning, match="1 of 3 cases failed, first x = 0: ZeroDivisionError"):
            result = sweep(sweepcases.inverse, {"x": [0.0, 1.0, 2.0]}, checkpoint=path)
    assert result.ran.endswith("2 of 3 cases taken from the checkpoint")
    assert_array_equal(np.asarray(result.values), [np.nan, 1.0, 0.5])


def test_threads_processes_and_this_process_continue_each_others_work(tmp_path: Path) -> None:
    """The file does not know who wrote it."""
    path, whole = tmp_path / "sweep.jsonl", mounts()
    mounts(path)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:3]))
    with ThreadPoolExecutor(2) as executor:
        same(mounts(path, executor=executor), whole)
    path.write_bytes(b"".join(lines[:3]))
    same(mounts(path, workers=2, timeout=300.0), whole)


def test_frequencies_of_one_model_are_kept_in_pieces(tmp_path: Path) -> None:
    """A model that stands for itself has its frequencies in the file."""
    path, model, omega = tmp_path / "sweep.jsonl", hydromount(), np.geomspace(1.0, 50.0, 50)
    whole = sweep(model, omega=omega, checkpoint=path)
    lines = path.read_bytes().splitlines(keepends=True)
    assert len(lines) == 51
    path.write_bytes(b"".join(lines[:20]))
    again = sweep(model, omega=omega, checkpoint=path)
    assert again.ran.endswith("19 of 50 frequencies taken from the checkpoint")
    same(again, whole)


def test_the_file_is_text_that_executes_nothing(tmp_path: Path) -> None:
    """JSON behind a checksum; numbers as the bytes of doubles."""
    path = tmp_path / "sweep.jsonl"
    sweep(sweepcases.inverse, {"x": [4.0]}, checkpoint=path)
    header, record = [json.loads(line.split(" ", 1)[1]) for line in path.read_text("ascii").splitlines()]
    assert (header["function"], header["cases"]) == ("inverse", 1)
    kind, shape, text = record["value"]
    assert (kind, shape, np.frombuffer(base64.b64decode(text), kind).tolist()) == ("<f8", [], [0.25])


# --- whose it is


@pytest.mark.parametrize(
    "other",
    [
        {"parameters": MOUNTS | {"C_h": [100.0, 300.0, 1e-9]}},
        {"parameters": {"K_v": [250.0, 500.0], "C_h": [100.0, 300.0, 0.0]}},
        {"parameters": MOUNTS | {"m": 21.0}},
        {"omega": np.nextafter(OMEGA, 100.0)},
        {"outputs": ["y_dot"]},
        {"inputs": "F_y1"},
        {"compute": "poles"},
        {"function": sweepcases.mount},
        {"function": partial(hydromount, m=19.0)},
    ],
)
def test_the_checkpoint_of_another_sweep_is_refused(tmp_path: Path, other: dict[str, Any]) -> None:
    """Before anything is computed, and with its content as it was."""
    path = tmp_path / "sweep.jsonl"
    mounts(path)
    content = path.read_bytes()
    with pytest.raises(CheckpointError, match=r"cases of another sweep .hydromount with C_h = 100") as refusal:
        mounts(path, **other)
    assert refusal.value.path == str(path)
    assert path.read_bytes() == content


@pytest.mark.parametrize("content", [b"x,y\n1,2\n", b"no line", b"\n", b"\x00\xff\n\n", b"0", b"00000000 {}\n"])
def test_other_files_are_refused_and_left_alone(tmp_path: Path, content: bytes) -> None:
    """Whatever they are."""
    path = tmp_path / "table.csv"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match="no checkpoint of a sweep"):
        mounts(path)
    assert path.read_bytes() == content


def test_a_checkpoint_that_another_run_writes_is_refused(tmp_path: Path) -> None:
    """Two runs would do the same work twice."""
    pytest.importorskip("fcntl")
    path = tmp_path / "sweep.jsonl"

    def nested(x: float) -> float:
        sweep(sweepcases.square, {"x": [x]}, checkpoint=path)
        return x

    with pytest.warns(FailedCasesWarning, match="CheckpointError: .* another sweep is writing it"):
        sweep(nested, {"x": [1.0]}, checkpoint=path)


def test_places_that_are_no_files_are_refused(tmp_path: Path) -> None:
    """With their names, before anything is computed."""
    for path in (tmp_path, tmp_path / "missing" / "sweep.jsonl"):
        with pytest.raises(OSError, match=r"directory") as refusal:
            mounts(path)
        assert refusal.value.filename == str(path)
    for wrong in (7, "", True):
        with pytest.raises(ParameterError, match="must be the path of a file"):
            mounts(wrong)  # type: ignore[arg-type]  # what is refused
    if Path("/dev/zero").exists():
        with pytest.raises(CheckpointError, match="not a device"):
            mounts("/dev/zero")


def test_a_full_disk_loses_no_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sweep goes on, its result is whole, and the file holds the whole lines that fitted."""
    path, room = tmp_path / "sweep.jsonl", [1500]
    write = os.write

    def small_disk(descriptor: int, line: bytes) -> int:
        if not room[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fits = line[: room[0]]
        room[0] -= len(fits)
        return write(descriptor, fits)

    monkeypatch.setattr("halfdof_ctrl.sweeps.checkpoint.os.write", small_disk)
    with pytest.warns(CheckpointWarning, match=r"\d finished cases are not in the checkpoint .*: No space left"):
        same(mounts(path), mounts())
    monkeypatch.undo()
    kept = path.read_bytes()
    assert kept.endswith(b"\n")
    assert 1 < kept.count(b"\n") < 7
    same(mounts(path), mounts())


# --- fingerprints

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.complex_numbers(),
    lambda below: st.lists(below, max_size=3) | st.dictionaries(st.text(max_size=3), below, max_size=3),
    max_leaves=6,
)


@given(one=VALUES, other=VALUES)
def test_fingerprints_tell_values_apart(one: object, other: object) -> None:
    """As their written forms do."""
    assert (fingerprint(x=one) == fingerprint(x=other)) == (repr(one) == repr(other))


def test_models_functions_and_matrices_are_what_they_hold() -> None:
    """Not where they are."""

    def scaled(by: float) -> Any:  # noqa: ANN401
        return lambda x: by * x

    assert fingerprint(f=scaled(2.0)) == fingerprint(f=scaled(2.0))
    assert fingerprint(f=scaled(2.0)) != fingerprint(f=scaled(3.0))
    assert fingerprint(m=hydromount()) == fingerprint(m=hydromount())
    assert fingerprint(m=hydromount()) != fingerprint(m=hydromount(m=21))
    matrix = sp.eye_array(3, format="csr")
    assert fingerprint(m=matrix) == fingerprint(m=matrix.copy())
    assert fingerprint(m=matrix) != fingerprint(m=2.0 * matrix)
    sparse = mechss(matrix, None, matrix)
    assert fingerprint(m=sparse) == fingerprint(m=mechss(matrix.copy(), None, matrix.copy()))
    assert fingerprint(m=sparse) != fingerprint(m=mechss(matrix, None, 2.0 * matrix))


def test_values_that_do_not_say_what_they_are_are_refused(tmp_path: Path) -> None:
    """Their address would be another in the next run."""
    with pytest.raises(ParameterError, match=r"cannot tell whether another run has the same .*a object does not say"):
        sweep(sweepcases.square, {"x": [object()]}, checkpoint=tmp_path / "sweep.jsonl")


def test_fingerprints_are_those_of_another_process() -> None:
    """Whatever the seed of its hashes."""
    code = (
        "from halfdof_ctrl.sweeps.fingerprint import fingerprint; from support import sweepcases; from halfdof_ctrl "
        "import hydromount; print(fingerprint(f=sweepcases.mount, g=hydromount, m=hydromount(), p={'a': [1.0, 'b']}))"
    )
    places = os.pathsep.join([str(Path(__file__).parents[2]), str(Path(__file__).parents[1])])
    prints = {
        subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": places},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        for seed in ("1", "2")
    }
    assert prints == {fingerprint(f=sweepcases.mount, g=hydromount, m=hydromount(), p={"a": [1.0, "b"]})}
