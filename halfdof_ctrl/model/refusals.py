"""Wording of the refusal of a singular pencil: what is loose, in words of springs, masses and constraints.

Names come in and sentences go out. Whoever finds that a pencil is singular, and how, can say it with these.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from halfdof_ctrl.base.errors import SingularPencilError
from halfdof_ctrl.base.names import listed

Kind: TypeAlias = Literal["unattached", "unused", "floating", "redundant", "free", "empty", "identical", "dependent"]

WORDS: dict[Kind, str] = {
    "unattached": "nothing is attached to {names}, no spring, no damper and no mass",
    "unused": "{names} appears in no equation",
    "floating": "{names} float as one body that springs and dampers tie to nothing else, and no mass takes part",
    "redundant": "the constraints of the multipliers {names} are redundant, such as a constraint that stands twice",
    "free": "{names} can move together in a way that no equation resists",
    "empty": "the equation of {names} is empty",
    "identical": "the equations of {names} are identical but for a factor",
    "dependent": "the equations of {names} are dependent, so that one follows from the others",
}
REMEDIES: dict[Kind, str] = {
    "unattached": "Attach a spring, a damper or a mass to what is loose, or remove it.",
    "unused": "Attach a spring, a damper or a mass to what is loose, or remove it.",
    "floating": "Tie what floats to the ground, or give it its mass.",
    "redundant": "Remove one of the redundant constraints.",
    "free": "Put the equation that is missing in place of one that follows from others.",
    "empty": "Put the equation that is missing in place of one that follows from others.",
    "identical": "Put the equation that is missing in place of one that follows from others.",
    "dependent": "Put the equation that is missing in place of one that follows from others.",
}
MOST_CAUSES = 4  #: causes that a message spells out


@dataclass(frozen=True, slots=True)
class Cause:
    """One independent reason why a pencil is singular, and the DOFs whose unknowns or equations it concerns."""

    kind: Kind
    names: tuple[str, ...]

    def __str__(self) -> str:
        """Say it in words."""
        return WORDS[self.kind].format(names=listed(self.names))


def singular_pencil_error(
    *, dofs: Sequence[str], equations: Sequence[str], fact: str, causes: Sequence[Cause] = ()
) -> SingularPencilError:
    """Make the refusal of a model whose ``det P(s)`` vanishes at every s.

    Parameters
    ----------
    dofs : sequence of str
        DOFs that take part in a motion without force, the support of the right null vectors of P(s).
    equations : sequence of str
        Equations that depend on each other, the support of the left null vectors, named by the DOF whose
        row they are (of a multiplier: its constraint).
    fact : str
        What was measured.
    causes : sequence of Cause, optional
        Why, as far as it is known.

    Returns
    -------
    SingularPencilError

    Examples
    --------
    >>> cause = Cause("unattached", ("b",))
    >>> error = singular_pencil_error(dofs=["b"], equations=["b"], fact="its rank is 1 of 2", causes=[cause])
    >>> print(error)  # doctest: +NORMALIZE_WHITESPACE
    The pencil is singular: det P(s) vanishes at every s (its rank is 1 of 2). DOF b can move in any way without a
    force, and the equation of b says nothing: nothing is attached to b, no spring, no damper and no mass. Attach a
    spring, a damper or a mass to what is loose, or remove it.
    """
    moving = f"DOFs {listed(dofs)} can move together" if len(dofs) > 1 else f"DOF {listed(dofs)} can move"
    saying = "equations of {} depend on each other" if len(equations) > 1 else "equation of {} says nothing"
    reasons = [str(cause) for cause in causes[:MOST_CAUSES]]
    if len(causes) > MOST_CAUSES:
        reasons.append(f"and {len(causes) - MOST_CAUSES} more such causes")
    remedies = dict.fromkeys(REMEDIES[cause.kind] for cause in causes) or {"Remove what is redundant or loose.": None}
    msg = (
        f"The pencil is singular: det P(s) vanishes at every s ({fact}). {moving} in any way without a force, and the "
        f"{saying.format(listed(equations))}{': ' if reasons else ''}{'; '.join(reasons)}. {' '.join(remedies)}"
    )
    return SingularPencilError(msg, dofs=tuple(dofs), equations=tuple(equations))
