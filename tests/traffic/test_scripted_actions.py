"""Actions of a script in SUMO: what is asked for is driven, shown and given back."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.traffic import Traffic, TrafficSetup
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.values import Lamp
from fogsim.values.script import (
    ChangeLane,
    ChangeSpeed,
    Depart,
    Follow,
    Leave,
    SetLamps,
    SetSignal,
    Shape,
    Stop,
    TakeRoute,
    TrafficAction,
)
from tests.traffic.common import DATA, NET, driven, running, setup_of

STEP = 0.1
TYPE = '<vType id="car" sigma="0" decel="4.5" emergencyDecel="9" accel="2.6" maxSpeed="40" tau="1.0"/>'


def setup_in(folder: Path, net: Path, *vehicles: str) -> TrafficSetup:
    setup = setup_of(folder, f"<routes>{TYPE}{''.join(vehicles)}</routes>", ("ego", "lead"))
    return replace(setup, net=net)


def car(name: str, edges: str, position: float, speed: float, lane: int = 0) -> str:
    place = f'departPos="{position}" departSpeed="{speed}" departLane="{lane}"'
    return f'<vehicle id="{name}" type="car" depart="0" {place}><route edges="{edges}"/></vehicle>'


PAIR = car("ego", "approach bank", 100, 25), car("lead", "approach bank", 180, 25)


@pytest.fixture
def motorway(tmp_path: Path) -> Iterator[Traffic]:
    with running(setup_in(tmp_path, NET, *PAIR)) as traffic:
        yield traffic


def drive(traffic: Traffic, steps: int, vehicle: str = "lead") -> list[dict[str, Any]]:
    """What is seen of a vehicle after each step."""
    seen = []
    for snapshot in driven(traffic, steps):
        state, row = snapshot.state, snapshot.state.ids.index(vehicle)
        one = {"speed": float(state.speed[row]), "lane": state.lane[row], "place": state.position[row]}
        seen.append({**one, "lamps": Lamp(int(state.lamps[row])), "leader": snapshot.leader})
    return seen


@pytest.mark.parametrize(
    ("action", "due", "speed"),
    [
        (ChangeSpeed("lead", 10.0, 2.0), 2.0, 10.0),  # 7.5 m/s², harder than the type's decel, within an emergency's
        (ChangeSpeed("lead", 35.0, 5.0), 5.0, 35.0),  # the limit is 33.3 m/s
        (ChangeSpeed("lead", 0.0, 0.0, Shape.STEP), 2.8, 0.0),  # as hard as in an emergency: 25 m/s over 9 m/s²
    ],
)
def test_a_speed_is_reached_in_its_time_to_the_step(
    motorway: Traffic, action: ChangeSpeed, due: float, speed: float
) -> None:
    motorway.begin([action])
    speeds = [one["speed"] for one in drive(motorway, round(due / STEP) + 20)]
    there = next(i for i, one in enumerate(speeds, 1) if abs(one - speed) < 0.01)
    assert there * STEP == pytest.approx(due, abs=STEP + 1e-9)
    assert speeds[there:] == pytest.approx([speed] * len(speeds[there:]))


def test_who_was_held_is_free_again_and_nothing_is_left(motorway: Traffic) -> None:
    get = load_libsumo().vehicle
    mode = get.getSpeedMode("lead")
    motorway.begin([ChangeSpeed("lead", 10.0, 1.0, hold=2.0), SetLamps("lead", failed=Lamp.STOP)])
    seen = drive(motorway, 60)
    assert seen[19]["speed"] == pytest.approx(10.0)
    assert seen[-1]["speed"] == pytest.approx(10.0 + 4.0 * 2.6, abs=0.3)
    assert get.getSpeedMode("lead") == mode
    assert not any(Lamp.STOP & one["lamps"] for one in seen)  # it braked


def test_scripted_vehicles_brake_for_others(motorway: Traffic) -> None:
    motorway.begin([ChangeSpeed("ego", 35.0), ChangeSpeed("lead", 5.0, 3.0)])
    gaps = [one["leader"].gap for one in drive(motorway, 250) if one["leader"]]
    assert len(gaps) > 200
    assert min(gaps) > 0.5


def test_a_follower_keeps_a_headway_shorter_than_its_own(motorway: Traffic) -> None:
    motorway.begin([ChangeSpeed("lead", 25.0), Follow("ego", "lead", 0.6)])
    last = drive(motorway, 400)[-1]
    assert last["leader"].gap == pytest.approx(0.6 * 25.0 + 2.0, abs=0.3)


def test_a_vehicle_stops_at_a_place(motorway: Traffic) -> None:
    odometer = load_libsumo().vehicle.getDistance
    begun = odometer("lead")
    motorway.begin([Stop("lead", 180.0, 3.0, stand=2.0)])
    speeds = [one["speed"] for one in drive(motorway, 115)]
    assert speeds[-1] < 0.1
    assert odometer("lead") - begun == pytest.approx(180.0, abs=1.0)
    assert drive(motorway, 40)[-1]["speed"] > 2.0


def across(traffic: Traffic, steps: int) -> tuple[list[float], list[dict[str, Any]]]:
    """How far the lead has moved to the left of where and whither it drives now, after each step [m]; and `drive`'s."""
    angle = math.radians(90.0 - load_libsumo().vehicle.getAngle("lead"))
    begin, seen = np.array(load_libsumo().vehicle.getPosition("lead")), drive(traffic, steps)
    moved = np.array([one["place"][:2] for one in seen]) - begin
    return list(moved @ np.array([-math.sin(angle), math.cos(angle)])), seen


def test_a_change_of_lane_takes_its_time_and_is_indicated_before(motorway: Traffic) -> None:
    assert motorway.begin([ChangeLane("lead", -1), ChangeLane("nobody", 1)]) != ()  # lane 0 is the rightmost
    change = ChangeLane("lead", 1, stay=20.0, duration=5.0, indicator=1.0)
    drive(motorway, 1)
    assert motorway.begin([change]) == ()
    lateral, seen = across(motorway, 75)
    width = lateral[-1]
    assert width == pytest.approx(3.75, abs=0.3)
    moving = [i for i, way in enumerate(lateral) if 0.01 * width < way < 0.99 * width]
    assert (len(moving) - 1) * STEP == pytest.approx(5.0, rel=0.15)
    assert moving[0] * STEP == pytest.approx(1.0, abs=0.5)
    indicated = [bool(one["lamps"] & Lamp.INDICATOR_LEFT) for one in seen]
    assert all(indicated[:55])
    assert not any(indicated[62:])


def test_in_left_hand_traffic_lanes_count_to_the_right_and_so_does_the_indicator(tmp_path: Path) -> None:
    net = tmp_path / "left.net.xml"
    net.write_text(NET.read_text(encoding="utf-8").replace("<net ", '<net lefthand="true" ', 1), encoding="utf-8")
    with running(setup_in(tmp_path, net, *PAIR)) as traffic:
        assert traffic.begin([ChangeLane("lead", 1, indicator=1.0)]) == ()
        (snapshot,) = driven(traffic, 1)
    lamps = int(snapshot.state.lamps[snapshot.state.ids.index("lead")])
    assert lamps & (Lamp.INDICATOR_LEFT | Lamp.INDICATOR_RIGHT) == Lamp.INDICATOR_RIGHT


@pytest.mark.parametrize("gap", [15.0, -20.0])
def test_a_vehicle_comes_onto_the_road_near_another(motorway: Traffic, gap: float) -> None:
    get = load_libsumo().vehicle
    refused = Depart("ego", "lead", 10.0), Depart("new", "nobody", 10.0), Depart("new", "lead", -9e5)
    assert motorway.begin(refused) == refused
    before = get.getDistance("lead") + 180.0
    assert motorway.begin([Depart("new", "lead", gap, lane=1, speed=20.0)]) == ()
    seen = drive(motorway, 1, "new")[0]
    assert seen["lane"] == "approach_1"
    assert seen["speed"] == pytest.approx(20.0, abs=0.3)
    length = get.getLength("lead")
    front = before + gap + math.copysign(length, gap)
    assert get.getLanePosition("new") == pytest.approx(front, abs=0.5)
    assert get.getRoute("new") == get.getRoute("lead")


def test_who_leaves_does_nothing_else_in_the_same_step(motorway: Traffic) -> None:
    later = SetLamps("lead", lit=Lamp.STOP), Follow("ego", "lead", 1.0), Depart("new", like="lead", gap=-30.0)
    assert motorway.begin([Leave("lead"), *later]) == later
    assert driven(motorway, 2)[-1].state.ids == ("ego",)


def test_no_one_else_gets_the_type_that_a_vehicle_has_for_itself(motorway: Traffic) -> None:
    """SUMO deletes it with the first vehicle that has it, be it one that is made to search a way."""
    library = load_libsumo()
    library.vehicle.setMaxSpeed("lead", 35.0)
    assert library.vehicle.getTypeID("lead") == "car@lead"
    assert motorway.begin([Depart("new", like="lead", gap=-30.0), TakeRoute("lead", ("exit",))]) == ()
    driven(motorway, 3)
    assert library.vehicle.getTypeID("new") == "car"
    assert "car@lead" in library.vehicletype.getIDList()
    assert library.vehicle.getRoute("lead")[-1] == "exit"


def test_traffic_lights_are_held_and_given_back(tmp_path: Path) -> None:
    setup = setup_in(tmp_path, DATA / "crossing" / "lights.net.xml", car("ego", "WC CE", 100, 10, lane=1))
    with running(setup) as traffic:
        get = load_libsumo().trafficlight
        program, state = get.getProgram("C"), get.getRedYellowGreenState("C")
        traffic.begin([SetSignal("C", state="r", hold=2.0)])
        drive(traffic, 15, "ego")
        assert get.getRedYellowGreenState("C") == "r" * len(state)
        drive(traffic, 10, "ego")
        assert get.getProgram("C") == program
        assert set(get.getRedYellowGreenState("C")) != {"r"}
        traffic.begin([SetSignal("C", phase=2, hold=3.0)])
        drive(traffic, 25, "ego")
        assert get.getPhase("C") == 2
        drive(traffic, 10, "ego")
        assert get.getPhase("C") == 3
        for wrong, told in [
            (SetSignal("D"), "no traffic lights 'D' in the net; known: C"),
            (SetSignal("C", state="rG"), f"expected {len(state)} letters, or one for all, got 'rG'"),
            (SetSignal("C", phase=99), "has phases 0 to"),
        ]:
            action: TrafficAction = wrong
            with pytest.raises(InputError, match=told):
                traffic.begin([action])


def test_a_vehicle_moves_within_its_lane_along_half_a_cosine_and_stays_there(motorway: Traffic) -> None:
    drive(motorway, 1)
    motorway.begin([ChangeLane("lead", 0, duration=2.0, offset=0.8)])
    lateral, _ = across(motorway, 40)
    wave = [0.4 - 0.4 * math.cos(math.pi * (i + 1) / 20) for i in range(20)]
    assert lateral == pytest.approx([*wave, *[0.8] * 20], abs=0.01)


def test_a_change_of_lane_may_end_off_the_lanes_middle(motorway: Traffic) -> None:
    drive(motorway, 1)
    motorway.begin([ChangeLane("lead", 1, duration=2.0, offset=-0.5)])
    lateral, _ = across(motorway, 40)
    assert np.abs(np.diff([0.0, *lateral])).max() < 0.3
    assert lateral[-1] == pytest.approx(3.75 - 0.5, abs=0.02)
