"""Names of degrees of freedom (DOFs) and signals, and their way into python-control and back.

For a DOF ``y`` the package knows the force ``F_y``, the displacement, velocity and acceleration ``y``, ``y_dot``,
``y_ddot``, and ``R_y``, the reaction where its motion is prescribed. python-control forbids the full stop in
labels, which finite-element labels such as ``101.1`` need, so a label writes it as a colon, and a colon as ``%3A``.
"""

import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import chain, islice
from typing import Literal, TypeAlias

from halfdof_ctrl.base.doors import described, is_whole_number, shown
from halfdof_ctrl.base.errors import SignalNameError
from halfdof_ctrl.base.near_names import nearest_names
from halfdof_ctrl.base.printable import UNPRINTED

Names: TypeAlias = str | Sequence[str] | None

DERIVATIVE_SUFFIXES = ("", "_dot", "_ddot")
FORCE_PREFIX = "F_"
REACTION_PREFIX = "R_"
SIGNAL_WORDS = {
    "input": ("u", "the unit force on a DOF", "B"),
    "output": ("y", "a DOF's motion", "F, G, H"),
}  #: letter of a nameless signal, what its physical name would mean, and the matrices that decide
LISTS = (tuple, list)  #: what names mostly come in, known at once
MOST_NAMES = 10**8  #: more than memory holds: an iterator without an end is stopped there
MOST_LISTED = 8  #: names that a message spells out
LARGEST_NUMBER = 10**18  #: node numbers of all programs are smaller
MOST_CACHED = 1000  #: names of larger models are made anew each time, since a cache would hold on to them


def control_label(name: str) -> str:
    """Write a name as a label that python-control takes; `name_from_label` is the exact inverse.

    >>> control_label("101.1")
    '101:1'
    """
    if "." in name or ":" in name or "%" in name:
        return name.replace("%", "%25").replace(":", "%3A").replace(".", ":")
    return name


def control_labels(names: tuple[str, ...]) -> tuple[str, ...]:
    """Write names as labels that python-control takes."""
    return _cached_labels(names) if len(names) <= MOST_CACHED else tuple([control_label(name) for name in names])


@lru_cache(maxsize=256)
def _cached_labels(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple([control_label(name) for name in names])


def name_from_label(label: str) -> str:
    """Return the model's name behind a label of `control_label`.

    >>> name_from_label("101:1")
    '101.1'
    """
    return label.replace(":", ".").replace("%3A", ":").replace("%25", "%")


def motion_names(dofs: tuple[str, ...], derivative: int) -> tuple[str, ...]:
    """Names of the displacements (0), velocities (1) or accelerations (2) of the DOFs."""
    if derivative == 0:
        return dofs
    return _affixed(dofs, "", DERIVATIVE_SUFFIXES[derivative])


def force_names(dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the unit forces on the DOFs."""
    return _affixed(dofs, FORCE_PREFIX, "")


def _affixed(dofs: tuple[str, ...], prefix: str, suffix: str) -> tuple[str, ...]:
    if len(dofs) <= MOST_CACHED:
        return _cached_affixed(dofs, prefix, suffix)
    return tuple([prefix + dof + suffix for dof in dofs])


def derivative_name(dof: str, order: int, dofs: tuple[str, ...]) -> str:
    """Name any derivative of a DOF's displacement, clear of the names of the other DOFs' motions.

    >>> derivative_name("y", 3, ("y",))
    'y_d3'
    """
    if order < len(DERIVATIVE_SUFFIXES):
        return dof + DERIVATIVE_SUFFIXES[order]
    name = f"{dof}_d{order}"
    while name in motions(dofs):
        name += "_"
    return name


@lru_cache(maxsize=256)
def _cached_affixed(dofs: tuple[str, ...], prefix: str, suffix: str) -> tuple[str, ...]:
    return tuple([prefix + dof + suffix for dof in dofs])


def reaction_names(dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the forces that it takes to move the DOFs as prescribed."""
    return tuple([REACTION_PREFIX + dof for dof in dofs])


def motions(dofs: tuple[str, ...]) -> dict[str, tuple[int, int]]:
    """Map every displacement, velocity and acceleration to (position of the DOF, derivative)."""
    return {
        name: (index, derivative)
        for derivative in range(len(DERIVATIVE_SUFFIXES))
        for index, name in enumerate(motion_names(dofs, derivative))
    }


def listed(names: Sequence[str], most: int = MOST_LISTED) -> str:
    """Join names for a message, cutting a long list short."""
    text = ", ".join(names[:most])
    return text if len(names) <= most else f"{text} and {len(names) - most} more"


def removal_of(names: Sequence[str], owner: str = "this error's `dofs`") -> str:
    """Write the call that takes DOFs out of a model, for a message.

    >>> removal_of(["1.4", "1.5"])
    "model.without(['1.4', '1.5'])"
    """
    few = len(names) <= MOST_LISTED
    return f"model.without({[str(name) for name in names]})" if few else f"model.without([...]) with {owner}"


def checked_names(given: str | Sequence[str], count: int, what: str) -> tuple[str, ...]:
    """Check a list of names: as many as there are signals, non-empty strings, no two the same.

    Raises
    ------
    SignalNameError
        Wrong count, entries that are not text, or duplicates, which python-control would merge
        silently into one signal.
    """
    names = as_tuple(given, what)
    if len(names) != count:
        msg = (
            f"{len(names)} names were given for {count} {what}: {listed([str(name) for name in names])}. Name each one."
        )
        raise SignalNameError(msg, names=tuple(str(name) for name in names))
    if not _is_plain(names):
        _require_sound(names, what)
    if len(set(names)) != count:
        twice = _duplicates(names)
        msg = f"Names of {what} must differ, but {listed(twice)} stands more than once. Rename all but one."
        raise SignalNameError(msg, names=twice)
    return names


def _is_plain(names: tuple[str, ...]) -> bool:
    """Tell by all names at once that none is empty, holds blanks or anything that cannot be printed."""
    if not set(map(type, names)) <= {str} or not all(names):
        return False
    joined = "".join(names)
    return joined.isprintable() and " " not in joined


def _require_sound(names: tuple[str, ...], what: str) -> None:
    """Refuse names that are no text, and those with blanks at their ends or control characters."""
    if not all(isinstance(name, str) and name.strip() == name and name for name in names):
        bad = [repr(name) for name in names if not (isinstance(name, str) and name.strip() == name and name)]
        msg = f"Names of {what} must be non-empty text without blanks at the ends, not {listed(bad)}."
        raise SignalNameError(msg, names=tuple(bad))
    odd = [repr(name) for name in names if not name.isprintable() and _acts_on_a_terminal(name)]
    if odd:
        msg = f"Names of {what} hold control characters, which terminals and tables obey: {listed(odd)}. Rename them."
        raise SignalNameError(msg, names=tuple(odd))


def _acts_on_a_terminal(text: str) -> bool:
    """Tell whether text holds control characters (Cc), marks that turn the direction of text (Cf), or line ends."""
    return any(unicodedata.category(letter) in UNPRINTED for letter in text)


def checked_dofs(given: str | Sequence[str], count: int) -> tuple[str, ...]:
    """Check the names of the DOFs, and that their velocities and accelerations have names of their own.

    Raises
    ------
    SignalNameError
        As `checked_names`, or a DOF is named like the velocity or acceleration of another.
    """
    names = as_tuple(given, "DOFs")
    return _cached_dofs(names, count) if len(names) <= MOST_CACHED else _checked_dofs(names, count)


@lru_cache(maxsize=256)
def _cached_dofs(names: tuple[str, ...], count: int) -> tuple[str, ...]:
    return _checked_dofs(names, count)


def _checked_dofs(names: tuple[str, ...], count: int) -> tuple[str, ...]:
    dofs = checked_names(names, count, "DOFs")
    every = "\n".join([*dofs, ""])
    may_be_derived = any(f"{suffix}\n" in every for suffix in DERIVATIVE_SUFFIXES[1:])
    derived = [name for name in dofs if name.endswith(DERIVATIVE_SUFFIXES[1:])] if may_be_derived else []
    places = dict.fromkeys(dofs) if derived else {}
    clash = tuple([name for name in derived if any(stem in places for stem, _ in derivative_stems(name))])
    if clash:
        msg = (
            f"{listed(clash)} would name both a DOF's motion and a derivative of another DOF's motion, "
            "since the velocity of y is called y_dot and its acceleration y_ddot. Rename one of the DOFs."
        )
        raise SignalNameError(msg, names=clash)
    return dofs


def derivative_stems(name: str) -> list[tuple[str, int]]:
    """Return the names of which this one would be the velocity or acceleration, with the order of the derivative.

    >>> derivative_stems("y_ddot"), derivative_stems("y")
    ([('y', 2)], [])
    """
    return [
        (name.removesuffix(suffix), order)
        for order, suffix in enumerate(DERIVATIVE_SUFFIXES)
        if suffix and name.endswith(suffix)
    ]


def as_tuple(names: Names, what: str = "") -> tuple[str, ...]:
    """Read one name, several or none as a tuple of text; whole numbers in a list are read as text (node numbers).

    Raises
    ------
    SignalNameError
        A set, whose order changes from run to run, a mapping, a single number, or what holds other things than text
        and whole numbers.

    Examples
    --------
    >>> as_tuple("y"), as_tuple([101, 102]), as_tuple(None)
    (('y',), ('101', '102'), ())
    """
    if isinstance(names, str):
        return (str(names),)
    if names is None:
        return ()
    if type(names) not in LISTS and isinstance(names, set | frozenset | Mapping | bytes):
        raise _no_names_error(names, what)
    try:
        found = tuple(islice(names, MOST_NAMES))
    except Exception as cause:  # an array without dimensions, a class, an object that fails
        raise _no_names_error(names, what) from cause
    return found if all([type(name) is str for name in found]) else _as_texts(found, what)  # noqa: C419  # faster


def _no_names_error(given: object, what: str) -> SignalNameError:
    """Make the refusal of a single thing in place of names."""
    order = ", whose order changes from run to run" if isinstance(given, set | frozenset) else ""
    example = f"[{given}]" if is_whole_number(given) and abs(given) <= LARGEST_NUMBER else "['a', 'b']"
    msg = (
        f"Names{f' of {what}' if what else ''} must be a text or a list of texts, not {described(given)}{order}. "
        f"Give a list, such as {example}."
    )
    return SignalNameError(msg, names=())


def _as_texts(names: tuple[object, ...], what: str) -> tuple[str, ...]:
    for name in names:
        if not (isinstance(name, str) or is_whole_number(name)):
            msg = (
                f"Names{f' of {what}' if what else ''} must be non-empty text without blanks at the ends, or whole "
                f"numbers in a list, not a {type(name).__name__}. Name each one."
            )
            raise SignalNameError(msg, names=(type(name).__name__,))
        if not isinstance(name, str) and abs(int(name)) > LARGEST_NUMBER:
            msg = f"A number as a name may have 18 digits, not {int(name).bit_length()} bits."
            raise SignalNameError(msg, names=())
    return tuple([str(name) for name in names])


def physical_places(names: Iterable[str], dofs: tuple[str, ...], what: Literal["input", "output"]) -> dict[str, int]:
    """Find which names are those of unit forces on DOFs (inputs), or of motions of DOFs (outputs).

    Parameters
    ----------
    names : iterable of str
    dofs : tuple of n str
    what : {"input", "output"}

    Returns
    -------
    dict from name to int
        The DOF's position, for a velocity n more, for an acceleration 2n more; names of other things are left out.

    Examples
    --------
    >>> physical_places(["b_ddot", "F_a"], ("a", "b"), "output")
    {'b_ddot': 5}
    """
    stems: dict[str, list[tuple[str, int]]] = {}
    for name in names:
        if what == "input":
            stems[name] = [(name.removeprefix(FORCE_PREFIX), 0)] if name.startswith(FORCE_PREFIX) else []
        else:
            stems[name] = [(name, 0), *derivative_stems(name)]
    places = dict.fromkeys([stem for found in stems.values() for stem, _ in found], -1)
    for index, dof in enumerate(dofs):
        if dof in places:
            places[dof] = index
    n = len(dofs)
    return {name: n * k + places[stem] for name, found in stems.items() for stem, k in found if places[stem] >= 0}


def reconciled_names(
    given: Names, found: Sequence[str | None], dofs: tuple[str, ...], what: Literal["input", "output"]
) -> tuple[str, ...]:
    """Take the given names, or the ones found by what signals are, and refuse a physical name on another signal.

    Raises
    ------
    SignalNameError
        As `checked_names`, or a name of a force or motion on a signal that is something else.
    """
    letter, meaning, matrices = SIGNAL_WORDS[what]
    if given is None:
        physical_found = [name for name in found if name is not None]
        once = len(set(physical_found)) == len(physical_found)
        return tuple([name if name and once else f"{letter}[{i}]" for i, name in enumerate(found)])
    names = checked_names(given, len(found), f"{what}s")
    others = [name for name, by_matrix in zip(names, found, strict=True) if name != by_matrix]
    wrong = tuple(physical_places(others, dofs, what)) if others else ()
    if wrong:
        msg = (
            f"Among the {what}s, {listed(wrong)} is the name of {meaning}, but {matrices} say something else. "
            "Rename it, or take the physical signal by select()."
        )
        raise SignalNameError(msg, names=wrong)
    return names


def picked_places(
    names: Names, own: tuple[str, ...], dofs: tuple[str, ...], what: Literal["input", "output"]
) -> list[int]:
    """Return the positions of names in a model's own signals followed by the physical ones (see `physical_places`).

    Raises
    ------
    SignalNameError
        No name, one that is unknown, or one that stands twice.
    """
    wanted = as_tuple(names)
    if not wanted:
        msg = f"No {what} is selected: a model needs at least one."
        raise SignalNameError(msg, names=())
    checked_names(wanted, len(wanted), f"{what}s")
    places = {name: len(own) + place for name, place in physical_places(wanted, dofs, what).items()}
    asked = set(wanted)
    places.update({name: index for index, name in enumerate(own) if name in asked})
    for name in wanted:
        if name not in places:
            derivatives = range(len(DERIVATIVE_SUFFIXES))
            physical = [force_names(dofs)] if what == "input" else [motion_names(dofs, k) for k in derivatives]
            raise unknown_name_error(name, what, dict.fromkeys(chain(own, *physical)))
    return [places[name] for name in wanted]


def unknown_name_error(name: object, what: str, known: Iterable[str]) -> SignalNameError:
    """Make the refusal of a name that is not in the model, with the nearest ones and the first of all."""
    names = list(known)
    near = nearest_names(name, names) if isinstance(name, str) else []
    nearest = f" Nearest: {', '.join(near)}." if near else ""
    msg = f"The model has no {what} {shown(name)}. Known: {listed(names, most=24)}.{nearest}"
    return SignalNameError(msg, names=(name if isinstance(name, str) else shown(name),))


def _duplicates(names: Iterable[str]) -> tuple[str, ...]:
    seen: set[str] = set()
    twice: dict[str, None] = {}
    for name in names:
        if name in seen:
            twice[name] = None
        seen.add(name)
    return tuple(twice)
