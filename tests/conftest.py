"""Surroundings of all tests: hypothesis profiles, no figures left, and a way to run everything without slycot.

``HYPOTHESIS_PROFILE=wide`` runs 1000 random examples a property instead of 50; both are derandomized, so a
failure can be repeated. ``HALFDOF_WITHOUT_SLYCOT=1`` makes slycot unimportable before control is imported. Ctrl-C
arrives as on a terminal wherever the suite runs.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers of pytest-xdist share the cores already

if os.environ.get("HALFDOF_WITHOUT_SLYCOT", "0") not in {"", "0"}:
    if "control" in sys.modules or sys.modules.get("slycot") is not None:
        msg = "control or slycot was imported before tests/conftest.py could block slycot."
        raise RuntimeError(msg)
    sys.modules["slycot"] = None  # type: ignore[assignment]  # an import of it fails from now on

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell that runs the suite in the background takes it

SLOW_DATA = [HealthCheck.too_slow, HealthCheck.data_too_large]  # a drawn model has some hundred entries

settings.register_profile(
    "default", derandomize=True, deadline=None, max_examples=50, database=None, suppress_health_check=SLOW_DATA
)
settings.register_profile(
    "wide", derandomize=True, deadline=None, max_examples=1000, database=None, suppress_health_check=SLOW_DATA
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


@pytest.fixture(autouse=True)
def _no_figures_left() -> Iterator[None]:
    """Close what a test drew, so that none finds the figures of another."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")
