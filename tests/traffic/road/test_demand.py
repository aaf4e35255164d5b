import gzip
from pathlib import Path

import pytest

from fogsim.traffic.road.demand import Demand, VehicleRoute, read_configured_demand, read_demand, read_flows

VEHICLES = """<routes><route id="r" edges="a b"/>
<vehicle id="ego" route="r" depart="0" departLane="1"/><trip id="t" depart="1" from="a" to="c"/>
<vehicle id="own" depart="2"><route edges="b c"/></vehicle>
<flow id="f" begin="0" end="9" number="3" route="r"/><flow id="g" begin="0" end="9" probability="0.1" from="a" to="b"/>
</routes>"""


def demand_of(folder: Path, text: str, *wanted: str, **options: int) -> Demand:
    file = folder / "a.rou.xml"
    file.write_text(text, encoding="utf-8")
    return read_demand([file], wanted, **options)


def test_who_can_come_and_who_never_can(tmp_path: Path) -> None:
    for vehicle in ["ego", "t", "own", "f.0", "f.2", "g.0", "g.123456"]:
        demand = demand_of(tmp_path, VEHICLES, vehicle)
        assert demand.found == {vehicle}
        assert not demand.lacks(vehicle)
    for vehicle in ["egoo", "EGO", "r", "f", "f.3", "f.00", "f.01", "f.-1", "f.", "f.1.0", ".0", "g"]:
        demand = demand_of(tmp_path, VEHICLES, "ego", vehicle)
        assert demand.lacks(vehicle)
        assert not demand.lacks("ego")
        assert demand.names == ("ego", "t", "own", "f.0", "f.2", "g.0")


def test_ways_that_are_written_out(tmp_path: Path) -> None:
    file = tmp_path / "a.rou.xml"
    demand = demand_of(tmp_path, VEHICLES, "ego", "own", "t", "f.1")
    assert demand.routes == {
        "ego": VehicleRoute(("a", "b"), 1, file),
        "own": VehicleRoute(("b", "c"), None, file),
        "f.1": VehicleRoute(("a", "b"), None, file),
    }


@pytest.mark.parametrize(
    "text",
    [
        '<routes><rerouter id="x"/><route id="r" edges="a"/><vehicle id="ego" route="r" depart="0"/></routes>',
        '<routes><route id="r" edges="a" repeat="2"/><vehicle id="ego" route="r" depart="0"/></routes>',
        '<routes><vehicle id="ego" depart="0"><routeDistribution><route id="r" edges="a" probability="1"/>'
        '<route id="s" edges="b" probability="1"/></routeDistribution></vehicle></routes>',
    ],
)
def test_ways_that_can_be_others_are_not_claimed(tmp_path: Path, text: str) -> None:
    demand = demand_of(tmp_path, text, "ego")
    assert demand.found == {"ego"}
    assert not demand.routes


def test_nothing_is_claimed_where_vehicles_may_come_from_elsewhere(tmp_path: Path) -> None:
    for text in [
        '<routes><include href="b.rou.xml"/></routes>',
        '<additional><calibrator id="c" lane="a_0" pos="0"><flow begin="0" end="9" vehsPerHour="9"/></calibrator>'
        "</additional>",
        '<routes><person id="p" depart="0"><personTrip from="a" to="b" modes="car"/></person></routes>',
        '<routes><vType id="car" scale="2"/></routes>',
        "<routes><vehicle",
        '<?xml version="1.0" encoding="no-such"?><routes/>',
        "",
    ]:
        assert not demand_of(tmp_path, text, "ego").lacks("ego")
    for name in ("none.rou.xml", "$HOME/a.rou.xml", "x" * 5000, "."):
        assert not read_demand([tmp_path / name], ["ego"]).lacks("ego")


def test_packed_and_large_files(tmp_path: Path) -> None:
    file = tmp_path / "a.rou.xml.gz"
    file.write_bytes(gzip.compress(VEHICLES.encode()))
    demand = read_demand([file], ["ego", "egoo"])
    assert not demand.lacks("ego")
    assert demand.lacks("egoo")
    file.write_bytes(file.read_bytes()[:100])
    assert not read_demand([file], ["egoo"]).lacks("egoo")
    text = VEHICLES + " " * 300_000
    assert demand_of(tmp_path, text, "egoo", most_bytes=1_000_000).lacks("egoo")
    assert not demand_of(tmp_path, text, "egoo", most_bytes=100_000).lacks("egoo")


@pytest.mark.parametrize(
    ("option", "lacks", "routes"),
    [
        ("", True, 1),
        ('<load-state value="s.xml"/>', False, 0),
        ('<scale value="1.5"/>', False, 0),
        ("<seed v='3'/>", True, 1),
        ('<device.rerouting.probability value="1"/>', True, 0),
    ],
)
def test_vehicles_and_ways_of_a_configuration(tmp_path: Path, option: str, lacks: bool, routes: int) -> None:
    (tmp_path / "a.rou.xml").write_text(VEHICLES, encoding="utf-8")
    (tmp_path / "b.add.xml").write_text('<additional><vehicle id="late" depart="9"/></additional>', encoding="utf-8")
    config = tmp_path / "a.sumocfg"
    config.write_text(
        f'<configuration><net-file value="a.net.xml"/><route-files value="a.rou.xml"/><a v="b.add.xml"/>{option}'
        "</configuration>",
        encoding="utf-8",
    )
    demand = read_configured_demand(config, ["ego", "late", "egoo"])
    assert demand.lacks("egoo") is lacks
    assert not demand.lacks("ego")
    assert not demand.lacks("late")
    assert len(demand.routes) == routes


FLOWS = """<routes>
  <vTypeDistribution id="mix"><vType id="car" probability="3"/><vType id="truck" probability="1"/></vTypeDistribution>
  <flow id="a" type="mix" begin="0" end="60" vehsPerHour="400"/>
  <flow id="b" type="bus" begin="0" end="60" period="60"/>
  <flow id="c" type="bus" begin="0" end="60" period="exp(0.1)"/>
  <flow id="d" type="bus" begin="0" end="60" probability="0.01"/>
  <flow id="e" type="bus" begin="0" end="1800" number="10"/>
  <vehicle id="ego" depart="0"/>
</routes>"""


def test_rates_are_added_up_by_type(tmp_path: Path) -> None:
    (tmp_path / "my.rou.xml").write_text(FLOWS)
    found = read_flows([tmp_path / "my.rou.xml"])
    assert found.rates == pytest.approx({"car": 300.0, "truck": 100.0, "bus": 60.0 + 360.0 + 36.0 + 20.0})
    assert (found.flows, dict(found.single), found.is_whole) == (5, {"DEFAULT_VEHTYPE": 1.0}, True)
    assert not read_flows([tmp_path / "none.rou.xml"]).is_whole
