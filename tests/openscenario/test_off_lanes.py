"""Trajectories, persons next to the road, and vehicles off the middle of their lanes: where each is at each moment."""

import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from fogsim.errors import InputError, LeftOutWarning, UnplayedWarning
from fogsim.openscenario import read_openscenario
from fogsim.values import Step

from tests.openscenario.writing import (  # isort: skip
    CAR, CASES, DATA, PERSON, TIMED, TWO_LANES, after, begun, changed, changes_lane, event, follows, lane, linear,
    motion_at, over, polyline, profile, row_of, run, speed, world, write,
)  # fmt: skip

EGO = f"{lane(30)}\n{speed(5)}"


def _heading(steps: Sequence[Step], time: float, name: str) -> float:
    step = min(steps, key=lambda one: abs(one.time - time))
    return float(step.traffic.heading[row_of(step, name)])


def _follows(*vertices: tuple[float | None, str], reference: str = TIMED) -> str:
    return follows(polyline(*vertices), reference)


def _offset(target: str, most: float = 1.0, shape: str = "sinusoidal", continuous: str = "false") -> str:
    return (
        f'<PrivateAction><LateralAction><LaneOffsetAction continuous="{continuous}"><LaneOffsetActionDynamics '
        f'dynamicsShape="{shape}" maxLateralAcc="{most}"/><LaneOffsetTarget>{target}</LaneOffsetTarget>'
        "</LaneOffsetAction></LateralAction></PrivateAction>"
    )


def _absolute(value: float) -> str:
    return f'<AbsoluteTargetLaneOffset value="{value}"/>'


def test_a_car_turned_round_comes_along_its_lane() -> None:
    steps = run(CASES / "turned_round.xosc")
    x, y, speed_then = motion_at(steps, 2.0, "Oncoming")
    # From s = 500 m; its front bumper is 3.7 m ahead of the middle of its rear axle. It appears in the first period.
    assert (x, y) == pytest.approx((500.0 - 3.7 - 2.0 * speed_then, -1.75), abs=0.11 * speed_then)
    assert math.cos(_heading(steps, 2.0, "Oncoming")) == pytest.approx(-1.0)
    assert motion_at(steps, 3.0, "Oncoming")[0] == pytest.approx(x - speed_then, abs=0.01)


def test_a_person_waits_next_to_the_road_and_crosses_it_by_times(tmp_path: Path) -> None:
    walks = event("walk", _follows((0, world(150, -6)), (4, world(150, 2)), (6, world(154, 2))), after(2.0))
    begin = {"Ego": EGO, "Ann": world(150, -6, 'h="1.5708"')}
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, {"Ann": walks}))
    start = next(step.time for step in steps if "walk" in begun([step]))
    assert motion_at(steps, start - 0.1, "Ann") == pytest.approx((150.0, -6.0 + 0.25, 0.0), abs=1e-3)
    row = row_of(steps[5], "Ann")
    assert steps[5].traffic.off_lanes[row]
    # The figure's front is 0.25 m ahead of its middle, which follows the line at 2 m/s; begun after that step.
    for passed, place in ((2.0, (150.0, -2.0 + 0.25)), (3.5, (150.0, 1.0 + 0.25)), (5.0, (152.0 + 0.25, 2.0))):
        assert motion_at(steps, start - 0.1 + passed, "Ann") == pytest.approx((*place, 2.0), abs=0.01)
    assert motion_at(steps, 9.9, "Ann") == pytest.approx((154.25, 2.0, 0.0), abs=0.01)
    assert _heading(steps, 9.9, "Ann") == pytest.approx(0.0, abs=1e-6)


def test_who_stands_next_to_the_road_walks_straight_on_at_the_speed_that_is_ordered(tmp_path: Path) -> None:
    # Another one may stand far from the road.
    begin = {"Ego": EGO, "Ann": world(150, -6, 'h="1.5708"'), "Ben": world(60, -150)}
    story = {"Ann": event("walk", speed(1.5), after(2.0))}
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON, "Ben": PERSON}, begin, story))
    assert steps[-1].traffic.position[row_of(steps[-1], "Ben")].tolist() == pytest.approx([60.25, -150.0, 0.0])
    start = next(step.time for step in steps if "walk" in begun([step]))
    assert motion_at(steps, start + 3.9, "Ann") == pytest.approx((150.0, -6.0 + 0.25 + 4.0 * 1.5, 1.5), abs=0.16)


def test_a_trajectory_without_times_is_followed_at_the_vehicles_speed_and_a_car_drives_on(tmp_path: Path) -> None:
    line = _follows((None, world(100, -1.75)), (None, world(130, 1.75)), (None, world(160, -1.75)), reference="<None/>")
    begin = {"Ego": EGO, "Lead": f"{lane(100)}\n{speed(10)}"}
    events = event("line", line, after(0)) + event("next", speed(10), over("line"))
    steps = run(write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": events}))
    # 2 sides of 30.2 m; the front bumper is 3.7 m ahead of the middle of the rear axle.
    side = math.hypot(30.0, 3.5)
    along = 30.0 / side
    x, y, _ = motion_at(steps, 3.0, "Lead")
    assert (x, y) == pytest.approx((100.0 + 30.0 * along + 3.7 * 30.0 / side, -1.75 + 3.5 * along + 0.43), abs=0.15)
    assert begun(steps)["next"] == pytest.approx(2.0 * side / 10.0, abs=0.21)
    x, y, now = motion_at(steps, 9.0, "Lead")
    # Beyond the end it drives on in its lane, 90 m from the beginning.
    assert (x, y, now) == pytest.approx((160.0 + 3.7 + 90.0 - 2.0 * side, -1.75, 10.0), abs=0.3)


@pytest.mark.parametrize(("kind", "sense"), [("RelativeWorldPosition", 1.0), ("RelativeObjectPosition", -1.0)])
def test_a_trajectory_may_begin_where_the_vehicle_is(tmp_path: Path, kind: str, sense: float) -> None:
    own = [f'<Position><{kind} entityRef="Other" dx="{dx}" dy="{dy}"/></Position>' for dx, dy in ((0, 0), (20, 1))]
    begin = {"Ego": EGO, "Other": f"{lane(400, 1)}\n{speed(10)}"}
    moves = event("move", _follows((0, own[0]), (2, own[1])), after(1.0))
    steps = run(write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, {"Other": moves}, stop=after(3.0)))
    # It drives against x; its front bumper is 3.7 m ahead of the point that moves 20 m ahead or along x, and 1 m aside.
    x, y, _ = motion_at(steps, 2.9, "Other")
    share, length = 0.95, math.hypot(20.0, 1.0)
    wanted = (390.0 + sense * (20.0 * share + 3.7 * 20.0 / length), 1.75 + sense * (share + 3.7 / length))
    assert (x, y) == pytest.approx(wanted, abs=0.05)


@pytest.mark.parametrize(("shape", "lasts"), [("sinusoidal", math.pi * math.sqrt(0.4)), ("step", 0.0)])
def test_a_lane_offset_takes_the_time_that_its_acceleration_allows(tmp_path: Path, shape: str, lasts: float) -> None:
    moves = event("move", _offset(_absolute(0.5), 1.0, shape), after(1.0)) + event("back", speed(9), over("move"))
    begin = {"Ego": EGO, "Lead": lane(90, -1, 'offset="-0.3"') + f"\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": moves}))
    times = begun(steps)
    assert motion_at(steps, 0.0, "Lead")[:2] == pytest.approx((93.7, -2.05), abs=1e-3)
    assert times["back"] - times["move"] == pytest.approx(lasts, abs=0.21)
    halfway = motion_at(steps, times["move"] + 0.5 * lasts, "Lead")[1]
    assert halfway == pytest.approx(-1.65 if lasts else -2.05, abs=0.06)
    assert motion_at(steps, times["move"] + lasts + 0.1, "Lead")[1] == pytest.approx(-1.25, abs=1e-3)


def test_offsets_may_go_by_another_vehicle_and_end_a_change_of_lane(tmp_path: Path) -> None:
    place = lane(90, -2, 'offset="0.4"')
    changes = changes_lane(-1, "time", 2).replace("ChangeAction>", 'ChangeAction targetLaneOffset="-0.6">', 1)
    like = _offset('<RelativeTargetLaneOffset entityRef="Lead" value="0.1"/>')
    story = {"Lead": event("leave", changes, after(3.0)), "Ego": event("like", like, after(1.0))}
    begin = {"Ego": f"{lane(30, -2)}\n{speed(5)}", "Lead": f"{place}\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, story, road=TWO_LANES))
    right, left = -25.25, -21.75
    assert motion_at(steps, 0.0, "Lead")[1] == pytest.approx(right + 0.4, abs=0.01)
    assert motion_at(steps, 9.0, "Lead")[1] == pytest.approx(left - 0.6, abs=0.01)
    # The order of the file: Lead's offset is that of its change of lane.
    assert min(abs(motion_at(steps, 9.0, "Ego")[1] - y) for y in (left - 0.5, right - 0.5)) <= 0.01


@pytest.mark.parametrize(("free", "gap"), [("true", 12.0), ("false", 12.0 - 3.7 - 0.9)])
def test_a_distance_is_kept(tmp_path: Path, free: str, gap: float) -> None:
    keeps = (
        '<PrivateAction><LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" distance="12" '
        f'freespace="{free}" continuous="true"><DynamicConstraints maxAcceleration="3" maxSpeed="30"/>'
        "</LongitudinalDistanceAction></LongitudinalAction></PrivateAction>"
    )
    begin = {"Ego": f"{lane(90)}\n{speed(10)}", "Next": f"{lane(60)}\n{speed(10)}"}
    file = write(tmp_path, {"Ego": CAR, "Next": CAR}, begin, {"Next": event("keep", keeps, after(1.0))}, stop=after(25))
    with pytest.warns(LeftOutWarning, match="DynamicConstraints: FogSim's law of following has limits of its own"):
        steps = run(file)
    ego, other = motion_at(steps, 24.0, "Ego"), motion_at(steps, 24.0, "Next")
    assert ego[0] - 4.6 - other[0] == pytest.approx(gap, abs=0.3)


def test_a_profile_of_speeds_is_driven_to_the_step(tmp_path: Path) -> None:
    limits = '<DynamicConstraints maxAcceleration="3" maxDeceleration="4"/>'
    drives = profile((0, 10), (2, 16), (None, 4), limits=limits)
    events = event("profile", drives, after(1.0)) + event("next", speed(5), over("profile"))
    begin = {"Ego": EGO, "Lead": f"{lane(90)}\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": events}))
    times = begun(steps)
    start = times["profile"]
    # 16 m/s after 2 s, and then 12 m/s less at 4 m/s².
    for passed, wanted in ((1.0, 13.0), (2.0, 16.0), (3.5, 10.0), (5.0, 4.0)):
        assert motion_at(steps, start + passed, "Lead")[2] == pytest.approx(wanted, abs=0.05), passed
    assert times["next"] - times["profile"] == pytest.approx(5.0, abs=0.21)


@pytest.mark.parametrize(
    ("first", "most", "told"),
    [
        ((None, 16), 3, "SpeedProfileEntry: time: how long DynamicConstraints let the first one take depends on"),
        ((0, 10), 0, "DynamicConstraints: maxAcceleration: expected more than 0, got 0"),
    ],
)
def test_a_profile_of_speeds_needs_what_gives_its_times(
    tmp_path: Path, first: tuple[float | None, float], most: float, told: str
) -> None:
    drives = profile(first, (None, 20), limits=f'<DynamicConstraints maxAcceleration="{most}"/>')
    begin = {"Ego": EGO, "Lead": f"{lane(90)}\n{speed(10)}"}
    with pytest.raises(InputError, match=told):
        read_openscenario(write(tmp_path, dict.fromkeys(begin, CAR), begin, {"Lead": event("e", drives, after(1.0))}))


def test_conditions_on_values_hold_once_an_event_has_set_them(tmp_path: Path) -> None:
    file = DATA / "off_the_lanes.xosc"
    times = begun(run(file))
    assert times["like_lead"] == pytest.approx(times["storm"], abs=0.21)
    assert times["brake"] == pytest.approx(times["more"], abs=0.21)
    storm = ('rule="equalTo" value="storm"', 'rule="notEqualTo" value="storm"')
    count = ('rule="greaterThan" value="2"', 'rule="greaterThan" value="3"')
    times = begun(run(changed(tmp_path, file, storm, count)))
    assert times["like_lead"] < times["storm"]
    assert "brake" not in times


def _entity(name: str, inside: str) -> str:
    return f'<GlobalAction><EntityAction entityRef="{name}">{inside}</EntityAction></GlobalAction>'


def test_vehicles_come_onto_the_road_and_leave_it(tmp_path: Path) -> None:
    comes = event("come", _entity("Late", f"<AddEntityAction>{lane(300)}</AddEntityAction>"), after(2.0))
    drives = event("drive", speed(6), after(4.0))
    goes = event("go", _entity("Lead", "<DeleteEntityAction/>"), after(3.0))
    begin = {"Ego": EGO, "Lead": f"{lane(90)}\n{speed(10)}"}
    file = write(
        tmp_path, {"Ego": CAR, "Lead": CAR, "Late": CAR, "Never": CAR}, begin, {"Lead": comes + goes, "Late": drives}
    )
    text = file.read_text(encoding="utf-8")
    gone = _entity("Never", "<DeleteEntityAction/>")
    (file := tmp_path / "changed.xosc").write_text(text.replace("<Actions>", f"<Actions>{gone}", 1), encoding="utf-8")
    steps = run(file)
    there = {name: [step.time for step in steps if name in step.traffic.ids] for name in ("Lead", "Late", "Never")}
    assert (there["Lead"][0], there["Lead"][-1]) == pytest.approx((0.0, 3.0), abs=0.11)
    assert (there["Late"][0], there["Late"][-1]) == pytest.approx((2.1, steps[-1].time), abs=0.11)
    assert there["Never"] == []
    assert motion_at(steps, 3.9, "Late") == pytest.approx((303.7, -1.75, 0.0), abs=0.05)
    assert motion_at(steps, 9.9, "Late")[0] == pytest.approx(303.7 + 6.0 * (9.9 - 4.0) - 0.5 * 6.0**2 / 4.0, abs=0.7)


def test_one_turned_round_may_begin_where_its_road_ends(tmp_path: Path) -> None:
    place = world(0, -1.75, 'h="3.1416"')
    steps = run(write(tmp_path, {"Ego": CAR, "Onc": CAR}, {"Ego": EGO, "Onc": place}, stop=after(1)))
    assert motion_at(steps, 1.0, "Onc") == pytest.approx((-3.7, -1.75, 0.0), abs=0.05)


def test_the_fog_may_change_where_one_is_far_from_all_lanes(tmp_path: Path) -> None:
    thicker = '<Environment name="e"><Weather><Fog visualRange="60"/></Weather></Environment>'
    fog = event("fog", f"<GlobalAction><EnvironmentAction>{thicker}</EnvironmentAction></GlobalAction>", after(1))
    begin = {"Ego": EGO, "Far": world(150, 60, 'h="0"')}
    file = write(tmp_path, {"Ego": CAR, "Far": CAR}, begin, {"Ego": fog}, stop=after(3))
    assert run(file, "drivers.see_through_fog=false")[-1].truth.visibility == pytest.approx(60.0)


def _added(name: str, s: float) -> str:
    return _entity(name, f"<AddEntityAction>{lane(s)}</AddEntityAction>")


def test_the_initial_state_does_not_wait_for_who_comes_later(tmp_path: Path) -> None:
    begin = {"Ego": EGO, "Lead": f"{lane(90)}\n{speed(10, linear(8))}"}
    comes = event("come", _added("Late", 300), after(6.0))
    steps = run(write(tmp_path, {"Ego": CAR, "Lead": CAR, "Late": PERSON}, begin, {"Ego": comes}, stop=after(7)))
    assert begun(steps)["Init"] == 0.0
    assert motion_at(steps, 4.0, "Lead")[2] == pytest.approx(5.0, abs=0.2)
    assert int(steps[-1].traffic.lamps[row_of(steps[-1], "Late")]) == 0


@pytest.mark.parametrize("events", ["one event", "another actor's event", "an event before"])
def test_who_comes_does_what_is_ordered_at_that_moment(tmp_path: Path, events: str) -> None:
    comes, drives = _added("Late", 300), speed(15)
    story = {"Late": event("come", f'{comes}</Action><Action name="drive">{drives}', after(2.0))}
    if events != "one event":
        first = 2.0 if events == "another actor's event" else 1.0
        story = {"Late": event("drive", drives, after(first)), "Ego": event("come", comes, after(2.0))}
    steps = run(write(tmp_path, {"Ego": CAR, "Late": CAR}, {"Ego": EGO}, story, stop=after(7)))
    x, _, fast = motion_at(steps, 7.0, "Late")
    assert fast == pytest.approx(15.0)
    # It comes as fast, or speeds up by 4 m/s².
    lost = 0.0 if events == "one event" else 0.5 * 15.0**2 / 4.0
    assert x == pytest.approx(303.7 + 4.9 * 15.0 - lost, abs=1.0)


@pytest.mark.parametrize("order", [speed(15), speed(15, linear(2))])
def test_init_orders_nothing_of_who_comes_in_a_story(tmp_path: Path, order: str) -> None:
    comes = {"Ego": event("come", _added("Late", 300), after(2.0))}
    file = write(tmp_path, {"Ego": CAR, "Late": CAR}, {"Ego": EGO, "Late": order}, comes)
    with pytest.raises(InputError, match="Late comes in a story, and stands then"):
        read_openscenario(file)


def test_who_leaves_does_not_come_back(tmp_path: Path) -> None:
    goes = event("go", _entity("Late", "<DeleteEntityAction/>"), after(2.0))
    again = event("again", _added("Late", 400), after(3.0)).replace("override", "parallel")
    comes = event("come", _added("Late", 300), after(1.0)) + goes + again
    file = write(tmp_path, {"Ego": CAR, "Late": CAR}, {"Ego": EGO}, {"Ego": comes}, stop=after(4))
    with pytest.warns(UnplayedWarning, match=r"again \(Late: path\): the vehicle left the road before"):
        run(file)
    file = write(tmp_path, {"Ego": CAR, "Late": CAR}, {"Ego": EGO, "Late": lane(90)}, {"Ego": comes})
    with pytest.raises(InputError, match="Late is there from Init on, and who leaves does not come back"):
        read_openscenario(file)


@pytest.mark.parametrize("place", [lane(90), world(90, 20)])
def test_who_is_deleted_in_init_is_never_there(tmp_path: Path, place: str) -> None:
    file = write(tmp_path, {"Ego": CAR, "Late": PERSON}, {"Ego": EGO, "Late": place}, stop=after(1))
    gone = _entity("Late", "<DeleteEntityAction/>")
    file.write_text(file.read_text(encoding="utf-8").replace("<Actions>", f"<Actions>{gone}", 1), encoding="utf-8")
    assert all(step.traffic.ids == ("Ego",) for step in run(file))


def _meeting(folder: Path, final: str, further: str) -> Path:
    """A file in which Other arrives when the ego does, and further events of Other."""
    meets = (
        '<PrivateAction><SynchronizeAction masterEntityRef="Ego" targetToleranceMaster="1"><TargetPositionMaster>'
        '<LanePosition roadId="7" laneId="-1" s="110"/></TargetPositionMaster><TargetPosition>'
        f'<LanePosition roadId="7" laneId="1" s="330"/></TargetPosition>{final}</SynchronizeAction></PrivateAction>'
    )
    begin = {"Ego": f"{lane(30)}\n{speed(10)}", "Other": f"{lane(420, 1)}\n{speed(9)}"}
    events = event("meet", meets, after(1.0)) + further
    return write(folder, {"Ego": CAR, "Other": CAR}, begin, {"Other": events}, stop=after(9.0))


def test_an_event_that_overrides_ends_a_synchronisation(tmp_path: Path) -> None:
    final = '<FinalSpeed><AbsoluteSpeed value="2"/></FinalSpeed>'
    steps = run(_meeting(tmp_path, final, event("aside", _offset(_absolute(0.3)), after(3.0))))
    then, later = (motion_at(steps, time, "Other")[2] for time in (3.5, 7.0))
    assert later == pytest.approx(then, abs=0.05)
    assert then > 9.5


@pytest.mark.parametrize(
    ("final", "speed_there"),
    [
        ('<FinalSpeed><AbsoluteSpeed value="6"/></FinalSpeed>', 6.0),
        ('<FinalSpeed><RelativeSpeedToMaster value="0.5" speedTargetValueType="factor"/></FinalSpeed>', 5.0),
        ('<FinalSpeed><RelativeSpeedToMaster value="-2" speedTargetValueType="delta"/></FinalSpeed>', 8.0),
        ("", None),
    ],
)
def test_a_vehicle_arrives_when_the_ego_does(tmp_path: Path, final: str, speed_there: float | None) -> None:
    steps = run(_meeting(tmp_path, final, event("next", speed(3), over("meet"))))
    # The ego drives 80 m in 8 s, the other one 90 m against the road, 8.9 m of it before it begins to synchronise.
    x, _, speed_then = motion_at(steps, 8.0, "Other")
    assert (x, motion_at(steps, 8.0, "Ego")[0]) == pytest.approx((330.0 - 3.7, 110.0 + 3.7), abs=1.0)
    assert speed_there is None or speed_then == pytest.approx(speed_there, abs=0.6)
    times = begun(steps)
    assert times["next"] == pytest.approx(7.9, abs=0.21)


def test_what_cannot_be_followed_is_refused(tmp_path: Path) -> None:
    place, there = world(100, 0), world(120, 0)
    relative = '<Position><Relative{}Position entityRef="Ego" {}="0" ds="0"/></Position>'
    for action, told in [
        (_follows((0, place), (None, there)), "expected a number for time, got 'nothing'"),
        (_follows((0, relative.format("Lane", "dLane"))), "outside Init, where Ego is by then is not known"),
        (_follows((0, place), (4, there)).replace('"relative"', '"absolute"'), "from the beginning of the action"),
        (_follows((0, place), (4, there)).replace('"false"', '"true"'), "closed: write the first"),
        (_entity("Late", f"<AddEntityAction>{relative.format('Road', 'dt')}</AddEntityAction>"), "a place on the map"),
        (_entity("Late", "<AddEntityAction/>"), "expected Position inside"),
        (_offset(_absolute(2.0)), "2 m from the middle is not in its lane, 3.5 m wide"),
        (_offset(_absolute(0.5), 1e-5), "a move across takes 60 s at most, but this one would take"),
        (_offset("<Whatever/>"), "expected AbsoluteTargetLaneOffset or RelativeTargetLaneOffset"),
    ]:
        story = {"Ego": event("e", action, after(1.0))}
        file = write(tmp_path, {"Ego": CAR, "Late": CAR}, {"Ego": EGO}, story)
        with pytest.raises(InputError, match=told):
            read_openscenario(file)


def test_times_of_a_trajectory_that_begins_with_the_run_are_those_of_the_run(tmp_path: Path) -> None:
    action = _follows((0, world(33.7, -1.75)), (4, world(73.7, -1.75))).replace('"relative"', '"absolute"')
    file = write(tmp_path, {"Ego": CAR}, {"Ego": EGO}, {"Ego": event("e", action, after(0.0))})
    assert read_openscenario(file).data["timeline"][-1]["do"]["Ego"]["path"]["at_s"] == [0.0, 4.0]


def test_what_waits_for_an_unknown_end_is_refused_and_for_none_never_comes(tmp_path: Path) -> None:
    here = '<Position><RelativeObjectPosition entityRef="Ego" dx="{}" dy="0"/></Position>'
    line = _follows((None, here.format(0)), (None, here.format(30)), reference="<None/>")
    events = event("line", line, after(1.0)) + event("next", speed(5), over("line"))
    with pytest.raises(InputError, match="when a trajectory without times or places is over is not known"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": EGO}, {"Ego": events}))
    events = event("line", _offset(_absolute(0.5), continuous="true"), after(1.0))
    events += event("next", speed(9), over("line"))
    assert "next" not in begun(run(write(tmp_path, {"Ego": CAR}, {"Ego": EGO}, {"Ego": events}, stop=after(5.0))))


def test_who_is_off_the_lanes_is_no_ego_and_changes_no_lane(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is on no lane that leads there"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": world(150, -6)}))
    begin = {"Ego": EGO, "Ann": world(150, -6)}
    file = write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, {"Ann": event("e", _offset(_absolute(0.2)), after(1.0))})
    with pytest.raises(InputError, match="Ann is on no lane, or turned on one: SpeedAction, "):
        read_openscenario(file)


def test_who_only_follows_a_trajectory_begins_at_its_first_vertex(tmp_path: Path) -> None:
    across = _follows((None, world(80, -6)), (None, world(80, 6)), reference="<None/>")
    along = _follows((None, world(60, -1.75)), (None, world(160, 1.75)), reference="<None/>")
    begin = {"Ego": f"{along}\n{speed(10)}", "Ann": f"{across}\n{speed(1)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, stop=after(5.0)))
    length = math.hypot(100.0, 3.5)
    wanted = (60.0 + (40.0 + 3.7) * 100.0 / length, -1.75 + (40.0 + 3.7) * 3.5 / length)
    assert motion_at(steps, 0.0, "Ego")[:2] == pytest.approx((63.7, -1.75), abs=0.01)
    assert motion_at(steps, 4.0, "Ego")[:2] == pytest.approx(wanted, abs=0.02)
    assert motion_at(steps, 4.0, "Ann")[:2] == pytest.approx((80.0, -6.0 + 0.25 + 4.0), abs=0.11)


BESIDE = lane(20, -1, 'offset="3.5"')
TURNED = (
    '<Position><LanePosition roadId="7" laneId="1" s="20"><Orientation type="relative" h="3.14159"/></LanePosition>'
    "</Position>"
)
LIKE_EGO = '<RelativeTarget{} entityRef="Ego" value="0"/>'
IN_TWO_SECONDS = changes_lane(-1, "time", 2.0).replace('<AbsoluteTargetLane value="-1"/>', LIKE_EGO.format("Lane"))


@pytest.mark.parametrize(
    ("place", "action", "lasts"),
    [
        (BESIDE, _offset(LIKE_EGO.format("LaneOffset")), math.pi * math.sqrt(0.5 * 3.5)),
        (BESIDE, _offset(_absolute(0.0), 4.0), math.pi * math.sqrt(0.5 * 3.5 / 4.0)),
        (TURNED, IN_TWO_SECONDS, 2.0),
        (TURNED, changes_lane(-1, "rate", 2.0), 1.5 * 3.5 / 2.0),
    ],
)
def test_who_overtakes_from_the_beginning_cuts_in(tmp_path: Path, place: str, action: str, lasts: float) -> None:
    events = event("in", action, after(4.0)) + event("slow", speed(12), over("in"))
    begin = {"Ego": f"{lane(40)}\n{speed(8)}", "Fast": f"{place}\n{speed(16)}"}
    file = write(tmp_path, {"Ego": CAR, "Fast": CAR}, begin, {"Fast": events}, stop=after(10.0))
    steps = run(file)
    # It comes at the end of the first period, with its reference point where the file has it.
    assert motion_at(steps, 3.0, "Fast") == pytest.approx((20.0 + 3.7 + 16.0 * 3.0, 1.75, 16.0), abs=0.02)
    assert motion_at(steps, 4.0 + 0.5 * lasts, "Fast")[1] == pytest.approx(0.0, abs=1.0)
    assert motion_at(steps, 4.1 + lasts, "Fast")[1] == pytest.approx(-1.75, abs=0.02)
    assert motion_at(steps, 4.0, "Ego")[0] == pytest.approx(40.0 + 3.7 + 8.0 * 4.0, abs=0.1)
    times = begun(steps)
    assert times["slow"] - times["in"] == pytest.approx(lasts, abs=0.21)
    assert motion_at(steps, 9.9, "Fast")[1:] == pytest.approx((-1.75, 12.0), abs=0.02)


def test_who_drives_against_a_lane_goes_over_to_a_lane_that_is_there(tmp_path: Path) -> None:
    begin = {"Ego": lane(40), "Fast": f"{TURNED}\n{speed(16)}"}
    events = event("in", changes_lane(-3, "time", 2.0), after(4.0))
    with pytest.raises(InputError, match="LaneChangeAction: road '7' has no lane '-3' to drive on; it has -1, 1"):
        read_openscenario(write(tmp_path, {"Ego": CAR, "Fast": CAR}, begin, {"Fast": events}))
