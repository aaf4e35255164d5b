from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.traffic.road.network import read_net, road_network
from fogsim.traffic.road.signs import geographic_position, sign_map
from tests.traffic.common import MOTORWAY, NET

ONE_EDGE = """<net version="1.20">{location}
<edge id="e" from="a" to="b" priority="1">
<lane id="e_0" index="0" speed="30" length="100" shape="0,0 100,0"/></edge>
<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-1"/>
<junction id="b" type="dead_end" x="100" y="0" incLanes="e_0" intLanes="" shape="100,0 100,-1"/></net>"""


def additional(folder: Path, content: str) -> Path:
    file = folder / "signs.add.xml"
    file.write_text(f"<additional>{content}</additional>", encoding="utf-8")
    return file


def test_signs_stand_where_limits_change_and_where_pois_say() -> None:
    signs = {sign.sign_id: sign for sign in sign_map(read_net(NET), [MOTORWAY / "signs.add.xml"]).signs}
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


def test_a_polygon_is_a_sign_in_its_middle(tmp_path: Path) -> None:
    file = additional(
        tmp_path,
        '<poly id="p" type="fogsim.sign.speed_limit" shape="0,0 2,0 2,1 0,1" angle="90">'
        '<param key="value" value="72"/><param key="diameter" value="0.6"/></poly>'
        '<poly id="house" type="building" shape="0,0 2,0 2,1"/><poi id="tree" type="tree" x="1" y="2"/>',
    )
    sign = sign_map(read_net(NET), [file]).signs[-1]
    assert (sign.sign_id, sign.kind, sign.diameter) == ("p", "speed_limit", 0.6)
    assert sign.value == pytest.approx(20.0)
    assert sign.position[:2] == (1.0, 0.5)
    assert sign.heading == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ('<poi id="p" type="fogsim.sign.speed_limit" x="1" y="2" angle="90"/>', "poi 'p'.*<param"),
        (
            '<poi id="p" type="fogsim.sign.stop" x="1" y="2"><param key="value" value="3"/></poi>',
            "poi 'p'.*angle must be a number",
        ),
        (
            '<poly id="q" type="fogsim.sign.stop" angle="9" shape=""><param key="value" value="3"/></poly>',
            "poly 'q'.*expected a shape",
        ),
        ("<poi", "not XML"),
    ],
)
def test_signs_that_say_nothing(tmp_path: Path, shape: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        sign_map(read_net(NET), [additional(tmp_path, shape)])


def test_signals_of_an_opendrive_file_are_moved_as_the_net_was(tmp_path: Path) -> None:
    net = tmp_path / "one.net.xml"
    location = '<location netOffset="500.00,-30.00" convBoundary="0,0,1,1" origBoundary="0,0,1,1" projParameter="!"/>'
    net.write_text(ONE_EDGE.format(location=location), encoding="utf-8")
    roads = tmp_path / "roads.xodr"
    roads.write_text(
        '<OpenDRIVE><road id="1" length="50"><planView><geometry s="0" x="0" y="0" hdg="0" length="50"><line/>'
        '</geometry></planView><signals><signal id="9" s="20" t="-5" type="274" value="50"/></signals></road>'
        "</OpenDRIVE>",
        encoding="utf-8",
    )
    sign = sign_map(read_net(net), [roads]).signs[-1]
    assert sign.position[:2] == pytest.approx((520.0, -35.0))
    assert geographic_position(read_net(net)) is None
    net.write_text(ONE_EDGE.format(location=""), encoding="utf-8")  # which says nothing about where it is
    assert geographic_position(read_net(net)) is None
    assert [sign.sign_id for sign in sign_map(read_net(net), []).signs] == ["limit.e"]


def test_a_sign_over_a_lane_hangs_high_and_all_stand_at_the_height_of_their_road(tmp_path: Path) -> None:
    net = tmp_path / "hill.net.xml"
    net.write_text(ONE_EDGE.format(location="").replace('"0,0 100,0"/', '"0,0,5 100,0,15"/'), encoding="utf-8")
    value = '<param key="value" value="72"/>'
    file = additional(
        tmp_path,
        f'<poi id="beside" type="fogsim.sign.stop" x="50" y="-8" angle="90">{value}</poi>'
        f'<poi id="over" type="fogsim.sign.variable_speed_limit" x="50" y="0.5" angle="90">{value}</poi>'
        f'<poi id="low" type="fogsim.sign.stop" x="0" y="-8" angle="90">{value}<param key="height" value="1.5"/></poi>',
    )
    signs = {sign.sign_id: sign for sign in sign_map(read_net(net), [file]).signs}
    assert signs["beside"].position[2] == pytest.approx(10 + 2.6)
    assert signs["over"].position[2] == pytest.approx(10 + 6.2)
    assert signs["low"].position[2] == pytest.approx(5 + 1.5)
    assert signs["over"].value == pytest.approx(20.0)
    assert signs["beside"].value == 72.0


def test_in_a_network_of_footways_alone_signs_stand_at_their_height(tmp_path: Path) -> None:
    net = tmp_path / "path.net.xml"
    path = ONE_EDGE.format(location="").replace('"0,0 100,0"/', '"0,0,5 100,0,15" allow="pedestrian"/')
    net.write_text(path, encoding="utf-8")
    shape = '<poi id="s" type="fogsim.sign.stop" x="50" y="-8" angle="90"/>'
    (sign,) = sign_map(read_net(net), [additional(tmp_path, shape)]).signs
    assert sign.position[2] == pytest.approx(10 + 2.6)
