"""Rates of flows as SUMO's route files write them."""

from pathlib import Path

import pytest

from fogsim.traffic.road.demand import read_flows

ROUTES = """<routes>
  <vTypeDistribution id="mix"><vType id="car" probability="3"/><vType id="truck" probability="1"/></vTypeDistribution>
  <flow id="a" type="mix" begin="0" end="60" vehsPerHour="400"/>
  <flow id="b" type="bus" begin="0" end="60" period="60"/>
  <flow id="c" type="bus" begin="0" end="60" period="exp(0.1)"/>
  <flow id="d" type="bus" begin="0" end="60" probability="0.01"/>
  <flow id="e" type="bus" begin="0" end="1800" number="10"/>
  <vehicle id="ego" depart="0"/>
</routes>"""


def test_rates_are_added_up_by_type(tmp_path: Path) -> None:
    (tmp_path / "my.rou.xml").write_text(ROUTES)
    found = read_flows([tmp_path / "my.rou.xml"])
    assert found.rates == pytest.approx({"car": 300.0, "truck": 100.0, "bus": 60.0 + 360.0 + 36.0 + 20.0})
    assert (found.flows, dict(found.single), found.is_whole) == (5, {"DEFAULT_VEHTYPE": 1.0}, True)


def test_a_missing_file_leaves_the_demand_incomplete(tmp_path: Path) -> None:
    assert not read_flows([tmp_path / "none.rou.xml"]).is_whole
