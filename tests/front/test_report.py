"""Claims about the report: what it holds, that it is whole, and that it harms nothing."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    FileFormatError,
    ImproperError,
    NearlyMasslessWarning,
    SingularPencilError,
    WeightError,
)
from halfdof_ctrl.files.systems import load_system
from halfdof_ctrl.report import default_design, default_effort, write_report

FILES = {
    "index.html",
    "crosscheck.json",
    "statespace.npz",
    "statespace.mat",
    *(f"{stem}.{ending}" for stem in ("bode", "step", "poles") for ending in ("png", "svg")),
}
VOID = {"meta", "img", "br", "link", "hr"}
MOUNT = hydromount().select("F_y", ["y", "y_dot"])


class Page(HTMLParser):
    """Reads a page strictly: every tag that opens closes in order, ids are unique."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.alternatives: list[str] = []
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note a tag that opens."""
        found = {key: value or "" for key, value in attrs}
        self.ids += [found["id"]] if "id" in found else []
        self.references += [found[key] for key in ("src", "href") if key in found]
        if tag == "img":
            self.alternatives.append(found.get("alt", ""))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Check a tag that closes."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Collect the text."""
        self.text += data


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw empty figures where figures are not what is tested."""

    def empty(*_: object, **__: object) -> control.ControlPlot:
        figure, axes = plt.subplots(squeeze=False)
        return control.ControlPlot(np.empty((1, 1), dtype=object), axes, figure)

    for name in ("bode_plot", "step_plot", "pole_map_plot"):
        monkeypatch.setattr(f"halfdof_ctrl.report.{name}", empty)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the mount's report once."""
    folder = tmp_path_factory.mktemp("report") / "mount"
    assert write_report(MOUNT, folder).passed
    return folder


def test_the_folder_holds_the_page_figures_state_space_and_check(written: Path) -> None:
    """And nothing temporary is left beside it."""
    assert {file.name for file in written.iterdir()} == FILES
    assert [file.name for file in written.parent.iterdir()] == ["mount"]
    np.testing.assert_array_equal(load_system(written / "statespace.mat").A, mech2ss(MOUNT).A)
    assert json.loads((written / "crosscheck.json").read_text())["passed"] is True


def test_the_page_stands_alone_and_is_well_formed(written: Path) -> None:
    """Figures are inside with a text for who does not see them; links lead to the files beside it only."""
    text = (written / "index.html").read_text(encoding="utf-8")
    page = Page(text)
    assert text.startswith("<!DOCTYPE html>")
    assert page.open == []
    assert len(set(page.ids)) == len(page.ids)
    embedded = [reference for reference in page.references if reference.startswith("data:image/svg+xml;base64,")]
    assert len(embedded) == 3
    assert {*page.references} - {*embedded} == FILES - {"index.html"}
    assert all(len(alternative) > 20 for alternative in page.alternatives)
    assert b"<svg" in base64.b64decode(embedded[0].partition(",")[2])
    assert not re.search(r"https?://|url\(|@import|<script", re.sub(r"base64,[^\"]*", "", text))


def test_the_page_says_what_the_paper_says(written: Path) -> None:
    """Eigenvalues with two infinite ones before, the verdict, the gain and the poles with it."""
    text = Page((written / "index.html").read_text(encoding="utf-8")).text
    for words in ("-0.6897 ± 17.7059j", "-8.7797", "-3.1742", "Cross-check passed", "Closed-loop poles", "1.66667"):
        assert words in text
    assert text.count("infinite\n") + text.count("infinitenone") >= 2


@pytest.mark.usefixtures("quick")
@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.HalfdofWarning")
def test_the_page_says_what_info_says_of_free_motions_and_odd_matrices(tmp_path: Path) -> None:
    """Two bodies on a spring float; a follower force makes the stiffness unsymmetric. The mount has neither."""
    floating = mechss(np.diag([2.0, 1.0]), None, [[5.0, -5.0], [-5.0, 5.0]])
    follower = mechss(np.eye(2), np.eye(2), [[2.0, 1.0], [-1.0, 3.0]])
    said = []
    for name, model in (("floating", floating), ("follower", follower), ("mount", MOUNT)):
        write_report(model, tmp_path / name)
        page = Page((tmp_path / name / "index.html").read_text(encoding="utf-8")).text
        said.append(["1 free motion: 2 poles at exactly 0" in page, "Unusual: K is unsymmetric between" in page])
        assert [words in repr(model) for words in ("1 free motion: 2 poles", "unusual: K is")] == said[-1]
    assert said == [[True, False], [False, True], [False, False]]


@pytest.mark.usefixtures("quick")
def test_a_second_report_replaces_the_first_and_spares_other_files(tmp_path: Path) -> None:
    """Files of the user in the folder are left alone."""
    folder = tmp_path / "report"
    write_report(MOUNT, folder)
    (folder / "notes.txt").write_text("mine")
    first = (folder / "crosscheck.json").read_text()
    write_report(hydromount(C_h=450.0).select("F_y", "y"), folder)
    assert (folder / "notes.txt").read_text() == "mine"
    assert (folder / "crosscheck.json").read_text() != first
    assert [file.name for file in tmp_path.iterdir()] == ["report"]


def test_a_page_of_someone_else_is_not_replaced(tmp_path: Path) -> None:
    """An index.html that is no report of ours stays, and so does a file of the folder's name."""
    (tmp_path / "index.html").write_text("<p>my page</p>")
    (tmp_path / "file").write_text("")
    with pytest.raises(FileFormatError, match="that is no report"):
        write_report(MOUNT, tmp_path)
    with pytest.raises(FileFormatError, match="that is no report"):
        write_report(MOUNT, tmp_path / "file")
    assert {file.name for file in tmp_path.iterdir()} == {"index.html", "file"}


@pytest.mark.parametrize(
    ("model", "error", "message"),
    [
        (hydromount().select("F_y1", "y1_ddot"), ImproperError, "y1_ddot from F_y1"),
        (mechss([[1.0]], None, [[1 + 0.1j]]), ComplexModelError, "K has imaginary parts"),
        (mechss([[1.0, 0.0], [0.0, 0.0]], None, [[1.0, 0.0], [0.0, 0.0]]), Exception, "q1"),
    ],
)
def test_a_model_without_a_state_space_is_refused_before_anything_is_written(
    tmp_path: Path, model: SecondOrderModel, error: type[Exception], message: str
) -> None:
    """Improper, complex and singular models."""
    with pytest.raises(error, match=message):
        write_report(model, tmp_path / "report")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_parent_folder_is_named(tmp_path: Path) -> None:
    """It is not made: a wrong path should not leave folders behind."""
    with pytest.raises(FileNotFoundError, match=r"no/report"):
        write_report(MOUNT, tmp_path / "no" / "report")


@pytest.mark.usefixtures("quick")
def test_a_failure_on_the_way_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder appears when it is complete."""

    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("halfdof_ctrl.report.save_system", full_disk)
    with pytest.raises(OSError, match="No space left") as failure:
        write_report(MOUNT, tmp_path / "report")
    assert failure.value.filename == str(tmp_path / "report")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("quick")
def test_the_report_says_why_there_is_no_regulator(tmp_path: Path) -> None:
    """A mode that the input does not reach and that is not stable: in the words of the error."""
    free = mechss(np.eye(2), np.zeros((2, 2)), np.diag([4.0, 0.0]), dofs=["a", "b"]).select("F_a", "a")
    report = write_report(free, tmp_path / "report")
    assert report.feedback is None
    assert "the inputs reach it by" in report.notes[-1]
    assert "the inputs reach it by" in Page((tmp_path / "report" / "index.html").read_text()).text


@pytest.mark.usefixtures("quick")
def test_many_channels_are_cut_in_the_figures_and_the_page_says_so(tmp_path: Path) -> None:
    """Nine channels would be too small to read; the state space keeps them."""
    report = write_report(hydromount(), tmp_path / "report")
    (note,) = report.notes
    assert "show y, y1, y2 from F_y, F_y1 only, of 3 outputs and 3 inputs; select others" in note
    assert load_system(tmp_path / "report" / "statespace.npz").ninputs == 3


@pytest.mark.usefixtures("quick")
def test_a_warning_of_the_model_stands_in_the_report_and_is_given_once(tmp_path: Path) -> None:
    """A nearly massless DOF is worth a note to who reads the page."""
    model = mechss(np.diag([1.0, 1e-13]), np.eye(2), np.diag([4.0, 1.0]), dofs=["a", "b"])
    with pytest.warns(NearlyMasslessWarning, match="DOFs b have a mass") as caught:
        report = write_report(model.select("F_a", "a"), tmp_path / "report")
    assert len(caught) == 1
    assert "DOFs b have a mass" in report.notes[0]


@pytest.mark.usefixtures("quick")
def test_names_cannot_break_the_page(tmp_path: Path) -> None:
    """Markup in a name is text."""
    model = mechss([[1.0]], [[1.0]], [[2.0]], dofs=["<b>&"], name="</title><script>alert(1)</script>")
    write_report(model, tmp_path / "report")
    page = Page((tmp_path / "report" / "index.html").read_text(encoding="utf-8"))
    assert page.open == []
    assert "<b>&_dot" in page.text


def test_a_model_without_states_has_a_report(tmp_path: Path) -> None:
    """A spring alone: no poles, no regulator, a constant response."""
    report = write_report(mechss([[0.0]], None, [[4.0]]), tmp_path / "report")
    assert report.eigenvalues.order == 0
    assert "nothing to regulate" in report.notes[-1]


def test_the_default_effort_has_the_unit_of_an_energy() -> None:
    """A change of the unit of a DOF, and so of its force, changes the weight as the square of the input."""
    scale = 1000.0
    weight = default_effort(MOUNT)["F_y"]
    in_mm = mechss(MOUNT.M / scale**2, MOUNT.C / scale**2, MOUNT.K / scale**2, dofs=["y", "y1", "y2"])
    np.testing.assert_allclose(default_effort(in_mm)["F_y"], weight * scale**2, rtol=1e-12)
    np.testing.assert_allclose(
        default_design(in_mm.select("F_y", "y"))[0].poles, default_design(MOUNT)[0].poles, rtol=1e-6
    )


def test_an_input_that_moves_nothing_has_no_default_effort() -> None:
    """There is no size to go by."""
    with pytest.raises(WeightError, match="no default effort for idle, which moves nothing"):
        default_effort(mechss([[1.0]], None, [[1.0]], [[0.0]], inputs=["idle"]))


def test_a_singular_pencil_is_refused(tmp_path: Path) -> None:
    """Two DOFs that nothing ties down."""
    loose = mechss(np.zeros((2, 2)), None, [[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises((SingularPencilError, ValueError), match="q0, q1"):
        write_report(loose, tmp_path / "report")
