"""Route files: the road is full at first, and free around the actors."""

import itertools
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

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
from tests.traffic.templates.common import play

RATE = 0.3  # [1/s]
PLACED = place_actors((Actor("ego", place=500.0, speed=25.0), Actor("slow", place=Relation("ego", 600.0), speed=20.0)))


def written(name: str, flows: tuple[tuple[str, float], ...], turning: float = 0.2) -> tuple[str, str]:
    """Network and route file."""
    template = ROAD_TEMPLATES[name]()
    layout = template.layout(cuts_around(PLACED, template.free_length))
    placed = PLACED if template.free_length else ()
    return net_text(layout.net), routes_text(layout, Demand(flows, usual_mix(name), turning), placed)


def departures(name: str, folder: Path, seed: int) -> list[tuple[str, str, float]]:
    """Vehicles at the run's beginning: id, lane and position [m]."""
    files = written(name, (("same_way", RATE), ("oncoming", RATE)))
    play(folder, *files, "--seed", str(seed), "--fcd-output", "fcd.xml", "--end", "0.1", "--step-length", "0.1")
    (first, *_) = ET.parse(folder / "fcd.xml").getroot().iter("timestep")  # noqa: S314 - our own file
    return [(v.get("id", ""), v.get("lane", ""), float(v.get("pos", ""))) for v in first]


def test_the_road_is_full_at_first_and_the_seed_varies_it(tmp_path: Path) -> None:
    found = {seed: departures("motorway", tmp_path, seed) for seed in (1, 2)}
    for vehicles in found.values():
        # As many as flow and speed make: 0.3 /s on 3 km at 0.9 of 36.1 m/s, but for the lane between the actors.
        oncoming = [one for one in vehicles if one[1].startswith("oncoming")]
        same_way = [one for one in vehicles if one[1].startswith("same_way")]
        assert len(oncoming) == pytest.approx(RATE * 3000.0 / 32.5, abs=2)
        assert len(same_way) == pytest.approx(2 + RATE * (3000.0 - 0.5 * 669.2) / 32.5, abs=3)
        # Nobody is on the actors' lane from 30 m behind the last of them to 30 m before the first.
        assert {one[0] for one in vehicles if one[1] == "same_way.1_0"} == {"ego", "slow"}
        assert [one for one in vehicles if one[1] == "same_way.1_1"]
    assert found[1] != found[2]


def test_some_turn_where_roads_meet() -> None:
    root = ET.fromstring(written("crossing", (("south", 0.1),), turning=0.5)[1])  # noqa: S314 - our own text
    periods = {one.get("id"): one.get("period") for one in root.iter("flow") if one.get("period")}
    assert periods == {"south.0": "exp(0.050000)", "south.left.0": "exp(0.025000)", "south.right.0": "exp(0.025000)"}
    routes = {one.get("id"): one.get("edges") for one in root.iter("route")}
    assert routes["route.south.left.0"] == "south same_way.back"


def test_actors_have_the_whole_way_as_their_route_and_heavy_vehicles_keep_to_the_right_and_are_as_many_as_said() -> (
    None
):
    root = ET.fromstring(written("motorway", ())[1])  # noqa: S314 - our own text
    routes = {one.get("id"): one.get("edges") for one in root.iter("route")}
    vehicles = {one.get("id"): one for one in root.iter("vehicle")}
    assert routes["route.slow"] == "same_way same_way.1 same_way.2"
    assert [vehicles[name].get("departEdge") for name in ("ego", "slow")] == ["1", "1"]
    # The first cut is 30 m behind the ego, which is 4.6 m long, and the lane across it has SUMO's least length.
    assert float(vehicles["ego"].get("departPos") or "") == pytest.approx(30.0 + 4.6 - 0.1)
    mixes = {
        one.get("id"): {kind.get("id"): float(kind.get("probability") or "") for kind in one}
        for one in root.iter("vTypeDistribution")
    }
    assert set(mixes["mix.left"]) == {"car.left", "van.left"}
    # Of two lanes, the right one has twice its share.
    heavy = mixes["mix.right"]["truck.right"] + mixes["mix.right"]["coach.right"]
    assert heavy == pytest.approx(2 * (0.15 + 0.03))
    assert all(sum(shares.values()) == pytest.approx(1.0, abs=1e-3) for shares in mixes.values())
    types = [one.get("id") for one in root.iter("vType")]
    assert all(one != other for one, other in itertools.combinations(types, 2))
