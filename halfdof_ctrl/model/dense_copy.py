"""Dense copies of small sparse models, for what works on dense matrices alone."""

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY
from halfdof_ctrl.base.errors import ComplexModelError, ModelSizeError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel


def dense_copy(model: SecondOrderModel, what: str, remedy: str) -> SecondOrderModel:
    """Return a model with dense matrices: itself if they are, a copy of a small sparse one.

    Parameters
    ----------
    model : SecondOrderModel
    what : str
        What works on dense matrices alone, the subject of the message.
    remedy : str
        What to do with larger models, a sentence.

    Raises
    ------
    ModelSizeError
        A sparse model with more than 2000 DOFs, inputs or outputs.

    Examples
    --------
    >>> from scipy.sparse import eye_array
    >>> dense_copy(mechss(None, None, eye_array(2)), "This example", "").K.tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    if not model.is_sparse:
        return model
    n, m, p = len(model.dofs), len(model.inputs), len(model.outputs)
    if max(n, m, p) > LARGEST_DENSE_COPY:
        msg = (
            f"{what} works on dense matrices, of sparse models with up to {LARGEST_DENSE_COPY} DOFs, inputs and "
            f"outputs; this one has {n} DOFs, {m} inputs and {p} outputs. {remedy}"
        )
        raise ModelSizeError(msg, size=max(n, m, p), limit=LARGEST_DENSE_COPY)
    return model.as_dense()


def complex_model_error(model: SecondOrderModel) -> ComplexModelError:
    """Make the refusal of a real state space for a complex model."""
    letters = model.complex_matrices
    msg = (
        f"{listed(letters)} has imaginary parts (structural damping), which no real state space can represent at all "
        "frequencies. descriptor_response computes such a model exactly; for a state space replace the loss "
        "factor eta by a viscous damper, C = eta K / omega at the frequency that matters."
    )
    return ComplexModelError(msg, matrices=letters)
