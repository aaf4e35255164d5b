from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.traffic.network import read_net, road_network
from fogsim.values import LaneMarking

FOLDER = Path(__file__).resolve().parents[2] / "scenarios" / "motorway_fog_bank"
NET = FOLDER / "motorway.net.xml"


def test_lanes_of_the_motorway() -> None:
    network = road_network(read_net(NET), ["approach", "bank", "exit"])
    lanes = {lane.lane_id: lane for lane in network.lanes}
    right, middle, left = (lanes[f"bank_{i}"] for i in range(3))
    assert (right.right, right.left) == (LaneMarking.SOLID, LaneMarking.DASHED)
    assert (middle.right, middle.left) == (LaneMarking.DASHED, LaneMarking.DASHED)
    assert (left.right, left.left) == (LaneMarking.DASHED, LaneMarking.SOLID)
    assert right.outermost
    assert not middle.outermost
    assert right.speed_limit == pytest.approx(110 / 3.6, abs=0.01)
    assert np.linalg.norm(right.centreline[0] - middle.centreline[0]) == pytest.approx(3.75, abs=0.02)


def test_the_route_runs_along_the_middle_lanes_without_jumps() -> None:
    route = road_network(read_net(NET), ["approach", "bank", "exit"]).route
    steps = np.linalg.norm(np.diff(route, axis=0), axis=1)
    assert steps.sum() == pytest.approx(5500.0, rel=0.005)
    assert steps.min() > 0
    assert steps.max() < 25.0


def test_what_is_no_network(tmp_path: Path) -> None:
    file = tmp_path / "broken.net.xml"
    file.write_text("<net><edge", encoding="utf-8")
    with pytest.raises(InputError, match="not a SUMO network"):
        read_net(file)
    file.write_text('<net version="1.20"></net>', encoding="utf-8")
    with pytest.raises(InputError, match="has no edges"):
        read_net(file)
