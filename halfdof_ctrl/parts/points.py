"""Points of parts by name: DOFs, and outputs that are displacements, such as the points of a rigid body."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.base.arrays import Matrix
from halfdof_ctrl.base.doors import shown
from halfdof_ctrl.base.errors import ParameterError, SignalNameError
from halfdof_ctrl.base.names import checked_names, listed, motions
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.links import LINKS_AXES
from halfdof_ctrl.parts.ties import Row


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """All DOFs and points of some parts, each by the name ``part_dof``, as rows over all DOFs."""

    dofs: tuple[str, ...]
    rows: Mapping[str, Row]
    part_of: Mapping[str, str]
    outputs: tuple[str, ...]  #: names of points that are no DOFs, and of other outputs of parts

    def named(self, name: str) -> tuple[str, ...]:
        """Give a point, or its axes where the name has none.

        Raises
        ------
        SignalNameError
            There is none of this name.
        """
        if name in self.rows:
            return (name,)
        found = tuple([f"{name}_{axis}" for axis in LINKS_AXES if f"{name}_{axis}" in self.rows])
        if not found:
            part = max(
                (part for part in set(self.part_of.values()) if name.startswith(f"{part}_")), key=len, default=""
            )
            near = [other for other in self.rows if not part or self.part_of[other] == part]
            where = f"part {part} has" if part else "the parts have"
            msg = f"No part has a point {shown(name)}. Points are called part_dof; {where} {listed(near, most=24)}."
            raise SignalNameError(msg, names=(str(name),))
        return found

    def pairs(self, a: str, b: str) -> list[tuple[str, str]]:
        """Match two points axis by axis.

        Raises
        ------
        SignalNameError
            One is unknown, or they have no axes in common.
        """
        first, second = self.named(a), self.named(b)
        if len(first) == len(second) == 1:
            return [(first[0], second[0])]
        by_axis = [{name.rpartition("_")[2]: name for name in names} for names in (first, second)]
        common = [axis for axis in LINKS_AXES if axis in by_axis[0] and axis in by_axis[1]]
        if len(common) != min(len(first), len(second)) or not common:
            msg = (
                f"{a} and {b} have not the same axes: {listed(first)} and {listed(second)}. Name the axes one by one, "
                f'such as Rigid("{first[0]}", "{second[0]}").'
            )
            raise SignalNameError(msg, names=(a, b))
        return [(by_axis[0][axis], by_axis[1][axis]) for axis in common]


def points_of(parts: Mapping[str, SecondOrderModel]) -> Points:
    """Collect the points of all parts.

    Raises
    ------
    ParameterError
        No part, or one that is no model.
    SignalNameError
        Two points get the same name.
    """
    if not isinstance(parts, Mapping) or not parts:
        msg = 'parts must be a mapping from names to models, such as {"body": point_mass(400)}, not empty.'
        raise ParameterError(msg, parameter="parts", value=parts)
    checked_names(list(parts), len(parts), "parts")
    dofs: list[str] = []
    rows: dict[str, Row] = {}
    part_of: dict[str, str] = {}
    others: list[str] = []
    for part, model in parts.items():
        if not isinstance(cast("object", model), SecondOrderModel):
            kind = type(model).__name__
            msg = f"Part {shown(part)} is a {kind}, but it must be a model, such as mechss or zener make it."
            raise ParameterError(msg, parameter=part, value=model)
        for i, dof in enumerate(model.dofs):
            _add(rows, part_of, f"{part}_{dof}", {len(dofs) + i: 1.0}, part)
        for name, row in _displacements(model, len(dofs)).items():
            _add(rows, part_of, f"{part}_{name}", row, part)
            others.append(f"{part}_{name}")
        dofs += [f"{part}_{dof}" for dof in model.dofs]
    return Points(tuple(dofs), rows, part_of, tuple(others))


def _add(rows: dict[str, Row], part_of: dict[str, str], name: str, row: Row, part: str) -> None:
    if name in rows:
        msg = (
            f"{name} would name points of two parts, {part_of[name]} and {part}: part and DOF are joined by _. Rename "
            "a part."
        )
        raise SignalNameError(msg, names=(name,))
    rows[name], part_of[name] = row, part


def _displacements(model: SecondOrderModel, first: int) -> dict[str, Row]:
    """Give the outputs of a part that are displacements of points that are no DOFs, as rows over all DOFs."""
    known = motions(model.dofs)
    F, *others = (as_sparse(part).tocsr() for part in (model.F, model.G, model.H, model.D, model.Dv, model.Da))
    found: dict[str, Row] = {}
    for i, name in enumerate(model.outputs):
        plain = not any(np.diff(part.indptr[i : i + 2]).any() for part in others)
        span = slice(*F.indptr[i : i + 2].tolist())
        if name not in known and plain and F.indices[span].size and not np.iscomplexobj(F.data):
            places, values = F.indices[span].tolist(), F.data[span].tolist()
            found[name] = {first + place: value for place, value in zip(places, values, strict=True)}
    return found


def block_diagonal(blocks: Sequence[Matrix]) -> SparseMatrix:
    """Put matrices of any shape on a diagonal, as one sparse matrix."""
    parts = [coo_array(block) for block in blocks]
    rows, columns = (np.concatenate([[0], np.cumsum([part.shape[axis] for part in parts])]) for axis in range(2))
    data = np.concatenate([part.data for part in parts])
    row = np.concatenate([part.row + first for part, first in zip(parts, rows, strict=False)])
    column = np.concatenate([part.col + first for part, first in zip(parts, columns, strict=False)])
    return csc_array(coo_array((data, (row, column)), shape=(int(rows[-1]), int(columns[-1]))))
