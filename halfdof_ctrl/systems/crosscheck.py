"""Compare a state space with the descriptor form of its model, by routes that share no code.

| quantity | descriptor form | state space |
|---|---|---|
| count | exact count of finite eigenvalues | order |
| poles | QZ, refined, matched one to one | eigenvalues of A, refined |
| transfer function | refined solves of equation (1) | refined solves with A, B, C, D |
| step response | Radau IIA on the descriptor equations | Radau IIA on the state equations |

Three things are kept apart: the error of the state space, what rounding of its doubles and of the entries of
M, C, K allows, and what python-control's own evaluation loses, which is no reason to fail.
"""

from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY
from halfdof_ctrl.base.errors import MatrixError, ParameterError
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.descriptor.first_order import typical_frequency
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.descriptor.structure import PencilStructure, pencil_structure
from halfdof_ctrl.model.dense_copy import complex_model_error
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.check_points import check_points, moving_eigenvalues
from halfdof_ctrl.systems.check_result import CrossCheck
from halfdof_ctrl.systems.doors import checked_system
from halfdof_ctrl.systems.judged import Grade, Judged
from halfdof_ctrl.systems.pole_check import compare_poles
from halfdof_ctrl.systems.refined_poles import refined_poles
from halfdof_ctrl.systems.second_opinion import second_opinion
from halfdof_ctrl.systems.sparse_check import (
    NOT_COUNTED,
    NOT_FOLLOWED,
    compare_some_poles,
    require_few_states,
    sparse_response,
)
from halfdof_ctrl.systems.step_check import StepCheck, compare_steps
from halfdof_ctrl.systems.transfer_check import TransferCheck, compare_transfer, system_response, transfer_of_both

POINT_WORK = 5e9  #: points times the cubes of DOFs and states, which takes about as long as the eigenvalues do
POINT_VALUES = 2**22  #: values of all channels at all points
FEWEST_POINTS = 24  #: for the largest models


def crosscheck(model: SecondOrderModel, sys: control.StateSpace) -> CrossCheck:
    """Check a state space against the descriptor form of the model that it claims to be.

    Parameters
    ----------
    model : SecondOrderModel
        A real, regular model.
    sys : control.StateSpace
        With as many inputs and outputs, in the model's order.

    Returns
    -------
    CrossCheck
        Errors and where they are worst; `verdict` is ``"ok"``, ``"ok within what the numbers allow"`` or ``"failed"``,
        and `passed` is true for the first two.

    Raises
    ------
    ComplexModelError, SingularPencilError
        The model has no real state space.
    ParameterError
        The system is discrete in time.
    MatrixError
        Another number of inputs or outputs.
    ModelSizeError
        A sparse model with more than 2000 DOFs, of which the state space has more than 2500 states.

    Warns
    -----
    CloseDecisionWarning
        The number of states rests on a value near rounding.

    Notes
    -----
    An error is ok up to 1e-10 of the value of the channel at that point (beside a zero, of the value at a frequency
    0.1 % away), 1e-10 of each eigenvalue, and 1e-9 of a channel's largest value in a step response. Beyond that it is
    ok within what the numbers allow up to 16 sqrt(n) times what rounding of them changes in first order, n the DOFs:
    eps in each of A, B, C, D, and in M, C, K what `SecondOrderModel.known_to` says. For a transfer function that is
    ``eps |y| |A| |x|`` and so on, with x and y the solutions for input and output, and for a pole the same with
    eigenvectors. So a double pole, a sharp resonance or a DOF that constraints hold raises no false alarm. A channel
    that is zero for every input is measured by the sizes of its output and its input.

    Of sparse models with more than 2000 DOFs the transfer function and some of the poles are checked, by sparse
    factorizations, and the count and the time response are not: `limits` says so.

    Examples
    --------
    >>> model = hydromount()
    >>> crosscheck(model, mech2ss(model)).verdict
    'ok'
    """
    model, sys = checked_model(model, "crosscheck"), checked_system(sys, "crosscheck")
    if model.is_complex:
        raise complex_model_error(model)
    if (sys.noutputs, sys.ninputs) != model.D.shape:
        msg = (
            f"The system has {sys.noutputs} outputs and {sys.ninputs} inputs, the model {len(model.outputs)} and "
            f"{len(model.inputs)}. Compare it with the model it was made of."
        )
        raise MatrixError(msg, matrix="D")
    if sys.isdtime(strict=True):
        msg = f"The system is discrete in time (dt = {sys.dt}), the model is not. Check it before it is sampled."
        raise ParameterError(msg, parameter="dt", value=sys.dt)
    with limited_threads(1):  # small matrices by the hundred: more threads wait for each other
        require_regular(model)
        if model.is_sparse and max(len(model.dofs), *model.D.shape) > LARGEST_DENSE_COPY:
            return _compared_sparsely(model, sys)
        return _compared(model.as_dense() if model.is_sparse else model, sys)


def _compared(model: SecondOrderModel, sys: control.StateSpace) -> CrossCheck:
    """Compare all that can be."""
    most = _most_points(model, sys)
    with progress_bar(None, "steps of the cross-check") as advance:
        structure = pencil_structure(model)
        advance(1)
        told = slice(None if sys.nstates >= structure.finite_eigenvalues.size else structure.fewest_finite)
        finite, bounds = structure.finite_eigenvalues[told], structure.bounds[told]
        poles, gamma = refined_poles(np.asarray(sys.A, dtype=float)), typical_frequency(model)
        moving = moving_eigenvalues(finite, bounds, poles, gamma)
        points = check_points(moving, most)
        transfer = compare_transfer(model, sys, points, *transfer_of_both(model, sys, points, advance))
        of_poles = compare_poles(model, poles, finite, bounds, gamma, most=structure.most_finite)
        advance(1)
        steps = compare_steps(model, sys, moving, transfer.zero_scale, transfer.least)
        advance(1)
        return CrossCheck(
            order=sys.nstates,
            n_finite=structure.finite_eigenvalues.size,
            most_finite=structure.most_finite,
            n_infinite=structure.n_infinite,
            count_grade=_count_grade(sys.nstates, structure),
            index=structure.index,
            slycot=second_opinion(model),
            **_figures(model, transfer, of_poles, steps),
        )


def _compared_sparsely(model: SecondOrderModel, sys: control.StateSpace) -> CrossCheck:
    """Compare what sparse factorizations can tell of a large model."""
    require_few_states(model, sys)
    with progress_bar(None, "steps of the cross-check") as advance:
        poles = refined_poles(np.asarray(sys.A, dtype=float))
        away = poles.values[~poles.at_origin]
        points = check_points(away if away.size else np.array([-1.0 + 0.0j]), FEWEST_POINTS)
        exact, found = sparse_response(model, points, advance), system_response(sys, points, advance)
        transfer = compare_transfer(model, sys, points, exact, found)
        of_poles = compare_some_poles(model, poles)
    not_followed = StepCheck(judged=Judged.nothing("not followed"), horizon=0.0, evaluation=0.0, evaluation_worst="")
    return CrossCheck(
        order=sys.nstates,
        n_finite=-1,
        n_infinite=-1,
        count_grade=int(Grade.OK),
        index=-1,
        slycot="not asked",
        limits=(NOT_COUNTED.format(n=len(model.dofs)), NOT_FOLLOWED),
        **_figures(model, transfer, of_poles, not_followed),
    )


def _figures(model: SecondOrderModel, transfer: TransferCheck, poles: Judged, steps: StepCheck) -> dict[str, Any]:
    """Return what a cross-check says of everything but the count."""
    return {
        "max_transfer_error": transfer.judged.error,
        "transfer_allowed": transfer.judged.allowed,
        "transfer_worst": transfer.judged.where,
        "transfer_grade": int(transfer.judged.grade),
        "max_pointwise_error": transfer.pointwise,
        "max_pole_error": poles.error,
        "pole_allowed": poles.allowed,
        "pole_worst": poles.where,
        "pole_grade": int(poles.grade),
        "max_step_error": steps.judged.error,
        "step_allowed": steps.judged.allowed,
        "step_worst": steps.judged.where,
        "step_grade": int(steps.judged.grade),
        "step_horizon": steps.horizon,
        "known_to": model.known_to,
        "data_limit": transfer.data,
        "data_worst": transfer.data_worst,
        "double_limit": transfer.doubles,
        "evaluation_error": transfer.evaluation,
        "evaluation_worst": transfer.evaluation_worst,
        "step_evaluation_error": steps.evaluation,
        "step_evaluation_worst": steps.evaluation_worst,
    }


def _count_grade(order: int, structure: PencilStructure) -> int:
    """Grade the number of states: the stored numbers may have more than what is told from rounding.

    Parts above rounding are no fault of theirs, so that what they would add is said, whichever side left it out.
    """
    if order == structure.finite_eigenvalues.size and (order == structure.most_finite or not structure.is_close):
        return int(Grade.OK)
    return int(Grade.WITHIN if structure.fewest_finite <= order <= structure.most_finite else Grade.FAILED)


def _most_points(model: SecondOrderModel, sys: control.StateSpace) -> int:
    """Return how many points the size of a model allows, so that they take no longer than its eigenvalues."""
    n, N, signals = len(model.dofs), sys.nstates, sum(model.D.shape)
    cubes = n**3 + N**3 + 4 * signals * (n**2 + N**2)
    by_work, by_values = POINT_WORK / max(cubes, 1), POINT_VALUES / max(model.D.size, 1)
    return int(max(FEWEST_POINTS, min(by_work, by_values)))
