"""What a running simulation says of itself; a stand-in for it here."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fogsim.errors import InputError, SimulationError
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.sumo.loaded_files import (
    LoadedRoads,
    check_step_length,
    describe_seen,
    loaded_additional,
    loaded_net,
)
from tests.helpers.attached import GRID
from tests.traffic.common import configured


def simulation(step: float = 0.1, **options: str) -> Any:
    return SimpleNamespace(
        simulation=SimpleNamespace(getDeltaT=lambda: step, getOption=lambda name: options[name.replace("-", "_")])
    )


def test_the_most_similar_ids_are_named_first() -> None:
    seen = [f"veh{i}" for i in range(20)] + ["egon"]
    text = describe_seen("ego", seen)
    assert text.startswith("those that did: egon, ")
    assert text.endswith(" and 13 more")
    assert "no vehicle did" in describe_seen("ego", [])


def test_another_step_is_refused_but_not_the_rounding_of_sumos_clock() -> None:
    check_step_length(simulation(0.1), 0.1 + 1e-9)
    with pytest.raises(SimulationError, match=r"steps of 0\.1 s, but clocks\.traffic_step_s is 0\.05"):
        check_step_length(simulation(0.1), 0.05)


def test_files_that_are_here_are_found(tmp_path: Path) -> None:
    net = tmp_path / "a.net.xml"
    net.touch()
    api = simulation(net_file=str(net), additional_files=f"{net}, {tmp_path / 'none.xml'}")
    assert loaded_net(api) == net
    assert loaded_additional(api) == (net,)
    with pytest.raises(SimulationError, match="there is no such file"):
        loaded_net(simulation(net_file="nowhere.net.xml"))


def test_a_network_without_the_egos_way_is_refused() -> None:
    roads = LoadedRoads(GRID / "grid.net.xml", ())
    expected = r"grid\.net\.xml: the ego drives on edge 'A0B9', which this network does not have \(nearest: A0B0, "
    with pytest.raises(InputError, match=expected):
        roads.along(simulation(additional_files=""), ("A0B0", "A0B9"))


def test_names_of_files_may_have_environment_variables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOWN", str(tmp_path / "town"))
    net, signs = tmp_path / "town.net.xml", tmp_path / "town.add.xml"
    net.write_text("<net/>")
    signs.write_text("<additional/>")
    api = simulation(net_file="${TOWN}.net.xml", additional_files="${TOWN}.add.xml")
    assert (loaded_net(api), loaded_additional(api)) == (net, (signs,))
    config = configured(tmp_path, Path("${TOWN}.net.xml"), "<routes/>", additional="${TOWN}.add.xml")
    assert configured_files(config) == (net, (signs,))
