from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.traffic.network import read_net, road_network, sign_map
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


def test_signs_stand_where_limits_change_and_where_pois_say() -> None:
    signs = {sign.sign_id: sign for sign in sign_map(read_net(NET), [FOLDER / "signs.add.xml"]).signs}
    assert {"limit.approach", "limit.bank", "limit.exit", "limit.opposite", "bank.600"} <= set(signs)
    assert signs["limit.bank"].value == pytest.approx(110 / 3.6, abs=0.01)
    assert signs["bank.600"].value == pytest.approx(110 / 3.6)


def test_a_sign_stands_to_the_right_of_the_outermost_lane() -> None:
    net = read_net(NET)
    lane = next(lane for lane in road_network(net, ["bank"]).lanes if lane.lane_id == "bank_0")
    sign = next(s for s in sign_map(net, []).signs if s.sign_id == "limit.bank")
    offset = np.array(sign.position[:2]) - lane.centreline[0, :2]
    along = np.array([np.cos(sign.heading), np.sin(sign.heading)])
    assert offset @ along == pytest.approx(10.0, abs=0.1)
    assert along[0] * offset[1] - along[1] * offset[0] == pytest.approx(-(3.75 / 2 + 3.9), abs=0.1)


def test_what_is_no_network(tmp_path: Path) -> None:
    file = tmp_path / "broken.net.xml"
    file.write_text("<net><edge", encoding="utf-8")
    with pytest.raises(InputError, match="not a SUMO network"):
        read_net(file)
    file.write_text('<net version="1.20"></net>', encoding="utf-8")
    with pytest.raises(InputError, match="has no edges"):
        read_net(file)


@pytest.mark.parametrize(
    ("poi", "message"),
    [
        ('<poi id="p" type="fogsim.sign.speed_limit" x="1" y="2" angle="90"/>', "needs <param"),
        ('<poi id="p" type="fogsim.sign.stop" x="1" y="2"><param key="value" value="3"/></poi>', "needs numbers"),
    ],
)
def test_signs_that_say_nothing(tmp_path: Path, poi: str, message: str) -> None:
    file = tmp_path / "signs.add.xml"
    file.write_text(f"<additional>{poi}</additional>", encoding="utf-8")
    with pytest.raises(InputError, match=f"poi 'p'.*{message}"):
        sign_map(read_net(NET), [file])
