"""Finite and infinite structure of ``K + C s + M s^2``: exact counts first, then eigenvalues, then what is in doubt."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.descriptor.exact_counts import ExactCounts, exact_counts, were_rounded
from halfdof_ctrl.descriptor.finite_part import finite_part, infinite_part
from halfdof_ctrl.descriptor.finite_spectrum import finite_spectrum
from halfdof_ctrl.descriptor.first_order import first_order_pencil
from halfdof_ctrl.descriptor.nearness import UNDECIDED, nearly_singular, share_of_rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FoundStructure:
    """What is known of a square matrix polynomial."""

    values: ComplexArray  #: (k,) finite eigenvalues [rad/s]
    bounds: FloatArray  #: (k,) of the error of each [rad/s]
    most: int  #: finite eigenvalues of the stored numbers, exactly
    blocks: tuple[int, ...]  #: sizes of the blocks at infinity of the pencil (8), the largest first
    most_index: int  #: the larger of the index of the stored numbers and that by ranks up to rounding
    is_regular: bool
    doubts: tuple[str, ...]
    close: int = 0  #: how many of the largest values rest on parts that stand little above rounding
    unsure: int = 0  #: how many may be none where `is_open`
    is_open: bool = False  #: whether no circle counts as many as there are values, or these are not proved
    above: str = ""  #: the doubt to be warned of: a part was taken as zero, or not, that stands above rounding


@np.errstate(all="ignore")  # numbers near the largest and the smallest doubles; what comes of them is proved or doubted
def found_structure(coefficients: Sequence[DenseMatrix]) -> FoundStructure:
    """Find counts, eigenvalues and doubts of a square matrix polynomial, of 1, s, s^2."""
    if not coefficients[0].size:
        empty = np.zeros(0)
        return FoundStructure(
            values=empty.astype(np.complex128),
            bounds=empty,
            most=0,
            blocks=(),
            most_index=0,
            is_regular=True,
            doubts=(),
        )
    counts = exact_counts(coefficients)
    if not counts.is_regular:
        return _of_singular(coefficients)
    share = share_of_rounding(coefficients)
    spectrum = finite_spectrum(coefficients, counts)
    doubts = list(spectrum.doubts)
    if share > UNDECIDED:
        doubts.append(nearly_singular(share))
    blocks, most_index, doubt = _blocks(coefficients, counts, spectrum.values.size)
    doubts += doubt
    above = next((doubt for doubt in doubts if "above rounding" in doubt), "")
    if not above and counts.degree > spectrum.values.size and not were_rounded(coefficients):
        above = not_rounded(counts.degree, spectrum.values.size)
        doubts.append(above)
    return FoundStructure(
        values=spectrum.values,
        bounds=spectrum.bounds,
        most=counts.degree,
        blocks=blocks,
        most_index=most_index,
        is_regular=True,
        doubts=tuple(doubts),
        close=spectrum.close,
        unsure=spectrum.unsure,
        is_open=spectrum.is_open,
        above=above,
    )


def not_rounded(stored: int, found: int) -> str:
    """Say that a part was taken as zero that rounding did not make."""
    return (
        f"the stored numbers have {stored} finite eigenvalues and not {found}: a part of M, C, K as small as rounding "
        "is taken as zero, though their entries have so few digits that they were not rounded"
    )


def _of_singular(coefficients: Sequence[DenseMatrix]) -> FoundStructure:
    """Find the eigenvalues of the regular part by deflation, whose ranks are decided by size."""
    pencil = first_order_pencil(coefficients)
    part = finite_part(pencil.A, pencil.E)
    doubt = "the number of eigenvalues of the regular part: a rank on which it rests is hardly to be told from rounding"
    values, blocks = part.eigenvalues * pencil.scale, infinite_part(pencil.A, pencil.E).blocks
    return FoundStructure(
        values=values,
        bounds=np.full(values.size, np.inf),
        most=values.size,
        blocks=blocks,
        most_index=max(blocks, default=0),
        is_regular=False,
        doubts=() if part.is_certain else (doubt,),
    )


def _blocks(
    coefficients: Sequence[DenseMatrix], counts: ExactCounts, finite: int
) -> tuple[tuple[int, ...], int, list[str]]:
    """Return the blocks at infinity that go with the count of finite eigenvalues, the larger index, and doubts.

    Beside the exact ones there are those by ranks up to rounding, which stand for what was meant where rounding made
    eigenvalues of its own.
    """
    pencil = first_order_pencil(coefficients)
    rounded = infinite_part(pencil.A, pencil.E).blocks
    if rounded == counts.blocks and finite == counts.degree:
        return rounded, max(rounded, default=0), []
    index, exact = max(rounded, default=0), max(counts.blocks, default=0)
    doubt = f"the index is {exact} of the stored numbers and {index} by ranks up to rounding"
    is_meant = finite != counts.degree and sum(rounded) + finite == len(pencil.E)
    if finite != counts.degree and not is_meant:
        doubt = (
            f"the index: it is {exact} of the stored numbers, with {counts.degree} finite eigenvalues, and {index} by "
            f"ranks up to rounding, with {len(pencil.E) - sum(rounded)}, and neither goes with {finite} of them"
        )
        return counts.blocks, max(index, exact, len(pencil.E) - finite), [doubt]
    return (rounded if is_meant else counts.blocks), max(index, exact), [doubt] if exact != index else []
