"""The phase of a response on one branch, from poles and zeros and not from its samples.

    phi(w) = sum_zeros th(w - z) - sum_poles th(w - p) + what it is at w = 0,
    th(w - r) = atan2(w - b, |a|)  for a root r = a + jb on or left of the axis, its negative right of it

and likewise along the unit circle for discrete systems (`phase_sources`). A root on the axis counts as the limit of
vanishing damping: a pole lowers the phase by 180 deg, a zero raises it. At w = 0 the phase is 90 deg for each zero at
the origin, less 90 deg for each pole there, and 180 deg beside that if the gain is negative, on the side nearer to 0.
What is shown is the angle of the value itself, on the turn nearest to phi, so that any grid gives the same branch.
Where phi and the values disagree the zeros are wrong, and where there are too many of them none are computed; then the
phase is followed along half circles in the right half plane, over each interval of the grid, where a response without
roots there is smooth. At a DOF that is driven and observed it is known without either: work is done on the structure,
so that a receptance stays between 0 and -180 deg.
"""

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.phase_sources import SOURCE, KnownSource, LargeSource, Plane, Source
from halfdof_ctrl.systems.pole_bounds import BoundedPoles
from halfdof_ctrl.systems.sampled_phase import continuous_phase

ON_AXIS = 4.0  #: times its bound: a pole nearer to the axis is on it
ZERO_ON_AXIS = 1e-9  #: of its size: a zero nearer to the axis is on it
CANCELLED = 1e-9  #: of its size: a zero so near to a pole is the pole of a motion that is not reached
SAME = 1e-15  #: of its size: poles and zeros nearer than this are at one place
AGREES = 1e-3  #: [rad] between phi and the angle of the values
AGREES_IN_SIZE = 1e-2  #: between the logarithms of their sizes
GARBLED = 1.0  #: the same of a value that is rounding, fifty decades below the largest, or beside a needle ...
MOST_GARBLED = 0.05  #: ... of which so many, as part of all, ...
LONGEST_GARBLED = 2  #: ... and so many side by side say nothing about poles and zeros
UNSURE = 0.1  #: [rad] by which bounds of poles may turn phi: where they may do more, nothing is compared
BESIDE_POLE = 1e-9  #: relative distance to a pole on the axis within which the angle says nothing
PHASE_BESIDE_ZERO = 1e-7  #: the same for a zero, where the value is rounding
POLE_EFFORT = 1.1e9  #: cubed size up to which poles are computed
PHASE_ZERO_EFFORT = 3e8  #: channels times cubed size up to which zeros are computed
BOTH_SIDES = (1.0 - 4.0 * PHASE_BESIDE_ZERO, 1.0 + 4.0 * PHASE_BESIDE_ZERO)
CIRCLE_EFFORT = 1e8  #: channels times frequencies times squared size up to which half circles are followed
RATIO = 1.2  #: of the ends of an interval that a half circle spans
PHASE_STEP = np.pi / 3.0  #: [rad] largest change between points of a half circle
ARC_POINTS = 5
HALVINGS = 6
CLOSEST = 16.0  #: times what rounding leaves between two points: as near to its ends a half circle is followed
BELOW = 1e-2  #: of the slowest pole: where the phase is what it is at the origin
TIED = 1.0  #: [rad] two starts that are so nearly as far from 0: the negative one is taken
SIDE = 1e-6  #: [rad] by which rounding puts a phase outside what work on the structure allows


def response_phase(data: control.FrequencyResponseData) -> FloatArray:
    """Return the phase of all channels of a response [rad].

    Parameters
    ----------
    data : control.FrequencyResponseData
        Of functions of this package the branch follows from poles and zeros, continuous or discrete, of the model; of
        others, and of sparse models with more than 1000 states, from the samples (`continuous_phase`), but where a DOF
        is both driven and observed.

    Returns
    -------
    (p, m, k) ndarray
        NaN where a value has no phase.

    Examples
    --------
    Two undamped resonances with an antiresonance between; three samples would not tell:

    >>> model = mechss(np.eye(2), None, [[2, -1], [-1, 2]]).select("F_q0", "q0")
    >>> np.degrees(response_phase(frequency_response(model, [0.5, 1.2, 9.0]))).round(6).tolist()
    [[[0.0, -180.0, -180.0]]]
    """
    values, omega = np.asarray(data.frdata), np.asarray(data.omega, dtype=float)
    given: Source | None = getattr(data, SOURCE, None)
    source = given.reduced() if isinstance(given, LargeSource) else given
    channels = values.shape[0] * values.shape[1]
    poles = source.poles() if source is not None and source.size**3 <= POLE_EFFORT else None
    phase = np.empty(values.shape)
    for i, j in np.ndindex(*values.shape[:2]):
        found = None
        if source is not None and poles is not None and channels * source.size**3 <= PHASE_ZERO_EFFORT:
            found = _by_roots(source, poles, (i, j), omega, values[i, j])
        if found is None and given is not None and given.model is not None:
            found = _by_work(given.model, (i, j), values[i, j])
        if found is None and source is not None and channels * omega.size * source.size**2 <= CIRCLE_EFFORT:
            found = _along_half_circles(source, poles, (i, j), omega, values[i, j])
        phase[i, j] = continuous_phase(values[i, j]) if found is None else found
    return phase


def _angle(values: ComplexArray) -> FloatArray:
    return np.where((values == 0.0) | ~np.isfinite(values), np.nan, np.angle(values))


def _on_turn(angle: FloatArray, phi: FloatArray) -> FloatArray:
    """Put angles on the turn nearest to phi."""
    turns = np.round((phi - angle) / (2.0 * np.pi))
    return np.asarray(angle + 2.0 * np.pi * np.where(np.isnan(turns), 0.0, turns))


def _wrapped(angle: npt.ArrayLike) -> FloatArray:
    """Put angles between -pi and pi."""
    return np.asarray(np.mod(np.asarray(angle) + np.pi, 2.0 * np.pi) - np.pi)


def _by_roots(
    source: KnownSource, poles: BoundedPoles, channel: tuple[int, int], omega: FloatArray, values: ComplexArray
) -> FloatArray | None:
    """Return the phase from poles and zeros, None where it does not agree with the values."""
    plane, zeros = source.plane, source.zeros(*channel)
    p = plane.on_boundary(poles.values, ON_AXIS * poles.bounds)
    z = plane.on_boundary(zeros, ZERO_ON_AXIS * np.abs(zeros))
    p, z, close = _without_common(p, ON_AXIS * poles.bounds, z, plane)
    gain = _gain(source, channel, p, z)
    if gain is None:
        return None
    slow_z, slow_p = plane.at_start(z), plane.at_start(p)
    base = 0.5 * np.pi * float(np.count_nonzero(slow_z) - np.count_nonzero(slow_p))
    none = np.zeros(1)
    begin = float((plane.swept(none, z[~slow_z]) - plane.swept(none, p[~slow_p]))[0])
    rest = _start(base, gain.imag + plane.constant(z) - plane.constant(p) + begin, is_real=source.is_real)
    phi = plane.swept(omega, z) - plane.swept(omega, p) - begin + rest
    angle = _angle(values)
    away = np.ones(omega.size, dtype=bool)
    for roots, beside in ((p, BESIDE_POLE), (np.append(z, close), PHASE_BESIDE_ZERO)):
        for root in plane.touching(roots):
            away &= np.abs(omega - root.imag) > beside * omega
    points = plane.points(np.asarray(1j * omega, dtype=np.complex128))
    doubt = _doubt(points, poles)
    sure = away & (doubt < UNSURE) & ~np.isnan(angle)
    turned = np.abs(_wrapped(angle - phi))[sure] - ON_AXIS * doubt[sure]
    grown = np.abs(np.log(np.abs(values[sure])) - _log_size(points[sure], p, z, gain)) - ON_AXIS * doubt[sure]
    sound = ~_garbled(grown)
    turned, grown = turned[sound], grown[sound]
    if not (turned.max(initial=0.0) < AGREES and grown.max(initial=0.0) < AGREES_IN_SIZE):
        return None
    sides = [plane.swept(omega * shift, z) - plane.swept(omega * shift, p) - begin + rest for shift in BOTH_SIDES]
    return _on_turn(angle, np.where(away, phi, _nearer(angle, *sides)))


def _garbled(grown: FloatArray) -> npt.NDArray[np.bool_]:
    """Tell which values are rounding: single ones, or two side by side, among many that have the size of the roots."""
    garbled = grown > GARBLED
    edges = np.diff(np.concatenate([[False], garbled, [False]]).astype(int))
    runs = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    few = np.count_nonzero(garbled) <= MOST_GARBLED * garbled.size and runs.max(initial=0) <= LONGEST_GARBLED
    return garbled & bool(few and not garbled[-1:].any())


def _doubt(points: ComplexArray, poles: BoundedPoles) -> FloatArray:
    """Return by how much the bounds of poles may turn the phase [rad]: much beside those that lie close to the axis."""
    doubt = np.zeros(points.size)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        for pole, bound in zip(poles.values.tolist(), poles.bounds.tolist(), strict=True):
            doubt += np.minimum(bound / np.abs(points - pole), 1.0) if bound else 0.0
    return np.nan_to_num(doubt, nan=1.0)


def _nearer(angle: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return of two phases, on both sides of a root on the axis, the one that an angle agrees with."""
    return np.where(np.abs(_wrapped(angle - first)) <= np.abs(_wrapped(angle - second)), first, second)


def _start(base: float, rest: float, *, is_real: bool) -> float:
    """Return what the phase has at the origin beside 90 deg for each root there: nearest to 0, ties below."""
    rest = float(_wrapped(rest))
    if is_real:
        rest = 0.0 if abs(rest) < np.pi / 2.0 else -np.pi
    if abs(rest) < np.pi / 2.0:
        return rest
    low = rest - 2.0 * np.pi if rest > 0.0 else rest
    return low + 2.0 * np.pi if abs(base + low + 2.0 * np.pi) < abs(base + low) - TIED else low


def _without_common(
    poles: ComplexArray, doubts: FloatArray, zeros: ComplexArray, plane: Plane
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Take out zeros with the poles that they cancel; return poles and zeros that are left, and boundary pairs' zeros.

    On the boundary a pole and a zero side by side turn the phase between them, and cancel elsewhere by themselves.
    Beside both of them values are rounding.
    """
    left, kept, close = list(range(poles.size)), [], []
    for zero in zeros.tolist():
        places = np.array(left, dtype=np.intp)
        apart = np.abs(poles[places] - zero)
        allowed = np.maximum(CANCELLED * abs(zero), doubts[places] * (zero != 0.0))
        near = np.flatnonzero(apart <= allowed)
        if near.size == 0:
            kept.append(zero)
            continue
        place = int(near[apart[near].argmin()])
        pair = np.array([poles[left[place]], zero])
        touching = plane.touching(pair).size == pair.size
        if touching:
            close.append(zero)
        if touching and apart[place] > doubts[left[place]] + SAME * abs(zero):
            kept.append(zero)
        else:
            left.pop(place)
    return poles[left], np.array(kept, dtype=np.complex128), np.array(close, dtype=np.complex128)


def _gain(source: KnownSource, channel: tuple[int, int], poles: ComplexArray, zeros: ComplexArray) -> complex | None:
    """Return log k in ``H = k prod(s - z) / prod(s - p)``, from one real point; None where there is none."""
    point = source.plane.gain_point(np.concatenate([poles, zeros]))
    value = complex(source.response(*channel, np.array([point], dtype=np.complex128))[0])
    if not np.isfinite(value) or value == 0.0:
        return None
    return complex(np.log(value) + np.log(point - poles).sum() - np.log(point - zeros).sum())


def _log_size(points: ComplexArray, poles: ComplexArray, zeros: ComplexArray, gain: complex) -> FloatArray:
    """Return log size of H by poles and zeros; the angles alone do not tell four zeros at the origin from none."""
    size = np.full(points.size, gain.real)
    with np.errstate(divide="ignore"):
        for roots, sign in ((zeros, 1.0), (poles, -1.0)):
            for root in roots.tolist():
                size += sign * np.log(np.abs(points - root))
    return size


def _by_work(model: SecondOrderModel, channel: tuple[int, int], values: ComplexArray) -> FloatArray | None:
    """Return the phase of a motion at the place of its force; None for others, or where no damper takes the work."""
    order = _derivative_at_force(model, *channel)
    return None if order is None else phase_by_work(values, order)


def phase_by_work(values: ComplexArray, order: int) -> FloatArray | None:
    """Return the phase [rad] of a derivative of the motion at the place of its force; None where no work is done there.

    Examples
    --------
    >>> np.degrees(phase_by_work(np.array([1.0, -1.0, 0.5, -0.1j]), 0)).tolist()
    [0.0, -180.0, 0.0, -90.0]
    """
    middle = (order - 1) * np.pi / 2.0
    phase = _on_turn(_angle(values), np.full(values.size, middle))
    outside = np.abs(phase - middle) > np.pi / 2.0 + SIDE
    return None if outside.any() else phase


def _derivative_at_force(model: SecondOrderModel, output: int, source: int) -> int | None:
    """Return which derivative of the motion at its own force an output is, of a symmetric model; else None."""
    others = [as_sparse(part)[:, [source]] for part in (model.Bv, model.Ba)]
    others += [as_sparse(part)[[output]][:, [source]] for part in (model.D, model.Dv, model.Da)]
    if any([np.abs(part.data).any() for part in others]):  # noqa: C419
        return None
    force = as_sparse(model.B)[:, [source]].toarray()[:, 0]
    rows = [as_sparse(part)[[output]].toarray()[0] for part in (model.F, model.G, model.H)]
    there = [k for k, row in enumerate(rows) if row.any()]
    if len(there) != 1 or not force.any() or np.iscomplexobj(force):
        return None
    row = rows[there[0]]
    share = float(row @ force) / float(force @ force)
    if share <= 0.0 or not np.array_equal(row, share * force):
        return None
    symmetric = all([abs(part - part.T).max() == 0.0 for part in map(as_sparse, (model.M, model.C, model.K))])  # noqa: C419
    return there[0] if symmetric else None


def _along_half_circles(
    source: KnownSource, poles: BoundedPoles | None, channel: tuple[int, int], omega: FloatArray, values: ComplexArray
) -> FloatArray | None:
    """Follow the phase through the right half plane, from below the slowest pole; None where that fails."""
    plane, right = source.plane, np.zeros(0, dtype=np.complex128)
    known = (omega > 0.0) & np.isfinite(values) & (values != 0.0)
    if poles is not None:
        roots = plane.on_boundary(poles.values, ON_AXIS * poles.bounds)
        for root in plane.touching(roots):  # where the angle is rounding
            known &= np.abs(omega - root.imag) > BESIDE_POLE * omega
    there = np.flatnonzero(known)
    if there.size == 0:
        return None
    slowest = first = float(omega[there[0]])
    if poles is not None:
        moving, right = plane.exponents(roots[~plane.at_start(roots)]), plane.exponents(plane.unstable(roots))
        slowest = min(first, BELOW * float(np.abs(moving).min(initial=first / BELOW)))
    nodes = np.append(slowest, omega[there])
    changes = _changes(source, channel, nodes)
    begin = _begin(source, channel, slowest) if poles is not None else continuous_phase(values)[there[0]]
    if changes is None or begin is None:
        return None
    centres, radii = 0.5j * (nodes[1:] + nodes[:-1]), 0.5 * np.diff(nodes)
    for root in right:
        changes -= 2.0 * np.pi * (np.abs(root - centres) < radii)
    angle = _angle(values)
    phase = angle.copy()
    phase[there] = _on_turn(angle[there], begin + np.cumsum(changes))
    beside = np.flatnonzero(~known & ~np.isnan(angle))
    phase[beside] = _on_turn(angle[beside], np.interp(omega[beside], omega[there], phase[there]))
    return phase


def _begin(source: KnownSource, channel: tuple[int, int], omega: float) -> float | None:
    """Return the phase below the slowest pole, from the slope of the magnitude there."""
    found = source.response(*channel, source.plane.points(1j * np.array([omega, 2.0 * omega])))
    if not (np.isfinite(found) & (found != 0.0)).all():
        return None
    base = 0.5 * np.pi * float(np.round(np.log2(np.abs(found[1] / found[0]))))
    angle = float(np.angle(found[0]))
    rest = _start(base, angle - base, is_real=source.is_real)
    return float(_on_turn(np.array([angle]), np.array([base + rest]))[0])


def _changes(source: KnownSource, channel: tuple[int, int], nodes: FloatArray) -> FloatArray | None:
    """Return the change of the phase between frequencies; None where it is not followed."""
    turns = np.exp(1j * np.linspace(-np.pi / 2.0, np.pi / 2.0, ARC_POINTS))[1:-1]
    paths, ends = [], []
    for low, high in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
        pieces = _pieces(low, high, source.plane.widest)
        ends.append(pieces)
        paths.append(_half_circles(pieces, turns))
    found = source.response(*channel, source.plane.points(np.concatenate(paths)))
    changes = np.empty(len(paths))
    for k, part in enumerate(np.split(found, np.cumsum([path.size for path in paths])[:-1])):
        with np.errstate(all="ignore"):
            steps = np.angle(part[1:] / part[:-1])
        if np.isfinite(steps).all() and np.abs(steps).max(initial=0.0) < PHASE_STEP:
            changes[k] = steps.sum()
            continue
        change = _finer_change(source, channel, ends[k])
        if change is None:
            return None
        changes[k] = change
    return changes


def _pieces(low: float, high: float, widest: float) -> FloatArray:
    """Cut an interval into pieces of at most a ratio and a width."""
    ends = [low]
    while (next_end := min(ends[-1] * RATIO, ends[-1] + widest)) < high:
        ends.append(next_end)
    return np.array([*ends, high])


def _half_circles(ends: FloatArray, turns: ComplexArray) -> ComplexArray:
    """Return points from j times the first end to the last, along half circles to the right of the axis."""
    path = [np.array([1j * ends[0]])]
    for low, high in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        path += [0.5j * (low + high) + 0.5 * (high - low) * turns, np.array([1j * high])]
    return np.concatenate(path)


def _finer_change(source: KnownSource, channel: tuple[int, int], ends: FloatArray) -> float | None:
    """Return the change of the phase over an interval from more and more points, ever closer towards its ends.

    An end may lie beside a root on the axis, around which the phase turns within that distance.
    """
    ratio = 2.0
    for _ in range(HALVINGS):
        closest = CLOSEST * source.plane.resolution(float(ends[-1])) / float(np.diff(ends).max())
        part = 0.5 * ratio ** -np.arange(max(np.ceil(-np.log(closest) / np.log(ratio)), 1.0))
        turns = np.exp(1j * np.pi * (np.concatenate([part[::-1], 1.0 - part[1:]]) - 0.5))
        found = source.response(*channel, source.plane.points(_half_circles(ends, turns)))
        if (np.isfinite(found) & (found != 0.0)).all():
            steps = np.angle(found[1:] / found[:-1])
            if np.abs(steps).max() < PHASE_STEP:
                return float(steps.sum())
            ratio = np.sqrt(ratio)
            continue
        ends = np.sort(np.append(ends, 0.5 * (ends[1:] + ends[:-1])))
    return None
