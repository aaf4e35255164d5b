"""Distances that are reached once, trajectories that are overridden, events that are skipped, and selected actors."""

from pathlib import Path

import pytest

from fogsim.errors import InputError, UnplayedWarning
from fogsim.openscenario import read_openscenario
from fogsim.scenario.loading import load_scenario
from fogsim.values import Step

from tests.openscenario.writing import (  # isort: skip
    CAR, PERSON, QUIET, TIMED, after, begun, event, follows, group, lane, linear, motion_at, on, over, polyline, run,
    speed, state, world, write,
)  # fmt: skip

pytestmark = pytest.mark.filterwarnings("ignore::fogsim.errors.LeftOutWarning")

LIMITS = '<DynamicConstraints maxAcceleration="3" maxDeceleration="5" maxSpeed="40"/>'
LAMPS = (
    '<PrivateAction><AppearanceAction><LightStateAction transitionTime="0"><LightType><VehicleLight '
    'vehicleLightType="lowBeam"/></LightType><LightState mode="on"/></LightStateAction></AppearanceAction>'
    "</PrivateAction>"
)


def distance(attributes: str, inside: str = LIMITS) -> str:
    return (
        '<PrivateAction><LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" continuous="false" '
        f"{attributes}>{inside}</LongitudinalDistanceAction></LongitudinalAction></PrivateAction>"
    )


def between(steps: list[Step], time: float) -> float:
    """Gap from Next to the ego [m]."""
    return motion_at(steps, time, "Ego")[0] - 4.6 - motion_at(steps, time, "Next")[0]


@pytest.mark.parametrize(
    ("wanted", "gap"),
    [
        ('distance="12" freespace="true"', 12.0),
        ('distance="3" freespace="true"', 3.0),
        ('timeGap="2" freespace="false"', 20.0 - 4.6),
    ],
)
def test_a_distance_is_reached_once_and_not_kept(tmp_path: Path, wanted: str, gap: float) -> None:
    events = event("near", distance(f'displacement="trailingReferencedEntity" {wanted}'), after(1.0))
    story = {"Next": events, "Ego": event("faster", speed(14), over("near"))}
    begin = {"Ego": f"{lane(90)}\n{speed(10)}", "Next": f"{lane(60)}\n{speed(10)}"}
    stop = group(state("event", "near", "completeState", 5.5)) + after(40.0)
    steps = run(write(tmp_path, {"Ego": CAR, "Next": CAR}, begin, story, stop=stop))
    then = begun(steps)["faster"]
    assert between(steps, then) == pytest.approx(gap, abs=0.5)
    assert motion_at(steps, then + 5.0, "Next")[2] == pytest.approx(10.0, abs=0.15)
    assert between(steps, then + 5.0) > gap + 10.0


def test_two_may_come_to_a_distance_by_one_event(tmp_path: Path) -> None:
    begin = {name: f"{lane(s)}\n{speed(10)}" for name, s in (("Ego", 140), ("Next", 110), ("Last", 60))}
    near = {"Next": event("near", distance('distance="20" freespace="true"'), after(1.0))}
    file, last = (
        write(tmp_path, dict.fromkeys(begin, CAR), begin, near, stop=after(2.0)),
        '<EntityRef entityRef="Last"/>',
    )
    text = file.read_text(encoding="utf-8").replace("</Actors>", f"{last}</Actors>")
    file.write_text(text, encoding="utf-8")
    names = [entry.name for entry in load_scenario(file, QUIET).timeline]
    assert names == ["Init", "near", "near_reached", "near_reached_2"]


def test_another_order_before_a_distance_is_reached_counts(tmp_path: Path) -> None:
    # Next speeds up to 15 m/s, brakes from 3 s on, and is as fast as the ego at 16.3 s, 20 m behind it.
    events = event("near", distance('distance="20" freespace="true"'), after(1.0))
    events = (events + event("slow", speed(0, linear(40)), after(3.0))).replace("override", "parallel")
    begin = {"Ego": f"{lane(122.95)}\n{speed(10)}", "Next": f"{lane(60)}\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Next": CAR}, begin, {"Next": events}, stop=after(18.0)))
    assert between(steps, 16.3) == pytest.approx(20.0, abs=0.05)
    assert motion_at(steps, 17.5, "Next")[2] < 9.7


def test_a_distance_of_a_story_that_begins_at_once_is_a_place(tmp_path: Path) -> None:
    place = distance('distance="30" freespace="true" displacement="leadingReferencedEntity"', "")
    begin = {"Ego": f"{lane(60)}\n{speed(10)}", "Next": f"{lane(90)}\n{speed(10)}"}
    story = {"Next": event("place", place, after(0)) + event("then", speed(5), over("place"))}
    steps = run(write(tmp_path, {"Ego": CAR, "Next": CAR}, begin, story, stop=after(2.0)))
    ego, ahead = (motion_at(steps, 0.0, name)[0] for name in ("Ego", "Next"))
    assert ahead - 4.6 - ego == pytest.approx(30.0, abs=0.1)
    assert begun(steps)["then"] == pytest.approx(0.1, abs=0.11)
    late = {"Next": event("place", place.replace("leading", "trailing"), after(1))}
    with pytest.raises(InputError, match="without DynamicConstraints it is there at once"):
        read_openscenario(write(tmp_path, {"Ego": CAR, "Next": CAR}, begin, late))


@pytest.mark.parametrize("reference", ["<None/>", TIMED])
def test_an_event_that_overrides_ends_a_trajectory(tmp_path: Path, reference: str) -> None:
    # Both turn away by 2.9 degrees at 10 m/s; the car takes to its lane from 4 s on, and Ann goes straight on.
    def line(x: float, y: float) -> str:
        return follows(polyline((0, world(x, y)), (10, world(x + 100, y + 5))), reference)

    story = {
        "Far": event("path", line(150, -1.75), after(1.0)) + event("lit", LAMPS, after(4.0)),
        "Ann": event("walk", line(150, 30), after(1.0)) + event("stop", speed(2), after(4.0)),
        "Ego": event("then", speed(9), over("path")),
    }
    begin = {"Ego": lane(20), "Far": lane(140), "Ann": world(150, 30)}
    begin = {name: f"{place}\n{speed(10)}" for name, place in begin.items()}
    steps = run(write(tmp_path, {"Ego": CAR, "Far": CAR, "Ann": PERSON}, begin, story, stop=after(8.0)))
    x, y, fast = motion_at(steps, 7.5, "Far")
    assert (y, fast) == (pytest.approx(-1.75 + 1.75, abs=1.8), pytest.approx(10.0, abs=0.1))
    assert y == pytest.approx(motion_at(steps, 6.0, "Far")[1], abs=0.01)
    assert x == pytest.approx(motion_at(steps, 6.0, "Far")[0] + 15.0, abs=0.1)
    walked = motion_at(steps, 7.5, "Ann")[0] - motion_at(steps, 5.0, "Ann")[0]
    assert walked == pytest.approx(5.0, abs=0.1)
    assert begun(steps)["then"] == pytest.approx(4.1, abs=0.15)


def test_an_event_is_skipped_while_another_of_its_maneuver_runs(tmp_path: Path) -> None:
    events = event("waits", LAMPS, after(2.0)) + event("free", LAMPS, after(0.5))
    events = (events + event("same", LAMPS, after(1.0)).replace('"none"', '"rising"')).replace("override", "skip")
    events = event("slow", speed(5, linear(3)), after(1.0)) + events
    file = write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(20)}\n{speed(10)}"}, {"Ego": events}, stop=after(6.0))
    times = begun(run(file))
    assert (times["free"], times["slow"]) == pytest.approx((0.5, 1.0), abs=0.11)
    # What is skipped counts as an execution.
    assert not {"waits", "same"} & times.keys()


def test_the_entities_of_a_selection_all_act(tmp_path: Path) -> None:
    entities = {"Ego": CAR, "Far": CAR, "Next": CAR}
    begin = {name: f"{lane(20 + 40 * n)}\n{speed(10)}" for n, name in enumerate(entities)}
    too = event("too", speed(11), group(on('<SpeedCondition value="12" rule="greaterThan"/>', "both")))
    story = {"both": event("fast", speed(13), after(1.0)), "Ego": too}
    file = write(tmp_path, entities, begin, story, stop=after(4.0))
    text = file.read_text(encoding="utf-8")
    chosen = '<EntitySelection name="both"><Members>{}</Members></EntitySelection></Entities>'
    members = '<EntityRef entityRef="Far"/><EntityRef entityRef="Next"/>'
    file.write_text(text.replace("</Entities>", chosen.format(members)), encoding="utf-8")
    steps = run(file)
    assert [motion_at(steps, 3.5, name)[2] for name in entities] == pytest.approx([11.0, 13.0, 13.0], abs=0.1)
    kind = '<ByType objectType="vehicle"/>'
    file.write_text(text.replace("</Entities>", chosen.format(kind)), encoding="utf-8")
    with pytest.raises(InputError, match="expected EntityRef inside, got 'ByType'"):
        read_openscenario(file)


def test_a_distance_to_a_vehicle_that_is_not_ahead_is_reported_as_not_kept(tmp_path: Path) -> None:
    action = distance('timeGap="2" freespace="true"', "").replace(
        '"Ego" continuous="false"', '"Next" continuous="true"'
    )
    begin = {"Ego": f"{lane(90)}\n{speed(10)}", "Next": f"{lane(60)}\n{speed(10)}"}
    file = write(
        tmp_path, {"Ego": CAR, "Next": CAR}, begin, {"Ego": event("near", action, after(1.0))}, stop=after(2.0)
    )
    with pytest.warns(UnplayedWarning, match="not played: near .*: the vehicle to follow was not ahead"):
        steps = run(file)
    assert "near" not in begun(steps)


def test_an_ego_that_no_one_orders_is_driven_by_habit_and_not_as_hard_as_it_can_be(tmp_path: Path) -> None:
    strong = CAR.replace('maxDeceleration="9" maxAcceleration="4"', 'maxDeceleration="10" maxAcceleration="9"')
    for story, habit in ({}, ("2.6", "4.5")), ({"Ego": event("fast", speed(14), after(1.0))}, ("9", "10")):
        file = write(tmp_path, {"Ego": strong}, {"Ego": f"{lane(20)}\n{speed(10)}"}, story)
        text = Path(read_openscenario(file).data["traffic"]["routes"][0]).read_text(encoding="utf-8")
        assert f'accel="{habit[0]}" decel="{habit[1]}" emergencyDecel="10"' in text
