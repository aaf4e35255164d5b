import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest

from fogsim.errors import InputError
from fogsim.recorders import write_sign_map
from fogsim.scenario import catalogue, load_scenario
from fogsim.simulation.recording import record_signs
from fogsim.values import Sign, SignMap

LIMIT = Sign("limit.a", "speed_limit", 20.0, (10.0, -5.0, 2.6), math.radians(30.0), 0.9)
OTHER = Sign("xodr.9", "xodr.276", 0.0, (40.0, 6.0, 2.0), math.pi, 0.6)


def written(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def test_points_with_what_the_signs_say(tmp_path: Path) -> None:
    write_sign_map(tmp_path / "signs.geojson", SignMap((LIMIT, OTHER)), "roads")
    content = written(tmp_path / "signs.geojson")
    assert (content["type"], content["name"]) == ("FeatureCollection", "roads")
    assert "not longitude and latitude" in content["coordinates"]
    limit, other = content["features"]
    assert limit["geometry"] == {"type": "Point", "coordinates": [10.0, -5.0]}
    assert limit["properties"]["speed_limit_kmh"] == pytest.approx(72.0)
    assert limit["properties"]["heading_deg"] == pytest.approx(60.0)
    assert (other["id"], other["properties"]["kind"], other["properties"]["value"]) == ("xodr.9", "xodr.276", 0.0)
    assert other["properties"]["heading_deg"] == pytest.approx(270.0)


def test_longitude_and_latitude_where_they_are_known(tmp_path: Path) -> None:
    write_sign_map(tmp_path / "a.geojson", SignMap((LIMIT,)), "roads", lambda x, y: (8.0 + x / 1e3, 50.0 + y / 1e3))
    content = written(tmp_path / "a.geojson")
    assert "WGS 84" in content["coordinates"]
    (limit,) = content["features"]
    assert limit["geometry"]["coordinates"] == pytest.approx([8.01, 49.995])
    assert (limit["properties"]["x_m"], limit["properties"]["y_m"]) == (10.0, -5.0)


def test_a_sign_map_does_not_replace_what_it_is_made_of(tmp_path: Path) -> None:
    shutil.copytree(catalogue()["motorway_fog_bank"].parent, tmp_path, dirs_exist_ok=True)
    scenario = load_scenario(tmp_path)
    net = tmp_path / "motorway.net.xml"
    before = net.read_bytes()
    with pytest.raises(InputError, match="would replace what is read"):
        record_signs(scenario, net, overwrite=True)
    assert net.read_bytes() == before
