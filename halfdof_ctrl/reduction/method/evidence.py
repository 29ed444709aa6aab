"""What a method gives as evidence: its decisions about ranks, and the warnings that follow from them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.base.errors import CloseDecisionWarning, LostDigitsWarning, NearlyMasslessWarning, give_warning
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.reduction.algebra.blocks import BlockSplit
from halfdof_ctrl.reduction.method.loss import NOTHING_LOST, Loss

CALLED_ILL_CONDITIONED = 1e-3  #: reciprocal condition number of W below which that is the cause of a loss
CLOSE_GAP = 1e3  #: a decision about a rank with a smaller gap between singular values is warned of
ALLOWED_LOSS = 1e-9  #: against a direct solve: above it other ways are tried, and what is kept is warned of
NEARLY_MASSLESS = 1e-10  #: scaled mass of a DOF over the largest one, below which a warning is given


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RankDecision:
    """The singular values by which one block of a matrix was split or found nonsingular."""

    matrix: Literal["M", "C", "W", "J"]  #: whose block; W of equation (2), J of equation (16)
    dofs: tuple[str, ...]  #: the DOFs of the block
    singular_values: FloatArray  #: of the scaled block, falling
    rank: int  #: how many of them count
    bound: float  #: those up to this one count as zero
    noise: float = float("inf")  #: those up to this one may be what rounding of the entries makes of a zero

    @classmethod
    def of(cls, matrix: Literal["M", "C"], dofs: tuple[str, ...], split: BlockSplit) -> "RankDecision":
        """Take over how a block was split."""
        return cls(
            matrix=matrix,
            dofs=dofs,
            singular_values=split.singular_values,
            rank=split.rank,
            bound=split.bound,
            noise=split.noise,
        )

    @property
    def is_doubtful(self) -> bool:
        """Whether a value that counts as zero is more than rounding, so that as stored the matrix has a higher rank."""
        return self.rank < self.singular_values.size and float(self.singular_values[self.rank]) > self.noise

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


@dataclass(frozen=True, slots=True)
class LightMasses:
    """DOFs whose mass is not zero but hardly counts."""

    dofs: tuple[str, ...]
    ratio: float  #: the largest of their masses over the largest of all, in the units of `mass_ratios`

    @classmethod
    def among(cls, ratio: FloatArray, inertial: npt.NDArray[np.bool_], dofs: tuple[str, ...]) -> "LightMasses | None":
        """Find those below 1e-10 of the largest; None if there are none."""
        tiny = np.flatnonzero(inertial & (ratio < NEARLY_MASSLESS))
        if tiny.size == 0:
            return None
        return cls(tuple([dofs[index] for index in tiny.tolist()]), float(ratio[tiny].max()))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Evidence:
    """What a method rests on, and what follows from it for whoever uses the state space."""

    decisions: tuple[RankDecision, ...]  #: singular values of blocks of M, C or J by which their ranks were decided
    rcond: float  #: reciprocal condition number of W, or the smallest of the systems (18)
    light: LightMasses | None = None  #: masses that hardly count
    loss: Loss = NOTHING_LOST  #: by the rounding of A, B, C and D; nothing where rcond says that it is none
    hardly: bool = False  #: whether rcond is near rounding, so that the number of states rests on it
    barely: bool = False  #: whether P(s) is singular to working precision, but not as its entries are stored
    altered: bool = False  #: whether `tol` made a state space that has another spectrum than the model, (19)

    @property
    def is_doubtful(self) -> bool:
        """Whether a decision took as zero what is more than rounding, which is warned of."""
        return any(decision.is_doubtful for decision in self.decisions)

    def warn(self, tol: float | None) -> None:
        """Warn of what a user must know whatever states he gets.

        Warns
        -----
        CloseDecisionWarning, NearlyMasslessWarning
        """
        if self.light is not None:
            _warn_of_light_masses(self.light)
        if self.altered:
            _warn_of_another_model(tol)
            return
        _warn_of_close_decisions(self.decisions)
        if self.hardly:
            _warn_of_hardly_regular(self.rcond)
        if self.barely:
            _warn_of_barely_regular()

    def warn_of_loss(self, what: str = "A, B, C and D") -> None:
        """Warn whoever uses these states where what is stored loses more than 1e-9 of a channel.

        Parameters
        ----------
        what : str, optional
            The numbers that are told of.

        Warns
        -----
        LostDigitsWarning
        """
        if not self.altered:
            cause = "some states are far faster than others, as DOFs with hardly any mass or damping make them"
            if self.rcond < CALLED_ILL_CONDITIONED:
                number = f"reciprocal condition number {self.rcond:.1e}"
                cause = f"the equations for the highest derivatives are ill conditioned ({number})"
            warn_of_lost_digits(self.loss, cause, what)


def _warn_of_another_model(tol: float | None) -> None:
    msg = (
        f"With tol={tol:g} singular values count as zero on which the spectrum depends: the state space is not "
        "that of this model but of one that differs by as much. Pass a smaller tol, unless that is what you mean."
    )
    give_warning(msg, CloseDecisionWarning)


def _warn_of_hardly_regular(rcond: float) -> None:
    msg = (
        f"The leading matrix W is regular, but hardly (rcond {rcond:.1e}): the number of states rests on "
        "its smallest singular value. Look for entries that nearly cancel and DOFs with hardly any mass or damping."
    )
    give_warning(msg, CloseDecisionWarning)


def _warn_of_barely_regular() -> None:
    msg = (
        "det P(s) vanishes at every s to working precision: only a part of M, C, K that is left where entries nearly "
        "cancel gives the equations one solution. It is more than rounding of the entries explains, and is taken as it "
        "is stored. Look for constraints that are nearly the same and other entries that nearly cancel: mend them if "
        "they should, or give the DOFs the mass, damper or spring that is meant."
    )
    give_warning(msg, CloseDecisionWarning)


def warn_of_lost_digits(loss: Loss, cause: str, what: str = "A, B, C and D") -> None:
    """Warn where what is stored loses more than 1e-9 of a channel.

    Warns
    -----
    LostDigitsWarning
    """
    if loss.value > ALLOWED_LOSS:
        msg = (
            f"The state space is exact, but {what} as double precision stores them lose {loss.there:.1e} of "
            f"{loss.output} from {loss.source} at {loss.omega:.3g} rad/s: terms cancel in them that are "
            f"{loss.there / EPS:.0e} times as large as what they leave, since {cause}. "
            "descriptor_response keeps the digits."
        )
        give_warning(msg, LostDigitsWarning)


def _warn_of_close_decisions(evidence: tuple[RankDecision, ...]) -> None:
    """Warn of decisions that rest on singular values less than 1e3 apart, and of zeros that are more than rounding."""
    for decision in evidence:
        values, rank = decision.singular_values, decision.rank
        if decision.gap < CLOSE_GAP:
            zero = f"{values[rank]:.1e} as zero" if rank < values.size else f"none as zero (bound {decision.bound:.1e})"
            msg = (
                f"A decision about a rank is close: of the singular values of a block of {decision.matrix}, "
                f"{values[rank - 1]:.1e} counts and {zero}. It concerns DOFs {listed(decision.dofs)}: look for entries "
                "that nearly cancel, or pass tol."
            )
            give_warning(msg, CloseDecisionWarning)
        elif decision.is_doubtful:
            known = (
                f"rounding of its entries explains {decision.noise:.1e}"
                if decision.noise
                else "its entries have so few digits that they were not rounded"
            )
            msg = (
                f"A block of {decision.matrix} counts as rank {rank}: its next singular value, {values[rank]:.1e} of "
                f"{values[0]:.1e}, is taken as zero, though {known}. "
                f"It concerns DOFs {listed(decision.dofs)}: the numbers as they are stored have one state or two more, "
                "very fast ones. Pass tol to say what counts as zero, or mend entries that should cancel."
            )
            give_warning(msg, CloseDecisionWarning)


def _warn_of_light_masses(light: LightMasses) -> None:
    msg = (
        f"DOFs {listed(light.dofs)} have a mass of at most {light.ratio:.1e} of the largest (in scaled units), but not "
        "zero: their two states are far faster than the others and cost digits. If they are meant to be "
        f"massless, set their mass to zero or pass tol={2.0 * light.ratio:.0e}."
    )
    give_warning(msg, NearlyMasslessWarning)
