"""Exact state space of mechanical models with singular mass, for python-control."""

from halfdof_ctrl.descriptor.structure import PencilStructure, pencil_structure
from halfdof_ctrl.descriptor.zeros import zeros
from halfdof_ctrl.design.lqr import StateFeedback, lqr
from halfdof_ctrl.errors import HalfdofError
from halfdof_ctrl.files.models import inspect_files, load_model, save_model
from halfdof_ctrl.files.read_tables import load_response
from halfdof_ctrl.files.systems import load_system, save_system
from halfdof_ctrl.files.tables import save_response
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.mounts import hydromount
from halfdof_ctrl.plots import (
    bode_plot,
    dynamic_stiffness_plot,
    pole_map_plot,
    step_plot,
    sweep_plot,
    transmissibility_plot,
)
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.energy.port_hamiltonian import PortHamiltonian, port_hamiltonian
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.modal.truncation import TruncatedModel, truncate_modes
from halfdof_ctrl.report import write_report
from halfdof_ctrl.sweeps.result import SweepFailure, SweepResult
from halfdof_ctrl.sweeps.sweep import sweep
from halfdof_ctrl.systems.crosscheck import CrossCheck, crosscheck
from halfdof_ctrl.systems.frequency import descriptor_response, frequency_response
from halfdof_ctrl.systems.state_map import StateMap, state_map
from halfdof_ctrl.systems.state_space import mech2ss
from halfdof_ctrl.systems.stiffness import (
    dynamic_stiffness,
    dynamic_stiffness_response,
    transmissibility,
    transmissibility_response,
)
from halfdof_ctrl.systems.time_response import forced_response, initial_response, step_response

__version__ = "0.1.0"

__all__ = [
    "CrossCheck",
    "ExactReduction",
    "HalfdofError",
    "PencilStructure",
    "PortHamiltonian",
    "SecondOrderModel",
    "StateFeedback",
    "StateMap",
    "SweepFailure",
    "SweepResult",
    "TruncatedModel",
    "bode_plot",
    "crosscheck",
    "descriptor_response",
    "dynamic_stiffness",
    "dynamic_stiffness_plot",
    "dynamic_stiffness_response",
    "exact_reduction",
    "forced_response",
    "frequency_response",
    "hydromount",
    "initial_response",
    "inspect_files",
    "load_model",
    "load_response",
    "load_system",
    "lqr",
    "mech2ss",
    "mechss",
    "pencil_structure",
    "pole_map_plot",
    "port_hamiltonian",
    "save_model",
    "save_response",
    "save_system",
    "state_map",
    "step_plot",
    "step_response",
    "sweep",
    "sweep_plot",
    "transmissibility",
    "transmissibility_plot",
    "transmissibility_response",
    "truncate_modes",
    "write_report",
    "zeros",
]


def __dir__() -> list[str]:
    """Show the public names alone; the rooms of the package can still be imported."""
    return [*__all__, "__version__", "errors"]
