"""How much of the inertia each DOF carries, in no unit."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.scaling import time_log, unit_free_scaling

PLAIN_SPREAD = 1e5  #: of stiffness over mass between the DOFs; a smaller one needs no closer look


def mass_ratios(model: SecondOrderModel) -> FloatArray:
    """Return each DOF's mass relative to the largest, free of units.

    At the slowest DOF's own frequency g the rows and columns of ``|K| + g |C| + g^2 |M|`` are scaled, first by the
    means of the logarithms of their entries and then until their largest entries are one; the ratio is between the
    largest entries of the columns of the scaled M. So it compares a DOF's inertia with what else acts on it, at the
    time scale of the heavy DOFs.

    Notes
    -----
    A light DOF and a slow one beside ordinary ones are the same model in other units: masses of 1 and 1e-13 kg on
    springs of 1 N/m are masses of 1 kg on springs of 1 and 1e13 N/m, with the second DOF in other units. So equal
    numbers in M can have any ratio: what is small is the share of the inertia in the equation of motion.
    """
    M, C, K = (np.abs(matrix) for matrix in (model.M, model.C, model.K))
    gamma = slowest_speed(model)
    mass = unit_free_scaling(K + gamma * C + gamma**2 * M).of(M).max(axis=0)
    return np.asarray(mass / mass.max() if mass.max() > 0.0 else mass)


def without_light_masses(model: SecondOrderModel, tol: float) -> SecondOrderModel:
    """Take the mass from the DOFs whose `mass_ratios` are at most `tol`."""
    light = model.M.any(axis=0) & (mass_ratios(model) <= tol)
    return replace(model, M=read_only(np.where(light, 0.0, model.M))) if light.any() else model


def own_speeds(model: SecondOrderModel) -> FloatArray:
    """Return max(K_jj / M_jj, (C_jj / M_jj)^2) of the DOFs with M_jj, zero for others: the same in any unit of them."""
    mass, drag, stiffness = (np.abs(matrix.diagonal()) for matrix in (model.M, model.C, model.K))
    with_mass = np.where(mass > 0.0, mass, np.inf)
    return np.asarray(np.maximum(stiffness / with_mass, (drag / with_mass) ** 2))


def slowest_speed(model: SecondOrderModel) -> float:
    """Return the own frequency of the slowest DOF, or a mean one of the entries where no DOF has one by itself."""
    speeds = own_speeds(model)
    if (speeds > 0.0).any():
        return float(np.sqrt(speeds[speeds > 0.0].min()))
    return float(np.exp2(time_log(model.quadratics.P)))


def spread_is_wide(model: SecondOrderModel, inertial: npt.NDArray[np.bool_]) -> bool:
    """Tell cheaply whether some mass might be tiny against the others in some unit."""
    if len(inertial) == 1 or np.count_nonzero(inertial) <= 1:
        return False
    speeds = own_speeds(model)[inertial]
    return bool(speeds.max() > PLAIN_SPREAD * speeds.min())
