"""Files that are whole or not there."""

import json
import math
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.files.atomic import (
    Reserve,
    naming,
    partial_path,
    refuse_existing,
    refuse_missing_folder,
    write_bytes,
    write_json,
    write_text,
)


def test_what_is_written_is_read_back_and_nothing_else_stays(tmp_path: Path) -> None:
    write_bytes(tmp_path / "a", b"\x00\xff")
    write_text(tmp_path / "b", "20 m – Ω\n")
    write_json(tmp_path / "c", {"V": 80.0, "name": "Nebel", "none": None})
    assert (tmp_path / "a").read_bytes() == b"\x00\xff"
    assert (tmp_path / "b").read_text(encoding="utf-8") == "20 m – Ω\n"
    assert json.loads((tmp_path / "c").read_text(encoding="utf-8")) == {"V": 80.0, "name": "Nebel", "none": None}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]


def test_a_write_that_fails_leaves_the_old_file_and_no_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a"
    write_bytes(path, b"old")

    def cut_off(whole: Path) -> None:
        assert whole == path
        raise OSError("cut off")

    monkeypatch.setattr("fogsim.files.atomic.publish", cut_off)
    with pytest.raises(OSError, match="cut off"):
        write_bytes(path, b"new")
    assert path.read_bytes() == b"old"
    assert not partial_path(path).exists()


@pytest.mark.parametrize("value", [math.nan, math.inf, object()])
def test_json_holds_nothing_that_json_has_no_word_for(tmp_path: Path, value: object) -> None:
    with pytest.raises(InputError, match=r"values\.json holds only"):
        write_json(tmp_path / "values.json", {"value": value})
    assert not list(tmp_path.iterdir())


def test_an_error_of_the_system_names_the_file() -> None:
    with pytest.raises(OSError, match="here") as told, naming(Path("here")):
        raise OSError(28, "No space left on device")
    assert (told.value.errno, told.value.filename) == (28, "here")


def test_a_reserve_takes_room_until_it_is_released(tmp_path: Path) -> None:
    reserve = Reserve(tmp_path / "reserve")
    least = (tmp_path / "reserve").stat().st_size
    reserve.grow(1000)
    assert (tmp_path / "reserve").stat().st_size == least + 1000
    reserve.release()
    reserve.release()
    assert not list(tmp_path.iterdir())


def test_outputs_that_would_be_lost_are_refused_by_the_name_of_their_option(tmp_path: Path) -> None:
    there = tmp_path / "there"
    there.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"--overlay .*there is there already"):
        refuse_existing(there, overwrite=False, option="--overlay")
    refuse_existing(there, overwrite=True)
    refuse_existing(tmp_path / "new", overwrite=False)
    with pytest.raises(InputError, match="is a folder"):
        refuse_existing(tmp_path, overwrite=True)
    refuse_missing_folder(there)
    with pytest.raises(InputError, match=r"^--camera .*: there is no folder"):
        refuse_missing_folder(tmp_path / "none" / "a", "--camera")
