"""Hunt for failures over thousands of random structures of any index, judged by exact arithmetic.

Run ``python tests/benchmarks/hunt.py --cases 10000 --seed 1 --kind mixed`` from the project's folder. Each failure is
printed with the seed that draws it again (``--again mixed 5 2001247``); at the end come counts and worst errors per
kind, and the smallest failing models as code. ``--largest 5`` hunts among small ones, ``--units`` gives them random
units, ``--near`` moves an entry of M by 2^-20 to 2^-45. Then only what is silent counts: an error above 1e-9 in the
stored numbers, evaluated in 600 bits, a wrong order, a false refusal, or a loss that is told with a wrong size. What
states of DOFs always lose far below all modes is counted apart.
"""

import argparse
import sys
import time
import warnings
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ImproperError, SingularPencilError
from halfdof_ctrl.model.second_order import LETTERS
from halfdof_ctrl.systems.free_motion_warning import USUAL_SPURIOUS
from support import rational
from support.anykinds import ANY_KIND, Kind, in_units, nearly_singular, signals
from support.structures import Structure
from support.verdict import (
    Improved,
    characteristic_error,
    eigenvalue_error,
    polynomial_at,
    polynomial_error,
    roll_off_error,
    transfer_errors,
)

POINTS = np.array([0.3j, 1.1j, 4.7j, 0.618034 + 0.207107j])  # [rad/s]
FAR = np.array([0.3j, 1.1j, 4.7j, 1e2j, 1e3j])  # [rad/s] into the roll-off
ANNOUNCED = 1e5  #: times the limits may be lost where LostDigitsWarning says so
SILENT = 1e-9  #: of the largest entry of H(s): a larger error in A, B, C, D has to be told
AT_POLE = 1e-6  #: relative distance: an undamped resonance itself determines nothing
NO_NUMBER = 1e-100  #: what is left of zero in 600 bits
DRIFTING = 10.0  #: times what one pole that rounding has moved from the origin changes, or two that have
FAR_BELOW = 1e-3  #: of the slowest pole that is not at the origin
BESIDE = 1.1j  #: times that
FALLEN = 10.0  #: times frequency over that pole: what is left of a channel that falls
TOLD_SIZE = 30.0  #: a loss that is told is right to this factor
LIMITS = {
    "transfer": 1e-8,
    "proper": 1e-8,
    "far": 1e-10,
    "polynomial": 1e-8,
    "characteristic": 1e-7,
    "eigenvalue": 1e-7,
}


@dataclass
class Finding:
    """What one model showed."""

    complaints: list[str] = field(default_factory=list)
    errors: dict[str, float] = field(default_factory=dict)
    method: str = "-"
    index: int = -1
    rcond: float = float("nan")
    said: list[str] = field(default_factory=list)


def judged(structure: Structure, model: hd.SecondOrderModel, tau: float = 1.0) -> Finding:
    """Reduce a model whose unit of time is tau [s] and compare all that is promised with exact arithmetic."""
    finding = Finding()
    exact = rational.rational_transfer(model)
    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            reduction = hd.exact_reduction(model)
    except SingularPencilError as refusal:
        _judge_refusal(finding, structure, refusal, exact)
        return finding
    except Exception as other:  # noqa: BLE001  # whatever it is, it is a finding
        finding.complaints.append(f"{type(other).__name__} for a pencil of order {exact.order}: {str(other)[:90]}")
        return finding
    finding.said = sorted({warning.category.__name__ for warning in said})
    finding.method, finding.rcond = reduction.method, reduction.rcond
    if reduction.order != exact.order:
        finding.complaints.append(f"order {reduction.order}, exactly {exact.order}")
        return finding
    finding.index = rational.pencil_index(*structure.matrices)
    if (reduction.index, reduction.n_infinite) != (finding.index, 2 * structure.size - exact.order):
        finding.complaints.append(f"index {reduction.index}, n_infinite {reduction.n_infinite}")
    _judge_channels(finding, model, reduction, exact, tau)
    allowed = ANNOUNCED if "LostDigitsWarning" in finding.said else 1.0
    finding.complaints += [
        f"{what} error {error:.1e}" for what, error in finding.errors.items() if not error <= allowed * LIMITS[what]
    ]
    return finding


def judged_near(model: hd.SecondOrderModel, tau: float = 1.0) -> Finding:
    """Reduce a model that is nearly singular and look for what is silent."""
    finding, exact = Finding(), rational.rational_transfer(model)
    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            reduction = hd.exact_reduction(model)
            told = [warning for warning in said if warning.category is hd.errors.LostDigitsWarning]
            hd.mech2ss(reduction, improper="drop")
    except hd.errors.HalfdofError as refusal:
        if exact.order >= 0:
            finding.complaints.append(f"false refusal: {type(refusal).__name__} for a pencil of order {exact.order}")
        return finding
    finding.said = sorted({warning.category.__name__ for warning in said})
    finding.method, finding.rcond = reduction.method, reduction.rcond
    if reduction.order != exact.order:
        if "CloseDecisionWarning" not in finding.said:
            finding.complaints.append(f"order {reduction.order}, exactly {exact.order}, in silence")
        return finding
    output, loss = reduction.output, reduction.solution.evidence.loss
    stored = Improved(reduction.A, reduction.B, output.X, output.direct(len(model.inputs)), output.U[1:])
    points = POINTS / tau
    roots = exact.eigenvalues()[0]
    points = points[~(np.abs(points[:, None] - roots) < AT_POLE * np.abs(points[:, None])).any(axis=1)]
    also = polynomial_at(stored.polynomial, points, stored.D.shape)
    value = exact.at(points)
    zero = ~value.any(axis=2, keepdims=True)  # of nothing at all, any error is all: there the terms count
    size = np.maximum(np.abs(value), np.abs(also)).max(axis=(0, 1), initial=0.0)
    if zero.any():
        size = np.where(
            zero, np.maximum(np.maximum(stored.balanced().terms_at(points), _other(model, points)), size), size
        )
    error = np.abs(stored.exactly_at(points) - value) / np.where(size > NO_NUMBER, size, 1.0)
    finding.errors["stored"] = float(error.max(initial=0.0))
    silent = finding.errors["stored"] > SILENT and "LostDigitsWarning" not in finding.said
    if silent and (error <= SILENT + _usual(stored, exact, points, value)).all():
        finding.said.append("far below all modes")
    elif silent:
        finding.complaints.append(f"error {finding.errors['stored']:.1e} in silence, measured {loss.value:.1e}")
    if not told:  # free motions and python-control's evaluation are told by another size
        return finding
    point, channel = 1j * loss.omega, (model.outputs.index(loss.output), model.inputs.index(loss.source), 0)
    grown = abs(polynomial_at(stored.polynomial, point, stored.D.shape)[channel])
    value, found = exact.at(point)[channel], stored.exactly_at(point)[channel]
    true = abs(found - value) / max(abs(value), grown, sys.float_info.min)
    if not loss.there / TOLD_SIZE <= true <= loss.there * TOLD_SIZE:
        finding.complaints.append(
            f"lost {loss.there:.1e} is told, {true:.1e} is right, at {loss.omega * tau:.1e} / tau"
        )
    return finding


def _other(model: hd.SecondOrderModel, points: np.ndarray) -> np.ndarray:
    """Give the sizes of responses to forces, seen by outputs, of other sizes in the same places: no terms cancel."""
    generator = np.random.default_rng(0)
    letters = [letter for letter in LETTERS if letter not in "MCK"]
    parts = {
        letter: getattr(model, letter) * generator.integers(5, 16, getattr(model, letter).shape) for letter in letters
    }
    return np.abs(rational.rational_transfer(replace(model, **parts)).at(points))


def _usual(stored: Improved, exact: rational.RationalTransfer, points: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Give what is usually lost at points in states of DOFs and is not told, counted apart.

    Free motions drift: rounding of A moves poles from the origin, which has to be told where it is by more than
    `USUAL_SPURIOUS` of the slowest other pole. Channels that have fallen by decades towards rest, as accelerations do,
    are too small for what they are a difference of; scales alone do not tell a mode that a tiny mass makes fast.
    """
    roots, counts = exact.eigenvalues()
    free, slowest = int(counts[roots == 0.0].sum()), np.abs(roots[roots != 0.0]).min(initial=np.inf)
    sizes = np.sort(np.abs(np.linalg.eigvals(stored.balanced().A)))
    moved = np.zeros(points.size)
    if free and sizes[free - 1] <= USUAL_SPURIOUS * slowest:
        ratio = sizes[free - 1] / np.abs(points)
        moved = DRIFTING * np.where(ratio < 1.0, ratio ** (1 if free % 2 else 2), np.inf)
    if not np.isfinite(slowest):
        return moved
    below = np.abs(points) / slowest
    fallen = np.abs(value).max(axis=(0, 1)) < FALLEN * below * np.abs(exact.at([BESIDE * slowest])).max()
    return np.where((below < FAR_BELOW) & fallen, np.inf, moved)


def _judge_refusal(
    finding: Finding, structure: Structure, refusal: SingularPencilError, exact: rational.RationalTransfer
) -> None:
    if exact.order >= 0:
        finding.complaints.append("false refusal: SingularPencilError for a regular pencil")
        return
    free = rational.free_dofs(*structure.matrices)
    named = np.array([dof in refusal.dofs for dof in structure.model().dofs])
    if not named.any() or (named & ~free).any():
        finding.complaints.append(f"refusal names {refusal.dofs}, free are {np.flatnonzero(free).tolist()}")


def _judge_channels(
    finding: Finding,
    model: hd.SecondOrderModel,
    reduction: hd.ExactReduction,
    exact: rational.RationalTransfer,
    tau: float,
) -> None:
    growth = exact.growth
    improper = tuple(
        (model.inputs[j], model.outputs[i], int(growth[i, j])) for i, j in np.argwhere(growth > 0).tolist()
    )
    try:
        hd.mech2ss(reduction)
        refused: tuple[tuple[str, str, int], ...] = ()
    except ImproperError as refusal:
        refused = refusal.pairs
    if set(refused) != set(improper):
        finding.complaints.append(f"improper pairs {refused}, exactly {improper}")
    polynomial, points, roll_off = exact.polynomial_part(), POINTS / tau, FAR / tau
    system = Improved.of(hd.mech2ss(reduction, improper="drop"), reduction.polynomial_part)
    if tau != 1.0:  # a plain solve does not know that states have units
        system = system.balanced()
    finding.errors["polynomial"] = polynomial_error(reduction.polynomial_part, polynomial)
    near, exactly = system.at(points), exact.at(points)
    also = polynomial_at(polynomial, points, system.D.shape)
    finding.errors["transfer"] = float(transfer_errors(near, exactly, also).max())
    proper = growth <= 0
    finding.errors["proper"] = float(transfer_errors(near[proper][None], exactly[proper][None]).max())
    finding.errors["far"] = roll_off_error(system.at(roll_off)[proper], exact.at(roll_off)[proper])
    finding.errors["characteristic"] = characteristic_error(system.A, exact, points)
    finding.errors["eigenvalue"] = eigenvalue_error(system.A, exact, floor=1.0 / tau)


def drawn(kind: Kind, size: int, seed: int, *, near: bool = False) -> tuple[Structure, hd.SecondOrderModel]:
    """Draw a model again from its kind, size and seed."""
    generator = np.random.default_rng([seed, size])
    structure = kind(generator, size)
    structure = nearly_singular(generator, structure) if near else structure
    return structure, signals(generator, structure)


def rescaled(model: hd.SecondOrderModel, seed: int) -> tuple[hd.SecondOrderModel, float]:
    """Give a model in random units of its DOFs, equations and time, powers of eight that round nothing."""
    generator = np.random.default_rng([seed, 8])
    columns, rows = 8.0 ** generator.integers(-9, 10, (2, len(model.dofs)))
    tau = 8.0 ** int(generator.integers(-9, 10))
    return in_units(model, columns, rows, tau), tau


def shown(structure: Structure, model: hd.SecondOrderModel) -> str:
    """Write a model as code."""
    letters = [letter for letter in LETTERS if letter in "MCK" or getattr(model, letter).any()]
    code = ", ".join(f"{letter}={getattr(model, letter).tolist()}" for letter in letters)
    return f"{structure.kind}: hd.mechss({code})"


def main() -> None:
    """Hunt and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--largest", type=int, default=12)
    parser.add_argument("--kind", action="append", help="names of kinds, all by default")
    parser.add_argument("--units", action="store_true", help="in random units")
    parser.add_argument("--near", action="store_true", help="nearly singular, by one entry of M")
    parser.add_argument("--again", nargs=3, metavar=("KIND", "SIZE", "SEED"), help="judge one model again and show it")
    parser.add_argument("--shown", type=int, default=25, help="failures to be printed in full")
    options = parser.parse_args()
    if options.again:
        name, size, seed = options.again
        kind = next(kind for kind in ANY_KIND if kind.__name__ == name)
        structure, model = drawn(kind, int(size), int(seed), near=options.near)
        scaled, tau = rescaled(model, int(seed)) if options.units else (model, 1.0)
        finding = judged_near(scaled, tau) if options.near else judged(structure, scaled, tau)
        print(shown(structure, model), finding, sep="\n")
        return
    kinds = [kind for kind in ANY_KIND if options.kind is None or kind.__name__ in options.kind]
    counts: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    worst: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    failures: list[tuple[int, str]] = []
    start = time.time()
    for case in range(options.cases):
        kind = kinds[case % len(kinds)]
        seed = options.seed * 1_000_000 + case
        size = int(np.random.default_rng(seed).integers(1, options.largest + 1))
        structure, model = drawn(kind, size, seed, near=options.near)
        scaled, tau = rescaled(model, seed) if options.units else (model, 1.0)
        finding = judged_near(scaled, tau) if options.near else judged(structure, scaled, tau)
        row = kind.__name__
        counts[row]["cases"] += 1
        counts[row][finding.method] += 1
        for warning in finding.said:
            counts[row][warning] += 1
        for what, error in finding.errors.items():
            worst[row][what] = max(worst[row][what], error)
        if finding.complaints:
            counts[row]["failed"] += 1
            text = (
                f"kind {row}, size {size}, seed {seed}, {finding.method}, index {finding.index}, "
                f"rcond {finding.rcond:.0e}, {finding.said}: " + "; ".join(finding.complaints)
            )
            failures.append((size, f"{text}\n    {shown(structure, model)}"))
            print(text, flush=True)
    print(f"\n{options.cases} cases in {time.time() - start:.0f} s")
    for row, count in counts.items():
        print(f"{row:16}", dict(count), {what: f"{error:.0e}" for what, error in worst[row].items()})
    print(f"{len(failures)} failures; the smallest:")
    for _, text in sorted(failures, key=lambda failure: failure[0])[: options.shown]:
        print(text)


if __name__ == "__main__":
    main()
