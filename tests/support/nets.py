"""A net of springs, a few of whose nodes carry masses or dampers: many DOFs and few states."""

import numpy as np
import scipy.sparse as sp

from halfdof_ctrl import SecondOrderModel, mechss

MASSES, DAMPERS = 6, 2


def net(side: int) -> SecondOrderModel:
    """Give ``side^2`` nodes on springs of 10 kN/m, 6 masses of 2 kg and 2 dampers of 60 N s/m to the ground."""
    line = sp.diags_array([[2.0] * side, [-1.0] * (side - 1), [-1.0] * (side - 1)], offsets=[0, 1, -1])
    K = 1e4 * (sp.kron(line, sp.eye_array(side)) + sp.kron(sp.eye_array(side), line))
    places = np.random.default_rng(1).permutation(side**2)
    heavy, damped = places[:MASSES], places[MASSES : MASSES + DAMPERS]
    M = sp.coo_array((np.full(MASSES, 2.0), (heavy, heavy)), shape=K.shape)
    C = sp.coo_array((np.full(DAMPERS, 60.0), (damped, damped)), shape=K.shape)
    return mechss(M, C, K, name="net")
