"""The notebooks run from first cell to last, in an empty folder outside the checkout (``make notebooks``)."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

CHECKOUT = Path(__file__).resolve().parents[2]
FOLDER = CHECKOUT / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
NEXT = "## What to try next"
PICTURES = {"image/png", "image/svg+xml"}

every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def read(path: Path) -> nbformat.NotebookNode:
    """A notebook, of which nothing is mended while it is read."""
    notebook = nbformat.read(path, as_version=nbformat.NO_CONVERT)
    nbformat.validate(notebook)
    return notebook


def test_there_are_notebooks() -> None:
    assert [path.name[:2] for path in NOTEBOOKS] == [f"{number:02}" for number in range(1, len(NOTEBOOKS) + 1)]


@every_notebook
def test_no_outputs_are_kept(path: Path) -> None:
    for cell in read(path).cells:
        assert not cell.get("outputs"), cell.id
        assert cell.get("execution_count") is None, cell.id
        assert cell.metadata == {}, cell.id


@every_notebook
def test_a_notebook_begins_and_ends_as_all_do(path: Path) -> None:
    """It says what it needs and how long it takes, and what to try next: three to five things."""
    first, *_, last = read(path).cells
    assert re.match(r"# .+\n\n", first.source)
    install = re.escape("[FogSim](../docs/tutorial/first_run.md#install), `pip install 'fogsim[notebooks]'`")
    assert re.search(rf"\nIt needs {install} and about [^.]+ on two cores", first.source)
    assert NEXT in last.source
    assert 3 <= len(re.findall(r"^- ", last.source.partition(NEXT)[2], re.MULTILINE)) <= 5


@pytest.mark.timeout(900)
@every_notebook
def test_a_notebook_runs(path: Path, tmp_path: Path) -> None:
    """Without an error, and with a picture and a table; what is written to stderr would be a warning."""
    assert not tmp_path.is_relative_to(CHECKOUT)
    notebook = read(path)
    NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    errors = [output.text for output in outputs if output.output_type == "stream" and output.name == "stderr"]
    told = [line for text in errors for line in text.splitlines()]
    # Calibrations that are not cached yet say what they do.
    assert [line for line in told if not line.startswith("fogsim: calibrating ")] == []
    kinds = {kind for output in outputs for kind in output.get("data", {})}
    assert kinds & PICTURES
    assert "text/html" in kinds, "no table"
