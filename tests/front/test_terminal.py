"""The command's streams and signals: nothing foreign on stdout, nothing half-written, no traceback."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from halfdof_ctrl.terminal import TerminatedError, orderly_end

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")
STOPPED_IMPORT = """
import os, signal, sys
class Stop:
    def find_spec(self, name, path, target=None):
        if name == "numpy": os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Stop())
from halfdof_ctrl.cli import main
"""
PRINTED_IN_C = "import ctypes; ctypes.CDLL(None).puts(b'** On entry to DTRSV parameter number 6')"


def run(script: str, *arguments: str, folder: Path, closed: str = "") -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own, with `poles` doing what a script says."""
    program = "\n".join(
        [
            "import sys, os, signal",
            "import halfdof_ctrl.cli as cli",
            "from halfdof_ctrl.files.writing import replacing",
            "def poles(arguments):",
            *(f"    {line}" for line in script.splitlines()),
            "    return 0",
            "cli.run_poles = poles" if script != "pass" else "",
            "sys.exit(cli.main())",
        ]
    )
    (folder / "command.py").write_text(program)
    command = f'exec "$0" "$@" {closed}'
    return subprocess.run(
        ["/bin/sh", "-c", command, sys.executable, "command.py", *(arguments or ("poles", "hydromount"))],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@posix
def test_what_compiled_libraries_print_is_not_on_stdout(tmp_path: Path) -> None:
    """Written past Python's stream at once, or kept in the buffer of C until the end."""
    done = run(f"os.write(1, b'foreign')\n{PRINTED_IN_C}\nprint('asked')", folder=tmp_path)
    assert (done.returncode, done.stdout) == (0, "asked\n")
    assert "foreign" in done.stderr
    assert "DTRSV" in done.stderr


@posix
def test_names_do_not_steer_the_terminal(tmp_path: Path) -> None:
    """On stdout and in the words of a refusal alike."""
    assert run(r"print('a\x1b[31m\tb')", folder=tmp_path).stdout == "a\\x1b[31m\tb\n"
    refused = run("pass", "poles", "no\x1b[31msuch", folder=tmp_path)
    assert refused.returncode == 2
    assert "no\\x1b[31msuch" in refused.stderr


@posix
@pytest.mark.parametrize("closed", [">&-", ">/dev/full"])
def test_a_stdout_that_takes_nothing_is_named(tmp_path: Path, closed: str) -> None:
    """Closed by the shell, or a full disk."""
    if closed.endswith("full") and not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full")
    done = run("print('asked')", folder=tmp_path, closed=closed)
    assert done.returncode == 2
    assert done.stderr.startswith("halfdof-ctrl: error: standard output: ")
    assert done.stderr.count("\n") == 1


@posix
def test_a_closed_stdout_is_no_matter_where_nothing_is_printed(tmp_path: Path) -> None:
    """Its number does not go to the file that is written."""
    script = f"with replacing('a.npz') as stream:\n    stream.write(b'whole')\n    {PRINTED_IN_C}"
    done = run(script, folder=tmp_path, closed=">&-")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "a.npz").read_bytes() == b"whole"


@posix
def test_a_terminated_command_leaves_nothing_half_written(tmp_path: Path) -> None:
    """SIGTERM takes the temporary file away as Ctrl-C does."""
    script = "with replacing('a.npz') as stream:\n    os.kill(os.getpid(), signal.{})\n    stream.write(b'half')"
    for name, code in (("SIGTERM", 143), ("SIGINT", 130)):
        done = run(script.format(name), folder=tmp_path)
        assert (done.returncode, done.stderr) == (code, "")
        assert [file.name for file in tmp_path.iterdir()] == ["command.py"]


@posix
def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    """Not its temporary name, and nothing is left of it."""
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))"
    done = run(f"{limit}\nwith replacing('a.npz') as stream:\n    stream.write(bytes(10**6))", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("halfdof-ctrl: error: a.npz: ")
    assert [file.name for file in tmp_path.iterdir()] == ["command.py"]


@posix
def test_ctrl_c_while_the_command_imports_says_nothing(tmp_path: Path) -> None:
    """The shell sees a process that SIGINT ended; a program of the user's keeps Python's exception."""
    for name in ("halfdof-ctrl", "other"):
        (tmp_path / name).write_text(STOPPED_IMPORT)
        command = [sys.executable, str(tmp_path / name)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
        if name == "halfdof-ctrl":
            assert (done.returncode, done.stderr) == (-signal.SIGINT, "")
        else:
            assert "KeyboardInterrupt" in done.stderr


class Dying:
    """Something in whose destructor a signal arrives."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __del__(self) -> None:
        """Receive the signal, which Python reports and forgets."""
        signal.raise_signal(self.number)


def _receive_in_a_destructor(number: int) -> None:
    with orderly_end():
        one = Dying(number)
        del one
        for _ in range(6000):
            time.sleep(0.01)


@pytest.mark.parametrize(("number", "error"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, TerminatedError)])
def test_a_signal_that_arrives_in_a_destructor_is_not_lost(
    capsys: pytest.CaptureFixture[str], number: signal.Signals, error: type[BaseException]
) -> None:
    """It is given once more, and nothing is printed; afterwards all is as it was."""
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM), sys.unraisablehook
    with pytest.raises(error):
        _receive_in_a_destructor(number)
    assert capsys.readouterr() == ("", "")
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM), sys.unraisablehook) == before


@posix
def test_a_disk_that_is_full_elsewhere_is_not_called_stdout(tmp_path: Path) -> None:
    """What fails names itself, or says that it is a file; stdout was not written to."""
    done = run("raise OSError(28, 'No space left on device')", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "halfdof-ctrl: error: file: No space left on device\n"
