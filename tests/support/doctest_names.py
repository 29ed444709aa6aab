"""Pytest plugin: names that the docstring examples of the package use without importing them.

Examples see the globals of their module; what stands above it (`mech2ss` in `second_order`, say) comes from here.
Loaded by ``-p support.doctest_names`` with ``pythonpath = ["tests"]``, since no conftest.py lies beside the package.
"""

from typing import Any

import pytest


@pytest.fixture(autouse=True)
def _public_names(doctest_namespace: dict[str, Any]) -> None:
    """Give every example what `halfdof_ctrl` exports, and control and numpy by their usual names."""
    import control  # noqa: PLC0415  # not before conftest.py has had a chance to block slycot
    import numpy as np  # noqa: PLC0415

    import halfdof_ctrl as hd  # noqa: PLC0415

    doctest_namespace.update({name: getattr(hd, name) for name in hd.__all__})
    doctest_namespace.update(hd=hd, ct=control, np=np)
