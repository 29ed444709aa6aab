"""What slycot says of the count of finite eigenvalues and zeros: a second opinion, where it is installed.

SLICOT's AG08BD (P. Misra, P. Van Dooren and A. Varga, 1994) extracts the finite part of the same balanced pencil (8) by
its own rank decisions. It is shown and never decides: chains of masses are known on which it loses
zeros.
"""

import numpy as np

from halfdof_ctrl.descriptor.first_order import FirstOrderPencil, first_order_pencil
from halfdof_ctrl.descriptor.growth import system_pencil
from halfdof_ctrl.model.second_order import SecondOrderModel

SECOND_OPINION_LARGEST = 1000  #: dimension of a pencil up to which slycot is asked, which takes it a second


def second_opinion(model: SecondOrderModel) -> str:
    """Count the finite eigenvalues and zeros of a real model by slycot, in words.

    Examples
    --------
    >>> second_opinion(mechss([[1]], [[2]], [[3]])) in {"2 finite eigenvalues, 0 zeros by ag08bd", "not installed"}
    True
    """
    every = list(range(len(model.outputs))), list(range(len(model.inputs)))
    poles = first_order_pencil(model.quadratics.P)
    zeros = first_order_pencil(system_pencil(model, *every))
    if max(zeros.E.shape) > SECOND_OPINION_LARGEST:
        return f"not asked above dimension {SECOND_OPINION_LARGEST}"
    try:
        return f"{_finite_count(poles)} finite eigenvalues, {_finite_count(zeros)} zeros by ag08bd"
    except ImportError:
        return "not installed"
    except (ArithmeticError, ValueError) as refusal:
        return f"no count by ag08bd: {refusal}"


def _finite_count(pencil: FirstOrderPencil) -> int:
    """Count the finite eigenvalues as the zeros of a system with an input and an output of its own, u = y."""
    import slycot  # noqa: PLC0415  # an optional opinion, asked for here alone

    rows, columns = pencil.E.shape
    nothing_in, nothing_out, through = np.zeros((rows, 1)), np.zeros((1, columns)), np.ones((1, 1))
    finite, *_ = slycot.ag08bd(rows, columns, 1, 1, pencil.A, pencil.E, nothing_in, nothing_out, through)
    return int(finite.shape[0])
