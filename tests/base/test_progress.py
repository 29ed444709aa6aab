"""Progress is shown to somebody who watches, and to nobody else."""

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from halfdof_ctrl.base import progress as module
from halfdof_ctrl.base.progress import activity, clear_activity, progress, progress_bar, shows_activity, silence


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Show bars without the delay that hides short runs."""
    monkeypatch.setattr(module, "DELAY", 0.0)


def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the captured stderr pass for a terminal."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)


def test_steps_come_through_unchanged(capsys: pytest.CaptureFixture[str]) -> None:
    """A list, or a generator whose length nobody knows; without a terminal nothing is shown."""
    assert list(progress([3, 1, 2], "steps")) == [3, 1, 2]
    assert list(progress((k * k for k in range(3)), "steps", total=3)) == [0, 1, 4]
    assert capsys.readouterr().err == ""


def test_a_terminal_shows_what_is_done(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The bar names the steps and ends full."""
    terminal(monkeypatch)
    assert sum(progress([1, 2, 3], "frequencies")) == 6
    shown = capsys.readouterr().err
    assert "frequencies: 100%" in shown
    assert "3/3" in shown


def test_a_notebook_shows_what_is_done(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Its stderr is no terminal, but its shell has a kernel."""
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    with progress_bar(4, "cases") as advance:
        advance(3)
    assert "3/4" in capsys.readouterr().err


def test_a_short_run_shows_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Below the delay, even on a terminal."""
    terminal(monkeypatch)
    monkeypatch.setattr(module, "DELAY", 60.0)
    list(progress([1, 2, 3], "steps"))
    assert "100%" not in capsys.readouterr().err


@pytest.mark.parametrize("show", [None, True])
def test_inside_silence_nothing_is_shown(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    show: bool | None,  # noqa: FBT001
) -> None:
    """The cases of a sweep draw no bars of their own."""
    terminal(monkeypatch)
    with silence():
        list(progress([1, 2], "steps", show=show))
    assert capsys.readouterr().err == ""
    list(progress([1, 2], "steps", show=show))
    assert "2/2" in capsys.readouterr().err


def test_nothing_is_shown_on_request(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Of False, on a terminal."""
    terminal(monkeypatch)
    list(progress([1, 2], "steps", show=False))
    assert capsys.readouterr().err == ""


def test_the_switch_of_tqdm_is_left_to_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """``TQDM_DISABLE`` is the default of an argument that is not given; False would overrule it."""
    given: list[dict[str, Any]] = []

    @contextmanager
    def recorder(**options: Any) -> Iterator[None]:  # noqa: ANN401
        given.append(options)
        yield

    monkeypatch.setattr("tqdm.tqdm", recorder)
    for show in (True, False):
        with progress_bar(3, "steps", show=show):
            pass
    assert ["disable" in options for options in given] == [False, True]


def test_a_process_without_stderr_is_no_reason_to_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows starts some without."""
    monkeypatch.setattr(sys, "stderr", None)
    assert list(progress([1, 2], "steps", show=True)) == [1, 2]


def wait_for(text: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Wait until something stands on stderr, and give all that does."""
    shown = ""
    for _ in range(6000):
        shown += capsys.readouterr().err
        if text in shown:
            return shown
        time.sleep(0.01)
    pytest.fail(f"{text!r} was not shown, but {shown!r}")


def test_an_activity_shows_that_it_lasts(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """On one line, which is taken away before something is printed and at the end."""
    terminal(monkeypatch)
    with activity("zeros"):
        wait_for("\rzeros: 0 s\r", capsys)
        clear_activity()
        assert capsys.readouterr().err.endswith("\r          \r")
        wait_for("\rzeros: ", capsys)
    assert capsys.readouterr().err.split("\r")[-2].strip() == ""


def test_an_activity_gives_way_to_a_bar_inside(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And comes back after it; an activity inside another has no line of its own."""
    terminal(monkeypatch)
    monkeypatch.setattr(module, "TICK", 0.01)
    with activity("check"), activity("zeros"):
        wait_for("check: ", capsys)
        with progress_bar(2, "steps") as advance:
            capsys.readouterr()
            advance(2)
            time.sleep(0.1)
            assert "check" not in capsys.readouterr().err
        shown = wait_for("check: ", capsys)
    assert "2/2" in shown
    assert "zeros" not in shown


@pytest.mark.parametrize("watched", [True, False])
def test_an_activity_that_nobody_watches_is_not_shown(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, watched: bool
) -> None:
    """Without a terminal, inside `silence`, or where bars are disabled."""
    monkeypatch.setattr(module, "TICK", 0.01)
    if watched:
        terminal(monkeypatch)
        monkeypatch.setenv("TQDM_DISABLE", "1")

    @shows_activity("zeros")
    def slow(x: int) -> int:
        """Take some time."""
        time.sleep(0.1)
        return x

    assert slow(3) == 3
    monkeypatch.delenv("TQDM_DISABLE", raising=False)
    with silence():
        assert slow(x=4) == 4
    assert slow.__doc__ == "Take some time."
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX's")
def test_a_terminal_without_a_size_shows_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that a program or a container opens: tqdm alone would draw nothing on it."""
    parent, child = os.openpty()
    with os.fdopen(child, "w") as stream, monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", stream)
        assert sum(progress([1, 2, 3], "frequencies")) == 6
        stream.write("the end")
        stream.flush()
        shown = b""
        while b"the end" not in shown:
            shown += os.read(parent, 4096)
    os.close(parent)
    assert b"frequencies: 100%" in shown


def test_a_long_first_step_is_not_silent(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The bar stands there before any step is done, whatever the first one takes."""
    terminal(monkeypatch)
    with progress_bar(2, "steps") as advance:
        monkeypatch.setattr(module, "TICK", 0.0)
        shown = ""
        while "steps:   0%" not in shown.partition("steps:   0%")[2]:  # drawn once more
            shown += capsys.readouterr().err
        advance(2)
    assert "2/2" in capsys.readouterr().err
