from pathlib import Path

from fogsim.metrics import step_metrics
from fogsim.recorders import RECORDERS, RunDirectory, RunInformation
from tests.recorders.synthetic import METHODS, drive


def test_every_registered_recorder_writes_its_file(tmp_path: Path) -> None:
    with RunDirectory(tmp_path) as directory:
        directory.begin({})
        information = RunInformation(directory, "Bank", "", 0, METHODS, 0.2)
        recorders = [make(information) for make in RECORDERS.values()]
        for step in drive(10):
            for recorder in recorders:
                recorder.record(step, step_metrics(step))
        for recorder in recorders:
            recorder.close(complete=True)
        directory.finish({})
        assert directory.files() == [
            "events.parquet",
            "ground_truth.osi",
            "manifest.json",
            "report.html",
            "restored.mp4",
            "scenario.xosc",
            "steps.parquet",
            "trajectories.parquet",
            "video.mp4",
        ]
