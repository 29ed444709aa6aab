"""The first thing that the command `halfdof-ctrl` runs: Ctrl-C ends it without a word while it still imports.

Python's own answer to Ctrl-C is an exception, which nobody can catch before there is a `main`. On a busy machine the
imports take seconds, and who watches is told so.
"""

import signal
import sys
import threading
from pathlib import Path

from halfdof_ctrl.base.progress import begin_activity

PROGRAM = "halfdof-ctrl"


def is_command() -> bool:
    """Tell whether this process was started as the command and not as a program of the user's."""
    return bool(getattr(sys, "argv", None)) and Path(sys.argv[0]).stem == PROGRAM


if is_command() and threading.current_thread() is threading.main_thread():
    with_words = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if with_words:  # and not ignored, as in the background
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    if getattr(sys.modules.get("multiprocessing"), "parent_process", lambda: None)() is None:  # a worker has no main
        begin_activity(PROGRAM)
