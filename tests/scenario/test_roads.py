"""Scenarios whose road is a template."""

from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.scenario import Scenario, build, load_scenario, override, resolved
from fogsim.scenario.roads.files import traffic_files

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


def test_a_road_by_template_is_written_for_sumo(tmp_path: Path) -> None:
    scenario = loaded(tmp_path)
    setup = build.traffic_setup(scenario)
    assert setup.net is not None
    assert setup.net.is_relative_to(tmp_path / "cache")
    assert setup.keep_lane == ("ego", "slow")
    assert [event.trigger.name for event in setup.events] == ["actors.slow.lamps"]
    # The same road has the same files, and what was declared is kept as it was.
    assert traffic_files(override(scenario, [])).net == setup.net
    assert traffic_files(override(scenario, ["road.lanes=3"])).net != setup.net
    assert resolved(scenario)["traffic"].get("net") is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "scenario.yaml"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("template: motorway", "template: motorwy", "unknown road template 'motorwy'"),
        ("540 veh/h", "540 km/h", "scenario.yaml:4: demand.same_way: "),
        ("lanes: 2", "lane: 2", "road.lane: unknown key; did you mean 'lanes'"),
        ("lane: right", "lan: right", "actors.ego.lan: unknown key; did you mean 'lane'"),
        ("truck: 15 %", "tram: 15 %", "unknown vehicle type 'tram'"),
        ("truck: 15 %", "truck: 95 %, van: 10 %", "shares of types must together be 1"),
        ("ahead_of: ego", "ahead_of: eggo", "scenario.yaml:7: actors.slow: there is no actor 'eggo'"),
        ("gap: 60 m, ", "", "gap_m goes with ahead_of or behind"),
        ("ahead_of: ego", "ahead_of: ego, behind: ego", "give one of position_m, ahead_of"),
        ("fog:", "traffic: {net: a.net.xml}\nfog:", "give road or traffic.net, not both"),
        ("road:", "# road:", "traffic: this key is missing"),
    ],
)
def test_mistakes_are_told_where_they_stand(tmp_path: Path, old: str, new: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        loaded(tmp_path, TEXT.replace(old, new, 1))


def test_demand_and_actors_need_a_road(tmp_path: Path) -> None:
    text = TEXT.replace("road:", "traffic: {net: a.net.xml, routes: [a.rou.xml]} #", 1)
    with pytest.raises(InputError, match="demand: goes with a road by template"):
        loaded(tmp_path, text)
