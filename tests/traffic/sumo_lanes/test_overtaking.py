"""Vehicles on the oncoming lane, where SUMO counts positions from the far end: against positions on a straight road."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import fogsim
from fogsim.metrics.following import find_following
from fogsim.scenario import scenario_from_config
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.vehicle_reader import VehicleReader
from fogsim.traffic.sumo_lanes.leaders import Leaders
from fogsim.traffic.sumo_lanes.route_position import GapToEgo
from fogsim.traffic.sumo_lanes.street import LightsAhead
from fogsim.traffic.sumo_lanes.vehicle_places import SumoVehiclePlaces
from fogsim.values import Step, Stretch
from tests.traffic.common import DATA, QUIET, configured

CASES = DATA / "sumo_cases"
# Edges are 600 m long; the junction between them, of 0.1 m in SUMO's reckoning, is a point at x = 600 m.


def routes(lorry: float, ego: float, oncoming: str = "") -> str:
    """A car and a lorry that it overtakes, from where they depart [m]."""
    return f"""<routes><vType id="slow" vClass="truck" maxSpeed="6" length="12" sigma="0"/>
     <vType id="car" vClass="passenger" sigma="0" lcOpposite="5"/>
     <route id="r" edges="we1 we2"/><route id="back" edges="ew1"/>
     <vehicle id="lorry" type="slow" route="r" depart="0" departPos="{lorry}" departSpeed="6"/>
     <vehicle id="ego" type="car" route="r" depart="1" departPos="{ego}" departSpeed="15"/>{oncoming}</routes>"""


ONCOMING = '<vehicle id="oncoming" type="car" route="back" depart="1" departPos="250" departSpeed="5"/>'


def config(folder: Path, demand: str, *options: str, net: str = "overtaking.net.xml") -> Path:
    return configured(folder, CASES / net, demand, *options)


def steps_of(path: Path, ego: str = "ego", *settings: str) -> Iterator[Step]:
    usual = ("renderer=none", "estimators=[]", "fog.visibility_m=5000", "duration_s=20")
    return fogsim.run(scenario_from_config(path, ego, [*usual, *settings]), seed=1)


@contextmanager
def simulation(path: Path) -> Iterator[Any]:
    """SUMO itself, as long as the ego overtakes and after it; each step is a value of the iterator."""
    link = LibsumoLink()
    api = link.begin(["-c", str(path), "--step-length", "0.5", *QUIET])
    try:
        yield link, api
    finally:
        link.end()


@pytest.mark.parametrize("places", [(80.0, 20.0), (540.0, 500.0)], ids=["along an edge", "across a junction"])
def test_the_position_along_the_route_is_the_way_driven(tmp_path: Path, places: tuple[float, float]) -> None:
    lanes = set()
    for step in steps_of(config(tmp_path, routes(*places))):
        lanes.add(step.traffic.lane[step.ego])
        assert step.route_position == pytest.approx(step.traffic.position[step.ego, 0], abs=0.15)
    assert {"we1_0", "ew1_0"} <= lanes
    assert ("ew2_0" in lanes) == (places[0] > 500.0)


def test_an_event_waits_for_its_place() -> None:
    begun = fogsim.run(fogsim.load_scenario(CASES / "overtaking_trigger.yaml"), seed=1)
    dense = next(step for step in begun if step.truth.visibility_ahead < 100.0)
    assert 500.0 < dense.traffic.position[dense.ego, 0] < 510.0
    assert dense.time == pytest.approx(20.4, abs=0.5)


def test_gaps_and_stretches_go_by_the_way(tmp_path: Path) -> None:
    overtaking = 0
    with simulation(config(tmp_path, routes(80.0, 20.0))) as (link, api):
        link.step()
        places = SumoVehiclePlaces(api, "ego", Roster(api))
        for _ in range(24):
            link.step()
            if "ego" not in api.vehicle.getIDList():
                continue
            places._roster.update()
            x = {v: api.vehicle.getPosition(v)[0] for v in ("ego", "lorry")}
            apart = x["lorry"] - x["ego"]
            gap = max(apart - 12.0, 0.0) if apart > 0.0 else min(apart + 5.0, 0.0)
            assert GapToEgo(api, "ego").measure("lorry") == pytest.approx(gap, abs=0.01)
            assert GapToEgo(api, "lorry").measure("ego") == pytest.approx(-gap, abs=0.01)
            stretch, back = (Stretch(start=50.0, end=400.0, edges=(edge,)) for edge in ("we1", "ew1"))
            expected = {v: pytest.approx(at - 50.0, abs=0.01) for v, at in x.items() if 50.0 <= at < 400.0}
            assert places.on_stretch(stretch) == places.on_stretch(stretch, ("ego", "lorry")) == expected
            assert places.on_stretch(back) == places.on_stretch(back, ("ego", "lorry")) == {}
            overtaking += api.vehicle.getRoadID("ego") == "ew1"
    assert overtaking > 5


def test_nobody_follows_who_comes_along_the_oncoming_lane(tmp_path: Path) -> None:
    """SUMO takes each for the leader of the other, with the speed of one who drives away."""
    path, met = config(tmp_path, routes(80.0, 20.0, ONCOMING)), 0
    for ego in ("ego", "oncoming"):
        for step in steps_of(path, ego, "duration_s=12"):
            traffic = step.traffic
            x, lane = traffic.position[:, 0], traffic.lane
            found = find_following(traffic)
            pairs = {(traffic.ids[i], traffic.ids[j]) for i, j in zip(found.follower, found.leader, strict=True)}
            if "ego" in traffic.ids and lane[traffic.ids.index("ego")] == "ew1_0":
                met += "oncoming" in traffic.ids
                assert pairs == set()
                assert step.leader is None
            elif ego == "ego":
                ahead = x[traffic.ids.index("lorry")] - x[step.ego] > 0.0
                assert (step.leader is not None and step.leader.vehicle_id == "lorry") == ahead
    assert met > 20


def test_lights_are_as_far_away_as_the_way_to_them(tmp_path: Path) -> None:
    met = 0
    with simulation(config(tmp_path, routes(200.0, 150.0), net="overtaking_lights.net.xml")) as (link, api):
        for _ in range(24):
            link.step()
            if "ego" not in api.vehicle.getIDList():
                continue
            light, x = LightsAhead(api).next_of("ego"), api.vehicle.getPosition("ego")[0]
            assert light is not None
            assert light[2] == pytest.approx(596.0 - x, abs=0.1)
            met += api.vehicle.getRoadID("ego") == "ew1"
    assert met > 5


def test_the_leader_of_one_that_overtakes_is_one_that_overtakes(tmp_path: Path) -> None:
    second = '<vehicle id="second" type="car" route="r" depart="1" departPos="5" departSpeed="15"/>'
    met = 0
    with simulation(config(tmp_path, routes(80.0, 30.0, second))) as (link, api):
        for _ in range(24):
            link.step()
            there = [v for v in api.vehicle.getIDList() if api.vehicle.getLaneID(v) == "ew1_0"]
            if set(there) == {"ego", "second"}:
                ahead, behind = sorted(there, key=lambda v: -api.vehicle.getPosition(v)[0])
                apart = api.vehicle.getPosition(ahead)[0] - api.vehicle.getPosition(behind)[0]
                found = Leaders(api).of_ego(behind)
                assert found is not None
                assert found.vehicle_id == ahead
                assert found.gap == pytest.approx(apart - 5.0, abs=0.01)
                assert Leaders(api).of_ego(ahead) is None
                met += 1
    assert met > 0


@pytest.mark.parametrize("action", ["warn", "remove"])
def test_vehicles_that_meet_head_on_collide_with_both_speeds(tmp_path: Path, action: str) -> None:
    """Whether or not SUMO has removed them before they can be asked for their headings."""
    path = config(tmp_path, routes(80.0, 20.0, ONCOMING), f'<collision.action value="{action}"/>')
    with simulation(path) as (link, api):
        reader, hits, get = VehicleReader(api, None, 1000.0), [], api.vehicle
        for number in range(50):
            link.step()
            for vehicle in {"ego", "oncoming"}.intersection(get.getIDList()):
                get.setSpeedMode(vehicle, 0)
                get.setSpeed(vehicle, 12.0)
                get.setLaneChangeMode(vehicle, 0)
            if 4 <= number < 12:
                get.changeLane("ego", 1, 5.0)
            hits += reader.collisions()
    assert (hits[0].collider, hits[0].victim) == ("ego", "oncoming")
    assert hits[0].impact_speed == pytest.approx(24.0)
