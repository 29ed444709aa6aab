"""Guyan reduction, and a small mass on massless DOFs, beside the exact reduction of the same models.

Run ``python examples/ex02_alternatives.py [FIGURE]``: it prints the tables of docs/explanation/alternatives.md and
draws the figure of that page, in about half a minute. Imported, it draws and prints nothing.
"""

import io
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import control
import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
import scipy.integrate
import scipy.linalg
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image  # pillow, which matplotlib brings
from scipy.optimize import linear_sum_assignment

import halfdof_ctrl as hd

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
Solver: TypeAlias = Literal["RK45", "LSODA", "BDF", "Radau"]

SOLVERS: tuple[Solver, ...] = ("RK45", "LSODA", "BDF", "Radau")
HORIZON = 0.5  #: [s] of the step response, which settles at 1
RTOL, ATOL = 1e-4, 1e-7  #: of every solver
LIMIT = 20_000  #: evaluations after which a solver is stopped
TABLED = (1e-2, 1e-3, 1e-4, 1e-6)  #: epsilons that stand in the tables
SETTLED = 1_000  #: evaluations with which an implicit solver is done, unless it is at an undamped vibration
CERTAIN = 0.8  #: of such a count, which hangs on rounding, is exceeded on every processor
ROUNDING = 1e-13  #: below which the tables give no digits of an error
BAND = 10.0  #: [Hz] up to which the tables give the error of the transfer function, above all natural frequencies

HEADER = f"| | states | eigenvalues | transfer function | {' | '.join(SOLVERS)} |\n|---|---|---|---|---|---|---|---|"
DPI = 130
ERRORS = (1e-17, 1e2)  #: limits of both drawings of errors
ROWS = (
    "largest relative error\nof the eigenvalues",
    "relative error\nof the transfer function",
    "evaluations of x'\nfor a step response",
)
SMALL_MASS: dict[str, Any] = {"color": "C1", "linewidth": 1.3}
LOOKS: dict[str, dict[str, Any]] = {
    "": {"color": "C0", "linewidth": 1.8, "label": "exact reduction"},
    "static DOFs": {"color": "C2", "linestyle": (0, (1, 1))},
    "half DOFs": {"color": "C2", "linestyle": (0, (4, 2))},
    "static and half DOFs": {"color": "C2", "linestyle": (0, (4, 2)), "label": "Guyan reduction"},
    "static DOFs and w1": {"color": "C2", "linestyle": (0, (6, 2, 1, 2))},
}
LABELS_AT = {  #: where the transfer function's errors leave room for a label, on the left or to the left of [Hz]
    "static DOFs": (0.12, 5e-14, "left"),
    "half DOFs": (0.12, 0.05, "left"),
    "static and half DOFs": (0.12, 0.3, "left"),
    "static DOFs and w1": (6.3, 4.0, "right"),
}
SOLVER_LOOKS: dict[Solver, dict[str, Any]] = {
    "RK45": {"color": "C3", "marker": "o", "markersize": 4.0},
    "LSODA": {"color": "C4", "marker": "s", "markersize": 3.5},
    "BDF": {"color": "C5", "marker": "^", "markersize": 4.0},
    "Radau": {"color": "black", "marker": "d", "markersize": 3.5},
}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Case:
    """A model with one input and one output, and what is tried on it."""

    name: str
    model: hd.SecondOrderModel
    inertia: FloatArray  #: (n,) what epsilon multiplies: an inertia in scale on massless DOFs, 0 on the others
    condensed: Mapping[str, Sequence[str]]  #: DOFs that Guyan reduction eliminates, by what they are
    eigenvalues: ComplexArray  #: [rad/s] all finite ones to 16 digits, roots of the characteristic polynomial


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What came out for one way to treat a model."""

    name: str
    states: int
    eigenvalue_error: float  #: largest relative one of the eigenvalues that have a partner
    transfer_error: float  #: largest relative one up to BAND
    evaluations: tuple[int, ...]  #: of x' by each of SOLVERS; above LIMIT where it was stopped


def mount() -> Case:
    """Give the hydraulic mount: y1 and y2 are half DOFs."""
    pair = -0.6897228096519806 + 17.70591511240659j  # 3 s^4 + 40 s^3 + 1075 s^2 + 11375 s + 26250 = 0
    return Case(
        name="hydraulic mount: two half DOFs",
        model=hd.hydromount().select(inputs="F_y", outputs="y"),
        inertia=np.array([0.0, 20.0, 20.0]),
        condensed={"half DOFs": ["y1", "y2"]},
        eigenvalues=np.array([pair, pair.conjugate(), -8.779694309560127, -3.174193404469245]),
    )


def cantilever() -> Case:
    """Give a beam of two elements with masses at its nodes, whose tip hangs on a spring and a damper in series.

    The rotations are static DOFs, the point x between spring and damper is a half DOF.
    """
    h, EI, spring = 0.5, 40.0, 300.0  # [m], [N m^2], [N/m]
    shear, bending, coupling = 12.0, (4.0 * h**2, 2.0 * h**2), 6.0 * h
    element = (EI / h**3) * np.array(
        [
            [shear, coupling, -shear, coupling],
            [coupling, bending[0], -coupling, bending[1]],
            [-shear, -coupling, shear, -coupling],
            [coupling, bending[1], -coupling, bending[0]],
        ]
    )
    K = np.zeros((7, 7))  # two rows for the clamped node, then w1, phi1, w2, phi2, x
    K[:4, :4] += element
    K[2:6, 2:6] += element
    K[np.ix_([4, 6], [4, 6])] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M = np.diag([2.0, 0.0, 1.0, 0.0, 0.0])  # [kg]
    C = np.diag([2.0, 0.0, 2.0, 0.0, 10.0])  # [N s/m]
    model = hd.mechss(M, C, K[2:, 2:], dofs=["w1", "phi1", "w2", "phi2", "x"], name="cantilever")
    pairs = np.array([-6.429511199756294 + 10.883208606167107j, -0.8617861423873925 + 51.803422784565264j])
    return Case(
        name="cantilever: two static DOFs, one half DOF",
        model=model.select(inputs="F_w2", outputs="w2"),
        inertia=np.array([0.0, h**2, 0.0, h**2, 1.0]),
        condensed={
            "static DOFs": ["phi1", "phi2"],
            "static and half DOFs": ["phi1", "phi2", "x"],
            "static DOFs and w1": ["phi1", "phi2", "w1"],
        },
        # 7 s^5 + 231 s^4 + 21944 s^3 + 613080 s^2 + 7488000 s + 55296000 = 0
        eigenvalues=np.array([*pairs, *pairs.conjugate(), -18.417405315712628]),
    )


def guyan(model: hd.SecondOrderModel, dofs: Sequence[str]) -> hd.SecondOrderModel:
    """Eliminate DOFs s by ``q_s = -K_ss^-1 K_sm q_m``, their equation less inertia, damping and force."""
    s = [model.dofs.index(dof) for dof in dofs]
    m = [k for k in range(len(model.dofs)) if k not in s]
    K = np.asarray(model.K)
    T = np.eye(len(model.dofs))[:, m]
    T[s] = -np.linalg.solve(K[np.ix_(s, s)], K[np.ix_(s, m)])
    M_G, C_G, K_G = (T.T @ matrix @ T for matrix in (model.M, model.C, model.K))
    kept = [model.dofs[k] for k in m]
    return hd.mechss(M_G, C_G, K_G, T.T @ model.B, model.F @ T, dofs=kept, inputs=model.inputs, outputs=model.outputs)


def with_small_mass(case: Case, epsilon: float) -> hd.SecondOrderModel:
    """Put the small mass ``epsilon`` times `inertia` on the massless DOFs."""
    model = case.model
    M = model.M + epsilon * np.diag(case.inertia)
    return hd.mechss(M, model.C, model.K, model.B, model.F, dofs=model.dofs, inputs=model.inputs, outputs=model.outputs)


def textbook(model: hd.SecondOrderModel) -> control.StateSpace:
    """Give the usual state space of q and q', with the inverse of M."""
    n, m = model.B.shape
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(model.M, np.hstack([model.K, model.C]))]])
    B = np.vstack([np.zeros((n, m)), np.linalg.solve(model.M, model.B)])
    return control.ss(A, B, np.hstack([model.F, np.zeros_like(model.F)]), 0)


def eigenvalues_by_qz(model: hd.SecondOrderModel) -> ComplexArray:
    """Give the eigenvalues of the pencil of q and q', without the inverse of M."""
    n = len(model.dofs)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-model.K, -model.C]])
    E = scipy.linalg.block_diag(np.eye(n), model.M)
    return np.asarray(scipy.linalg.eigvals(A, E), dtype=np.complex128)


def eigenvalue_error(found: ComplexArray, exact: ComplexArray) -> float:
    """Give the largest relative error of eigenvalues matched one to one; one without a partner does not count."""
    finite = found[np.isfinite(found)]
    errors = np.abs(exact[:, None] - finite) / np.abs(exact)[:, None]
    return float(errors[linear_sum_assignment(errors)].max())


def transfer_errors(system: control.StateSpace, case: Case, hertz: FloatArray) -> FloatArray:
    """Give the relative error of a transfer function, against a solve with the model's own matrices."""
    omega = 2.0 * np.pi * hertz
    exact = case.model(1j * omega)
    found = hd.frequency_response(system, omega).complex
    return np.asarray(np.abs(found - exact) / np.abs(exact), dtype=np.float64)


def evaluations(system: control.StateSpace, case: Case, solver: Solver) -> int:
    """Count the evaluations of x' for a step response that settles at 1; LIMIT + 1 stands for more than LIMIT."""
    A, b = system.A, system.B[:, 0] / float(case.model(0.0).real)
    jacobian: dict[Solver, Any] = {"LSODA": lambda _t, _x: A, "BDF": A, "Radau": A}
    options = {"jac": jacobian[solver]} if solver in jacobian else {}
    method = getattr(scipy.integrate, solver)
    run = method(lambda _, x: A @ x + b, 0.0, np.zeros(len(A)), HORIZON, rtol=RTOL, atol=ATOL, **options)
    while run.status == "running" and run.nfev <= LIMIT:
        message = run.step()
    if run.status == "failed":
        raise RuntimeError(message)
    return min(int(run.nfev), LIMIT + 1)


def compared(system: control.StateSpace, case: Case, name: str) -> Row:
    """Measure one system against the exact answers."""
    return Row(
        name=name,
        states=system.nstates,
        eigenvalue_error=eigenvalue_error(np.linalg.eigvals(system.A), case.eigenvalues),
        transfer_error=float(transfer_errors(system, case, np.geomspace(BAND / 100.0, BAND, 200)).max()),
        evaluations=tuple(evaluations(system, case, solver) for solver in SOLVERS),
    )


def table(case: Case) -> Iterator[Row]:
    """Give the rows of a case: the exact reduction, Guyan reductions, small masses."""
    yield compared(hd.mech2ss(case.model), case, "exact reduction")
    for what, dofs in case.condensed.items():
        yield compared(hd.mech2ss(guyan(case.model, dofs)), case, f"Guyan, {what}")
    for epsilon in TABLED:
        yield compared(textbook(with_small_mass(case, epsilon)), case, f"small mass, ε = {epsilon:.0e}")


def printed(row: Row) -> str:
    """Write a row as Markdown."""
    errors = [
        f"{error:.1e}" if error > ROUNDING else f"< {ROUNDING:.0e}"
        for error in (row.eigenvalue_error, row.transfer_error)
    ]
    work = [printed_count(solver, count) for solver, count in zip(SOLVERS, row.evaluations, strict=True)]
    cells = [row.name, str(row.states), *errors, *work]
    return f"| {' | '.join(cells)} |"


def printed_count(solver: Solver, count: int) -> str:
    """Write a count, or what it surely exceeds: the limit, or 1, 2 or 5 times a power of ten."""
    if count > LIMIT:
        return f"> {LIMIT}"
    if solver == "RK45" or count <= SETTLED:
        return f"{count}"
    decade = 10 ** int(np.log10(CERTAIN * count))
    return f"> {max(step * decade for step in (1, 2, 5) if step * decade <= CERTAIN * count)}"


def reduced_systems(case: Case) -> Iterator[tuple[str, control.StateSpace]]:
    """Give what has no epsilon: the exact reduction, named "", and Guyan reductions, by what they condense."""
    yield "", hd.mech2ss(case.model)
    for what, dofs in case.condensed.items():
        yield what, hd.mech2ss(guyan(case.model, dofs))


def draw_eigenvalue_errors(ax: Axes, case: Case) -> None:
    """Draw the largest error of the eigenvalues over epsilon."""
    epsilons = np.geomspace(1e-16, 1.0, 65)
    models = [with_small_mass(case, epsilon) for epsilon in epsilons]
    inverse = [eigenvalue_error(np.linalg.eigvals(textbook(model).A), case.eigenvalues) for model in models]
    qz = [eigenvalue_error(eigenvalues_by_qz(model), case.eigenvalues) for model in models]
    for what, system in reduced_systems(case):
        error = eigenvalue_error(np.linalg.eigvals(system.A), case.eigenvalues)
        ax.axhline(error, **LOOKS[what])
        below = what in {"static DOFs", "static DOFs and w1"}
        annotated(ax, what, (1e-11, error), LOOKS[what]["color"], "top" if below else "bottom")
    ax.loglog(epsilons, inverse, label="small mass ε, state space with M⁻¹", **SMALL_MASS)
    ax.loglog(
        epsilons, qz, label="small mass ε, generalized problem by QZ", **(SMALL_MASS | {"linestyle": (0, (1, 1))})
    )
    ax.set(xlim=(epsilons[0], epsilons[-1]), ylim=ERRORS, xlabel="ε")


def draw_transfer_errors(ax: Axes, case: Case) -> None:
    """Draw the error of the transfer function over frequency."""
    hertz = np.geomspace(0.1, 100.0, 200)
    for what, system in reduced_systems(case):
        ax.loglog(hertz, transfer_errors(system, case, hertz), **LOOKS[what])
        if what:
            *at, ha = LABELS_AT[what]
            annotated(ax, what, at, LOOKS[what]["color"], "bottom", ha)
    for power in (-2, -4, -6):
        errors = transfer_errors(textbook(with_small_mass(case, 10.0**power)), case, hertz)
        ax.loglog(hertz, errors, **SMALL_MASS)
        annotated(ax, f"ε = $10^{{{power}}}$", (hertz[-27], errors[-40]), SMALL_MASS["color"], "top", "right")
    ax.set(xlim=(hertz[0], hertz[-1]), ylim=ERRORS, xlabel="frequency [Hz]")


def draw_work(ax: Axes, case: Case) -> None:
    """Draw the evaluations of each solver over epsilon, and on the left those of the exact system."""
    epsilons, apart = np.geomspace(1e-12, 1.0, 25), 1e-14
    systems = [textbook(with_small_mass(case, epsilon)) for epsilon in epsilons]
    for offset, (solver, look) in zip((0.2, 0.6, 1.7, 5.0), SOLVER_LOOKS.items(), strict=True):
        counts = np.array([evaluations(system, case, solver) for system in systems])
        ax.loglog(epsilons, np.where(counts > LIMIT, np.nan, counts), linewidth=1.0, label=solver, **look)
        ax.loglog(apart * offset, evaluations(hd.mech2ss(case.model), case, solver), **look)
    ax.axhline(LIMIT, color="0.5", linestyle=":", linewidth=1.0)
    annotated(ax, f"stopped after {LIMIT:,}".replace(",", " "), (2e-12, LIMIT), "0.4")
    ax.axvline(np.sqrt(apart * epsilons[0]), color="0.7", linewidth=0.8)
    ax.set(xlim=(apart / 10.0, epsilons[-1]), ylim=(60.0, 2.5 * LIMIT), xlabel="ε")
    ax.set_xticks([apart, *10.0 ** np.arange(-12.0, 1.0, 3.0)], ["exact", *[f"$10^{{{p}}}$" for p in range(-12, 1, 3)]])
    ax.minorticks_off()


def annotated(ax: Axes, text: str, at: Sequence[float], color: str, va: str = "bottom", ha: str = "left") -> None:
    """Write at a point of the data, a little above or below it."""
    shift = (0.0, 1.5 if va == "bottom" else -2.0)
    ax.annotate(text, (at[0], at[1]), shift, textcoords="offset points", color=color, va=va, ha=ha, fontsize="small")


def draw(cases: Sequence[Case]) -> Figure:
    """Draw a column for each case, a row for each question."""
    figure = plt.figure(figsize=(8.5, 9.5), layout="constrained")
    axes = figure.subplots(3, len(cases), sharey="row")
    for column, case in zip(axes.T, cases, strict=True):
        column[0].set_title(case.name, fontsize="medium")
        draw_eigenvalue_errors(column[0], case)
        draw_transfer_errors(column[1], case)
        draw_work(column[2], case)
    for ax, label in zip(axes[:, 0], ROWS, strict=True):
        ax.set_ylabel(label)
    for ax in axes.flat:
        ax.grid(visible=True, which="major", color="0.88", linewidth=0.6)
        ax.set_axisbelow(True)
    handles = [line for line in axes[0, 1].get_lines() if not str(line.get_label()).startswith("_")]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)
    axes[2, 0].legend(loc="upper left", bbox_to_anchor=(0.14, 0.9), ncols=2, frameon=False)
    return figure


def write_small_png(figure: Figure, path: str) -> None:
    """Write a PNG of 256 colours, a third of the size of matplotlib's own."""
    pixels = io.BytesIO()
    figure.savefig(pixels, dpi=DPI)
    Image.open(pixels).convert("RGB").quantize().save(path, format="png", optimize=True)


def main(path: str) -> None:
    """Print the tables and write the figure."""
    cases = [mount(), cantilever()]
    for case in cases:
        print(f"\n{case.name}\n\n{HEADER}", *map(printed, table(case)), sep="\n")
    write_small_png(draw(cases), path)
    print(f"\nfigure: {path}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "alternatives.png")
