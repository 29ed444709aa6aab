"""What a user sees of the package: the public names, each the thing it says, none hidden by a room."""

import ast
import pkgutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import halfdof_ctrl as hd


def test_dir_shows_the_public_names() -> None:
    """Neither rooms nor what the package imports; completion in a notebook asks for this."""
    assert dir(hd) == sorted([*hd.__all__, "__version__", "errors", "laws"])


@pytest.mark.parametrize("name", sorted({*hd.__all__} - {"laws"}))  # which is meant as a module
def test_no_public_name_is_a_module(name: str) -> None:
    """A function whose name is that of a room or file beside it would be lost by importing that."""
    assert not isinstance(getattr(hd, name), ModuleType)
    assert name not in {module.name for module in pkgutil.iter_modules(hd.__path__)}


@pytest.mark.parametrize("name", hd.errors.__all__)
def test_errors_name_the_path_at_which_they_are_documented(name: str) -> None:
    """`hd.errors` is there without an import of its own, and a traceback shows a name that can be imported."""
    assert getattr(hd.errors, name).__module__ == "halfdof_ctrl.errors"


def test_rooms_are_found_by_their_names() -> None:
    """No room of the package is shadowed by something that it or a room above hands on."""
    hidden = [
        module.name
        for module in pkgutil.walk_packages(hd.__path__, "halfdof_ctrl.")
        if not isinstance(_attribute(module.name), ModuleType)
    ]
    assert not hidden


def _attribute(name: str) -> object:
    found: object = hd
    __import__(name)
    for part in name.split(".")[1:]:
        found = getattr(found, part)
    return found


def test_type_checkers_find_names_where_the_package_does() -> None:
    """The imports that they read, and the places from which names are loaded when they are asked for."""
    block = next(node for node in ast.parse(Path(hd.__file__).read_text()).body if isinstance(node, ast.If))
    told = {
        alias.name: str(node.module)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name != "laws"
    }
    assert set(told) == set(hd.__all__)
    for name, home in told.items():
        assert getattr(sys.modules[home], name) is getattr(hd, name)


def test_importing_the_package_waits_for_no_other() -> None:
    """Neither python-control nor numpy is loaded before a name is asked for, and a room that is named is found."""
    code = (
        "import sys, halfdof_ctrl as hd; assert not {'control', 'numpy', 'scipy'} & {*sys.modules}; "
        "assert hd.systems.__name__ == 'halfdof_ctrl.systems'; assert hd.mech2ss and 'control' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_name_that_does_not_exist_is_told_as_any_module_tells_it() -> None:
    """An AttributeError with the name."""
    with pytest.raises(AttributeError, match="module 'halfdof_ctrl' has no attribute 'mech2sss'"):
        _ = hd.mech2sss  # type: ignore[attr-defined]
