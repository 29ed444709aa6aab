"""What the source code cites stands in the documentation, under the same number."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MODULES = sorted((ROOT / "halfdof_ctrl").rglob("*.py"))
DEFINED = re.compile(r"[ \]\d;,.]\s*\((\d+a?)\)$", re.MULTILINE)  # a number at the end of a displayed line
LARGEST_PNG = 100_000  #: bytes of an image in the repository


def docstrings() -> dict[Path, str]:
    """Give each module's docstring, where its equations stand."""
    return {path: path.read_text(encoding="utf-8").split('"""')[1] for path in MODULES}


def pages() -> dict[Path, str]:
    """Give the text of all pages."""
    found = [path for path in DOCS.rglob("*.md") if "_build" not in path.parts]
    return {path: path.read_text(encoding="utf-8") for path in found}


def tagged() -> list[str]:
    """Give the numbers of the displayed formulas in the documentation."""
    return [number for text in pages().values() for number in re.findall(r"\\tag\{(\d+a?)\}", text)]


def test_every_equation_of_a_module_docstring_is_derived_in_the_docs() -> None:
    """A number at the end of a displayed line in a docstring is a numbered formula of a page."""
    cited = {number for text in docstrings().values() for number in DEFINED.findall(text)}
    assert {"1", "2", "2a", "3", "4", "8", "9", "10", "11", "12", "13"} <= cited
    assert not cited - set(tagged())


def test_no_equation_number_stands_twice() -> None:
    """A number means one formula."""
    numbers = tagged()
    assert sorted(numbers) == sorted(set(numbers))


def test_numbered_formulas_run_without_a_gap() -> None:
    """From (1) on, with (2a) as the only letter."""
    numbers = set(tagged())
    assert numbers == {"2a", *map(str, range(1, len(numbers)))}


def test_pages_that_the_code_cites_exist() -> None:
    """A docstring that says docs/explanation/... leads somewhere."""
    cited = {link for path in MODULES for link in re.findall(r"docs/[\w/-]+\.md", path.read_text(encoding="utf-8"))}
    assert cited
    assert not [link for link in sorted(cited) if not (ROOT / link).is_file()]


def test_images_in_the_repository_are_small() -> None:
    """Pictures are made by the scripts of the examples at a size that a clone does not notice."""
    images = list((DOCS / "images").iterdir())
    assert images
    assert all(image.stat().st_size < LARGEST_PNG for image in images)
