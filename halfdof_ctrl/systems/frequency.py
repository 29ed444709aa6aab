"""Frequency responses: of the descriptor form by direct solves, of a state space fast and balanced.

Both give `control.FrequencyResponseData`, so that python-control's plots and tools take them. Frequencies
are always the points themselves: two of them are two points, not the limits of a range.
"""

from collections.abc import Sequence

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.doors import real_numbers
from halfdof_ctrl.base.errors import (
    NoStateSpaceError,
    ParameterError,
)
from halfdof_ctrl.base.names import control_label, control_labels
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.descriptor.data_limit import dense_frequency_response, warn_of_digits
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.descriptor.sparse_response import sparse_frequency_response
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.kinds import null_column_kinds
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.modal.modes import Modes, ShiftedStiffness, is_unsymmetric, lowest_modes
from halfdof_ctrl.systems.channel_zeros import descriptor_zeros, system_zeros
from halfdof_ctrl.systems.default_grid import MARGIN, default_frequencies, visible_zeros
from halfdof_ctrl.systems.doors import checked_system
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.systems.origin import poles_of_model
from halfdof_ctrl.systems.pencil_poles import pencil_poles, sharpened
from halfdof_ctrl.systems.phase_sources import source_of, with_source
from halfdof_ctrl.systems.pole_bounds import bounded_poles
from halfdof_ctrl.systems.seen_modes import (
    MOST_CIRCLED,
    NO_CHANNEL,
    VISIBLE,
    SeenModes,
    seen_by_vectors,
    seen_poles,
)
from halfdof_ctrl.systems.state_space import energy_state_space, system_of_model
from halfdof_ctrl.systems.state_space_data import StateSpaceData
from halfdof_ctrl.systems.working_states import response_of_model, working_form

SYSTEM_OR_MODEL = "a model of mechss or a control.StateSpace"  #: what a frequency response is of
HIGHEST = 1e150  #: [rad/s] of a frequency, whose square times a mass must be a number
DEFAULT_POINTS = 1000  #: frequencies between limits that are given
FEW_POINTS = 200  #: the same for a sparse model with many states, each a factorization
GRID_MODES = 12  #: lowest modes that the default grid of such a model reaches to ...
MORE_MODES = 48  #: ... chosen among so many where channels show few of them
FEWEST_SHOWN = 6  #: modes that are enough to choose among
NEAR_PEAKS = np.array([0.98, 0.999, 1.0001, 1.001, 1.02])  #: frequencies around each of them, in parts of it
NEXT_MODE = 1.2  #: it ends this factor above the last of them
FREQUENCY_MOST_STATES = 1000  #: of a sparse model whose frequency response is that of its state space
POLE_AT_ORIGIN = 1e-7  #: of the largest of a few lowest frequencies: smaller ones are those of rigid motions
ZERO_EFFORT = 1e7  #: channels times cubed size up to which the grid is refined at zeros
NYQUIST_SHARE = 0.999  #: of the Nyquist frequency that grids of discrete systems reach
DISCRETE_ORIGIN = 1e-12  #: |log z| of a pole at 1 that rounding has moved


def descriptor_response(model: SecondOrderModel, omega: npt.ArrayLike | None = None) -> control.FrequencyResponseData:
    """Compute the frequency response of the descriptor form.

    Equation (1) is solved directly at each frequency, without the reduction, also for complex and
    improper models. A sparse model is factorized once a frequency, with a progress bar on a terminal or in a
    notebook where that takes long.

    Parameters
    ----------
    model : SecondOrderModel
    omega : (k,) array_like, optional
        Frequencies [rad/s], the very points; by default those of `model_frequencies`.

    Returns
    -------
    control.FrequencyResponseData
        With the model's names. That of a sparse model may be stopped (Ctrl-C): then it holds the frequencies
        that are done, which are spread over the whole range.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.
    ParameterError
        Frequencies that are no finite, nonnegative numbers; a sparse model for which there are no default ones.
    ModelSizeError
        A response of too many inputs and outputs.

    Warns
    -----
    InterruptedResponseWarning
        The user stopped it.
    DataLimitWarning
        Entries known to their last digit do not determine the response to 1e-6 of its value; the message names the
        frequency where it is worst.

    Examples
    --------
    >>> spring = mechss([[0]], [[0]], [[4]])
    >>> descriptor_response(spring, [1.0, 2.0]).magnitude.tolist()
    [0.25, 0.25]
    """
    if checked_model(model, "descriptor_response").is_sparse:
        frequencies = checked_frequencies(model_frequencies(model) if omega is None else omega)
        values, frequencies = sparse_frequency_response(model, frequencies)
    else:
        require_regular(model)
        frequencies = checked_frequencies(model_frequencies(model) if omega is None else omega)
        values = dense_frequency_response(model, frequencies)
    name = None if model.name is None else control_label(model.name)
    data = _data(values, frequencies, control_labels(model.inputs), control_labels(model.outputs), name)
    return with_source(data, source_of(model))


def frequency_response(
    sysdata: control.StateSpace | SecondOrderModel, omega: npt.ArrayLike | None = None
) -> control.FrequencyResponseData:
    """Compute the frequency response of a state space or model, fast at any order.

    Parameters
    ----------
    sysdata : control.StateSpace or SecondOrderModel
        A model is reduced first; where no state space exists (complex, improper, order uncertain), and where a sparse
        model has more than 1000 states, its descriptor form is evaluated.
    omega : (k,) array_like, optional
        Frequencies [rad/s], the very points; by default a grid around the poles.

    Returns
    -------
    control.FrequencyResponseData
        ``inf + nan j`` at a pole.

    Raises
    ------
    ParameterError
        Frequencies that are no finite, nonnegative numbers.

    Warns
    -----
    DataLimitWarning
        Entries of a model known to their last digit, or to the digits of the file that it came from, do not determine
        the response to 1e-6 of its value; it names the frequency where it is worst of 16.

    Notes
    -----
    The states are balanced by powers of two and all points are worked side by side on a Hessenberg
    form; no eigenvectors are used, so defective systems are as safe as others. See `hessenberg`. A model is worked in
    energy coordinates where it has them and DOF states lose digits, whatever states `mech2ss` gives.

    Examples
    --------
    >>> lag = mech2ss([[0]], [[1]], [[2]])
    >>> frequency_response(lag, [0.0]).complex.tolist()
    [(0.5+0j)]
    """
    reduction, model = None, None
    if isinstance(sysdata, SecondOrderModel):
        if has_many_states(sysdata):
            return descriptor_response(sysdata, omega)
        try:
            reduction = reduced(sysdata)
            sys, model = system_of_model(reduction), sysdata
        except NoStateSpaceError:
            return descriptor_response(sysdata, omega)
    else:
        sys = checked_system(sysdata, "frequency_response", parameter="sysdata", wanted=SYSTEM_OR_MODEL)
    if omega is None:
        form = None if model is None else working_form(model, sys.nstates)
        omega = system_frequencies(sys if form is None else energy_state_space(form), model)
    frequencies = checked_frequencies(omega)
    points = np.asarray(1j * frequencies, dtype=np.complex128)
    if sys.isdtime(strict=True):
        points = np.exp(points * float(sys.dt))
    dofs = StateSpaceData.of(sys)
    if reduction is None or model is None:
        values = state_space_response(*dofs, points)
    else:
        values, amplified = response_of_model(reduction, dofs, points)
        warn_of_digits(model, frequencies, values, amplified=amplified)
    data = _data(values, frequencies, sys.input_labels, sys.output_labels, sys.name, dt=sys.dt)
    return with_source(data, source_of(sys) if model is None else source_of(model, sys))


def has_many_states(model: SecondOrderModel) -> bool:
    """Return whether a sparse model has so many states that its descriptor form is evaluated sooner than A, B, C, D."""
    if not model.is_sparse:
        return False
    inertial, half = null_column_kinds(model.M, model.C)
    return bool(2 * np.count_nonzero(inertial) + np.count_nonzero(half) > FREQUENCY_MOST_STATES)


def model_frequencies(model: SecondOrderModel) -> FloatArray:
    """Choose frequencies [rad/s] for a model.

    Those of `default_frequencies` for the finite eigenvalues that its channels show; for a sparse model with many
    states 200 frequencies, from a tenth of its lowest mode to its twelfth.

    Raises
    ------
    ParameterError
        A sparse model with many states that has no real modes: complex, unsymmetric, or M or K not semidefinite.
    """
    if not model.is_sparse:
        return _grid(*descriptor_modes(model))
    if not has_many_states(model):
        try:
            reduction = reduced(model)
            return _grid(*system_modes(system_of_model(reduction, improper="drop"), reduction.polynomial_part, model))
        except NoStateSpaceError:
            pass
    omega = _lowest_frequencies(model)
    near = (omega[:, None] * NEAR_PEAKS).ravel()
    return np.union1d(np.geomspace(omega[0] / MARGIN, omega[-1] * NEXT_MODE, FEW_POINTS - near.size), near)


def descriptor_modes(model: SecondOrderModel) -> tuple[SeenModes, ComplexArray]:
    """Find which poles of a dense model its descriptor form shows, and the zeros of its channels."""
    modes = seen_poles(
        pencil_poles(model),
        lambda points: model(points, squeeze=False),
        np.abs(np.asarray(model.D)),
        real=not model.is_complex,
    )
    p, m = model.D.shape
    zeros = [np.zeros(0, dtype=np.complex128)]
    if p * m * len(model.dofs) ** 3 <= ZERO_EFFORT:
        zeros += [descriptor_zeros(model, i, j) for i in range(p) for j in range(m)]
    return modes, np.concatenate(zeros)


def system_modes(
    sys: control.StateSpace, polynomial: tuple[FloatArray, ...] = (), model: SecondOrderModel | None = None
) -> tuple[SeenModes, ComplexArray]:
    """Find which poles of a continuous state space and a polynomial part are seen, and the zeros of its channels."""
    data = StateSpaceData.of(sys)
    A, D = data.A, data.D
    poles = bounded_poles(A) if model is None else sharpened(poles_of_model(model, A), model)
    if len(A) > MOST_CIRCLED:
        return seen_by_vectors(*data, poles), np.zeros(0, dtype=np.complex128)
    p, m = D.shape
    zeros = [np.zeros(0, dtype=np.complex128)]
    if p * m * len(A) ** 3 <= ZERO_EFFORT:
        zeros += [system_zeros(data.channel(i, j)) for i in range(p) for j in range(m)]

    def response(points: ComplexArray) -> ComplexArray:
        values = state_space_response(*data, points)
        for power, part in enumerate(polynomial, start=1):
            values = values + part[:, :, None] * points**power
        return values

    if polynomial:
        zeros = zeros[:1]
    return seen_poles(poles, response, np.abs(D)), np.concatenate(zeros)


def _grid(modes: SeenModes, zeros: ComplexArray) -> FloatArray:
    hidden = modes.poles[~modes.in_frequency]
    return default_frequencies(modes.moving, visible_zeros(zeros, hidden))


def _lowest_frequencies(model: SecondOrderModel) -> FloatArray:
    """Return the lowest natural frequencies [rad/s] that some channel shows and that are not zero."""
    K, M = as_sparse(model.K), as_sparse(model.M)
    moving = np.zeros(0)
    if not (model.is_complex or is_unsymmetric(K) or is_unsymmetric(M)):
        with limited_threads(1):
            stiffness = ShiftedStiffness.factorized(K, M)
            for count in (GRID_MODES, MORE_MODES):
                if stiffness is None:
                    break
                modes = lowest_modes(stiffness, count)
                seen = modes.omega[_shown_modes(model, modes)]
                moving = np.asarray(seen[seen > POLE_AT_ORIGIN * modes.omega.max(initial=0.0)])[:GRID_MODES]
                if moving.size >= FEWEST_SHOWN or modes.omega.size < count:
                    break
    if moving.size == 0:
        require_regular(model)
        msg = (
            "There are no default frequencies for this sparse model, of whose lowest real modes its inputs and outputs "
            "show none. Give omega [rad/s]."
        )
        raise ParameterError(msg, parameter="omega", value=None)
    return moving


def _shown_modes(model: SecondOrderModel, modes: Modes) -> npt.NDArray[np.bool_]:
    """Tell which modes add to some channel, at their peak, more than a thousandth of what the others do."""
    phi, omega = modes.shapes, modes.omega
    F, G, H, C = (as_sparse(part) for part in (model.F, model.G, model.H, model.C))
    out = np.abs(F @ phi) + omega * np.abs(G @ phi) + omega**2 * np.abs(H @ phi)
    B, Bv, Ba = (as_sparse(part).T for part in (model.B, model.Bv, model.Ba))
    drive = np.abs(B @ phi) + omega * np.abs(Bv @ phi) + omega**2 * np.abs(Ba @ phi)
    damped = np.einsum("ij,ij->j", phi, C @ phi)
    shown = np.zeros(omega.size, dtype=bool)
    for i, j in np.ndindex(len(out), len(drive)):
        with np.errstate(all="ignore"):
            weight = np.nan_to_num(out[i] * drive[j] / omega**2)
            peak = np.where(damped > 0.0, weight * np.maximum(omega / damped, 1.0), np.inf)
        rest = weight.sum() - weight
        shown |= (weight > NO_CHANNEL * weight.max(initial=0.0)) & (peak > VISIBLE * rest)
    return shown


def system_frequencies(sys: control.StateSpace, model: SecondOrderModel | None = None) -> FloatArray:
    """Choose frequencies for a state space; of a discrete one, by s = log(z) / dt, nearly to its Nyquist frequency."""
    if not sys.isdtime(strict=True):
        return _grid(*system_modes(sys, model=model))
    dt = float(sys.dt)
    poles = bounded_poles(np.asarray(sys.A, dtype=float)).values
    slow = np.log(poles[poles != 0.0]) / dt
    frequencies = default_frequencies(slow[np.abs(slow) * dt > DISCRETE_ORIGIN])
    top = NYQUIST_SHARE * np.pi / dt  # where sampled systems have a zero, and values are rounding
    return np.append(frequencies[frequencies < top], top)


def checked_frequencies(omega: npt.ArrayLike) -> FloatArray:
    """Read frequencies as a 1D array of finite numbers that are not negative [rad/s]."""
    frequencies = np.atleast_1d(real_numbers(omega, "omega", "real numbers [rad/s]"))
    if frequencies.ndim != 1 or frequencies.size == 0 or not (np.isfinite(frequencies) & (frequencies >= 0.0)).all():
        msg = "omega must be a list of one or more finite frequencies [rad/s], none of them negative."
        raise ParameterError(msg, parameter="omega", value=omega)
    if frequencies.max() > HIGHEST:
        msg = f"omega reaches {frequencies.max():.3g} rad/s, but squares of frequencies above {HIGHEST:.0e} overflow."
        raise ParameterError(msg, parameter="omega", value=omega)
    return frequencies


def _data(
    values: ComplexArray,
    frequencies: FloatArray,
    inputs: Sequence[str],
    outputs: Sequence[str],
    name: str | None,
    *,
    dt: float | bool | None = 0,
) -> control.FrequencyResponseData:
    labels = {} if name is None else {"name": name, "sysname": name}
    return control.FrequencyResponseData(
        values, frequencies, dt, inputs=list(inputs), outputs=list(outputs), plot_type="bode", **labels
    )
