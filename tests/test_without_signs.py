"""A road without any sign: the map is empty, and everything works."""

import math
from pathlib import Path

import pytest

import fogsim
from fogsim.simulation.recording import record_signs

RADIUS = 400.0
SCENARIO = """
name: ring
duration_s: 1
traffic: {net: ring.net.xml, routes: [ring.rou.xml]}
fog: {visibility_m: 120}
camera: {width: 160, height: 120}
"""
ROUTES = """<routes><vType id="car" vClass="passenger"/><route id="r" edges="north south" repeat="5"/>
<vehicle id="lead" type="car" route="r" depart="0" departPos="80" departSpeed="10"/>
<vehicle id="ego" type="car" route="r" depart="0" departPos="20" departSpeed="10"/></routes>"""


def half_circle(start: float) -> str:
    """Points of half of the ring, counterclockwise from an angle [rad]."""
    angles = [start + math.pi * i / 60 for i in range(61)]
    return " ".join(f"{RADIUS * math.cos(a):.3f},{RADIUS * math.sin(a):.3f}" for a in angles)


def ring() -> str:
    """A ring of two edges with one limit, so that nowhere does a limit change."""
    ends = {"north": ("east", "west", 0.0), "south": ("west", "east", math.pi)}
    edges = "".join(
        f'<edge id="{name}" from="{a}" to="{b}" priority="1"><lane id="{name}_0" index="0" speed="20" '
        f'length="{math.pi * RADIUS:.2f}" shape="{half_circle(start)}"/></edge>'
        for name, (a, b, start) in ends.items()
    )
    junctions = "".join(
        f'<junction id="{name}" type="priority" x="{x}" y="0" incLanes="{edge}_0" intLanes="" '
        f'shape="{x - 2},0 {x + 2},0"><request index="0" response="0" foes="0" cont="0"/></junction>'
        for name, x, edge in (("east", RADIUS, "south"), ("west", -RADIUS, "north"))
    )
    links = "".join(
        f'<connection from="{a}" to="{b}" fromLane="0" toLane="0" dir="s" state="M"/>'
        for a, b in (("north", "south"), ("south", "north"))
    )
    return f'<net version="1.20">{edges}{junctions}{links}</net>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    (tmp_path / "ring.net.xml").write_text(ring(), encoding="utf-8")
    (tmp_path / "ring.rou.xml").write_text(ROUTES, encoding="utf-8")
    return tmp_path


def test_a_net_without_signs_has_an_empty_map_and_runs(folder: Path) -> None:
    scenario = fogsim.load_scenario(str(folder))
    assert record_signs(scenario, folder / "signs.geojson").signs == ()
    steps = list(fogsim.run(scenario, seed=1))
    assert len(steps) == 11
    assert all(step.observation.signs == () for step in steps)
    assert steps[-1].leader is not None
