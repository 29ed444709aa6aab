"""From a descriptor system ``E x' = A x + B u`` with singular E (DAE, semistate equations) to a plain state space.

The reduction is that of mechanical models with M = 0. Where orthonormal bases would mix variables, deflation is tried,
which keeps them: a state is then its variable, less what the inputs add to it at once. Explanation:
docs/howto/descriptor-systems.md.
"""

from collections.abc import Sequence

import control
import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    HalfdofError,
    ImproperError,
    ParameterError,
    SignalNameError,
    SingularPencilError,
    UncertainRankError,
)
from halfdof_ctrl.base.names import Names, listed
from halfdof_ctrl.base.sparse_arrays import MatrixLike
from halfdof_ctrl.model.descriptor_system import dss
from halfdof_ctrl.model.doors import require_matrix
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.state_space import Improper, mech2ss

LARGEST_UNMIXED = 300  #: variables up to which deflation is tried for the sake of names
SHOWN = 4  #: pairs that a message spells out


def dss2ss(
    A: MatrixLike | SecondOrderModel,
    B: MatrixLike | None = None,
    C: MatrixLike | None = None,
    D: MatrixLike | None = None,
    E: MatrixLike | None = None,
    *,
    states: Names = None,
    inputs: Names = None,
    outputs: Names = None,
    name: str | None = None,
    improper: Improper = "refuse",
) -> control.StateSpace:
    """Convert a descriptor system (DAE, singular E, semistate equations) to state space, exactly.

    Parameters
    ----------
    A : DescriptorSystem (or SecondOrderModel) or (n, n) array_like
        A system that `dss` made, or the matrix A; with a matrix the other arguments are those of `dss`.
    B, C, D, E : array_like, optional
        As in `dss`; only with a matrix A.
    states, inputs, outputs, name : optional
        As in `dss`; only with a matrix A.
    improper : {"refuse", "drop"}
        What to do where the transfer function grows with frequency: refuse it with its polynomial part (default), or
        give the proper part alone.

    Returns
    -------
    control.StateSpace
        With as many states as the pencil ``s E - A`` has finite eigenvalues, of any index. States are called like the
        variables that they are, ``mix0``, ... where no selection of variables does.

    Raises
    ------
    MatrixError, SignalNameError
        What `dss` refuses.
    SingularPencilError
        ``det(s E - A)`` vanishes at every s; variables and equations are named.
    ImproperError
        A transfer function grows with frequency, such as the inverse of ``1 / (s + 1)``.
    UncertainRankError, ComplexModelError
        Entries nearly cancel, or have imaginary parts.
    ParameterError
        `improper` is neither of what it can be.

    Examples
    --------
    A resistor of 2 ohm and a capacitor of 3 F behind a voltage source:

    >>> sys = dss2ss([[0, 1], [-1, -2]], [[0], [1]], [[1, 0]], 0, [[3, 0], [0, 0]], states=["voltage", "current"])
    >>> sys.state_labels, sys.poles().real.round(9).tolist()
    (['voltage'], [-0.166666667])
    """
    if not is_choice(improper, ("refuse", "drop")):
        msg = f"improper must be 'refuse' or 'drop', not {shown(improper)}."
        raise ParameterError(msg, parameter="improper", value=improper)
    if isinstance(A, SecondOrderModel):
        if any(value is not None for value in (B, C, D, E, states, inputs, outputs, name)):
            msg = "A descriptor system brings its matrices and names with it: use dss() or select() to change them."
            raise SignalNameError(msg, names=())
        system: SecondOrderModel = A
    else:
        require_matrix(A, "dss2ss", parameter="A")
        if B is None or C is None:
            msg = "dss2ss takes a system made by dss, or the matrices A, B, C, D, E."
            raise ParameterError(msg, parameter="B" if B is None else "C", value=None)
        system = dss(A, B, C, D, E, states=states, inputs=inputs, outputs=outputs, name=name)
    reduction = _reduced(system)
    polynomial = reduction.polynomial_part
    if polynomial and improper == "refuse":
        raise _improper(system, [reduction.output.U[0], *polynomial])
    return mech2ss(reduction, improper=improper)


def _reduced(system: SecondOrderModel) -> ExactReduction:
    """Reduce, with variables as states if there is a way."""
    try:
        reduction = exact_reduction(system)
    except (SingularPencilError, UncertainRankError, ComplexModelError) as refusal:
        raise _in_variables(system, refusal) from refusal
    mixed = [state for state in reduction.states if state not in system.dofs]
    if not mixed or reduction.method == "deflation" or len(system.dofs) > LARGEST_UNMIXED:
        return reduction
    try:
        unmixed = exact_reduction(system, method="deflation")
    except HalfdofError:
        return reduction
    return unmixed if unmixed.order == reduction.order else reduction


def _in_variables(
    system: SecondOrderModel, refusal: SingularPencilError | UncertainRankError | ComplexModelError
) -> HalfdofError:
    """Say a refusal in words of variables and equations."""
    if isinstance(refusal, SingularPencilError):
        numbers = [str(system.dofs.index(name) + 1) for name in refusal.equations if name in system.dofs]
        msg = (
            f"The pencil s E - A is singular: det(s E - A) vanishes at every s. The equations leave the variables "
            f"{listed(refusal.dofs) or '(none by itself)'} open"
            f"{f', since the equations {listed(numbers)} (counted from 1) depend on each other' if numbers else ''}. "
            "Add the equation that is missing, or leave out the variable or the equation that stands twice."
        )
        return SingularPencilError(msg, dofs=refusal.dofs, equations=refusal.equations)
    if isinstance(refusal, UncertainRankError):
        msg = (
            "The number of states cannot be told to working precision: entries at the variables "
            f"{listed(refusal.dofs)} nearly cancel (ratio of singular values {refusal.gap:.1e}). Give them more "
            "digits, or write zeros as 0."
        )
        return UncertainRankError(msg, dofs=refusal.dofs, gap=refusal.gap)
    letters = {"C": "E", "K": "A", "F": "C"}
    found = tuple([letters.get(letter, letter) for letter in refusal.matrices])
    msg = (
        f"{listed(found)} has imaginary parts, which no real state space can represent. descriptor_response evaluates "
        "it."
    )
    return ComplexModelError(msg, matrices=found)


def _improper(system: SecondOrderModel, polynomial: Sequence[FloatArray]) -> ImproperError:
    """Refuse what grows with frequency, with its polynomial part."""
    order = np.zeros(polynomial[0].shape, dtype=int)
    for power, part in enumerate(polynomial):
        order[part != 0.0] = power
    grown = np.argwhere(order > 0).tolist()
    pairs = tuple([(system.inputs[j], system.outputs[i], int(order[i, j])) for i, j in grown])
    words = [
        f"{system.outputs[i]} from {system.inputs[j]} = {_in_powers([float(part[i, j]) for part in polynomial])} + "
        "(strictly proper part)"
        for i, j in grown
    ]
    msg = (
        f"No state space has what grows with frequency: {listed(words, most=SHOWN)}. Close the loop or connect the "
        "systems before the conversion, so that the derivative of the input is no longer needed; filter the input; "
        "take other outputs by select(); or pass improper='drop' for the proper part alone."
    )
    return ImproperError(msg, pairs=pairs)


def _in_powers(coefficients: Sequence[float]) -> str:
    """Write a polynomial in s.

    >>> _in_powers([1.0, 0.0, -2.5])
    '1 - 2.5 s^2'
    """
    text = ""
    for power, value in enumerate(coefficients):
        if value == 0.0:
            continue
        unit = "" if power == 0 else " s" if power == 1 else f" s^{power}"
        sign = (" - " if value < 0.0 else " + ") if text else ("-" if value < 0.0 else "")
        text += f"{sign}{abs(value):.6g}{unit}"
    return text or "0"
