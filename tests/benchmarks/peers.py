"""The benchmark problems through SB10JD, QZ and this package: is the count right, how far off is the response.

Run ``python tests/benchmarks/peers.py`` from the project's folder; ``--random 200`` adds so many random structures,
counted per kind. Errors are those of a plain solve with the matrices that came out, against exact rational arithmetic,
at points from a tenth of the slowest to a hundred times the fastest eigenvalue, relative to the largest entry at each.
"""

import argparse
import sys
import warnings
from collections import defaultdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import HalfdofError
from support import rational
from support.anykinds import ANY_KIND, signals
from support.benchmark_cases import REGULAR, SINGULAR
from support.descriptor_peers import companion, conversions, converted, massive, qz_count
from support.verdict import ComplexArray, Improved, transfer_errors

GOOD = 1e-6  #: a worse transfer function is a wrong one


def spread(values: ComplexArray) -> ComplexArray:
    """Give points on the imaginary axis about the sizes of the eigenvalues."""
    speeds = np.abs(values[np.abs(values) > 1e-9 * np.abs(values).max(initial=0.0)]) if values.size else np.ones(1)
    speeds = speeds if speeds.size else np.ones(1)
    return np.asarray(1j * np.geomspace(0.1 * speeds.min(), 100.0 * speeds.max(), 12))


def ours(model: hd.SecondOrderModel) -> Improved | str:
    """Reduce by this package; the name of the refusal if it refuses."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            reduction = hd.exact_reduction(model)
            return Improved.of(hd.mech2ss(reduction, improper="drop"), reduction.polynomial_part)
        except HalfdofError as refusal:
            return type(refusal).__name__


def judged(model: hd.SecondOrderModel) -> dict[str, str]:
    """Give what each way says: `right`, or the error, or how the count is wrong."""
    exact = rational.rational_transfer(model)
    if exact.order < 0:
        mine = ours(model)
        peers = dict.fromkeys(conversions(model), "accepted")
        return {"ours": mine if isinstance(mine, str) else "ACCEPTED", **peers, "QZ count": str(qz_count(model))}
    points = spread(hd.pencil_structure(model).finite_eigenvalues)
    desired = exact.at(points)
    answers: dict[str, Improved | str] = {"ours": ours(model), **conversions(model)}
    found = {
        name: answer if isinstance(answer, str) else verdict(answer, exact, points, desired)
        for name, answer in answers.items()
    }
    count = qz_count(model)
    found["QZ count"] = "right" if count == exact.order else f"{count} of {exact.order}"
    return found


def verdict(system: Improved, exact: rational.RationalTransfer, points: ComplexArray, desired: ComplexArray) -> str:
    """Say whether the order is right and how far the response is off."""
    with np.errstate(all="ignore"):
        error = float(transfer_errors(system.at(points), desired).max())
    order = "" if len(system.A) == exact.order else f", {len(system.A)} of {exact.order} states"
    return f"{error:.0e}{order}"


def table(rows: list[tuple[str, dict[str, str]]]) -> None:
    """Print one row a problem, one column a way."""
    columns = ("ours", "companion", "[q; dq_massive]", "QZ count")
    print(f"{'problem':36}" + "".join(f"{column:26}" for column in columns))
    for name, cells in rows:
        print(f"{name:36}" + "".join(f"{cells.get(column, '-'):26}" for column in columns))


def random_counts(cases: int, seed: int) -> None:
    """Count right answers per kind: order (or refusal of a singular pencil) and response."""
    right: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for case in range(cases * len(ANY_KIND)):
        kind = ANY_KIND[case % len(ANY_KIND)]
        generator = np.random.default_rng([seed, case])
        structure = kind(generator, int(generator.integers(1, 13)))
        model = without_derivatives(signals(generator, structure))
        exact = rational.rational_transfer(model)
        row = right[kind.__name__]
        row["cases"] += 1
        ways: dict[str, Improved | str | None] = {"ours": ours(model)}
        ways["companion"], ways["[q; dq_massive]"] = (converted(form(model)) for form in (companion, massive))
        for name, system in ways.items():
            row[name] += is_right(system, exact)
        row["QZ count"] += qz_count(model) == exact.order
    print(f"\nright answers among random structures ({cases} of each kind)")
    for kind_name, row in right.items():
        print(f"{kind_name:18}", {name: count for name, count in row.items() if name != "cases"})


def without_derivatives(model: hd.SecondOrderModel) -> hd.SecondOrderModel:
    """Keep the signals that plain descriptor forms have."""
    return hd.mechss(model.M, model.C, model.K, model.B, model.F, D=model.D)


def is_right(system: Improved | str | None, exact: rational.RationalTransfer) -> bool:
    """Tell whether a refusal was due, or the order and response are right."""
    if exact.order < 0 or not isinstance(system, Improved):
        return (exact.order < 0) == (system is None or isinstance(system, str))
    points = np.array([0.3j, 1.1j, 4.7j])
    with np.errstate(all="ignore"):
        good = bool(transfer_errors(system.at(points), exact.at(points)).max() < GOOD)
    return good and len(system.A) == exact.order


def main() -> None:
    """Print the table of benchmark problems, and counts for random structures where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--random", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    problems = [*[problem for problem, _, _ in REGULAR], *SINGULAR]
    table([(problem.__name__, judged(problem())) for problem in problems])
    if options.random:
        random_counts(options.random, options.seed)


if __name__ == "__main__":
    main()
