import errno
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.recorders import RunDirectory


def test_it_makes_the_directory_and_its_parents(tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
    assert directory.table == tmp_path / "a" / "b" / "steps.parquet"
    assert directory.files() == []


def test_a_directory_with_other_files_is_fine(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert RunDirectory(tmp_path).files() == []


@pytest.mark.parametrize("name", ["manifest.json", "metrics.json", "steps.parquet", "video.mp4", "report.html"])
@pytest.mark.parametrize("suffix", ["", ".part"])
def test_results_are_not_overwritten_unasked(tmp_path: Path, name: str, suffix: str) -> None:
    (tmp_path / (name + suffix)).write_text("earlier")
    with pytest.raises(InputError, match=r"holds results of an earlier run.*--overwrite"):
        RunDirectory(tmp_path)
    assert (tmp_path / (name + suffix)).read_text() == "earlier"


def test_overwriting_removes_what_fogsim_writes_and_nothing_else(tmp_path: Path) -> None:
    for name in ("manifest.json", "steps.parquet", "video.mp4.part"):
        (tmp_path / name).write_text("earlier")
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "video.mp4").mkdir()
    RunDirectory(tmp_path, overwrite=True)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["notes.txt", "video.mp4"]


def test_a_file_in_its_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(InputError, match="is a file"):
        RunDirectory(tmp_path / "out")
    with pytest.raises(InputError, match="cannot make the directory"):
        RunDirectory(tmp_path / "out" / "deeper")


def test_a_place_that_may_not_be_written_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    # Root may write everywhere, so the system's refusal is played.
    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(InputError, match=r"cannot make the directory .*: Permission denied"):
        RunDirectory(tmp_path / "out")
