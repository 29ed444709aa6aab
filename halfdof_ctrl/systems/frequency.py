"""Frequency responses: of the descriptor form by direct solves, of a state space fast and balanced.

Both give `control.FrequencyResponseData`, so that python-control's plots and tools take them. Frequencies
are always the points themselves: two of them are two points, not the limits of a range.
"""

from collections.abc import Sequence

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.descriptor.structure import pencil_structure, require_regular
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    ImproperError,
    ParameterError,
    SingularLeadingMatrixError,
    UncertainRankError,
)
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.model.second_order import SecondOrderModel, null_column_kinds
from halfdof_ctrl.reduction.modal.modes import ShiftedStiffness, is_unsymmetric, lowest_modes
from halfdof_ctrl.base.names import control_label, control_labels
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.descriptor.data_limit import dense_frequency_response
from halfdof_ctrl.descriptor.sparse_response import sparse_frequency_response
from halfdof_ctrl.base.spectrum import eigenvalues_and_rounding
from halfdof_ctrl.systems.state_space import mech2ss
from halfdof_ctrl.base.threads import limited_threads

NO_STATE_SPACE = (ComplexModelError, ImproperError, SingularLeadingMatrixError, UncertainRankError)
DEFAULT_POINTS = 1000  #: frequencies of a default grid, before those at resonances
FEW_POINTS = 200  #: the same for a sparse model with many states, each a factorization
GRID_MODES = 12  #: lowest modes that the default grid of such a model reaches to
NEXT_MODE = 1.2  #: it ends this factor above the last of them
MOST_STATES = 1000  #: of a sparse model whose frequency response is that of its state space
MARGIN = 10.0  #: a default grid reaches this factor below and above the modes
AT_ORIGIN = 1e-7  #: of the largest: smaller poles have no part in a default grid
FALLBACK_RANGE = (0.1, 10.0)  #: [rad/s] grid of a system without any mode away from the origin


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
    if model.is_sparse:
        frequencies = checked_frequencies(model_frequencies(model) if omega is None else omega)
        values, frequencies = sparse_frequency_response(model, frequencies)
    else:
        require_regular(model)
        frequencies = checked_frequencies(model_frequencies(model) if omega is None else omega)
        values = dense_frequency_response(model, frequencies)
    name = None if model.name is None else control_label(model.name)
    return _data(values, frequencies, control_labels(model.inputs), control_labels(model.outputs), name)


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

    Notes
    -----
    The states are balanced by powers of two and all points are worked side by side on a Hessenberg
    form; no eigenvectors are used, so defective systems are as safe as others. See `hessenberg`.

    Examples
    --------
    >>> lag = mech2ss([[0]], [[1]], [[2]])
    >>> frequency_response(lag, [0.0]).complex.tolist()
    [(0.5+0j)]
    """
    if isinstance(sysdata, SecondOrderModel):
        if has_many_states(sysdata):
            return descriptor_response(sysdata, omega)
        try:
            sys = mech2ss(sysdata)
        except NO_STATE_SPACE:
            return descriptor_response(sysdata, omega)
    else:
        sys = sysdata
    frequencies = checked_frequencies(_system_frequencies(sys) if omega is None else omega)
    points = np.asarray(1j * frequencies, dtype=np.complex128)
    if sys.isdtime(strict=True):
        points = np.exp(points * float(sys.dt))
    A, B, C, D = (np.asarray(matrix) for matrix in (sys.A, sys.B, sys.C, sys.D))
    values = state_space_response(A, B, C, D, points)
    return _data(values, frequencies, sys.input_labels, sys.output_labels, sys.name, dt=sys.dt)


def has_many_states(model: SecondOrderModel) -> bool:
    """Tell whether a sparse model has so many states that its descriptor form is evaluated sooner than A, B, C, D."""
    if not model.is_sparse:
        return False
    inertial, half = null_column_kinds(model.M, model.C)
    return bool(2 * np.count_nonzero(inertial) + np.count_nonzero(half) > MOST_STATES)


def model_frequencies(model: SecondOrderModel) -> FloatArray:
    """Choose frequencies [rad/s] for a model.

    Those of `default_frequencies` for its finite eigenvalues; for a sparse model with many states 200 frequencies, from
    a tenth of its lowest mode to its twelfth.

    Raises
    ------
    ParameterError
        A sparse model with many states that has no real modes: complex, unsymmetric, or M or K not semidefinite.
    """
    if not model.is_sparse:
        return default_frequencies(pencil_structure(model).finite_eigenvalues)
    if not has_many_states(model):
        try:
            poles, rounding = eigenvalues_and_rounding(exact_reduction(model.select(model.inputs[0])).A)
            return default_frequencies(poles[np.abs(poles) > rounding])
        except NO_STATE_SPACE:
            pass
    omega = _lowest_frequencies(model)
    return np.geomspace(omega[0] / MARGIN, omega[-1] * NEXT_MODE, FEW_POINTS)


def _lowest_frequencies(model: SecondOrderModel) -> FloatArray:
    """Give the lowest natural frequencies [rad/s] that are not zero, without damping."""
    K, M = as_sparse(model.K), as_sparse(model.M)
    omega = np.zeros(0)
    if not (model.is_complex or is_unsymmetric(K) or is_unsymmetric(M)):
        with limited_threads(1):
            stiffness = ShiftedStiffness.factorized(K, M)
            if stiffness is not None:
                omega = lowest_modes(stiffness, GRID_MODES).omega
    moving = np.asarray(omega[omega > AT_ORIGIN * omega.max(initial=0.0)])
    if moving.size == 0:
        require_regular(model)
        msg = "There are no default frequencies for this sparse model, which has no real modes. Give omega [rad/s]."
        raise ParameterError(msg, parameter="omega", value=None)
    return moving


def default_frequencies(poles: ComplexArray, points: int = DEFAULT_POINTS) -> FloatArray:
    """Choose frequencies [rad/s] that show every mode.

    A logarithmic grid from a tenth of the slowest to ten times the fastest pole, and around each lightly
    damped pole the frequencies that its peak needs.
    """
    size = np.abs(poles)
    moving = poles[size > AT_ORIGIN * size.max(initial=0.0)]
    if moving.size == 0:
        return np.geomspace(*FALLBACK_RANGE, points)
    low, high = np.abs(moving).min() / MARGIN, np.abs(moving).max() * MARGIN
    peaks = moving[(moving.imag > 0.0) & (np.abs(moving.real) < 0.05 * moving.imag)]
    width = np.maximum(np.abs(peaks.real), 1e-6 * peaks.imag)
    near = peaks.imag[:, None] + width[:, None] * np.linspace(-4.0, 4.0, 17)
    near = near[(near > low) & (near < high)]
    return np.unique(np.concatenate([np.geomspace(low, high, points), near]))


def _system_frequencies(sys: control.StateSpace) -> FloatArray:
    """Choose frequencies for a state space; of a discrete one, by s = log(z) / dt and up to the Nyquist frequency."""
    poles, rounding = eigenvalues_and_rounding(np.asarray(sys.A, dtype=float))
    if not sys.isdtime(strict=True):
        return default_frequencies(poles[np.abs(poles) > rounding])
    dt = float(sys.dt)
    frequencies = default_frequencies(np.log(poles[poles != 0.0]) / dt)
    return np.append(frequencies[frequencies < np.pi / dt], np.pi / dt)


def checked_frequencies(omega: npt.ArrayLike) -> FloatArray:
    """Read frequencies as a 1D array of finite numbers that are not negative [rad/s]."""
    try:
        frequencies = np.atleast_1d(np.asarray(omega, dtype=float))
    except (TypeError, ValueError) as cause:
        msg = f"omega must be real numbers [rad/s]: {cause}."
        raise ParameterError(msg, parameter="omega", value=omega) from cause
    if frequencies.ndim != 1 or frequencies.size == 0 or not (np.isfinite(frequencies) & (frequencies >= 0.0)).all():
        msg = "omega must be a list of one or more finite frequencies [rad/s], none of them negative."
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
