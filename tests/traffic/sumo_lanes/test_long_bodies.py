"""Bodies longer than 15 m: their pieces lie on the lanes, they are drawn and seen there, and crossings are closed."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import fogsim
from fogsim.scenario import scenario_from_config
from fogsim.scenario.build import traffic_setup
from fogsim.traffic import DriverSight
from fogsim.traffic.drivers.sight_kernels import LINE
from fogsim.traffic.road.network import read_net
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.vehicle_reader import VehicleReader
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, VehicleSight
from fogsim.traffic.sumo_lanes.long_bodies import LONGEST_RIGID, LongBodies, sections
from fogsim.traffic.sumo_lanes.street import LightsAhead
from fogsim.values import Command, Lamp, SignalColour, TrafficState
from fogsim.values.command import EgoControl
from fogsim.values.scene import Instance
from fogsim.values.traffic import with_pieces
from tests.traffic.common import DATA, QUIET, configured, driven, even, hits_of, running

CASES = DATA / "sumo_cases"
RAILS = CASES / "rails.sumocfg"
ROAD = ("e0_0", ":r1_2_0", "e1_0", ":b_0_0", "e2_0")
TRACK = ("t0_0", ":r1_1_0", "t1_0")
DEMAND = """<routes><route id="r" edges="e1 e2"/>
 <vType id="semi" vClass="trailer" length="16.5" sigma="0" maxSpeed="5"/>
 <vType id="bus" vClass="bus" length="18" sigma="0" maxSpeed="5"/>
 <vType id="tram" vClass="tram" length="32" width="2.4" sigma="0" maxSpeed="5"/>
 <vType id="road_train" vClass="trailer" length="25.25" sigma="0" maxSpeed="5"/>
 <vehicle id="road_train" type="road_train" route="r" depart="0" departPos="135" departSpeed="3"/>
 <vehicle id="tram" type="tram" route="r" depart="0" departPos="105" departSpeed="3"/>
 <vehicle id="bus" type="bus" route="r" depart="0" departPos="68" departSpeed="3"/>
 <vehicle id="semi" type="semi" route="r" depart="0" departPos="45" departSpeed="3"/></routes>"""
ALONE = """<routes><route id="rt" edges="t0 t1"/><route id="rc" edges="e0 e1 e2"/>
 <vType id="train" vClass="rail" length="180" maxSpeed="15" sigma="0"/><vType id="car" vClass="passenger" sigma="0"/>
 <vehicle id="train" type="train" route="rt" depart="0" departPos="190" departSpeed="12"/>
 <vehicle id="ego" type="car" route="rc" depart="1" departPos="150" departSpeed="10"/></routes>"""
KINDS = {
    "road_train": ("tractor", "trailer", "trailer"),
    "tram": ("carriage",) * 3,
    "bus": ("bus", "carriage"),
    "semi": ("tractor", "trailer"),
    "train": ("carriage",) * 7,
}


def begun(link: LibsumoLink, *arguments: str) -> Any:
    return link.begin([*arguments, "--step-length", "0.5", *QUIET])


def line_of(api: Any, lanes: tuple[str, ...]) -> NDArray[np.float64]:
    return np.array([point[:2] for lane in lanes for point in api.lane.getShape(lane)])


def distance_to(line: NDArray[np.float64], point: NDArray[np.float64]) -> float:
    start, way = line[:-1], np.diff(line, axis=0)
    share = ((point - start) * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-12)
    return float(np.hypot(*(point - start - np.clip(share, 0.0, 1.0)[:, None] * way).T).min())


def state_of(api: Any, bodies: LongBodies) -> TrafficState:
    return bodies.add(VehicleReader(api, None, 0.0).state(Lamp.NONE))


def check_pieces(state: TrafficState, line: NDArray[np.float64], vehicle: str) -> int:
    """Both ends of each piece lie on the line, and the pieces reach from the front bumper to the rear; their number."""
    row, pieces = state.ids.index(vehicle), state.pieces
    own = np.flatnonzero(pieces.row == row)
    if not len(own):
        return 0
    assert tuple(pieces.kind[n] for n in own) == KINDS[vehicle]
    np.testing.assert_allclose(pieces.position[own[0]], state.position[row], atol=1e-6)
    for n in own:
        heading = np.array([math.cos(pieces.heading[n]), math.sin(pieces.heading[n])])
        rear = pieces.position[n, :2] - pieces.length[n] * heading
        # A chord is a little shorter than the part of the line between its ends.
        assert distance_to(line, pieces.position[n, :2]) < 0.02
        assert distance_to(line, rear) < 0.6
    whole = float(np.hypot(*(pieces.position[own[0], :2] - rear)))
    assert whole <= state.length[row] + 0.01
    return len(own)


def test_a_train_lies_on_its_track_and_shorter_bodies_are_in_one_piece(link: LibsumoLink) -> None:
    api = begun(link, "-c", str(RAILS))
    bodies = LongBodies(api)
    for _ in range(60):
        link.step()
        state = state_of(api, bodies)
        assert check_pieces(state, line_of(api, TRACK), "train") == 7
        assert (state.length[state.pieces.row] > LONGEST_RIGID).all()  # shorter ones are in one piece


def test_road_vehicles_bend_with_the_road(link: LibsumoLink, tmp_path: Path) -> None:
    (tmp_path / "a.rou.xml").write_text(DEMAND)
    api = begun(link, "-n", str(CASES / "rails.net.xml"), "-r", str(tmp_path / "a.rou.xml"))
    bodies, counts = LongBodies(api), {name: set[int]() for name in KINDS if name != "train"}
    for _ in range(120):
        link.step()
        state, line = state_of(api, bodies), line_of(api, ROAD)
        for name in set(counts).intersection(state.ids):
            counts[name].add(check_pieces(state, line, name))
    # A semitrailer on a straight road is in one piece.
    assert counts == {"road_train": {3}, "tram": {3}, "bus": {2}, "semi": {0, 2}}


def test_bodies_are_divided() -> None:
    for vehicle_class, length, carriage, lengths in [
        ("rail", 180.0, math.nan, [(180.0 - 6 * 0.6) / 7] * 7),
        ("rail", 50.0, 10.0, [(50.0 - 4 * 0.6) / 5] * 5),
        ("bus", 18.0, math.nan, [9.0, 9.0]),
        ("trailer", 16.5, 12.0, [6.2, 12.0]),
        ("truck", 16.5, math.nan, [6.2, 13.65]),
    ]:
        found = sections(vehicle_class, length, carriage)
        assert [one.end - one.start for one in found] == pytest.approx(lengths)
        assert found[0].start == 0.0
        assert found[-1].end == pytest.approx(length)


def test_lamps_burn_at_the_ends_of_a_body(link: LibsumoLink) -> None:
    api = begun(link, "-c", str(RAILS))
    link.step()
    state = state_of(api, LongBodies(api))
    drawn, body = with_pieces(state, None)
    train = np.flatnonzero(body == state.ids.index("train"))
    lit = [Lamp(int(lamps)) for lamps in drawn.lamps[train]]
    assert lit == [Lamp.LOW_BEAM, *[Lamp.NONE] * 5, Lamp.POSITION]
    assert set(drawn.ids) == set(state.ids)
    rest = np.flatnonzero(body != state.ids.index("train"))
    np.testing.assert_array_equal(drawn.position[rest], state.position[body[rest]])
    # Of a vehicle that is not drawn there are no further pieces to be seen.
    skipped, _ = with_pieces(state, state.ids.index("train"))
    assert len(skipped.ids) == len(state.ids)


def test_a_train_on_the_crossing_is_near_wherever_its_front_is(link: LibsumoLink) -> None:
    """At 35 s its front is 150 m farther on."""
    api = begun(link, "-c", str(RAILS))
    for _ in range(40):
        link.step()
    sight = VehicleSight(DriversView(api, even(40.0), DriverSight(1e3), Roster(api)))
    eyes, front = (np.array(api.vehicle.getPosition(v)) for v in ("semi", "train"))
    gap = 351.6 - 0.5 * api.vehicle.getWidth("train") - eyes[0]
    assert math.dist(eyes, front) > 100.0
    pairs = [("semi", "train")]
    assert sight.lines_of_sight(pairs)[0, LINE] == pytest.approx(gap, abs=0.5)
    assert sight.sees(pairs, {}) == [True]


def test_an_ego_on_rails_runs_and_is_shown_no_light_of_the_road(link: LibsumoLink) -> None:
    """Every letter that is no light is none, and no head stands where a link is not controlled."""
    settings = ("renderer=none", "estimators=[]", "fog.visibility_m=300", "duration_s=20")
    steps = list(fogsim.run(scenario_from_config(RAILS, "train", settings), seed=1))
    assert steps[-1].route_position - steps[0].route_position > 200.0
    assert {step.signal_ahead for step in steps} == {None}
    assert {head.lane_id for head in read_net(CASES / "rails.net.xml").signal_heads} == {"e0_0"}
    api = begun(link, "-c", str(RAILS))
    link.step()
    assert {api.vehicle.getNextTLS("train")[0][1:4:2]} == {(-1, "M")}
    assert LightsAhead(api).next_of("train") is None
    light = LightsAhead(api).shown_to("semi")
    assert light is not None
    assert light.colour is SignalColour.GREEN


def alone(folder: Path) -> Path:
    """A configuration with a car and a train that arrive at the crossing at about the same time."""
    return configured(folder, CASES / "rails.net.xml", ALONE)


def test_who_drives_into_a_train_has_a_collision(tmp_path: Path) -> None:
    """An agent at the wheel is not stopped; the train's front is 130 m past the crossing, and it lies in a bend."""
    scenario = scenario_from_config(alone(tmp_path), "ego", ("renderer=none", "estimators=[]", "fog.visibility_m=500"))
    with running(traffic_setup(scenario)) as traffic:
        snapshots = driven(traffic, 230, Command(control=EgoControl(acceleration=0.0)))
    hits = hits_of(snapshots)
    assert [(hit.collider, hit.victim) for hit in hits] == [("ego", "train")]
    # Its front bumper reaches the side of the train at 10 m/s from 150 m on; their ways are at a right angle.
    assert hits[0].time - 1.0 == pytest.approx((351.6 - 1.42 - 150.0) / 10.0, abs=0.3)
    assert hits[0].impact_speed == pytest.approx(math.hypot(10.0, 15.0), abs=0.1)


@pytest.mark.parametrize("visibility", [500, 15])
def test_a_car_stops_before_a_closed_crossing_and_sees_the_train_on_it(tmp_path: Path, visibility: int) -> None:
    drawn = ("renderer=cpu", "camera.width=64", "camera.height=48", "clocks.camera_period_s=0.5")
    settings = (*drawn, f"fog.visibility_m={visibility}", "duration_s=45", "advice=none", "estimators=[lead_contrast]")
    closed = passed = seen = 0
    for step in fogsim.run(scenario_from_config(alone(tmp_path), "ego", settings), seed=1):
        x, traffic = float(step.traffic.position[step.ego, 0]), step.traffic
        pieces = traffic.pieces
        south, north = 298.4 - 1.6, 298.4 + 1.6
        on_crossing = any(
            y > south and y - length < north and abs(at - 351.6) < 1.0
            for (at, y, _), length in zip(pieces.position.tolist(), pieces.length.tolist(), strict=True)
        )
        assert not (on_crossing and 348.5 < x < 354.7)
        assert not step.collisions
        closed += on_crossing
        passed += x > 360.0
        if on_crossing and x > 345.0:
            # Straight ahead, in the middle of the frame above the horizon, there is nothing but the train.
            middle = step.view.instance[step.view.instance.shape[0] // 3, step.view.instance.shape[1] // 2]
            seen += int(middle) == Instance.FIRST_VEHICLE + traffic.ids.index("train")
    assert closed > 20
    assert passed > 0
    assert seen > 5
