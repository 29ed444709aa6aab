"""Port-Hamiltonian form, and the certificate that a model is passive.

    x' = (J - R) Q x + B u,    J = -J^T,  R = R^T,    energy E = x^T Q x / 2                 (28)
    E' = -(Q x)^T R (Q x) + (Q x)^T B u

in energy coordinates, Q the identity but for zeros at displacements of free motions, which hold no energy. With u = 0
the power lost is ``q'^T C q'``, so that R is positive semidefinite where the symmetric part of C is: what C says about
its own entries decides, not eigenvalues of a large R. Where C is not, the most negative eigenvalue of R has a motion,
and there are DOFs at which its dampers feed energy in.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray, read_only
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_form

PASSIVE_WITHIN = 4 * EPS  #: times n: negative eigenvalues of C, each DOF in its own unit, that are rounding
ENTERING_SHARE = 0.1  #: of the largest power that enters: DOFs with less are not named


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class PortHamiltonian:
    """Equation (28) for N states and m inputs. Made by `port_hamiltonian`."""

    J: FloatArray  #: (N, N) skew: energy that is exchanged
    R: FloatArray  #: (N, N) symmetric: energy that is lost
    B: FloatArray  #: (N, m) inputs
    Q: FloatArray  #: (N, N) diagonal: energy is x^T Q x / 2
    states: tuple[str, ...]  #: names of the states, as ``mech2ss(model, states="energy")`` has them
    is_passive: bool  #: R is positive semidefinite, so that the model creates no energy
    smallest: float  #: smallest eigenvalue of the symmetric part of C, scaled to unit diagonal: 0 for no dampers [-]
    dofs: tuple[str, ...]  #: DOFs through which energy enters, the strongest first; empty where none does

    def __repr__(self) -> str:
        """Print the certificate."""
        size = f"PortHamiltonian, {len(self.J)} states"
        if self.is_passive:
            return f"{size}: passive (smallest eigenvalue of the scaled damping {self.smallest:.1e})"
        return f"{size}: not passive, energy enters through {listed(self.dofs)}"


def port_hamiltonian(model: SecondOrderModel) -> PortHamiltonian:
    """Write a model as a port-Hamiltonian system and certify that it is passive, or say where energy enters.

    Parameters
    ----------
    model : SecondOrderModel
        With energy coordinates (see `mech2ss` with ``states="energy"``).

    Returns
    -------
    PortHamiltonian

    Raises
    ------
    EnergyFormError
        The model has no energy coordinates; `reason` and `dofs` say why.
    ComplexModelError
        Complex matrices.

    Examples
    --------
    A damper of 3 N s/m on 1 kg:

    >>> ph = port_hamiltonian(mechss([[1]], [[3]], [[4]]))
    >>> ph.R.tolist(), ph.is_passive
    ([[0.0, 0.0], [0.0, 3.0]], True)

    A negative one feeds energy in:

    >>> port_hamiltonian(mechss([[1]], [[-3]], [[4]], dofs="y")).dofs
    ('y',)
    """
    form = energy_form(checked_model(model, "port_hamiltonian"))
    exchanged, lost = _split(form)
    damping = (np.asarray(form.model.C, dtype=float) + np.asarray(form.model.C, dtype=float).T) / 2.0
    smallest, _ = _smallest(damping, np.abs(np.diagonal(damping)))
    rounding = PASSIVE_WITHIN * len(form.model.dofs)
    is_passive = smallest >= -rounding
    dofs: tuple[str, ...] = ()
    if not is_passive:
        K, _, M = (np.diagonal(np.asarray(part, dtype=float)) for part in form.model.quadratics.P)
        least, velocity = _smallest(damping, np.maximum(np.abs(np.diagonal(damping)), np.sqrt(np.abs(K * M))))
        is_passive = least >= -rounding
        dofs = () if is_passive else _entrances(form, lost, velocity)
    return PortHamiltonian(
        J=read_only(exchanged),
        R=read_only(lost),
        B=form.B,
        Q=read_only(np.diag((np.arange(len(form.A)) >= form.n_rigid).astype(float))),
        states=form.states,
        is_passive=is_passive,
        smallest=smallest,
        dofs=dofs,
    )


def _split(form: EnergyForm) -> tuple[FloatArray, FloatArray]:
    """Return J and R; displacements of free motions follow their rates and hold no energy."""
    d = form.n_rigid
    whole = np.array(form.A)
    whole[:d] = 0.0
    exchanged, lost = (whole - whole.T) / 2.0, -(whole + whole.T) / 2.0
    exchanged[:d, d:] = form.A[:d, d:]
    exchanged[d:, :d] = -form.A[:d, d:].T
    return exchanged, lost + 0.0


def _smallest(C: FloatArray, size: FloatArray) -> tuple[float, FloatArray]:
    """Return the smallest eigenvalue of a symmetric C in units in which its diagonal is at most one, and its motion.

    The sizes of DOFs may be those of their dampers, or of what their own springs and masses would make of them: beside
    these, and not beside the dampers of other DOFs, a negative damper is rounding or not.
    """
    used = C.any(axis=0)
    velocity = np.zeros(len(C))
    if not used.any():
        return 0.0, velocity
    part = C[np.ix_(used, used)]
    root = np.sqrt(size[used])
    scale = 1.0 / np.where(root > 0.0, root, np.sqrt(np.abs(part).max(axis=0)))
    values, vectors = np.linalg.eigh(scale[:, None] * part * scale)
    velocity[used] = scale * vectors[:, 0]
    return float(values[0]), velocity


def _entrances(form: EnergyForm, lost: FloatArray, velocity: FloatArray) -> tuple[str, ...]:
    """Return the DOFs at which dampers feed energy into a motion, the strongest first.

    That is the motion of the most negative eigenvalue of R, or a given one where dampers that are far larger hide it.
    """
    values, vectors = np.linalg.eigh(lost)
    if values[0] < -PASSIVE_WITHIN * len(lost) * np.abs(values).max():
        velocity = form.velocity.X @ vectors[:, 0]
    power = -velocity * ((form.model.C + form.model.C.T) / 2.0 @ velocity)
    strongest = float(power.max())
    order = [j for j in np.argsort(-power, kind="stable").tolist() if power[j] >= ENTERING_SHARE * strongest]
    return tuple([form.model.dofs[j] for j in order])
