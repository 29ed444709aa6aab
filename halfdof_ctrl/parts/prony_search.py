"""The best Prony series of every order, from a floor that no series can beat.

    floor  non-negative least squares on a dense grid of rates: the best of all series, up to the grid
    exact  where the curve has no scatter, rates from the Loewner matrices (`loewner`)
    down   clusters of the grid's branches; refine, merge or drop the cheapest, refine, ... to none
    up     from every order: add the branch that the dual of the least squares asks for, refine
    down   the three best merges of every order, once more

The dual of the least squares, the product of the residual with a column ``s / (s + w)``, says how fast a new branch at
w would lower the residual; where it is nowhere positive no branch helps, so the grid's optimum is global.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.parts.loewner import rational_rates
from halfdof_ctrl.parts.measured_curve import MeasuredCurve, scatter
from halfdof_ctrl.parts.prony_series import OUTSIDE, Series, best_sizes, refined, relaxing

TRIALS_PER_DECADE = 10  #: rates of the grid
PER_DECADE_EXACT = 20  #: the same where the curve has no scatter
BEYOND = 10.0  #: the grid reaches beyond the band by this factor
SMOOTH_MISFIT = 1e-5  #: scatter of a curve that was computed, not measured
PERHAPS_EXACT = 3e-3  #: the same, where it is worth a trial
HOPEFUL = 0.03  #: rms up to which rates of a rational function are refined
EXACT = 1e-11  #: rms of a series that is the curve
CLOSE_TO_FLOOR = 1.05  #: of the floor: with fewer branches than this takes something is left of the curve
NEAR_FLOOR = 1.01  #: a series so close to the floor needs no more branches
MERGES = 3  #: best merges of an order that are tried
SWAP_POINTS = 40  #: rates that are tried in the place of one of a series
SPLITS = (1.2, 1.6, 2.5)  #: factors by which the halves of a branch are moved apart
SWAPS = 6  #: best of these that are refined
DUAL_POINTS = 400  #: rates at which the dual is looked at


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The best series of every order, and the floor."""

    best: dict[int, Series]  #: by number of branches
    grid: Series  #: on the dense grid: as many branches as it likes


def rms(curve: MeasuredCurve, series: Series) -> float:
    """Give the root mean square of the weighted complex residual."""
    return float(np.sqrt(series.cost / curve.omega.size))


def best_series(curve: MeasuredCurve, most: int) -> Found:
    """Find the best series of every order up to `most`."""
    grid = _on_grid(curve, TRIALS_PER_DECADE)
    left = scatter(curve.weights[0] * (curve.values - grid.values(curve.omega)))
    smooth = left < SMOOTH_MISFIT
    if smooth:
        grid = _on_grid(curve, PER_DECADE_EXACT)
    best: dict[int, Series] = {}
    _offer(best, best_sizes(curve, np.zeros(0))[0])
    if left < PERHAPS_EXACT:  # few points of a computed curve look as if they were scattered
        _interpolated(curve, best, most)
        if _is_exact(curve, best):
            return Found(best, grid)
    _down(curve, best, _clustered(curve, grid, most))
    _up(curve, best, most, 0.0 if smooth else NEAR_FLOOR * rms(curve, grid))
    for order in sorted(best, reverse=True):
        if order > 1:
            for merged in _merged(curve, best[order])[:MERGES]:
                _offer(best, refined(curve, merged))
    if smooth:
        _swapped(curve, best, most)
    return Found(best, grid)


def _on_grid(curve: MeasuredCurve, per_decade: int) -> Series:
    low, high = curve.omega[0] / BEYOND, curve.omega[-1] * BEYOND
    return best_sizes(curve, np.geomspace(low, high, int(per_decade * np.log10(high / low)) + 2))[0]


def _clustered(curve: MeasuredCurve, grid: Series, most: int) -> Series:
    """Join neighbours of the grid, which stand for one branch between them."""
    w = grid.w
    if w.size == 0:
        return grid
    step = 10.0 ** (1.5 / TRIALS_PER_DECADE)
    groups = np.split(np.arange(w.size), np.flatnonzero(w[1:] > step * w[:-1]) + 1)
    centres = [float(np.exp(np.average(np.log(w[group]), weights=grid.k[group]))) for group in groups]
    series, _ = best_sizes(curve, np.array(centres))
    while series.k.size > most:
        series = _cheapest(curve, series)
    return series


def _down(curve: MeasuredCurve, best: dict[int, Series], start: Series) -> None:
    series = refined(curve, start)
    _offer(best, series)
    while series.k.size > 1:
        series = refined(curve, _cheapest(curve, series))
        _offer(best, series)


def _up(curve: MeasuredCurve, best: dict[int, Series], most: int, enough: float) -> None:
    rates = np.geomspace(curve.omega[0] / OUTSIDE * 1.1, curve.omega[-1] * OUTSIDE / 1.1, DUAL_POINTS)
    columns = curve.weighted(relaxing(curve.omega, rates))
    columns /= np.linalg.norm(columns, axis=0)
    for order in range(most):
        if order not in best:
            continue
        if rms(curve, best[order]) < max(EXACT, enough) or _is_exact(curve, best):
            return
        residual = curve.weighted(curve.values - best[order].values(curve.omega))
        rate = rates[int(np.argmax(residual @ columns))]
        _offer(best, refined(curve, best_sizes(curve, np.append(best[order].w, rate))[0]))


def _interpolated(curve: MeasuredCurve, best: dict[int, Series], most: int) -> None:
    """Take the poles of the rational functions through a computed curve, and what is below by merging."""
    for w in rational_rates(curve, most):
        start = best_sizes(curve, w)[0]
        if rms(curve, start) > HOPEFUL:
            continue
        series = refined(curve, start)
        if series.k.size <= most:
            _offer(best, series)
        if series.k.size <= most and rms(curve, series) < EXACT:
            _down(curve, best, series)
            return


def _swapped(curve: MeasuredCurve, best: dict[int, Series], most: int) -> None:
    """Look on where a computed curve has no exact series yet: from every order move, add or halve one branch."""
    rates = np.geomspace(curve.omega[0] / OUTSIDE * 1.1, curve.omega[-1] * OUTSIDE / 1.1, SWAP_POINTS)
    for order in range(1, most + 1):
        if _is_exact(curve, best):
            return
        if order not in best:
            continue
        w = best[order].w
        rest = [np.delete(w, i) for i in range(w.size)] + ([w] if order < most else [])
        trials = [np.append(part, rate) for part in rest for rate in rates]
        halves = [np.append(np.delete(w, i), [w[i] / r, w[i] * r]) for i in range(w.size) for r in SPLITS]
        for some in (trials, halves if order < most else []):
            ordered = sorted([best_sizes(curve, trial)[0] for trial in some], key=lambda found: found.cost)
            for trial in ordered[:SWAPS]:
                _offer(best, refined(curve, trial))


def _is_exact(curve: MeasuredCurve, best: dict[int, Series]) -> bool:
    return any(rms(curve, series) < EXACT for series in best.values())


def _offer(best: dict[int, Series], series: Series) -> None:
    order = int(series.k.size)
    if order not in best or series.cost < best[order].cost:
        best[order] = series


def _merged(curve: MeasuredCurve, series: Series) -> list[Series]:
    """Give the series with one branch less, by merging neighbours or dropping one, the best first."""
    w, k = series.w, series.k
    candidates = [np.delete(w, i) for i in range(w.size)]
    for i in range(w.size - 1):
        middle = np.exp(np.average(np.log(w[i : i + 2]), weights=k[i : i + 2]))
        candidates.append(np.append(np.delete(w, [i, i + 1]), middle))
    fewer = [best_sizes(curve, candidate)[0] for candidate in candidates]
    return sorted(fewer, key=lambda found: found.cost)


def _cheapest(curve: MeasuredCurve, series: Series) -> Series:
    return _merged(curve, series)[0]


def criterion(curve: MeasuredCurve, series: Series) -> float:
    """Give Akaike's criterion with its correction for few points (C. M. Hurvich and C.-L. Tsai, 1989)."""
    count = 2 * curve.omega.size
    unknowns = 1 + 2 * series.k.size + (series.k0 > 0.0) + (series.c0 > 0.0)
    if count - unknowns - 1 <= 0:
        return np.inf
    penalty = 2.0 * unknowns * (1.0 + (unknowns + 1.0) / (count - unknowns - 1.0))
    return count * float(np.log(max(series.cost, float(np.finfo(float).tiny)) / count)) + penalty


def chosen_order(curve: MeasuredCurve, best: dict[int, Series], floor: float) -> int:
    """Choose the first order that is the curve itself, else that of the least criterion among those near the floor."""
    exact = [order for order in sorted(best) if rms(curve, best[order]) < EXACT]
    if exact:
        return exact[0]
    close = [order for order in sorted(best) if rms(curve, best[order]) <= CLOSE_TO_FLOOR * floor]
    return min(close or sorted(best), key=lambda order: criterion(curve, best[order]))


def lag_one(residual: ComplexArray) -> float:
    """Give the correlation of neighbours in a complex residual."""
    size = float(np.sum(np.abs(residual) ** 2))
    return float(np.sum(residual[1:] * residual[:-1].conj()).real) / size if size > 0.0 else 0.0
