"""The README's example prints what the README shows, and its commands stand where continuous integration looks."""

import contextlib
import io
import re
from pathlib import Path

import pytest

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
MOST_LINES = 15  #: of the example


def block(language: str) -> str:
    """Give the only fenced block of a language."""
    found = re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
    assert len(found) == 1
    return str(found[0])


def test_example_prints_what_the_readme_shows() -> None:
    """The python block, run as it stands, prints the text block to the last character."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(block("python"), "README.md", "exec"), {})  # noqa: S102  # our own file
    assert printed.getvalue() == block("text")


def test_example_has_at_most_fifteen_lines() -> None:
    """Blank lines count."""
    assert len(block("python").splitlines()) <= MOST_LINES


@pytest.mark.parametrize(
    ("mark", "last"),
    [("report-command", "halfdof-ctrl report hydromount -o report"), ("test-command", "python -m pytest")],
)
def test_marked_command_is_one_line_that_starts_from_nothing(mark: str, last: str) -> None:
    """Each command makes its own environment and ends with what it is for."""
    found = re.findall(rf"^<!-- {mark} -->\n```sh\n(.+)\n```$", README, flags=re.MULTILINE)
    assert len(found) == 1
    steps = found[0].split(" && ")
    assert steps[0] == "python3 -m venv .venv"
    assert steps[-1].endswith(last)


def test_files_that_the_readme_links_to_exist() -> None:
    """Every relative link leads to a file of the repository."""
    links = re.findall(r"\]\(([^)#]+)\)", README)
    missing = [link for link in links if "://" not in link and not (Path(__file__).parents[2] / link).exists()]
    assert links
    assert not missing
