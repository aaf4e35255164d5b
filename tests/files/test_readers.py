"""What a message about a missing file adds, and numbers that are none."""

from pathlib import Path

import pytest

from fogsim.core.files.readers import nearest_file, open_regular, read_json
from fogsim.errors import InputError


def test_a_missing_file_answers_with_the_nearest_name_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "m2024.csv").touch()
    with pytest.raises(InputError, match=r"m2025\.csv: cannot be read: .*; did you mean 'm2024\.csv'\?$"):
        open_regular(tmp_path / "m2025.csv")


def test_nothing_is_said_where_no_name_is_near_and_a_missing_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "m2024.csv").touch()
    assert nearest_file(tmp_path / "other.yaml") == ""
    assert nearest_file(tmp_path / "\0" / "a") == ""
    assert nearest_file(tmp_path / "m2024.csv" / "a") == ""
    assert nearest_file(tmp_path / "none" / "a").endswith(f"there is no folder '{tmp_path}/none'")


def test_numbers_of_json_are_finite(tmp_path: Path) -> None:
    for number in ("1e999", "-1e999", "NaN", "Infinity"):
        (tmp_path / "a.json").write_text(f'{{"k": [1.5, {number}]}}', encoding="utf-8")
        with pytest.raises(InputError, match=rf"a\.json: not valid JSON: .*{number}"):
            read_json(tmp_path / "a.json")
