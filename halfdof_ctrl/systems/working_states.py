"""The states in which responses are computed, whatever states the user has.

Energy coordinates lose a square root of what displacements and velocities lose on stiff structures. But their matrices
are dense, so that terms cancel in deep roll-off, or where stiff and soft springs meet in a node without mass, that DOF
states keep apart. A frequency response is evaluated in both, and refined solves of the descriptor form tell which one
to keep.
Models without energy coordinates (unsymmetric or indefinite M or K, constraints, masses or dampers that need rotated
coordinates) are worked in DOF states, scaled by powers of two.
"""

from typing import NamedTuple

import control
import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY, ComplexArray, FloatArray, IndexArray, is_zero
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.descriptor.data_limit import amplifies
from halfdof_ctrl.model.evaluation import data_limit, random_growth
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.refinement import COARSE_GROWTH, refined
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.weak_directions import Factors, refined_along_weak
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_system
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.hessenberg import bounded_response, state_space_response
from halfdof_ctrl.systems.state_map import StateMap, map_of_form, state_map
from halfdof_ctrl.systems.state_space import energy_state_space, system_of_model
from halfdof_ctrl.systems.state_space_data import StateSpaceData

AGREEMENT = 1e-12  #: relative difference between two evaluations up to which both are right
SOUND_BOUND = (
    5e-10  #: bound of the relative error of an evaluation up to which it is right; it exceeds it some 10 times
)
SOUND_STORED = 1e-9  #: the same over rcond(W), which rounding of A and B is enlarged by; it exceeds that some 30 times
SOUND_RESPONSE = 2e-11  #: relative error at tested points up to which a model stays with the states it has
FEW_STATES = 60  #: up to which two evaluations cost nothing to speak of
SOLVING_EFFORT = 1e9  #: points times cubed DOFs up to which refined solves take the place of both evaluations
PEAK = 100.0  #: times what rounding of entries changes elsewhere, it changes beside an undamped resonance
MOST_TESTED = 8  #: points of a response at which a refined solve tells which evaluation is better


def working_map(reduction: ExactReduction) -> StateMap | None:
    """Return the states in which a time response is computed; None for a large sparse model, which stays as it is.

    Examples
    --------
    >>> working_map(exact_reduction(hydromount())).kind
    'energy'
    >>> working_map(exact_reduction(mechss([[1, 0], [0, 1]], None, [[2, 1], [-1, 2]]))).kind
    'scaled'
    """
    model = reduction.model
    if reduction.order == 0 or (model.is_sparse and _is_large(model)):
        return None
    form = energy_system(model)
    if form is None or len(form.A) != reduction.order:
        return state_map(reduction, "scaled")
    return map_of_form(form, "energy", reduction)


def working_form(model: SecondOrderModel, order: int) -> EnergyForm | None:
    """Return the energy coordinates of a model that has `order` states, None where there are none."""
    form = None if model.is_sparse and _is_large(model) else energy_system(model)
    return form if form is not None and len(form.A) == order else None


def working_matrix(model: SecondOrderModel) -> FloatArray:
    """Return A in energy coordinates where the model has them, else in DOF states."""
    reduction = reduced(model)
    form = working_form(model, reduction.order)
    if form is None:
        reduction.solution.evidence.warn_of_loss()
    return reduction.A if form is None else form.A


def model_poles(model: SecondOrderModel) -> ComplexArray:
    """Return the poles of the state space of a model [rad/s], computed in the states that keep most digits.

    Poles of motions that K and C leave free are exactly 0.

    Raises
    ------
    ComplexModelError, SingularPencilError, UncertainRankError
        What `exact_reduction` refuses.

    Examples
    --------
    Two free masses joined by a spring:

    >>> poles = model_poles(mechss([[2, 0], [0, 2]], None, [[9, -9], [-9, 9]]))
    >>> int(np.count_nonzero(poles == 0.0)), float(np.abs(poles).max().round(12))
    (2, 3.0)
    """
    A = working_matrix(model)
    return np.asarray(scipy.linalg.eigvals(A), dtype=np.complex128) if A.size else np.zeros(0, dtype=np.complex128)


def working_system(model: SecondOrderModel) -> control.StateSpace:
    """Return the state space in energy coordinates where the model has them, else in DOF states.

    Raises
    ------
    ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        The model has no state space (see `mech2ss`).
    """
    reduction = reduced(model)
    sys = system_of_model(reduction)
    form = working_form(model, sys.nstates)
    if form is None:
        reduction.solution.evidence.warn_of_loss()
    return sys if form is None else energy_state_space(form, np.asarray(sys.D))


class ModelResponse(NamedTuple):
    """A response, and whether rounding of the model's entries may be amplified in it."""

    values: ComplexArray
    amplified: bool


def response_of_model(reduction: ExactReduction, dofs: StateSpaceData, points: ComplexArray) -> ModelResponse:
    """Evaluate a model in the states that keep most digits.

    DOF states are kept where a bound of rounding says that they are right, or, with many states, where they are right
    wherever they are tested by refined solves of the descriptor form; energy coordinates cost more than that.

    Parameters
    ----------
    reduction : ExactReduction
        Of a proper model with N states, m inputs and p outputs.
    dofs : StateSpaceData
        Its state space in DOF states.
    points : (k,) complex ndarray

    Returns
    -------
    ModelResponse
    """
    model, evaluated = reduction.model, bounded_response(*dofs, points)
    values = evaluated.values
    stored = reduction.solution.evidence.loss.value
    is_sound = stored <= SOUND_RESPONSE and evaluated.bound <= min(SOUND_BOUND, SOUND_STORED * reduction.rcond)
    if is_sound and reduction.order == 2 * len(model.dofs):
        return ModelResponse(values, amplified=False)
    amplified = not _is_large(model) and amplifies(model.as_dense(), np.abs(points))  # static DOFs hide it from A
    if is_sound and not amplified:
        return ModelResponse(values, amplified=False)
    if not (model.is_sparse or _is_free_at_rest(model, points)) and _is_sound(model, values, points):
        return ModelResponse(values, amplified)
    form = working_form(model, reduction.order)
    if form is not None:
        return ModelResponse(response_of_form(form, values, points), amplified)
    if _is_large(model) or points.size * len(model.dofs) ** 3 > SOLVING_EFFORT:
        reduction.solution.evidence.warn_of_loss()
        return ModelResponse(values, amplified)
    return ModelResponse(_refined_where_wrong(model.as_dense(), values, values, points), amplified)


def response_of_form(form: EnergyForm, others: ComplexArray, points: ComplexArray) -> ComplexArray:
    """Evaluate a model in energy coordinates, and keep what DOF states gave where that is better.

    Which is better tell refined solves of the descriptor form at a few of the points where they differ, or of all where
    they agree, and those values are taken themselves; all of them where neither is right at one of the few, up to a
    size. A large model
    stays in energy coordinates if they are right wherever it is tested.

    Parameters
    ----------
    form : EnergyForm
        Of a proper model with N states, m inputs and p outputs.
    others : (p, m, k) complex ndarray
        The same in DOF states.
    points : (k,) complex ndarray

    Returns
    -------
    (p, m, k) complex ndarray
    """
    output = form.output
    values = state_space_response(form.A, form.B, output.X, output.direct(form.B.shape[1]), points)
    if len(form.A) > FEW_STATES and _is_sound(form.model, values, points):
        return values
    return _refined_where_wrong(form.model, values, others, points)


def _refined_where_wrong(
    model: SecondOrderModel, values: ComplexArray, others: ComplexArray, points: ComplexArray
) -> ComplexArray:
    """Return the better of two evaluations of a dense model, and refined solves where neither is right."""
    with np.errstate(invalid="ignore"):
        doubt = ~(np.abs(values - others) <= AGREEMENT * np.abs(others))  # at an infinite value too: is it a pole?
    doubt &= np.isfinite(values) | (points != 0.0)  # at rest it is that of a free motion
    doubtful = np.flatnonzero(doubt.any(axis=(0, 1)))
    doubtful = doubtful if doubtful.size else np.flatnonzero(points)  # both may have lost the same
    if doubtful.size == 0:
        return values
    tested = doubtful[_spread(doubtful.size)]
    exact = refined_response(model, points[tested])
    nearest = np.abs(np.arange(points.size)[:, None] - tested).argmin(axis=1)
    with np.errstate(invalid="ignore"):
        worse = np.abs(values[:, :, tested] - exact) > np.abs(others[:, :, tested] - exact)
    values = np.where(doubt & worse[:, :, nearest], others, values)
    every = np.union1d(doubtful, np.flatnonzero(points))  # where both agree they may have rounded the same terms
    if not _agree(values[:, :, tested], exact) and every.size * len(model.dofs) ** 3 <= SOLVING_EFFORT:
        tested, exact = every, refined_response(model, points[every])
    with np.errstate(invalid="ignore"):
        wrong = doubt[:, :, tested] | ~(np.abs(values[:, :, tested] - exact) <= SOUND_RESPONSE * np.abs(exact))
    values[:, :, tested] = np.where(wrong & np.isfinite(exact), exact, values[:, :, tested])
    return values


def _is_free_at_rest(model: SecondOrderModel, points: ComplexArray) -> bool:
    """Return whether a value at rest is asked for where K may be singular but for rounding: energy coordinates know."""
    rest = points[points == 0.0][:1]
    return bool(rest.size and random_growth(model.quadratics.P, rest).max() > COARSE_GROWTH)


def _is_sound(model: SecondOrderModel, values: ComplexArray, points: ComplexArray) -> bool:
    """Return whether values are right at some points, the smallest and the largest values among them.

    Beside an undamped resonance, which entries determine much less than the rest, as far as they do.
    """
    size = np.abs(values).reshape(-1, points.size)
    with np.errstate(invalid="ignore"):
        extremes = [int(np.nanargmin(size.min(axis=0))), int(np.argmax(np.nan_to_num(size, posinf=0.0).max(axis=0)))]
    tested = np.unique(np.append(_spread(points.size), extremes))
    exact = refined_response(model, points[tested])
    if _agree(values[:, :, tested], exact):
        return True
    data, size = data_limit(*model.quadratics, points[tested]).data, np.abs(exact)
    shares = np.divide(data, size, out=np.zeros(size.shape), where=size > 0.0)
    usual = np.median(shares, axis=2, keepdims=True)
    return _agree(values[:, :, tested], exact, np.where(shares > PEAK * usual, data, 0.0))


def _agree(values: ComplexArray, exact: ComplexArray, room: FloatArray | float = 0.0) -> bool:
    known = np.isfinite(exact)  # elsewhere P(s) is singular
    with np.errstate(invalid="ignore"):
        allowed = np.maximum(SOUND_RESPONSE * np.abs(exact), room)
        return bool((np.abs(values - exact)[known] <= allowed[known]).all())


def _spread(count: int) -> IndexArray:
    """Return a few places of a list, its ends among them."""
    return np.unique(np.rint(np.linspace(0, count - 1, min(count, MOST_TESTED))).astype(np.intp))


def refined_response(model: SecondOrderModel, points: ComplexArray) -> ComplexArray:
    """Evaluate the descriptor form of a dense model by solves that are refined as far as they go.

    Returns
    -------
    (p, m, k) complex ndarray
        NaN where P(s) is singular.

    Examples
    --------
    >>> refined_response(mechss([[0]], [[0]], [[4]]), np.array([1j])).ravel().tolist()
    [(0.25+0j)]
    """
    m, coefficients = len(model.inputs), model.quadratics
    factors = [Factors.of_dense(np.asarray(_at(coefficients.P, s), dtype=np.complex128)) for s in points.tolist()]
    right = np.hstack([_at(coefficients.B, s) + 0j for s in points.tolist()])
    exact = ExactPolynomial(coefficients.P)

    def solve(columns: ComplexArray) -> ComplexArray:
        parts = zip(factors, np.split(columns, len(factors), axis=1), strict=True)
        return np.hstack([part * np.nan if each is None else each.solve(part) for each, part in parts])

    motion, settled = refined(exact, np.repeat(points, m), solve(right), right, solve)
    for k, each in enumerate(factors):
        left = m * k + np.flatnonzero(~settled[m * k : m * k + m])
        if each is not None and left.size:
            found = refined_along_weak(exact, complex(points[k]), motion[:, left], right[:, left], each)
            motion[:, left] = found.solution if found.is_settled else np.nan
    values = [
        _at(coefficients.F, s) @ motion[:, m * k : m * k + m] + _at(coefficients.D, s)
        for k, s in enumerate(points.tolist())
    ]
    return np.stack(values, axis=2)


def _at(coefficients: Coefficients, s: complex) -> FloatArray | ComplexArray:
    """Evaluate a quadratic matrix polynomial."""
    constant, linear, quadratic = coefficients
    value = np.asarray(constant)
    for power, part in ((s, linear), (s**2, quadratic)):
        value = value if is_zero(part) else value + power * part
    return value


def _is_large(model: SecondOrderModel) -> bool:
    return max(map(len, (model.dofs, model.inputs, model.outputs))) > LARGEST_DENSE_COPY
