"""The phase of a response on one branch, from poles and zeros and not from its samples.

    phi(w) = sum_zeros th(w - z) - sum_poles th(w - p)   [- 180 deg if the gain at low frequency is negative],
    th(w - r) = atan2(w - b, |a|)  for a root r = a + jb on or left of the axis, its negative right of it

A root on the axis counts as the limit of vanishing damping: a pole lowers the phase by 180 deg, a zero raises it.
What is shown is the angle of the value itself, on the turn nearest to phi, so that any grid gives the same branch.
Where phi and the values disagree the zeros are wrong; then the phase is followed along half circles in the right half
plane, over each interval of the grid, where a response without roots there is smooth.
"""

from dataclasses import dataclass

import control
import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.channel_zeros import descriptor_zeros, system_zeros
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.systems.pencil_poles import pencil_poles
from halfdof_ctrl.systems.pole_bounds import BoundedPoles, bounded_poles
from halfdof_ctrl.systems.sampled_phase import continuous_phase
from halfdof_ctrl.systems.state_space_data import StateSpaceData

SOURCE = "halfdof_source"  #: attribute of a FrequencyResponseData: where its values come from
ON_AXIS = 4.0  #: times its bound: a pole nearer to the axis is on it
ZERO_ON_AXIS = 1e-9  #: of its size: a zero nearer to the axis is on it
CANCELLED = 1e-9  #: of its size: a zero so near to a pole is the pole of a motion that is not reached
AGREES = 1e-3  #: [rad] between phi and the angle of the values
BESIDE = 1e-9  #: relative distance to a root on the axis within which the angle says nothing
EFFORT = 2e8  #: channels times cubed size up to which zeros are computed
LARGEST_DENSE = 300  #: DOFs of a model up to which they are
RATIO = 1.2  #: of the ends of an interval that a half circle spans
STEP = np.pi / 3.0  #: [rad] largest change between points of a half circle
ARC_POINTS = 5
HALVINGS = 6


@dataclass(frozen=True, slots=True, eq=False)
class SystemSource:
    """Values come from a continuous state space."""

    data: StateSpaceData

    @property
    def size(self) -> int:
        """Order."""
        return len(self.data.A)

    def poles(self) -> BoundedPoles:
        """Return the poles."""
        return bounded_poles(self.data.A)

    def zeros(self, output: int, source: int) -> ComplexArray:
        """Return the zeros of a channel."""
        return system_zeros(self.data.channel(output, source))

    def response(self, output: int, source: int, points: ComplexArray) -> ComplexArray:
        """Evaluate a channel."""
        return np.asarray(state_space_response(*self.data.channel(output, source), points)[0, 0])


@dataclass(frozen=True, slots=True, eq=False)
class ModelSource:
    """Values come from a real, dense model."""

    model: SecondOrderModel

    @property
    def size(self) -> int:
        """Order of the pencil."""
        return 2 * len(self.model.dofs)

    def poles(self) -> BoundedPoles:
        """Return the finite eigenvalues."""
        return pencil_poles(self.model)

    def zeros(self, output: int, source: int) -> ComplexArray:
        """Return the zeros of a channel."""
        return descriptor_zeros(self.model, output, source)

    def response(self, output: int, source: int, points: ComplexArray) -> ComplexArray:
        """Evaluate a channel."""
        channel = self.model.select(self.model.inputs[source], self.model.outputs[output])
        return np.asarray(channel(points, squeeze=False)[0, 0])


Source = SystemSource | ModelSource


def with_source(data: control.FrequencyResponseData, source: Source | None) -> control.FrequencyResponseData:
    """Note in a response where its values come from."""
    if source is not None:
        setattr(data, SOURCE, source)
    return data


def source_of(sysdata: control.StateSpace | SecondOrderModel) -> Source | None:
    """Return what the phase of a system or model follows from, None where its samples are all there is."""
    if isinstance(sysdata, SecondOrderModel):
        usable = not sysdata.is_sparse and not sysdata.is_complex and len(sysdata.dofs) <= LARGEST_DENSE
        return ModelSource(sysdata) if usable else None
    if sysdata.isdtime(strict=True):
        return None
    return SystemSource(StateSpaceData.of(sysdata))


def response_phase(data: control.FrequencyResponseData) -> FloatArray:
    """Return the phase of all channels of a response [rad].

    Parameters
    ----------
    data : control.FrequencyResponseData
        Of functions of this package the branch follows from poles and zeros of the model; of others, of discrete and of
        sparse models from the samples (`continuous_phase`).

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
    source: Source | None = getattr(data, SOURCE, None)
    phase = np.empty(values.shape)
    few = source is not None and values.shape[0] * values.shape[1] * source.size**3 <= EFFORT
    poles = source.poles() if source is not None and few else None
    for i, j in np.ndindex(*values.shape[:2]):
        found = None
        if source is not None and poles is not None:
            found = _by_roots(source, poles, (i, j), omega, values[i, j])
            if found is None:
                found = _along_half_circles(source, poles, (i, j), omega, values[i, j])
        phase[i, j] = continuous_phase(values[i, j]) if found is None else found
    return phase


def _angle(values: ComplexArray) -> FloatArray:
    return np.where((values == 0.0) | ~np.isfinite(values), np.nan, np.angle(values))


def _on_turn(angle: FloatArray, phi: FloatArray) -> FloatArray:
    """Put angles on the turn nearest to phi."""
    turns = np.round((phi - angle) / (2.0 * np.pi))
    return np.asarray(angle + 2.0 * np.pi * np.where(np.isnan(turns), 0.0, turns))


def _by_roots(
    source: Source, poles: BoundedPoles, channel: tuple[int, int], omega: FloatArray, values: ComplexArray
) -> FloatArray | None:
    """Return the phase from poles and zeros, None where it does not agree with the values."""
    zeros = source.zeros(*channel)
    left, zeros = _without_common(poles, zeros)
    p = poles.values[left].copy()
    on_axis = np.abs(p.real) <= ON_AXIS * poles.bounds[left]
    p[on_axis] = 1j * p[on_axis].imag
    z = np.where(np.abs(zeros.real) <= ZERO_ON_AXIS * np.abs(zeros), 1j * zeros.imag, zeros)
    gain = _sign_of_gain(source, channel, p, z)
    if gain == 0.0:
        return None
    phi = _swept(omega, z) - _swept(omega, p)
    if gain * (-1.0) ** np.count_nonzero(np.concatenate([p, z]).real > 0.0) < 0.0:
        at_start = -(np.count_nonzero(p == 0.0) - np.count_nonzero(z == 0.0)) * np.pi / 2.0
        phi += np.pi if abs(at_start + np.pi) < abs(at_start - np.pi) else -np.pi
    angle = _angle(values)
    away = np.ones(omega.size, dtype=bool)
    for root in np.concatenate([p, z]):
        if root.real == 0.0:
            away &= np.abs(omega - root.imag) > BESIDE * omega
    difference = np.abs(np.mod(angle - phi + np.pi, 2.0 * np.pi) - np.pi)[away]
    if not np.nan_to_num(difference).max(initial=0.0) < AGREES:
        return None
    return _on_turn(angle, phi)


def _without_common(poles: BoundedPoles, zeros: ComplexArray) -> tuple[list[int], ComplexArray]:
    """Take out zeros with the poles that they cancel; return the places of the poles left."""
    left, kept = list(range(poles.values.size)), []
    for zero in zeros.tolist():
        near = [
            place
            for place in left
            if abs(poles.values[place] - zero)
            <= max(CANCELLED * abs(zero), ON_AXIS * float(poles.bounds[place]) * (zero != 0.0))
        ]
        if near:
            left.remove(min(near, key=lambda place: abs(poles.values[place] - zero)))
        else:
            kept.append(zero)
    return left, np.array(kept, dtype=np.complex128)


def _swept(omega: FloatArray, roots: ComplexArray) -> FloatArray:
    """Return the sum of th(w - r) over the roots."""
    total = np.zeros(omega.size)
    for root in roots.tolist():
        angle = np.arctan2(omega - root.imag, abs(root.real))
        total += -angle if root.real > 0.0 else angle
    return total


def _sign_of_gain(source: Source, channel: tuple[int, int], poles: ComplexArray, zeros: ComplexArray) -> float:
    """Return the sign of k in ``H = k prod(s - z) / prod(s - p)``, from one real point; 0 where there is none."""
    sizes = np.abs(np.concatenate([poles, zeros]))
    sizes = sizes[sizes > 0.0]
    s = float(np.exp(np.log(sizes).mean())) * 1.1 if sizes.size else 1.0
    value = complex(source.response(*channel, np.array([s], dtype=np.complex128))[0])
    if not np.isfinite(value) or value.real == 0.0:
        return 0.0
    turn = np.exp(1j * (np.angle(s - poles).sum() - np.angle(s - zeros).sum()))
    return float(np.sign((value * turn).real))


def _along_half_circles(
    source: Source, poles: BoundedPoles, channel: tuple[int, int], omega: FloatArray, values: ComplexArray
) -> FloatArray | None:
    """Follow the phase through the right half plane; None where values are missing at the start."""
    there = np.flatnonzero((omega > 0.0) & np.isfinite(values) & (values != 0.0))
    if there.size == 0 or there.size != np.count_nonzero(omega > 0.0):
        return None
    right = poles.values[poles.values.real > ON_AXIS * poles.bounds]
    start = continuous_phase(values)[there[0]]
    phase = np.full(omega.size, np.nan)
    phase[omega == 0.0] = _angle(values)[omega == 0.0]
    phase[there[0]] = start
    for first, second in zip(there[:-1].tolist(), there[1:].tolist(), strict=True):
        change = _change(source, channel, float(omega[first]), float(omega[second]))
        if change is None:
            return None
        centre, radius = 0.5j * (omega[first] + omega[second]), 0.5 * (omega[second] - omega[first])
        change -= 2.0 * np.pi * np.count_nonzero(np.abs(right - centre) < radius)
        phase[second] = _on_turn(_angle(values[[second]]), np.array([phase[first] + change]))[0]
    return phase


def _change(source: Source, channel: tuple[int, int], low: float, high: float) -> float | None:
    """Return the change of the phase from j low to j high along half circles, each over a small ratio."""
    pieces = max(1, int(np.ceil(np.log(high / low) / np.log(RATIO))))
    ends = np.geomspace(low, high, pieces + 1)
    count = ARC_POINTS
    for _ in range(HALVINGS):
        turns = np.exp(1j * np.linspace(-np.pi / 2.0, np.pi / 2.0, count))[1:-1]
        centres, radii = 0.5j * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
        path = [np.array([1j * ends[0]])]
        for centre, radius, end in zip(centres, radii, ends[1:], strict=True):
            path += [centre + radius * turns, np.array([1j * end])]
        found = source.response(*channel, np.concatenate(path))
        if not (np.isfinite(found) & (found != 0.0)).all():
            ends = np.geomspace(low, high, len(ends) + 1)
            ends[0], ends[-1] = low, high
            continue
        steps = np.angle(found[1:] / found[:-1])
        if np.abs(steps).max() < STEP:
            return float(steps.sum())
        count = 2 * count - 1
    return None
