"""Exact state space of mechanical models with singular mass, for python-control."""

from halfdof_ctrl.base import command_start as command_start  # before what takes time to import

# isort: split
from importlib import import_module
from typing import TYPE_CHECKING

from halfdof_ctrl import errors as errors  # a module, as `laws` is, and so no public name of its own

if TYPE_CHECKING:
    from halfdof_ctrl import laws as laws
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


#: Where the public names are, to be imported when they are asked for: who needs a state space need not wait for the
#: readers of files, and `import halfdof_ctrl` waits for nobody.
_HOMES = {
    "descriptor.structure": "PencilStructure pencil_structure",
    "descriptor.zeros": "zeros",
    "design.lqr": "StateFeedback lqr",
    "errors": "HalfdofError",
    "files.models": "inspect_files load_model save_model",
    "files.read_tables": "load_response",
    "files.systems": "load_system save_system",
    "files.tables": "save_response",
    "model.descriptor_form": "DescriptorForm",
    "model.descriptor_system": "DescriptorSystem dss",
    "model.elements": "Damper Force Spring",
    "model.law": "Law",
    "model.mechss": "mechss",
    "model.nonlinear": "NonlinearModel nlmechss",
    "model.second_order": "SecondOrderModel",
    "nonlinear.response": "nonlinear_response",
    "nonlinear.system": "mech2nlsys",
    "parts.assemble": "assemble",
    "parts.hydraulic": "Decoupler hydraulic_mount",
    "parts.joints": "Joint Rigid",
    "parts.loss_factor": "MaxwellDampedModel with_maxwell_damping",
    "parts.masses": "point_mass rigid_body",
    "parts.mounts": "hydromount hydromount_part",
    "parts.prony": "PronyFit fit_prony",
    "parts.rubber": "generalized_maxwell inerter kelvin_voigt maxwell zener",
    "plots": "bode_plot dynamic_stiffness_plot pole_map_plot prony_plot step_plot sweep_plot transmissibility_plot",
    "reduction.choose": "exact_reduction",
    "reduction.energy.port_hamiltonian": "PortHamiltonian port_hamiltonian",
    "reduction.exact_reduction": "ExactReduction",
    "reduction.modal.modal_damping": "with_modal_damping",
    "reduction.modal.truncation": "TruncatedModel truncate_modes",
    "report": "write_report",
    "sweeps.result": "SweepFailure SweepResult",
    "sweeps.sweep": "sweep",
    "systems.check_result": "CrossCheck",
    "systems.crosscheck": "crosscheck",
    "systems.descriptor_systems": "dss2ss",
    "systems.frequency": "descriptor_response frequency_response",
    "systems.state_map": "StateMap state_map",
    "systems.state_space": "mech2ss",
    "systems.stiffness": "dynamic_stiffness dynamic_stiffness_response transmissibility transmissibility_response",
    "systems.time_response": "forced_response initial_response step_response",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}
_CORE = "halfdof_ctrl.systems.state_space"  #: comes with the first name, so that no later call pays for the import
_MODULES = (
    "base",
    "descriptor",
    "design",
    "files",
    "laws",
    "model",
    "nonlinear",
    "parts",
    "plots",
    "reduction",
    "report",
    "sweeps",
    "systems",
)


if not TYPE_CHECKING:  # who checks types knows the names, and is to say of others that there are none

    def __getattr__(name: str) -> object:
        """Import a public name, or a room, when it is first asked for."""
        if name in _MODULES:
            return import_module(f"halfdof_ctrl.{name}")
        if name not in _HOME_OF:
            msg = f"module 'halfdof_ctrl' has no attribute {name!r}"
            raise AttributeError(msg)
        import_module(_CORE)
        value = getattr(import_module(f"halfdof_ctrl.{_HOME_OF[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Show the public names alone; the rooms of the package can still be imported."""
    return [*__all__, "__version__", "errors", "laws"]
