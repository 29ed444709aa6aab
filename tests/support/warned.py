"""Warnings as if another module raised them."""

import warnings
from collections.abc import Callable
from typing import Any


def raised_in(module: str, category: type[Warning]) -> Callable[[], None]:
    """Make a function of a module that warns."""
    names: dict[str, Any] = {"__name__": module, "warnings": warnings, "category": category}
    exec("def warn(): warnings.warn(category.__name__ + ' by ' + __name__, category)", names)  # noqa: S102  # written above
    warn: Callable[[], None] = names["warn"]
    return warn
