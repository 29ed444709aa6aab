"""A loss factor in the time domain: Maxwell branches in the directions of the damped stiffness, as half DOFs.

With K'' = L diag(d) L^T of rank r, branches g_i, w_i, the reference frequency w_r and ``D = diag(d)``,

    kappa = sum of g_i w_r^2 / (w_r^2 + w_i^2),    Ks = K - kappa K''                                    (L2)

        [ M        ]      [ C                ]      [ Ks + sum g_i K''   -g_1 L D   -g_2 L D ... ]
    M = [    0     ]  C = [   g_1/w_1 D      ]  K = [ -g_1 D L^T          g_1 D                  ]        (L3)
        [       0  ]      [        g_2/w_2 D ]      [ -g_2 D L^T                     g_2 D       ]

    q^T K q = q^T Ks q + sum of g_i (L^T q - z_i)^T D (L^T q - z_i)

K is positive semidefinite if and only if Ks is, and the model is passive: its energy falls by the dampers alone. At the
reference the stiffness is that of the model. Explanation: docs/explanation/loss-factors.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeAlias, cast, get_args

import numpy as np
import scipy.linalg
from scipy.sparse import csc_array, diags_array, kron

from halfdof_ctrl.base.arrays import FloatArray, Matrix, read_only
from halfdof_ctrl.base.doors import answer_of, is_choice, is_real_number, is_whole_number, real_numbers, shown
from halfdof_ctrl.base.errors import ComplexModelError, ParameterError
from halfdof_ctrl.base.names import DERIVATIVE_SUFFIXES, listed
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse, joined_sparse, sparse_zeros
from halfdof_ctrl.base.sparse_factors import sparse_lu
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.loss_branches import Branches, Loss, band_points, enough_branches
from halfdof_ctrl.parts.loss_stiffness import NAMED_SHARE, directions, require_symmetric

Keep: TypeAlias = Literal["loss", "factor"]
LossFactor: TypeAlias = float | Callable[[FloatArray], FloatArray] | tuple[Sequence[float], Sequence[float]] | None

STEEPEST_LOSS = 1.0  #: slope of the loss over frequency in log-log that springs and dampers can follow
SLOPE_ROUNDING = 1e-6  #: by which a computed slope may exceed it
STIFFNESS_ROUNDING = 1e-12  #: of the largest: a negative eigenvalue of the static stiffness below is rounding
LOSS_FACTOR_MOST_BRANCHES = 1000  #: more than any loss over frequency needs
SHIFT = 1e-9  #: of its diagonal, added to a sparse stiffness that is singular


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class MaxwellDampedModel(SecondOrderModel):
    """A model whose loss is in half DOFs, with what that costs. Made by `with_maxwell_damping`.

    Its DOFs are those of the model, then ``loss<i>_<j>``, branch i in direction j.
    """

    band: tuple[float, float]  #: over which the loss is as wanted [Hz]
    reference: float  #: at which the stiffness is that of the model [Hz]
    g: FloatArray  #: (N,) sizes of the branches, over K'' (or over K where a loss factor was given)
    w: FloatArray  #: (N,) their rates [rad/s]
    rank: int  #: directions that are damped
    relative_to: str  #: what the changes of stiffness are relative to: ``K`` or ``K''``
    loss_error: float  #: largest relative error of the loss over the band
    stiffness_drift: tuple[float, float]  #: smallest and largest change of the stiffness over the band
    change_at_rest: float  #: of the stiffness at zero frequency

    def __repr__(self) -> str:
        """Say what was added, and the two errors that causality does not let vanish together."""
        low, high = self.stiffness_drift
        return (
            # two arguments, since a dataclass with slots is made anew and the bare super() knows the old one
            f"{super(MaxwellDampedModel, self).__repr__()}\n"
            f"  {self.g.size} branches in {self.rank} directions: {self.g.size * self.rank} half DOFs\n"
            f"  loss error {self.loss_error:.2%} from {self.band[0]:.4g} to {self.band[1]:.4g} Hz\n"
            f"  stiffness {low:+.2%} to {high:+.2%} of {self.relative_to} over the band, {self.change_at_rest:+.2%} at "
            f"rest, right at {self.reference:.4g} Hz"
        )


def with_maxwell_damping(
    model: SecondOrderModel,
    loss_factor: LossFactor = None,
    *,
    band: tuple[float, float],
    branches: int | None = None,
    tol: float = 0.02,
    reference: float | None = None,
    keep: Keep = "loss",
) -> MaxwellDampedModel:
    """Give a model that loses energy by a loss factor in the time domain too, with half DOFs.

    Parameters
    ----------
    model : SecondOrderModel
        Symmetric M, C, K; a whole model or a part, such as a mount before `assemble`.
    loss_factor : float, callable or (frequency, eta), optional
        eta of the whole stiffness, ``K (1 + j eta)``; a function of the angular frequency [rad/s], or a table of
        frequencies [Hz] and eta. By default the imaginary part of the model's K says what is damped.
    band : (f1, f2)
        Over which the loss is as wanted [Hz].
    branches : int, optional
        Number of branches; by default as many as `tol` needs.
    tol : float
        Largest relative error of the loss over the band.
    reference : float, optional
        Frequency at which the stiffness is that of `model` [Hz]; by default the middle ``sqrt(f1 f2)``.
    keep : {"loss", "factor"}
        What is as wanted over the band: the imaginary part K'' (default), or the loss factor, imaginary over real part,
        with the stiffening that comes with it. ``factor`` keeps the model passive for every eta.

    Returns
    -------
    MaxwellDampedModel
        Real, with a half DOF for each branch and each direction of K''. Print it: the loss error, the drift of the
        stiffness over the band, which causality forbids to vanish with it, and the change at rest are stated.

    Raises
    ------
    ParameterError
        A band, eta, reference or number out of range; an eta(f) whose loss is steeper than springs and dampers can
        follow; a tolerance that 12 branches do not reach; a static stiffness that would turn negative.
    ComplexModelError
        K is real and no loss factor is given, or both say what is lost, or another matrix is complex.
    MatrixError
        K is not symmetric.
    ModelSizeError
        A sparse model that is damped all over: truncate it first.

    Examples
    --------
    >>> model = mechss([[1.0]], None, [[4e4]], dofs=["y"])
    >>> damped = with_maxwell_damping(model, 0.1, band=(3, 300), branches=4)
    >>> damped.dofs, round(damped.loss_error, 4)
    (('y', 'loss1_1', 'loss2_1', 'loss3_1', 'loss4_1'), 0.0055)
    """
    low, high = _checked_band(band)
    at = float(np.sqrt(low * high)) if reference is None else _positive(reference, "reference", "Hz")
    _require_options(keep, branches, tol)
    K, lost, loss, constant = _what_is_lost(model, loss_factor, (low, high), keep)
    require_symmetric(K, "K")
    found, error = enough_branches(
        loss, (low, high), 2.0 * np.pi * at, count=branches, tol=tol, factor=keep == "factor", constant=constant
    )
    L, d = directions(lost, model.dofs, sparse=model.is_sparse)
    kappa = float(found(np.array([2.0 * np.pi * at])).real[0])
    _require_static(model, (K, lost), (L, d), kappa, uniform=loss_factor is not None)
    parts = _realized(model, (K, lost), (L, d), found, kappa)
    rise = found(band_points((low, high))).real - kappa
    return MaxwellDampedModel(
        **parts,
        band=(low, high),
        reference=at,
        g=read_only(found.g),
        w=read_only(found.w),
        rank=d.size,
        relative_to="K" if loss_factor is not None else "K''",
        loss_error=error,
        stiffness_drift=(float(rise.min()), float(rise.max())),
        change_at_rest=-kappa,
    )


def _what_is_lost(
    model: SecondOrderModel, loss_factor: LossFactor, band: tuple[float, float], keep: Keep
) -> tuple[SparseMatrix, SparseMatrix, Loss, bool]:
    """Give K, the matrix that the branches multiply, their loss over frequency, and whether that is constant."""
    K = as_sparse(checked_model(model, "with_maxwell_damping").K)
    others = tuple([letter for letter in model.complex_matrices if letter != "K"])
    if others or (model.is_complex and loss_factor is not None):
        msg = (
            f"{listed(others)} has imaginary parts, and only those of K are a loss that half DOFs can give."
            if others
            else "K has imaginary parts, which say what is lost, and a loss factor is given too. Leave out one of them."
        )
        raise ComplexModelError(msg, matrices=others or ("K",))
    if loss_factor is not None:
        loss, constant = _loss_over_frequency(loss_factor, band)
        return K, K, loss, constant
    if not model.is_complex:
        msg = "K is real and no loss factor is given: nothing says what is lost. Give loss_factor, or a complex K."
        raise ComplexModelError(msg, matrices=())
    if keep == "factor":
        msg = (
            "keep='factor' is for one loss factor of the whole stiffness; the imaginary part of K has many. Keep "
            "'loss'."
        )
        raise ParameterError(msg, parameter="keep", value=keep)
    lost = csc_array(K.imag, copy=True)
    lost.eliminate_zeros()
    return csc_array(K.real, copy=True), lost, np.ones_like, True


def _loss_over_frequency(loss_factor: LossFactor, band: tuple[float, float]) -> tuple[Loss, bool]:
    if is_real_number(loss_factor):
        eta = _positive(loss_factor, "loss_factor", "")
        return lambda omega: np.full(np.shape(omega), eta), True
    loss = loss_factor if callable(loss_factor) else _tabulated(loss_factor, band)
    omega = band_points(band)
    answer = answer_of(loss, omega, parameter="loss_factor", meaning="a function of the frequencies [rad/s] alone")
    values = real_numbers(answer, "loss_factor", "one positive number for each frequency")
    if values.shape != omega.shape or not (np.isfinite(values) & (values > 0.0)).all():
        msg = "loss_factor must give one positive number for each frequency of the band."
        raise ParameterError(msg, parameter="loss_factor", value=None)
    slope = np.diff(np.log(values)) / np.diff(np.log(omega))
    worst = int(np.argmax(np.abs(slope)))
    if abs(slope[worst]) > STEEPEST_LOSS + SLOPE_ROUNDING:
        f = float(omega[worst] / (2.0 * np.pi))
        msg = (
            f"The loss changes as f^{slope[worst]:.2f} at {f:.4g} Hz, but springs and dampers follow slopes from -1 to "
            "1 only: a steeper loss needs inertia. Smooth it, or take a model with mass for it."
        )
        raise ParameterError(msg, parameter="loss_factor", value=f)
    return loss, False


def _tabulated(table: object, band: tuple[float, float]) -> Loss:
    try:
        f, eta = (real_numbers(column, "loss_factor", "real numbers") for column in cast("Any", table))
        sound = f.ndim == 1 and f.shape == eta.shape and f.size > 1 and bool(np.isfinite(f).all() and f[0] > 0.0)
        sound = sound and bool((f[1:] > f[:-1]).all())
        sound = sound and bool((eta > 0.0).all())
    except Exception:  # noqa: BLE001  # the object is the user's, and so is what it raises
        sound = False
    if not sound or f[0] > band[0] * (1.0 + STIFFNESS_ROUNDING) or f[-1] < band[1] * (1.0 - STIFFNESS_ROUNDING):
        msg = (
            "loss_factor must be a positive number, a function of the angular frequency, or a table (frequency, eta) "
            f"with rising frequencies [Hz] that reach from {band[0]:.4g} to {band[1]:.4g} Hz and positive eta."
        )
        raise ParameterError(msg, parameter="loss_factor", value=None)
    return lambda omega: np.exp(np.interp(np.log(omega / (2.0 * np.pi)), np.log(f), np.log(eta)))


def _require_static(
    model: SecondOrderModel,
    stiffness: tuple[SparseMatrix, SparseMatrix],
    damped: tuple[SparseMatrix, FloatArray],
    kappa: float,
    *,
    uniform: bool,
) -> None:
    """Refuse a static stiffness ``Ks = K - kappa K''`` that is negative in a direction in which K is not."""
    (K, lost), (L, d) = stiffness, damped
    if uniform:
        if kappa >= 1.0:
            msg = (
                f"With the loss kept over this band the stiffness at rest would be {1.0 - kappa:.3f} of K, negative, "
                "and the model unstable: so much loss comes with so much stiffening. Pass keep='factor', which keeps "
                "imaginary over real part, or narrow the band."
            )
            raise ParameterError(msg, parameter="loss_factor", value=kappa)
        return
    if model.is_sparse:
        worst, vector = _largest_ratio(K, L, d)
        negative = kappa * worst - 1.0
    else:
        values, vectors = scipy.linalg.eigh((K - kappa * lost).toarray())
        before = scipy.linalg.eigvalsh(K.toarray())
        negative = float(min(before[0], 0.0) - values[0]) / float(np.abs(values).max())
        vector = vectors[:, 0]
    if negative > STIFFNESS_ROUNDING * len(model.dofs):
        part = np.abs(vector)
        found = tuple([model.dofs[i] for i in np.flatnonzero(part > NAMED_SHARE * part.max()).tolist()])
        msg = (
            "With this loss kept over the band the stiffness at rest would be negative in a motion of "
            f"{listed(found)}: so much loss comes with so much stiffening. Narrow the band, or lower the loss there."
        )
        raise ParameterError(msg, parameter="band", value=found)


def _largest_ratio(K: SparseMatrix, L: SparseMatrix, d: FloatArray) -> tuple[float, FloatArray]:
    """Give the largest eigenvalue of ``K'' v = lambda K v``, with K'' = L diag(d) L^T, and its vector."""
    spread = L.toarray() * np.sqrt(d)
    try:
        factors = sparse_lu(K)
    except RuntimeError:  # exactly singular: a structure that floats
        factors = sparse_lu(csc_array(K + SHIFT * diags_array(np.abs(K.diagonal()))))
    solved = factors.solve(spread)
    inner = spread.T @ solved
    values, vectors = scipy.linalg.eigh((inner + inner.T) / 2.0)
    return float(values[-1]), np.asarray(solved @ vectors[:, -1])


def _realized(
    model: SecondOrderModel,
    stiffness: tuple[SparseMatrix, SparseMatrix],
    damped: tuple[SparseMatrix, FloatArray],
    branches: Branches,
    kappa: float,
) -> dict[str, Any]:
    """Give the matrices (L3) and the names as arguments of the model."""
    (K, lost), (L, d) = stiffness, damped
    n, r, count = len(model.dofs), d.size, branches.g.size
    D = csc_array(diags_array(d))
    inner = csc_array(kron(diags_array(branches.g), D))
    dampers = csc_array(kron(diags_array(branches.g / branches.w), D))
    coupling = csc_array(-kron(branches.g[None, :], csc_array(L @ D)))
    whole = csc_array(K + (float(branches.g.sum()) - kappa) * lost)
    size = r * count
    matrices: dict[str, Matrix] = {
        "M": joined_sparse([[model.M, sparse_zeros(n, size)], [sparse_zeros(size, n), sparse_zeros(size, size)]]),
        "C": joined_sparse([[model.C, sparse_zeros(n, size)], [sparse_zeros(size, n), dampers]]),
        "K": joined_sparse([[whole, coupling],
                            [csc_array(coupling.T), inner]]),
    }  # fmt: skip
    m, p = len(model.inputs), len(model.outputs)
    for letter in ("B", "Bv", "Ba"):
        matrices[letter] = joined_sparse([[getattr(model, letter)], [sparse_zeros(size, m)]])
    for letter in ("F", "G", "H"):
        matrices[letter] = joined_sparse([[getattr(model, letter), sparse_zeros(p, size)]])
    for letter in ("D", "Dv", "Da"):
        matrices[letter] = getattr(model, letter)
    values: dict[str, Any] = matrices
    if not model.is_sparse:
        values = {key: X.toarray() if hasattr(X, "toarray") else X for key, X in matrices.items()}
    made = mechss(
        **values, dofs=(*model.dofs, *_names(model.dofs, count, r)), inputs=model.inputs, outputs=model.outputs,
        name=model.name,
    )  # fmt: skip
    found = {field.name: getattr(made, field.name) for field in fields(SecondOrderModel)}
    return found | {"prescribed": model.prescribed, "known_to": model.known_to}


def _names(dofs: tuple[str, ...], count: int, rank: int) -> list[str]:
    taken, stem = set(dofs), "loss"
    while True:
        names = [f"{stem}{i}_{j}" for i in range(1, count + 1) for j in range(1, rank + 1)]
        if not any(name + end in taken for name in names for end in DERIVATIVE_SUFFIXES):
            return names
        stem += "_"


def _checked_band(band: tuple[float, float]) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in band)
    except Exception as cause:
        msg = f"band = {shown(band)}, but it must be two frequencies (f1, f2) [Hz]."
        raise ParameterError(msg, parameter="band", value=band) from cause
    if not (np.isfinite(low) and np.isfinite(high) and 0.0 < low < high):
        msg = f"band = {shown(band)}, but it must be two positive frequencies [Hz], the lower one first."
        raise ParameterError(msg, parameter="band", value=band)
    return low, high


def _positive(value: object, parameter: str, unit: str) -> float:
    number = float(value) if is_real_number(value) else np.nan  # type: ignore[arg-type]
    if not (np.isfinite(number) and number > 0.0):
        msg = f"{parameter} = {shown(value)}{' ' if unit else ''}{unit}, but it must be a positive number."
        raise ParameterError(msg, parameter=parameter, value=value)
    return number


def _require_options(keep: Keep, branches: int | None, tol: float) -> None:
    if not is_choice(keep, get_args(Keep)):
        msg = f"keep must be one of {listed(get_args(Keep))}, not {shown(keep)}."
        raise ParameterError(msg, parameter="keep", value=keep)
    if branches is not None and not (is_whole_number(branches) and 0 < branches <= LOSS_FACTOR_MOST_BRANCHES):
        msg = f"branches = {shown(branches)}, but it must be a whole number from 1 to {LOSS_FACTOR_MOST_BRANCHES}."
        raise ParameterError(msg, parameter="branches", value=branches)
    if not (isinstance(tol, int | float) and 0.0 < tol < 1.0):
        msg = f"tol = {shown(tol)}, but it is a relative error: a number between 0 and 1, such as 0.02."
        raise ParameterError(msg, parameter="tol", value=tol)
