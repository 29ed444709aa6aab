"""The plant that a regulator is designed for, without what is only rounding in A.

The condensed stiffness of springs in series on a free body is zero, and what stands there is a rounding error. It would
make a mode of its own that no input reaches; the reduction knows which entries are rounding (`without_rounding`).
Where a model has energy coordinates the design is done in these, which keep the slow modes of stiff structures: states
of DOFs lose all digits of a gain at 40 elements of a beam.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.double_double import matrix_product
from halfdof_ctrl.base.names import force_names
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.design.care_problem import CareProblem
from halfdof_ctrl.design.cost import Cost, PhysicalWeights
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_system
from halfdof_ctrl.reduction.exact_reduction import ExactReduction


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Plant:
    """``x' = A x + B u`` in some states x = T x_dofs, with the cost of these, for N states and m inputs."""

    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    cost: Cost
    sizes: FloatArray  #: (N, N) what the rounding errors of the entries of A are relative to
    left_out: FloatArray | None  #: (N, N) what was taken from A as being rounding of nothing
    shown: FloatArray | None  #: (N, N) K shown is the gain that errors are judged by; None for balanced states
    T: FloatArray | None  #: (N, N) from states of the reduction; None where they are these
    T_inverse: FloatArray | None  #: (N, N)

    @property
    def problem(self) -> CareProblem:
        """The Riccati equation."""
        cost = self.cost
        return CareProblem(self.A, self.B, cost.Q, cost.R, cost.N, self.sizes, self.left_out, self.shown)


def plant_of(reduction: ExactReduction, cost: Cost) -> Plant:
    """Return A and B of a reduction, entries of A that are rounding of nothing set to zero."""
    A = reduction.solution.without_rounding()
    return Plant(
        A=A,
        B=reduction.B,
        cost=cost,
        sizes=reduction.solution.rounding_sizes(),
        left_out=reduction.A - A,
        shown=None,
        T=None,
        T_inverse=None,
    )


def plant_in_energy_states(reduction: ExactReduction, cost: Cost, weights: PhysicalWeights | None) -> Plant | None:
    """Return a model in energy coordinates, where it has them; weights that are physical are formed in them.

    Parameters
    ----------
    reduction : ExactReduction
    cost : Cost
        On the states of the reduction.
    weights : PhysicalWeights or None
        What the cost was made of; None where Q, R and N were given.
    """
    form = energy_system(reduction.model)
    if form is None or form.shift or reduction.shift or form.dofs != reduction.states:
        return None
    if weights is None:
        Q, N = form.T_inverse.T @ cost.Q @ form.T_inverse, form.T_inverse.T @ cost.N
    else:
        Q, N = _physical(form, weights)
    inner = Cost((Q + Q.T) / 2.0, cost.R, N)
    return Plant(
        A=form.A,
        B=form.B,
        cost=inner,
        sizes=np.abs(form.A),
        left_out=_of_free_motions(form),
        shown=form.T * balanced_states(reduction.A)[1],
        T=form.T,
        T_inverse=form.T_inverse,
    )


def _of_free_motions(form: EnergyForm) -> FloatArray | None:
    """Return what the stored stiffness does beyond that of the strains: rounding, in motions that are left free."""
    model, count, end = form.model, form.n_rigid, form.n_rigid + form.n_massive + form.n_strains
    pushed = energy_system(model.select(inputs=force_names(model.dofs))) if count else None
    if pushed is None:
        return None
    K, displacement = np.asarray(model.K, dtype=float), form.displacement.X
    strains = form.from_q[form.n_rigid + form.n_massive : end]
    if np.abs(form.from_q).any(axis=0).all():  # no static DOFs, whose springs the strains hold in series
        held = matrix_product(strains.T, strains)
        force = ((K - held[0]) - held[1]) @ displacement
    else:
        force = np.zeros_like(displacement)
        force[:, :count] = np.add(*matrix_product(K, displacement[:, :count]))
    return np.asarray(-pushed.B @ force)


def _physical(form: EnergyForm, weights: PhysicalWeights) -> tuple[FloatArray, FloatArray]:
    """Form Q and N of (12) in energy coordinates, in which the energy is half the sum of squares."""
    (n, m), place = form.B.shape, {name: k for k, name in enumerate(form.model.dofs)}
    Q, N = np.zeros((n, n)), np.zeros((n, m))
    signals = (form.displacement, form.velocity, form.velocity.derivative(form.A, form.B))
    for signal, weighted in zip(signals, weights.motions, strict=True):
        rows = [place[name] for name in weighted]
        C, W = signal.X[rows], np.array(list(weighted.values()))
        Q += (C.T * W) @ C
        N += (C.T * W) @ signal.direct(m)[rows]
    if weights.energy is not None:
        stored = np.arange(form.n_rigid, n)  # free displacements store nothing
        Q[stored, stored] += 0.5 * weights.energy
    return Q, N
