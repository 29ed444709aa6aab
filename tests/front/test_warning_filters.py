"""A warning fails the suite by where it is raised: deprecations in other packages' code do not, all others do."""

import numpy as np
import pytest

from halfdof_ctrl.errors import LostDigitsWarning
from support.warned import raised_in

OURS = [
    "halfdof_ctrl",
    "halfdof_ctrl.plots.bode",
    "tests.front.test_cli",
    "support.structures",
    "multiprocessing.context",
]
THEIRS = ["control", "control.statesp", "numpy.linalg", "scipy.sparse._construct"]
DEPRECATIONS = [
    DeprecationWarning,
    PendingDeprecationWarning,
    FutureWarning,
    np.exceptions.VisibleDeprecationWarning,
]


@pytest.mark.parametrize("module", THEIRS)
@pytest.mark.parametrize("category", DEPRECATIONS)
def test_deprecations_in_other_packages_do_not_fail(module: str, category: type[Warning]) -> None:
    """They say nothing about this package."""
    raised_in(module, category)()


@pytest.mark.parametrize("module", [*OURS, "controls"])
@pytest.mark.parametrize("category", DEPRECATIONS)
def test_deprecations_in_our_code_fail(module: str, category: type[Warning]) -> None:
    """In the package, in tests and their helpers, and in the standard library; a name that begins alike is another."""
    with pytest.raises(category, match=f"by {module}"):
        raised_in(module, category)()


@pytest.mark.parametrize("module", [*OURS, *THEIRS])
@pytest.mark.parametrize("category", [RuntimeWarning, UserWarning, ResourceWarning, LostDigitsWarning])
def test_all_other_warnings_fail_wherever_they_are_raised(module: str, category: type[Warning]) -> None:
    """They speak of what was handed over."""
    with pytest.raises(category, match=f"by {module}"):
        raised_in(module, category)()
