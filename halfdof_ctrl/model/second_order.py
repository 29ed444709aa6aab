"""The mechanical model: four quadratic matrix polynomials and the names of their signals.

    P(s) q = B(s) u,    y = F(s) q + D(s) u,    H(s) = F(s) P(s)^-1 B(s) + D(s)          (1)

    P(s) = K + C s + M s^2        B(s) = B + Bv s + Ba s^2
    F(s) = F + G s + H s^2        D(s) = D + Dv s + Da s^2

The letters are those of MATLAB's `mechss`. `mechss` is the one door through which models come in; what
it has checked is not checked again. Derivation of all that follows: docs/explanation/reduction.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import (
    DENSE_ROW_LIMIT,
    MATRIX_DIMENSIONS,
    ComplexArray,
    Matrix,
    checked_matrix,
    checked_square_matrices,
    is_complex,
    read_only,
)
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.model.evaluation import Coefficients, checked_points, quadratic_transfer, squeezed
from halfdof_ctrl.model.motion import MotionKind, prescribed_signals, require_free, with_motion_as_input
from halfdof_ctrl.base.names import (
    DERIVATIVE_SUFFIXES,
    FORCE_PREFIX,
    Names,
    as_tuple,
    checked_dofs,
    force_names,
    listed,
    picked_places,
    reconciled_names,
)
from halfdof_ctrl.base.sparse_arrays import (
    MatrixLike,
    as_sparse,
    checked_sparse_matrix,
    checked_sparse_squares,
    filled_rows,
    has_sparse,
    is_sparse,
    locked,
    picked_below,
    picked_beside,
    transposed,
    unit_columns,
    unit_like,
    zeros_like,
)

LETTERS = ("M", "C", "K", "B", "Bv", "Ba", "F", "G", "H", "D", "Dv", "Da")
EPS = 2.0**-52  #: rounding of float64
LARGEST_RANKED_REPR = 500  #: above so many DOFs `repr` does not spend the time to rank W


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class SecondOrderModel:
    """``M q'' + C q' + K q = B u``, ``y = F q + G q' + H q'' + D u`` with named signals.

    Made by `mechss`, not directly. For n DOFs, m inputs and p outputs; all arrays are read-only. Units
    are those of the user; with SI units and forces as inputs they read as given here.
    """

    M: Matrix  #: (n, n) mass [kg]; all matrices are `scipy.sparse.csc_array` in a sparse model (`is_sparse`)
    C: Matrix  #: (n, n) damping [N s/m]
    K: Matrix  #: (n, n) stiffness [N/m]
    B: Matrix  #: (n, m) what an input does to the equations [N per unit of input]
    Bv: Matrix  #: (n, m) the same for its first derivative
    Ba: Matrix  #: (n, m) the same for its second derivative
    F: Matrix  #: (p, n) displacements in the outputs
    G: Matrix  #: (p, n) velocities in the outputs
    H: Matrix  #: (p, n) accelerations in the outputs
    D: Matrix  #: (p, m) direct term
    Dv: Matrix  #: (p, m) the same for the first derivative of the inputs
    Da: Matrix  #: (p, m) the same for the second derivative of the inputs
    dofs: tuple[str, ...]  #: names of the n DOFs
    inputs: tuple[str, ...]  #: names of the m inputs
    outputs: tuple[str, ...]  #: names of the p outputs
    name: str | None = None  #: name of the model, which the state space takes over
    prescribed: tuple[str, ...] = ()  #: DOFs, here or removed, whose motion is an input (see `prescribe_motion`)
    known_to: float = EPS  #: relative rounding of the entries of M, C, K; 5e-10 from a file with ten digits

    @property
    def is_complex(self) -> bool:
        """Whether any matrix has imaginary parts (structural damping)."""
        return any([is_complex(matrix) for matrix in self._matrices()])  # noqa: C419  # a list is faster here

    @property
    def is_sparse(self) -> bool:
        """Whether the matrices are sparse, all of them, since one of M, C, K was given so to `mechss`."""
        return is_sparse(self.K)

    @property
    def complex_matrices(self) -> tuple[str, ...]:
        """Letters of the complex matrices."""
        return tuple([letter for letter, matrix in zip(LETTERS, self._matrices(), strict=True) if is_complex(matrix)])

    def _matrices(self) -> tuple[Matrix, ...]:
        return (self.M, self.C, self.K, self.B, self.Bv, self.Ba, self.F, self.G, self.H, self.D, self.Dv, self.Da)

    def __call__(self, s: npt.ArrayLike, squeeze: bool | None = None) -> ComplexArray:  # noqa: FBT001  # as in control
        """Transfer function H(s) of equation (1) by a direct solve at each `s`.

        Parameters
        ----------
        s : complex or 1D array_like of complex
            Points in the complex plane [rad/s].
        squeeze : bool, optional
            As in `control.StateSpace.__call__`: by default a single-input single-output model gives
            a scalar or 1D array; False keeps (p, m, len(s)), True drops every axis of length one.

        Returns
        -------
        complex ndarray
            (p, m) for a scalar `s`, (p, m, len(s)) for an array, less the axes that `squeeze` drops.
            ``inf + nan j`` where P(s) is exactly singular, as python-control has it.

        Examples
        --------
        A spring of 4 N/m under 2 N gives 0.5 m:

        >>> complex(mechss([[1]], [[0]], [[4]], [[2]])(0))
        (0.5+0j)
        """
        points = checked_points(s)
        values = quadratic_transfer(*_coefficients(self), points.reshape(-1))
        return squeezed(values, scalar=points.ndim == 0, squeeze=squeeze)

    def select(self, inputs: Names = None, outputs: Names = None) -> "SecondOrderModel":
        """Give the model with other inputs and outputs, picked by name.

        Parameters
        ----------
        inputs : str or sequence of str, optional
            Inputs of this model, or ``F_<dof>``, the unit force on any DOF. All inputs by default.
        outputs : str or sequence of str, optional
            Outputs of this model, or ``<dof>``, ``<dof>_dot``, ``<dof>_ddot``: displacement,
            velocity or acceleration of any DOF. All outputs by default.

        Raises
        ------
        SignalNameError
            A name that is neither, or one that stands twice.
        """
        model = self if inputs is None else _with_inputs(self, inputs)
        return model if outputs is None else _with_outputs(model, outputs)

    def prescribe_motion(
        self, dof: Names, kind: MotionKind = "displacement", *, inputs: Names = None, outputs: Names = None
    ) -> "SecondOrderModel":
        """Make the motion of DOFs an input and the force that it takes an output (base excitation).

        Parameters
        ----------
        dof : str or sequence of str
            DOFs whose motion is prescribed.
        kind : {"displacement", "velocity", "acceleration"}
            What the input is, named ``<dof>``, ``<dof>_dot`` or ``<dof>_ddot``. With displacements the DOFs leave
            the model; else they stay, with the equation ``q' = u`` or ``q'' = u`` in place of their own.
        inputs, outputs : str or sequence of str, optional
            All signals of the new model, in order: the new ones (motions, reactions ``R_<dof>``) and whatever
            `select` finds in this model, motions of `dof` itself among them. By default the new ones alone,
            behind what `select` could not bring back later: inputs that are no forces on DOFs (motions
            prescribed before) and outputs that are no motions. Inputs that are left out are zero.

        Returns
        -------
        SecondOrderModel
            ``R_<dof>`` is the force on the DOF that must act besides those of the other inputs.

        Raises
        ------
        SignalNameError
            A DOF that is unknown, named twice or prescribed already; no DOF left; an unknown or taken name.
        ParameterError
            `kind` is none of the three.

        Examples
        --------
        The foot of a spring of 8 N/m under 2 kg: at s = 1 the mass follows by 8 / (2 + 8), and it takes 1.6 N/m.

        >>> model = mechss([[2, 0], [0, 0]], None, [[8, -8], [-8, 8]], dofs=["mass", "foot"])
        >>> model.prescribe_motion("foot", outputs=["mass", "R_foot"])(1.0).real.round(12).tolist()
        [[0.8], [1.6]]
        """
        new = prescribed_signals(self, dof, kind, inputs, outputs)
        base = self.select(new.old_inputs or self.inputs[:1], new.old_outputs or self.outputs[:1])
        P, B, F, D = with_motion_as_input(*_coefficients(base), new.driven, new.derivative)
        letters = ("K", "C", "M", "B", "Bv", "Ba", "F", "G", "H", "D", "Dv", "Da")
        matrices: dict[str, Any] = dict(zip(letters, map(locked, (*P, *B, *F, *D)), strict=True))
        model = replace(
            base,
            **matrices,
            dofs=tuple([name for name in self.dofs if new.derivative or name not in new.names]),
            inputs=(*base.inputs, *new.motions),
            outputs=(*base.outputs, *new.reactions),
            prescribed=(*self.prescribed, *new.names),
        )
        return model.select(new.inputs, new.outputs)

    def as_dense(self) -> "SecondOrderModel":
        """Give the model with dense matrices: itself if they are.

        Raises
        ------
        ModelSizeError
            A matrix would have more than 5000 x 5000 entries.
        """
        if not self.is_sparse:
            return self
        n, m, p = (len(names) for names in (self.dofs, self.inputs, self.outputs))
        largest = max(n, m, p)
        if largest > DENSE_ROW_LIMIT:
            msg = (
                f"Dense matrices of {n} DOFs, {m} inputs and {p} outputs would take up to {8e-9 * largest**2:.3g} GB "
                f"each; the limit is {DENSE_ROW_LIMIT} of each. Select fewer signals, or stay with the sparse model."
            )
            raise ModelSizeError(msg, size=largest, limit=DENSE_ROW_LIMIT)
        dense: dict[str, Any] = {letter: read_only(as_sparse(getattr(self, letter)).toarray()) for letter in LETTERS}
        return replace(self, **dense)

    def __repr__(self) -> str:
        """Give the model on four lines: what it is called, how its DOFs split, its signals."""
        title = f"{type(self).__name__} {self.name!r}" if self.name else type(self).__name__
        complex_part = f"\n  complex: {', '.join(self.complex_matrices)}" if self.is_complex else ""
        prescribed_part = f"\n  motion prescribed: {listed(self.prescribed)}" if self.prescribed else ""
        rounded_part = f"\n  entries known to {self.known_to:.0e}" if self.known_to > EPS else ""
        return (
            f"{title}: {len(self.dofs)} DOFs: {_split_in_words(self.M, self.C, self.K)}\n"
            f"  dofs:    {listed(self.dofs)}\n"
            f"  inputs:  {listed(self.inputs)}\n"
            f"  outputs: {listed(self.outputs)}{prescribed_part}{complex_part}{rounded_part}"
        )


def mechss(
    M: MatrixLike | None,
    C: MatrixLike | None,
    K: MatrixLike | None,
    B: MatrixLike | None = None,
    F: MatrixLike | None = None,
    G: MatrixLike | None = None,
    *,
    H: MatrixLike | None = None,
    D: MatrixLike | None = None,
    Bv: MatrixLike | None = None,
    Ba: MatrixLike | None = None,
    Dv: MatrixLike | None = None,
    Da: MatrixLike | None = None,
    dofs: Names = None,
    inputs: Names = None,
    outputs: Names = None,
    name: str | None = None,
) -> SecondOrderModel:
    """Create a mechanical model from mass, damping and stiffness.

    Parameters
    ----------
    M, C, K : (n, n) array_like, scipy sparse array or matrix, or None
        Mass [kg], damping [N s/m] and stiffness [N/m]; None for a matrix of zeros, but not all three.
        They may be singular, unsymmetric or complex (structural damping). If one of them is sparse, the model is: all
        its matrices are kept in compressed columns, and nothing of n x n entries is ever formed.
    B : (n, m) array_like or sparse, optional
        Forces per input [N]; by default a unit force on every DOF, named ``F_<dof>``. A 1D array of
        length n is one input.
    F, G, H : (p, n) array_like, optional
        Displacements, velocities and accelerations in the outputs; without any of them every
        displacement is an output. A 1D array of length n is one output.
    D : (p, m) array_like or 0, optional
        Direct term from the inputs to the outputs.
    Bv, Ba : (n, m) array_like, optional
        Forces per first and second derivative of the inputs.
    Dv, Da : (p, m) array_like, optional
        Direct terms of the first and second derivative of the inputs.
    dofs, inputs, outputs : str or sequence of str, optional
        Names. By default the DOFs are ``q0, q1, ...``, a unit force on a DOF is ``F_<dof>``, a DOF's
        motion ``<dof>``, ``<dof>_dot`` or ``<dof>_ddot``, and any other signal ``u[0]``, ``y[0]``, ...
    name : str, optional
        Name of the model.

    Returns
    -------
    SecondOrderModel

    Raises
    ------
    MatrixError
        A matrix of wrong shape, empty, of things that are no numbers, with NaN or Inf.
    SignalNameError
        Names that are too many or too few, twice the same, or that name a DOF's force or motion
        while the matrices say something else.

    Examples
    --------
    A mass of 2 kg on a spring, the spring's far end held by a damper alone:

    >>> model = mechss([[2, 0], [0, 0]], [[0, 0], [0, 5]], [[8, -8], [-8, 8]], dofs=["mass", "joint"])
    >>> model
    SecondOrderModel: 2 DOFs: 1 inertial, 1 half, 0 static; 3 states
      dofs:    mass, joint
      inputs:  F_mass, F_joint
      outputs: mass, joint
    """
    M, C, K = (checked_sparse_squares if has_sparse((M, C, K)) else checked_square_matrices)((M, C, K), "MCK")
    n = M.shape[0]
    names = tuple([f"q{index}" for index in range(n)]) if dofs is None else checked_dofs(dofs, n)
    m = _signals((B, Bv, Ba), axis=1, default=n)
    p = _signals((F, G, H), axis=0, default=n)
    every_force = B is None and Bv is None and Ba is None
    every_displacement = F is None and G is None and H is None
    input_columns = (
        unit_like(K, n) if every_force else _checked_or_zero(B, "B", n, m, K),
        _checked_or_zero(Bv, "Bv", n, m, K),
        _checked_or_zero(Ba, "Ba", n, m, K),
    )
    output_rows = (
        unit_like(K, n) if every_displacement else _checked_or_zero(F, "F", p, n, K),
        _checked_or_zero(G, "G", p, n, K),
        _checked_or_zero(H, "H", p, n, K),
    )
    direct = tuple([_checked_or_zero(X, name, p, m, K) for X, name in ((D, "D"), (Dv, "Dv"), (Da, "Da"))])
    plain_inputs = every_force and inputs is None
    plain_outputs = every_displacement and outputs is None and D is None and Dv is None and Da is None
    return SecondOrderModel(
        M=M,
        C=C,
        K=K,
        B=input_columns[0],
        Bv=input_columns[1],
        Ba=input_columns[2],
        F=output_rows[0],
        G=output_rows[1],
        H=output_rows[2],
        D=direct[0],
        Dv=direct[1],
        Da=direct[2],
        dofs=names,
        inputs=force_names(names) if plain_inputs else _input_names(inputs, input_columns, names),
        outputs=names if plain_outputs else _output_names(outputs, output_rows, direct, names),
        name=name,
    )


def null_column_kinds(M: Matrix, C: Matrix) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Tell which columns of M are not null, and which of the others have a column in C that is not."""
    if is_sparse(M):
        inertial, damped = (np.diff(as_sparse(X).indptr) > 0 for X in (M, C))
    else:
        inertial, damped = (np.logical_or.reduce(X, axis=0) for X in (M, C))
    return np.asarray(inertial), np.asarray(damped > inertial)


def _signals(given: Sequence[MatrixLike | None], axis: int, default: int) -> int:
    """Count the inputs (axis 1) or outputs (axis 0) by the first matrix that is given."""
    for value in given:
        if value is not None:
            shape = np.shape(cast("npt.ArrayLike", value))
            return shape[axis] if len(shape) == MATRIX_DIMENSIONS else 1
    return default


def _checked_or_zero(value: object, letter: str, rows: int, columns: int, like: Matrix) -> Matrix:
    """Check one matrix, dense or sparse as `like` is."""
    if value is None or (type(value) in {int, float} and value == 0):
        return zeros_like(like, rows, columns)
    return (checked_sparse_matrix if is_sparse(like) else checked_matrix)(value, letter, (rows, columns))


def _input_names(given: Names, columns: Sequence[Matrix], dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name the inputs; a column that is a unit force on a DOF and the name ``F_<dof>`` belong together."""
    if is_sparse(columns[0]):
        meaning = unit_columns(columns)
    else:
        meaning = [_unit_vectors([matrix[:, j] for matrix in columns]) for j in range(columns[0].shape[1])]
    found = [FORCE_PREFIX + dofs[hit[1]] if hit is not None and hit[0] == 0 else None for hit in meaning]
    return reconciled_names(given, found, dofs, "input")


def _output_names(
    given: Names, rows: Sequence[Matrix], direct: Sequence[Matrix], dofs: tuple[str, ...]
) -> tuple[str, ...]:
    """Name the outputs; a row that is a DOF's motion and the motion's name belong together."""
    if is_sparse(rows[0]):
        meaning, fed = unit_columns([transposed(matrix) for matrix in rows]), filled_rows(direct)
    else:
        every = range(rows[0].shape[0])
        meaning = [_unit_vectors([matrix[i] for matrix in rows]) for i in every]
        fed = [any(matrix[i].any() for matrix in direct) for i in every]
    found = [
        None if hit is None or is_fed else dofs[hit[1]] + DERIVATIVE_SUFFIXES[hit[0]]
        for hit, is_fed in zip(meaning, fed, strict=True)
    ]
    return reconciled_names(given, found, dofs, "output")


def _unit_vectors(vectors: Sequence[Matrix]) -> tuple[int, int] | None:
    """Find (which vector, which entry) if all entries are zero but a single one that is 1."""
    places = [(which, int(entry)) for which, vector in enumerate(vectors) for entry in np.flatnonzero(vector)]
    if len(places) == 1 and vectors[places[0][0]][places[0][1]] == 1:
        return places[0]
    return None


def _coefficients(model: SecondOrderModel) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """Give the coefficients of 1, s, s^2 in P, B, F and D of equation (1)."""
    P, B, F = (model.K, model.C, model.M), (model.B, model.Bv, model.Ba), (model.F, model.G, model.H)
    return P, B, F, (model.D, model.Dv, model.Da)


def _with_inputs(model: SecondOrderModel, names: Names) -> SecondOrderModel:
    require_free(names, model.inputs, model.prescribed)
    picked = picked_places(names, model.inputs, model.dofs, "input")
    n, p = model.M.shape[0], model.F.shape[0]
    unit, no_force, no_feed = unit_like(model.K, n), zeros_like(model.K, n, n), zeros_like(model.K, p, n)
    return replace(
        model,
        inputs=as_tuple(names),
        B=picked_beside([model.B, unit], picked),
        Bv=picked_beside([model.Bv, no_force], picked),
        Ba=picked_beside([model.Ba, no_force], picked),
        D=picked_beside([model.D, no_feed], picked),
        Dv=picked_beside([model.Dv, no_feed], picked),
        Da=picked_beside([model.Da, no_feed], picked),
    )


def _with_outputs(model: SecondOrderModel, names: Names) -> SecondOrderModel:
    picked = picked_places(names, model.outputs, model.dofs, "output")
    n, m = model.M.shape[0], model.B.shape[1]
    unit, no_motion, no_feed = unit_like(model.K, n), zeros_like(model.K, n, n), zeros_like(model.K, 3 * n, m)
    return replace(
        model,
        outputs=as_tuple(names),
        F=picked_below([model.F, unit, no_motion, no_motion], picked),
        G=picked_below([model.G, no_motion, unit, no_motion], picked),
        H=picked_below([model.H, no_motion, no_motion, unit], picked),
        D=picked_below([model.D, no_feed], picked),
        Dv=picked_below([model.Dv, no_feed], picked),
        Da=picked_below([model.Da, no_feed], picked),
    )


def _split_in_words(M: Matrix, C: Matrix, K: Matrix) -> str:
    """Say how many DOFs are inertial, half and static, and the states that follow."""
    inertial, half = null_column_kinds(M, C)
    n, n_inertial, n_half = M.shape[0], int(inertial.sum()), int(half.sum())
    kinds = f"{n_inertial} inertial, {n_half} half, {n - n_inertial - n_half} static"
    if n <= LARGEST_RANKED_REPR:
        M, C, K = (as_sparse(X).toarray() if is_sparse(X) else X for X in (M, C, K))
        leading = np.where(inertial, M, np.where(half, C, K))
        size = np.abs(leading).max(axis=0)
        if not size.all() or np.linalg.matrix_rank(leading / size) < n:
            return f"{kinds} by null columns, which do not suffice here (see exact_reduction)"
    return f"{kinds}; {2 * n_inertial + n_half} states"
