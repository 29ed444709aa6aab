"""What a cross-check says: errors as they are, what the numbers allow, and the verdict that follows."""

import textwrap
from dataclasses import asdict, dataclass

from halfdof_ctrl.systems.judged import Grade

TABLE_WIDTH = 79  #: columns of the printed table, as terminals have them
FIGURES = 37  #: columns in front of the place of the worst error
NO_BREAK = "\N{NO-BREAK SPACE}"
VERDICTS = {Grade.OK: "ok", Grade.WITHIN: "within", Grade.FAILED: "FAILED"}
CHECK_RESULT_NONE = "(none)"  #: where nothing was compared
CHECK_RESULT_WITHIN = "ok within what the numbers allow"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CrossCheck:
    """The errors of a state space against its descriptor form. Printing it gives a table.

    Every error is as it was measured; `..._allowed` is what rounding of the numbers may account for in the same place.
    Errors and places are those of the largest one with the worst verdict.
    """

    order: int  #: states
    n_finite: int  #: finite eigenvalues of the descriptor form; in a large sparse model not counted, -1
    n_infinite: int  #: infinite ones; in a large sparse model not counted, -1
    count_grade: int  #: of the count: 0 ok, 1 within what the numbers allow, 2 failed
    max_transfer_error: float  #: relative to the value of the channel there (Notes of `crosscheck`)
    transfer_allowed: float  #: by rounding of M, C, K and of A, B, C, D
    transfer_worst: str  #: where: output, input, s
    transfer_grade: int
    max_pointwise_error: float  #: relative to each value, beside zeros too
    max_pole_error: float  #: relative to each eigenvalue
    pole_allowed: float
    pole_worst: str  #: which pole
    pole_grade: int
    max_step_error: float  #: relative to the channel's largest value
    step_allowed: float  #: 0 where the error is so small that it was not asked for
    step_worst: str  #: where: output, input, t
    step_grade: int
    step_horizon: float  #: how far the step response was followed [s]
    known_to: float  #: relative rounding of the entries of M, C, K
    data_limit: float  #: what entries known to that determine the transfer function to, relative, at worst; (DATA)
    data_worst: str  #: where
    double_limit: float  #: what rounding of the doubles in A, B, C, D changes, relative, at worst
    evaluation_error: float  #: of python-control's sys(s), relative; decides nothing
    evaluation_worst: str  #: where
    step_evaluation_error: float  #: of python-control's step response, relative to the channel's largest value
    step_evaluation_worst: str  #: where
    index: int  #: of the descriptor form, pencil (8); in a large sparse model not found, -1
    slycot: str  #: what slycot's ag08bd counts, where it is installed; it never decides
    limits: tuple[str, ...] = ()  #: what was not checked, and why
    most_finite: int = -1  #: finite eigenvalues of the stored numbers, if these have more than are told from rounding

    @property
    def grade(self) -> Grade:
        """The worst of all."""
        return Grade(max(self.count_grade, self.transfer_grade, self.pole_grade, self.step_grade))

    @property
    def verdict(self) -> str:
        """``"ok"``, ``"ok within what the numbers allow"`` with how much, or ``"failed"``."""
        if self.grade == Grade.WITHIN:
            rows = (
                (self.transfer_grade, self.max_transfer_error),
                (self.pole_grade, self.max_pole_error),
                (self.step_grade, self.max_step_error),
            )
            most = max([error for grade, error in rows if grade == Grade.WITHIN], default=0.0)
            return (
                f"{CHECK_RESULT_WITHIN} ({most:.1e})" if most > 0.0 else f"{CHECK_RESULT_WITHIN} (the count of states)"
            )
        return "ok" if self.grade == Grade.OK else "failed"

    @property
    def failed(self) -> tuple[str, ...]:
        """What failed: ``"states"``, ``"transfer"``, ``"poles"``, ``"step"``, as the rows of the table are called."""
        grades = {
            "states": self.count_grade,
            "transfer": self.transfer_grade,
            "poles": self.pole_grade,
            "step": self.step_grade,
        }
        return tuple(what for what, grade in grades.items() if grade == Grade.FAILED)

    @property
    def passed(self) -> bool:
        """Whether the count agrees and every error is small, or no larger than the numbers allow."""
        return self.grade != Grade.FAILED

    def as_dict(self) -> dict[str, bool | int | float | str | list[str]]:
        """Return the verdict and all figures, as for a JSON file."""
        return {"passed": self.passed, "verdict": self.verdict, **asdict(self), "limits": list(self.limits)}

    @property
    def rows(self) -> tuple[tuple[str, str, str, str, str], ...]:
        """The table: what, error, allowed, verdict, where; rows without a verdict decide nothing."""
        judged = [
            ("transfer", self.max_transfer_error, self.transfer_allowed, self.transfer_grade, self.transfer_worst),
            ("poles", self.max_pole_error, self.pole_allowed, self.pole_grade, self.pole_worst),
            ("step", self.max_step_error, self.step_allowed, self.step_grade, self.step_worst),
        ]
        count = VERDICTS[Grade(self.count_grade)] if self.n_finite >= 0 else CHECK_RESULT_NONE
        figures = [(what, f"{e:.1e}", f"{a:.1e}" if a else "", VERDICTS[Grade(g)], w) for what, e, a, g, w in judged]
        step = [
            ("ct.step", f"{self.step_evaluation_error:.1e}", "", "", f"python-control, {self.step_evaluation_worst}")
        ]
        if self.step_horizon == 0.0:
            figures[-1], step = ("step", "", "", CHECK_RESULT_NONE, self.step_worst), []
        return (
            ("states", f"{self.order}", "", count, self._count()),
            *figures,
            ("data", "", f"{self.data_limit:.1e}", "", f"entries of M, C, K known to {self.known_to:.1e}"),
            ("doubles", "", f"{self.double_limit:.1e}", "", "rounding of A, B, C, D"),
            ("sys(s)", f"{self.evaluation_error:.1e}", "", "", f"python-control, {self.evaluation_worst}"),
            *step,
            ("slycot", "", "", "", self.slycot),
        )

    def _count(self) -> str:
        if self.n_finite < 0:
            return "not counted"
        finite = f"{self.n_finite} to {self.most_finite}" if self.most_finite > self.n_finite else f"{self.n_finite}"
        return f"{finite} finite, {self.n_infinite} infinite, index {self.index}"

    def __repr__(self) -> str:
        """Print as a small table, as wide as a terminal; a long place goes on in the next line."""
        lines = [f"{'':10}{'error':>8}  {'allowed':>7}  {'':6}  worst at (s, poles in rad/s)"]
        for what, error, allowed, verdict, where in self.rows:
            first, *more = _wrapped(where, TABLE_WIDTH - FIGURES)
            lines.append(f"{what:10}{error:>8}  {allowed:>7}  {verdict or '(info)':6}  {first}".rstrip())
            lines += [f"{'':{FIGURES}}{line}" for line in more]
        notes = [f"Not checked: {limit}" for limit in self.limits]
        head = f"Cross-check FAILED: {', '.join(self.failed)}" if not self.passed else "Cross-check passed"
        return "\n".join([f"{head}: {self.verdict}" if self.grade == Grade.WITHIN else head, *lines, *notes])


def _wrapped(text: str, width: int) -> list[str]:
    """Break what is too long, the point of frequency or time in one piece.

    >>> _wrapped("a_very_long_name from another at s = -0.1 + 1j", 30)
    ['a_very_long_name from another', 'at s = -0.1 + 1j']
    """
    channel, at, point = text.rpartition(" at ")
    held = f"{channel} at{NO_BREAK}{point.replace(' ', NO_BREAK)}" if at else text
    lines = textwrap.wrap(held, width, break_on_hyphens=False)
    return [line.replace(NO_BREAK, " ") for line in lines] or [""]
