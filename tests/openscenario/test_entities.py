"""Persons, obstacles and names with blanks: where they are, how they look, and what drivers make of them."""

from pathlib import Path

import numpy as np
import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.openscenario import read_openscenario
from fogsim.values import Step
from fogsim.values.scene import Instance

from tests.openscenario.writing import (  # isort: skip
    CAR, PERSON, after, begun, box, event, first_step, lane, linear, over, row_of, run, speed, speed_of, write,
)  # fmt: skip

CARGO = box("MiscObject", "obstacle", 1.0, 1.5, 1.0)


def _run(file: Path, *settings: str) -> list[Step]:
    return run(file, "drivers.see_through_fog=false", *settings)


def test_a_box_is_where_the_file_has_it_and_the_driver_stops_before_it(tmp_path: Path) -> None:
    begin = {"Ego": f"{lane(30)}\n{speed(15)}", "Box": lane(250)}
    steps = _run(write(tmp_path, {"Ego": CAR, "Box": CARGO}, begin, stop=after(30)))
    traffic, row = steps[0].traffic, row_of(steps[0], "Box")
    # Its middle at 250 m; positions are those of the front.
    assert traffic.position[row, :2] == pytest.approx((250.5, -1.75), abs=0.01)
    assert (traffic.length[row], traffic.width[row], traffic.height[row]) == (1.0, 1.5, 1.0)
    assert traffic.types[row] == "box"
    last = steps[-1].traffic
    front = float(last.position[row_of(steps[-1], "Ego"), 0])
    assert 240.0 < front < 249.5
    assert float(last.speed[row_of(steps[-1], "Ego")]) < 0.1
    assert float(last.speed[row_of(steps[-1], "Box")]) == 0.0
    assert int(last.lamps[row_of(steps[-1], "Box")]) == 0


def test_who_drives_too_fast_in_dense_fog_hits_the_box(tmp_path: Path) -> None:
    begin = {"Ego": f"{lane(30)}\n{speed(25)}", "Box": lane(250)}
    file = write(tmp_path, {"Ego": CAR, "Box": CARGO}, begin, visibility=15.0, stop=after(30))
    (hit,) = _run(file, "drivers.speed_choice=unaffected")[-1].collisions
    assert {hit.collider, hit.victim} == {"Ego", "Box"}


@pytest.mark.parametrize(("thing", "instance"), [(CARGO, None), (PERSON, int(Instance.PERSON))])
def test_boxes_and_persons_are_drawn_where_they_are(tmp_path: Path, thing: str, instance: int | None) -> None:
    file = write(tmp_path, {"Ego": CAR, "It": thing}, {"Ego": f"{lane(30)}\n{speed(5)}", "It": lane(50)}, stop=after(1))
    settings = ["renderer=cpu", "camera.width=320", "camera.height=240"]
    step = next(iter(fogsim.run(fogsim.load_scenario(file, settings))))
    row = row_of(step, "It")
    number = int(Instance.FIRST_VEHICLE) + row if instance is None else instance
    seen = np.argwhere(step.view.instance == number)
    assert len(seen) > 50
    # It stands on the road ahead: middle of the picture, and as far as the camera is from its rear.
    assert abs(float(np.median(seen[:, 1])) - 160.0) < 4.0
    middle = 50.0 - 0.5 * float(step.traffic.length[row])
    camera = float(step.traffic.position[step.ego, 0]) - 1.7
    distance = float(np.min(step.view.distance[step.view.instance == number]))
    assert distance == pytest.approx(middle - camera, abs=0.6)


def test_persons_walk_along_their_lane(tmp_path: Path) -> None:
    begin = {"Ego": f"{lane(30)}\n{speed(5)}", "Walker": f"{lane(100)}\n{speed(1.4)}"}
    steps = _run(write(tmp_path, {"Ego": CAR, "Walker": PERSON}, begin))
    ways = [float(step.traffic.position[row_of(step, "Walker"), 0]) for step in (steps[0], steps[-1])]
    assert steps[0].traffic.types[row_of(steps[0], "Walker")] == "pedestrian"
    assert ways[1] - ways[0] == pytest.approx(1.4 * (steps[-1].time - steps[0].time), abs=0.2)


def test_persons_and_boxes_are_no_ego(tmp_path: Path) -> None:
    steps = _run(write(tmp_path, {"Ego": CARGO, "Car": CAR}, {"Ego": lane(100), "Car": f"{lane(30)}\n{speed(5)}"}))
    assert steps[0].traffic.ids[steps[0].ego] == "Car"


def test_names_may_hold_blanks(tmp_path: Path) -> None:
    begin = {"my car": f"{lane(30)}\n{speed(15)}", "slow lorry": f"{lane(90)}\n{speed(10)}"}
    steps = _run(write(tmp_path, {"my car": CAR, "slow lorry": CAR}, begin, visibility=1000.0))
    assert set(steps[0].traffic.ids) == {"my%20car", "slow%20lorry"}
    row = row_of(steps[-1], "slow%20lorry")
    assert float(steps[-1].traffic.position[row, 0]) == pytest.approx(90.0 + 3.7 + 10.0 * steps[-1].time, abs=1.1)


def test_a_thing_without_a_size_is_refused(tmp_path: Path) -> None:
    entities = {"Ego": CAR, "Box": '<MiscObject miscObjectCategory="none"/>'}
    file = write(tmp_path, entities, {"Ego": lane(30), "Box": lane(90)})
    with pytest.raises(InputError, match=r"MiscObject: expected BoundingBox inside, got"):
        fogsim.load_scenario(file)


def test_who_is_no_entity_is_named(tmp_path: Path) -> None:
    for begin, actor, action in [
        ({"Ghost": lane(90)}, "Ego", speed(5)),
        ({"Ego": f"{lane(30)}\n{speed(speed_of('Ghost'))}"}, "Ego", speed(5)),
        ({}, "Ghost", speed(5)),
        ({}, "Ego", speed(speed_of("Ghost"))),
    ]:
        file = write(tmp_path, {"Ego": CAR}, {"Ego": lane(30), **begin}, {actor: event("e", action, after(1))})
        with pytest.raises(InputError) as refused:
            read_openscenario(file)
        (line,) = str(refused.value).splitlines()
        assert line.endswith("[Ghost]: there is no vehicle 'Ghost'")


def test_a_story_waits_for_a_vehicle_with_a_blank_in_its_name(tmp_path: Path) -> None:
    events = event("slow", speed(2, linear(4, "rate")), after(1)) + event("then", speed(5), over("slow"))
    begin = {"Ego": lane(30), "slow lorry": f"{lane(90)}\n{speed(10)}"}
    steps = _run(write(tmp_path, {"Ego": CAR, "slow lorry": CAR}, begin, {"slow lorry": events}))
    times = begun(steps)
    assert times["then"] - times["slow"] == pytest.approx(2.0, abs=0.21)


def test_no_vehicle_begins_where_another_one_is(tmp_path: Path) -> None:
    for ahead, is_free in [(4.7, True), (4.5, False), (0.0, False), (-4.5, False), (-4.7, True)]:
        file = write(tmp_path, {"Ego": CAR, "Lead": CAR}, {"Ego": lane(90), "Lead": lane(90 + ahead)})
        if is_free:
            assert {*first_step(file).traffic.ids} == {"Ego", "Lead"}
        else:
            with pytest.raises(InputError, match="Lead cannot begin where it is to: Ego is there"):
                read_openscenario(file)
