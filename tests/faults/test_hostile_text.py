"""JSON and CSV that are hostile or broken: each ends at once, in one message that names the file."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fogsim.errors import InputError
from fogsim.estimators.night.halos import HaloThreshold
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.offline.drive.sign_watch import load_sign_file
from fogsim.offline.drive.track_file import load_track
from fogsim.scenario.parts.lamp_file import load_lamps

Reader = Callable[[Path], object]
SIGN = {
    "type": "Feature",
    "geometry": {"type": "Point", "coordinates": [24.9, 60.2]},
    "properties": {"kind": "stop", "height_m": 2.4, "diameter_m": 0.9, "heading_deg": 30.0, "speed_limit_kmh": 50},
}
THRESHOLD = HaloThreshold(320, 240, 300.0, "srgb", 0.0, 30.0, 25.0, 0.01, 0.01, 100)
RANGE = OperatingRange(300.0, 0.9, (50.0, 100.0, 200.0), (20.0, 40.0, 60.0), (25.0, 45.0, 65.0), (2.0, 3.0, 4.0))
JSON: dict[str, tuple[Any, Reader]] = {
    "signs": ({"type": "FeatureCollection", "features": [SIGN]}, load_sign_file),
    "halos": (json.loads(THRESHOLD.as_json()), HaloThreshold.read),
    "operating range": (json.loads(RANGE.as_json()), OperatingRange.read),
}
CSV, BEAM = "time_s,lat,lon\n0,50.0,8\n1,50.001,8\n", "0,-1,1\n-1,5,6\n1,7,8\n"


def lamps_with_table(path: Path) -> object:
    lamps = path.with_name("lamps.yaml")
    lamps.write_text(f"low_beam: {path.name}\n", encoding="utf-8")
    return load_lamps(lamps)


TEXTS: dict[str, tuple[str, str, Reader]] = {
    **{name: ("file.json", json.dumps(data), read) for name, (data, read) in JSON.items()},
    "track": ("track.csv", CSV, load_track),
    "beam": ("beam.csv", BEAM, lamps_with_table),
}
"""Name of a file, a text that can be read, and what reads it."""


def refused(read: Reader, path: Path, told: str | None = None) -> None:
    """Expect one line that names the file."""
    with pytest.raises(InputError, match=told) as error:
        read(path)
    assert path.name in str(error.value)
    assert len(str(error.value).splitlines()) == 1
    assert len(str(error.value)) < 500


@pytest.mark.parametrize("reader", TEXTS)
def test_files_that_are_not_text(tmp_path: Path, reader: str) -> None:
    name, text, read = TEXTS[reader]
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    read(file)
    file.write_bytes(text.encode() + "\nGrün".encode("latin-1"))
    refused(read, file, "expected UTF-8 text, got the byte 0xfc")
    file.write_text("", encoding="utf-8")
    refused(read, file)
    file.write_text(text[: len(text) // 3], encoding="utf-8")
    refused(read, file)
    file.unlink()
    refused(read, file, "cannot be read: No such file")
    os.mkfifo(file)
    refused(read, file, "cannot be read: not a regular file")


ROOTS = ["null", "3", '"text"', "[]", "{}", "[" * 50_000, '{"a":' * 50_000, "[" * 400 + "]" * 400, "NaN", "9" * 5000]


def test_json_that_is_something_else(tmp_path: Path) -> None:
    for text in ROOTS:
        for reader in JSON:
            file = tmp_path / "file.json"
            file.write_text(text, encoding="utf-8")
            refused(JSON[reader][1], file)


DEEP: list[Any] = []
for _ in range(400):
    DEEP = [DEEP]

WRONG = {
    "null": None,
    "true": True,
    "text": "wide",
    "list": [],
    "deep": DEEP,
    "block": {"a": 1},
    "-1e300": -1e300,
    "1e300": 1e300,
    "whole": 10**400,
}


def places(data: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values in it."""
    keys = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [at, *(place for key, value in keys for place in places(value, (*at, key)))]


def put(data: Any, at: tuple[Any, ...], value: object) -> Any:
    """Copy of it with another value in a place."""
    if not at:
        return value
    copy = dict(data) if isinstance(data, dict) else list(data)
    copy[at[0]] = put(data[at[0]], at[1:], value)
    return copy


FREE = {("features", 0, "type"), ("type",)}
"""Places that no reader looks at."""


def test_values_of_wrong_types(tmp_path: Path) -> None:
    for wrong, value in WRONG.items():
        for data, read in JSON.values():
            file = tmp_path / "file.json"
            for at in places(data):
                if at in FREE or (at[2:3] == ("properties",) and wrong in {"null", "text"}):
                    continue
                file.unlink(missing_ok=True)  # as in tests/scenario/test_fuzz.py
                file.write_text(json.dumps(put(data, at, value)), encoding="utf-8")
                refused(read, file)


def test_tables_of_places(tmp_path: Path) -> None:
    for text, told in [
        (CSV + "2,50.0,9," + "x" * 200_000, ":4: not valid CSV: field larger than field limit"),
        (CSV + '2,"50', "line 4: fewer cells than columns"),
        (CSV.replace("50.001", "nan"), "line 3: latitude must be a number"),
        (CSV.replace("\n1,", "\n1e300,"), "line 3: time_s must be a number"),
        ("time,lat,lon\n0001-01-01,1,2\n0001-01-01,1,2", "line 2: expected a time as|two positions"),
        (CSV + "1\x002,1,2\n", "line 4: time_s must be a number|not valid CSV"),
    ]:
        (tmp_path / "track.csv").write_text(text, encoding="utf-8")
        refused(load_track, tmp_path / "track.csv", told)


def test_tables_of_intensities(tmp_path: Path) -> None:
    for number in ["nan", "inf", "1e999", "", "wide", "-5"]:
        (tmp_path / "beam.csv").write_text(BEAM.replace("5", number), encoding="utf-8")
        refused(lamps_with_table, tmp_path / "beam.csv")
