"""The command `halfdof-ctrl`.

Exit codes: 0 done, 1 the cross-check failed, 2 the request or the model is refused (one line on stderr,
nothing written).
"""

import argparse
import functools
import importlib.metadata
import inspect
import io
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

from halfdof_ctrl.base.command_start import PROGRAM
from halfdof_ctrl.base.errors import HalfdofError, HalfdofWarning, InterruptedResponseWarning, own_messages
from halfdof_ctrl.base.printable import printable
from halfdof_ctrl.base.progress import activity, clear_activity, end_activity
from halfdof_ctrl.commands import (
    BUILT_IN_MODELS,
    DONE,
    EXIT_REFUSED,
    WEIGHT_KINDS,
    run_bode,
    run_check,
    run_info,
    run_lqr,
    run_poles,
    run_report,
    run_ss,
    run_step,
    run_stiffness,
    run_transmissibility,
)
from halfdof_ctrl.plots.figure_files import without_windows
from halfdof_ctrl.systems.frequency import DEFAULT_POINTS
from halfdof_ctrl.systems.state_map import STATE_KINDS
from halfdof_ctrl.terminal import TerminatedError, asked_output_only, orderly_end

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

EXAMPLES = {
    "report": "hydromount -o report",
    "info": "hydromount -p C_h=450",
    "ss": "hydromount -o mount.mat",
    "bode": "hydromount --f-min 0.1 --f-max 20 --hz -o bode.png",
    "step": "hydromount --time 5 -o step.csv",
    "poles": "hydromount -o poles.svg",
    "stiffness": "hydromount --f-max 30 -o stiffness.png",
    "transmissibility": "hydromount --from y --to y2 -o transmissibility.png",
    "lqr": "hydromount --displacement y=1e6 --effort F_y=1e-4",
    "check": "hydromount -o check.json",
}
INTERRUPTED, BROKEN_PIPE, TERMINATED = 130, 141, 143  #: as shells report the signals SIGINT, SIGPIPE and SIGTERM


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with its arguments, by default those of the process, and give its exit code."""
    end_activity()  # of the imports
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal cannot show is no reason to stop
            stream.reconfigure(errors="backslashreplace")
    try:
        with orderly_end(), asked_output_only(), _warnings_on_stderr() as caught:
            arguments = _parsed(sys.argv[1:] if argv is None else argv)
            command: Callable[[argparse.Namespace], int] = arguments.command
            without_windows()
            with activity(f"{PROGRAM} {getattr(arguments, 'name', '')}".strip()):
                code = command(arguments)
            sys.stdout.flush()
        if any(issubclass(warning.category, InterruptedResponseWarning) for warning in caught):
            code = INTERRUPTED  # what was done is written
    except BrokenPipeError:  # who reads our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # so that Python's own flush at exit does not complain
        return BROKEN_PIPE
    except KeyboardInterrupt:
        return INTERRUPTED
    except TerminatedError:
        return TERMINATED
    except HalfdofError as refusal:
        _say("error", str(refusal))
        return EXIT_REFUSED
    except OSError as refusal:
        _say("error", f"{refusal.filename or 'file'}: {refusal.strerror or refusal}")
        return EXIT_REFUSED
    return code


@contextmanager
def _warnings_on_stderr() -> Iterator[list[warnings.WarningMessage]]:
    """Show each of the package's warnings once, as a line."""
    with warnings.catch_warnings(record=True) as caught:  # the process is the command's own
        warnings.filterwarnings("always", category=HalfdofWarning)
        try:
            yield caught
        finally:
            for message in own_messages(caught):
                _say("warning", message)


def _say(kind: str, text: str) -> None:
    if sys.stderr is not None:
        clear_activity()
        print(f"{PROGRAM}: {kind}: {printable(' '.join(text.split()))}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    """A parser that says in one line what is wrong."""

    def error(self, message: str) -> NoReturn:
        """Print one line, whatever the arguments contain, and end."""
        _say("error", f"{message}. usage: {self.prog} --help lists what can be given.")
        raise SystemExit(EXIT_REFUSED)

    def _print_message(self, message: str, file: "SupportsWrite[str] | None" = None) -> None:
        """Print help; what cannot be printed is an error, which argparse keeps to itself."""
        stream = sys.stderr if file is None else file
        if message and stream is not None:
            stream.write(message)
            sys.stdout.flush()


class _Once(argparse.Action):
    """Store a value, and refuse a second one instead of forgetting the first."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        """Store the value."""
        given: set[str] = vars(namespace).setdefault("_given", set())
        if self.dest in given:
            parser.error(f"{option_string} is given twice")
        given.add(self.dest)
        setattr(namespace, self.dest, values)


def _parsed(given: Sequence[str]) -> argparse.Namespace:
    """Read the arguments; ``--option=--`` is refused, of which argparse makes a list without entries."""
    parser = _parser()
    for text in given:
        if text.startswith("-") and text.endswith("=--"):
            parser.error(f"argument {text[:-3]}: expected one argument, not --")
    return parser.parse_args(given)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=PROGRAM,
        description="Exact state space of mechanical models M, C, K with singular mass.",
        epilog="Exit codes: 0 done, 1 the cross-check failed, 2 the request or the model is refused.",
        allow_abbrev=False,
    )
    version = importlib.metadata.version("halfdof_ctrl")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {version}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    parser.set_defaults(command=functools.partial(_print_help, parser))
    add = functools.partial(_add_command, commands)
    add(
        "report",
        run_report,
        "write a page, figures, the state space and the check into a folder",
        "FOLDER",
        needed=True,
    )
    add("info", run_info, "print what is in the files, the model, its pencil and its reduction", None)
    ss = add("ss", run_ss, "print the state space, or write it (npz, mat)", "FILE")
    ss.add_argument(
        "--states", action=_Once, choices=STATE_KINDS, default="dofs", help="what the states are (default: dofs)"
    )
    bode = add("bode", run_bode, "write the Bode diagram (png, svg, pdf) or its numbers (csv)", "FILE", needed=True)
    _add_frequencies(bode)
    bode.add_argument("--hz", action="store_true", help="frequency axis of the figure in Hz")
    bode.add_argument("--db", action="store_true", help="magnitude axes of the figure in dB")
    step = add("step", run_step, "write the step response (png, svg, pdf) or its numbers (csv)", "FILE", needed=True)
    step.add_argument(
        "--amplitude", action=_Once, type=float, metavar="A", help="of the step, of a nonlinear model (default: 1)"
    )
    step.add_argument(
        "--time", action=_Once, type=float, metavar="T", help="last time [s] (default: until the modes settle)"
    )
    add("poles", run_poles, "print eigenvalues before and after, and draw the pole map (png, svg, pdf)", "FILE")
    what = "write the dynamic stiffness at a DOF and its loss angle over Hz (png, svg, pdf), or the numbers (csv)"
    stiffness = add("stiffness", run_stiffness, what, "FILE", needed=True, signals=False)
    stiffness.add_argument("--dof", action="append", metavar="A,B", help="DOF that is moved; several move together")
    _add_frequencies(stiffness)
    stiffness.add_argument("--db", action="store_true", help="modulus of the figure in dB re 1 N/m")
    stiffness.add_argument("--log", action="store_true", help="logarithmic axes and frequencies instead of linear ones")
    what = "write the motion of a DOF per motion of another over Hz (png, svg, pdf), or the numbers (csv)"
    passed = add("transmissibility", run_transmissibility, what, "FILE", needed=True, signals=False)
    passed.add_argument(
        "--from", dest="from_", action="append", required=True, metavar="A,B", help="DOF that is moved or pushed"
    )
    passed.add_argument("--to", action="append", required=True, metavar="A,B", help="DOF whose motion or force it is")
    passed.add_argument("--force", action="store_true", help="force on the held DOF per force, instead of motions")
    _add_frequencies(passed)
    passed.add_argument("--db", action="store_true", help="modulus of the figure in dB")
    passed.add_argument("--linear", action="store_true", help="linear axes and frequencies instead of logarithmic ones")
    regulator = add("lqr", run_lqr, "print a linear quadratic regulator; write its gain or pole map", "FILE")
    for kind in WEIGHT_KINDS:
        regulator.add_argument(f"--{kind}", action="append", default=[], metavar="NAME=W", help=f"weight of {kind}^2")
    regulator.add_argument(
        "--energy", action=_Once, type=float, metavar="W", help="weight of the mechanical energy [1/J]"
    )
    add("check", run_check, "check the state space against the descriptor form; write the figures (json)", "FILE")
    return parser


def _print_help(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> int:  # noqa: ARG001  # as commands
    parser.print_help()
    return DONE


def _known_parameters() -> str:
    known = (f"of {name}: {', '.join(inspect.signature(make).parameters)}" for name, make in BUILT_IN_MODELS.items())
    return f"parameter of a built-in model; {'; '.join(known)}"


def _add_frequencies(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--omega-min", action=_Once, type=float, metavar="W", help="lowest frequency [rad/s]")
    parser.add_argument("--omega-max", action=_Once, type=float, metavar="W", help="highest frequency [rad/s]")
    parser.add_argument("--f-min", action=_Once, type=float, metavar="F", help="lowest frequency [Hz]")
    parser.add_argument("--f-max", action=_Once, type=float, metavar="F", help="highest frequency [Hz]")
    parser.add_argument(
        "--points", action=_Once, type=int, metavar="N", help=f"number of frequencies (default {DEFAULT_POINTS})"
    )


def _add_command(
    commands: "argparse._SubParsersAction[_Parser]",
    name: str,
    command: Callable[[argparse.Namespace], int],
    purpose: str,
    target: str | None,
    *,
    needed: bool = False,
    signals: bool = True,
) -> argparse.ArgumentParser:
    parser = commands.add_parser(
        name,
        help=purpose,
        description=f"{purpose[0].upper()}{purpose[1:]}.",
        epilog=f"Example: {PROGRAM} {name} {EXAMPLES[name]}",
        allow_abbrev=False,
    )
    parser.set_defaults(command=command, name=name, alone=False)
    parser.add_argument(
        "model",
        metavar="MODEL",
        help=f"a file, a folder with exported matrices, or a built-in model: {', '.join(BUILT_IN_MODELS)}",
    )
    parser.add_argument("-p", action="append", default=[], metavar="NAME=VALUE", help=_known_parameters())
    what = "name of a matrix in a file with several: C=D, K=sys.K, M=maa#2; C= for none"
    parser.add_argument("--matrix", action="append", default=[], metavar="K=NAME", help=what)
    parser.add_argument(
        "--triangle", action=_Once, choices=("lower", "upper"), help="files store this triangle of symmetric matrices"
    )
    parser.add_argument("--remove-fixed", action="store_true", help="take out DOFs whose stiffness is 1e35 or more")
    parser.add_argument(
        "--element",
        action="append",
        default=[],
        metavar="'KIND A [B] LAW'",
        help="spring or damper to add, as 'damper y2 quadratic(1e4,30)'; linear commands take the tangent at rest",
    )
    parser.set_defaults(inputs=None, outputs=None)
    if signals:
        parser.add_argument("--inputs", action="append", metavar="A,B", help="inputs, as F_y")
        parser.add_argument("--outputs", action="append", metavar="A,B", help="outputs, as y, y_dot, y_ddot")
    if target is not None:
        where = f"where to write; the ending of the {target.lower()} is its format" if target == "FILE" else "where"
        parser.add_argument("-o", action=_Once, metavar=target, required=needed, help=where)
    return parser
