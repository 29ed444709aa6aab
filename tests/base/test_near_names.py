"""The nearest names are found in lists of any length: `halfdof_ctrl.base.near_names`."""

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.base.near_names import MOST_COMPARED, nearest_names

#: names that are alike by no slip of the keyboard, and names that many are
FAR = [hashlib.sha1(str(i).encode(), usedforsecurity=False).hexdigest()[:12] for i in range(5 * MOST_COMPARED)]
MANY = [f"node_{i}_x" for i in range(5 * MOST_COMPARED)]


@pytest.mark.parametrize("size", [100, len(FAR)])
@given(place=st.integers(0, 11), slip=st.sampled_from(["drop", "double", "swap", "change", "case"]))
def test_one_slip_of_the_keyboard_is_undone(size: int, place: int, slip: str) -> None:
    """The right name is among those offered, whatever the length of the list."""
    right = FAR[77]
    before, letter, after = right[:place], right[place], right[place + 1 :]
    wrong = {
        "drop": before + after,
        "double": before + 2 * letter + after,
        "swap": before + after[:1] + letter + after[1:],
        "change": f"{before}?{after}",
        "case": right.upper(),
    }[slip]
    assert wrong == right or right in nearest_names(wrong, FAR[:size])


def test_names_with_the_same_beginning_stand_in_where_no_slip_explains() -> None:
    """Of thousands, three."""
    assert len(nearest_names("node_7077_xyz", MANY)) == 3


@pytest.mark.parametrize("name", ["", "?" * 1000, "quite another"])
def test_nothing_is_offered_that_is_not_like_the_name(name: str) -> None:
    """Nor does a long name take long."""
    assert nearest_names(name, MANY) == []
