"""The report of the paper's mount shows its scheme."""

from pathlib import Path

import halfdof_ctrl as hd


def test_report_shows_the_scheme_of_the_papers_mount(tmp_path: Path) -> None:
    """And no scheme for another model."""
    hd.write_report(hd.hydromount().select("F_y", "y"), tmp_path / "mount")
    assert '<pre class="scheme">' in (tmp_path / "mount" / "index.html").read_text(encoding="utf-8")
    other = hd.mechss([[1.0]], [[1.0]], [[4.0]])
    hd.write_report(other, tmp_path / "other")
    assert '<pre class="scheme">' not in (tmp_path / "other" / "index.html").read_text(encoding="utf-8")
