"""Rigid ties between DOFs, eliminated by substitution where that keeps names, by multipliers otherwise.

A point of an assembly is a row r over all DOFs of its parts, ``r q``: one entry 1 for a DOF, a lever arm's row for a
point of a rigid body. A tie says ``(r_a - r_b) q = 0``. Where one of the points is a DOF of its own, not yet
substituted, that DOF is replaced by the other point, so that with the n x r substitution T

    q = T p,    M -> T^T M T, and so for C and K

Where neither is, the tie is kept as an equation with the force in it as a multiplier: a DOF without mass and damping,
which makes index 3. A tie that says nothing new is redundant, and refused by name.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.base.errors import AssemblyError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.sparse_arrays import SparseMatrix

Row = dict[int, float]

TIE_ROUNDING = 1e-12  #: of the entries that cancel: what is left of a tie that says nothing
DEPENDENT = 1e-10  #: of a row of unit length: what earlier ties leave of one that follows from them


class Ties:
    """Substitutions and multipliers for n DOFs, grown tie by tie."""

    def __init__(self, dofs: Sequence[str]) -> None:
        self.dofs = dofs
        self.replaced: dict[int, Row] = {}  # a DOF and what stands in its place
        self.equations: list[tuple[str, Row]] = []  # of multipliers, by name

    def reduced(self, row: Mapping[int, float]) -> Row:
        """Express a row by the DOFs that are left."""
        done: Row = {}
        size: Row = {}
        waiting = list(row.items())
        while waiting:
            place, value = waiting.pop()
            if place in self.replaced:
                waiting += [(inner, value * factor) for inner, factor in self.replaced[place].items()]
            else:
                done[place] = done.get(place, 0.0) + value
                size[place] = max(size.get(place, 0.0), abs(value))
        return {place: value for place, value in done.items() if abs(value) > TIE_ROUNDING * size[place]}

    def tie(self, first: Mapping[int, float], second: Mapping[int, float], words: str, name: str) -> None:
        """Let two points move as one; the DOF of the second goes if one of them has to.

        Raises
        ------
        AssemblyError
            The tie says nothing new.
        """
        a, b = self.reduced(first), self.reduced(second)
        difference = self.reduced({place: a.get(place, 0.0) - b.get(place, 0.0) for place in {**a, **b}})
        if not difference:
            msg = f"{words} is redundant: the joints before it hold these points together already. Leave it out."
            raise AssemblyError(msg, names=(name,))
        for own, other in ((b, a), (a, b)):
            if len(own) == 1:
                place, factor = next(iter(own.items()))
                if factor == 1.0 and place not in other:
                    self.replaced[place] = other
                    return
        self.equations.append((name, difference))

    def hold(self, row: Mapping[int, float], words: str, name: str) -> None:
        """Hold a point at zero.

        Raises
        ------
        AssemblyError
            It is held already.
        """
        self.tie({}, row, words, name)

    def is_one(self, first: Mapping[int, float], second: Mapping[int, float]) -> bool:
        """Tell whether two points are rigidly one."""
        a, b = self.reduced(first), self.reduced(second)
        return not self.reduced({place: a.get(place, 0.0) - b.get(place, 0.0) for place in {**a, **b}})

    def substitution(self) -> tuple[SparseMatrix, list[int]]:
        """Give T of ``q = T p`` and the places of p among q."""
        kept = [place for place in range(len(self.dofs)) if place not in self.replaced]
        column = {place: j for j, place in enumerate(kept)}
        rows, columns, values = list(kept), list(range(len(kept))), [1.0] * len(kept)
        for place in self.replaced:
            for inner, value in self.reduced({place: 1.0}).items():
                rows.append(place)
                columns.append(column[inner])
                values.append(value)
        shape = (len(self.dofs), len(kept))
        return csc_array(coo_array((values, (rows, columns)), shape=shape)), kept

    def constraints(self, kept: Sequence[int]) -> SparseMatrix:
        """Give the equations that are left, one row each, over the DOFs that are left.

        Raises
        ------
        AssemblyError
            One follows from the others.
        """
        column = {place: j for j, place in enumerate(kept)}
        found = [(i, column[place], value) for i, (_, row) in enumerate(self.equations)
                 for place, value in self.reduced(row).items()]  # fmt: skip
        rows, columns, values = (list(part) for part in zip(*found, strict=True)) if found else ([], [], [])
        G = csc_array(coo_array((values, (rows, columns)), shape=(len(self.equations), len(kept))))
        self._require_independent(G)
        return G

    def _require_independent(self, G: SparseMatrix) -> None:
        used = np.unique(G.indices)  # rows of csc are equations: the columns that they touch are few
        touched = np.flatnonzero(np.diff(G.indptr))
        dense = G[:, touched].toarray() if used.size else np.zeros((G.shape[0], 0))
        basis: list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = []
        for i, (name, _) in enumerate(self.equations):
            length = float(np.linalg.norm(dense[i]))
            row = dense[i] / length if length > 0.0 else dense[i]
            for _ in range(2):  # twice is enough
                for vector in basis:
                    row = row - vector * (vector @ row)
            rest = float(np.linalg.norm(row))
            if rest <= DEPENDENT:
                before = [other for other, _ in self.equations[:i]]
                msg = (
                    f"The tie {name} is redundant: it follows from {listed(before) or 'the joints before it'}, so that "
                    "the force in it is not determined. Leave one of them out, or put a spring in its place."
                )
                raise AssemblyError(msg, names=(name,))
            basis.append(row / rest)
