"""The page of a report: HTML with its style and figures inside, from the template report.html."""

import base64
import html
import importlib.metadata
import importlib.resources
import platform
import string
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import control
import numpy as np

from halfdof_ctrl.base.names import listed, name_from_label
from halfdof_ctrl.design.lqr import StateFeedback
from halfdof_ctrl.model.free_motions import free_motions_in_words
from halfdof_ctrl.model.second_order import SecondOrderModel, unusual_in_words
from halfdof_ctrl.parts.mounts import scheme_of
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.check_result import CrossCheck
from halfdof_ctrl.systems.eigenvalue_table import EigenvalueTable, eigenvalues_in_words

SHOWN_STATES = 12  #: larger matrices are in the files only
SHOWN_EIGENVALUES = 40
PAGE_MARK = "halfdof-ctrl"  #: stands in the page and tells it from others


@dataclass(frozen=True, slots=True)
class PageFigure:
    """A figure for the page."""

    stem: str  #: name of its files without the ending
    title: str
    description: str  #: what it shows, for the caption and for readers who do not see it
    svg: bytes
    columns: int  #: of axes; from two on it scrolls on a narrow screen instead of shrinking


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Findings:
    """What a page says about a model."""

    reduction: ExactReduction
    sys: control.StateSpace
    check: CrossCheck
    eigenvalues: EigenvalueTable
    feedback: StateFeedback | None  #: the regulator, if there is one
    regulator: str  #: what it minimizes, or why there is none
    notes: list[str]  #: warnings and what the figures leave out

    @property
    def model(self) -> SecondOrderModel:
        """The model that was reduced."""
        return self.reduction.model


def page(findings: Findings, figures: Sequence[PageFigure], files: Iterable[str]) -> str:
    """Render the page.

    Parameters
    ----------
    findings : Findings
    figures : sequence of PageFigure
        Embedded as SVG.
    files : iterable of str
        Names of the files beside the page.

    Returns
    -------
    str
        HTML 5 without references to anything elsewhere.
    """
    template = importlib.resources.files("halfdof_ctrl").joinpath("report.html").read_text(encoding="utf-8")
    verdict, look = ("Cross-check passed", "good") if findings.check.passed else ("Cross-check FAILED", "bad")
    return string.Template(template).substitute(
        mark=f"{PAGE_MARK} {_version('halfdof_ctrl')}",
        title=html.escape(findings.model.name or "Mechanical model"),
        summary=html.escape(_summary(findings)),
        verdict=f'<span class="verdict {look}">{verdict}</span>',
        notes=_scheme(findings) + "\n".join(f'<p class="note">{html.escape(note)}</p>' for note in findings.notes),
        counts=html.escape(findings.eigenvalues.counts),
        eigenvalues=_eigenvalues(findings.eigenvalues),
        check=_check(findings.check),
        figures="\n".join(map(_figure, figures)),
        regulator=_regulator(findings),
        system=_system(findings.sys),
        files=_links(files),
        provenance=html.escape(_provenance()),
    )


def _scheme(findings: Findings) -> str:
    """Return the scheme of a built-in mount, without which nobody can check M, C and K."""
    scheme = scheme_of(findings.model)
    return "" if scheme is None else f'<pre class="scheme">{html.escape(scheme)}</pre>\n'


def _summary(findings: Findings) -> str:
    model, part = findings.model, findings.reduction.partition
    kinds = (("inertial", part.inertial), ("half", part.half), ("static", part.static))
    split = ", ".join(f"{len(names)} {kind} ({listed(names)})" if names else f"no {kind} ones" for kind, names in kinds)
    free = free_motions_in_words(model.M, model.C, model.K, model.known_to)
    unusual = unusual_in_words(model)
    return (
        f"{len(model.dofs)} degrees of freedom: {split}; {findings.reduction.order} states. "
        f"Inputs: {listed(model.inputs)}. Outputs: {listed(model.outputs)}."
        f"{f' {free}.' if free else ''}{f' Unusual: {unusual}.' if unusual else ''}"
    )


def _eigenvalues(table: EigenvalueTable) -> str:
    rows = table.rows[:SHOWN_EIGENVALUES]
    left = len(table.rows) - len(rows)
    more = f'\n<p class="soft">and {left} more rows, which the command poles prints.</p>' if left else ""
    return _table(("descriptor form [rad/s]", "state space [rad/s]", "difference"), rows) + more


def _check(check: CrossCheck) -> str:
    rows = [(what, error, allowed, verdict, where) for what, error, allowed, verdict, where in check.rows if what]
    notes = "".join(f'\n<p class="soft">Not checked: {html.escape(limit)}</p>' for limit in check.limits)
    return _table(("", "error", "numbers allow", "verdict", "worst at"), rows, long={4}) + notes


def _figure(figure: PageFigure) -> str:
    data = base64.b64encode(figure.svg).decode("ascii")
    text = html.escape(f"{figure.title}. {figure.description}")
    look = ' class="broad"' if figure.columns > 1 else ""
    return (
        f'<figure id="{figure.stem}"{look}>\n<div class="wide">'
        f'<img src="data:image/svg+xml;base64,{data}" alt="{text}">'
        f"</div>\n<figcaption>{text}</figcaption>\n</figure>"
    )


def _regulator(findings: Findings) -> str:
    feedback = findings.feedback
    text = f"<p>{html.escape(findings.regulator)}</p>"
    if feedback is None:
        return text
    gains = zip(feedback.inputs, feedback.K.tolist(), strict=True)
    poles = listed(eigenvalues_in_words(feedback.poles.tolist()), most=SHOWN_STATES)
    return "\n".join(
        [
            text,
            _matrix("K", feedback.states, gains),
            f"<p>Closed-loop poles [rad/s]: {html.escape(poles)}</p>",
        ]
    )


def _system(sys: control.StateSpace) -> str:
    if sys.nstates > SHOWN_STATES:
        return f"<p>{sys.nstates} states: the matrices are in the files statespace.npz and statespace.mat.</p>"
    states, inputs, outputs = (
        [name_from_label(label) for label in labels]
        for labels in (sys.state_labels, sys.input_labels, sys.output_labels)
    )
    blocks = (("A", states, states), ("B", states, inputs), ("C", outputs, states), ("D", outputs, inputs))
    tables = [
        _matrix(letter, columns, zip(rows, np.asarray(getattr(sys, letter)).tolist(), strict=True))
        for letter, rows, columns in blocks
        if rows and columns
    ]
    return "\n".join(["<p>x' = A x + B u, y = C x + D u, shown with six digits; the files have all.</p>", *tables])


def _matrix(letter: str, columns: Sequence[str], rows: Iterable[tuple[str, list[float]]]) -> str:
    if len(columns) > SHOWN_STATES:
        return f"<p>{letter} has {len(columns)} columns and is not shown.</p>"
    return _table((letter, *columns), [(name, *(f"{value:.6g}" for value in row)) for name, row in rows], numbers=True)


def _table(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, long: Collection[int] = (), numbers: bool = False
) -> str:
    """Write a table that scrolls by itself where the screen is narrow; columns in `long` wrap their text."""
    first = "".join(f'<th scope="col">{html.escape(cell)}</th>' if cell else "<td></td>" for cell in head)
    body = "\n".join(f"<tr>{_cells(row, long)}</tr>" for row in rows)
    look = ' class="numbers"' if numbers else ' class="prose"' if long else ""
    return (
        f'<div class="wide" role="group" tabindex="0" aria-label="{html.escape(" ".join(head).strip())}">'
        f"<table{look}>\n<thead><tr>{first}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>"
    )


def _cells(row: Sequence[str], long: Collection[int]) -> str:
    first, *rest = row
    cells = [f'<th scope="row">{html.escape(first)}</th>']
    for column, cell in enumerate(rest, start=1):
        cells.append(
            f'<td class="text">{html.escape(cell)}</td>' if column in long else f"<td>{html.escape(cell)}</td>"
        )
    return "".join(cells)


def _links(files: Iterable[str]) -> str:
    items = "\n".join(f'<li><a href="{html.escape(name)}">{html.escape(name)}</a></li>' for name in files)
    return f"<ul>\n{items}\n</ul>"


def _provenance() -> str:
    versions = ", ".join(f"{name} {_version(name)}" for name in ("halfdof_ctrl", "control", "numpy", "scipy"))
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return f"Made {made} by {versions}, Python {platform.python_version()} on {platform.machine()}."


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"
