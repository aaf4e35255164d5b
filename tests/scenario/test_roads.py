"""Scenarios whose road is a template."""

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.scenario import Scenario, build, load_scenario, override, resolved
from fogsim.scenario.roads.files import road_layout, traffic_files
from fogsim.traffic.road.network import read_net
from fogsim.traffic.road.signs import sign_map
from fogsim.traffic.road.structures import structures
from fogsim.traffic.templates import ROAD_TEMPLATES, net_text

TEXT = """
name: template_motorway
road: {template: motorway, length: 4 km, lanes: 2, limit: 130 km/h}
demand: {same_way: 540 veh/h, oncoming: 540 veh/h, mix: {truck: 15 %}}
actors:
  ego: {lane: right, position: 200 m, speed: 90 km/h}
  slow: {type: truck, ahead_of: ego, gap: 60 m, speed: 80 km/h, lamps: failed}
fog: {visibility: 150 m}
"""


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "cache"))


def loaded(folder: Path, text: str = TEXT) -> Scenario:
    file = folder / "scenario.yaml"
    file.write_text(text, encoding="utf-8")
    return load_scenario(file)


def test_footways_lie_beside_the_lanes_that_traffic_keeps(tmp_path: Path) -> None:
    text = TEXT.replace("motorway, length: 4 km, lanes: 2, limit: 130 km/h", "rural, length: 1 km, footways: true")
    text = text.replace("same_way: 540", "same_way: 1800")
    files = traffic_files(
        loaded(tmp_path, text.replace("footways: true", "footways: true, zebra_crossings: [230 m, 400 m]"))
    )
    net, routes = (ET.parse(path).getroot() for path in (files.net, files.routes[0]))  # noqa: S314 - our own files
    on_foot = {lane.get("id") for lane in net.iter("lane") if lane.get("allow") == "pedestrian"}
    assert {"same_way_0", "oncoming_0", ":cut2_c0_0", ":cut1_w0_0"} <= on_foot
    driven = [one for kind in ("vehicle", "flow") for one in routes.iter(kind)]
    assert {one.get("departLane") for one in driven} == {"1"}
    # Both actors, before and behind a crossing, and nobody else between them.
    there = {one.get("id") for one in driven if (one.get("id") or "").startswith("same_way.there")}
    assert there == {f"same_way.there.{place}.0" for place in (0, 3, 4)}


def test_footways_that_cannot_be_are_refused(tmp_path: Path) -> None:
    for road, told in [
        ("{template: motorway, footways: true}", "a motorway has no footways; "),
        ("{template: straight, footway: true}", "road.footway: unknown key; did you mean 'footways'"),
        ("{template: straight, zebra_crossings: [90 m]}", "zebra_crossings go with footways: true"),
        ("{template: straight, footways: true, zebra_crossings: [90 m, 110 m]}", "40 m from one another"),
        ("{template: straight, footways: true, zebra_crossings: [90 m], median: 2 m}", "without a median"),
        ("{template: straight, footways: true, zebra_crossings: [90 m, 2 s]}", "the unit 's' does not fit"),
        ("{template: crossing, footways: true, zebra_crossings: [90 m]}", "a crossing has no zebra_crossings_m"),
    ]:
        with pytest.raises(InputError, match=r"scenario.yaml:2: road") as refused:
            loaded(tmp_path, f"name: on_foot\nroad: {road}\nfog: {{visibility: 150 m}}\n")
        assert told in str(refused.value)


def test_a_road_by_template_is_written_for_sumo(tmp_path: Path) -> None:
    scenario = loaded(tmp_path)
    setup = build.traffic_setup(scenario)
    assert setup.net.is_relative_to(tmp_path / "cache")
    assert setup.keep_lane == ("ego", "slow")
    assert [event.trigger.name for event in setup.events] == ["actors.slow.lamps"]
    # The same road has the same files, and what was declared is kept as it was.
    assert traffic_files(override(scenario, [])).net == setup.net
    assert traffic_files(override(scenario, ["road.lanes=3"])).net != setup.net
    assert resolved(scenario)["traffic"].get("net") is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "scenario.yaml"]


def test_mistakes_are_told_where_they_stand(tmp_path: Path) -> None:
    for old, new, told in [
        ("template: motorway", "template: motorwy", "unknown road template 'motorwy'"),
        ("540 veh/h", "540 km/h", "scenario.yaml:4: demand.same_way: "),
        ("oncoming: 540", "ramp: 540", "scenario.yaml:4: demand.ramp_vph: the road has no way 'ramp'"),
        ("lanes: 2", "lane: 2", "road.lane: unknown key; did you mean 'lanes'"),
        ("lane: right", "lan: right", "actors.ego.lan: unknown key; did you mean 'lane'"),
        ("truck: 15 %", "tram: 15 %", "unknown vehicle type 'tram'"),
        ("truck: 15 %", "truck: 95 %, van: 10 %", "shares of types must together be 1"),
        ("ahead_of: ego", "ahead_of: eggo", "scenario.yaml:7: actors.slow: there is no actor 'eggo'"),
        ("gap: 60 m, ", "", "gap_m goes with ahead_of or behind"),
        ("ahead_of: ego", "ahead_of: ego, behind: ego", "give one of position_m, ahead_of"),
        ("lamps: failed", "stands: true", "actors.slow: it stands, and speed_kmh is 80"),
        ("fog:", "traffic: {net: a.net.xml}\nfog:", "give road or traffic.net, not both"),
        ("road:", "# road:", "traffic: this key is missing"),
    ]:
        with pytest.raises(InputError, match=told):
            loaded(tmp_path, TEXT.replace(old, new, 1))


def test_demand_and_actors_need_a_road(tmp_path: Path) -> None:
    text = TEXT.replace("road:", "traffic: {net: a.net.xml, routes: [a.rou.xml]} #", 1)
    with pytest.raises(InputError, match="demand: goes with a road by template"):
        loaded(tmp_path, text)
    with pytest.raises(InputError, match=r"actors: go with a road by template .* or with traffic.net"):
        loaded(tmp_path, OWN_NET.replace("net: road.net.xml", "config: a.sumocfg"))


BESIDE = """
name: beside
road:
  template: tunnel
  tunnel_at: 200 m
  obstructions: [{kind: hedge, at: 20 m, side: left, distance: 2 m}, {kind: wall, at: 20 m, length: 50 m}]
fog: {visibility: 150 m}
"""


def test_what_stands_beside_a_road_is_drawn_where_it_is_said_to_be(tmp_path: Path) -> None:
    setup = build.traffic_setup(loaded(tmp_path, BESIDE))
    found = {one.structure_id: one for one in structures(setup.additional)}
    assert {name: one.kind for name, one in found.items()} == {
        "obstruction.0": "hedge",
        "obstruction.1": "wall",
        **dict.fromkeys(("tunnel.right", "tunnel.left", "tunnel.roof"), "tunnel"),
    }
    along = np.array([np.cos(np.radians(20.0)), np.sin(np.radians(20.0))])
    left = np.array([-along[1], along[0]])
    hedge, wall, roof = (found[name] for name in ("obstruction.0", "obstruction.1", "tunnel.roof"))
    # The two lanes have 3.5 m each; the middle of the road begins where the map does.
    np.testing.assert_allclose(hedge.line[0, :2], 20.0 * along + (3.5 + 2.0 + 0.6) * left, atol=0.02)
    np.testing.assert_allclose(wall.line[-1, :2], 70.0 * along - (3.5 + 3.0 + 0.15) * left, atol=0.02)
    np.testing.assert_allclose(roof.line[[0, -1], :2], [200.0 * along, 600.0 * along], atol=0.02)
    assert roof.bottom == 5.2


def test_signs_repeat_the_limit_but_in_a_tunnel(tmp_path: Path) -> None:
    setup = build.traffic_setup(loaded(tmp_path, BESIDE.replace("tunnel_at", "sign_spacing: 450 m\n  tunnel_at")))
    found = {one.sign_id: one for one in sign_map(read_net(setup.net), setup.additional).signs}
    repeated = {name: one for name, one in found.items() if name[-1].isdigit()}
    # One would be 450 m along, in the tunnel from 200 to 600 m.
    assert list(repeated) == ["limit.2", "limit.3", "limit.4"]
    along = np.array([np.cos(np.radians(20.0)), np.sin(np.radians(20.0))])
    right = np.array([along[1], -along[0]])
    for name, at in (("limit.2", 900.0), ("limit.4", 1800.0)):
        one = repeated[name]
        # Crossings between the edges of a tunnel's road are 0.1 m long.
        np.testing.assert_allclose(one.position[:2], at * along + (3.5 + 3.9) * right, atol=0.25)
        assert (one.kind, one.heading) == ("speed_limit", pytest.approx(np.radians(20.0), abs=1e-4))
        assert one.value == pytest.approx(80.0 / 3.6)


def test_what_does_not_fit_beside_a_road_is_told(tmp_path: Path) -> None:
    for old, new, told in [
        ("at: 20 m, side", "at: 1990 m, side", "scenario.yaml:3: road: obstructions.0: ends beyond its way"),
        ("kind: hedge", "kind: hedge, along: ramp", "obstructions.0: the road has no way 'ramp'"),
        ("tunnel_at: 200 m", "tunnel_at: 1700 m", "road: the tunnel ends 100 m beyond the road"),
        ("kind: wall", "kind: wal", "scenario.yaml:6: road.obstructions.1.kind"),
    ]:
        with pytest.raises(InputError, match=told):
            loaded(tmp_path, BESIDE.replace(old, new, 1))


OWN_NET = """
name: own_net
traffic: {net: road.net.xml, warm_up_limit: 10 s}
actors:
  ego: {edges: [EDGES], position: 60 m, depart: 5 s}
  behind: {behind: ego, gap: 20 m, speed: 50 km/h}
fog: {visibility: 150 m}
"""


def test_actors_drive_on_a_network_of_ones_own(tmp_path: Path) -> None:
    layout = ROAD_TEMPLATES["motorway"]().layout((500.0,))
    (tmp_path / "road.net.xml").write_text(net_text(layout.net), encoding="utf-8")
    scenario = loaded(tmp_path, OWN_NET.replace("EDGES", "same_way, same_way.1"))
    (routes,) = build.traffic_setup(scenario).routes
    root = ET.fromstring(routes.read_text(encoding="utf-8"))  # noqa: S314 - our own file
    found = {one.get("id"): (one.get("depart"), float(one.get("departPos") or "")) for one in root.iter("vehicle")}
    assert found == {"ego": ("5", 60.0), "behind": ("5", pytest.approx(60.0 - 4.6 - 20.0))}
    assert {one.get("edges") for one in root.iter("route")} == {"same_way same_way.1"}
    with pytest.raises(InputError, match=r"scenario.yaml:5: actors.ego: the net has no edge 'same'; did you mean"):
        loaded(tmp_path, OWN_NET.replace("EDGES", "same"))
    foot = (tmp_path / "road.net.xml").read_text(encoding="utf-8").replace("<lane ", '<lane allow="pedestrian" ')
    with pytest.raises(InputError, match=r"actors.ego: needs edges"):
        loaded(tmp_path, OWN_NET.replace("edges: [EDGES], ", ""))
    (tmp_path / "road.net.xml").write_text(foot, encoding="utf-8")
    with pytest.raises(InputError, match=r"actors.ego: edge 'same_way' has no lane for vehicles, only for pedestrians"):
        loaded(tmp_path, OWN_NET.replace("EDGES", "same_way"))


def test_places_of_traffic_alone_count_along_the_whole_way(tmp_path: Path) -> None:
    alone = """
name: traffic_alone
road: {template: crossing, lights: true}
demand: {same_way: 540 veh/h}
traffic: {ego: none}
fog: {outside_visibility: 2 km, banks: [{start: 300 m, end: 400 m, visibility: 50 m}]}
expect: {flows: {never: collisions > 0}}
"""
    scenario = loaded(tmp_path, alone)
    layout, _ = road_layout(scenario)
    assert scenario.traffic.along == layout.way("same_way")
    assert len(scenario.traffic.along) > 1
    named = override(scenario, ["traffic.along=[same_way]"])
    assert named.traffic.along == ("same_way",)


def test_a_speed_that_an_actor_never_reaches_is_refused(tmp_path: Path) -> None:
    timeline = "timeline: [{{when: time > 1 s, do: {{slow: {{speed: {{to: {} km/h}}}}}}}}]\n"
    with pytest.raises(InputError, match=r"do\.slow: slow begins with speed_kmh: 80 and never .* come to 90"):
        loaded(tmp_path, TEXT + timeline.format(90))
    loaded(tmp_path, TEXT + timeline.format(80))
