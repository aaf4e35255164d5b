"""The bar of a run, and the commands that take a SUMO configuration, inside this process."""

import io
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from fogsim.cli import app
from fogsim.cli.printing import stderr
from fogsim.cli.progress import SimulationProgress, progress_bar
from fogsim.errors import InputError
from fogsim.values import Ending
from tests.recorders.synthetic import make_step, make_traffic_step

TOWN = str(Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.sumocfg")


@pytest.mark.parametrize(("ending", "share"), [(None, 25.0), (Ending.ARRIVED, 100.0), (Ending.TIME, 100.0)])
def test_the_bar_of_a_run_that_is_over_is_full(ending: Ending | None, share: float) -> None:
    progress = SimulationProgress(stderr, 200.0)
    progress.show(make_step(500, time=50.0, ending=ending))
    (task,) = progress._progress.tasks
    assert task.percentage == pytest.approx(share)
    assert "50 of 200 s" in task.description
    progress.show(make_traffic_step(time=50.0))
    assert progress._progress.tasks[0].description.endswith("2 vehicles")


def test_a_run_of_traffic_alone_has_a_summary_and_no_video(tmp_path: Path) -> None:
    out = tmp_path / "out"
    alone = ["--sumocfg", TOWN, "--ego", "none", "--visibility", "120", "--set", "duration_s=1", "--out", str(out)]
    done = CliRunner().invoke(app.app, ["run", *alone, "--set", "traffic.warm_up_s=20"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert {path.name for path in out.iterdir()} == {"manifest.json", "metrics.json", "report.html", "steps.parquet"}
    assert "time of all vehicles together" in done.output
    assert "distance driven" not in done.output
    assert "The run ended: time." in done.output


def test_a_data_set_of_a_sumo_configuration(tmp_path: Path) -> None:
    chosen = ["--sumocfg", TOWN, "--ego", "veh18", "--visibility", "120", "--out", str(tmp_path / "out")]
    small = ["--set", "camera.width=64", "--set", "camera.height=48", "--frames", "1"]
    done = CliRunner().invoke(app.app, ["dataset", *chosen, *small], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out" / "frames" / "000000.png").is_file()


def test_a_bar_without_progress_does_not_stay_before_an_error() -> None:
    for begun in (False, True):
        console = Console(file=io.StringIO())
        progress = progress_bar(console, stays=True)
        progress.start()
        progress.add_task("starting", total=2, completed=int(begun))
        progress.__exit__(InputError, InputError("--out"), None)
        assert bool(console.file.getvalue()) is begun  # type: ignore[attr-defined]  # a StringIO
