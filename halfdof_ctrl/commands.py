"""What each subcommand of `halfdof-ctrl` does; `cli` has the parser and the exit codes."""

import argparse
import functools
import inspect
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias, TypedDict

import numpy as np

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY
from halfdof_ctrl.base.errors import (
    FileFormatError,
    HalfdofError,
    LostStateWarning,
    ParameterError,
    SelectedSignalsWarning,
    give_warning,
    recording_warnings,
)
from halfdof_ctrl.base.names import force_names, listed, motions
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.design.lqr import StateFeedback, lqr
from halfdof_ctrl.files.containers import MATRIX_ENDINGS
from halfdof_ctrl.files.folders import several_models
from halfdof_ctrl.files.formats.raw_matrix import Triangle
from halfdof_ctrl.files.models import inspect_files, load_model
from halfdof_ctrl.files.systems import save_system
from halfdof_ctrl.files.tables import GAIN_ENDINGS, TABLE_ENDINGS, save_gain, save_response
from halfdof_ctrl.files.writing import replacing
from halfdof_ctrl.model.kinds import null_column_kinds
from halfdof_ctrl.model.law_text import element_from_text
from halfdof_ctrl.model.nonlinear import NonlinearModel, nlmechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.response import nonlinear_response
from halfdof_ctrl.option_texts import assignments, chosen_frequencies, listed_names, require_ending, require_finite
from halfdof_ctrl.parts.mounts import hydromount
from halfdof_ctrl.plots import bode_plot, dynamic_stiffness_plot, pole_map_plot, step_plot, transmissibility_plot
from halfdof_ctrl.plots.figure_files import save_figure
from halfdof_ctrl.plots.step import MOST_RECOVERED
from halfdof_ctrl.plots.stiffness import Scale
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.report import check_as_json, default_design, write_report
from halfdof_ctrl.systems.crosscheck import crosscheck
from halfdof_ctrl.systems.eigenvalue_table import eigenvalue_table
from halfdof_ctrl.systems.frequency import (
    DEFAULT_POINTS,
    FEW_POINTS,
    frequency_response,
    has_many_states,
    model_frequencies,
)
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.state_space import mech2ss, system_of_model
from halfdof_ctrl.systems.step_times import relevant_poles, step_times
from halfdof_ctrl.systems.stiffness import (
    TransmissibilityKind,
    dynamic_stiffness_response,
    motion_frequencies,
    transmissibility_response,
)
from halfdof_ctrl.systems.time_response import step_response
from halfdof_ctrl.systems.working_states import working_matrix, working_system

DONE, CHECK_FAILED, EXIT_REFUSED = 0, 1, 2
_Signals: TypeAlias = tuple[tuple[str, ...], tuple[str, ...]]
BUILT_IN_MODELS = {"hydromount": hydromount}
BUILT_IN_SIGNALS: dict[str, _Signals] = {
    "hydromount": (("F_y",), ("y", "y_dot"))
}  #: what is shown unless the user asks for others
BUILT_IN_ALONE = {"hydromount": {"m": 0.0}}  #: parameters of the part without what it carries, whose stiffness is meant
BUILT_IN_DOF = {"hydromount": "y"}  #: whose dynamic stiffness is meant
SURE = 10.0  #: bounds by which the real part of a pole exceeds zero where it is called unstable
CHOSEN_SIGNALS = 3  #: inputs, and outputs, of a large model for which none are given
LARGEST_PRINTED = 500  #: DOFs up to which `info` takes the time for QZ
FIGURE_ENDINGS = (".png", ".svg", ".pdf")
WEIGHT_KINDS = ("displacement", "velocity", "acceleration", "effort")


def run_report(arguments: argparse.Namespace) -> int:
    """Write the folder of a report."""
    report = write_report(_model(arguments), arguments.o)
    print(report.eigenvalues)
    print(report.check)
    for note in report.notes:
        print(note)
    print(f"report: {arguments.o}{os.sep}index.html")
    return DONE if report.passed else CHECK_FAILED


def run_info(arguments: argparse.Namespace) -> int:
    """Print what a model is."""
    if arguments.model not in BUILT_IN_MODELS and (several := several_models(Path(arguments.model))):
        print(several, flush=True)
        return DONE
    if arguments.model not in BUILT_IN_MODELS and Path(arguments.model).exists() and not arguments.p:
        print(inspect_files(arguments.model, **_file_options(arguments)), flush=True)
    given = _given_model(arguments)
    if isinstance(given, NonlinearModel):
        print(given)
        return DONE
    model = given
    print(model)
    if len(model.dofs) > LARGEST_PRINTED:
        if not model.is_sparse:
            print(f"Pencil and reduction: not shown above {LARGEST_PRINTED} DOFs.")
            return DONE
        print(f"Pencil: not shown above {LARGEST_PRINTED} DOFs.")
        model = model.select(model.inputs[0], model.outputs[0])  # others change nothing in what is printed
    else:
        structure = pencil_structure(model)
        kind = "regular" if structure.is_regular else "SINGULAR"
        finite, infinite = structure.finite_eigenvalues.size, structure.n_infinite
        print(f"Pencil: {kind}, {finite} finite and {infinite} infinite eigenvalues, index {structure.index}")
    try:
        reduction = exact_reduction(model)
        print(reduction)
        print(_unstable_in_words(model, reduction.order), end="")
    except HalfdofError as refusal:
        print(f"No state space: {refusal}")
    return DONE


def _unstable_in_words(model: SecondOrderModel, order: int) -> str:
    """Say which poles are right of the imaginary axis by more than rounding; nothing where none is."""
    if order > LARGEST_PRINTED:
        return f"Stability: not looked at above {LARGEST_PRINTED} states.\n"
    poles = bounded_poles(working_matrix(model))
    unstable = poles.values[poles.values.real > SURE * poles.bounds]
    if not unstable.size:
        return ""
    fastest = complex_in_words(complex(unstable[np.argmax(unstable.real)]))
    return f"Unstable: {unstable.size} of {order} poles are right of the imaginary axis, the fastest {fastest} rad/s\n"


def run_ss(arguments: argparse.Namespace) -> int:
    """Write or print the state space."""
    require_ending(arguments.o, MATRIX_ENDINGS)
    system = mech2ss(_model(arguments), states=arguments.states)
    if arguments.o is None:
        print(system)
    else:
        save_system(system, arguments.o)
    return DONE


def run_bode(arguments: argparse.Namespace) -> int:
    """Draw or tabulate the frequency response."""
    kind = require_ending(arguments.o, (*FIGURE_ENDINGS, *TABLE_ENDINGS))
    model = _model(arguments)
    usual = FEW_POINTS if has_many_states(model) else DEFAULT_POINTS
    omega = chosen_frequencies(lambda: model_frequencies(model), arguments, usual=usual)
    if kind in TABLE_ENDINGS:
        save_response(frequency_response(model, omega), arguments.o)
    else:
        save_figure(bode_plot(model, omega, dB=arguments.db, Hz=arguments.hz, title=model.name), arguments.o)
    return DONE


def run_stiffness(arguments: argparse.Namespace) -> int:
    """Draw or tabulate the dynamic stiffness; a built-in model is a mount, and stands without what it carries."""
    arguments.alone = True
    kind = require_ending(arguments.o, (*FIGURE_ENDINGS, *TABLE_ENDINGS))
    model = _model(arguments)
    dof = _driven(model, arguments)
    grid = functools.partial(motion_frequencies, [model], dof, free=True, linear=not arguments.log)
    omega = chosen_frequencies(grid, arguments, linear=not arguments.log)
    if kind in TABLE_ENDINGS:
        save_response(dynamic_stiffness_response(model, dof, grid() if omega is None else omega), arguments.o)
    else:
        scale: Scale = "log" if arguments.log else "linear"
        plot = dynamic_stiffness_plot(
            model, dof, omega, xscale="log" if arguments.log else None, yscale=scale, dB=arguments.db
        )
        save_figure(plot, arguments.o)
    return DONE


def run_transmissibility(arguments: argparse.Namespace) -> int:
    """Draw or tabulate the transmissibility between two DOFs."""
    kind = require_ending(arguments.o, (*FIGURE_ENDINGS, *TABLE_ENDINGS))
    model = _model(arguments)
    from_, to = listed_names(arguments.from_, ()), listed_names(arguments.to, ())
    what: TransmissibilityKind = "force" if arguments.force else "motion"
    held, other = (from_, to) if what == "motion" else (to, from_)
    grid = functools.partial(motion_frequencies, [model], held, other=other, linear=arguments.linear)
    omega = chosen_frequencies(grid, arguments, linear=arguments.linear)
    if kind in TABLE_ENDINGS:
        points = grid() if omega is None else omega
        save_response(transmissibility_response(model, from_, to, points, kind=what), arguments.o)
    else:
        scale: Scale = "linear" if arguments.linear else "log"
        save_figure(
            transmissibility_plot(model, from_, to, omega, kind=what, xscale=scale, yscale=scale, dB=arguments.db),
            arguments.o,
        )
    return DONE


def run_step(arguments: argparse.Namespace) -> int:
    """Draw or tabulate the step response."""
    kind = require_ending(arguments.o, (*FIGURE_ENDINGS, *TABLE_ENDINGS))
    given = _given_model(arguments)
    if isinstance(given, NonlinearModel):
        return _nonlinear_step(given, arguments, kind)
    if arguments.amplitude is not None:
        msg = "--amplitude is about nonlinear models; of this one, multiply the response to a unit step by it."
        raise ParameterError(msg, parameter="--amplitude", value=arguments.amplitude)
    model = _with_few_signals(given, arguments)
    if kind in TABLE_ENDINGS:
        with np.errstate(over="ignore", invalid="ignore"):  # which is refused below
            response = step_response(_with_recovered(model), arguments.time)
        require_finite(response.t, response.y)
        save_response(response, arguments.o)
    else:
        with np.errstate(over="ignore", invalid="ignore"):
            plot = step_plot(model, arguments.time, title=model.name)
        for line in [line for axes in plot.axes.flat for line in axes.get_lines()]:
            require_finite(line.get_xdata(), line.get_ydata())
        save_figure(plot, arguments.o)
    return DONE


def run_poles(arguments: argparse.Namespace) -> int:
    """Print the eigenvalues of both forms, or draw them."""
    require_ending(arguments.o, FIGURE_ENDINGS)
    model = _model(arguments)
    table = eigenvalue_table(model, working_system(model))
    if arguments.o is not None:
        save_figure(pole_map_plot(model, title=model.name), arguments.o)
    print(table)
    return DONE


def run_lqr(arguments: argparse.Namespace) -> int:
    """Design a state feedback, print it or write it."""
    kind = require_ending(arguments.o, (*FIGURE_ENDINGS, *GAIN_ENDINGS))
    model = _model(arguments)
    feedback, words = _feedback(model, arguments)
    if kind in FIGURE_ENDINGS:
        save_figure(pole_map_plot(model, feedback=feedback, title=model.name), arguments.o)
    elif kind is not None:
        save_gain(feedback, arguments.o)
    if words:
        print(words)
    print(feedback)
    return DONE


def run_check(arguments: argparse.Namespace) -> int:
    """Run the cross-check; exit code 1 where it fails."""
    require_ending(arguments.o, (".json",))
    model = _model(arguments)
    check = crosscheck(model, system_of_model(model))
    if arguments.o is not None:
        with replacing(arguments.o) as stream:
            stream.write(check_as_json(check))
    print(check)
    return DONE if check.passed else CHECK_FAILED


def _nonlinear_step(model: NonlinearModel, arguments: argparse.Namespace, kind: str | None) -> int:
    """Tabulate the response to a step of one input: there is no superposition of several."""
    if kind not in TABLE_ENDINGS:
        msg = "The step response of a nonlinear model is written as numbers: give -o FILE.csv."
        raise ParameterError(msg, parameter="-o", value=arguments.o)
    if len(model.inputs) != 1:
        msg = f"A nonlinear model takes a step of one input; choose it by --inputs: {listed(model.inputs)}."
        raise ParameterError(msg, parameter="--inputs", value=model.inputs)
    with recording_warnings() as caught:
        system = system_of_model(model.tangent())
    for message, category in caught:
        if category is not LostStateWarning:  # of the tangent that only says how long to look
            give_warning(message, category)
    times = step_times(relevant_poles(system.A, system.B, system.C, system.D), arguments.time)
    amplitude = 1.0 if arguments.amplitude is None else arguments.amplitude
    save_response(nonlinear_response(model, times, amplitude), arguments.o)
    return DONE


def _model(arguments: argparse.Namespace) -> SecondOrderModel:
    """Return the model of a command that works on linear ones: of a nonlinear one, the tangent at rest."""
    model = _given_model(arguments)
    return _with_few_signals(model.tangent() if isinstance(model, NonlinearModel) else model, arguments)


def _with_few_signals(model: SecondOrderModel, arguments: argparse.Namespace) -> SecondOrderModel:
    """Choose signals of a large sparse model that has one for each DOF, of which nobody said which ones matter."""
    inputs, outputs = model.inputs, model.outputs
    if not model.is_sparse or max(len(inputs), len(outputs)) <= LARGEST_DENSE_COPY:
        return model
    heavy, _ = null_column_kinds(model.M, model.C)
    dofs = [model.dofs[k] for k in np.flatnonzero(heavy).tolist()]
    chosen: dict[str, list[str]] = {}
    for kind, names, wanted in (("inputs", inputs, force_names(tuple(dofs))), ("outputs", outputs, tuple(dofs))):
        if len(names) > LARGEST_DENSE_COPY and getattr(arguments, kind) is None:
            known = set(names)
            chosen[kind] = [name for name in wanted if name in known][:CHOSEN_SIGNALS] or list(names[:CHOSEN_SIGNALS])
    if chosen:
        words = " and ".join(f"the {kind} {', '.join(names)}" for kind, names in chosen.items())
        msg = (
            f"The model has {len(inputs)} inputs and {len(outputs)} outputs, too many for this command, which takes "
            f"{words}. Choose others by {' and '.join(f'--{kind}' for kind in chosen)}."
        )
        give_warning(msg, SelectedSignalsWarning)
    return model.select(chosen.get("inputs"), chosen.get("outputs"))


def _given_model(arguments: argparse.Namespace) -> SecondOrderModel | NonlinearModel:
    """Make the built-in model or load the file, add elements, and select its signals."""
    name: str = arguments.model
    signals: _Signals | None = None
    model: SecondOrderModel | NonlinearModel
    if name in BUILT_IN_MODELS:
        if arguments.matrix or arguments.triangle or arguments.remove_fixed:
            msg = f"--matrix, --triangle and --remove-fixed are about files; {name} is built in."
            raise ParameterError(msg, parameter="--matrix", value=arguments.matrix)
        signals = BUILT_IN_SIGNALS[name]
        alone = BUILT_IN_ALONE[name] if arguments.alone else {}
        model = BUILT_IN_MODELS[name](**(alone | _parameters(name, arguments.p)))
    else:
        if arguments.p:
            msg = f"-p changes parameters of built-in models ({', '.join(BUILT_IN_MODELS)}); {name} is a file."
            raise ParameterError(msg, parameter="-p", value=arguments.p)
        if not Path(name).exists() and Path(name).suffix.lower() not in MATRIX_ENDINGS:
            msg = f"{name}: neither a file nor a built-in model. Built in: {', '.join(BUILT_IN_MODELS)}."
            raise FileFormatError(msg, path=name)
        model = load_model(name, **_file_options(arguments))
    elements = [element_from_text(text) for text in arguments.element]
    if elements:
        known = model.elements if isinstance(model, NonlinearModel) else ()
        model = nlmechss(model.linear if isinstance(model, NonlinearModel) else model, [*known, *elements])
    inputs, outputs = signals or (None, None)
    return model.select(listed_names(arguments.inputs, inputs), listed_names(arguments.outputs, outputs))


class _FileOptions(TypedDict):
    triangle: Triangle | None
    remove_fixed: bool
    matrices: dict[str, str | None] | None


def _file_options(arguments: argparse.Namespace) -> _FileOptions:
    """Read what `load_model` is to be told about files."""
    matrices: dict[str, str | None] = {}
    for text in arguments.matrix:
        letter, sign, name = text.partition("=")
        if not (letter and sign):
            msg = f"--matrix takes a letter and a name, K=NAME, not {text!r}."
            raise ParameterError(msg, parameter="--matrix", value=text)
        matrices[letter] = name or None
    return {"triangle": arguments.triangle, "remove_fixed": arguments.remove_fixed, "matrices": matrices or None}


def _driven(model: SecondOrderModel, arguments: argparse.Namespace) -> list[str]:
    """Return the DOFs that are moved: those asked for, that of the built-in model, or the only one."""
    default = BUILT_IN_DOF.get(arguments.model, model.dofs[0] if len(model.dofs) == 1 else None)
    if arguments.dof is None and default is None:
        msg = f"--dof must name the DOF whose dynamic stiffness is meant: {listed(model.dofs)}."
        raise ParameterError(msg, parameter="--dof", value=None)
    return listed_names(arguments.dof, [str(default)])


def _parameters(name: str, given: Sequence[str]) -> dict[str, float]:
    known = list(inspect.signature(BUILT_IN_MODELS[name]).parameters)
    parameters = assignments(given, "-p")
    for symbol in parameters:
        if symbol not in known:
            msg = f"{name} has no parameter {symbol!r}. Known: {', '.join(known)}."
            raise ParameterError(msg, parameter=symbol, value=parameters[symbol])
    return parameters


def _with_recovered(model: SecondOrderModel) -> SecondOrderModel:
    """Add the displacements of DOFs without inertia to the outputs, as the figure shows them."""
    if model.is_sparse and len(model.dofs) > MOST_RECOVERED:
        return model
    part = exact_reduction(model).partition
    known = motions(model.dofs)
    extra = [name for name in (*part.half, *part.static) if name in known and name not in model.outputs]
    return model.select(outputs=[*model.outputs, *extra])


def _feedback(model: SecondOrderModel, arguments: argparse.Namespace) -> tuple[StateFeedback, str]:
    weights = {
        kind: assignments(listed_names(getattr(arguments, kind), ()), f"--{kind}") or None for kind in WEIGHT_KINDS
    }
    if arguments.energy is None and not any(weights.values()):
        return default_design(model)
    return lqr(
        model,
        displacement=weights["displacement"],
        velocity=weights["velocity"],
        acceleration=weights["acceleration"],
        effort=weights["effort"],
        energy=arguments.energy,
    ), ""
