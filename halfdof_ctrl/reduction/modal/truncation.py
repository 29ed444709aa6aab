"""A small model of the modes that matter, and how far it is from the full one.

Craig and Bampton's method (R. R. Craig and M. C. C. Bampton, 1968). The DOFs b that are kept are those of inputs and
outputs, of dampers, and the half DOFs; the others, o, move with them and in modes of their own with b held still:

    q_b = p_b,    q_o = Psi p_b + Phi p_m + R p_r,
    K_oo Psi = -K_ob,    K_oo Phi = M_oo Phi diag(omega^2),

with the lowest modes Phi, and R for static corrections: what the modes that are left out add at rest under the inertia
``(M_ob + M_oo Psi)`` and under inputs and outputs that are spread over many DOFs. M, C, K, B, F, G, H are projected on
these motions. Damping ``alpha M + beta K`` and what else is spread over the structure is projected too; no DOF is kept
for it. At rest the small model is exact. How far it is from the full one over frequency is measured, by factorizing
P(s) of the full model at frequencies of the band.
Derivation: docs/explanation/truncation.md.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, read_only
from halfdof_ctrl.base.digits import digits_in_words
from halfdof_ctrl.base.doors import is_real_number, is_whole_number, shown
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    MatrixError,
    ParameterError,
    SingularPencilError,
    TruncationWarning,
    give_warning,
)
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.progress import progress, shows_activity
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import LETTERS, SecondOrderModel
from halfdof_ctrl.model.singular import Cause, singular_pencil_error
from halfdof_ctrl.model.sparse_evaluation import SparseTransfer
from halfdof_ctrl.reduction.modal.craig_bampton import KEPT_MODES_MARGIN, Motions, Parts, craig_bampton
from halfdof_ctrl.reduction.modal.modes import is_unsymmetric
from halfdof_ctrl.reduction.modal.projection import IMAGINARY_STIFFNESS, projected
from halfdof_ctrl.reduction.modal.resonance_error import ResonanceErrors, resonance_errors
from halfdof_ctrl.reduction.modal.zero_error import ZeroErrors, zero_errors

MEASURED_POINTS = 12  #: frequencies between resonances at which the error is measured
DOUBTFUL_POINTS = 4  #: frequencies where most is expected of it, at which it is measured too
MOST_POINTS = 1_000_000  #: more frequencies than any use
CANDIDATES = 200  #: frequencies among which these are looked for
MEASURING_EFFORT = 1e10  #: cubes of the small model's size that this may take
DECADES = 2.0  #: of the band below its upper end
ALLOWED_ERROR = 0.05  #: error relative to a channel's largest value, or of a resonance's height, that is warned of
ALLOWED_SHIFT = 0.01  #: relative shift of a resonance that is warned of
BANDWIDTHS = 5.0  #: half-power bandwidths that frequencies between resonances keep from them
SHARPEST = 5e-4  #: half-power bandwidth of an undamped resonance, in 2 pi of its frequency


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class TruncatedModel(SecondOrderModel):
    """A small dense model in the place of a large one, with its measured error. Made by `truncate_modes`.

    Its DOFs are those that were kept, by their names, then the modes ``mode1, mode2, ...`` and static corrections
    ``correction1, ...``. Everything that takes a `SecondOrderModel` takes it.
    """

    full_size: int  #: DOFs of the full model
    kept: tuple[str, ...]  #: names of the DOFs that were kept
    mode_frequencies: FloatArray  #: (k,) of the modes that were kept, with these DOFs held [Hz]
    band: tuple[float, float]  #: lowest and highest frequency at which the error was measured [Hz]
    checked: FloatArray  #: (l,) frequencies at which it was measured [Hz]
    errors: FloatArray  #: (p, m, l) of the transfer function there, relative to each channel's largest value there
    data_limit: FloatArray  #: (p, m, l) what rounding of the full model's entries makes of it, (DATA), likewise
    resonances: ResonanceErrors  #: how far resonances in the band are from those of the full model
    antiresonances: ZeroErrors  #: the same of antiresonances

    @property
    def max_error(self) -> float:
        """Largest of `errors`: between the resonances."""
        return float(self.errors.max(initial=0.0))

    @property
    def max_shift(self) -> float:
        """Largest relative shift of the frequency of a resonance in the band that is more than rounding."""
        found = self.resonances
        return float(found.frequency_shift[found.frequency_shift > found.floor].max(initial=0.0))

    def __repr__(self) -> str:
        """Say what was kept of how much, and the error that was measured."""
        corrections = len(self.dofs) - len(self.kept) - self.mode_frequencies.size
        modes = f"{self.mode_frequencies.size} modes"
        if self.mode_frequencies.size:
            modes += f" up to {self.mode_frequencies[-1]:.4g} Hz"
        return (
            # two arguments, since a dataclass with slots is made anew and the bare super() knows the old one
            f"{super(TruncatedModel, self).__repr__()}\n"
            f"  of {self.full_size} DOFs: {len(self.kept)} kept, {modes} with these held, {corrections} corrections\n"
            f"{_error_in_words(self)}"
        )


@shows_activity("truncation")
@limited_threads(1)
def truncate_modes(
    model: SecondOrderModel, *, f_max: float | None = None, n_modes: int | None = None, points: int = MEASURED_POINTS
) -> TruncatedModel:
    """Make a small model of the modes that matter, and measure its error.

    Parameters
    ----------
    model : SecondOrderModel
        Sparse or dense, with symmetric M and K that are positive semidefinite. K may be complex (structural
        damping): the modes are those of its real part, and the small model's K is complex too. Choose its inputs and
        outputs before, with `select`: their DOFs are kept.
    f_max : float, optional
        Highest frequency that matters [Hz]. The modes up to twice this frequency are kept, found with the kept DOFs
        held.
    n_modes : int, optional
        Number of modes to keep, in the place of `f_max`; the band then reaches to half the highest of them.
    points : int
        Frequencies between resonances at which the full model is factorized to measure the error; up to four where most
        is expected of the error, the resonances of the band, and up to 48 antiresonances come on top.

    Returns
    -------
    TruncatedModel
        Dense, for `mech2ss` and everything else. Print it to see the error.

    Raises
    ------
    ParameterError
        Not exactly one of `f_max` and `n_modes`, one that is not positive, or no convergence of the Lanczos iteration.
    ComplexModelError
        Another matrix than K has imaginary parts.
    MatrixError
        M or K is not symmetric.
    ModelSizeError
        Too many DOFs are to be kept, or too many modes lie in the band.
    SingularPencilError
        Parts of the structure float without mass.

    Warns
    -----
    TruncationWarning
        The error is above 5 per cent of a channel's largest value between resonances or of a resonance's height, or a
        resonance is shifted by more than 1 per cent; the message says where rounding of the full model's
        entries alone makes so much.

    Notes
    -----
    DOFs are kept for every input and output that touches up to six of them, for dampers and for half DOFs. A damping
    ``alpha M + beta K`` needs none, nor does a damping that is spread over more than 1000 DOFs. Inputs and outputs that
    touch more DOFs get a static correction each. Errors at resonances are shifts of frequency and damping and changes
    of the height, one solve with the full model for each; at other frequencies the error is that of the whole transfer
    function, phase included.

    Examples
    --------
    A cantilever of 40 springs and masses, driven at its end; three modes are far fewer than 40:

    >>> n = 40
    >>> K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    >>> K[-1, -1] = 1
    >>> chain = mechss(np.eye(n), 0.01 * K, K).select(f"F_q{n - 1}", f"q{n - 1}")
    >>> small = truncate_modes(chain, n_modes=3)
    >>> small.dofs, bool(small.max_error < 0.001)
    (('q39', 'mode1', 'mode2', 'mode3', 'correction1'), True)
    """
    checked_model(model, "truncate_modes")
    _require_band(f_max, n_modes, points)
    _require_symmetric(model)
    whole = {letter: as_sparse(getattr(model, letter)) for letter in LETTERS}
    parts = dict(whole)
    if model.is_complex:  # modes are those of the real part; both are projected on them
        parts |= {"K": csc_array(parts["K"].real), IMAGINARY_STIFFNESS: csc_array(parts["K"].imag)}
    motions = craig_bampton(parts, model.dofs, f_max, n_modes)
    _require_attached(model, whole)
    top = _band_top(parts, motions.omega, f_max)
    small, basis = projected(model, parts, motions, 2.0 * np.pi * top)
    band = (top / 10.0**DECADES, top)
    try:
        resonances = resonance_errors(whole, small, basis, band)
    except RuntimeError as cause:  # the full model is exactly singular at one of its resonances, thus everywhere
        msg = "Some DOFs of the full model move together without a force and without mass; mech2ss says which."
        raise SingularPencilError(msg, dofs=()) from cause
    return _measured(model, small, motions, resonances, (band, points))


def _require_attached(model: SecondOrderModel, parts: dict[str, SparseMatrix]) -> None:
    """Refuse DOFs without any entry, which would be kept and could move in any way."""
    filled = np.zeros(len(model.dofs))
    for letter in "MCK":
        size: Any = abs(parts[letter])
        filled += size.sum(axis=0) + size.sum(axis=1)
    loose = tuple([model.dofs[place] for place in np.flatnonzero(filled == 0.0).tolist()])
    if loose:
        fact = f"{len(loose)} of {len(model.dofs)} DOFs have no entry in M, C and K"
        raise singular_pencil_error(dofs=loose, equations=loose, fact=fact, causes=[Cause("unattached", loose)])


def _require_band(f_max: float | None, n_modes: int | None, points: int) -> None:
    if (f_max is None) == (n_modes is None):
        msg = "Give either f_max, the highest frequency that matters [Hz], or n_modes, the number of modes to keep."
        raise ParameterError(msg, parameter="f_max", value=f_max)
    if f_max is not None and not (is_real_number(f_max) and np.isfinite(float(f_max)) and f_max > 0.0):
        msg = f"f_max = {shown(f_max)} Hz, but it must be a positive frequency."
        raise ParameterError(msg, parameter="f_max", value=f_max)
    if n_modes is not None and not (is_whole_number(n_modes) and n_modes > 0):
        msg = f"n_modes = {shown(n_modes)}, but it must be a whole number, at least 1."
        raise ParameterError(msg, parameter="n_modes", value=n_modes)
    if not is_whole_number(points) or not 1 <= points <= MOST_POINTS:
        msg = f"points = {shown(points)}, but the error is to be measured at a whole number of frequencies, 1 to 1e6."
        raise ParameterError(msg, parameter="points", value=points)


def _require_symmetric(model: SecondOrderModel) -> None:
    others = tuple([letter for letter in model.complex_matrices if letter != "K"])
    if others:
        msg = (
            f"{listed(others)} has imaginary parts, and a truncation keeps those of K alone (structural damping). "
            "descriptor_response computes such a model as it is."
        )
        raise ComplexModelError(msg, matrices=others)
    for letter in "MK":
        asymmetry = is_unsymmetric(as_sparse(getattr(model, letter)))
        if asymmetry:
            msg = (
                f"{letter} is not symmetric (by {asymmetry:.1e} of its largest entry), so that it has no orthogonal "
                "modes. If a triangle is missing, complete it; prescribe velocities and accelerations on the small "
                "model, truncate_modes(...).prescribe_motion(...); else reduce or evaluate the model as it is."
            )
            raise MatrixError(msg, matrix=letter)


def _band_top(parts: Parts, omega: FloatArray, f_max: float | None) -> float:
    """Return the highest frequency of the band [Hz]."""
    if f_max is not None:
        return f_max
    if omega.size and omega[-1] > 0.0:
        return float(omega[-1] / (2.0 * np.pi * KEPT_MODES_MARGIN))
    stiffness, mass = np.abs(parts["K"].diagonal()), np.abs(parts["M"].diagonal())
    speeds = stiffness[mass > 0.0] / mass[mass > 0.0]
    return float(np.sqrt(speeds.max(initial=0.0) or 1.0) / (2.0 * np.pi))


def _measured(
    model: SecondOrderModel,
    small: SecondOrderModel,
    motions: Motions,
    resonances: ResonanceErrors,
    where: tuple[tuple[float, float], int],
) -> TruncatedModel:
    """Compare with the full model over the band, between the resonances."""
    band, points = where
    wanted = np.union1d(np.geomspace(*band, points), _doubtful(small, motions, *band))
    frequencies = _beside(wanted, resonances.poles, band)
    s = 2j * np.pi * frequencies
    full = SparseTransfer(*[tuple(map(as_sparse, part)) for part in model.quadratics])
    found, desired, limit = small(s, squeeze=False), np.empty((*model.D.shape, s.size), complex), []
    for k, point in enumerate(progress(s.tolist(), "frequencies")):
        desired[:, :, k] = full.at(point)
        limit.append(full.limit.of_entries_known_to(model.known_to).data)
    sound, difference, size = _compared(found, desired)
    errors, data = (_relative(part, size) for part in (difference, np.where(sound, np.stack(limit, axis=2), 0.0)))
    fields = {letter: getattr(small, letter) for letter in LETTERS}
    truncated = TruncatedModel(
        **fields,
        dofs=small.dofs,
        inputs=small.inputs,
        outputs=small.outputs,
        name=small.name,
        prescribed=model.prescribed,
        known_to=small.known_to,
        full_size=len(model.dofs),
        kept=tuple([model.dofs[place] for place in motions.kept.tolist()]),
        mode_frequencies=read_only(motions.omega / (2.0 * np.pi)),
        band=band,
        checked=read_only(frequencies),
        errors=read_only(errors),
        data_limit=read_only(data),
        resonances=resonances,
        antiresonances=zero_errors(full, small, resonances.poles, band),
    )
    told = resonances.frequency_shift > resonances.floor
    height = float(resonances.height[told].max(initial=0.0))
    said = " ".join(_error_in_words(truncated).split())
    undetermined = max(
        float(data.max(initial=0.0)) / ALLOWED_ERROR, float(resonances.floor.max(initial=0.0)) / ALLOWED_SHIFT
    )
    large = truncated.max_error > ALLOWED_ERROR or truncated.max_shift > ALLOWED_SHIFT or height > ALLOWED_ERROR
    known = "their last digit" if model.known_to <= EPS else digits_in_words(model.known_to)
    if large and undetermined > 1.0:
        msg = (
            f"The small model is as far from the full one as rounding of the entries of M, C, K, known to {known}, "
            f"moves that itself: {said}. More modes do not help; fewer elements do."
        )
        give_warning(msg, TruncationWarning)
    elif large:
        msg = f"The small model is not close to the full one: {said}. Raise f_max or n_modes."
        give_warning(msg, TruncationWarning)
    return truncated


def _beside(frequencies: FloatArray, poles: ComplexArray, band: tuple[float, float]) -> FloatArray:
    """Move frequencies [Hz] off the resonances, by five half-power bandwidths."""
    moved = frequencies.copy()
    places, widths = (
        np.abs(poles.imag) / (2.0 * np.pi),
        np.maximum(np.abs(poles.real) / np.pi, SHARPEST * np.abs(poles)),
    )
    for k, frequency in enumerate(moved.tolist()):
        free = frequency
        for _ in range(places.size):
            near = np.flatnonzero(np.abs(free - places) < BANDWIDTHS * widths)
            if near.size == 0:
                break
            free = float((places + 1.01 * BANDWIDTHS * widths)[near].max())
        moved[k] = free if free <= band[1] else frequency
    return np.unique(moved)


def _error_in_words(small: TruncatedModel) -> str:
    """Say the errors at resonances and between them."""
    i, j, k = np.unravel_index(int(small.errors.argmax()), small.errors.shape)
    found, lines = small.resonances, ""
    if found.frequencies.size:
        worst = int(found.frequency_shift.argmax())
        shift = f"{found.frequency_shift[worst]:.1e} (at {found.frequencies[worst]:.4g} Hz)"
        if found.frequency_shift[worst] <= found.floor[worst]:
            shift += ", not told from rounding"
        checked = "" if found.in_band == found.frequencies.size else f" of {found.in_band}"
        lines = (
            f"  {found.frequencies.size}{checked} resonances from {found.frequencies[0]:.4g} to "
            f"{found.frequencies[-1]:.4g} Hz: "
            f"frequency within {shift}, damping within {found.damping_shift.max():.1e}, height within "
            f"{found.height.max():.1e}\n"
        )
    zeros = small.antiresonances
    if (place := zeros.worst) is not None:
        doubt = "" if zeros.shift[place] > zeros.floor[place] else ", not told from rounding"
        lines += (
            f"  {zeros.shift.size} antiresonances: frequency within {zeros.shift[place]:.1e} (at "
            f"{zeros.frequencies[place]:.4g} Hz){doubt}\n"
        )
    rounding = float(small.data_limit[i, j, k])
    allowed = f", of which rounding of the entries may make {rounding:.1e}" if rounding > small.max_error / 10.0 else ""
    return (
        f"{lines}  error between them from {small.band[0]:.4g} to {small.band[1]:.4g} Hz, at {small.checked.size} "
        f"frequencies: {small.max_error:.1e} of the channel's largest value there{allowed}\n"
        f"  worst: {small.outputs[i]} from {small.inputs[j]} at {small.checked[k]:.4g} Hz"
    )


def _relative(difference: FloatArray, size: FloatArray) -> FloatArray:
    """Give (p, m, l) differences relative to the largest size of each channel, of all where a channel is zero."""
    largest = size.max(axis=2, keepdims=True)
    every = max(float(size.max(initial=0.0)), float(np.finfo(float).tiny))
    return np.asarray(difference / np.where(largest > 0.0, largest, every))


def _compared(found: ComplexArray, desired: ComplexArray) -> tuple[npt.NDArray[np.bool_], FloatArray, FloatArray]:
    """Return where two responses are finite, how far they are apart there, and the size of the second."""
    sound = np.isfinite(found) & np.isfinite(desired)
    found, desired = (np.where(sound, part, 0.0) for part in (found, desired))  # no infinity less another
    return sound, np.abs(found - desired), np.abs(desired)


def _doubtful(small: SecondOrderModel, motions: Motions, low: float, top: float) -> FloatArray:
    """Return frequencies of the band [Hz] at which the modes above it matter most: those left out matter there too."""
    count = min(CANDIDATES, int(MEASURING_EFFORT / len(small.dofs) ** 3))
    above = motions.kept.size + np.flatnonzero(motions.omega > 2.0 * np.pi * top)
    if count < DOUBTFUL_POINTS or above.size == 0:
        return np.zeros(0)
    rest = np.setdiff1d(np.arange(len(small.dofs)), above)
    parts: dict[str, Any] = {letter: getattr(small, letter)[np.ix_(rest, rest)] for letter in "MCK"}
    parts |= {letter: getattr(small, letter)[rest] for letter in ("B", "Bv", "Ba")}
    parts |= {letter: getattr(small, letter)[:, rest] for letter in ("F", "G", "H")}
    fewer = mechss(**parts, D=small.D, Dv=small.Dv, Da=small.Da)
    frequencies = np.geomspace(low, top, count)
    s = 2j * np.pi * frequencies
    found, desired = fewer(s, squeeze=False), small(s, squeeze=False)
    _, difference, size = _compared(found, desired)
    expected = _relative(difference, size).max(axis=(0, 1))
    peaks = np.flatnonzero((expected >= np.append(expected[1:], 0.0)) & (expected >= np.append(0.0, expected[:-1])))
    return np.asarray(frequencies[peaks[np.argsort(-expected[peaks])[:DOUBTFUL_POINTS]]])
