"""The choice of the method: propose, prove, choose.

Each method in turn proposes state equations and proves them; the first that is proved is taken. What it rests on goes
with it, and what of that a user must know is warned of once, here.
"""

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import ModelSizeError, ParameterError
from halfdof_ctrl.model.dense_copy import complex_model_error
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.deflation.method import by_deflation
from halfdof_ctrl.reduction.dense.method import by_bases, by_selection
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.evidence import Evidence
from halfdof_ctrl.reduction.method.exact_order import warn_of_hidden_states
from halfdof_ctrl.reduction.method.file_digits import warn_of_file_digits
from halfdof_ctrl.reduction.method.protocol import METHODS, MethodName, ReductionMethod
from halfdof_ctrl.reduction.sparse.method import by_sparse_bases, by_sparse_selection


def exact_reduction(
    model: SecondOrderModel, *, tol: float | None = None, method: MethodName | None = None
) -> ExactReduction:
    """Reduce a model with singular mass to its exact states.

    Parameters
    ----------
    model : SecondOrderModel
        A real model with n DOFs.
    tol : float, optional
        Size of a mass, relative to the largest in scaled units, up to which it counts as none
        (see `dense.selection.select_columns` and `dense.bases.orthonormal_bases`), and of singular values in
        deflation. By default only exact zeros and rounding count as none.
    method : {"selection", "orthogonal", "deflation"}, optional
        Method to take; by default selection of DOFs, orthonormal bases where that leaves W singular, and
        deflation where they do too (index above one). The default also takes orthonormal bases where DOFs as
        states would lose digits that those keep.

    Returns
    -------
    ExactReduction
        A, B, the way back to all DOFs, and the evidence.

    Raises
    ------
    ComplexModelError
        The model has structural damping or other imaginary parts.
    ParameterError
        `tol` or `method` is none of what they can be.
    SingularPencilError
        No motion follows from the equations: ``det P(s)`` vanishes at every s, as with a redundant constraint or
        a motion that nothing resists.
    UncertainRankError
        Entries nearly cancel, so that the number of states cannot be told to working precision.
    SingularLeadingMatrixError
        `method` asks for a method by which W of equation (2) is singular to working precision (rcond below
        max(n, 256) eps after scaling).

    Warns
    -----
    NearlyMasslessWarning
        A mass is not zero but below 1e-10 of the others in scaled units.
    CloseDecisionWarning
        A decision about a rank rests on singular values less than 1e3 apart, or W is hardly regular, or `tol`
        is so large that deflation gives the state space of another model.
    LostDigitsWarning
        A and B lose more than 1e-9 of the largest entry of the transfer function, because W, or J after
        deflation, is ill conditioned.
    DataLimitWarning
        Eigenvalues of K are no more than the digits of the model's file leave unknown (rigid-body motions); of M they
        are a CloseDecisionWarning.

    Notes
    -----
    Source: Simionatto, Miyasato, Melo and Dias Junior, "Singular mass matrices and half degrees of
    freedom", section 2; the single solve (3) and the orthonormal bases are this package's.

    Examples
    --------
    A damper of 5 N s/m against a spring of 10 N/m, no mass: one state with eigenvalue -2:

    >>> exact_reduction(mechss([[0]], [[5]], [[10]])).A
    array([[-2.]])
    """
    reduction, evidence = _reduced(model, tol, method)
    evidence.warn_of_loss()
    return reduction


def reduced(model: SecondOrderModel, *, tol: float | None = None, method: MethodName | None = None) -> ExactReduction:
    """Reduce a model as `exact_reduction` does, without a word about digits that only A and B as stored lose.

    For those who go on in other states: whoever uses A and B says so by `Evidence.warn_of_loss`.
    """
    return _reduced(model, tol, method)[0]


def _reduced(model: SecondOrderModel, tol: float | None, method: MethodName | None) -> tuple[ExactReduction, Evidence]:
    """Reduce a model and return what the reduction rests on beside it, with all said but what A and B lose."""
    if checked_model(model, "exact_reduction").is_complex:
        raise complex_model_error(model)
    _require_valid(tol, method)
    solution = _sparsely_solved(model, tol, method) if model.is_sparse else None
    if solution is None:
        solution = _solved(model.as_dense() if model.is_sparse else model, tol, method)
    evidence = solution.evidence
    evidence.warn(tol)
    if tol is None and solution.name != "selection" and not evidence.is_doubtful:
        warn_of_hidden_states(model, len(solution.A))
    warn_of_file_digits(model, evidence.rcond, tol)
    return ExactReduction(model=solution.model, solution=solution, tol=tol), evidence


def _solved(model: SecondOrderModel, tol: float | None, method: MethodName | None) -> ReductionMethod:
    """Return the first proposal that is proved, or the one that was asked for."""
    asked = method is not None
    if method in {None, "selection"}:
        found = by_selection(model, tol, asked=asked)
        if found is not None:
            return found
    if method in {None, "orthogonal"}:
        found = by_bases(model, tol, asked=asked)
        if found is not None:
            return found
    return by_deflation(model, tol)


def _sparsely_solved(model: SecondOrderModel, tol: float | None, method: MethodName | None) -> ReductionMethod | None:
    """Do so with sparse matrices; None for what its dense copy serves."""
    if method == "deflation":
        return None
    too_large = max(len(model.dofs), len(model.inputs), len(model.outputs)) > LARGEST_DENSE_COPY
    asked = method is not None
    try:
        found = None if method == "orthogonal" else by_sparse_selection(model, tol, asked=asked)
        return found or by_sparse_bases(model, tol, asked=asked or too_large)
    except ModelSizeError:
        if asked or too_large:
            raise
        return None


def _require_valid(tol: float | None, method: MethodName | None) -> None:
    if method is not None and not is_choice(method, METHODS):
        msg = f"method must be 'selection', 'orthogonal', 'deflation' or None, not {shown(method)}."
        raise ParameterError(msg, parameter="method", value=method)
    if tol is not None and not (isinstance(tol, int | float) and 0.0 <= tol < 1.0):
        msg = f"tol = {shown(tol)}, but it is a relative size: a number from 0 to below 1, such as 1e-12."
        raise ParameterError(msg, parameter="tol", value=tol)
