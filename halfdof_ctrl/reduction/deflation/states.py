"""The coordinates of a deflated model: displacements, velocities and, rarely, higher derivatives of DOFs."""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.names import derivative_name


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StateSelection:
    """The states of a deflated model: displacements, velocities and, rarely, higher derivatives of DOFs."""

    dofs: tuple[str, ...]  #: names of the n DOFs
    places: tuple[tuple[int, int], ...]  #: (DOF, order of the derivative) of each state
    differentiations: dict[str, int]  #: how often the equation of a DOF was differentiated, if at all

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple([derivative_name(self.dofs[j], order, self.dofs) for j, order in self.places])

    @property
    def inertial(self) -> tuple[str, ...]:
        """DOFs with two states or more."""
        return tuple([dof for dof, count in zip(self.dofs, self._counts(), strict=True) if count > 1])

    @property
    def half(self) -> tuple[str, ...]:
        """DOFs with one state."""
        return tuple([dof for dof, count in zip(self.dofs, self._counts(), strict=True) if count == 1])

    @property
    def static(self) -> tuple[str, ...]:
        """DOFs without a state: they follow from the others and the inputs."""
        return tuple([dof for dof, count in zip(self.dofs, self._counts(), strict=True) if count == 0])

    def kinds_of(self, dofs: tuple[str, ...]) -> dict[str, str]:
        """Tell for each of the model's DOFs with less than two states whether it is half or static."""
        return {dof: "half" if dof in self.half else "static" for dof in dofs if dof not in self.inertial}

    def state_of(self, displacements: FloatArray, velocities: FloatArray) -> FloatArray:
        """Return the states that belong to displacements and velocities of all n DOFs; higher derivatives are zero."""
        from_q, from_v = self.state_maps()[:2]
        return np.asarray(from_q @ displacements + from_v @ velocities)

    def state_maps(self) -> tuple[FloatArray, ...]:
        """Give L_q, L_v, ..., (N, n) each, of x = L_q q + L_v q' + ..."""
        maps = np.zeros((max([order for _, order in self.places], default=0) + 2, len(self.places), len(self.dofs)))
        for index, (j, order) in enumerate(self.places):
            maps[order, index, j] = 1.0
        return tuple(maps[: max(2, len(maps) - 1)])

    def _counts(self) -> list[int]:
        return [int(count) for count in np.bincount([j for j, _ in self.places], minlength=len(self.dofs))]
