"""The first thing that the command `halfdof-ctrl` runs: Ctrl-C ends it without a word while it still imports.

Python's own answer to Ctrl-C is an exception, which nobody can catch before there is a `main`.
"""

import signal
import sys
import threading
from pathlib import Path

PROGRAM = "halfdof-ctrl"


def is_command() -> bool:
    """Tell whether this process was started as the command and not as a program of the user's."""
    return bool(getattr(sys, "argv", None)) and Path(sys.argv[0]).stem == PROGRAM


if is_command() and threading.current_thread() is threading.main_thread():
    with_words = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if with_words:  # and not ignored, as in the background
        signal.signal(signal.SIGINT, signal.SIG_DFL)
