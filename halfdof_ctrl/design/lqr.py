"""Linear quadratic regulators with weights on physical quantities.

The cost of the feedback u = -K x on a reduced model is

    J = integral of  sum_d w_d q_d^2 + sum_d v_d q'_d^2 + sum_d a_d q''_d^2 + e E + sum_j r_j u_j^2   dt,
    E = 1/2 q'^T M q' + 1/2 q^T K q                                                        (12)

Every quantity is C x + D u with the direct term of (4), so each weight w adds w C^T C to Q, w C^T D to N and
w D^T D to R; half and static DOFs are weighted like any other. What `control.lqr` finds is improved by Newton's method
(`riccati`), and accepted only if the closed loop is stable and the gain known to 1e-6.

A feedback on x is one on q and q': with x = L_q q + L_v q' the closed loop is the second-order model

    M q'' + (C + B K L_v) q' + (K + B K L_q) q = B u.                                      (13)
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, get_args

import control
import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, read_only
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import (
    InaccurateGainWarning,
    ParameterError,
    StabilizationError,
    WeightError,
    give_warning,
)
from halfdof_ctrl.base.names import force_names, listed, motion_names
from halfdof_ctrl.base.progress import shows_activity
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.design.cost import Cost, PhysicalWeights, Weights, checked_weights, given_cost, physical_cost
from halfdof_ctrl.design.plant import Plant, plant_in_energy_states, plant_of
from halfdof_ctrl.design.reach import axis_eigenvalues, hidden_mode
from halfdof_ctrl.design.riccati import Solver, solved_care
from halfdof_ctrl.model.dense_copy import dense_copy
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.state_space import labelled_system, system_of_model

UNSEEN = 1e-8  #: imaginary parts, or displacements beside velocities, below this part are not shown
DERIVATIVES = 3  #: displacement, velocity and acceleration, which a second-order model can feed back
MARGIN = 4.0  #: times its bound: a closed-loop pole nearer to the axis is not told from one on it
GOOD = 1e-9  #: estimated error with which no other states are tried
MANY = 24  #: states from which on energy coordinates are tried first: these are structures, whose DOFs lose digits
WORTH = 0.01  #: of the estimated error: other states that leave more are not worth their way back to DOFs
WARNED, REFUSED = 1e-8, 1e-6  #: estimated errors of a gain that are said, and that are too much


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class StateFeedback:
    """A stabilizing feedback ``u = -K x`` on a reduced model, for N states and m inputs."""

    model: SecondOrderModel  #: the open loop
    reduction: ExactReduction  #: the open loop, reduced
    cost: Cost  #: what was minimized
    K: FloatArray  #: (m, N) gain
    S: FloatArray  #: (N, N) solution of the Riccati equation: the cost from x is x^T S x
    gain_error: float  #: estimated error of K, relative to the gain of each input in scaled states
    closed_loop: control.StateSpace  #: from the model's inputs to its outputs, with the feedback
    poles: ComplexArray  #: (N,) of the closed loop [rad/s]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the closed loop by its matrices and labels, since python-control's objects hold functions."""
        sys = self.closed_loop
        others = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "closed_loop"}
        labels = {"states": sys.state_labels, "inputs": sys.input_labels, "outputs": sys.output_labels}
        return _rebuilt, (others, (sys.A, sys.B, sys.C, sys.D), {**labels, "name": sys.name})

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the rows of K."""
        return self.model.inputs

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the columns of K."""
        return self.reduction.states

    def as_mechss(self) -> SecondOrderModel:
        """Return the closed loop as a second-order model, equation (13).

        Its finite eigenvalues are the closed-loop poles, which checks the design without the reduction.

        Raises
        ------
        WeightError
            Derivatives of the inputs act on the model (by `Bv`, `Ba` or a constraint), so that the state is not a
            function of q and its derivatives alone; or a state is a third or higher derivative of a DOF.
        """
        if self.reduction.shift:
            msg = (
                f"The states of this model contain its inputs {listed(self.inputs)}, whose derivatives act on it (by "
                "Bv, Ba or a constraint): the closed loop is no second-order model of the same form. Use `closed_loop`."
            )
            raise WeightError(msg, names=self.inputs)
        model, K = self.model, self.K
        partition = self.reduction.partition
        maps = partition.state_maps()
        gains = [K @ state_map for state_map in maps]  # on q, q' and, rarely, q''
        if len(gains) > DERIVATIVES:
            msg = f"Among the states are derivatives above the second: {listed(self.states)}. Use `closed_loop`."
            raise WeightError(msg, names=self.states)
        on_q, on_v, on_a = (*gains, np.zeros_like(gains[0]))[:DERIVATIVES]
        return replace(
            model,
            M=read_only(model.M + model.B @ on_a),
            C=read_only(model.C + model.B @ on_v),
            K=read_only(model.K + model.B @ on_q),
            F=read_only(model.F - model.D @ on_q),
            G=read_only(model.G - model.D @ on_v),
            H=read_only(model.H - model.D @ on_a),
            name=self.closed_loop.name,
        )

    def __repr__(self) -> str:
        """Print the gain with its labels and the closed-loop poles."""
        width = max(11, *(len(state) + 1 for state in self.states))
        first = max(len(name) for name in self.inputs)
        lines = [f"StateFeedback u = -K x, {len(self.inputs)} x {len(self.states)}"]
        lines.append(" " * (first + 2) + "".join(f"{state:>{width}}" for state in self.states))
        for name, row in zip(self.inputs, self.K, strict=True):
            lines.append(f"  {name:<{first}}" + "".join(f"{gain:>{width}.4g}" for gain in row))
        poles = ", ".join(complex_in_words(pole, pair=True) for pole in sorted(self.poles, key=abs) if pole.imag >= 0.0)
        lines.append(f"  closed-loop poles: {poles}")
        if self.gain_error > WARNED:
            lines.append(f"  gain known to {self.gain_error:.0e} of its size")
        return "\n".join(lines)


@dataclass(frozen=True, slots=True, eq=False)
class _Solved:
    K: FloatArray
    S: FloatArray
    error: float
    poles: ComplexArray


def _rebuilt(others: dict[str, Any], matrices: tuple[FloatArray, ...], labels: dict[str, Any]) -> StateFeedback:
    """Make a feedback again of what was pickled."""
    return StateFeedback(**others, closed_loop=control.StateSpace(*matrices, **labels))


@shows_activity("regulator")
def lqr(
    model: SecondOrderModel,
    Q: npt.ArrayLike | None = None,
    R: npt.ArrayLike | None = None,
    N: npt.ArrayLike | None = None,
    *,
    displacement: Weights = None,
    velocity: Weights = None,
    acceleration: Weights = None,
    effort: Weights = None,
    energy: float | None = None,
    method: Solver = "scipy",
) -> StateFeedback:
    """Design a linear quadratic regulator for a mechanical model.

    Give either matrices or physical weights. A useful first choice of a weight is one over the square of the
    largest value that is acceptable (Bryson's rule).

    Parameters
    ----------
    model : SecondOrderModel
        Its inputs are the actuators; choose them with `select`.
    Q, R, N : (N, N), (m, m), (N, m) array_like, optional
        Weights of ``x^T Q x + u^T R u + 2 x^T N u``, as in `control.lqr`, on the states of `exact_reduction`. For Q and
        R a vector is a diagonal matrix, and a number the weight of each state or input; labels are aligned.
    displacement, velocity, acceleration : mapping from DOF to weight, optional
        Weights of the squares of any DOF's motion [1/m^2, s^2/m^2, s^4/m^2], none negative.
    effort : mapping from input to weight, optional
        Weights of the squares of the inputs [1/N^2], positive.
    energy : float, optional
        Weight of the total mechanical energy, kinetic and elastic [1/J].
    method : {"scipy", "slycot"}, optional
        Solver that gives the start, as in `control.lqr`. Newton's method takes both to the same digits, and where one
        finds nothing the other is asked.

    Returns
    -------
    StateFeedback
        The gain with its labels, the closed loop, and the way back to a second-order model.

    Raises
    ------
    WeightError
        Weights that are negative or not finite, an input without a weight, a cost that is not positive
        semidefinite, a model without states, the energy of a model without one (unsymmetric or indefinite M or K), or a
        quantity that follows the derivative of an input.
    SignalNameError
        A weight on a DOF or input that is not there.
    StabilizationError
        No stabilizing gain: a mode on or right of the imaginary axis that the inputs do not reach, or one on
        the axis that the cost does not see. Or none whose digits can be told: an estimated error above 1e-6.

    Warns
    -----
    InaccurateGainWarning
        The estimated error of the gain (`StateFeedback.gain_error`) is above 1e-8.

    Examples
    --------
    For a mass of 1 kg, weights 1 on displacement and force give the gains 1 and sqrt(2):

    >>> model = mechss([[1]], [[0]], [[0]], dofs="y")
    >>> lqr(model, displacement={"y": 1}, effort={"F_y": 1}).K.round(6).tolist()
    [[1.0, 1.414214]]
    """
    physical = {"displacement": displacement, "velocity": velocity, "acceleration": acceleration}
    if not is_choice(method, get_args(Solver)):
        msg = f"method must be one of {listed(get_args(Solver))}, not {shown(method)}."
        raise ParameterError(msg, parameter="method", value=method)
    named = [dof for weights in physical.values() if isinstance(weights, Mapping) for dof in weights]
    remedy = "Weigh the states yourself: control.lqr(mech2ss(model), Q, R)."
    model = dense_copy(checked_model(model, "lqr"), "lqr", remedy, keep=list(map(str, named)))
    reduction = exact_reduction(model)
    if reduction.order == 0:
        msg = "The model has no states: its displacements follow the inputs at once, and nothing is to be regulated."
        raise WeightError(msg, names=())
    if Q is not None or R is not None or N is not None:
        if effort is not None or energy is not None or any(weights is not None for weights in physical.values()):
            msg = "Give either the matrices Q, R, N or physical weights, not both."
            raise WeightError(msg, names=("Q", "R", "N"))
        weights, cost = None, given_cost(Q, R, N, reduction)
    else:
        weights = checked_weights(model, list(physical.values()), energy)
        cost = physical_cost(reduction, weights, effort)
    plant = system_of_model(reduction)
    solved = _solved(reduction, cost, weights, method)
    gain, A, B = solved.K, reduction.A, reduction.B
    closed = labelled_system(
        A - B @ gain,
        B,
        plant.C - plant.D @ gain,
        plant.D,
        states=reduction.states,
        inputs=model.inputs,
        outputs=model.outputs,
        name=f"{model.name}_lqr" if model.name else None,
    )
    return StateFeedback(
        model=model,
        reduction=reduction,
        cost=cost,
        K=read_only(gain),
        S=read_only(solved.S),
        gain_error=solved.error,
        closed_loop=closed,
        poles=read_only(solved.poles),
    )


def _solved(reduction: ExactReduction, cost: Cost, weights: PhysicalWeights | None, method: Solver) -> _Solved:
    """Solve the Riccati equation, and accept the gain only if it stabilizes and is known well enough."""
    refusal: StabilizationError | None = None
    best: _Solved | None = None
    in_energy = (True, False) if reduction.order > MANY else (False, True)
    for energy in in_energy:
        plant = plant_in_energy_states(reduction, cost, weights) if energy else plant_of(reduction, cost)
        if plant is None:
            continue
        try:
            found = _solved_in(plant, reduction, method)
        except StabilizationError as error:
            refusal = error
            continue
        if best is None or found.error < WORTH * best.error:
            best = found
        if best.error <= GOOD:
            break
    if best is None:
        raise refusal if refusal is not None else _unsolved_error(_eigenvalues(reduction.A))
    if best.error > WARNED:
        msg = (
            f"The gain is known to {best.error:.1e} of its size only: that is what rounding of the entries of A, B, Q "
            "and R does to it. The closed loop is stable; weights nearer to each other give a gain with more digits."
        )
        give_warning(msg, InaccurateGainWarning)
    return best


def _solved_in(plant: Plant, reduction: ExactReduction, method: Solver) -> _Solved:
    """Solve in the states of a plant, and go back to those of the reduction."""
    _require_stabilizing_solution(reduction, plant)
    found = solved_care(plant.problem, method, balance=plant.T is None)
    if found is None:
        raise _unsolved_error(_eigenvalues(plant.A))
    poles = bounded_poles(plant.A - plant.B @ found.K)
    if (poles.values.real >= -MARGIN * poles.bounds).any():
        raise _unsolved_error(poles.values, float(poles.bounds[np.argmax(poles.values.real)]))
    if not found.error <= REFUSED:
        raise _inaccurate_error(found.error, poles.values)
    K, S = (found.K, found.X) if plant.T is None else (found.K @ plant.T, plant.T.T @ found.X @ plant.T)
    return _Solved(K + 0.0, S, found.error, poles.values)


def _require_stabilizing_solution(reduction: ExactReduction, plant: Plant) -> None:
    """Refuse a mode that no feedback stabilizes or that the optimal one would leave on the axis.

    A stabilizing solution of the Riccati equation exists if and only if every mode that is not stable is
    reached by the inputs and no mode on the imaginary axis is hidden from the cost (K. Zhou, J. C. Doyle and
    K. Glover, Robust and Optimal Control, theorem 13.7).
    """
    A, B, cost = plant.A, plant.B, plant.cost
    cross = np.linalg.solve(cost.R, cost.N.T)
    for eigenvalue in axis_eigenvalues(A, right_too=True):
        hidden = hidden_mode(A.T, B.T, eigenvalue)
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
    for eigenvalue in axis_eigenvalues(folded, right_too=False):
        hidden = hidden_mode(folded, cost.Q - cost.N @ cross, eigenvalue)
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
    """Make the refusal where no gain was found although one may exist."""
    worst = complex(max(poles.tolist(), key=lambda pole: pole.real))
    known = "" if bound is None else f", known to {bound:.0e} rad/s"
    msg = (
        "The solver found no stabilizing gain, although nothing hides a mode from inputs and cost: a pole stays at "
        f"{complex_in_words(worst, pair=True)} rad/s{known}. Inputs may reach it, or the cost may see it, too little; "
        "or the weights differ by too many powers of ten: bring Q and R closer together, or place an actuator where "
        "the mode moves."
    )
    return StabilizationError(msg, eigenvalue=worst, quantity="Q, R")


def _inaccurate_error(error: float, poles: ComplexArray) -> StabilizationError:
    """Make the refusal of a gain with too few digits."""
    slowest = complex(max(poles.tolist(), key=lambda pole: pole.real))
    msg = (
        f"The gain that was found stabilizes, but it is known to {error:.0e} of its size only, where {REFUSED:.0e} is "
        "needed to call it optimal: rounding of the entries of A, B, Q and R moves it so far. The slowest pole with it "
        f"is {complex_in_words(slowest, pair=True)} rad/s. An input that hardly reaches a mode, or weights that differ "
        "by many powers of ten, do this: bring the weights closer together, or actuate the mode."
    )
    return StabilizationError(msg, eigenvalue=slowest, quantity="Q, R")


def _best_force(reduction: ExactReduction, mode: ComplexArray) -> str:
    """Name the DOF whose force drives a left eigenvector most."""
    every_force = exact_reduction(reduction.model.select(inputs=force_names(reduction.model.dofs)))
    driven = np.abs(mode @ every_force.B)
    return reduction.model.dofs[int(np.argmax(driven))]


def _largest_motion(reduction: ExactReduction, mode: ComplexArray) -> tuple[str, str]:
    """Say in the displacement or velocity of which DOF a mode shows most, displacements first."""
    shares = [np.abs(reduction.motion(derivative).X @ mode) for derivative in range(2)]
    derivative = 0 if shares[0].max() > UNSEEN * shares[1].max() else 1
    return ("displacement", "velocity")[derivative], reduction.model.dofs[int(np.argmax(shares[derivative]))]


def _eigenvalues(A: FloatArray) -> ComplexArray:
    return np.asarray(scipy.linalg.eigvals(A), dtype=np.complex128) if A.size else np.zeros(0, dtype=np.complex128)
