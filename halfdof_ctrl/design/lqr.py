"""Linear quadratic regulators with weights on physical quantities.

The cost of the feedback u = -K x on a reduced model is

    J = integral of  sum_d w_d q_d^2 + sum_d v_d q'_d^2 + sum_d a_d q''_d^2 + e E + sum_j r_j u_j^2   dt,
    E = 1/2 q'^T M q' + 1/2 q^T K q                                                        (12)

Every quantity is C x + D u with the direct term of (4), so each weight w adds w C^T C to Q, w C^T D to N and
w D^T D to R; half and static DOFs are weighted like any other. What `control.lqr` finds is improved by Newton's method
(`riccati`), and accepted only if the closed loop is stable and the gain optimal (`optimal_gain`).

A feedback on x is one on q and q': with x = L_q q + L_v q' the closed loop is the second-order model

    M q'' + (C + B K L_v) q' + (K + B K L_q) q = B u.                                      (13)
"""

from dataclasses import dataclass, fields, replace
from typing import Any, get_args

import control
import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, Matrix, read_only
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import ModelSizeError, ParameterError, WeightError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.progress import shows_activity
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.design.cost import Cost, Weights, checked_weights, given_cost, physical_cost
from halfdof_ctrl.design.optimal_gain import OPTIMAL_GAIN_WARNED, optimal_gain
from halfdof_ctrl.design.starts import Solver
from halfdof_ctrl.model.dense_copy import is_large
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.state_space import labelled_system, system_of_model

MOST_STATES = 2000  #: of a regulator: a few minutes, which grow with their cube
DERIVATIVES = 3  #: displacement, velocity and acceleration, which a second-order model can feed back


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class StateFeedback:
    """A stabilizing feedback ``u = -K x`` on a reduced model, for N states and m inputs."""

    model: SecondOrderModel  #: the open loop
    reduction: ExactReduction  #: the open loop, reduced
    cost: Cost  #: what was minimized
    K: FloatArray  #: (m, N) gain
    S: FloatArray  #: (N, N) solution of the Riccati equation: the cost from x is x^T S x
    gain_error: float  #: estimated error of K, and what rounding of the entries does to it, relative to each input's
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

        def closed(matrix: Matrix, factor: Matrix, gain: FloatArray) -> Matrix:
            if model.is_sparse:
                return csc_array(matrix + as_sparse(factor) @ as_sparse(gain))
            return read_only(matrix + factor @ gain)

        return replace(
            model,
            M=closed(model.M, model.B, on_a),
            C=closed(model.C, model.B, on_v),
            K=closed(model.K, model.B, on_q),
            F=closed(model.F, model.D, -on_q),
            G=closed(model.G, model.D, -on_v),
            H=closed(model.H, model.D, -on_a),
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
        if self.gain_error > OPTIMAL_GAIN_WARNED:
            lines.append(f"  gain known to {self.gain_error:.0e} of its size")
        return "\n".join(lines)


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
        the axis that the cost does not see. Or none whose digits can be told: a gain that solves its equation to
        less than 1e-6, or one that rounding of the entries moves by more than a tenth.
    ModelSizeError
        More than 2000 states.

    Warns
    -----
    InaccurateGainWarning
        The estimated error of the gain (`StateFeedback.gain_error`) is above 1e-8.
    LostDigitsWarning
        `StateFeedback.closed_loop`, as double precision stores it, loses more than 1e-9 of an output.

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
    model = checked_model(model, "lqr")
    if model.is_sparse and not is_large(model):
        model = model.as_dense()
    reduction = reduced(model)
    reduction.solution.evidence.warn_of_loss("A, B, C and D of the closed loop in displacements and velocities")
    if reduction.order > MOST_STATES:
        msg = (
            f"lqr works on models with up to {MOST_STATES} states; this one has {reduction.order}. Regulate its slow "
            "modes: lqr(truncate_modes(model, f_max=...), ...)."
        )
        raise ModelSizeError(msg, size=reduction.order, limit=MOST_STATES)
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
    solved = optimal_gain(reduction, cost, weights, method)
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
