"""The notebooks run from their first cell to their last, in an empty folder (``make notebooks``)."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))

pytestmark = pytest.mark.timeout(900)


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_it_showed(path: Path, tmp_path: Path) -> None:
    kept = nbformat.read(path, as_version=4)
    shown = {cell.id: kinds(cell) for cell in kept.cells if cell.cell_type == "code"}
    assert any(shown.values()), f"{path.name} is kept without its outputs"
    client = NotebookClient(kept, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    assert {cell.id: kinds(cell) for cell in kept.cells if cell.cell_type == "code"} == shown


def kinds(cell: nbformat.NotebookNode) -> list[str]:
    """What a cell shows: media types of its results, without what goes by time or machine."""
    return sorted({kind for output in cell.outputs for kind in output.get("data", {})})
