from pathlib import Path

import pytest

from fogsim.traffic.road import map_cache
from fogsim.traffic.road.map_cache import RoadMap
from fogsim.traffic.road.network import read_net
from tests.traffic.common import DATA, NET, networks_parsed

GRID = DATA / "grid" / "grid.net.xml"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of its own, for networks of any size."""
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(map_cache, "_WORTHWHILE", 0)
    return tmp_path / "cache" / "networks"


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    return networks_parsed(monkeypatch)


def told(roads: RoadMap) -> list[object]:
    """All that a map says, to be compared."""
    lanes = [(lane.lane_id, lane.edge_id, lane.width, lane.speed_limit, lane.outermost) for lane in roads.lanes]
    painted = [(lane.left, lane.right, lane.kind, lane.end, lane.centreline.tolist()) for lane in roads.lanes]
    areas = [(area.area_id, area.kind, area.outline.tolist()) for area in roads.areas]
    chosen = [roads.drawn.tolist(), roads.between.tolist()]
    return [roads.edges, lanes, painted, areas, chosen, roads.limit_signs, roads.location]


@pytest.mark.parametrize("net", [GRID, NET])
@pytest.mark.usefixtures("cache")
def test_a_network_is_parsed_once_and_comes_back_as_it_was(net: Path, parsed: list[Path]) -> None:
    first, second = read_net(net), read_net(net)
    assert parsed == [net]
    assert told(first) == told(second)
    # Types as well: identity of markings and plain numbers, which dictionaries and texts show.
    assert repr(first.lanes[0]) == repr(second.lanes[0])


def test_what_another_version_has_kept_is_parsed_anew(
    cache: Path, parsed: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    read_net(GRID)
    monkeypatch.setattr(map_cache, "_version", lambda: b"another version of FogSim")
    read_net(GRID)
    assert len(parsed) == 2
    assert len(list(cache.iterdir())) == 2


def test_a_cache_that_cannot_be_written_is_done_without(cache: Path, parsed: list[Path]) -> None:
    cache.parent.parent.mkdir(exist_ok=True)
    cache.parent.write_text("a file where the folder should be", encoding="utf-8")
    assert read_net(GRID).lanes
    assert read_net(GRID).lanes
    assert len(parsed) == 2


def test_a_changed_network_is_another_and_the_oldest_maps_go(
    cache: Path, parsed: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(map_cache, "_MOST_FILES", 2)
    net, text = tmp_path / "net.net.xml", NET.read_text(encoding="utf-8")
    for number in range(4):
        net.write_text(f"{text}<!-- {number} -->", encoding="utf-8")
        read_net(net)
    assert len(parsed) == 4
    assert len(list(cache.iterdir())) == 2


def test_where_the_cache_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("FOGSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert map_cache.cache_directory() == tmp_path / "fogsim"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert map_cache.cache_directory().name == "fogsim"
