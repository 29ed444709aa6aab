"""Figures as files: the ending is the format, and no figure stays open."""

from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from halfdof_ctrl import hydromount, pole_map_plot
from halfdof_ctrl.plots.figure_files import close_figure, save_figure


@pytest.mark.parametrize(("ending", "begin"), [("png", b"\x89PNG"), ("PDF", b"%PDF"), ("svg", b"<?xml")])
def test_the_ending_is_the_format(tmp_path: Path, ending: str, begin: bytes) -> None:
    """In any case of letters; the figure is closed."""
    save_figure(pole_map_plot(hydromount()), tmp_path / f"poles.{ending}")
    assert (tmp_path / f"poles.{ending}").read_bytes().startswith(begin)
    assert not plt.get_fignums()


def test_a_figure_that_cannot_be_written_is_closed(tmp_path: Path) -> None:
    """And leaves no part of a file."""
    with pytest.raises(ValueError, match="not supported"):
        save_figure(pole_map_plot(hydromount()), tmp_path / "poles.unknown")
    assert not plt.get_fignums()
    assert not list(tmp_path.iterdir())


def test_a_figure_that_is_not_wanted_is_closed() -> None:
    """Other figures stay."""
    kept = plt.figure()
    close_figure(pole_map_plot(hydromount()))
    assert plt.get_fignums() == [kept.number]
    plt.close(kept)
