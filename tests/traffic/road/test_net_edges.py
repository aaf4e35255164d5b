import itertools
from pathlib import Path

import pytest

from fogsim.traffic.road.network import read_net, read_net_edges, road_network
from tests.traffic.common import NET

ROUTE = ["approach", "bank", "exit"]


def test_lanes_of_the_edges_and_length_of_a_route() -> None:
    edges = read_net_edges(NET, ROUTE)
    assert edges is not None
    assert edges.lanes == {"approach": 3, "bank": 3, "exit": 3, "opposite": 3}
    axis = road_network(read_net(NET), ROUTE).route
    length = sum(float(((b - a) ** 2).sum() ** 0.5) for a, b in itertools.pairwise(axis))
    assert edges.route_length(ROUTE) == pytest.approx(length, abs=1e-6)


def test_what_is_too_large_or_no_network_is_not_listed(tmp_path: Path) -> None:
    assert read_net_edges(NET, ROUTE, most_bytes=1000) is None
    for text in ("<net", "<net/>", '<net><edge id="a"><lane shape="0,zero"/></edge></net>', ""):
        file = tmp_path / "a.net.xml"
        file.write_text(text, encoding="utf-8")
        assert read_net_edges(file, ["a"]) is None
    assert read_net_edges(tmp_path / "none.net.xml", ["a"]) is None
