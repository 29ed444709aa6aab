"""What a method gives as evidence: its decisions about ranks, and the warnings that follow from them."""

import warnings
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import CloseDecisionWarning, LostDigitsWarning, NearlyMasslessWarning, callers_level
from halfdof_ctrl.base.names import listed

Road: TypeAlias = Literal["selection", "orthogonal", "deflation"]
CLOSE = 1e3  #: a decision about a rank with a smaller gap between singular values is warned of
LOST = 1e-9  #: a state space that loses more than this against a direct solve is warned of
NEARLY_MASSLESS = 1e-10  #: scaled mass of a DOF over the largest one, below which a warning is given


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RankDecision:
    """The singular values by which one block of a matrix was split or found nonsingular."""

    matrix: Literal["M", "C", "W", "J"]  #: whose block; W of equation (2), J of equation (16)
    dofs: tuple[str, ...]  #: the DOFs of the block
    singular_values: FloatArray  #: of the scaled block, falling
    rank: int  #: how many of them count
    bound: float  #: those up to this one count as zero

    @property
    def gap(self) -> float:
        """Smallest singular value that counts over the largest that does not, or over the bound where all count.

        inf where the others are exactly zero or none counts.
        """
        values = self.singular_values
        if self.rank == 0:
            return float("inf")
        below = self.bound if self.rank == values.size else float(values[self.rank])
        return float(values[self.rank - 1]) / below if below > 0.0 else float("inf")


def warn_of_lost_digits(lost: float, rcond: float) -> None:
    """Warn where A and B lose more than 1e-9 of the largest entry of the transfer function."""
    if lost > LOST:
        msg = (
            f"The state space is exact, but A and B in double precision lose {lost:.1e} of the largest entry of the "
            "transfer function: the equations for the highest derivatives are ill conditioned "
            f"(reciprocal condition number {rcond:.1e}). descriptor_response keeps the digits."
        )
        warnings.warn(msg, LostDigitsWarning, stacklevel=callers_level())


def warn_of_close_decisions(evidence: tuple[RankDecision, ...]) -> None:
    """Warn of decisions that rest on singular values less than 1e3 apart."""
    for decision in evidence:
        if decision.gap < CLOSE:
            values, rank = decision.singular_values, decision.rank
            zero = f"{values[rank]:.1e} as zero" if rank < values.size else f"none as zero (bound {decision.bound:.1e})"
            msg = (
                f"A decision about a rank is close: of the singular values of a block of {decision.matrix}, "
                f"{values[rank - 1]:.1e} counts and {zero}. It concerns DOFs {listed(decision.dofs)}: look for entries "
                "that nearly cancel, or pass tol."
            )
            warnings.warn(msg, CloseDecisionWarning, stacklevel=callers_level())


def warn_of_tiny_masses(ratio: FloatArray, inertial: npt.NDArray[np.bool_], dofs: tuple[str, ...]) -> None:
    """Warn of DOFs whose mass is not zero but below 1e-10 of the largest, in the units of `mass_ratios`."""
    tiny = np.flatnonzero(inertial & (ratio < NEARLY_MASSLESS))
    if tiny.size:
        names = [dofs[index] for index in tiny.tolist()]
        largest = float(ratio[tiny].max())
        msg = (
            f"DOFs {listed(names)} have a mass of at most {largest:.1e} of the largest (in scaled units), but not "
            "zero: their two states are far faster than the others and cost digits. If they are meant to be "
            f"massless, set their mass to zero or pass tol={2.0 * largest:.0e}."
        )
        warnings.warn(msg, NearlyMasslessWarning, stacklevel=callers_level())
