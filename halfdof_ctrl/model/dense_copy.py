"""Dense copies of small sparse models, for what works on dense matrices alone."""

from collections.abc import Collection

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY
from halfdof_ctrl.base.errors import ComplexModelError, ModelSizeError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.condensed import condensed
from halfdof_ctrl.model.second_order import SecondOrderModel


def dense_copy(model: SecondOrderModel, what: str, remedy: str, *, keep: Collection[str] = ()) -> SecondOrderModel:
    """Return a model with dense matrices: itself if they are, a copy of a small sparse one.

    Of a large sparse one, static DOFs that no input acts on and no output sees are eliminated, which changes neither
    eigenvalues nor transfer function (`condensed`).

    Parameters
    ----------
    model : SecondOrderModel
    what : str
        What works on dense matrices alone, the subject of the message.
    remedy : str
        What to do with larger models, a sentence.
    keep : collection of str
        DOFs that are not to be eliminated.

    Raises
    ------
    ModelSizeError
        A sparse model with more than 2000 inputs, outputs, or DOFs that are inertial, half, or asked for by these.

    Examples
    --------
    >>> from scipy.sparse import eye_array
    >>> dense_copy(mechss(None, None, eye_array(2)), "This example", "").K.tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    if not model.is_sparse:
        return model
    n, m, p = len(model.dofs), len(model.inputs), len(model.outputs)
    small = small_dense(model, LARGEST_DENSE_COPY, keep) if max(m, p) <= LARGEST_DENSE_COPY else None
    if small is None:
        msg = (
            f"{what} works on dense matrices, of sparse models with up to {LARGEST_DENSE_COPY} DOFs, inputs and "
            f"outputs, or with so many left when static DOFs are condensed that no input or output is about; this one "
            f"has {n} DOFs, {m} inputs and {p} outputs. Select fewer of these. {remedy}"
        )
        raise ModelSizeError(msg, size=max(n, m, p), limit=LARGEST_DENSE_COPY)
    return small


def small_dense(model: SecondOrderModel, most: int, keep: Collection[str] = ()) -> SecondOrderModel | None:
    """Return a dense model of at most so many DOFs, condensed where that is needed; None where it has more."""
    if len(model.dofs) <= most:
        return model.as_dense()
    return condensed(model, most=most, keep=keep)


def with_few_signals(model: SecondOrderModel) -> SecondOrderModel:
    """Return a large sparse model that has too many inputs or outputs for dense matrices with one of each.

    For what depends on M, C and K alone.
    """
    if not model.is_sparse or max(len(model.inputs), len(model.outputs)) <= LARGEST_DENSE_COPY:
        return model
    return model.select(model.inputs[0], model.outputs[0])


def is_large(model: SecondOrderModel) -> bool:
    """Return whether a model has more than 2000 DOFs, inputs or outputs, whose dense copy would be too large."""
    return max(len(model.dofs), len(model.inputs), len(model.outputs)) > LARGEST_DENSE_COPY


def complex_model_error(model: SecondOrderModel) -> ComplexModelError:
    """Make the refusal of a real state space for a complex model."""
    letters = model.complex_matrices
    msg = (
        f"{listed(letters)} has imaginary parts (structural damping), which no real state space can represent at all "
        "frequencies. descriptor_response computes such a model exactly; for a state space replace the loss "
        "factor eta by a viscous damper, C = eta K / omega at the frequency that matters."
    )
    return ComplexModelError(msg, matrices=letters)
