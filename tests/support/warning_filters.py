"""Pytest plugin: which warnings fail the suite.

All of them (``filterwarnings = ["error"]`` in pyproject.toml) but deprecations in other packages' code. A deprecation
says something about the code that it is raised in, so the module decides whose it is, never its text: in
python-control it is python-control's, and comes and goes with the versions that pip happens to take; in the package,
the tests, or the standard library that they call, it is ours to cure. All other warnings speak of the numbers, files
and threads that were handed over, which are ours wherever that is noticed. The package's own warnings fail also where
another package's frame called it.

Loaded by ``-p support.warning_filters``, so that it holds for the docstring examples too.
"""

import re
from importlib.metadata import packages_distributions

import pytest

PACKAGE = "halfdof_ctrl"
OURS = {PACKAGE, "tests", "support"}  #: some distributions install their tests under these names too
DEPRECATIONS = (
    "DeprecationWarning",
    "PendingDeprecationWarning",
    "FutureWarning",
    "numpy.exceptions.VisibleDeprecationWarning",
)


def pytest_configure(config: pytest.Config) -> None:
    """Name the packages that are installed here; later filters go before earlier ones."""
    others = "|".join(re.escape(name) for name in sorted(packages_distributions()) if name not in OURS)
    for category in DEPRECATIONS:
        config.addinivalue_line("filterwarnings", rf"ignore::{category}:({others})(\.|$)")
    config.addinivalue_line("filterwarnings", f"error::{PACKAGE}.base.errors.HalfdofWarning")
