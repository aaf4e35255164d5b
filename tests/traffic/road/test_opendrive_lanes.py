"""Networks of OpenDRIVE files, and places on their lanes."""

import math
from pathlib import Path

import pytest

from fogsim.errors import InputError, MissingDependencyError
from fogsim.traffic.road import netconvert
from fogsim.traffic.road.netconvert import opendrive_net
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, read_opendrive_lanes

ROAD = Path(__file__).parents[2] / "data" / "openscenario" / "two_lanes.xodr"
RADIUS = 1200.0


@pytest.fixture(scope="module")
def lanes() -> OpenDriveLanes:
    return read_opendrive_lanes(opendrive_net(ROAD), ROAD)


def test_lanes_limits_and_the_place_on_earth(lanes: OpenDriveLanes) -> None:
    assert sorted((one.edge, one.index, one.origins) for one in lanes.lanes) == [
        ("-7", 0, ("7_-2",)), ("-7", 1, ("7_-1",)), ("7", 0, ("7_2",)), ("7", 1, ("7_1",)),
    ]  # fmt: skip
    assert [one.limit for one in lanes.lanes] == pytest.approx([130 / 3.6] * 4, abs=0.01)
    assert lanes.latitude == pytest.approx(math.radians(48.2))


@pytest.mark.parametrize(("lane", "aside", "way"), [("-1", -1.75, 0.0), ("-2", -5.25, 0.0), ("1", 1.75, math.pi)])
def test_places_on_lanes_are_where_the_road_has_them(
    lanes: OpenDriveLanes, lane: str, aside: float, way: float
) -> None:
    for s in (60.0, 499.0, 700.0, 899.0):
        turned = max(s - 500.0, 0.0) / RADIUS
        x = 100.0 + min(s, 500.0) + RADIUS * math.sin(turned) - aside * math.sin(turned)
        y = -20.0 + RADIUS * (1.0 - math.cos(turned)) + aside * math.cos(turned)
        found = lanes.on_lane("7", lane, s).world
        assert found[:2] == pytest.approx((x, y), abs=0.05)
        assert math.cos(found[2] - turned - way) == pytest.approx(1.0, abs=1e-4)
        assert lanes.at(x, y, found[2]).lane.origins == (f"7_{lane}",)
        assert lanes.at(*lanes.across("7", s, aside)).lane.origins == (f"7_{lane}",)


def test_places_beside_and_along(lanes: OpenDriveLanes) -> None:
    begin = lanes.on_lane("7", "-2", 100.0)
    assert lanes.beside(begin, 1).lane.origins == ("7_-1",)
    assert lanes.along(begin, 50.0).world[0] == pytest.approx(250.0, abs=0.1)
    assert lanes.route("-7") == ("-7",)
    for wrong, told in (
        (lambda: lanes.beside(begin, 2), "no lane 2 to the left"),
        (lambda: lanes.along(begin, 900.0), "the road ends before that"),
        (lambda: lanes.along(begin, -101.0), "the road begins before that"),
        (lambda: lanes.on_lane("7", "-3", 5.0), "has no lane '-3' to drive on; it has -1, -2, 1, 2"),
        (lambda: lanes.on_lane("7", "-1", 950.0), "expected s on the road"),
    ):
        with pytest.raises(ValueError, match=told):
            wrong()


@pytest.mark.parametrize(("lane", "begin", "ds"), [("-2", 550.0, 300.0), ("2", 550.0, 300.0), ("-1", 820.0, -700.0)])
def test_places_farther_along_a_road_count_along_its_reference_line(
    lanes: OpenDriveLanes, lane: str, begin: float, ds: float
) -> None:
    found = lanes.farther(lanes.on_lane("7", lane, begin), ds)
    assert found.world[:2] == pytest.approx(lanes.on_lane("7", lane, begin + ds).world[:2], abs=0.02)
    for beyond in (1000.0, -1000.0):
        with pytest.raises(ValueError, match=r"the road (ends|begins) before that"):
            lanes.farther(found, beyond)


def test_what_says_nothing_stops_no_conversion(tmp_path: Path) -> None:
    text = ROAD.read_text(encoding="utf-8")
    file = tmp_path / "empty.xodr"
    signal = '<signal s="100" t="-5" id="" type="" dynamic="" orientation=""/>'
    changed = text.replace("<signals>", f"<signals>{signal}").replace("<width", '<speed sOffset="0" max=""/><width')
    file.write_text(changed, encoding="utf-8")
    assert opendrive_net(file) == opendrive_net(ROAD)


@pytest.mark.parametrize("change", [0.0, -7e-17])
def test_a_spiral_whose_curvature_hardly_changes_is_an_arc(tmp_path: Path, change: float) -> None:
    """netconvert takes all memory for it, or is metres off."""
    curvature, file = 0.000833333333, tmp_path / "spiral.xodr"
    spiral = f'<spiral curvStart="{curvature!r}" curvEnd="{curvature + change!r}"/>'
    text = ROAD.read_text(encoding="utf-8").replace(f'<arc curvature="{curvature!r}"/>', spiral)
    assert spiral in text
    file.write_text(text, encoding="utf-8")
    assert opendrive_net(file) == opendrive_net(ROAD)


def test_places_on_a_hill_are_where_sumo_has_them(tmp_path: Path) -> None:
    """SUMO counts along the slope."""
    net, length = tmp_path / "hill.net.xml", 400.0 + 500.0
    lane = f'<lane id="up_0" index="0" speed="20" length="{length}" shape="0,0,0 400,0,0 800,0,300"/>'
    net.write_text(f'<net><location netOffset="0,0"/><edge id="up">{lane}</edge></net>', encoding="utf-8")
    spot = read_opendrive_lanes("", net).at(600.0, -1.0, None)
    assert (spot.position, spot.offset, spot.height) == pytest.approx((650.0, -1.0, 150.0))
    assert spot.world == pytest.approx((600.0, -1.0, 0.0))


def test_what_is_no_road_and_traffic_on_the_left_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.xodr"
    left = ROAD.read_text(encoding="utf-8").replace('rule="RHT"', 'rule="LHT"')
    for text, told in (("<OpenDRIVE><header/></OpenDRIVE>", ""), (left, "road '7': rule=\"LHT\": expected right-hand")):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=rf"bad\.xodr: {told}"):
            read_opendrive_lanes(opendrive_net(file), file)


def test_a_closed_road_is_driven_round_and_round(tmp_path: Path) -> None:
    length = 2.0 * math.pi * 100.0 / 3.0
    roads = [
        f'<road length="{length:.6f}" id="{i + 1}" junction="-1"><link>'
        f'<predecessor elementType="road" elementId="{(i - 1) % 3 + 1}" contactPoint="end"/>'
        f'<successor elementType="road" elementId="{(i + 1) % 3 + 1}" contactPoint="start"/></link><planView>'
        f'<geometry s="0" x="{100 * math.cos(i * length / 100):.6f}" y="{100 * math.sin(i * length / 100):.6f}" '
        f'hdg="{i * length / 100 + math.pi / 2:.9f}" length="{length:.6f}"><arc curvature="0.01"/></geometry>'
        '</planView><lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>'
        '<lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link>'
        '<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>'
        "</laneSection></lanes></road>"
        for i in range(3)
    ]
    file = tmp_path / "ring.xodr"
    file.write_text(f'<OpenDRIVE><header revMajor="1" revMinor="6"/>{"".join(roads)}</OpenDRIVE>', encoding="utf-8")
    lanes = read_opendrive_lanes(opendrive_net(file), file)
    route = lanes.route("-2")
    assert route[:5] == ("-2", "-3", "-1", "-2", "-3")
    assert sum(next(one.length for one in lanes.lanes if one.edge == edge) for edge in route) > 9_000.0


def test_without_netconvert_it_is_told_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(netconvert.shutil, "which", lambda *_, **__: None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'fogsim\[xodr\]'"):
        opendrive_net(ROAD)


def test_of_roads_on_top_of_one_another_the_height_or_the_road_decides(tmp_path: Path) -> None:
    lane = '<lane id="{0}_0" index="0" speed="20" length="100" shape="0,{1},{2} 100,{1},{3}">{4}</lane>'
    origin = '<param key="origId" value="9_-1"/>'
    levels = lane.format("street", 0, 0, 1, ""), lane.format("bridge", 0.5, 6, 8, origin)
    edges = (f'<edge id="{name}">{one}</edge>' for name, one in zip(("street", "bridge"), levels, strict=True))
    net = tmp_path / "two_levels.net.xml"
    net.write_text(f'<net><location netOffset="0,0"/>{"".join(edges)}</net>', encoding="utf-8")
    lanes = read_opendrive_lanes("", net)
    found = [lanes.at(50.0, 0.1, None, *where).lane.edge for where in (("", 0.0), ("", 6.0), ("", 99.0), ("9", None))]
    assert found == ["street", "bridge", "bridge", "bridge"]
    assert lanes.at(50.0, 0.1, None, "9").height == pytest.approx(7.0)
    assert lanes.at(50.0, -1.4, None).lane.edge == "street"
    with pytest.raises(ValueError, match=r"are roads 0\.5 m and 7\.0 m high; give z"):
        lanes.at(50.0, 0.1, None)


@pytest.mark.parametrize(
    ("written", "limits"),
    [
        ('<type s="0" type="town"><speed max="30" unit="mph"/></type>', {0.0: 13.4112}),
        ('<type s="0" type="town"><speed max="15"/></type><type s="500" type="rural"/>', {0.0: 15.0, 500.0: 130 / 3.6}),
        ('<type s="0" type="motorway"><speed max="no limit"/></type>', {0.0: 130 / 3.6}),
        ('<type s="200" type="town"><speed max="36" unit="km/h"/></type>', {0.0: 130 / 3.6, 200.0: 10.0}),
    ],
)
def test_lanes_without_limits_have_those_of_their_road(
    tmp_path: Path, written: str, limits: dict[float, float]
) -> None:
    text = (ROAD.parent / "cases" / "road.xodr").read_text(encoding="utf-8")
    file = tmp_path / "limits.xodr"
    file.write_text(text.replace("<planView>", f"{written}<planView>"), encoding="utf-8")
    lanes = read_opendrive_lanes(opendrive_net(file), file)
    found = {round(float(one.shape[0, 0])): one.limit for one in lanes.lanes if one.origins == ("7_-1",)}
    assert found == pytest.approx(limits, abs=0.01)


@pytest.mark.parametrize("most", ["no limit", "-1", "0"])
def test_limits_of_lanes_that_say_nothing_are_those_of_the_road(tmp_path: Path, most: str) -> None:
    text, file = (ROAD.parent / "cases" / "road.xodr").read_text(encoding="utf-8"), tmp_path / "limits.xodr"
    road = '<type s="0" type="town"><speed max="10"/></type><planView>'
    lane = f'<speed sOffset="0" max="{most}"/><width'
    file.write_text(text.replace("<planView>", road).replace("<width", lane), encoding="utf-8")
    assert {one.limit for one in read_opendrive_lanes(opendrive_net(file), file).lanes} == {10.0}


def test_places_of_limits_are_numbers(tmp_path: Path) -> None:
    text, file = (ROAD.parent / "cases" / "road.xodr").read_text(encoding="utf-8"), tmp_path / "limits.xodr"
    file.write_text(text.replace("<planView>", '<type s="here" type="town"/><planView>'), encoding="utf-8")
    with pytest.raises(InputError, match=r"limits\.xodr: road '7': <type>: s must be a number"):
        opendrive_net(file)


def test_a_limit_of_a_lane_counts_more_than_that_of_its_road(tmp_path: Path) -> None:
    text, file = ROAD.read_text(encoding="utf-8"), tmp_path / "limits.xodr"
    road = '<type s="0" type="town"><speed max="10"/></type><planView>'
    lane = '<speed sOffset="0" max="20" unit="m/s"/><width'
    file.write_text(text.replace("<planView>", road).replace("<width", lane, 1), encoding="utf-8")
    assert sorted(one.limit for one in read_opendrive_lanes(opendrive_net(file), file).lanes) == [10.0] * 3 + [20.0]


def test_lanes_may_have_borders_in_place_of_widths(tmp_path: Path) -> None:
    beyond = '<lane id="-2" type="shoulder"><border sOffset="0" a="-5.5" b="0" c="0" d="0"/></lane>'
    text, file = (ROAD.parent / "cases" / "road.xodr").read_text(encoding="utf-8"), tmp_path / "borders.xodr"
    file.write_text(text.replace("</right>", f"{beyond}</right>"), encoding="utf-8")
    lanes = read_opendrive_lanes(opendrive_net(file), file)
    assert lanes.middle("7", "-2", 50.0) == pytest.approx(-4.5)
    assert lanes.middle("7", "-1", 50.0) == pytest.approx(-1.75)


def test_networks_of_left_hand_traffic_are_refused_and_repeated_points_do_no_harm(tmp_path: Path) -> None:
    lane = '<edge id="e{0}"><lane id="e{0}_0" index="0" speed="20" length="{1}" shape="{2}"/></edge>'
    edges = lane.format(1, 100, "0,0 50,0 50,0 100,0"), lane.format(2, 0.1, "100,0 100,0")
    net = tmp_path / "points.net.xml"
    net.write_text(f"<net>{''.join(edges)}</net>", encoding="utf-8")
    lanes = read_opendrive_lanes("", net)
    assert lanes.at(70.0, 1.0, 0.0).world == pytest.approx((70.0, 1.0, 0.0))
    assert lanes.nearest(200.0, 50.0) is None
    net.write_text(f'<net lefthand="0">{edges[0]}</net>', encoding="utf-8")
    assert read_opendrive_lanes("", net).at(70.0, 1.0, 0.0).world == pytest.approx((70.0, 1.0, 0.0))
    net.write_text(f'<net lefthand="1">{edges[0]}</net>', encoding="utf-8")
    with pytest.raises(InputError, match=r"points\.net\.xml: lefthand: expected a network of right-hand traffic"):
        read_opendrive_lanes("", net)
