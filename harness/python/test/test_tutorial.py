"""The tutorial runs from its first cell to its last."""

from __future__ import annotations

from pathlib import Path

import nbclient
import nbformat

from conftest import EXAMPLES

NOTEBOOK = Path(__file__).parents[1] / "tutorial.ipynb"


def test_the_tutorial_runs(tmp_path: Path) -> None:
    # what it writes goes beside it
    (tmp_path / "python").mkdir()
    (tmp_path / "examples").symlink_to(EXAMPLES)
    notebook = nbformat.reads(NOTEBOOK.read_text(encoding="utf-8"), as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "the tutorial is kept without its outputs"
    place = {"metadata": {"path": str(tmp_path / "python")}}
    done = nbclient.NotebookClient(notebook, timeout=600, resources=place).execute()
    shown = nbformat.writes(done)
    assert "plastic_indentation" in shown and "image/png" in shown and "text/html" in shown
