"""The nonlinear model: M, C, K with springs, dampers and forces whose laws are not linear.

    M q'' + C q' + K q + sum of e_k phi_k = B u,    y = F q + G q' + H q'' + D u                   (N1)

The model is plain data. What its DOFs are, how it moves and what its tangent is comes from the room `nonlinear`, which
registers itself with `reduced` here, so that imports point down. Derivation: docs/explanation/nonlinear.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from importlib import import_module
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.base.doors import items_of, shown
from halfdof_ctrl.base.errors import ModelSizeError, ParameterError, SignalNameError
from halfdof_ctrl.base.names import Names, listed, reaction_names, unknown_name_error
from halfdof_ctrl.model.checked_laws import check_force, check_law
from halfdof_ctrl.model.dense_copy import complex_model_error
from halfdof_ctrl.model.elements import Damper, Element, Force, Spring, element_dofs, grounded
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.model.second_order import SecondOrderModel

LARGEST_NONLINEAR = 500  #: DOFs up to which nonlinear models are worked with, all of it dense

Values: TypeAlias = float | npt.ArrayLike | Mapping[str, float] | None


class Reduced(Protocol):
    """What the room `nonlinear` makes of a model."""

    @property
    def partition(self) -> Any: ...  # noqa: ANN401, D102  # a partition of the reduction, two floors above
    @property
    def states(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def made_by_elements(self) -> tuple[str, ...]: ...  # noqa: D102
    def state(self, initial: Values, inputs: Values) -> FloatArray: ...  # noqa: D102
    def recover(self, response: Any) -> Any: ...  # noqa: ANN401, D102
    def tangent(self, state: Any, inputs: Values) -> SecondOrderModel: ...  # noqa: ANN401, D102
    def equilibrium(self, inputs: Values) -> Any: ...  # noqa: ANN401, D102


REGISTERS = "halfdof_ctrl.nonlinear.reduction"  #: two floors above; no import of its own, for these point down


@singledispatch
def reduced(model: object) -> Reduced:
    """Return the reduction of a nonlinear model; the room `nonlinear` registers how, and is loaded for it."""
    if isinstance(model, NonlinearModel):
        import_module(REGISTERS)
        return reduced(model)
    msg = f"A {type(model).__name__} is no nonlinear model. Make one by nlmechss."
    raise ParameterError(msg, parameter="model", value=model)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class NonlinearModel:
    """``M q'' + C q' + K q + sum of e_k phi_k = B u`` with named signals.

    Made by `nlmechss`, not directly.
    """

    linear: SecondOrderModel  #: M, C, K and the signals, without any element
    elements: tuple[Element, ...]  #: springs, dampers and forces, in the order given

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the DOFs."""
        return self.linear.dofs

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.linear.inputs

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.linear.outputs

    @property
    def name(self) -> str | None:
        """Name of the model."""
        return self.linear.name

    @property
    def prescribed(self) -> tuple[str, ...]:
        """DOFs whose motion is an input."""
        return self.linear.prescribed

    @property
    def with_linear_elements(self) -> SecondOrderModel:
        """M, C, K with the elements whose law is a plain number."""
        C, K, F, G = (np.array(matrix) for matrix in (self.linear.C, self.linear.K, self.linear.F, self.linear.G))
        for element in self.elements:
            if isinstance(element, Spring | Damper) and not isinstance(element.law, Law):
                e = direction(element, self.dofs)
                on_dofs, on_outputs = split_actions(e[:, None], self.linear)
                left, seen = (K, F) if isinstance(element, Spring) else (C, G)
                left += element.law * on_dofs @ e[None]
                seen += element.law * on_outputs @ e[None]
        return replace(self.linear, C=read_only(C), K=read_only(K), F=read_only(F), G=read_only(G))

    @property
    def nonlinear_elements(self) -> tuple[Element, ...]:
        """Elements whose law is more than a number."""
        return tuple([element for element in self.elements if isinstance(element, Force) or not element.is_linear])

    def select(self, inputs: Names = None, outputs: Names = None) -> "NonlinearModel":
        """Return the model with other inputs and outputs, picked by name as `SecondOrderModel.select` does."""
        return replace(self, linear=self.linear.select(inputs, outputs))

    def without(self, dofs: Names) -> "NonlinearModel":
        """Return the model without some DOFs, as `SecondOrderModel.without` does: held at rest.

        An element that ends at one of them ends at the ground then; one with both ends there is left out.

        Raises
        ------
        SignalNameError
            As there; or a `Force` knows one of them, or an element with a law begins there.
        """
        linear = self.linear.without(dofs)
        names = zip(self.elements, element_words(self.elements), strict=True)
        left = [grounded(element, words, linear.dofs) for element, words in names]
        return nlmechss(linear, [element for element in left if element is not None])

    @property
    def partition(self) -> Any:  # noqa: ANN401
        """Which coordinates are inertial, half and static, by the tangent model with generic slopes."""
        return reduced(self).partition

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: displacements of inertial and half DOFs, then velocities of inertial ones."""
        return reduced(self).states

    def state(self, initial: Values = None, inputs: Values = None) -> FloatArray:
        """Return the state for displacements and velocities by name, and refuse those that cannot be.

        Parameters
        ----------
        initial : mapping from ``<dof>`` and ``<dof>_dot`` to a number, or (N,) array_like, optional
            What is left out is zero where it is a state and follows from the equations where it is not. An array is
            the state itself.
        inputs : float, array_like or mapping from input to number, optional
            Inputs at that time, zero by default; their derivatives are taken as zero.

        Raises
        ------
        InconsistentStateError
            A given value differs from what the equations without inertia require.
        SignalNameError
            A name that is no displacement or velocity.
        """
        return reduced(self).state(initial, inputs)

    def recover(self, response: Any) -> Any:  # noqa: ANN401  # TimeResponseData and RecoveredMotion live above
        """Return the displacements and velocities of all DOFs for a time response of this model.

        Velocities of static DOFs are the derivatives of what the springs require; where an input has a part in them,
        its slope until the next time is used.
        """
        return reduced(self).recover(response)

    def tangent(self, state: Any = None, inputs: Values = None) -> SecondOrderModel:  # noqa: ANN401
        """Return the linear model for small motions about a state, with the analytic slopes of the laws.

        What python-control calls `linearize`, one floor higher: a model whose `mech2ss`, `lqr` and `bode_plot` are
        those of small motions.

        Parameters
        ----------
        state : (N,) array_like, mapping as in `state`, or an `Equilibrium`, optional
            Where; by default at rest with all displacements zero.
        inputs : float, array_like or mapping, optional
            Constant inputs there.

        Returns
        -------
        SecondOrderModel
            With the signals of this model, all of them as differences from that state.

        Raises
        ------
        LawError
            A slope there is infinite.

        Warns
        -----
        LostStateWarning
            A slope is zero there on which a state hangs: the tangent has fewer states than this model.
        """
        return reduced(self).tangent(state, inputs)

    def equilibrium(self, inputs: Values = None) -> Any:  # noqa: ANN401
        """Return the state of rest under constant inputs: what python-control calls `find_operating_point`.

        Parameters
        ----------
        inputs : float, array_like or mapping from input to number, optional
            Zero by default.

        Returns
        -------
        Equilibrium
            ``state`` and ``inputs`` for `tangent` and `control.linearize`, ``displacement`` by DOF.

        Raises
        ------
        LawError
            No equilibrium was found, or nothing holds some DOFs there.
        """
        return reduced(self).equilibrium(inputs)

    def __repr__(self) -> str:
        """Return the model on a few lines: its DOFs and states, and which DOFs an element made what they are."""
        found = reduced(self)
        part = found.partition
        title = f"{type(self).__name__} {self.name!r}" if self.name else type(self).__name__
        kinds = f"{len(part.inertial)} inertial, {len(part.half)} half, {len(part.static)} static"
        prescribed = f"\n  motion prescribed: {listed(self.prescribed)}" if self.prescribed else ""
        elements = "".join([f"\n  {words}" for words in listed_elements(self.elements)])
        made = "".join([f"\n  {words}" for words in found.made_by_elements])
        return (
            f"{title}: {len(self.dofs)} DOFs: {kinds}; {len(found.states)} states\n"
            f"  dofs:    {listed(self.dofs)}\n"
            f"  inputs:  {listed(self.inputs)}\n"
            f"  outputs: {listed(self.outputs)}{prescribed}{elements}{made}"
        )


def nlmechss(
    model: SecondOrderModel, elements: Sequence[Element] | Element, *, name: str | None = None
) -> NonlinearModel:
    """Create a nonlinear model: a linear one with springs, dampers and forces between its DOFs.

    Parameters
    ----------
    model : SecondOrderModel
        A real, dense model of up to 500 DOFs; its signals are those of the nonlinear one. Motions are prescribed
        before: ``model.prescribe_motion("base", "acceleration")`` keeps the base as a DOF.
    elements : sequence of Spring, Damper and Force
        What acts besides M, C and K, on the left of equation (N1).
    name : str, optional
        By default that of `model`.

    Returns
    -------
    NonlinearModel

    Raises
    ------
    SignalNameError
        An element on a DOF that is not in the model.
    ComplexModelError, ModelSizeError
        The model is complex, sparse, or has more than 500 DOFs.
    LawError
        A law returns NaN at zero, complex numbers or the wrong shape; it must be solved for and is not monotone,
        bounded, or flat; or the model is above index 1.
    SingularPencilError, UncertainRankError
        As in `exact_reduction`.

    Examples
    --------
    Oil through a hole in series with a spring: the node between has a state although C knows nothing of it.

    >>> from halfdof_ctrl import laws
    >>> model = mechss([[1, 0], [0, 0]], None, [[8, -8], [-8, 8]], dofs=["mass", "oil"])
    >>> nlmechss(model.select("F_mass"), [Damper("oil", law=laws.quadratic(2))])
    NonlinearModel: 2 DOFs: 1 inertial, 1 half, 0 static; 3 states
      dofs:    mass, oil
      inputs:  F_mass
      outputs: mass, oil
      damper 1: Damper("oil", law=quadratic(2))
      oil: half, by damper 1 (quadratic); its column of C is null
    """
    given_model: object = model
    if not isinstance(given_model, SecondOrderModel):
        msg = f"nlmechss takes a model made by mechss and the elements to add, not a {type(model).__name__}."
        raise ParameterError(msg, parameter="model", value=model)
    if model.is_complex:
        raise complex_model_error(model)
    if model.is_sparse or len(model.dofs) > LARGEST_NONLINEAR:
        msg = (
            f"Nonlinear models are dense and have up to {LARGEST_NONLINEAR} DOFs; this one is "
            f"{'sparse' if model.is_sparse else 'dense'} and has {len(model.dofs)}: take as_dense() or truncate_modes "
            "first."
        )
        raise ModelSizeError(msg, size=len(model.dofs), limit=LARGEST_NONLINEAR)
    given = (
        (elements,)
        if isinstance(elements, Spring | Damper | Force)
        else tuple(items_of(elements, "elements", "a list of Spring, Damper and Force", parameter="elements"))
    )
    for element in given:
        _require_element(element)
    for element, words in zip(given, element_words(given), strict=True):
        _check(element, words, model)
    named = model if name is None else replace(model, name=name)
    nonlinear = NonlinearModel(linear=named, elements=given)
    reduced(nonlinear)  # refuses what cannot be solved for, before anything is computed with it
    return nonlinear


def element_words(elements: Sequence[Element]) -> tuple[str, ...]:
    """Name elements by kind, number and law: ``damper 1 (quadratic)``."""
    return tuple(
        [f"{label} ({_law_name(element)})" for label, element in zip(_labels(elements), elements, strict=True)]
    )


def listed_elements(elements: Sequence[Element], most: int = 8) -> list[str]:
    """List elements as they are typed, a line each, the rest of a long list by its number."""
    lines = [
        f"{label}: {element if not isinstance(element, Force) else f'Force({element.name}) on {listed(element.on)}'}"
        for label, element in zip(_labels(elements), elements, strict=True)
    ]
    return lines if len(lines) <= most else [*lines[:most], f"and {len(lines) - most} more elements"]


def direction(element: Spring | Damper, dofs: tuple[str, ...]) -> FloatArray:
    """Return e of equation (N1): 1 at a, -1 at b."""
    e = np.zeros(len(dofs))
    e[dofs.index(element.a)] = 1.0
    if element.b is not None:
        e[dofs.index(element.b)] = -1.0
    return e


def split_actions(E: FloatArray, model: SecondOrderModel) -> tuple[FloatArray, FloatArray]:
    """Split what forces act on into equations of motion and reactions.

    The equation of a DOF whose motion is prescribed is ``q'' = u``: no force moves it, and what acts there adds to the
    reaction, where that is an output.

    Returns
    -------
    E : (n, a) ndarray
        Without the rows of prescribed DOFs.
    R : (p, a) ndarray
        These rows, at the outputs ``R_<dof>``.
    """
    E, R = np.array(E), np.zeros((len(model.outputs), E.shape[1]))
    for dof, reaction in zip(model.prescribed, reaction_names(model.prescribed), strict=True):
        if dof in model.dofs:
            row = model.dofs.index(dof)
            if reaction in model.outputs:
                R[model.outputs.index(reaction)] = E[row]
            E[row] = 0.0
    return read_only(E), read_only(R)


def _labels(elements: Sequence[Element]) -> list[str]:
    counts: dict[str, int] = {}
    labels = []
    for element in elements:
        kind = type(element).__name__.lower()
        counts[kind] = counts.get(kind, 0) + 1
        labels.append(f"{kind} {counts[kind]}")
    return labels


def _law_name(element: Element) -> str:
    if isinstance(element, Force):
        return element.name
    return element.law.name if isinstance(element.law, Law) else "linear"


def _require_element(element: object) -> None:
    if not isinstance(element, Spring | Damper | Force):
        msg = f"Elements are Spring, Damper and Force; {shown(element)} is a {type(element).__name__}."
        raise ParameterError(msg, parameter="elements", value=element)


def _check(element: Element, words: str, model: SecondOrderModel) -> None:
    """Check an element against the model, and try its law."""
    for dof in element_dofs(element):
        if dof not in model.dofs:
            if dof in model.prescribed:
                msg = (
                    f"{words} sits on {dof}, whose displacement is prescribed, so that it has left the model. "
                    f'Prescribe its motion by model.prescribe_motion("{dof}", "acceleration") instead, which keeps '
                    "it as a DOF."
                )
                raise SignalNameError(msg, names=(dof,))
            raise unknown_name_error(dof, f"DOF for {words}:", model.dofs)
    if isinstance(element, Force):
        check_force(element, words)
    elif isinstance(element.law, Law):
        check_law(element.law, words, element_dofs(element))
