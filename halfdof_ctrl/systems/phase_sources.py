"""Where the values of a response come from, and the plane in which their poles and zeros lie.

The phase of a response along the boundary of stability, s = j w or z = exp(j w dt), is a sum over roots r of the
angle of (point - r). Each is split into a constant and a part that is continuous in w,

    s-plane, r = a + jb:   atan2(w - b, |a|), its negative right of the axis,   constant 0, or pi right of the axis
    z-plane, in the circle:   w dt + arg(1 - r exp(-j w dt)),   constant 0
    z-plane, outside:   arg(1 - exp(j w dt) / r),   constant arg(-r)

A root on the boundary counts as the limit of vanishing damping.
"""

from dataclasses import dataclass, field
from typing import TypeAlias

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, FloatArray
from halfdof_ctrl.base.errors import HalfdofError
from halfdof_ctrl.model.kinds import null_column_kinds
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.channel_zeros import descriptor_zeros, system_zeros
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.systems.pencil_poles import pencil_poles
from halfdof_ctrl.systems.pole_bounds import BoundedPoles, bounded_poles
from halfdof_ctrl.systems.state_space import mech2ss
from halfdof_ctrl.systems.state_space_data import StateSpaceData

SOURCE = "halfdof_source"  #: attribute of a FrequencyResponseData: where its values come from
PHASE_SOURCES_LARGEST_PENCIL = 300  #: DOFs of a model up to which poles and zeros are those of its pencil
SAMPLED_WIDTH = 0.05  #: [rad] of the unit circle that a half circle spans
MOST_REDUCED = 1000  #: states up to which a larger model is reduced for its poles and zeros


@dataclass(frozen=True, slots=True)
class Line:
    """The imaginary axis of the s-plane."""

    widest: float = field(default=np.inf, init=False)  #: [rad/s] interval that a half circle spans, beside its ratio

    def resolution(self, omega: float) -> float:
        """Return how far rounding moves a point of the axis [rad/s]."""
        return UNIT_ROUNDOFF * omega

    def points(self, exponents: ComplexArray) -> ComplexArray:
        """Return where a response is evaluated for s."""
        return exponents

    def exponents(self, roots: ComplexArray) -> ComplexArray:
        """Return the s of roots."""
        return roots

    def on_boundary(self, roots: ComplexArray, doubts: FloatArray) -> ComplexArray:
        """Put roots on the axis that are not told from it."""
        return np.where(np.abs(roots.real) <= doubts, 1j * roots.imag, roots)

    def touching(self, roots: ComplexArray) -> ComplexArray:
        """Return the roots on the axis."""
        return np.asarray(roots[roots.real == 0.0])

    def unstable(self, roots: ComplexArray) -> ComplexArray:
        """Return the roots right of the axis."""
        return np.asarray(roots[roots.real > 0.0])

    def at_start(self, roots: ComplexArray) -> npt.NDArray[np.bool_]:
        """Tell which roots lie at zero frequency."""
        return np.asarray(roots == 0.0)

    def constant(self, roots: ComplexArray) -> float:
        """Return the sum of the constants [rad]."""
        return float(np.pi * np.count_nonzero(roots.real > 0.0))

    def swept(self, omega: FloatArray, roots: ComplexArray) -> FloatArray:
        """Return the sum of the continuous parts [rad]."""
        total = np.zeros(omega.size)
        for root in roots.tolist():
            angle = np.arctan2(omega - root.imag, abs(root.real))
            total += -angle if root.real > 0.0 else angle
        return total

    def gain_point(self, roots: ComplexArray) -> float:
        """Return a real point at which all roots weigh."""
        sizes = np.abs(roots)
        sizes = sizes[sizes > 0.0]
        return float(np.exp(np.log(sizes).mean())) * 1.1 if sizes.size else 1.0


@dataclass(frozen=True, slots=True)
class Circle:
    """The unit circle of the z-plane, run through in steps of `dt`."""

    dt: float  #: [s]

    @property
    def widest(self) -> float:
        """Interval that a half circle spans [rad/s]: zeros from sampling lie outside the unit circle, near -1."""
        return SAMPLED_WIDTH / self.dt

    def resolution(self, omega: float) -> float:
        """Return how far rounding moves a point of the circle [rad/s]."""
        return UNIT_ROUNDOFF * max(omega, 1.0 / self.dt)

    def points(self, exponents: ComplexArray) -> ComplexArray:
        """Return where a response is evaluated for s."""
        return np.asarray(np.exp(exponents * self.dt))

    def exponents(self, roots: ComplexArray) -> ComplexArray:
        """Return the s of roots, up to the Nyquist frequency."""
        return np.asarray(np.log(roots[roots != 0.0]) / self.dt)

    def on_boundary(self, roots: ComplexArray, doubts: FloatArray) -> ComplexArray:
        """Put roots on the circle that are not told from it."""
        size = np.abs(roots)
        near = np.abs(size - 1.0) <= doubts
        moved = np.where(near, roots / np.where(near, size, 1.0), roots)
        return np.where(near & (np.abs(moved - 1.0) <= doubts), 1.0, moved)

    def touching(self, roots: ComplexArray) -> ComplexArray:
        """Return the s of the roots on the circle."""
        return self.exponents(roots[self._inside(roots) & (np.abs(np.abs(roots) - 1.0) <= ROUNDED_CIRCLE)])

    def unstable(self, roots: ComplexArray) -> ComplexArray:
        """Return the roots outside the circle."""
        return np.asarray(roots[~self._inside(roots)])

    def at_start(self, roots: ComplexArray) -> npt.NDArray[np.bool_]:
        """Tell which roots lie at zero frequency."""
        return np.asarray(roots == 1.0)

    def constant(self, roots: ComplexArray) -> float:
        """Return the sum of the constants [rad]."""
        return float(np.angle(-roots[~self._inside(roots)]).sum())

    def swept(self, omega: FloatArray, roots: ComplexArray) -> FloatArray:
        """Return the sum of the continuous parts [rad]."""
        angle = omega * self.dt
        turn, total = np.exp(1j * angle), np.zeros(omega.size)
        inside = self._inside(roots)
        for root, within in zip(roots.tolist(), inside.tolist(), strict=True):
            if within and abs(abs(root) - 1.0) <= ROUNDED_CIRCLE:  # half a turn at each passage
                place = np.angle(root)
                total += 0.5 * (angle + place) + np.pi * (0.5 + np.floor((angle - place) / (2.0 * np.pi)))
            else:
                total += angle + np.angle(1.0 - root * turn.conj()) if within else np.angle(1.0 - turn / root)
        return total

    def gain_point(self, roots: ComplexArray) -> float:
        """Return a real point outside all roots."""
        return 1.1 * float(max(1.0, np.abs(roots).max(initial=0.0)))

    def _inside(self, roots: ComplexArray) -> npt.NDArray[np.bool_]:
        return np.asarray(np.abs(roots) <= 1.0 + ROUNDED_CIRCLE)


ROUNDED_CIRCLE = 1e-15  #: of its radius: roots that were put on the circle are off it so far
Plane: TypeAlias = Line | Circle


@dataclass(frozen=True, slots=True, eq=False)
class SystemSource:
    """Values come from a state space."""

    data: StateSpaceData
    dt: float | None = None  #: [s], None for a continuous one
    model: SecondOrderModel | None = None  #: that it was made of
    is_real: bool = field(default=True, init=False)

    @property
    def size(self) -> int:
        """Order."""
        return len(self.data.A)

    @property
    def plane(self) -> Plane:
        """Where its roots lie."""
        return Line() if self.dt is None else Circle(self.dt)

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
    """Values come from a dense model of moderate size, real or complex."""

    model: SecondOrderModel
    plane: Plane = field(default_factory=Line, init=False)

    @property
    def is_real(self) -> bool:
        """Whether roots come in conjugate pairs."""
        return not self.model.is_complex

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


@dataclass(frozen=True, slots=True, eq=False)
class LargeSource:
    """Values come from a model that is reduced where its roots are asked for, if that is possible."""

    model: SecondOrderModel

    def reduced(self) -> SystemSource | None:
        """Return the reduced state space; None where there is none, or too large a one."""
        model = self.model
        inertial, half = null_column_kinds(model.M, model.C)
        if model.is_complex or 2 * np.count_nonzero(inertial) + np.count_nonzero(half) > MOST_REDUCED:
            return None
        try:
            return SystemSource(StateSpaceData.of(mech2ss(model)), model=model)
        except HalfdofError:
            return None


KnownSource: TypeAlias = SystemSource | ModelSource
Source: TypeAlias = KnownSource | LargeSource


def with_source(data: control.FrequencyResponseData, source: Source | None) -> control.FrequencyResponseData:
    """Note in a response where its values come from."""
    if source is not None:
        setattr(data, SOURCE, source)
    return data


def source_of(sysdata: control.StateSpace | SecondOrderModel, sys: control.StateSpace | None = None) -> Source:
    """Return what the phase of a system or model follows from; of a large model, of the state space if there is one."""
    if isinstance(sysdata, SecondOrderModel):
        if len(sysdata.dofs) <= PHASE_SOURCES_LARGEST_PENCIL:
            return ModelSource(sysdata.as_dense())
        return LargeSource(sysdata) if sys is None else SystemSource(StateSpaceData.of(sys), model=sysdata)
    dt = float(sysdata.dt) if sysdata.isdtime(strict=True) else None
    return SystemSource(StateSpaceData.of(sysdata), dt)
