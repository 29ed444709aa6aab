"""Progress of long runs: a bar by tqdm on a terminal or in a notebook, nothing anywhere else.

Nothing is shown in the first second, so that short runs leave no trace, and nothing inside `silence`, so that the
cases of a sweep do not draw bars of their own into that of the sweep.
"""

import sys
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Step = TypeVar("Step")

DELAY = 1.0  #: [s] before a bar appears

_SILENT: ContextVar[bool] = ContextVar("_SILENT", default=False)


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

    hidden = _SILENT.get() or sys.stderr is None or not (_is_watched() if show is None else show)
    switch = {"disable": True} if hidden else {}  # otherwise left to the user, who may have set TQDM_DISABLE
    with tqdm(total=total, desc=what, delay=DELAY, file=sys.stderr, **switch) as bar:

        def advance(steps: int) -> None:
            bar.update(steps)

        yield advance


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


def _is_watched() -> bool:
    """Return whether stderr is a terminal, or the code runs in a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel") or sys.stderr.isatty()
