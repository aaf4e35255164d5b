import json
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.recorders import RunDirectory, recover_run, write_json


@pytest.mark.parametrize("name", ["manifest.json", "metrics.json", "steps.parquet", "video.mp4", "report.html"])
@pytest.mark.parametrize("suffix", ["", ".part"])
def test_results_are_not_overwritten_unasked(tmp_path: Path, name: str, suffix: str) -> None:
    (tmp_path / (name + suffix)).write_text("earlier")
    with pytest.raises(InputError, match=r"holds results of an earlier run.*--overwrite"):
        RunDirectory(tmp_path)
    assert (tmp_path / (name + suffix)).read_text() == "earlier"


def test_overwriting_replaces_what_fogsim_writes_and_nothing_else_at_the_end(tmp_path: Path) -> None:
    for name in ("manifest.json", "steps.parquet", "video.mp4.part", "notes.txt"):
        (tmp_path / name).write_text("earlier")
    with RunDirectory(tmp_path, overwrite=True) as directory:
        directory.begin({"status": "running"})
        directory.file("report").write_text("new")
        assert directory.earlier == ["manifest.json", "steps.parquet", "video.mp4.part"]
        directory.finish({"status": "complete"})
    assert sorted(file.name for file in tmp_path.iterdir()) == ["manifest.json", "notes.txt", "report.html"]
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest == {"status": "complete", "files": ["manifest.json", "report.html"]}


@pytest.mark.parametrize("log", ["steps.arrows", "trajectories.arrows", "events.arrows"])
def test_rows_that_could_not_become_a_table_are_kept(tmp_path: Path, log: str) -> None:
    (tmp_path / "manifest.json").write_text("earlier")
    with RunDirectory(tmp_path, overwrite=True) as directory:
        directory.begin({"status": "running"})
        (directory.unfinished / log).write_text("rows")
        directory.finish({"status": "failed"})
    assert (tmp_path / "unfinished" / log).read_text() == "rows"
    assert (tmp_path / "manifest.json").read_text() == "earlier"


def test_a_change_of_places_that_is_cut_off_is_completed_and_mixes_nothing(tmp_path: Path) -> None:
    for name in ("manifest.json", "steps.parquet", "metrics.json", "video.mp4"):
        (tmp_path / name).write_text("earlier")
    with RunDirectory(tmp_path, overwrite=True) as directory:
        directory.begin({"status": "running"})
        for path in (directory.file("table"), directory.file("metrics")):
            path.write_text("new")
        # What is left when the process is killed in the middle of it.
        write_json(
            directory.file("manifest"),
            {"status": "complete", "files": ["manifest.json", "metrics.json", "steps.parquet"]},
        )
        (tmp_path / "manifest.json").unlink()
        directory.file("metrics").replace(tmp_path / "metrics.json")
    with pytest.raises(InputError, match="fogsim recover"):
        RunDirectory(tmp_path)
    assert recover_run(tmp_path) == ["manifest.json", "metrics.json", "steps.parquet"]
    assert {(tmp_path / name).read_text() for name in ("metrics.json", "steps.parquet")} == {"new"}
    assert json.loads((tmp_path / "manifest.json").read_text())["status"] == "complete"
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize("name", ["video.mp4", "unfinished"])
def test_what_is_in_the_way_of_results_is_refused_before_a_run(tmp_path: Path, name: str) -> None:
    if name == "unfinished":
        (tmp_path / name).write_text("mine")
    else:
        (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=f"{name} is in the way"):
        RunDirectory(tmp_path, overwrite=True)
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_folder_left_when_all_results_were_in_their_places_is_cleared_away(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text('{"status": "complete", "files": ["manifest.json"]}')
    (tmp_path / "unfinished").mkdir()
    with pytest.raises(InputError, match="results of an earlier run"):
        RunDirectory(tmp_path)
    assert recover_run(tmp_path) == ["manifest.json"]
    assert not (tmp_path / "unfinished").exists()
    with pytest.raises(InputError, match="contains no unfinished run"):
        recover_run(tmp_path)
