"""Every example runs, draws nothing when imported, and one number of each is right."""

import json
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose

from support.examples import EXAMPLES, imported

NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))
EXACT_PAIR = -0.6897228096519806 + 17.70591511240659j  #: root of 3 s^4 + 40 s^3 + 1075 s^2 + 11375 s + 26250
SLOWEST_LAG = -10.0 / 3.0  #: zero of the receptance, where the fast design leaves a pole
ROUNDING = 1e-13  #: of eigenvalues of a 4 x 4 matrix with entries up to 275
FOUR_DIGITS = 5e-5  #: that the notebook prints


def test_ex01_finds_the_published_pair_by_both_routes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The oscillating eigenvalue is the exact root to rounding, and two infinite ones are counted."""
    example = imported("ex01_hydromount")
    assert not plt.get_fignums()
    before, after, n_infinite = example.eigenvalues()
    assert n_infinite == 2
    for values in (before, after):
        assert_allclose(values[np.argmax(values.imag)], EXACT_PAIR, rtol=ROUNDING)
    with plt.rc_context({"backend": "agg"}):
        example.main(str(tmp_path / "figure.png"))
    plt.close("all")
    assert "2 infinite" in capsys.readouterr().out
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_ex02_prints_its_tables_and_draws_every_panel(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The mount's 175 N s/m of Guyan reduction put its pair 24 % off; each panel has its curves and lines."""
    example = imported("ex02_alternatives")
    assert not plt.get_fignums()
    pair = np.roots([20.0, 175.0, 5250.0])[0]
    assert_allclose(abs(pair - EXACT_PAIR) / abs(EXACT_PAIR), 0.24, rtol=0.01)
    monkeypatch.setattr(example, "LIMIT", 50)
    monkeypatch.setattr(example, "DPI", 40)
    with plt.rc_context({"backend": "agg"}):
        example.main(str(tmp_path / "figure.png"))
    printed = capsys.readouterr().out
    assert "| exact reduction | 4 | < 1e-13 | < 1e-13 | > 50 |" in printed
    assert "| Guyan, half DOFs | 2 | 2.4e-01 | 8.9e-01 | > 50 |" in printed
    assert [len(ax.get_lines()) for ax in plt.gcf().axes] == [4, 6, 5, 7, 10, 10]
    plt.close("all")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_stored_without_outputs(path: Path) -> None:
    """Outputs are made by the reader, not kept in the repository."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert code
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)


@pytest.mark.filterwarnings("ignore")  # the kernel's client, which is not ours, warns of its own affairs
def test_lqr_notebook_designs_two_stable_loops() -> None:
    """Run from top to bottom, the notebook ends with the pole margins of both designs over the damping of the oil."""
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(EXAMPLES / "lqr_hydromount.ipynb", as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources={})
    executed: Any = client.execute()
    printed = "".join(
        output.get("text", "") for cell in executed.cells if cell.cell_type == "code" for output in cell.outputs
    )
    found = [line for line in printed.splitlines() if line.startswith("slowest pole, firm design:")]
    assert len(found) == 1
    assert_allclose(float(found[0].split(":")[1]), -3.3328, rtol=FOUR_DIGITS)
