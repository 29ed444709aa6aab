"""The oracle: what the descriptor form itself says, by routes that the reduction does not take.

Counts are exact (`exact_counts`), eigenvalues carry bounds (`finite_spectrum`), and what rounding left open is said
(`found_structure`).
"""

from dataclasses import dataclass, field
from functools import cached_property

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, read_only
from halfdof_ctrl.base.errors import CloseDecisionWarning, give_warning
from halfdof_ctrl.base.progress import shows_activity
from halfdof_ctrl.base.spectrum import order_by_size
from halfdof_ctrl.descriptor.finite_part import infinite_part
from halfdof_ctrl.descriptor.first_order import first_order_pencil
from halfdof_ctrl.descriptor.found_structure import found_structure
from halfdof_ctrl.descriptor.growth import improper_pairs
from halfdof_ctrl.model.dense_copy import dense_copy, with_few_signals
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel


@dataclass(frozen=True, eq=False, kw_only=True)
class PencilStructure:
    """Eigenvalues of ``P(s)`` for n DOFs, found without the reduction."""

    finite_eigenvalues: ComplexArray  #: [rad/s], sorted by size; those at the origin are exactly zero
    bounds: FloatArray  #: (k,) how far rounding of M, C, K may have moved each of them [rad/s]
    most_index: int  #: the index, or a larger one that the ranks up to rounding have
    most_finite: int  #: finite eigenvalues of the stored numbers, exactly: k, or more where rounding makes some
    fewest_finite: int  #: k, without those that rest on parts of M, C, K which stand little above rounding
    n_infinite: int  #: infinite eigenvalues of the companion form of dimension 2n
    infinite_blocks: tuple[int, ...]  #: sizes of the Jordan blocks at infinity of the pencil (8), the largest first
    is_regular: bool  #: whether det P(s) is not identically zero, exactly
    is_close: bool  #: whether the count rests on a part of M, C, K that stands above rounding, which was warned of
    is_open: bool  #: whether rounding left no way to tell finite eigenvalues from infinite ones
    uncertainty: tuple[str, ...]  #: what is uncertain, a sentence each
    model: SecondOrderModel = field(repr=False)  #: whose structure this is

    @property
    def is_certain(self) -> bool:
        """Whether nothing is uncertain: the stored numbers say all of this exactly, and rounding left no part of it."""
        return not self.uncertainty

    @property
    def index(self) -> int:
        """Index of the pencil (8), the size of its largest block at infinity: 0 or 1 for passive structures."""
        return max(self.infinite_blocks, default=0)

    @property
    def is_proper(self) -> bool:
        """Whether no transfer function grows with frequency. A singular pencil has none, and is not proper."""
        return self.is_regular and not self.improper_pairs

    @cached_property  # which is why this class has no slots
    def gap(self) -> float:
        """Smallest ratio of a pivot that counts to one that does not where ranks are decided by their size.

        The counts do not rest on it, which are exact.
        """
        pencil = first_order_pencil(self.model.quadratics.P)
        return infinite_part(pencil.A, pencil.E).evidence.gap

    @cached_property
    def improper_pairs(self) -> tuple[tuple[str, str, int], ...]:
        """The (input, output, order of growth) of transfer functions that grow with frequency, found when asked for.

        Raises `UncertainRankError` where rounding left a part of its own size that may grow.
        """
        if not self.is_regular:
            return ()
        known = None if self.is_open else self.finite_eigenvalues
        return improper_pairs(self.model, known, self.most_index, self.most_finite)


@shows_activity("eigenvalues of the pencil")
def pencil_structure(model: SecondOrderModel) -> PencilStructure:
    """Find the finite eigenvalues of the descriptor form and the structure of the infinite ones.

    Parameters
    ----------
    model : SecondOrderModel
        Real or complex, with any M, C, K.

    Returns
    -------
    PencilStructure
        With a singular pencil (`is_regular` False) the finite eigenvalues are those of its regular part, and
        the other figures mean nothing.

    Warns
    -----
    CloseDecisionWarning
        Eigenvalues far above all others rest on a part of M, C, K that stands little above rounding, or were left out
        for a part of that size although the entries have too few digits to have been rounded.

    Notes
    -----
    Counts are those of the stored numbers, exactly (`exact_counts`); eigenvalues are those of QZ made sharper, each
    with the bound (33) of what rounding of the entries may have moved it, and the list is proved (`finite_spectrum`).
    Where numbers were rounded before they were stored, by a change of coordinates or to decimals, they may have
    eigenvalues that nobody meant. Those that are told from rounding are given, `most_finite` is what the stored numbers
    have, and `uncertainty` says what is in doubt.

    The pencil (8) of dimension n + rank M has ``n + rank M - k`` eigenvalues at infinity beside the k finite ones, in
    Jordan blocks whose sizes are `infinite_blocks`: a block of size 1 is an algebraic equation that holds at once (a
    static DOF), one of size 2 takes a derivative (a velocity constraint with its multiplier), one of size 3 two (a
    position constraint). In the companion form of dimension 2n each of the ``n - rank M`` directions without mass has a
    block larger by one, of size 1 for a half DOF, which makes `n_infinite` in all. A block of size k stands for a
    degree 1 - k of P(s) in its Smith-McMillan form at infinity: some entry of its inverse grows as s^(k - 1).

    Examples
    --------
    A damper of 5 N s/m against a spring of 10 N/m, no mass:

    >>> structure = pencil_structure(mechss([[0]], [[5]], [[10]]))
    >>> structure.finite_eigenvalues.real.round(12).tolist(), structure.n_infinite
    ([-2.0], 1)

    Two masses tied by a rigid link, whose force is the multiplier q2; a prescribed change of its length takes
    forces that grow as s^2:

    >>> tied = mechss([[1, 0, 0], [0, 1, 0], [0, 0, 0]], None, [[2, 0, 1], [0, 3, -1], [1, -1, 0]])
    >>> structure = pencil_structure(tied)
    >>> structure.infinite_blocks, structure.index, structure.is_proper
    ((3,), 3, False)
    >>> structure.improper_pairs
    (('F_q2', 'q2', 2),)
    """
    n = len(checked_model(model, "pencil_structure").dofs)
    few = with_few_signals(model)
    small = dense_copy(few, "pencil_structure", "The poles of mech2ss(model) are the finite eigenvalues.")
    found = found_structure(small.quadratics.P)
    order = order_by_size(found.values)
    if found.above:
        msg = f"The number of finite eigenvalues, {found.values.size}, is a close decision: {found.above}."
        give_warning(msg, CloseDecisionWarning)
    return PencilStructure(
        finite_eigenvalues=read_only(found.values[order]),
        bounds=read_only(found.bounds[order]),
        most_index=found.most_index,
        most_finite=found.most,
        fewest_finite=found.values.size - max(found.close, found.unsure),
        n_infinite=2 * n - found.values.size,
        infinite_blocks=(*found.blocks, *(1,) * (n - len(small.dofs))),  # of static DOFs that were condensed
        is_regular=found.is_regular,
        is_close=bool(found.above),
        is_open=found.is_open,
        uncertainty=found.doubts,
        model=small if few is model else model,
    )
