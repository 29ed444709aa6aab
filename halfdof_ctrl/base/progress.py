"""Progress of long runs: a bar by tqdm on a terminal or in a notebook, nothing anywhere else.

Nothing is shown in the first second, so that short runs leave no trace, and nothing inside `silence`, so that the
cases of a sweep do not draw bars of their own into that of the sweep. What does not go step by step shows how long it
has been at work (`activity`), until something inside it has a bar.
"""

import functools
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

Step = TypeVar("Step")
Given = ParamSpec("Given")
Result = TypeVar("Result")

DELAY = 1.0  #: [s] before a bar appears
USUAL_SIZE = {"ncols": 80, "nrows": 24}  #: of a terminal that does not say its own, on which tqdm would draw nothing
TICK = 0.5  #: [s] between two looks at the clock

_SILENT: ContextVar[bool] = ContextVar("_SILENT", default=False)
_ACTIVITY: ContextVar["_Clock | None"] = ContextVar("_ACTIVITY", default=None)


def progress(steps: Iterable[Step], what: str, *, total: int | None = None, show: bool | None = None) -> Iterator[Step]:
    """Go through steps and show how far it is.

    Parameters
    ----------
    steps : iterable
    what : str
        What the steps are, in the plural: it stands before the bar.
    total : int, optional
        Number of steps, where `steps` has no length.
    show : bool, optional
        As in `progress_bar`.

    Yields
    ------
    object
        The steps, one by one.

    Examples
    --------
    >>> sum(progress([1, 2, 3], "numbers"))
    6
    """
    count = len(steps) if total is None and isinstance(steps, Sized) else total
    with progress_bar(count, what, show=show) as advance:
        for step in steps:
            yield step
            advance(1)


@contextmanager
def progress_bar(total: int | None, what: str, *, show: bool | None = None) -> Iterator[Callable[[int], None]]:
    """Show how far a run is that does not go step by step.

    Parameters
    ----------
    total : int or None
        Number of steps, if it is known.
    what : str
        What the steps are, in the plural: it stands before the bar.
    show : bool, optional
        False: never. True: also where nobody is seen to watch. By default where stderr is a terminal or the code
        runs in a notebook.

    Yields
    ------
    callable
        To be called with the number of steps done since the last call.

    Examples
    --------
    >>> with progress_bar(3, "numbers") as advance:
    ...     advance(3)
    """
    from tqdm import tqdm  # noqa: PLC0415  # costs time, which a bare import of the package does not need

    switch = {"disable": True} if _is_hidden(show) else {}  # otherwise left to the user, who may have set TQDM_DISABLE
    drawn = {"desc": what, "delay": DELAY, "file": sys.stderr} | _size()
    with _instead_of_the_clock(), tqdm(total=total, **drawn, **switch) as bar:

        def advance(steps: int) -> None:
            bar.update(steps)

        pulse = None if getattr(bar, "disable", True) else _Pulse(bar)
        try:
            yield advance
        finally:
            if pulse is not None:
                pulse.stop()


@contextmanager
def activity(what: str, *, show: bool | None = None) -> Iterator[None]:
    """Show how long something has been at work of which nobody knows how long it takes.

    Inside another activity it shows nothing of its own, and while a bar is shown the clock is not.

    Parameters
    ----------
    what : str
        What is done, in a word or two.
    show : bool, optional
        As in `progress_bar`.

    Examples
    --------
    >>> with activity("zeros"):
    ...     1 + 1
    2
    """
    if _is_hidden(show) or _ACTIVITY.get() is not None or os.environ.get("TQDM_DISABLE", "0") not in {"", "0"}:
        yield
        return
    clock = _Clock(what)
    token = _ACTIVITY.set(clock)
    clock.start()
    try:
        yield
    finally:
        _ACTIVITY.reset(token)
        clock.stop()


def begin_activity(what: str) -> None:
    """Show from now on how long something has been at work, until `end_activity`: what a `with` cannot stand around."""
    if not _is_hidden(None) and os.environ.get("TQDM_DISABLE", "0") in {"", "0"}:
        clock = _Clock(what)
        _ACTIVITY.set(clock)
        clock.start()


def end_activity() -> None:
    """Show it no longer."""
    clock = _ACTIVITY.get()
    if clock is not None:
        _ACTIVITY.set(None)
        clock.stop()


def shows_activity(what: str) -> Callable[[Callable[Given, Result]], Callable[Given, Result]]:
    """Have a function show how long it has been at work, as `activity` does."""

    def decorated(function: Callable[Given, Result]) -> Callable[Given, Result]:
        @functools.wraps(function)
        def shown(*args: Given.args, **kwargs: Given.kwargs) -> Result:
            with activity(what):
                return function(*args, **kwargs)

        return shown

    return decorated


def clear_activity() -> None:
    """Take away the line of the activity that is shown, before something is printed; it comes again with its clock."""
    clock = _ACTIVITY.get()
    if clock is not None:
        clock.clear()


class _Clock(threading.Thread):
    """Writes again and again how long an activity has lasted, on one line that it takes away."""

    def __init__(self, what: str) -> None:
        super().__init__(name="halfdof_ctrl clock", daemon=True)
        self.what, self.begin, self.stream, self.shown = what, time.monotonic(), sys.stderr, 0
        self.over, self.lock, self.covered = threading.Event(), threading.Lock(), 0

    def run(self) -> None:
        """Tick."""
        wait = DELAY
        while not self.over.wait(wait):
            wait = TICK
            with self.lock:
                if not self.covered and not self.over.is_set():
                    self._write(f"{self.what}: {time.monotonic() - self.begin:.0f} s")

    def clear(self) -> None:
        """Take the line away."""
        with self.lock:
            if self.shown:
                self._write("")

    def stop(self) -> None:
        """Take the line away for good."""
        self.over.set()
        self.clear()
        self.join()

    def cover(self, more: int) -> None:
        """Keep quiet while something else shows how far it is."""
        self.clear()
        with self.lock:
            self.covered += more

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # a terminal that went away
            self.stream.write(f"\r{text:<{self.shown}}\r")
            self.stream.flush()
        self.shown = len(text)


class _Pulse(threading.Thread):
    """Draws a bar again and again while a step lasts: tqdm draws it at the end of one."""

    def __init__(self, bar: Any) -> None:  # noqa: ANN401  # of tqdm, which is imported late
        super().__init__(name="halfdof_ctrl pulse", daemon=True)
        self.bar, self.over = bar, threading.Event()
        self.start()

    def run(self) -> None:
        """Beat."""
        wait = DELAY
        while not self.over.wait(wait):
            wait = TICK
            with suppress(OSError, ValueError):  # a terminal that went away
                self.bar.refresh()
                self.bar.last_print_t = time.time()  # so that tqdm knows that there is something to take away

    def stop(self) -> None:
        """Leave the bar to tqdm."""
        self.over.set()
        self.join()


@contextmanager
def _instead_of_the_clock() -> Iterator[None]:
    """Stop the clock of the activity around while something else shows how far it is."""
    clock = _ACTIVITY.get()
    if clock is not None:
        clock.cover(1)
    try:
        yield
    finally:
        if clock is not None:
            clock.cover(-1)


@contextmanager
def silence() -> Iterator[None]:
    """Show no progress of what is done inside.

    Examples
    --------
    >>> with silence():
    ...     list(progress([1, 2], "numbers", show=True))
    [1, 2]
    """
    token = _SILENT.set(True)
    try:
        yield
    finally:
        _SILENT.reset(token)


def _is_hidden(show: bool | None) -> bool:  # noqa: FBT001  # as the functions above have it
    return _SILENT.get() or sys.stderr is None or not (_is_watched() if show is None else show)


def _size() -> dict[str, Any]:
    """Return the size to draw in where a terminal says that it has none; otherwise tqdm finds it."""
    try:
        return {} if os.get_terminal_size(sys.stderr.fileno()).columns else USUAL_SIZE
    except (AttributeError, OSError, ValueError):  # no terminal
        return {}


def _is_watched() -> bool:
    """Return whether stderr is a terminal, or the code runs in a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel") or sys.stderr.isatty()
