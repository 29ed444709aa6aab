"""Quadratic costs of mechanical models: weights on physical quantities as Q, R and N, equation (12)."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import (
    LARGEST_SIZE,
    SMALLEST_SIZE,
    FloatArray,
    checked_matrix,
    full_square,
    is_zero_number,
    require_range,
    without_short_forms,
)
from halfdof_ctrl.base.by_name import by_name
from halfdof_ctrl.base.doors import is_real_number, shown, wrong_object
from halfdof_ctrl.base.errors import ImproperError, WeightError
from halfdof_ctrl.base.labelled import has_labels, without_labels
from halfdof_ctrl.base.names import listed, motion_names
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.state_space import system_of_model

Weights: TypeAlias = Mapping[str, float] | None

#: what rows and columns of the matrices are, by letter
AXES = {"Q": ("states", "states"), "R": ("inputs", "inputs"), "N": ("states", "inputs")}
INDEFINITE = 1e-10  #: eigenvalues of a scaled cost matrix below minus this are no rounding
UNSYMMETRIC_WEIGHTS = 1e-12  #: relative difference between a matrix and its transpose that is no rounding


@dataclass(frozen=True, slots=True, eq=False)
class Cost:
    """``x^T Q x + u^T R u + 2 x^T N u``, for N states and m inputs."""

    Q: FloatArray  #: (N, N)
    R: FloatArray  #: (m, m)
    N: FloatArray  #: (N, m)


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalWeights:
    """What a cost is made of, checked."""

    motions: tuple[dict[str, float], ...]  #: of displacements, velocities, accelerations, by DOF
    energy: float | None


def given_cost(
    Q: npt.ArrayLike | None, R: npt.ArrayLike | None, N: npt.ArrayLike | None, reduction: ExactReduction
) -> Cost:
    """Check weighting matrices that were given."""
    n, m = reduction.B.shape
    if Q is None or R is None:
        msg = "Q and R are both needed where matrices are given; physical weights need neither."
        raise WeightError(msg, names=("Q",) if Q is None else ("R",))
    if has_labels((Q, R, N)):
        names = {"states": reduction.states, "inputs": reduction.model.inputs}
        matrices, _ = without_labels({"Q": Q, "R": R, "N": N}, AXES, names)
        plain: dict[str, Any] = matrices
        Q, R, N = plain["Q"], plain["R"], plain["N"]
    cost = Cost(
        _square(Q, "Q", n, "states"),
        _square(R, "R", m, "inputs"),
        np.zeros((n, m)) if N is None or is_zero_number(N) else checked_matrix(N, "N", (n, m)),
    )
    for letter, matrix in (("Q", cost.Q), ("R", cost.R), ("N", cost.N)):
        if np.iscomplexobj(matrix) or (letter != "N" and not _is_symmetric(matrix)):
            kind = "real" if letter == "N" else "real and symmetric"
            msg = f"{letter} must be {kind}: take its symmetric part if that is what is meant."
            raise WeightError(msg, names=(letter,))
    _require_convex(cost, reduction.model.inputs)
    return cost


def _square(value: object, letter: str, size: int, rows: str) -> FloatArray:
    """Read a weighting matrix, a vector for a diagonal one, or a number for all of the diagonal."""
    if is_real_number(value):
        value = np.full(size, value)
    full = full_square(without_short_forms((value,), (letter,), size, rows)[0])
    matrix = checked_matrix(np.zeros((size, size)) if full is None else full, letter, (size, size))
    sizes = np.abs(matrix)
    require_range(letter, sizes.max(axis=0), sizes)
    return matrix


def checked_weights(model: SecondOrderModel, motions: list[Weights], energy: float | None) -> PhysicalWeights:
    """Check weights of displacements, velocities and accelerations, and of the energy."""
    return PhysicalWeights(
        tuple([dict(_checked_weights(weights, model.dofs, "DOF")) for weights in motions]),
        None if energy is None else _checked_weight("energy", energy),
    )


def physical_cost(reduction: ExactReduction, weights: PhysicalWeights, effort: Weights) -> Cost:
    """Assemble Q, R and N from weights on motions, inputs and energy, equation (12)."""
    model = reduction.model
    n, m = reduction.B.shape
    Q, R, N = np.zeros((n, n)), np.zeros((m, m)), np.zeros((n, m))
    quantities: dict[str, float] = {}
    for derivative, weighted in enumerate(weights.motions):
        quantities |= {motion_names((dof,), derivative)[0]: weight for dof, weight in weighted.items()}
    parts = []
    if quantities:
        parts.append((*_weighted_rows(reduction, tuple(quantities)), np.diag(list(quantities.values()))))
    if weights.energy is not None:
        parts += _energy_parts(reduction, weights.energy)
    for C, D, W in parts:
        Q, N, R = Q + C.T @ W @ C, N + C.T @ W @ D, R + D.T @ W @ D
    for name, weight in _checked_weights(effort, model.inputs, "input"):
        R[model.inputs.index(name), model.inputs.index(name)] += weight
    if not quantities and weights.energy is None:
        msg = "The cost sees no motion: weight a displacement, velocity, acceleration or the energy."
        raise WeightError(msg, names=())
    cost = Cost((Q + Q.T) / 2.0, (R + R.T) / 2.0, N)
    _require_convex(cost, model.inputs)
    return cost


def _weighted_rows(reduction: ExactReduction, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Give C and D of the named motions."""
    try:
        system = system_of_model(replace(reduction, model=reduction.model.select(outputs=names)))
    except ImproperError as cause:
        culprits = tuple(dict.fromkeys(output for _, output, _ in cause.pairs))
        msg = (
            f"{listed(culprits)} follows the derivative of an input, so that no weight on its square makes a quadratic "
            "cost of states and inputs. Weight the displacement instead."
        )
        raise WeightError(msg, names=culprits) from cause
    return np.asarray(system.C), np.asarray(system.D)


def _energy_parts(reduction: ExactReduction, weight: float) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Return the rows and weights of the kinetic and the elastic energy."""
    model, m = reduction.model, reduction.B.shape[1]
    if model.prescribed:
        msg = (
            f"The motion of {listed(model.prescribed)} is prescribed, so that the mechanical energy is no function of "
            "the states alone. Weight displacements and velocities instead."
        )
        raise WeightError(msg, names=("energy",))
    velocity = reduction.motion(1).X  # what has no mass stores nothing
    displacement = reduction.displacement
    for letter, matrix, motion in (("M", model.M, velocity), ("K", model.K, displacement.X)):
        stored = motion.T @ (matrix @ motion) if model.is_sparse else matrix  # of a large model, in its states
        if abs(matrix - matrix.T).max() > UNSYMMETRIC_WEIGHTS * abs(matrix).max() or (
            _smallest_eigenvalue(stored) < -INDEFINITE
        ):
            msg = (
                f"{letter} is not symmetric positive semidefinite, so that the model has no mechanical energy of the "
                "usual form. Weight displacements and velocities instead."
            )
            raise WeightError(msg, names=("energy",))
    if reduction.shift:
        msg = "The energy of a model on which derivatives of inputs act (Bv, Ba) is no function of its states alone."
        raise WeightError(msg, names=("energy",))
    return [
        (velocity, np.zeros((len(model.dofs), m)), 0.5 * weight * model.M),
        (displacement.X, displacement.direct(m), 0.5 * weight * model.K),
    ]


def _checked_weights(weights: object, known: tuple[str, ...], what: str) -> Iterator[tuple[str, float]]:
    if weights is None:
        return
    if not isinstance(weights, Mapping):
        example = f"such as {{{known[0]!r}: 1.0}}"
        raise wrong_object("A weight", f"a mapping from {what} to a number, {example}", weights, parameter="weights")
    for name, value in by_name(weights, known, what).items():
        yield name, _checked_weight(name, value)


def _checked_weight(name: str, value: object) -> float:
    """Read one weight: a finite number that is not negative."""
    number = float(value) if is_real_number(value) else math.nan  # type: ignore[arg-type]
    if not math.isfinite(number) or number < 0.0 or number > LARGEST_SIZE or 0.0 < number < SMALLEST_SIZE:
        msg = (
            f"The weight of {name} is {shown(value)}, but it must be a finite number that is not negative: 0, or from "
            f"{SMALLEST_SIZE:.0e} to {LARGEST_SIZE:.0e}."
        )
        raise WeightError(msg, names=(name,))
    return number


def _require_convex(cost: Cost, inputs: tuple[str, ...]) -> None:
    """Refuse R that is not positive definite and a cost that is not positive semidefinite."""
    diagonal = np.diagonal(cost.R)
    free = tuple([name for name, weight in zip(inputs, diagonal.tolist(), strict=True) if weight <= 0.0])
    if free:
        msg = (
            f"The inputs {listed(free)} cost nothing, so that the gain would be infinite. Give each a positive effort."
        )
        raise WeightError(msg, names=free)
    if _smallest_eigenvalue(cost.R) <= INDEFINITE:
        msg = f"R is not positive definite over the inputs {listed(inputs)}: some combination of them costs nothing."
        raise WeightError(msg, names=inputs)
    whole = np.block([[cost.Q, cost.N], [cost.N.T, cost.R]])
    if _smallest_eigenvalue(whole) < -INDEFINITE:
        msg = "The cost [[Q, N], [N', R]] is not positive semidefinite: it can be made as small as one likes."
        raise WeightError(msg, names=("Q", "N", "R"))


def _smallest_eigenvalue(matrix: FloatArray) -> float:
    """Return the smallest eigenvalue after scaling the diagonal to one."""
    scale = np.sqrt(np.abs(np.diagonal(matrix)))
    scale = np.where(scale > 0.0, scale, max(scale.max(initial=0.0), 1.0))
    return float(np.linalg.eigvalsh(matrix / scale / scale[:, None])[0])


def _is_symmetric(matrix: FloatArray) -> bool:
    return bool(np.abs(matrix - matrix.T).max() <= UNSYMMETRIC_WEIGHTS * np.abs(matrix).max())
