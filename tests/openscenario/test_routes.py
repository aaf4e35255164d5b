"""Routes of vehicles and positions on them, on a road that forks after 100 m: straight on, or to the left."""

from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.openscenario import read_openscenario
from tests.openscenario.writing import CAR, DATA, HEADER, after, event, first_step, motion, run, speed, write

FORK = DATA / "fork.xodr"


def _on(road: int, s: float) -> str:
    return f'<Position><LanePosition roadId="{road}" laneId="-1" s="{s}"/></Position>'


def _route(*places: str, strategy: str = "shortest", closed: str = "false") -> str:
    points = "".join(f'<Waypoint routeStrategy="{strategy}">{place}</Waypoint>' for place in places)
    return f'<Route name="r" closed="{closed}">{points}</Route>'


def _routing(inner: str, tag: str = "AssignRouteAction") -> str:
    return f"<PrivateAction><RoutingAction><{tag}>{inner}</{tag}></RoutingAction></PrivateAction>"


def _on_route(route: str, along: float) -> str:
    return (
        f"<Position><RoutePosition><RouteRef>{route}</RouteRef><InRoutePosition>"
        f'<FromLaneCoordinates pathS="{along}" laneId="-1"/></InRoutePosition></RoutePosition></Position>'
    )


NORTH, EAST = _route(_on(1, 20), _on(3, 50)), _route(_on(1, 20), _on(2, 50))
NAMED = NORTH.replace('"r"', '"to the north"')
CATALOG = f'{HEADER}<Catalog name="Ways">{NAMED}</Catalog></OpenSCENARIO>'
FROM_CATALOG = '<CatalogReference catalogName="Ways" entryName="to the north"/>'


@pytest.mark.parametrize(
    ("routing", "ends_north"),
    [
        ("", False),
        (_routing(NORTH), True),
        (_routing(EAST), False),
        (_routing(FROM_CATALOG), True),
        (_routing(_on(3, 50), "AcquirePositionAction"), True),
    ],
)
def test_vehicles_drive_their_routes(tmp_path: Path, routing: str, ends_north: bool) -> None:
    (tmp_path / "ways.xosc").write_text(CATALOG, encoding="utf-8")
    begin = "\n".join(filter(None, [_on(1, 30), routing, speed(10)]))
    file = write(tmp_path, {"Ego": CAR}, {"Ego": begin}, stop=after(15), visibility=5000.0, road=FORK)
    steps = run(file)
    places = np.array([step.traffic.position[step.ego, :2] for step in steps])
    # At 10 m/s for 15 s from 33.7 m on: to 183.7 m, of which the left arc takes 21.75 m · π/2 = 34.2 m.
    expected = (121.75, 20.0 + 183.7 - 100.0 - 34.2) if ends_north else (183.7, -1.75)
    assert places[-1] == pytest.approx(expected, abs=2.0)
    assert np.all(np.hypot(*np.diff(places, axis=0).T) < 1.2)


@pytest.mark.parametrize("routing", [_routing(NORTH), _routing(_on(3, 50), "AcquirePositionAction")])
def test_routes_change_while_vehicles_drive(tmp_path: Path, routing: str) -> None:
    begin = {"Ego": f"{_on(2, 40)}\n{speed(1)}", "Other": f"{_on(1, 30)}\n{speed(10)}"}
    story = {"Other": event("turn", routing, after(2.0))}
    file = write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, story, stop=after(15), visibility=5000.0, road=FORK)
    assert motion(run(file)[-1], "Other")[:2] == pytest.approx((121.75, 20.0 + 183.7 - 100.0 - 34.2), abs=2.0)


def test_the_egos_route_is_known_from_the_beginning(tmp_path: Path) -> None:
    story = {"Ego": event("turn", _routing(NORTH), after(2.0))}
    file = write(tmp_path, {"Ego": CAR}, {"Ego": _on(1, 30)}, story, road=FORK)
    with pytest.raises(InputError, match="AssignRouteAction: the ego's route, along which positions count"):
        read_openscenario(file)


def test_positions_on_a_route_and_conditions_count_the_junction(tmp_path: Path) -> None:
    # From the first waypoint 80 m to the road's end, 35.1 across the junction, and 40 m up the road to the north.
    begin = {"Ego": f"{_on(1, 30)}\n{_routing(NORTH)}\n{speed(10)}", "Other": _on_route(NORTH, 155.1)}
    file = write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, visibility=5000.0, road=FORK)
    assert motion(first_step(file), "Other")[:2] == pytest.approx((121.75, 20.0 + 40.0 + 3.7), abs=0.3)
    begin["Other"] = _on_route(NORTH, 100.0)
    with pytest.raises(InputError, match="RoutePosition: 100 m from there is inside a junction"):
        read_openscenario(write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, road=FORK))


def test_what_cannot_be_driven_is_refused(tmp_path: Path) -> None:
    for routing, told in [
        (_routing(_route(_on(3, 20), _on(2, 50))), "no way leads from lanes 3_-1 to lanes 2_-1"),
        (_routing(_route(_on(1, 20), _on(1, 10))), "a waypoint lies behind the one before"),
        (_routing(_route(_on(1, 20), _on(3, 10), strategy="random")), "routeStrategy: FogSim has no 'random' here"),
        (_routing(_route(_on(1, 20), _on(3, 10), closed="true")), "closed: write the waypoints of each lap"),
        (_routing("<Route/>"), "expected Waypoint inside"),
        (_routing(_route(_on(1, 20), _on_route(NORTH, 10.0))), "a waypoint needs an absolute position"),
        (_routing("<TrajectoryRef/>", "FollowTrajectoryAction"), "expected Trajectory or CatalogReference inside"),
        (_routing(FROM_CATALOG), "there is no catalog 'Ways'"),
    ]:
        file = write(tmp_path, {"Ego": CAR}, {"Ego": f"{_on(1, 30)}\n{routing}"}, road=FORK)
        with pytest.raises(InputError, match=rf"RoutingAction/.*{told}"):
            read_openscenario(file)


def _exit_road() -> str:
    """The fork with a second lane on the right, which alone leads to the right, along an arc to the south."""
    roads = FORK.read_text(encoding="utf-8").split("<road ")
    for number in (1, 3, 5):
        lane = roads[number].split("<right>")[1].split("</right>")[0]
        second = lane.replace('"-1"', '"-2"')
        first = lane.replace("driving", "none") if number == 5 else lane
        roads[number] = roads[number].replace(lane, f"{first}{second}")
    south = 'y="-20" hdg="-1.5707963267948966"'
    roads[3] = roads[3].replace('y="20" hdg="1.5707963267948966"', south)
    roads[5] = roads[5].replace('curvature="0.05"', 'curvature="-0.05"')
    text = "<road ".join(roads)
    return text.replace(
        'contactPoint="start"><laneLink from="-1" to="-1"/></connection>\n</junction>',
        'contactPoint="start"><laneLink from="-2" to="-2"/></connection>\n</junction>',
    )


def test_vehicles_without_a_route_go_where_their_lane_leads(tmp_path: Path) -> None:
    (road := tmp_path / "exit.xodr").write_text(_exit_road(), encoding="utf-8")
    exits = _on(1, 30).replace('"-1"', '"-2"')
    ahead = '<Position><RelativeLanePosition entityRef="Other" dLane="0" dsLane="200"/></Position>'
    begin = {"Ego": f"{_on(1, 30)}\n{speed(10)}", "Other": f"{exits}\n{speed(10)}", "Ahead": ahead}
    steps = run(write(tmp_path, dict.fromkeys(begin, CAR), begin, stop=after(12), visibility=5000.0, road=road))
    assert motion(steps[-1], "Ego")[:2] == pytest.approx((153.7, -1.75), abs=2.0)
    # From 33.7 m on it is 66.3 m to the junction and 23.8 m across it; all else is driven to the south.
    assert motion(steps[-1], "Other")[:2] == pytest.approx((114.75, -20.0 - 120.0 + 66.3 + 23.8), abs=1.0)
    assert motion(steps[-1], "Ahead")[:2] == pytest.approx((114.75, -20.0 - 200.0 + 66.3 + 23.8), abs=0.1)
