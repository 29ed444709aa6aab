"""The oracle: what the descriptor form itself says, by routes that the reduction does not take.

The eigenvalues come from the first-order pencil (8) in q and as many velocities as M has rank (`quadratics`), deflated
to its finite part (`pencils`). Zeros are the finite eigenvalues of the system pencil

    [ P(s)  -B(s) ]
    [ F(s)   D(s) ]                                                                        (9)
"""

from dataclasses import dataclass, field
from functools import cached_property

from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.base.spectrum import sorted_eigenvalues
from halfdof_ctrl.descriptor.finite_part import CLEAR_MARGIN, finite_part, infinite_part
from halfdof_ctrl.descriptor.first_order import first_order_pencil
from halfdof_ctrl.descriptor.growth import improper_pairs
from halfdof_ctrl.model.dense_copy import dense_copy
from halfdof_ctrl.model.second_order import SecondOrderModel


@dataclass(frozen=True, eq=False, kw_only=True)
class PencilStructure:
    """Eigenvalues of ``P(s)`` for n DOFs, found without the reduction."""

    finite_eigenvalues: ComplexArray  #: by QZ [rad/s], sorted by size; those at the origin are exactly zero
    n_infinite: int  #: infinite eigenvalues of the companion form of dimension 2n
    infinite_blocks: tuple[int, ...]  #: sizes of the Jordan blocks at infinity of the pencil (8), the largest first
    is_regular: bool  #: whether det P(s) is not identically zero
    gap: float  #: smallest ratio of a pivot that counts to one that does not, in all rank decisions
    is_certain: bool  #: False if a rank decision was so close to rounding that a count may be wrong
    model: SecondOrderModel = field(repr=False)  #: whose structure this is

    @property
    def index(self) -> int:
        """Index of the pencil (8), the size of its largest block at infinity: 0 or 1 for passive structures."""
        return max(self.infinite_blocks, default=0)

    @property
    def is_proper(self) -> bool:
        """Whether no transfer function grows with frequency. A singular pencil has none, and is not proper."""
        return self.is_regular and not self.improper_pairs

    @cached_property  # which is why this class has no slots
    def improper_pairs(self) -> tuple[tuple[str, str, int], ...]:
        """The (input, output, order of growth) of transfer functions that grow with frequency, found when asked for."""
        if not self.is_regular:
            return ()
        return improper_pairs(self.model, self.finite_eigenvalues, self.index)


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

    Notes
    -----
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
    model = dense_copy(model, "pencil_structure", "The poles of mech2ss(model) are the finite eigenvalues.")
    pencil = first_order_pencil((model.K, model.C, model.M))
    finite, infinite = finite_part(pencil.A, pencil.E), infinite_part(pencil.A, pencil.E)
    eigenvalues = sorted_eigenvalues(finite.eigenvalues * pencil.scale)
    adds_up = eigenvalues.size + sum(infinite.blocks) == len(pencil.E)
    is_clear = infinite.evidence.margin > CLEAR_MARGIN
    return PencilStructure(
        finite_eigenvalues=eigenvalues,
        n_infinite=2 * len(model.dofs) - eigenvalues.size,
        infinite_blocks=infinite.blocks,
        is_regular=finite.is_regular,
        gap=infinite.evidence.gap,
        is_certain=finite.is_certain and (not finite.is_regular or (adds_up and is_clear)),
        model=model,
    )
