"""Everything for one model, in a folder: a page to read, the figures, the state space, the check.

The page `index.html` needs nothing else: its style and its figures stand in it. The folder is built under a
temporary name and moved into place.
"""

import json
import math
import secrets
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import control
import numpy as np

from halfdof_ctrl.base.doors import require_path
from halfdof_ctrl.base.errors import (
    FileFormatError,
    HalfdofError,
    WeightError,
    give_warning,
    own_messages,
    recording_warnings,
)
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.design.lqr import StateFeedback, lqr
from halfdof_ctrl.files.containers import PathLike
from halfdof_ctrl.files.systems import save_system
from halfdof_ctrl.files.writing import naming_target
from halfdof_ctrl.model.dense_copy import dense_copy
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.page import PAGE_MARK, Findings, PageFigure, page
from halfdof_ctrl.plots import bode_plot, pole_map_plot, step_plot
from halfdof_ctrl.plots.figure_files import close_figure, save_figure
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.systems.check_result import CrossCheck
from halfdof_ctrl.systems.crosscheck import crosscheck
from halfdof_ctrl.systems.eigenvalue_table import EigenvalueTable, eigenvalue_table
from halfdof_ctrl.systems.frequency import descriptor_modes
from halfdof_ctrl.systems.state_space import mech2ss
from halfdof_ctrl.systems.working_states import working_system

COLUMN_WIDTH = 5.0  #: [in] of a figure with one column on the page, so that its text can be read on a phone
SHOWN_OUTPUTS, SHOWN_INPUTS = 3, 2  #: what a Bode diagram on a phone can hold
INDEX = "index.html"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Report:
    """What `write_report` wrote, and what it found."""

    folder: Path
    eigenvalues: EigenvalueTable  #: printing it gives the table "before and after"
    check: CrossCheck
    feedback: StateFeedback | None  #: the regulator, if there is one
    notes: tuple[str, ...]  #: warnings, what the figures leave out, and why there is no regulator

    @property
    def passed(self) -> bool:
        """Whether the state space agrees with the descriptor form."""
        return self.check.passed


def write_report(model: SecondOrderModel, folder: PathLike) -> Report:
    """Write a page, figures, the state space and the cross-check of a model into a folder.

    Parameters
    ----------
    model : SecondOrderModel
        All its inputs and outputs are reported; Bode diagram and step response show the first two inputs and
        three outputs at most.
    folder : path-like
        Made if it is not there. In a folder with an earlier report the files of the report are replaced one by
        one and others are left alone.

    Returns
    -------
    Report

    Raises
    ------
    ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        The model has no state space; nothing is written.
    FileFormatError
        The folder is a file, or holds an ``index.html`` that is no report.
    OSError
        The folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as parent:
    ...     write_report(hydromount().select("F_y", "y"), f"{parent}/report").passed
    True
    """
    n = len(checked_model(model, "write_report").dofs)
    require_path(folder, "write_report", parameter="folder", kind="folder")
    model = dense_copy(model, "write_report", "Report a reduced model: write_report(truncate_modes(...), folder).")
    target = Path(folder).resolve()
    _require_own_folder(target, folder)
    with recording_warnings() as caught:
        findings = _found(model)
        shown, cut = _shown(model)
        if len(model.dofs) < n:
            cut.append(
                f"The model has {n} DOFs, of which {n - len(model.dofs)} static ones, that no input or output is "
                "about, were condensed before; that changes neither eigenvalues nor transfer function. Each stands for "
                "two infinite eigenvalues that are not counted here."
            )
        plots = _plots(model, shown, findings.feedback)
    for message, category in dict(caught).items():
        give_warning(message, category)
    findings.notes.extend([*own_messages(caught), *cut])
    build = target.with_name(f".{target.name[:100]}.{secrets.token_hex(4)}.part")
    try:
        with naming_target(folder):
            build.mkdir()
            _fill(build, findings, plots)
            _move(build, target)
    finally:
        shutil.rmtree(build, ignore_errors=True)
        for made in plots:
            close_figure(made.plot)
    notes = (*findings.notes, *([] if findings.feedback else [findings.regulator]))
    return Report(
        folder=target,
        eigenvalues=findings.eigenvalues,
        check=findings.check,
        feedback=findings.feedback,
        notes=notes,
    )


def default_effort(model: SecondOrderModel) -> dict[str, float]:
    """Choose a weight of each input's square so that it costs about the energy that it stores.

    That is ``|B(s)^T P(s)^-1 B(s)| / 2``, half the receptance in the input's own direction, where s is the geometric
    mean of the sizes of the finite eigenvalues that the inputs move (real, off all resonances): its unit makes the
    square of the input an energy, whatever the input is.

    Parameters
    ----------
    model : SecondOrderModel

    Returns
    -------
    dict from input to weight
        [J/N^2] for a force; to be used with ``energy=1``.

    Raises
    ------
    WeightError
        An input that moves nothing, so that there is no size to go by.

    Examples
    --------
    A spring of 4 N/m stores 1/8 J under 1 N:

    >>> default_effort(mechss([[0]], [[0]], [[4]]))
    {'F_q0': 0.125}
    """
    model = dense_copy(model, "default_effort", "Give the weights.")
    moving = np.abs(descriptor_modes(model.select(outputs=list(model.dofs)))[0].moving)
    s = float(np.exp(np.log(moving).mean())) if moving.size else 1.0
    motion = model.select(outputs=list(model.dofs))(s, squeeze=False)
    force = model.B + s * model.Bv + s**2 * model.Ba
    stored = np.abs(np.einsum("ij,ij->j", force, motion)) / 2.0
    idle = [name for name, value in zip(model.inputs, stored, strict=True) if not (np.isfinite(value) and value > 0.0)]
    if idle:
        msg = (
            f"There is no default effort for {listed(idle)}, which moves nothing at s = {s:.4g} rad/s. Give the "
            "weights, or leave the input out."
        )
        raise WeightError(msg, names=tuple(idle))
    return dict(zip(model.inputs, stored.tolist(), strict=True))


def default_design(model: SecondOrderModel) -> tuple[StateFeedback, str]:
    """Design the regulator with weight 1/J on the energy and `default_effort`; say in words what it minimizes.

    Raises
    ------
    WeightError
        No default effort, no energy, or no states to regulate.
    StabilizationError
        No stabilizing gain.
    """
    if pencil_structure(model).finite_eigenvalues.size == 0:
        msg = "The model has no states, only static DOFs: there is nothing to regulate."
        raise WeightError(msg, names=model.dofs)
    effort = default_effort(model)
    feedback = lqr(model, energy=1.0, effort=effort)
    efforts = ", ".join(f"{weight:.3g} {name}^2" for name, weight in effort.items())
    words = (
        "Feedback u = -K x that minimizes the integral of the mechanical energy [J] plus "
        f"{efforts}: each input costs about the energy that it stores."
    )
    return feedback, words


def check_as_json(check: CrossCheck) -> bytes:
    """Write the figures of a check as JSON; what is no finite number is null."""
    figures = {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in check.as_dict().items()
    }
    return (json.dumps(figures, indent=2, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _found(model: SecondOrderModel) -> Findings:
    reduction = exact_reduction(model)
    sys = mech2ss(reduction)
    check = crosscheck(model, sys)
    feedback: StateFeedback | None = None
    try:
        feedback, words = default_design(model)
    except HalfdofError as refusal:
        words = f"There is no default regulator for this model. {refusal}"
    return Findings(
        reduction=reduction,
        sys=sys,
        check=check,
        eigenvalues=eigenvalue_table(model, working_system(model)),
        feedback=feedback,
        regulator=words,
        notes=[],
    )


def _shown(model: SecondOrderModel) -> tuple[SecondOrderModel, list[str]]:
    """Leave in the figures what a reader can see."""
    inputs, outputs = model.inputs[:SHOWN_INPUTS], model.outputs[:SHOWN_OUTPUTS]
    if (inputs, outputs) == (model.inputs, model.outputs):
        return model, []
    note = (
        f"Bode diagram and step response show {listed(outputs)} from {listed(inputs)} only, of "
        f"{len(model.outputs)} outputs and {len(model.inputs)} inputs; select others to see them."
    )
    return model.select(inputs, outputs), [note]


@dataclass(frozen=True, slots=True, eq=False)
class _Plot:
    stem: str
    title: str
    description: str
    plot: control.ControlPlot


def _plots(model: SecondOrderModel, shown: SecondOrderModel, feedback: StateFeedback | None) -> list[_Plot]:
    title = model.name
    model, shown = replace(model, name=None), replace(shown, name=None)  # once in the title, not in each legend entry
    channels = f"{listed(shown.outputs)} from {listed(shown.inputs)}"
    closed = " and of the closed loop" if feedback is not None else ""
    return [
        _Plot(
            "bode",
            "Bode diagram",
            f"{channels}: lines are the state space, circles the descriptor form.",
            bode_plot(shown, title=title),
        ),
        _Plot(
            "step",
            "Step response",
            f"{channels}, with the recovered displacements of DOFs without inertia.",
            step_plot(shown, title=title),
        ),
        _Plot(
            "poles",
            "Pole map",
            f"Poles of the state space{closed} over the finite eigenvalues of the descriptor form.",
            pole_map_plot(model, feedback=feedback, title=title),
        ),
    ]


def _fill(folder: Path, findings: Findings, plots: list[_Plot]) -> None:
    figures = []
    for made in plots:
        if made.plot.axes.shape[1] == 1:
            made.plot.figure.set_figwidth(COLUMN_WIDTH)
        made.plot.figure.savefig(folder / f"{made.stem}.svg", metadata={"Date": None})
        made.plot.figure.set_layout_engine("none")  # it stays as it is, which takes half the time
        save_figure(made.plot, folder / f"{made.stem}.png")
        svg = (folder / f"{made.stem}.svg").read_bytes()
        columns = made.plot.axes.shape[1]
        figures.append(PageFigure(made.stem, made.title, made.description, svg, columns))
    for ending in (".npz", ".mat"):
        save_system(findings.sys, folder / f"statespace{ending}")
    (folder / "crosscheck.json").write_bytes(check_as_json(findings.check))
    files = sorted(file.name for file in folder.iterdir())
    (folder / INDEX).write_text(page(findings, figures, files), encoding="utf-8")


def _require_own_folder(target: Path, given: PathLike) -> None:
    index = target / INDEX
    foreign = index.exists() and not (index.is_file() and PAGE_MARK in index.read_text("utf-8", errors="replace"))
    if foreign or not target.name or (target.exists() and not target.is_dir()):
        msg = f"{given}: there is something of that name that is no report. Choose another folder."
        raise FileFormatError(msg, path=str(given))


def _move(build: Path, target: Path) -> None:
    """Move a folder to its name, or its files one by one into the one that is there, the page last."""
    if not target.exists():
        build.rename(target)
        return
    for file in sorted(build.iterdir(), key=lambda file: file.name == INDEX):
        file.replace(target / file.name)
