"""Traffic on every template: SUMO says nothing against the files, and nobody collides in clear air."""

import subprocess
from pathlib import Path

import pytest
import sumo

from fogsim.traffic.templates import (
    ROAD_TEMPLATES,
    Actor,
    Demand,
    Relation,
    cuts_around,
    net_text,
    place_actors,
    routes_text,
    usual_mix,
)

FLOWS = tuple((way, 0.1) for way in ("same_way", "oncoming", "ramp", "north", "south"))


ON_FOOT = ("rural", "crossing")


@pytest.mark.parametrize(
    ("name", "on_foot"), [*((name, False) for name in ROAD_TEMPLATES), *((n, True) for n in ON_FOOT)]
)
def test_sumo_plays_it_without_a_warning(name: str, on_foot: bool, tmp_path: Path) -> None:
    template = ROAD_TEMPLATES[name](**({"footways": True} if on_foot else {}))  # type: ignore[arg-type]
    slow = Actor("slow", "truck", place=Relation("ego", 40.0), speed=8.0)
    broken_down = Actor("broken_down", "van", place=60.0, stands=True, lane=-1)
    standing = [broken_down] if name in ("motorway", "ramp") else []
    placed = place_actors((Actor("ego", place=120.0, speed=10.0), slow, *standing))
    layout = template.layout(cuts_around(placed, template.free_length))
    demand = Demand(tuple(flow for flow in FLOWS if layout.way(flow[0])), usual_mix(name))
    (tmp_path / "net.xml").write_text(net_text(layout.net), encoding="utf-8")
    (tmp_path / "rou.xml").write_text(routes_text(layout, demand, placed), encoding="utf-8")
    arguments = ["-n", "net.xml", "-r", "rou.xml", "--end", "60", "--step-length", "0.2", "--no-step-log", "true"]
    strict = ["--collision.action", "warn", "--collision.check-junctions", "true", "--time-to-teleport", "30"]
    program = Path(sumo.SUMO_HOME, "bin", "sumo")
    done = subprocess.run([program, *arguments, *strict], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
