"""Refusals of a file carry its name."""

from collections.abc import Iterator
from contextlib import contextmanager

from halfdof_ctrl.base.errors import FileFormatError, HalfdofError, MissingExtraError

MOST_WORDS = 300  #: characters of another library's error that are passed on


@contextmanager
def naming_the_file(path: object) -> Iterator[None]:
    """Turn what goes wrong with a file's content into a refusal that names the file."""
    try:
        yield  # without touching the filters of warnings, which belong to all threads
    except MissingExtraError as refusal:
        msg = f"{path}: {refusal}"
        raise MissingExtraError(msg, path=str(path), extra=refusal.extra) from refusal
    except HalfdofError as refusal:
        line = getattr(refusal, "line", None)
        words = " ".join(str(refusal).splitlines())
        msg = f"{path}{'' if line is None else f', line {line}'}: {words}"
        raise FileFormatError(msg, path=str(path), line=line) from refusal
    except OSError:
        raise
    except Exception as cause:  # the readers raise anything on damaged bytes: zlib.error, KeyError, struct.error, ...
        reason = " ".join(str(cause).split()) or type(cause).__name__
        reason = reason if len(reason) <= MOST_WORDS else f"{reason[:MOST_WORDS]}..."  # some quote the file at length
        msg = f"{path}: the file is damaged or of another kind than its ending says ({reason}). Write it anew."
        raise FileFormatError(msg, path=str(path)) from cause
