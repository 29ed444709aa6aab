"""The oracle: what the descriptor form itself says, by routes that the reduction does not take.

Counts are exact (`exact_counts`), eigenvalues carry bounds (`finite_spectrum`), and what rounding left open is said
(`found_structure`). Zeros are the finite eigenvalues of the system pencil

    [ P(s)  -B(s) ]
    [ F(s)   D(s) ]                                                                        (9)
"""

import warnings
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, Matrix, read_only
from halfdof_ctrl.base.errors import CloseDecisionWarning, callers_level
from halfdof_ctrl.descriptor.balancing import equilibrating_powers
from halfdof_ctrl.descriptor.exact_counts import normal_rank
from halfdof_ctrl.descriptor.finite_part import infinite_part
from halfdof_ctrl.descriptor.first_order import first_order_pencil, time_scale
from halfdof_ctrl.descriptor.found_structure import found_structure, order_by_size
from halfdof_ctrl.descriptor.growth import improper_pairs, system_pencil
from halfdof_ctrl.descriptor.minors import invariant_zeros
from halfdof_ctrl.descriptor.nearness import GENERIC_POINTS, UNDECIDED, share_of_rounding, undecided_regularity
from halfdof_ctrl.descriptor.regularity import require_regular_sparse
from halfdof_ctrl.descriptor.staircase import RANK_TOLERANCE
from halfdof_ctrl.model.dense_copy import dense_copy
from halfdof_ctrl.model.refusals import singular_pencil_error
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import causes, null_spaces


@dataclass(frozen=True, eq=False, kw_only=True)
class PencilStructure:
    """Eigenvalues of ``P(s)`` for n DOFs, found without the reduction."""

    finite_eigenvalues: ComplexArray  #: [rad/s], sorted by size; those at the origin are exactly zero
    bounds: FloatArray  #: (k,) how far rounding of M, C, K may have moved each of them [rad/s]
    most_index: int  #: the index, or a larger one that the ranks up to rounding have
    most_finite: int  #: finite eigenvalues of the stored numbers, exactly: k, or more where rounding makes some
    n_infinite: int  #: infinite eigenvalues of the companion form of dimension 2n
    infinite_blocks: tuple[int, ...]  #: sizes of the Jordan blocks at infinity of the pencil (8), the largest first
    is_regular: bool  #: whether det P(s) is not identically zero, exactly
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
        pencil = first_order_pencil((self.model.K, self.model.C, self.model.M))
        return infinite_part(pencil.A, pencil.E).evidence.gap

    @cached_property
    def improper_pairs(self) -> tuple[tuple[str, str, int], ...]:
        """The (input, output, order of growth) of transfer functions that grow with frequency, found when asked for.

        Raises `UncertainRankError` where rounding left a part of its own size that may grow.
        """
        if not self.is_regular:
            return ()
        return improper_pairs(self.model, self.finite_eigenvalues, self.most_index, self.most_finite)


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
    model = dense_copy(model, "pencil_structure", "The poles of mech2ss(model) are the finite eigenvalues.")
    found = found_structure((model.K, model.C, model.M))
    order = order_by_size(found.values)
    return PencilStructure(
        finite_eigenvalues=read_only(found.values[order]),
        bounds=read_only(found.bounds[order]),
        most_index=found.most_index,
        most_finite=found.most,
        n_infinite=2 * len(model.dofs) - found.values.size,
        infinite_blocks=found.blocks,
        is_regular=found.is_regular,
        uncertainty=found.doubts,
        model=model,
    )


def zeros(model: SecondOrderModel) -> ComplexArray:
    """Find the invariant zeros from the second-order system pencil.

    The pencil keeps the mechanical form, so that no zeros are lost or invented where a state space
    would have long chains at infinity.

    Parameters
    ----------
    model : SecondOrderModel
        Of any index, with any number of inputs and outputs, dependent or not.

    Returns
    -------
    (k,) complex ndarray
        Where the system pencil has a lower rank than almost everywhere [rad/s], as often as the greatest common
        divisor of its largest minors has that root, sorted by size; zeros at the origin are exactly zero. Among them
        are poles of motions that the inputs do not reach or the outputs do not show; the others are the transmission
        zeros.

    Warns
    -----
    CloseDecisionWarning
        Inputs or outputs are so nearly dependent that the number of zeros may be wrong.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.

    Notes
    -----
    Their number is exact for the stored numbers, and their values are refined as those of `pencil_structure` are. For
    other numbers of outputs than inputs, and for dependent ones, zeros are what two random combinations of the largest
    minors have in common (`minors`). Two outputs together vanish less often than one alone, and a model that does not
    respond at all has the zeros of the rank that is left.

    Examples
    --------
    A mass on a damper and a spring, velocity as output: one zero, at the origin.

    >>> zeros(mechss([[1]], [[2]], [[3]], [[1]], G=[[1]]))
    array([0.+0.j])

    Two oscillators; the force on the first cannot be seen in the first where the second stands still as an absorber,
    at 2 rad/s:

    >>> zeros(mechss(np.eye(2), None, [[5, -4], [-4, 4]], [1, 0], [1, 0])).imag.round(9).tolist()
    [2.0, -2.0]
    """
    model = dense_copy(model, "zeros", "Take those of a reduced model: zeros(truncate_modes(...)).")
    require_regular(model)
    every = _independent(model)
    found = invariant_zeros(system_pencil(model, *every))
    if found.doubts:
        msg = (
            f"The number of zeros, {found.values.size}, is in doubt: {'; '.join(found.doubts)}. Inputs or outputs "
            "depend on each other but for rounding, or the model is rounded; leave one out by select() and compare."
        )
        warnings.warn(msg, CloseDecisionWarning, stacklevel=callers_level())
    return _sorted(found.values)


def _independent(model: SecondOrderModel) -> tuple[list[int], list[int]]:
    """Pick outputs and inputs of which no one is a constant combination of others, as those change no zero."""
    inputs = np.vstack([model.B, model.Bv, model.Ba, model.D, model.Dv, model.Da])
    outputs = np.hstack([model.F, model.G, model.H, model.D, model.Dv, model.Da])
    return _independent_columns(outputs.T), _independent_columns(inputs)


def _independent_columns(matrix: Matrix) -> list[int]:
    """Pick columns that span the range."""
    rows, columns = equilibrating_powers(np.abs(matrix))
    _, triangle, order = scipy.linalg.qr(matrix * rows[:, None] * columns, mode="economic", pivoting=True)
    pivots = np.abs(np.diagonal(triangle))
    rank = int(np.count_nonzero(pivots > RANK_TOLERANCE * max(matrix.shape) * pivots[0]))
    return sorted(order[:rank].tolist())


def require_regular(model: SecondOrderModel) -> None:
    """Refuse a singular pencil, naming the DOFs that nothing holds and the equations that say too little.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` of the stored numbers vanishes at every s, exactly.
    UncertainRankError
        It does not, but changes of the size of rounding could make it vanish.
    """
    if model.is_sparse:
        require_regular_sparse(model)
        return
    coefficients = (model.K, model.C, model.M)
    share = share_of_rounding(coefficients)
    if share <= UNDECIDED:
        return
    n, rank = len(model.dofs), normal_rank(coefficients)
    s = typical_frequency(model) * GENERIC_POINTS[0]
    null = null_spaces(model.K + s * model.C + s**2 * model.M)
    dofs = [model.dofs[index] for index in sorted(frozenset().union(*null.unknowns))]
    if rank == n:
        raise undecided_regularity(share, dofs)
    raise singular_pencil_error(
        dofs=dofs,
        equations=[model.dofs[index] for index in sorted(frozenset().union(*null.equations))],
        fact=f"its rank is {rank} of {n}",
        causes=causes(null, coefficients, model.dofs),
    )


def typical_frequency(model: SecondOrderModel) -> float:
    """Give a frequency [rad/s], a power of two, at which the model's rows balance in the mean."""
    return time_scale((model.K, model.C, model.M))


def _sorted(values: ComplexArray) -> ComplexArray:
    """Sort by size, conjugate pairs with the positive imaginary part first."""
    return values[order_by_size(values)]
