"""The paper's mount as a part, and its scheme wherever its matrices stand."""

import inspect
from pathlib import Path

import numpy as np
from numpy.testing import assert_array_equal

import halfdof_ctrl as hd
from halfdof_ctrl.parts.mounts import SCHEME, scheme_of

ROOT = Path(__file__).parents[2]


def test_part_with_its_bottom_held_is_the_mount_on_the_ground() -> None:
    """The same matrices with a row and a column more, and no force when all moves together."""
    part, mount = hd.hydromount_part(m=20.0), hd.hydromount()
    assert part.dofs == ("top", "bottom", "1", "2")
    held = [0, 2, 3]
    for letter in "MCK":
        whole, fixed = getattr(part, letter), getattr(mount, letter)
        assert_array_equal(whole[np.ix_(held, held)], fixed)
    assert_array_equal(part.K.sum(axis=1), np.zeros(4))
    assert_array_equal(part.C.sum(axis=1), np.zeros(4))


def test_scheme_stands_in_readme_tutorial_and_docstring() -> None:
    """Nobody can check M, C and K without it."""
    lines = [line.strip() for line in SCHEME.strip().splitlines()]
    for text in (
        (ROOT / "README.md").read_text(encoding="utf-8"),
        (ROOT / "docs" / "tutorials" / "hydromount.md").read_text(encoding="utf-8"),
        inspect.getdoc(hd.hydromount) or "",
    ):
        assert all(line in text for line in lines)


def test_scheme_is_that_of_the_papers_mount_alone() -> None:
    """A model with other DOFs has none."""
    assert scheme_of(hd.hydromount().select("F_y", "y")) == SCHEME
    assert scheme_of(hd.hydromount_part()) is None
