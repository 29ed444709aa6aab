"""Which poles a transfer function shows, by their residues; what grids, horizons and plots are made for.

A pole 1e7 times faster than the modes, as a weak damper at a massless node makes it, is real and may show nowhere. So
poles count by their part in H: on a circle around a pole, or a cluster of poles that rounding does not tell apart, 16
values of H give the coefficients of its Laurent series (trapezoidal rule, L. N. Trefethen and J. A. C. Weideman, 2014),

    H(s) = sum_k c_-k / (s - p)^k + regular,        own(s) = sum_k c_-k / (s - p)^k + its conjugate's.

No eigenvectors are used, whose products cancel where poles are nearly multiple.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.systems.pole_bounds import BoundedPoles, bounded_poles

Response: TypeAlias = Callable[[ComplexArray], ComplexArray]  #: s (k,) to H (p, m, k)

POINTS_AROUND = 16
TOGETHER = 16.0  #: poles nearer than this times the sum of their bounds are one cluster ...
SAME_SEEN_POLE = 1e-6  #: ... and those nearer than this part of their size
WITHIN = 0.1  #: radius of a circle, of the distance to the next pole and of the pole's size
CIRCLE_AROUND = 3.0  #: radius of a circle, of the spread of a cluster
CIRCLE_ROUNDING = 64.0 * UNIT_ROUNDOFF  #: of the largest |H| on a circle: coefficients below are none
VISIBLE = 1e-3  #: part of the rest of H that a pole adds where it adds most
MOST_TERMS = 8  #: of a principal part
MOST_CIRCLED = 200  #: states up to which circles are drawn around the poles
NO_CHANNEL = 1e-12  #: channels that move less than this part of the largest are rounding


@dataclass(frozen=True, slots=True, eq=False)
class SeenModes:
    """Poles of a transfer function with what they do in it; of conjugate pairs both."""

    poles: ComplexArray  #: (N,) all poles [rad/s], those at the origin exactly zero
    bounds: FloatArray  #: (N,) what rounding moves each [rad/s]
    in_frequency: npt.NDArray[np.bool_]  #: (N,) whether a frequency response shows the pole in some channel
    in_step: npt.NDArray[np.bool_]  #: (N,) whether a step response does

    @property
    def moving(self) -> ComplexArray:
        """Poles that a frequency response shows, without those at the origin."""
        return np.asarray(self.poles[self.in_frequency & (self.poles != 0.0)])


@dataclass(frozen=True, slots=True, eq=False)
class _Cluster:
    places: npt.NDArray[np.intp]
    centre: complex
    radius: float
    top: complex  #: where its part in a frequency response is largest


def seen_modes(
    A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, poles: BoundedPoles | None = None
) -> SeenModes:
    """Find which poles of a continuous state space are seen in some channel.

    Parameters
    ----------
    A, B, C, D : (N, N), (N, m), (p, N), (p, m) ndarrays
    poles : BoundedPoles, optional
        Eigenvalues of A, where more is known of them than A says.

    Returns
    -------
    SeenModes

    Examples
    --------
    The slow mode does not reach the output:

    >>> A, B, C = np.diag([-1.0, -1e-6]), np.ones((2, 1)), np.array([[1.0, 0.0]])
    >>> seen_modes(A, B, C, np.zeros((1, 1))).moving.tolist()
    [(-1+0j)]
    """
    found = bounded_poles(A) if poles is None else poles
    if len(A) > MOST_CIRCLED:
        return seen_by_vectors(A, B, C, D, found)
    return seen_poles(found, lambda points: state_space_response(A, B, C, D, points), np.abs(D))


def seen_poles(poles: BoundedPoles, response: Response, direct: FloatArray, *, real: bool = True) -> SeenModes:
    """Find which poles are seen in a response.

    Parameters
    ----------
    poles : BoundedPoles
    response : callable
        Gives H at points of the complex plane.
    direct : (p, m) ndarray
        Sizes of the direct terms, which a step response shows at once.
    real : bool
        Whether poles come in conjugate pairs and ``H(conj s) = conj H(s)``.
    """
    values = poles.values
    clusters = _clusters(values, poles.bounds, real=real)
    frequency, step = np.zeros((2, values.size), dtype=bool)
    step |= values == 0.0
    frequency |= values == 0.0
    if not clusters:
        return SeenModes(values, poles.bounds, frequency, step)
    turn = np.exp(2j * np.pi * np.arange(POINTS_AROUND) / POINTS_AROUND)
    circles = np.concatenate([cluster.centre + cluster.radius * turn for cluster in clusters])
    tops = np.array([cluster.top for cluster in clusters])
    with np.errstate(all="ignore"):
        found = response(np.concatenate([circles, tops]))
    on_circles = found[:, :, : circles.size].reshape(*found.shape[:2], len(clusters), POINTS_AROUND)
    at_tops = found[:, :, circles.size :]
    steps = np.empty((*found.shape[:2], len(clusters)))
    for k, cluster in enumerate(clusters):
        principal = _principal_part(on_circles[:, :, k], cluster, turn)
        frequency[cluster.places] = _is_visible(principal, cluster, at_tops[:, :, k], real=real)
        sizes = np.abs(cluster.centre) ** -np.arange(1.0, len(principal) + 1.0)
        steps[:, :, k] = np.einsum("kij,k->ij", np.abs(principal), sizes)
    step |= _in_step(steps, direct, clusters, values.size)
    if real:
        frequency, step = _mirrored(values, frequency), _mirrored(values, step)
    return SeenModes(values, poles.bounds, frequency, step)


def seen_by_vectors(A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, poles: BoundedPoles) -> SeenModes:
    """Find which poles of a large continuous state space are seen, by residues from eigenvectors.

    Cheaper than `seen_modes` where there are hundreds of states: one decomposition gives the residues
    ``(C v)(w^H B) / (w^H v)`` of all, and H is their sum. Multiple poles count together.

    Parameters
    ----------
    A, B, C, D : (N, N), (N, m), (p, N), (p, m) ndarrays
    poles : BoundedPoles
        Eigenvalues of A.

    Returns
    -------
    SeenModes

    Examples
    --------
    >>> A, B, C = np.diag([-1.0, -1e-6]), np.ones((2, 1)), np.array([[1.0, 0.0]])
    >>> seen_by_vectors(A, B, C, np.zeros((1, 1)), bounded_poles(A)).moving.tolist()
    [(-1+0j)]
    """
    matrix, scale = balanced_states(A)
    found = scipy.linalg.eig(matrix, left=True, right=True)
    values, left, right = (np.asarray(part, dtype=np.complex128) for part in found)
    product = np.einsum("ik,ik->k", left.conj(), right)
    with np.errstate(all="ignore"):
        out, drive = (C * scale) @ right, (left.conj().T @ (B / scale[:, None])) / product[:, None]
    out, drive = np.nan_to_num(out), np.nan_to_num(drive)
    nearest = np.abs(poles.values[:, None] - values).argmin(axis=1)
    clusters = _clusters(poles.values, poles.bounds, real=True)
    frequency, step = np.tile(poles.values == 0.0, (2, 1))
    steps = np.zeros((*D.shape, len(clusters)))
    for k, cluster in enumerate(clusters):
        with np.errstate(all="ignore"):
            whole = D + (out / (cluster.top - values)) @ drive
        own = np.zeros(D.shape, dtype=np.complex128)
        for place in nearest[cluster.places].tolist():
            residue = np.outer(out[:, place], drive[place])
            with np.errstate(all="ignore"):
                own += residue / (cluster.top - values[place])
                if values[place].imag != 0.0:
                    own += residue.conj() / (cluster.top - values[place].conjugate())
                steps[:, :, k] += np.abs(residue) / np.abs(values[place])
        with np.errstate(all="ignore"):
            shown = ~np.isfinite(whole) | ~np.isfinite(own) | (np.abs(own) > VISIBLE * np.abs(whole - own))
        frequency[cluster.places] = bool((shown & (own != 0.0)).any())
    step |= _in_step(np.nan_to_num(steps), np.abs(D), clusters, poles.values.size)
    return SeenModes(poles.values, poles.bounds, _mirrored(poles.values, frequency), _mirrored(poles.values, step))


def _clusters(values: ComplexArray, bounds: FloatArray, *, real: bool) -> list[_Cluster]:
    """Group the poles away from the origin, of real systems those of the upper half plane."""
    places = np.flatnonzero((values != 0.0) & ((values.imag >= 0.0) | (not real)))
    left, clusters = places.tolist(), []
    while left:
        members = [left.pop(0)]
        for member in members:  # grows while it is walked
            near = [
                other
                for other in left
                if abs(values[other] - values[member])
                <= max(TOGETHER * (bounds[other] + bounds[member]), SAME_SEEN_POLE * abs(values[member]))
            ]
            members += near
            left = [other for other in left if other not in near]
        own = np.array(members)
        centre = complex(values[own].mean())
        others = np.delete(values, own)
        gap = float(np.abs(others - centre).min(initial=np.inf))
        spread = float(np.abs(values[own] - centre).max())
        radius = max(WITHIN * min(gap, abs(centre)), CIRCLE_AROUND * spread)
        height = abs(centre.imag) or abs(centre)
        doubt = TOGETHER * float(bounds[own].max())
        beside = doubt if abs(centre.real) <= doubt < height else 0.0  # where damping is rounding, H on the axis is too
        clusters.append(_Cluster(own, centre, radius or abs(centre), complex(beside, height)))
    return clusters


def _principal_part(values: ComplexArray, cluster: _Cluster, turn: ComplexArray) -> ComplexArray:
    """Return c_-1, c_-2, ... (k, p, m), zero where they are rounding."""
    largest = np.abs(values).max(axis=2)
    terms = []
    for k in range(1, min(cluster.places.size, MOST_TERMS) + 1):
        mean = (values * turn**k).mean(axis=2)
        terms.append(np.where(np.abs(mean) > CIRCLE_ROUNDING * largest, mean * cluster.radius**k, 0.0))
    return np.asarray(np.nan_to_num(np.array(terms)))


def _is_visible(principal: ComplexArray, cluster: _Cluster, value: ComplexArray, *, real: bool) -> bool:
    """Tell whether a cluster adds to H, where it adds most, more than a thousandth of the rest."""
    top = cluster.top
    there = np.abs(principal).max(axis=0) > 0.0
    with np.errstate(all="ignore"):
        own = np.zeros_like(value)
        for k, term in enumerate(principal, start=1):
            own += term / (top - cluster.centre) ** k
            if real and cluster.centre.imag != 0.0:
                own += term.conj() / (top - cluster.centre.conjugate()) ** k
        rest = np.abs(value - own)
        seen = there & (~np.isfinite(value) | ~np.isfinite(own) | (np.abs(own) > VISIBLE * rest))
    return bool(seen.any())


def _in_step(steps: FloatArray, direct: FloatArray, clusters: list[_Cluster], count: int) -> npt.NDArray[np.bool_]:
    """Return which poles move some output by more than a thousandth of its largest movement."""
    largest = np.maximum(steps.max(axis=2), direct)
    largest = np.maximum(largest, NO_CHANNEL * largest.max(initial=0.0))
    shown = (steps > VISIBLE * largest[:, :, None]).any(axis=(0, 1))
    seen = np.zeros(count, dtype=bool)
    for cluster, is_shown in zip(clusters, shown.tolist(), strict=True):
        seen[cluster.places] = is_shown
    return seen


def _mirrored(values: ComplexArray, seen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Give the lower halves of conjugate pairs what the upper ones have."""
    mirrored = seen.copy()
    for place in np.flatnonzero(values.imag < 0.0).tolist():
        partner = int(np.abs(values - values[place].conjugate()).argmin())
        mirrored[place] = seen[partner]
    return mirrored
