"""The frequency response of a sparse model's descriptor form: a factorization a frequency, to be stopped at any time.

Frequencies are worked from coarse to fine, so that what is done when the user stops it covers the whole range.
"""

import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.errors import InterruptedResponseWarning, give_warning
from halfdof_ctrl.base.progress import progress
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.descriptor.data_limit import Channels, warn_of_data
from halfdof_ctrl.descriptor.regularity import require_regular_sparse
from halfdof_ctrl.model.refinement import SUSPECT_GROWTH, DataLimit
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.sparse_evaluation import SparseTransfer, require_room

SINGULAR_GROWTH = 1e10  #: of a random solution at the first frequency, above which the pencil is tested for regularity


@limited_threads(1)
def sparse_frequency_response(model: SecondOrderModel, frequencies: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Evaluate equation (1) at frequencies, and keep what is done on an interrupt (Ctrl-C).

    Parameters
    ----------
    model : SecondOrderModel
        A sparse one.
    frequencies : (k,) ndarray
        [rad/s]

    Returns
    -------
    (p, m, l) complex ndarray
        Values, ``inf + nan j`` where ``P(s)`` is exactly singular.
    (l,) ndarray
        The frequencies of these: all of them, or after an interrupt those that were done, in their order.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.
    ModelSizeError
        A response with too many entries.
    KeyboardInterrupt
        No frequency was done yet.

    Warns
    -----
    InterruptedResponseWarning
        Not all frequencies were done.
    DataLimitWarning
        Entries known to their last digit do not determine it to 1e-6 of its value.
    """
    p, m = model.D.shape
    require_room(p, m, frequencies.size)
    transfer = SparseTransfer(*model.quadratics, bounded_above=SUSPECT_GROWTH * EPS / model.known_to)
    values = np.empty((p, m, frequencies.size), dtype=np.complex128)
    limit = DataLimit.none(values.shape)
    done = np.zeros(frequencies.size, dtype=bool)
    try:
        for index in progress(coarse_to_fine(frequencies.size), "frequencies"):
            values[:, :, index] = transfer.at(1j * frequencies[index])
            if transfer.growth > SINGULAR_GROWTH and not done.any():
                require_regular_sparse(model)
            limit.data[:, :, index], limit.slope[:, :, index] = transfer.limit.data, transfer.limit.slope
            done[index] = True
    except KeyboardInterrupt:
        if not done.any():
            raise
        msg = (
            f"Interrupted after {np.count_nonzero(done)} of {frequencies.size} frequencies: the response holds those "
            "that are done, spread over the whole range."
        )
        give_warning(msg, InterruptedResponseWarning)
        values, frequencies = values[:, :, done], frequencies[done]
        limit = DataLimit(limit.data[:, :, done], limit.slope[:, :, done])
    warn_of_data(Channels.of(model), frequencies, values, limit.of_entries_known_to(model.known_to), frequencies.size)
    return values, frequencies


def coarse_to_fine(count: int) -> list[int]:
    """Order positions so that any beginning of the order is spread over all of them.

    Examples
    --------
    >>> coarse_to_fine(6)
    [0, 5, 4, 2, 1, 3]
    """
    order = dict.fromkeys([0, count - 1])
    stride = 1 << count.bit_length()
    while stride > 1:
        stride //= 2
        order.update(dict.fromkeys(range(0, count, stride)))
    return list(order)
