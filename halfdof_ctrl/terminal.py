"""What the command does with its streams and signals, so that nothing but what was asked for is on stdout."""

import _thread
import ctypes
import errno
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from halfdof_ctrl.base.command_start import is_command
from halfdof_ctrl.base.printable import printable
from halfdof_ctrl.base.progress import clear_activity

STDOUT, STDERR = 1, 2  #: file descriptors
OURS = (signal.SIGINT, signal.SIGTERM)  #: signals that end the command in order
AGAIN_SECONDS = 0.01  #: after which a signal that was lost in a destructor is given once more


class TerminatedError(BaseException):
    """The process is asked to end by SIGTERM: what is half-written is taken away on the way out."""


class _Printable(io.TextIOWrapper):
    """A stream on which names cannot steer the terminal."""

    def write(self, text: str) -> int:
        """Write text with control characters as escapes."""
        clear_activity()
        with _naming_stdout():
            super().write(printable(text))
        return len(text)

    def flush(self) -> None:
        """Write out what is held."""
        with _naming_stdout():
            super().flush()


@contextmanager
def _naming_stdout() -> Iterator[None]:
    """Let an OSError tell that it is about this stream; a broken pipe says so by its class."""
    try:
        yield
    except OSError as failure:
        if failure.errno is None or failure.errno == errno.EPIPE:
            raise
        raise OSError(failure.errno, failure.strerror, "standard output") from failure


class _Closed(io.TextIOBase):
    """A stream that was closed before the program began."""

    def write(self, text: str) -> int:
        """Refuse."""
        raise OSError(errno.EBADF, f"it is closed, so that {len(text)} characters are lost", "standard output")


@contextmanager
def asked_output_only() -> Iterator[None]:
    """Print on stdout what Python prints, and on stderr what compiled libraries do: BLAS says its errors on stdout."""
    if sys.stdout is None:  # closed by the shell; its number would be given to the next file that is opened
        with suppress(OSError):
            os.open(os.devnull, os.O_RDWR)
        sys.stdout = _Closed()
        yield
        return
    before = sys.__stdout__
    if before is None or sys.stdout is not before or not _is_descriptor(before, STDOUT):  # the caller's own stream
        yield
        return
    before.flush()
    kept = os.dup(STDOUT)
    try:
        os.dup2(STDERR, STDOUT)
    except OSError:  # stderr is closed
        os.dup2(os.open(os.devnull, os.O_WRONLY), STDOUT)
    stream = _Printable(
        os.fdopen(kept, "wb"),
        encoding=before.encoding,
        errors="backslashreplace",  # a name that the terminal cannot show is no reason to stop
        line_buffering=os.isatty(kept),
    )
    sys.stdout = stream
    try:
        yield
        stream.flush()
    finally:
        _flush_compiled()
        sys.stdout = before
        with suppress(OSError):
            os.dup2(kept, STDOUT)
        with suppress(OSError):
            stream.close()


class _Signals:
    """What is done when a signal arrives that ends the command."""

    def __init__(self) -> None:
        self.hook = sys.unraisablehook
        self.received: list[int] = []

    def end(self, number: int, frame: FrameType | None) -> None:
        """Raise what takes away on its way out what is half-written."""
        self.received.append(number)
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise TerminatedError(number, frame is None)

    def again(self, lost: "sys.UnraisableHookArgs") -> None:
        """Give a signal once more that Python has lost, since it arrived in a destructor; keep quiet about the rest."""
        if not self.received:
            self.hook(lost)
        elif lost.exc_type is not None and issubclass(lost.exc_type, (KeyboardInterrupt, TerminatedError)):
            threading.Timer(AGAIN_SECONDS, _thread.interrupt_main, (self.received[-1],)).start()


@contextmanager
def orderly_end() -> Iterator[None]:
    """Let SIGTERM end the command as Ctrl-C does, and give Ctrl-C back what the start of the program took."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    signals, taken = _Signals(), {}
    for number in OURS:
        before = signal.getsignal(number)
        if before in {signal.SIG_DFL, signal.default_int_handler}:
            taken[number] = before
            signal.signal(number, signals.end)
    sys.unraisablehook = signals.again
    try:
        yield
    finally:
        sys.unraisablehook = signals.hook
        for number, before in taken.items():
            signal.signal(number, signal.SIG_DFL if is_command() else before)


def _is_descriptor(stream: io.TextIOBase | object, number: int) -> bool:
    try:
        return isinstance(stream, io.TextIOWrapper) and stream.fileno() == number
    except (OSError, ValueError):
        return False


def _flush_compiled() -> None:
    """Let compiled libraries write out what they printed, while it still goes to stderr."""
    if os.name == "posix":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).fflush(None)
