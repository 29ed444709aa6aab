"""What a sweep gave: the results of its cases in arrays whose axes have names."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, read_only
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.sweeps.cases import Cases, Values, in_words
from halfdof_ctrl.sweeps.one_case import CaseError, CaseResult

Outcome: TypeAlias = CaseResult | CaseError


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SweepFailure:
    """A case that gave nothing, and why."""

    case: tuple[int, ...]  #: where it stands in the arrays
    parameters: dict[str, object]  #: what was varied, at this case
    kind: str  #: type of the exception; ``NotRun`` where the sweep was interrupted before
    message: str  #: what the exception said
    traceback: str  #: where it came from, as Python writes it

    def __str__(self) -> str:
        """Write the failure on one line."""
        return f"{in_words(self.parameters) or 'the only case'}: {self.kind}: {' '.join(self.message.split())}"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class SweepResult:
    """Arrays whose first axes are those of the parameters. Made by `sweep`.

    For p outputs, m inputs, k frequencies and at most N poles; the dots stand for `shape`. NaN stands where a case
    failed and after the poles of a case that has fewer than N. What was not asked for, or what no case gave, is None.
    All arrays are read-only.
    """

    axes: dict[
        str, Values
    ]  #: values along each axis of a grid, by the name of the parameter; of a list ``case``: its numbers
    parameters: dict[str, Values]  #: (...) value of each parameter that was varied, at each case
    omega: FloatArray | None  #: (k,) frequencies of the response [rad/s]
    inputs: tuple[str, ...]  #: names of the m inputs
    outputs: tuple[str, ...]  #: names of the p outputs
    dofs: tuple[str, ...]  #: names of the DOFs of models whose forces and motions these are
    discrete: bool  #: whether the systems are sampled state spaces, with poles in z
    response: ComplexArray | None  #: (..., p, m, k) frequency response
    poles: ComplexArray | None  #: (..., N) [rad/s], sorted by size
    values: (
        npt.NDArray[Any] | None
    )  #: (...) numbers or arrays that a function gave; NaN fills up where they differ in shape
    failures: tuple[SweepFailure, ...]  #: cases that failed, in order
    ran: str = ""  #: where the cases were computed, and why there

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes of the parameters."""
        return tuple([len(values) for values in self.axes.values()])

    def __repr__(self) -> str:
        """Return the sweep on a few lines: its axes, what it has, what failed."""
        count = math.prod(self.shape)
        axes = " x ".join(f"{name} ({len(values)})" for name, values in self.axes.items())
        lines = [f"{type(self).__name__}: {count} case{'s' * (count != 1)}" + (f", {axes}" if axes else "")]
        if self.axes.keys() != self.parameters.keys():
            lines.append(f"parameters: {listed(list(self.parameters))}")
        if self.response is not None and self.omega is not None:
            lines.append(f"response: {listed(self.outputs)} from {listed(self.inputs)}, {self.omega.size} frequencies")
        if self.poles is not None:
            lines.append(f"poles: {self.poles.shape[-1]}")
        if self.values is not None:
            shape = self.values.shape[len(self.shape) :]
            lines.append(f"values: {' x '.join(map(str, shape)) if shape else 'a number'} each")
        if self.failures:
            lines.append(f"failed: {len(self.failures)}, first {self.failures[0]}")
        if "since" in self.ran or "checkpoint" in self.ran:  # what is not as it was asked for
            lines.append(f"computed {self.ran}")
        return "\n  ".join(lines)


def joined_cases(outcomes: Sequence[Outcome], cases: Cases, omega: FloatArray | None) -> SweepResult:
    """Put the results of all cases into arrays."""
    first = _first(outcomes)
    fitting = [_fitting(outcome, first) for outcome in outcomes]
    done = [outcome if isinstance(outcome, CaseResult) else None for outcome in fitting]
    failures = [
        SweepFailure(
            case=tuple(int(place) for place in np.unravel_index(number, cases.shape)),
            parameters=cases.varied(number),
            kind=outcome.kind,
            message=outcome.message,
            traceback=outcome.traceback,
        )
        for number, outcome in enumerate(fitting)
        if isinstance(outcome, CaseError)
    ]
    return SweepResult(
        axes=cases.axes,
        parameters=cases.parameters,
        omega=omega if first.response is not None else None,
        inputs=first.inputs,
        outputs=first.outputs,
        dofs=first.dofs,
        discrete=first.discrete,
        response=_stacked([None if result is None else result.response for result in done], cases.shape),
        poles=_stacked([None if result is None else result.poles for result in done], cases.shape),
        values=_stacked([None if result is None else result.value for result in done], cases.shape),
        failures=tuple(failures),
    )


def joined_frequencies(outcomes: Sequence[Outcome], omega: FloatArray) -> SweepResult:
    """Put the response of a single system together, of which each outcome is one frequency."""
    each = joined_cases(outcomes, Cases(axes={"omega": omega}, parameters={"omega": omega}, fixed={}), omega)
    response = None if each.response is None else np.moveaxis(each.response[..., 0], 0, -1)
    failures = tuple([replace(failure, case=()) for failure in each.failures])
    return replace(each, axes={}, parameters={}, response=response, failures=failures)


def _first(outcomes: Sequence[Outcome]) -> CaseResult:
    """Return the first result, or an empty one where every case failed."""
    return next((outcome for outcome in outcomes if isinstance(outcome, CaseResult)), CaseResult())


def _fitting(outcome: Outcome, first: CaseResult) -> Outcome:
    """Refuse a result that cannot stand in one array with the first one."""
    if isinstance(outcome, CaseError):
        return outcome
    message = ""
    if _dimensions(outcome.value) != _dimensions(first.value):
        message = (
            f"the function gave {_described(outcome.value)} here, but {_described(first.value)} in the first case. "
            "Let it give arrays of one kind."
        )
    elif (outcome.inputs, outcome.outputs) != (first.inputs, first.outputs):
        message = (
            f"inputs {listed(outcome.inputs)} and outputs {listed(outcome.outputs)} are others than those of the first "
            f"case, {listed(first.inputs)} and {listed(first.outputs)}. Pick the same by inputs and outputs."
        )
    return CaseError(kind="ShapeError", message=message, traceback="") if message else outcome


def _dimensions(value: npt.NDArray[Any] | None) -> int:
    return -1 if value is None else value.ndim


def _described(value: npt.NDArray[Any] | None) -> str:
    if value is None:
        return "a system"
    return f"an array of {value.ndim} dimension{'s' * (value.ndim != 1)}" if value.ndim else "a number"


def _stacked(arrays: Sequence[npt.NDArray[Any] | None], shape: tuple[int, ...]) -> npt.NDArray[Any] | None:
    """Stack arrays along the axes of the cases, with NaN where there is none or where one is smaller."""
    there = [array for array in arrays if array is not None]
    if not there:
        return None
    sizes = tuple(np.max([array.shape for array in there], axis=0).astype(int).tolist())
    dtype = np.result_type(float, *there)
    nothing = complex(math.nan, math.nan) if dtype.kind == "c" else math.nan
    stack = np.full((len(arrays), *sizes), nothing, dtype=dtype)
    for place, array in enumerate(arrays):
        if array is not None:
            stack[place, ...][tuple([slice(size) for size in array.shape])] = array
    return read_only(stack.reshape(*shape, *sizes))
