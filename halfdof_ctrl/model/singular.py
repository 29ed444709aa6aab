"""Why a pencil is singular: which DOFs its null vectors move, which equations they combine, and the words for it.

This serves the words of a refusal alone, so the reduction and the oracle may both ask; whether a pencil is
singular each of them decides by itself.

At a generic point, the null space of P(s) on the right holds the motions that take no force, that on the left the
combinations of equations that say nothing. Its support does not depend on the basis, nor does its finest
split into parts that share no DOF: these are the connected components of any basis in echelon form, each of which
is a cause of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import EPS, DenseMatrix, powers_of_two
from halfdof_ctrl.base.errors import SingularPencilError
from halfdof_ctrl.base.names import listed, removal_of

Kind: TypeAlias = Literal["unattached", "unused", "floating", "redundant", "free", "empty", "identical", "dependent"]
CAUSE_WORDS: dict[Kind, str] = {
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
    "unattached": "Attach a spring, a damper or a mass to what is loose, or take it out: {removal}.",
    "unused": "Attach a spring, a damper or a mass to what is loose, or take it out: {removal}.",
    "floating": "Tie what floats to the ground, or give it its mass.",
    "redundant": "Remove one of the redundant constraints.",
    "free": "Put the equation that is missing in place of one that follows from others.",
    "empty": "Put the equation that is missing in place of one that follows from others.",
    "identical": "Put the equation that is missing in place of one that follows from others.",
    "dependent": "Put the equation that is missing in place of one that follows from others.",
}
MOST_CAUSES = 4  #: causes that a message spells out
NULL = 64 * EPS  #: times the size: singular values below this part of the largest are zero
SCALING_SWEEPS = 10  #: of scaling, rows and columns in turns
NULL_VECTOR_SHARE = 1e-6  #: what has more than this share of a null vector in echelon form takes part in it
Group: TypeAlias = frozenset[int]
SINGLE: tuple[Kind, ...] = ("unattached", "unused", "empty")
WITH_THEIR_EQUATIONS: tuple[Kind, ...] = ("unattached", "floating", "redundant")
PAIR_OF_DOFS = 2


@dataclass(frozen=True, slots=True)
class Cause:
    """One independent reason why a pencil is singular, and the DOFs whose unknowns or equations it concerns."""

    kind: Kind
    names: tuple[str, ...]

    def __str__(self) -> str:
        """Say it in words."""
        return CAUSE_WORDS[self.kind].format(names=listed(self.names))


@dataclass(frozen=True, slots=True, eq=False)
class NullSpaces:
    """Independent groups of unknowns and of equations that take part in null vectors of a matrix."""

    unknowns: tuple[Group, ...]
    equations: tuple[Group, ...]
    dimension: int  #: of either null space
    smallest: float  #: singular value of the matrix in scaled rows and columns, relative to the largest


def null_spaces(P: DenseMatrix) -> NullSpaces:
    """Find the null spaces of a square matrix that is singular."""
    left, values, right = scipy.linalg.svd(_scaled(P))
    dimension = max(1, int(np.count_nonzero(values <= NULL * values.size * values[0])))
    return NullSpaces(
        unknowns=_groups(right[-dimension:].conj().T),
        equations=_groups(left[:, -dimension:]),
        dimension=dimension,
        smallest=float(values[-1] / values[0]) if values[0] > 0.0 else 0.0,
    )


def causes(null: NullSpaces, coefficients: Sequence[DenseMatrix], dofs: Sequence[str]) -> list[Cause]:
    """Put each group into words that a mechanical engineer knows.

    Parameters
    ----------
    null : NullSpaces
        Of ``K + C s + M s^2`` at a generic point.
    coefficients : (K, C, M)
    dofs : sequence of str
        Names of the unknowns and of the equations.
    """
    groups: list[tuple[Kind, Group]] = [
        (_kind_of_unknowns(group, null, coefficients), group) for group in null.unknowns
    ]
    told = {group for kind, group in groups if kind in WITH_THEIR_EQUATIONS}
    groups += [(_kind_of_equations(group, coefficients), group) for group in null.equations if group not in told]
    found: list[Cause] = []
    for single in SINGLE:
        members = sorted(frozenset[int]().union(*(group for kind, group in groups if kind == single)))
        if members:
            found.append(Cause(single, tuple([dofs[index] for index in members])))
    for kind, group in groups:
        if kind not in SINGLE:
            found.append(Cause(kind, tuple([dofs[index] for index in sorted(group)])))
    return found


def _scaled(P: DenseMatrix) -> DenseMatrix:
    """Bring the largest entries of rows and columns near one."""
    for _ in range(SCALING_SWEEPS):
        P = P * np.sqrt(powers_of_two(np.abs(P).max(axis=1, initial=0.0)))[:, None]
        P = P * np.sqrt(powers_of_two(np.abs(P).max(axis=0, initial=0.0)))
    return P


def _groups(basis: DenseMatrix) -> tuple[Group, ...]:
    """Split a space into the parts that share no coordinate, each given by the coordinates it moves."""
    _, _, order = scipy.linalg.qr(basis.conj().T, pivoting=True, mode="economic")
    pivots = order[: basis.shape[1]]
    echelon = np.abs(np.linalg.solve(basis[pivots].T, basis.T))
    takes_part = echelon > NULL_VECTOR_SHARE * echelon.max(axis=1, keepdims=True)
    vectors, coordinates = takes_part.shape
    graph = np.zeros((vectors + coordinates, vectors + coordinates), dtype=bool)
    graph[:vectors, vectors:] = takes_part
    _, labels = connected_components(csr_array(graph), directed=False)
    groups = [
        frozenset(np.flatnonzero(labels[vectors:] == label).tolist()) for label in dict.fromkeys(labels[:vectors])
    ]
    return tuple(sorted(groups, key=min))


def _kind_of_unknowns(group: Group, null: NullSpaces, coefficients: Sequence[DenseMatrix]) -> Kind:
    members = sorted(group)
    if len(members) == 1:
        return "unused" if any(matrix[members].any() for matrix in coefficients) else "unattached"
    if group not in null.equations:
        return "free"
    stiffness, *moving = coefficients
    if not stiffness[np.ix_(members, members)].any() and not any(matrix[:, members].any() for matrix in moving):
        return "redundant"
    return "floating" if _is_constant(np.vstack([matrix[:, members] for matrix in coefficients])) else "free"


def _kind_of_equations(group: Group, coefficients: Sequence[DenseMatrix]) -> Kind:
    members = sorted(group)
    if len(members) == 1:
        return "empty"
    rows = np.hstack([matrix[members] for matrix in coefficients])
    return "identical" if len(members) == PAIR_OF_DOFS and _is_constant(rows.T) else "dependent"


def _is_constant(columns: DenseMatrix) -> bool:
    """Return whether columns of K, C and M on top of each other depend, so that a null vector holds at every s."""
    values = scipy.linalg.svdvals(_scaled(columns))
    return bool(values[-1] <= NULL * max(columns.shape) * values[0])


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
    spring, a damper or a mass to what is loose, or take it out: model.without(['b']).
    """
    moving = f"DOFs {listed(dofs)} can move together" if len(dofs) > 1 else f"DOF {listed(dofs)} can move"
    saying = "equations of {} depend on each other" if len(equations) > 1 else "equation of {} says nothing"
    reasons = [str(cause) for cause in causes[:MOST_CAUSES]]
    if len(causes) > MOST_CAUSES:
        reasons.append(f"and {len(causes) - MOST_CAUSES} more such causes")
    outside = [name for cause in causes if "removal" in REMEDIES[cause.kind] for name in cause.names]
    remedies = list(dict.fromkeys(REMEDIES[cause.kind].format(removal=removal_of(outside)) for cause in causes))
    remedies = remedies or [f"Remove what is redundant, or take out what is loose: {removal_of(dofs)}."]
    msg = (
        f"The pencil is singular: det P(s) vanishes at every s ({fact}). {moving} in any way without a force, and the "
        f"{saying.format(listed(equations))}{': ' if reasons else ''}{'; '.join(reasons)}. {' '.join(remedies)}"
    )
    return SingularPencilError(msg, dofs=tuple(dofs), equations=tuple(equations))
