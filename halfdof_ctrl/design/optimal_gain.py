"""The optimal gain of a reduced model, accepted only if it stabilizes and is known well enough.

Refused before anything is solved is a mode that the inputs do not reach or the cost does not see; after it a gain that
solves (30) to less than six digits, one of which rounding leaves no digit, and one whose closed loop has a pole that is
not told from one on the axis. Each refusal names the mode, and the force or quantity that would help.
"""

from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, FloatArray
from halfdof_ctrl.base.errors import InaccurateGainWarning, StabilizationError, give_warning
from halfdof_ctrl.base.names import force_names, motion_names
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.design.cost import Cost, PhysicalWeights
from halfdof_ctrl.design.plant import Plant, plant_in_energy_states, plant_of
from halfdof_ctrl.design.reach import axis_eigenvalues, hidden_mode
from halfdof_ctrl.design.riccati import FEW, MORE, solved_care
from halfdof_ctrl.design.starts import Solver
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.pole_bounds import bounded_poles

UNSEEN = 1e-8  #: imaginary parts, or displacements beside velocities, below this part are not shown
OPTIMAL_GAIN_MARGIN = (
    4.0  #: times its bound, or N roundings of it: a closed-loop pole nearer to the axis is not told from one on it
)
OPTIMAL_GAIN_GOOD = 1e-9  #: estimated error with which no other states are tried
WORTH = 0.01  #: of the estimated error: other states that leave more are not worth their way back to DOFs
OPTIMAL_GAIN_WARNED = 1e-8  #: estimated error of a gain that is said
REFUSED = 1e-6  #: error of a gain as the solution of the equation as it is stored, that is too much
OPTIMAL_GAIN_UNKNOWN = (
    0.1  #: change of a gain by rounding of the entries: of one that solves them, but has no digit that is known
)
OPTIMAL_GAIN_ONE_THREAD = 600  #: states up to which several threads wait for each other longer than they work
COORDINATES = 2.0  #: times N roundings: what energy coordinates move a gain, seen on beams of 5 to 80 elements


@dataclass(frozen=True, slots=True, eq=False)
class OptimalGain:
    """A gain that stabilizes, for N states and m inputs."""

    K: FloatArray  #: (m, N)
    S: FloatArray  #: (N, N) solution of (30)
    error: float  #: of K, estimated, relative to each input's gain
    poles: ComplexArray  #: (N,) of the closed loop [rad/s]


@np.errstate(all="ignore")  # what overflows is refused, with the size of its error
def optimal_gain(reduction: ExactReduction, cost: Cost, weights: PhysicalWeights | None, method: Solver) -> OptimalGain:
    """Solve the Riccati equation, and accept the gain only if it stabilizes and is known well enough.

    Up to `FEW` states it is the equation of the states of the reduction as they are stored, solved to the last digit;
    beyond these, or where their rounding moves the gain, that of the energy, where a model has energy coordinates.
    """
    one_thread = FEW < reduction.order <= OPTIMAL_GAIN_ONE_THREAD
    with limited_threads(1) if one_thread else nullcontext():
        best = _best_gain(reduction, cost, weights, method)
    if best.error > OPTIMAL_GAIN_WARNED:
        msg = (
            f"The gain is known to {best.error:.1e} of its size only: that is what rounding of the entries of A, B, Q "
            "and R does to it. The closed loop is stable; weights nearer to each other give a gain with more digits."
        )
        give_warning(msg, InaccurateGainWarning)
    return best


def _best_gain(reduction: ExactReduction, cost: Cost, weights: PhysicalWeights | None, method: Solver) -> OptimalGain:
    """Solve in one kind of states or another, and give the better gain that is accepted."""
    refusal: StabilizationError | None = None
    best: OptimalGain | None = None
    few = reduction.order <= FEW
    for energy in (False, True) if few else (True, False):
        plant = plant_in_energy_states(reduction, cost, weights) if energy else plant_of(reduction, cost)
        if plant is None:
            continue
        if refusal is None:  # what the first states do not tell from hidden is not told; others round it away
            _require_stabilizing_solution(reduction, plant)
        try:
            found = _solved_in(plant, method)
        except StabilizationError as error:
            refusal = refusal or error
            continue
        if best is None or found.error < WORTH * best.error:
            best = found
        if best.error <= (OPTIMAL_GAIN_GOOD if reduction.order <= MORE else OPTIMAL_GAIN_WARNED):
            break
    if best is None:
        raise refusal if refusal is not None else _unsolved_error(_eigenvalues(reduction.A))
    return best


def _solved_in(plant: Plant, method: Solver) -> OptimalGain:
    """Solve in the states of a plant, and go back to those of the reduction."""
    found = solved_care(plant.problem, method, balance=plant.T is None)
    if found is None:
        raise _unsolved_error(_eigenvalues(plant.A))
    poles = bounded_poles(found.closed)
    if not (found.error <= REFUSED and found.of_effort <= OPTIMAL_GAIN_UNKNOWN):
        raise _inaccurate_error(found.error, found.of_effort, poles.values)
    least = np.maximum(poles.bounds, len(poles.values) * UNIT_ROUNDOFF * np.abs(poles.values))
    if (poles.values.real >= -OPTIMAL_GAIN_MARGIN * least).any():
        raise _unsolved_error(poles.values, OPTIMAL_GAIN_MARGIN * float(least[np.argmax(poles.values.real)]))
    K, S, own = found.K, found.X, 0.0
    if plant.T is not None:
        K, S, own = K @ plant.T, plant.T.T @ S @ plant.T, COORDINATES * len(S) * UNIT_ROUNDOFF
    return OptimalGain(K + 0.0, S, max(found.error, found.rounding, own), poles.values)


def _require_stabilizing_solution(reduction: ExactReduction, plant: Plant) -> None:
    """Refuse a mode that no feedback stabilizes or that the optimal one would leave on the axis.

    A stabilizing solution of the Riccati equation exists if and only if every mode that is not stable is
    reached by the inputs and no mode on the imaginary axis is hidden from the cost (K. Zhou, J. C. Doyle and
    K. Glover, Robust and Optimal Control, theorem 13.7).
    """
    A, B, cost = plant.A, plant.B, plant.cost
    cross = np.linalg.solve(cost.R, cost.N.T)
    unstable = axis_eigenvalues(A, right_too=True)
    for eigenvalue in unstable:
        hidden = hidden_mode(A.T, B.T, eigenvalue, plant.sizes.T)
        if hidden is not None:
            mode, part = hidden
            force = _best_force(reduction, mode if plant.T is None else plant.T.T @ mode)
            msg = (
                f"The mode at {complex_in_words(eigenvalue, pair=True)} rad/s is not stable and the inputs reach it by "
                f"{part:.0e} of a "
                "usual mode, which is not told from nothing, so that no feedback "
                f"stabilizes it. Actuate it: a force on DOF {force} moves it most (input F_{force})."
            )
            raise StabilizationError(msg, eigenvalue=eigenvalue, quantity=f"F_{force}")
    folded = A - B @ cross
    on_axis = (
        axis_eigenvalues(folded, right_too=False) if cross.any() else [value for value in unstable if not value.real]
    )
    for eigenvalue in on_axis:
        hidden = hidden_mode(folded, cost.Q - cost.N @ cross, eigenvalue, plant.sizes + np.abs(B) @ np.abs(cross))
        if hidden is not None:
            mode, part = hidden
            kind, dof = _largest_motion(reduction, mode if plant.T_inverse is None else plant.T_inverse @ mode)
            msg = (
                f"The mode at {complex_in_words(eigenvalue, pair=True)} rad/s is undamped and the cost sees it by "
                f"{part:.0e} of a usual "
                "mode, which is not told from nothing, so that the "
                f"optimal feedback leaves it where it is. Weight it: it shows most in the {kind} of DOF {dof}."
            )
            raise StabilizationError(
                msg, eigenvalue=eigenvalue, quantity=motion_names((dof,), int(kind == "velocity"))[0]
            )


def _unsolved_error(poles: ComplexArray, bound: float | None = None) -> StabilizationError:
    """Make the refusal where no gain was found although one may exist, or one of which it is not known if it does."""
    worst = complex(max(poles.tolist(), key=lambda pole: pole.real))
    place = complex_in_words(worst, pair=True)
    if bound is None:
        fact = (
            "The solver found no stabilizing gain, although nothing hides a mode from inputs and cost: a pole stays at "
            f"{place} rad/s"
        )
    else:
        fact = (
            f"It is uncertain whether a stabilizing gain exists: with the one that was found a pole lies at {place} "
            f"rad/s, and rounding of the entries of A, B, Q and R may move it by {bound:.0e} rad/s, so that it is "
            "not told from one on the imaginary axis"
        )
    msg = (
        f"{fact}. Inputs may reach it, or the cost may see it, too little; or the weights differ by too many powers of "
        "ten: bring Q and R closer together, or place an actuator where the mode moves."
    )
    return StabilizationError(msg, eigenvalue=worst, quantity="Q, R")


def _inaccurate_error(error: float, rounding: float, poles: ComplexArray) -> StabilizationError:
    """Make the refusal of a gain with too few digits."""
    slowest = complex(max(poles.tolist(), key=lambda pole: pole.real))
    if error > REFUSED:
        fact = f"it solves its equation to {error:.0e} of its size only, where {REFUSED:.0e} is needed"
    else:
        fact = f"rounding of the entries of A, B, Q and R moves it by {rounding:.0e} of its size"
    msg = (
        f"A gain that stabilizes was found, but it is not known to be optimal: {fact}. The slowest pole with it is "
        f"{complex_in_words(slowest, pair=True)} rad/s. An input that hardly reaches a mode, or weights that differ by "
        "many powers of ten, do this: bring the weights closer together, or actuate the mode."
    )
    return StabilizationError(msg, eigenvalue=slowest, quantity="Q, R")


def _best_force(reduction: ExactReduction, mode: ComplexArray) -> str:
    """Name the DOF whose force drives a left eigenvector most."""
    dofs = reduction.model.dofs
    if reduction.model.is_sparse:  # of a large model those that have states
        dofs = tuple([state for state in reduction.states if state in set(dofs)]) or dofs[:1]
    every_force = reduced(reduction.model.select(inputs=force_names(dofs)))
    return dofs[int(np.argmax(np.abs(mode @ every_force.B)))]


def _largest_motion(reduction: ExactReduction, mode: ComplexArray) -> tuple[str, str]:
    """Say in the displacement or velocity of which DOF a mode shows most, displacements first."""
    shares = [np.abs(reduction.motion(derivative).X @ mode) for derivative in range(2)]
    derivative = 0 if shares[0].max() > UNSEEN * shares[1].max() else 1
    return ("displacement", "velocity")[derivative], reduction.model.dofs[int(np.argmax(shares[derivative]))]


def _eigenvalues(A: FloatArray) -> ComplexArray:
    return np.asarray(scipy.linalg.eigvals(A), dtype=np.complex128) if A.size else np.zeros(0, dtype=np.complex128)
