"""Modal damping: one loss factor as dampers in the modes, without any state.

    K phi_r = w_r^2 M phi_r,  phi_r^T M phi_r = 1,    zeta_r = eta / 2,  or  zeta_r = phi_r^T K'' phi_r / (2 w_r^2)

    C = M Phi diag(2 zeta_r w_r) Phi^T M

acts on what has mass alone; massless DOFs stay static. It loses as much energy in a resonance as the loss factor does,
and differs from it between resonances. Which damping for what: docs/explanation/loss-factors.md.
"""

from dataclasses import replace

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.base.doors import is_real_number, shown
from halfdof_ctrl.base.errors import ComplexModelError, MatrixError, ModelSizeError, ParameterError, SingularPencilError
from halfdof_ctrl.base.names import listed, removal_of
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import NULL_VECTOR_SHARE
from halfdof_ctrl.reduction.modal.modes import is_unsymmetric

MASSLESS_MOTION = 1e-13  #: of the largest mass per stiffness: motions below have none but rounding
RIGID_MOTION = 1e-8  #: of the highest frequency, squared relative to the shift: modes below float and are not damped


def with_modal_damping(model: SecondOrderModel, loss_factor: float | None = None) -> SecondOrderModel:
    """Give a model with dampers that lose in every mode what a loss factor loses, without further states.

    Parameters
    ----------
    model : SecondOrderModel
        Dense, with symmetric M and K that are positive semidefinite.
    loss_factor : float, optional
        One eta for the whole stiffness; every mode gets the damping ratio ``eta / 2``. By default the imaginary part of
        K says how much each mode loses.

    Returns
    -------
    SecondOrderModel
        Real. The dampers come on top of those that the model has.

    Raises
    ------
    ParameterError
        A loss factor that is negative or no number, or imaginary parts of K that drive a mode.
    ComplexModelError
        No loss factor and a real K, or both, or another matrix is complex.
    ModelSizeError
        A sparse model: its damping matrix would be full. Take truncate_modes first.
    MatrixError
        M or K is not symmetric.
    SingularPencilError
        DOFs move without mass and without stiffness.

    Examples
    --------
    A mass of 2 kg on 200 N/m resonates at 10 rad/s; eta = 0.04 is 2 per cent damping, 2 * 0.02 * 10 * 2 = 0.8 N s/m:

    >>> from halfdof_ctrl.model.mechss import mechss
    >>> with_modal_damping(mechss([[2]], None, [[200]]), 0.04).C.round(12).tolist()
    [[0.8]]
    """
    _require(checked_model(model, "with_modal_damping"), loss_factor)
    M, K = np.asarray(model.M), np.asarray(model.K).real
    shapes, omega = _modes(M, K, model.dofs)
    if loss_factor is None:
        lost = np.einsum("ir,ij,jr->r", shapes, np.asarray(model.K).imag, shapes)
        if (lost < -MASSLESS_MOTION * np.abs(lost).max(initial=0.0)).any():
            worst = float(omega[int(np.argmin(lost))] / (2.0 * np.pi))
            msg = f"The imaginary part of K drives the mode at {worst:.4g} Hz instead of damping it. Look at its sign."
            raise ParameterError(msg, parameter="loss_factor", value=worst)
        rates = np.maximum(lost, 0.0) / omega
    else:
        rates = loss_factor * omega
    momentum = M @ shapes
    return replace(model, C=read_only(np.asarray(model.C) + (momentum * rates) @ momentum.T), K=read_only(K.copy()))


def _require(model: SecondOrderModel, loss_factor: float | None) -> None:
    if model.is_sparse:
        msg = (
            f"The model is sparse with {len(model.dofs)} DOFs, and modal damping fills C. Make the small model first, "
            "truncate_modes(model, ...), which takes a complex K, and damp that."
        )
        raise ModelSizeError(msg, size=len(model.dofs), limit=0)
    others = tuple([letter for letter in model.complex_matrices if letter != "K"])
    if others or model.is_complex == (loss_factor is not None):
        msg = (
            f"{listed(others)} has imaginary parts, and only those of K are a loss."
            if others
            else "Either K has imaginary parts or a loss factor is given, not both, not none: one says what is lost."
        )
        raise ComplexModelError(msg, matrices=model.complex_matrices)
    sound = loss_factor is None or (is_real_number(loss_factor) and np.isfinite(loss_factor))
    if not sound or (loss_factor or 0.0) < 0.0:
        msg = f"loss_factor = {shown(loss_factor)}, but it must be a number that is not negative."
        raise ParameterError(msg, parameter="loss_factor", value=loss_factor)
    for letter, part in (("M", model.M), ("K", model.K.real), ("K", model.K.imag)):
        asymmetry = is_unsymmetric(as_sparse(np.ascontiguousarray(part)))
        if asymmetry:
            msg = f"{letter} is not symmetric (by {asymmetry:.1e} of its largest entry): it has no orthogonal modes."
            raise MatrixError(msg, matrix=letter)


def _modes(M: FloatArray, K: FloatArray, dofs: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Give the shapes and frequencies of all modes that have mass and stiffness, by the pair M, K + sigma M."""
    stiffness, mass = np.diagonal(K), np.diagonal(M)
    speeds = stiffness[mass > 0.0] / mass[mass > 0.0]
    sigma = float(speeds[speeds > 0.0].min(initial=np.inf))
    sigma = sigma if np.isfinite(sigma) else 1.0
    shifted = K + sigma * M
    scale = 1.0 / np.sqrt(np.where(np.diagonal(shifted) > 0.0, np.diagonal(shifted), 1.0))
    values, vectors = scipy.linalg.eigh(shifted * scale * scale[:, None])
    if values[0] <= MASSLESS_MOTION * values[-1]:
        part = np.abs(vectors[:, 0])
        loose = tuple([dofs[i] for i in np.flatnonzero(part > NULL_VECTOR_SHARE * part.max()).tolist()])
        msg = (
            f"DOFs {listed(loose)} move together without mass and without stiffness. Give them one, or take them out: "
            f"{removal_of(loose)}."
        )
        raise SingularPencilError(msg, dofs=loose)
    scaled, both = M * scale * scale[:, None], shifted * scale * scale[:, None]
    slowness, turned = scipy.linalg.eigh((scaled + scaled.T) / 2.0, (both + both.T) / 2.0)
    kept = slowness > MASSLESS_MOTION * slowness.max(initial=0.0)
    shapes = turned[:, kept] * scale[:, None] / np.sqrt(slowness[kept])
    squares = np.einsum("ir,ij,jr->r", shapes, K, shapes)
    moving = squares > RIGID_MOTION * sigma
    return np.asarray(shapes[:, moving]), np.asarray(np.sqrt(squares[moving]))
