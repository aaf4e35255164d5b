import errno
import io
import json
import math
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow.parquet as pq
import pytest
from early_motorway import EARLY
from typer.testing import CliRunner

from fogsim.cli.app import app
from fogsim.core.files.atomic import write_json
from fogsim.core.files.writer_lock import WriterLock
from fogsim.errors import InputError
from fogsim.simulation import chosen_methods
from fogsim.study import StudyRun, load_study, run_study
from fogsim.study.directory import StudyDirectory
from fogsim.study.execution import RunWatch, result_file, run_to_file
from fogsim.study.profiles import RunProfiles
from fogsim.values import SpeedAdvice

STUDY = f"""
scenario: motorway_fog_bank
settings: ["{EARLY}", duration_s=1, camera.width=80, camera.height=60, clocks.camera_period_s=0.5]
factors:
  policy:
    none: [advice=none]
    fixed: ['advice={{method: fixed_speed, parameters: {{speed: 20}}}}']
seeds: 2
"""


def study_file(folder: Path, text: str = STUDY) -> Path:
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_study_is_run_continued_and_reported(tmp_path: Path) -> None:
    # An ego that never appears breaks the runs of one policy.
    text = STUDY.replace("seeds: 2", "    late: [traffic.warm_up_limit_s=1]\nseeds: 2")
    text = text.replace("duration_s=1", "duration_s=1, lighting=low_beam")
    study, out = load_study(study_file(tmp_path, text)), tmp_path / "out"
    done: list[int] = []
    rows = run_study(study, out, processes=1, watch=lambda number, _: done.append(number))
    assert done == [0, 1, 2, 3, 4, 5, 6]
    assert [(row["policy"], row["seed"], row["status"]) for row in rows] == [
        (policy, seed, "failed" if policy == "late" else "complete")
        for policy in study.factors["policy"]
        for seed in (0, 1)
    ]
    assert "did not appear within" in str(rows[-1]["message"])
    table = pq.read_table(out / "study.parquet").to_pylist()
    assert [row["mean_speed_mps"] for row in table[:4]] == [row["mean_speed_mps"] for row in rows[:4]]
    assert {path.name for path in out.iterdir()} == {
        *("study.json", "study.parquet", "study.csv", "comparison.csv", "methods.md", "report.html", "figures", "runs")
    }
    figures = {path.name for path in (out / "figures").iterdir()}
    assert {"mean_speed_mps.svg", "ttc_survival.csv", "speed_over_road.svg"} <= figures
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "PARTIAL: 2 of 6 runs missing or failed" in page
    assert "did not appear within" in page

    # As if the command had been killed: what is done is not run again, what failed is, and the table is the same.
    table_bytes = (out / "study.parquet").read_bytes()
    (out / "runs" / f"{study.runs[1].key}.json").unlink()
    (out / "study.parquet").unlink()
    again: list[int] = []
    run_study(study, out, processes=1, watch=lambda number, _: again.append(number))
    assert again == [3, 4, 5, 6]
    assert (out / "study.parquet").read_bytes() == table_bytes


def test_a_changed_study_is_refused_with_the_difference(tmp_path: Path) -> None:
    out = tmp_path / "out"
    StudyDirectory(out, load_study(study_file(tmp_path)))
    before = json.loads((out / "study.json").read_text(encoding="utf-8"))
    changed = load_study(study_file(tmp_path, STUDY.replace("duration_s=1", "duration_s=2")))
    with pytest.raises(InputError, match=r"policy=none · duration_s was 1\.0 and is 2\.0"):
        StudyDirectory(out, changed)
    # More seeds, another baseline, or another time limit of methods are the same study.
    assert StudyDirectory(out, load_study(study_file(tmp_path), ["method_timeout_s=2"])).missing()
    more = load_study(study_file(tmp_path, STUDY.replace("seeds: 2", "seeds: 5\nbaseline: {policy: fixed}")))
    assert len(StudyDirectory(out, more).missing()) == 10
    now = json.loads((out / "study.json").read_text(encoding="utf-8"))
    assert now == {**before, "seeds": [0, 1, 2, 3, 4], "baseline": {"policy": "fixed"}}


def test_other_versions_and_changed_files_are_refused(tmp_path: Path) -> None:
    shutil.copytree(Path(__file__).parents[1] / "data" / "grid", tmp_path / "town")
    text = (
        "sumocfg: town/grid.sumocfg\nego: veh18\nsettings: [fog.visibility_m=80]\nfactors: {p: {none: [advice=none]}}"
    )
    StudyDirectory(tmp_path / "out", load_study(study_file(tmp_path, text)))
    demand = tmp_path / "town" / "grid.trips.xml"
    demand.write_text(demand.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"grid\.trips\.xml was '\w+' and is"):
        StudyDirectory(tmp_path / "out", load_study(study_file(tmp_path, text)))
    manifest = tmp_path / "out" / "study.json"
    told = json.loads(manifest.read_text(encoding="utf-8"))
    told["versions"]["libsumo"] = "1.0"
    manifest.write_text(json.dumps(told), encoding="utf-8")
    with pytest.raises(InputError, match=r"version of libsumo was '1\.0' and is"):
        StudyDirectory(tmp_path / "out", load_study(study_file(tmp_path, text)))


def test_changed_methods_and_files_that_they_read_are_refused(tmp_path: Path) -> None:
    town = tmp_path / "town"
    shutil.copytree(Path(__file__).parents[1] / "data" / "grid", town)
    config = (town / "grid.sumocfg").read_text(encoding="utf-8")
    (town / "grid.sumocfg").write_text(config.replace("<input>", '<input><weight-files value="weights.xml"/>'))
    adviser = "import aids\nclass Mine:\n    def advise(self, time, fog):\n        return None\n"
    read = {"weights.xml": "<meandata/>", "edges.txt": "edge:A0A1", "range.json": "{}", "own.py": adviser}
    read |= {"aids/__init__.py": "from .deep import x", "aids/deep.py": "x = 1"}
    (town / "aids").mkdir()
    for name, content in read.items():
        (town / name).write_text(content)
    text = """
sumocfg: town/grid.sumocfg
ego: veh18
settings:
  - fog.visibility_m=80
  - 'traffic.sumo_options={fcd-output.filter-edges.input-file: edges.txt}'
  - 'estimators=[{method: belaroussi2015, parameters: {operating_range: range.json}}]'
factors: {p: {mine: ['advice=own:Mine']}}
"""
    StudyDirectory(tmp_path / "out", load_study(study_file(tmp_path, text)))
    for name, content in read.items():
        (town / name).write_text(content + "\n")
        with pytest.raises(InputError, match=rf"{'own:Mine' if name.endswith('.py') else name} was '[^']+' and is"):
            StudyDirectory(tmp_path / "out", load_study(study_file(tmp_path, text)))
        (town / name).write_text(content)


def test_cells_with_the_same_scenario_share_one_run(tmp_path: Path) -> None:
    estimators = "  estimator: {joint: ['estimators=[joint_road]'], zhu: ['estimators=[zhu2015]']}\nseeds: 2"
    study = load_study(study_file(tmp_path, STUDY.replace("seeds: 2", estimators)), ["lighting=low_beam"])
    engine, done = PlayedRuns(), [0]
    rows = run_study(study, str(tmp_path / "out"), engine=engine, watch=lambda number, _: done.append(number))
    assert (len(rows), len(engine.run_numbers), done[-1]) == (8, len({run.key for run in study.runs}), 8)
    assert len(engine.run_numbers) == 4
    assert {row["status"] for row in rows} == {"complete"}


def test_a_directory_that_is_written_keeps_the_description_of_its_study(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with WriterLock(tmp_path / "out"):
        with pytest.raises(InputError, match="is writing there"):
            run_study(load_study(study_file(tmp_path)), tmp_path / "out", processes=1)
        assert not (tmp_path / "out" / "study.json").exists()


def test_directories_of_something_else_are_left_alone(tmp_path: Path) -> None:
    study = load_study(study_file(tmp_path))
    with pytest.raises(InputError, match="something else than a study"):
        StudyDirectory(tmp_path, study)
    with pytest.raises(InputError, match="is not a folder; give the name of a folder"):
        StudyDirectory(study_file(tmp_path), study)


def full_disk(monkeypatch: pytest.MonkeyPatch, ending: str) -> None:
    """No room for files of this ending."""
    opened = Path.open

    class Full(io.FileIO):
        def write(self, _: object) -> int:
            raise OSError(errno.ENOSPC, "No space left on device")

    def refuse(path: Path, mode: str = "r", *about: Any, **more: Any) -> Any:
        if path.name.endswith(f"{ending}.part"):
            return Full(path, mode.replace("b", ""))
        return opened(path, mode, *about, **more)

    monkeypatch.setattr(Path, "open", refuse)


def test_a_full_disk_costs_no_run_and_the_same_command_goes_on(tmp_path: Path) -> None:
    study, out = load_study(study_file(tmp_path)), tmp_path / "out"
    engine = PlayedRuns()
    run = study.runs[2].key + ".json"
    for ending in ("study.json", run, "parquet", "study.csv", "comparison.csv", "svg", "html"):
        with pytest.MonkeyPatch.context() as patch:
            full_disk(patch, ending)
            with pytest.raises(OSError, match=r"No space left on device: '.*\.part'"):
                run_study(study, out, engine=engine)
        assert not list(out.rglob("*.part")), ending
    run_study(study, out, engine=engine)
    # What was done before is not run again, but the run whose result could not be written.
    assert len(engine.run_numbers) == len(set(engine.run_numbers)) + 1
    assert pq.read_table(out / "study.parquet").column("status").to_pylist() == ["complete"] * 4


def test_the_command_says_that_finished_runs_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("fogsim.study.run_study", refuse)
    done = CliRunner().invoke(app, ["study", str(study_file(tmp_path)), "--out", str(tmp_path / "out"), "-j", "1"])
    assert isinstance(done.exception, OSError)
    assert "Finished runs are kept" in done.output


def complete(metrics: dict[str, str | float | int | None]) -> dict[str, Any]:
    """What the file of a run holds that came to its end."""
    return {"status": "complete", "metrics": metrics, "profiles": RunProfiles().to_json()}


class PlayedRuns:
    """An engine that computes nothing."""

    def __init__(self) -> None:
        self.run_numbers: list[int] = []

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """Write a number for each run."""
        for run in runs:
            self.run_numbers.append(run.number)
            metrics = {"mean_speed_mps": float(run.number), "collisions": run.number % 2}
            write_json(result_file(folder, run), complete(metrics))
            watch(run, None)


def test_a_result_that_is_broken_is_run_again(tmp_path: Path) -> None:
    study = load_study(study_file(tmp_path))
    directory = StudyDirectory(tmp_path / "out", study)
    file = tmp_path / "out" / "runs" / f"{study.runs[0].key}.json"
    whole = complete({"mean_speed_mps": 20.0, "ending": "time", "minimum_gap_m": None})
    file.write_text(json.dumps(whole), encoding="utf-8")
    assert len(directory.missing()) == 3
    for damage in (
        "{",
        "null",
        "[]",
        "[" * 100_000,
        json.dumps({"status": "failed", "message": "no"}),
        *(json.dumps({**whole, "metrics": metrics}) for metrics in ({}, [], "x", {"a": True}, {"a": {"b": 1}})),
        json.dumps({**whole, "metrics": {"a": math.nan}}),
        json.dumps({**whole, "profiles": {**whole["profiles"], "road": {"place_m": [1.0]}}}),
        json.dumps({key: value for key, value in whole.items() if key != "profiles"}),
    ):
        file.write_text(damage, encoding="utf-8")
        assert len(directory.missing()) == 4, damage[:80]
        assert directory.rows()[0]["status"] in ("missing", "failed")


@pytest.mark.parametrize(
    "damage", ["[]", "null", "{", '{"versions": 5}', '{"versions": {}, "files": {}, "cells": [1]}']
)
def test_a_damaged_description_is_one_error(tmp_path: Path, damage: str) -> None:
    study = load_study(study_file(tmp_path))
    StudyDirectory(tmp_path / "out", study)
    (tmp_path / "out" / "study.json").write_text(damage, encoding="utf-8")
    with pytest.raises(InputError, match=r"study\.json: not the description of a study; choose another directory"):
        StudyDirectory(tmp_path / "out", study)


_REPORTS = "renderer=none, 'estimators=[]', lighting=low_beam, 'sensors.reports.roadside={every_m: 200}'"


@pytest.mark.parametrize(
    ("settings", "chosen", "is_known"),
    [
        ("lighting=low_beam", "", False),
        (f"{_REPORTS}, fusion=grid_filter", "metrics: [belief_median_error_percent]", False),
        (f"{_REPORTS}, fusion=field_filter", "", False),
        (f"{_REPORTS}, fusion=field_filter", "metrics: [belief_median_error_percent]", True),
    ],
)
def test_what_is_believed_without_camera_and_reports_is_no_metric(
    tmp_path: Path, settings: str, chosen: str, is_known: bool
) -> None:
    text = STUDY.replace("duration_s=1", f"duration_s=1, {settings}") + chosen
    study = load_study(study_file(tmp_path, text))
    assert not study.runs[0].scenario.estimators
    directory = StudyDirectory(tmp_path / "out", study)
    believed = {
        "belief_median_error_percent": 691.0,
        "dense_fog_known_before_m": -300.0,
        "fog_banks_without_warning": 1,
    }
    metrics = {**believed, "mean_speed_mps": 20.0}
    result = complete(metrics)
    (tmp_path / "out" / "runs" / f"{study.runs[0].key}.json").write_text(json.dumps(result), encoding="utf-8")
    row = directory.rows()[0]
    kept = believed if is_known else dict.fromkeys(believed)
    assert {key: row[key] for key in metrics} == {**kept, "mean_speed_mps": 20.0}


def test_a_policy_that_returns_no_speed_is_reported_with_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    signs = "duration_s=1, lighting=low_beam, drivers.advised=signs"
    study = load_study(study_file(tmp_path, STUDY.replace("duration_s=1", signs)))
    broken = SimpleNamespace(advise=lambda *_: SpeedAdvice(math.nan))
    monkeypatch.setattr(chosen_methods, "adviser", lambda _: broken)
    told = run_to_file(study.runs[-1].scenario, 1, tmp_path / "run.json")
    assert told == json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["message"]
    assert re.fullmatch(r"adviser 'fixed_speed': advise\(\): speed must be .* got nan", str(told))
