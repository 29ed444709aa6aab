"""Objects that are no model, no system, no name, no option: what a user passes by mistake."""

import datetime as dt
import decimal
import fractions
import io
import pathlib
from collections.abc import Callable

import control
import numpy as np
from scipy import sparse

import halfdof_ctrl as hd

FREQUENCIES = np.geomspace(0.1, 10.0, 12)
MEASURED = (FREQUENCIES, 1.0 + 2.0j * FREQUENCIES / (1.0 + 1.0j * FREQUENCIES))


class Nothing:
    """An object that can do nothing."""


class Lost:
    """A path that leads nowhere."""

    def __fspath__(self) -> str:
        """Fail."""
        message = "there is no way"
        raise RuntimeError(message)


def wrong_objects() -> dict[str, object]:
    """Give what is passed by mistake, by what it is, made anew."""
    mount = hd.hydromount().select("F_y", "y")
    system = hd.mech2ss(mount)
    broken = control.ss([[np.nan]], [[1.0]], [[1.0]], [[0.0]])
    in_itself: list[object] = []
    in_itself.append(in_itself)
    return {
        "none": None,
        "true": True,
        "zero": 0,
        "one": 1,
        "negative": -3,
        "huge integer": 10**400,
        "float": 1.5,
        "nan": float("nan"),
        "inf": float("inf"),
        "complex": 1 + 2j,
        "numpy float": np.float64(2.0),
        "numpy integer": np.int64(3),
        "fraction": fractions.Fraction(1, 3),
        "decimal": decimal.Decimal("0.1"),
        "decimal that compares with nothing": decimal.Decimal("sNaN"),
        "span of time, an integer of numpy": np.timedelta64(3, "s"),
        "empty text": "",
        "text": "nope",
        "number as text": "20",
        "method": "qz",
        "control characters": "\x1b[31m\n",
        "bytes": b"abc",
        "path": pathlib.Path("nowhere/at/all"),
        "path that fails": Lost(),
        "file": io.StringIO("1 2 3"),
        "empty list": [],
        "list of numbers": [1.0, 2.0, 3.0],
        "list of texts": ["y", "z"],
        "list of none": [None, None],
        "ragged": [[1.0, 2.0], [3.0]],
        "nested": [[[1.0]]],
        "mixed": [1, "a", None],
        "tuple": (1, 2),
        "empty tuple": (),
        "set": {"y", "z"},
        "frozenset": frozenset({"a"}),
        "range": range(3),
        "generator": (i for i in range(3)),
        "empty mapping": {},
        "mapping": {"y": 1.0},
        "mapping of texts": {"y": "x"},
        "mapping of numbers": {1: 2},
        "mapping of none": {"y": None},
        "array": np.array([1.0, 2.0]),
        "text array": np.array(["y", "x"]),
        "empty array": np.zeros((0, 0)),
        "zero-dimensional": np.array(1.0),
        "three-dimensional": np.zeros((2, 2, 2)),
        "object array": np.array([None, {}], dtype=object),
        "nan array": np.array([np.nan, 1.0]),
        "boolean array": np.array([True, False]),
        "masked": np.ma.masked_array([1.0, 2.0], mask=[True, False]),
        "sparse": sparse.csr_array(np.eye(3)),
        "sparse that is a mapping": sparse.dok_array((2, 2)),
        "in itself": in_itself,
        "date": np.datetime64("2020-01-01"),
        "time": dt.timedelta(1),
        "object": Nothing(),
        "class": Nothing,
        "class of models": hd.SecondOrderModel,
        "function": lambda *_: None,
        "module": np,
        "ellipsis": ...,
        "not implemented": NotImplemented,
        "slice": slice(1, 2),
        "state space": system,
        "transfer function": control.tf([1.0], [1.0, 1.0]),
        "frequency response": control.frd([1.0, 2.0], [1.0, 2.0]),
        "state space with NaN": broken,
        "discrete": control.ss(0.5, 1.0, 1.0, 0.0, 0.1),
        "model": mount,
        "reduction": hd.exact_reduction(mount),
        "nonlinear model": hd.nlmechss(hd.hydromount(), hd.Spring("y", None, hd.laws.cubic(1.0, 1.0))),
        "part": hd.hydromount_part(),
        "error": ValueError("no"),
    }


def doors(folder: pathlib.Path) -> dict[str, tuple[Callable[..., object], dict[str, object]]]:
    """Give each public function with arguments that it takes: `folder` is where it may write."""
    mount = hd.hydromount().select("F_y", "y")
    system = hd.mech2ss(mount)
    reduction = hd.exact_reduction(mount)
    states = hd.state_map(mount, "dofs")
    soft = hd.nlmechss(hd.hydromount(), hd.Spring("y", None, hd.laws.cubic(1.0, 1.0)))
    two = hd.mechss(np.eye(2), None, [[2.0, -1.0], [-1.0, 2.0]], dofs=["a", "b"])
    frequency = hd.frequency_response(system, [1.0, 2.0])
    rubber = hd.maxwell(2.0, 3.0)
    feedback = hd.lqr(mount, displacement={"y": 1.0}, effort={"F_y": 1.0})
    fit = hd.fit_prony(*MEASURED)
    swept = hd.sweep(hd.hydromount, {"m": [20.0, 30.0]}, omega=[1.0, 2.0], inputs="F_y", outputs="y", workers=None)
    hd.save_model(two, folder / "two.npz")
    hd.save_system(system, folder / "s.npz")
    hd.save_response(frequency, folder / "r.csv")
    square, omega = np.eye(2), [1.0, 2.0]
    return {
        "mechss": (
            hd.mechss,
            {
                "M": square,
                "C": square,
                "K": square,
                "B": [1.0, 0.0],
                "F": [1.0, 0.0],
                "G": None,
                "H": None,
                "D": None,
                "Bv": None,
                "Ba": None,
                "Dv": None,
                "Da": None,
                "dofs": None,
                "inputs": None,
                "outputs": None,
                "name": None,
            },
        ),
        "mech2ss": (
            hd.mech2ss,
            {
                "model": mount,
                "states": "dofs",
                "improper": "refuse",
                "C": None,
                "dofs": None,
                "name": None,
            },
        ),
        "mech2ss of matrices": (
            hd.mech2ss,
            {
                "model": square,
                "C": None,
                "K": square,
                "B": None,
                "F": None,
                "dofs": None,
                "inputs": None,
                "outputs": None,
                "name": None,
            },
        ),
        "exact_reduction": (hd.exact_reduction, {"model": mount, "method": None, "tol": None}),
        "recover": (reduction.recover, {"response": control.step_response(system)}),
        "state": (reduction.state, {"q0": {}, "v0": None, "u0": 0.0}),
        "pencil_structure": (hd.pencil_structure, {"model": mount}),
        "zeros": (hd.zeros, {"model": mount}),
        "truncate_modes": (hd.truncate_modes, {"model": two, "f_max": None, "n_modes": 1, "points": 12}),
        "crosscheck": (hd.crosscheck, {"model": mount, "sys": system}),
        "descriptor_response": (hd.descriptor_response, {"model": mount, "omega": omega}),
        "frequency_response": (hd.frequency_response, {"sysdata": system, "omega": omega}),
        "dss": (
            hd.dss,
            {
                "A": -square,
                "B": [1.0, 0.0],
                "C": [1.0, 0.0],
                "D": None,
                "E": square,
                "states": None,
                "inputs": None,
                "outputs": None,
                "name": None,
            },
        ),
        "dss2ss": (
            hd.dss2ss,
            {
                "A": -square,
                "B": [1.0, 0.0],
                "C": [1.0, 0.0],
                "D": None,
                "E": square,
                "states": None,
                "inputs": None,
                "outputs": None,
                "name": None,
                "improper": "refuse",
            },
        ),
        "lqr": (
            hd.lqr,
            {
                "model": mount,
                "displacement": {"y": 1.0},
                "velocity": None,
                "acceleration": None,
                "effort": {"F_y": 1.0},
                "energy": None,
                "method": "scipy",
            },
        ),
        "lqr of matrices": (hd.lqr, {"model": mount, "Q": np.eye(reduction.order), "R": [[1.0]], "N": None}),
        "port_hamiltonian": (hd.port_hamiltonian, {"model": two}),
        "with_modal_damping": (hd.with_modal_damping, {"model": two, "loss_factor": 0.1}),
        "with_maxwell_damping": (
            hd.with_maxwell_damping,
            {
                "model": two,
                "loss_factor": 0.1,
                "band": (1.0, 10.0),
                "branches": None,
                "tol": 0.02,
                "reference": None,
                "keep": "loss",
            },
        ),
        "state_map": (hd.state_map, {"model": mount, "states": "dofs"}),
        "state_map.state": (states.state, {"q0": {}, "v0": None, "u0": 0.0}),
        "forced_response": (
            hd.forced_response,
            {
                "model": mount,
                "timepts": [0.0, 0.1, 0.2],
                "inputs": 1.0,
            },
        ),
        "initial_response": (
            hd.initial_response,
            {"model": mount, "timepts": [0.0, 0.1], "displacement": {"y": 1.0}, "velocity": None},
        ),
        "step_response": (hd.step_response, {"model": mount, "timepts": [0.0, 0.1]}),
        "dynamic_stiffness": (hd.dynamic_stiffness, {"model": two, "dof": "a", "s": [1j]}),
        "dynamic_stiffness_response": (hd.dynamic_stiffness_response, {"model": two, "dof": "a", "omega": omega}),
        "transmissibility": (hd.transmissibility, {"model": two, "from_": "a", "to": "b", "s": [1j], "kind": "motion"}),
        "transmissibility_response": (
            hd.transmissibility_response,
            {
                "model": two,
                "from_": "a",
                "to": "b",
                "omega": omega,
                "kind": "motion",
            },
        ),
        "assemble": (
            hd.assemble,
            {
                "parts": {"a": hd.point_mass(1.0), "m": rubber},
                "joints": [hd.Rigid("a_z", "m_top")],
                "ground": "m_bottom",
                "name": None,
            },
        ),
        "nlmechss": (
            hd.nlmechss,
            {"model": two, "elements": [hd.Spring("a", "b", hd.laws.cubic(1.0, 1.0))], "name": None},
        ),
        "mech2nlsys": (hd.mech2nlsys, {"nonlinear": soft}),
        "nonlinear_response": (
            hd.nonlinear_response,
            {
                "nonlinear": soft,
                "timepts": [0.0, 0.001],
                "inputs": 0.0,
                "initial": None,
                "rtol": 1e-6,
                "method": "LSODA",
            },
        ),
        "Spring": (hd.Spring, {"a": "y", "b": None, "law": 1.0}),
        "Damper": (hd.Damper, {"a": "y", "b": None, "law": 1.0}),
        "Force": (hd.Force, {"function": abs, "displacements": "y", "velocities": (), "jacobian": None, "on": None}),
        "Law": (hd.Law, {"force": np.sin, "slope": np.cos, "inverse": None, "bounds": None}),
        "Rigid": (hd.Rigid, {"a": "a.x", "b": "b.x"}),
        "Joint": (hd.Joint, {"a": "a.x", "b": None, "model": rubber, "ports": ("top", "bottom"), "name": None}),
        "Decoupler": (hd.Decoupler, {"I": 1.0, "R": 1.0}),
        "point_mass": (hd.point_mass, {"m": 1.0, "axes": "z"}),
        "rigid_body": (
            hd.rigid_body,
            {
                "m": 1.0,
                "inertia": [1.0, 1.0, 1.0],
                "points": {"a": (1.0, 0.0, 0.0)},
                "rotations": False,
            },
        ),
        "kelvin_voigt": (hd.kelvin_voigt, {"k": 1.0, "c": 1.0, "axes": None}),
        "maxwell": (hd.maxwell, {"k": 1.0, "c": 1.0, "axes": None}),
        "zener": (hd.zener, {"k": 1.0, "k1": 1.0, "c1": 1.0, "axes": None}),
        "generalized_maxwell": (hd.generalized_maxwell, {"k": 1.0, "branches": [(1.0, 1.0)], "axes": None}),
        "inerter": (hd.inerter, {"b": 1.0, "axes": None}),
        "hydromount": (hd.hydromount, {"m": 20.0}),
        "hydromount_part": (hd.hydromount_part, {"K_r": 1e5, "C_h": 100.0}),
        "hydraulic_mount": (
            hd.hydraulic_mount,
            {
                "k_r": 1e3,
                "c_r": 0.0,
                "A": 2.0,
                "I": 1.0,
                "R": 1.0,
                "C1": 0.001,
                "C2": 0.003,
                "decoupler": None,
                "axes": None,
                "fluid_axis": None,
            },
        ),
        "load_model": (hd.load_model, {"path": folder / "two.npz"}),
        "inspect_files": (hd.inspect_files, {"path": folder / "two.npz"}),
        "load_response": (hd.load_response, {"path": folder / "r.csv"}),
        "load_system": (hd.load_system, {"path": folder / "s.npz"}),
        "save_model": (hd.save_model, {"model": two, "path": folder / "two.npz"}),
        "save_system": (hd.save_system, {"sys": system, "path": folder / "s.npz"}),
        "save_response": (hd.save_response, {"data": frequency, "path": folder / "r.csv"}),
        "fit_prony": (hd.fit_prony, {"frequency": MEASURED[0], "stiffness": MEASURED[1]}),
        "sweep": (
            hd.sweep,
            {
                "function": hd.hydromount,
                "parameters": {"m": [20.0]},
                "omega": omega,
                "inputs": "F_y",
                "outputs": "y",
                "compute": None,
            },
        ),
        "bode_plot": (
            hd.bode_plot,
            {
                "sysdata": mount,
                "omega": omega,
                "reference": None,
                "title": None,
                "label": None,
                "units": None,
                "ax": None,
            },
        ),
        "step_plot": (
            hd.step_plot,
            {"sysdata": mount, "timepts": [0.0, 0.1], "title": None, "label": None, "units": None, "ax": None},
        ),
        "pole_map_plot": (
            hd.pole_map_plot,
            {"sysdata": mount, "feedback": feedback, "title": None, "label": None, "ax": None},
        ),
        "prony_plot": (hd.prony_plot, {"fit": fit, "title": None, "unit": "N/m", "ax": None}),
        "sweep_plot": (
            hd.sweep_plot,
            {"result": swept, "kind": None, "parameter": None, "at": None, "title": None, "units": None},
        ),
        "dynamic_stiffness_plot": (hd.dynamic_stiffness_plot, {"sysdata": two, "dof": "a", "omega": omega}),
        "transmissibility_plot": (hd.transmissibility_plot, {"sysdata": two, "from_": "a", "to": "b", "omega": omega}),
        "write_report": (hd.write_report, {"model": None, "folder": folder / "report"}),
        "recover of a nonlinear model": (
            soft.recover,
            {"response": control.step_response(hd.mech2ss(hd.hydromount()))},
        ),
        "tangent": (soft.tangent, {"state": None, "inputs": None}),
        "equilibrium": (soft.equilibrium, {"inputs": None}),
        "state of a nonlinear model": (soft.state, {"initial": None, "inputs": None}),
        "without": (two.without, {"dofs": "a"}),
        "without of a nonlinear model": (soft.without, {"dofs": "y1"}),
        "table": (hd.laws.table, {"x": [0.0, 1.0], "f": [0.0, 1.0], "extend": None}),
        "slope of a table": (hd.laws.table([0.0, 1.0], [0.0, 1.0]).slope, {"x": 0.5}),
        "cubic": (hd.laws.cubic, {"k3": 1.0, "k1": 0.0}),
        "motion": (reduction.motion, {"derivative": 0}),
        "select": (two.select, {"inputs": "F_a", "outputs": "b"}),
        "prescribe_motion": (
            two.prescribe_motion,
            {"dof": "a", "kind": "displacement", "inputs": None, "outputs": None},
        ),
        "transfer function of a model": (two, {"s": 1j, "squeeze": None}),
    }


#: names of the entries of `doors`, known before a folder is
DOORS = (
    "mechss",
    "mech2ss",
    "mech2ss of matrices",
    "exact_reduction",
    "recover",
    "state",
    "pencil_structure",
    "zeros",
    "truncate_modes",
    "crosscheck",
    "descriptor_response",
    "frequency_response",
    "dss",
    "dss2ss",
    "lqr",
    "lqr of matrices",
    "port_hamiltonian",
    "with_modal_damping",
    "with_maxwell_damping",
    "state_map",
    "state_map.state",
    "forced_response",
    "initial_response",
    "step_response",
    "dynamic_stiffness",
    "dynamic_stiffness_response",
    "transmissibility",
    "transmissibility_response",
    "assemble",
    "nlmechss",
    "mech2nlsys",
    "nonlinear_response",
    "Spring",
    "Damper",
    "Force",
    "Law",
    "Rigid",
    "Joint",
    "Decoupler",
    "point_mass",
    "rigid_body",
    "kelvin_voigt",
    "maxwell",
    "zener",
    "generalized_maxwell",
    "inerter",
    "hydromount",
    "hydromount_part",
    "hydraulic_mount",
    "load_model",
    "inspect_files",
    "load_response",
    "load_system",
    "save_model",
    "save_system",
    "save_response",
    "fit_prony",
    "sweep",
    "bode_plot",
    "step_plot",
    "pole_map_plot",
    "prony_plot",
    "sweep_plot",
    "dynamic_stiffness_plot",
    "transmissibility_plot",
    "write_report",
    "recover of a nonlinear model",
    "tangent",
    "equilibrium",
    "state of a nonlinear model",
    "without",
    "without of a nonlinear model",
    "table",
    "slope of a table",
    "cubic",
    "motion",
    "select",
    "prescribe_motion",
    "transfer function of a model",
)
