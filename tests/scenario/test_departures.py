"""Vehicles that a timeline brings onto the road with a type and a way of their own."""

from pathlib import Path

import pytest

import fogsim
from fogsim import script as fs
from fogsim.errors import UnplayedWarning
from fogsim.scenario import scenario_from_config
from fogsim.scenario.roads.files import entering_vehicles
from fogsim.values import Step
from fogsim.values.script import Enter
from tests.data.early_motorway import EARLY
from tests.helpers.attached import GRID

ROAD = """
name: late_comers
duration: 4 s
road: {template: ramp, lanes: 2, limit: 100 km/h}
actors: {ego: {position: 100 m, speed: 80 km/h}}
fog: {visibility: 500 m}
renderer: none
sut: {estimators: [], advice: none}
timeline:
  - when: time >= 1 s
    do:
      lorry: {depart: {type: lorry, position: 300 m, lane: left, speed: 60 km/h}}
      merging: {depart: {type: motorcycle, on: ramp, position: 50 m}}
      near: {depart: {like: ego, gap: 100 m, type: coach, speed: 70 km/h}}
"""
MOTORWAY = "timeline=[{{when: time >= 0 s, do: {{new: {{depart: {{{}}}}}}}}}]"


def scenario_of(folder: Path, text: str) -> fogsim.Scenario:
    path = folder / "late.fog.yaml"
    path.write_text(text, encoding="utf-8")
    return fogsim.load_scenario(path)


def row_of(step: Step, vehicle: str) -> tuple[str, float, float, str]:
    row = step.traffic.row(vehicle)
    state = step.traffic
    return state.types[row], float(state.length[row]), float(state.speed[row]), state.lane[row]


def test_they_come_as_they_are_to(tmp_path: Path) -> None:
    first: dict[str, float] = {}
    for step in fogsim.run(scenario_of(tmp_path, ROAD)):
        first.update({v: step.time for v in step.traffic.ids if v not in first})
    assert step.unplayed is None or not step.unplayed
    assert {first[vehicle] for vehicle in ("lorry", "merging", "near")} <= {1.1, 1.2}
    kind, length, speed, lane = row_of(step, "lorry")
    assert (kind, length, lane[-2:]) == ("truck", 9.2, "_1")
    assert speed == pytest.approx(60.0 / 3.6, abs=0.1)
    assert row_of(step, "merging")[:2] == ("motorcycle", 2.2)
    assert row_of(step, "near")[:2] == ("bus", 12.5)


def test_of_a_network_edges_are_given_and_the_way_between_them_is_found() -> None:
    settings = ["renderer=none", "estimators=[]", "duration_s=3", EARLY]
    depart = MOTORWAY.format("edges: [approach, exit], lane: 2")
    scenario = fogsim.load_scenario("motorway_fog_bank", [*settings, depart])
    assert list(entering_vehicles(scenario).values()) == [Enter("new", "car", ("approach", "exit"), 4.6, 2)]
    *_, step = fogsim.run(scenario)
    assert row_of(step, "new")[3] == "approach_2"


def test_python_says_the_same(tmp_path: Path) -> None:
    written = scenario_of(tmp_path, ROAD)
    assert scenario_of(tmp_path, fs.to_yaml(written)).timeline == written.timeline
    (doing,) = written.timeline[0].do["merging"]  # type: ignore[misc]
    assert doing == fs.VehicleActions(depart=fs.DepartAction(type="motorcycle", on="ramp", position_m=50))


def test_mistakes_are_told_at_their_place(tmp_path: Path) -> None:
    for old, new, told in [
        ("type: lorry", "type: lory", "depart.type: unknown vehicle type 'lory'; did you mean 'lorry'"),
        ("on: ramp", "on: rampe", "timeline.0.do.merging.depart: the road has no way 'rampe'; did you mean 'ramp'"),
        ("position: 300 m", "position: 30 km", "timeline.0.do.lorry.depart: must begin within 9.2 …"),
        ("lane: left", "lane: 5", "timeline.0.do.lorry.depart: there are lanes 0 to 1, got 5"),
        ("on: ramp", "edges: [a]", "timeline.0.do.merging.depart: edges go with a network"),
        ("like: ego, gap: 100 m", "like: ego", "timeline.0.do.near.depart: like and gap_m go together"),
        ("like: ego", "position: 5 m, like: ego", "give like, or a route (position_m), not both"),
    ]:
        with pytest.raises(fogsim.InputError) as error:
            scenario_of(tmp_path, ROAD.replace(old, new))
        assert told in str(error.value)


def test_who_comes_by_a_route_file_does_not_come_by_the_timeline() -> None:
    late = "timeline=[{name: twice, when: time >= 0 s, do: {veh30: {depart: {like: ego, gap: 5 m}}}}]"
    settings = ["renderer=none", "estimators=[]", "fog.visibility_m=100", "duration_s=1", late]
    with pytest.warns(UnplayedWarning, match=r"twice .*: there was no place for the vehicle, or such a"):
        list(fogsim.run(scenario_from_config(GRID / "grid.sumocfg", "veh18", settings)))


def test_edges_of_a_network_are_looked_up() -> None:
    way = "timeline=[{when: time > 1 s, do: {slow: {take_route: [bank, exitt]}}}]"
    with pytest.raises(fogsim.InputError, match=r"slow\.take_route: the net has no edge 'exitt'; did you mean 'exit'"):
        fogsim.load_scenario("motorway_fog_bank", [way])
    for depart, told in (
        ("edges: [aproach]", "the net has no edge 'aproach'; did you mean 'approach'"),
        ("edges: [approach], position: 9 km", "position_m counts along 'approach'"),
        ("type: car", "on a network write edges"),
    ):
        with pytest.raises(fogsim.InputError, match=told):
            fogsim.load_scenario("motorway_fog_bank", [MOTORWAY.format(depart)])
