"""Exact state space of mechanical models with singular mass, for python-control."""

from halfdof_ctrl.base import command_start as command_start  # before what takes time to import

# isort: split
from halfdof_ctrl import laws as laws  # `hd.laws`, a module and so no public name of its own
from halfdof_ctrl.descriptor.structure import PencilStructure, pencil_structure
from halfdof_ctrl.descriptor.zeros import zeros
from halfdof_ctrl.design.lqr import StateFeedback, lqr
from halfdof_ctrl.errors import HalfdofError
from halfdof_ctrl.files.models import inspect_files, load_model, save_model
from halfdof_ctrl.files.read_tables import load_response
from halfdof_ctrl.files.systems import load_system, save_system
from halfdof_ctrl.files.tables import save_response
from halfdof_ctrl.model.descriptor_form import DescriptorForm
from halfdof_ctrl.model.descriptor_system import DescriptorSystem, dss
from halfdof_ctrl.model.elements import Damper, Force, Spring
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.nonlinear import NonlinearModel, nlmechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.response import nonlinear_response
from halfdof_ctrl.nonlinear.system import mech2nlsys
from halfdof_ctrl.parts.assemble import assemble
from halfdof_ctrl.parts.hydraulic import Decoupler, hydraulic_mount
from halfdof_ctrl.parts.joints import Joint, Rigid
from halfdof_ctrl.parts.loss_factor import MaxwellDampedModel, with_maxwell_damping
from halfdof_ctrl.parts.masses import point_mass, rigid_body
from halfdof_ctrl.parts.mounts import hydromount, hydromount_part
from halfdof_ctrl.parts.prony import PronyFit, fit_prony
from halfdof_ctrl.parts.rubber import generalized_maxwell, inerter, kelvin_voigt, maxwell, zener
from halfdof_ctrl.plots import (
    bode_plot,
    dynamic_stiffness_plot,
    pole_map_plot,
    prony_plot,
    step_plot,
    sweep_plot,
    transmissibility_plot,
)
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.energy.port_hamiltonian import PortHamiltonian, port_hamiltonian
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.modal.modal_damping import with_modal_damping
from halfdof_ctrl.reduction.modal.truncation import TruncatedModel, truncate_modes
from halfdof_ctrl.report import write_report
from halfdof_ctrl.sweeps.result import SweepFailure, SweepResult
from halfdof_ctrl.sweeps.sweep import sweep
from halfdof_ctrl.systems.check_result import CrossCheck
from halfdof_ctrl.systems.crosscheck import crosscheck
from halfdof_ctrl.systems.descriptor_systems import dss2ss
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
    "Damper",
    "Decoupler",
    "DescriptorForm",
    "DescriptorSystem",
    "ExactReduction",
    "Force",
    "HalfdofError",
    "Joint",
    "Law",
    "MaxwellDampedModel",
    "NonlinearModel",
    "PencilStructure",
    "PortHamiltonian",
    "PronyFit",
    "Rigid",
    "SecondOrderModel",
    "Spring",
    "StateFeedback",
    "StateMap",
    "SweepFailure",
    "SweepResult",
    "TruncatedModel",
    "assemble",
    "bode_plot",
    "crosscheck",
    "descriptor_response",
    "dss",
    "dss2ss",
    "dynamic_stiffness",
    "dynamic_stiffness_plot",
    "dynamic_stiffness_response",
    "exact_reduction",
    "fit_prony",
    "forced_response",
    "frequency_response",
    "generalized_maxwell",
    "hydraulic_mount",
    "hydromount",
    "hydromount_part",
    "inerter",
    "initial_response",
    "inspect_files",
    "kelvin_voigt",
    "load_model",
    "load_response",
    "load_system",
    "lqr",
    "maxwell",
    "mech2nlsys",
    "mech2ss",
    "mechss",
    "nlmechss",
    "nonlinear_response",
    "pencil_structure",
    "point_mass",
    "pole_map_plot",
    "port_hamiltonian",
    "prony_plot",
    "rigid_body",
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
    "with_maxwell_damping",
    "with_modal_damping",
    "write_report",
    "zener",
    "zeros",
]


def __dir__() -> list[str]:
    """Show the public names alone; the rooms of the package can still be imported."""
    return [*__all__, "__version__", "errors", "laws"]
