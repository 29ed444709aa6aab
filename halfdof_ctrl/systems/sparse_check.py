"""The cross-check of large sparse models: what sparse factorizations can tell, and what is not checked.

Transfer functions are compared as for other models. Poles are tried a few at a time: by inverse iteration from both
sides beside a pole of the state space the descriptor form tells where its own eigenvalue is. The number of finite
eigenvalues and the response in time would take dense matrices.
"""

from collections.abc import Callable

import control
import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.base.sparse_factors import PIVOTINGS
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.refined_response import RefinedResponse
from halfdof_ctrl.model.refinement import SUSPECT_GROWTH
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.sparse_evaluation import PointFactors, SparsePencil, SparseTransfer, require_room
from halfdof_ctrl.systems.judged import Judged, graded, safety
from halfdof_ctrl.systems.pole_check import POLE_TOLERANCE
from halfdof_ctrl.systems.refined_poles import RefinedPoles

MOST_CHECKED = 2500  #: of a state space whose dense matrices are factorized at every point
TRIED_POLES = 12  #: poles that are looked for in the descriptor form, the slowest and some of the others
SLOWEST = 6  #: of these
SEPARATED = 1e-2  #: relative distance of a pole from the next one: inverse iteration finds no closer ones apart
BESIDE = 1e-5  #: relative distance from a pole at which P(s) is factorized
ITERATIONS = 3  #: of inverse iteration from each side
ARRAYS = 8  #: of the size of a response that the comparison holds
NOT_COUNTED = "the number of finite eigenvalues, {n} DOFs being too many for dense matrices"
NOT_FOLLOWED = "the step response, for the same reason"


def require_few_states(model: SecondOrderModel, sys: control.StateSpace) -> None:
    """Refuse a state space that is too large for dense matrices.

    Raises
    ------
    ModelSizeError
        More than 2500 states.
    """
    if sys.nstates > MOST_CHECKED:
        msg = (
            f"crosscheck factorizes dense matrices of up to {MOST_CHECKED} states at every frequency; this system has "
            f"{sys.nstates}, of {len(model.dofs)} DOFs. Nothing is said about it. Check a coarser model of the same "
            "structure, or the small one that truncate_modes makes."
        )
        raise ModelSizeError(msg, size=sys.nstates, limit=MOST_CHECKED)


def sparse_response(model: SecondOrderModel, points: ComplexArray, advance: Callable[[int], None]) -> RefinedResponse:
    """Evaluate a sparse model at every point, refined where P(s) is nearly singular."""
    p, m = model.D.shape
    require_room(p, m, ARRAYS * points.size)
    shape = (p, m, points.size)
    values, data, slope = np.empty(shape, dtype=np.complex128), np.empty(shape), np.empty(shape)
    transfer = SparseTransfer(*model.quadratics)
    for k, s in enumerate(points.tolist()):
        values[:, :, k] = transfer.at(s)
        data[:, :, k] = np.maximum(transfer.limit.data, EPS * SUSPECT_GROWTH * np.abs(values[:, :, k]) / safety(1))
        slope[:, :, k] = transfer.limit.slope
        advance(1)
    values[~np.isfinite(values)] = np.nan
    return RefinedResponse(values, data, slope, np.full(shape, np.nanmax(np.abs(values), initial=0.0)))


def compare_some_poles(model: SecondOrderModel, poles: RefinedPoles) -> Judged:
    """Look for the eigenvalue of the descriptor form beside some poles of the state space."""
    alone = poles.gaps > SEPARATED * np.abs(poles.values)
    away = np.flatnonzero(~poles.at_origin & (poles.values.imag >= 0.0) & alone)
    if not away.size:
        return Judged.nothing("no pole stands alone")
    away = away[np.argsort(np.abs(poles.values[away]))]
    others = np.linspace(0, away.size - 1, min(away.size, TRIED_POLES - SLOWEST)).astype(np.intp)
    tried = np.unique(np.concatenate([np.arange(min(SLOWEST, away.size)), others]))
    chosen = poles.values[away[tried]]
    coefficients = [as_sparse(part) for part in model.quadratics.P]
    pencil, exact = SparsePencil.on_one_pattern(coefficients), ExactPolynomial(coefficients)
    found = [_beside(pencil, exact, coefficients, pole) for pole in chosen.tolist()]
    values, bounds = np.array([value for value, _ in found]), np.array([bound for _, bound in found])
    size = np.abs(values)
    known = max(model.known_to / EPS, 1.0)
    errors = np.abs(chosen - values) / size
    room = safety(len(model.dofs)) * (poles.bounds[away[tried]] + known * bounds) / size
    grade, worst = graded(errors, room, POLE_TOLERANCE)
    where = f"pole {complex_in_words(complex(chosen[worst]))}, one of {chosen.size} tried"
    return Judged(grade, float(errors[worst]), float(room[worst]), where)


def _beside(
    pencil: SparsePencil, exact: ExactPolynomial, coefficients: list[SparseMatrix], pole: complex
) -> tuple[complex, float]:
    """Return the eigenvalue of the descriptor form that is nearest to a pole, and what rounding moves it."""
    s = pole * (1.0 + BESIDE)
    ordering, threshold = PIVOTINGS[0 if pencil.is_nearly_symmetric else -1]
    n = coefficients[0].shape[0]
    v: ComplexArray = np.random.default_rng(0).standard_normal((n, 1)).astype(np.complex128)
    w = v.copy()
    slope = coefficients[1] + 2.0 * s * coefficients[2]
    try:
        factors = PointFactors.of(pencil, s, ordering, threshold)
    except RuntimeError:  # an eigenvalue of the descriptor form itself
        return s, 0.0
    with np.errstate(all="ignore"):
        for _ in range(ITERATIONS):
            v = factors.solve(slope @ (v / np.linalg.norm(v)))[0]
            w = factors.solve_transposed(slope.T @ (w / np.linalg.norm(w)))
        v, w = v / np.linalg.norm(v), w / np.linalg.norm(w)
        near = s
        for _ in range(2):
            tangent = complex((w.T @ ((coefficients[1] + 2.0 * near * coefficients[2]) @ v))[0, 0])
            near = near + complex((w.T @ exact.residual(near, v))[0, 0]) / tangent
        terms = [abs(near) ** k * (abs(part) @ np.abs(v)) for k, part in enumerate(coefficients)]
        sizes: FloatArray = terms[0] + terms[1] + terms[2]
        bound = EPS * float((np.abs(w).T @ sizes)[0, 0]) / abs(tangent)
    return near, bound
