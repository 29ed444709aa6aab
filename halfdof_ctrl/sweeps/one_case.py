"""One case of a sweep, as a worker computes it: parameters in, numbers out.

What crosses a process boundary is a function, its parameters, and arrays with the names of their signals. A
`control.StateSpace` cannot be pickled, so it is made and used in the worker.
"""

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import control
import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.errors import NoStateSpaceError, ParameterError, SignalNameError
from halfdof_ctrl.base.names import Names, force_names, motion_names, name_from_label, unknown_name_error
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.sweeps.cases import name_of
from halfdof_ctrl.systems.frequency import frequency_response

System: TypeAlias = SecondOrderModel | control.StateSpace
Quantity: TypeAlias = Literal["poles", "response"] | Callable[[Any], object]

RESULT_KINDS = "biufc"  #: kinds of arrays that count as results


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CaseResult:
    """What one case gave, for N poles, p outputs, m inputs and k frequencies."""

    poles: ComplexArray | None = None  #: (N,)
    response: ComplexArray | None = None  #: (p, m, k)
    value: npt.NDArray[Any] | None = None  #: what a function gave
    inputs: tuple[str, ...] = ()  #: names of the m inputs
    outputs: tuple[str, ...] = ()  #: names of the p outputs
    dofs: tuple[str, ...] = ()  #: names of the DOFs among these
    discrete: bool = False  #: whether it is a sampled state space, with poles in z


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseError:
    """Why one case gave nothing."""

    kind: str  #: type of the exception
    message: str
    traceback: str  #: where it came from, as Python writes it
    unknown: tuple[str, ...] = ()  #: names of asked signals that the system does not have

    @classmethod
    def of(cls, error: BaseException) -> "CaseError":
        """Keep of an exception what can be sent anywhere."""
        kind = type(error).__name__
        try:
            message = str(error)
        except Exception as broken:  # noqa: BLE001  # the user's own __str__ raises what it likes
            message = f"its words cannot be read: {type(broken).__name__}"
        try:
            text = "".join(traceback.format_exception(error))
        except Exception:  # noqa: BLE001  # as above, or a __cause__ of that kind
            text = "".join(traceback.format_tb(error.__traceback__)) + kind
        return cls(kind=kind, message=message, traceback=text)


class _UnknownSignalsError(SignalNameError):
    """Signals that were asked for, as against such as the user's function names."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CaseWork:
    """Compute cases one by one; an error in one is its result."""

    function: Callable[..., object]
    compute: tuple[
        Quantity, ...
    ]  #: empty: the poles of a system (and its response at `omega`), or the numbers themselves
    omega: FloatArray | None
    inputs: Names
    outputs: Names

    def __str__(self) -> str:
        """Name the function."""
        return name_of(self.function)

    def __call__(self, cases: list[Mapping[str, object]]) -> list[CaseResult | CaseError]:
        """Compute some cases."""
        results: list[CaseResult | CaseError] = []
        for parameters in cases:
            try:
                results.append(self.result_of(parameters))
            except _UnknownSignalsError as error:
                results.append(replace(CaseError.of(error.__cause__ or error), unknown=error.names))
            except (Exception, SystemExit) as error:  # noqa: BLE001  # whatever the user's function raises
                results.append(CaseError.of(error))
        return results

    def result_of(self, parameters: Mapping[str, object]) -> CaseResult:
        """Compute one case."""
        made = self.function(**parameters)
        quantities = self.compute or self._usual(made)
        if not isinstance(made, System):
            return CaseResult(value=as_numbers(self._computed(made, quantities)))
        try:
            made = selected(made, self.inputs, self.outputs)
        except SignalNameError as error:
            raise _UnknownSignalsError(str(error), names=error.names) from error
        functions = [quantity for quantity in quantities if callable(quantity)]
        inputs, outputs = signals_of(made)
        return CaseResult(
            poles=poles_of(made) if "poles" in quantities else None,
            response=response_of(made, self.omega) if "response" in quantities else None,
            value=as_numbers(functions[0](made)) if functions else None,
            inputs=inputs,
            outputs=outputs,
            dofs=_seen_dofs(made) if isinstance(made, SecondOrderModel) else (),
            discrete=not isinstance(made, SecondOrderModel) and made.isdtime(strict=True),
        )

    def _usual(self, made: object) -> tuple[Quantity, ...]:
        if not isinstance(made, System) and self.omega is None and self.inputs is None and self.outputs is None:
            return (_itself,)
        return ("poles",) if self.omega is None else ("poles", "response")

    def _computed(self, made: object, quantities: tuple[Quantity, ...]) -> object:
        """Compute from something that is no system."""
        for quantity in quantities:
            if not callable(quantity):
                msg = (
                    f"{self} gave {type(made).__name__}, which has no {quantity}. Return a SecondOrderModel or a "
                    "control.StateSpace, or leave out omega, inputs, outputs and compute to keep the numbers."
                )
                raise ParameterError(msg, parameter="function", value=type(made).__name__)
        (function,) = quantities
        return function(made)  # type: ignore[operator]  # mypy forgets what the loop has shown


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FrequencyWork:
    """Compute the response of one system at some frequencies, all in one go."""

    function: Callable[[], object]
    inputs: Names
    outputs: Names

    def __str__(self) -> str:
        """Name the function."""
        return name_of(self.function)

    def __call__(self, omega: list[float]) -> list[CaseResult | CaseError]:
        """Compute the response at some frequencies [rad/s]."""
        work = CaseWork(
            function=self.function,
            compute=("response",),
            omega=np.array(omega),
            inputs=self.inputs,
            outputs=self.outputs,
        )
        (result,) = work([{}])
        if isinstance(result, CaseError):
            return [result] * len(omega)
        values = np.asarray(result.response)
        return [replace(result, response=values[:, :, [place]]) for place in range(len(omega))]


@dataclass(frozen=True, slots=True, eq=False)
class Constant:
    """A function that gives the same system each time, which can be sent to a worker if the system can."""

    system: SecondOrderModel

    def __call__(self) -> SecondOrderModel:
        """Return the system."""
        return self.system


def selected(system: System, inputs: Names, outputs: Names) -> System:
    """Take some inputs and outputs by name; of a state space only such as it has.

    Raises
    ------
    SignalNameError
        A name that the system does not have.
    """
    if isinstance(system, SecondOrderModel):
        return system.select(inputs, outputs)
    if inputs is None and outputs is None:
        return system
    known_inputs, known_outputs = signals_of(system)
    columns = _places(inputs, known_inputs, "input")
    rows = _places(outputs, known_outputs, "output")
    return control.StateSpace(
        system.A,
        system.B[:, columns],
        system.C[rows],
        system.D[np.ix_(rows, columns)],
        system.dt,
        inputs=[system.input_labels[column] for column in columns],
        outputs=[system.output_labels[row] for row in rows],
        states=system.state_labels,
    )


def signals_of(system: System) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the inputs and of the outputs."""
    if isinstance(system, SecondOrderModel):
        return system.inputs, system.outputs
    return tuple(map(name_from_label, system.input_labels)), tuple(map(name_from_label, system.output_labels))


def poles_of(system: System) -> ComplexArray:
    """Compute the poles, sorted by size and conjugate pairs with the positive imaginary part first.

    Those of a model that has no state space (complex, or of an order that is uncertain) are its finite eigenvalues.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` of the model vanishes identically.
    """
    if not isinstance(system, SecondOrderModel):
        return by_size(_eigenvalues(np.asarray(system.A)))
    try:
        return by_size(_eigenvalues(exact_reduction(system).A))
    except NoStateSpaceError:
        require_regular(system)
        return by_size(pencil_structure(system).finite_eigenvalues)


def response_of(system: System, omega: FloatArray | None) -> ComplexArray:
    """Compute the frequency response, (p, m, k)."""
    return np.asarray(frequency_response(system, omega).frdata, dtype=np.complex128)


def by_size(poles: ComplexArray) -> ComplexArray:
    """Sort by size, conjugate pairs with the positive imaginary part first.

    >>> by_size(np.array([-3, 1 - 1j, 1 + 1j])).tolist()
    [(1+1j), (1-1j), (-3+0j)]
    """
    size = np.abs(poles)
    with np.errstate(divide="ignore"):
        rounded = np.log(size).round(9)  # conjugates may differ by rounding
    return np.asarray(poles[np.lexsort((-poles.imag, rounded))], dtype=np.complex128)


def as_numbers(value: object) -> npt.NDArray[Any]:
    """Read what a function gave as an array of numbers.

    Raises
    ------
    ParameterError
        Text, a system, or other things that are no numbers.
    """
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different length
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in RESULT_KINDS:
        msg = f"The function gave {type(value).__name__}, but a sweep keeps numbers and arrays of numbers alone."
        raise ParameterError(msg, parameter="function", value=type(value).__name__)
    return array


def _seen_dofs(model: SecondOrderModel) -> tuple[str, ...]:
    """Return the DOFs whose force or motion is an input or output, from which the units of plots follow."""
    seen = {*model.inputs, *model.outputs}
    names = zip(model.dofs, force_names(model.dofs), *(motion_names(model.dofs, k) for k in range(3)), strict=True)
    return tuple([dof for dof, *motions in names if not seen.isdisjoint(motions)])


def _itself(made: object) -> object:
    return made


def _eigenvalues(A: FloatArray) -> ComplexArray:
    return np.asarray(scipy.linalg.eigvals(A) if A.size else np.zeros(0), dtype=np.complex128)


def _places(names: Names, known: tuple[str, ...], what: str) -> list[int]:
    """Find names among those that a state space has."""
    if names is None:
        return list(range(len(known)))
    wanted = (names,) if isinstance(names, str) else tuple(names)
    for name in wanted:
        if name not in known:
            raise unknown_name_error(name, what, known)
    return [known.index(name) for name in wanted]
