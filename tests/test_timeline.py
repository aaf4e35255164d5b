"""The timeline of a scenario in runs: conditions fire, actions follow in the next period, steps tell of both."""

import dataclasses
import math
import warnings

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.errors import UnplayedWarning
from fogsim.scenario import Scenario, load_scenario
from fogsim.simulation.loop import ClosedLoop
from fogsim.simulation.timeline import Timeline
from fogsim.values import Command, Ending, Lamp, Reason, Step, TrafficStep, Truth
from fogsim.values.script import Begun, ChangeFog, ChangeLane, ChangeSpeed, Depart, Stop
from tests.helpers.vehicles import vehicles

BLIND = (EARLY, "renderer=none", "estimators=[]", "traffic.events=[]")


def scenario(*timeline: str, settings: tuple[str, ...] = ()) -> Scenario:
    return load_scenario("motorway_fog_bank", [*BLIND, f"timeline=[{', '.join(timeline)}]", *settings])


def timeline_of(described: Scenario) -> Timeline:
    return Timeline(described.run_config().script)


def step(time: float, *, speed: float = 20.0, lane: str = "e_1", **places: float) -> TrafficStep:
    """An instant in which vehicles are at places along a straight road to the east."""
    state = vehicles([*places.values()], time=time, ids=tuple(places), speed=speed, size=(5.0, 1.0, 1.0), lane=lane)
    truth = Truth(0.01, 0.01, route=np.array([[0.0, 0, 0], [5000.0, 0, 0]]))
    return TrafficStep(
        index=round(10 * time), time=time, traffic=state, collisions=(), truth=truth, command=Command(), ending=None
    )


def names(timeline: Timeline, *steps: TrafficStep) -> list[list[str]]:
    """Names of what begins after each step."""
    return [[begun.name for begun, _ in timeline.due(one).parts] for one in steps]


def test_an_entry_begins_once_or_each_time_and_after_its_delay() -> None:
    timeline = timeline_of(
        scenario(
            "{name: first, when: 'lead.speed > 10 m/s', do: {lead: {hazard_lights: true}}}",
            "{when: 'lead.speed > 10 m/s', repeat: each, do: {lead: {hazard_lights: true}}}",
            "{when: 'lead.speed > 10 m/s', delay: 0.2 s, do: {lead: {hazard_lights: true}}}",
        )
    )
    speeds = [5.0, 20.0, 20.0, 20.0, 5.0, 20.0]
    steps = [step(0.1 * i, speed=speed, lead=100.0) for i, speed in enumerate(speeds)]
    assert names(timeline, *steps) == [[], ["first", "timeline.1"], [], ["timeline.2"], [], ["timeline.1"]]


def test_an_entry_waits_for_its_vehicles() -> None:
    timeline = timeline_of(scenario("{when: time >= 0.1 s, do: {lead: {brake: {}}, ego: {hazard_lights: on}}}"))
    steps = step(0.0, ego=0.0, lead=50.0), step(0.1, ego=1.0), step(0.2, ego=2.0), step(0.3, ego=2.0, lead=50.0)
    assert names(timeline, *steps) == [[], [], [], ["timeline.0"]]


def test_actions_are_in_si_units_and_where_everybody_is() -> None:
    timeline = timeline_of(
        scenario(
            "{when: time >= 0 s, do: {"
            "lead: {brake: {to: 18 km/h, deceleration: 5 m/s², hold: 9 s}, change_lane: {to: 0, duration: 2 s}},"
            "ego: {stop: {position: 400 m, for: 3 s}}, fog: {density: 2.5, over: 4 s}}}"
        )
    )
    due = timeline.due(step(0.0, ego=100.0, lead=150.0))
    assert due.actions.traffic == (
        ChangeSpeed("lead", 5.0, 3.0, hold=9.0),
        ChangeLane("lead", -1, 60.0, 2.0),
        Stop("ego", pytest.approx(300.0), 3.0, 3.0),
    )
    assert due.actions.fog == (ChangeFog(2.5, 4.0),)


def test_a_vehicle_that_the_timeline_brings_is_known_to_the_rest_of_it() -> None:
    timeline = timeline_of(
        scenario(
            "{when: time >= 0 s, do: {new: {depart: {like: ego, gap: 15 m, speed: 72 km/h}}}}",
            "{when: new.speed > 10 m/s, do: {new: {hazard_lights: on}}}",
        )
    )
    assert timeline.due(step(0.0, ego=100.0)).actions.traffic == (Depart("new", "ego", 15.0, None, 20.0),)
    assert names(timeline, step(0.1, ego=100.0), step(0.2, ego=100.0, new=120.0)) == [[], ["timeline.1"]]


def test_an_entry_is_told_when_it_begins_and_when_it_is_over() -> None:
    timeline = timeline_of(scenario("{when: lead.speed > 10 m/s, do: {lead: {brake: {hold: 0.2 s}}}}"))
    told = []
    for i in range(4):
        due = timeline.due(step(0.1 * i, lead=100.0))
        told.append(timeline.begun(due, ()))
    begun = Begun("timeline.0", 0.0, "lead: brake", "lead.speed = 20 m/s", ("lead",), "timeline.0")
    assert told[0] == (begun,)
    assert told[1] == told[3] == ()
    assert told[2] == (dataclasses.replace(begun, time=0.2, is_over=True),)


def test_what_has_not_begun_is_told_with_the_reason() -> None:
    timeline = timeline_of(
        scenario(
            "{name: never, when: time > 99 s, do: {lead: {hazard_lights: on}}}",
            "{name: without, when: time >= 0 s, do: {ego: {hazard_lights: on}}}",
            "{name: left, when: time >= 0.2 s, do: {lead: {hazard_lights: on}}}",
            "{name: no_lane, when: time >= 0 s, do: {lead: {change_lane: {lanes: 3}}}}",
            "{name: no_place, when: time >= 0 s, do: {new: {depart: {like: lead, gap: 5 m}}}}",
            "{name: played, when: time >= 0 s, do: {lead: {hazard_lights: on}}}",
        )
    )
    due = timeline.due(step(0.0, lead=100.0))
    refused = due.parts[0][1] + due.parts[1][1]
    assert [begun.name for begun in timeline.begun(due, refused)] == ["played"]
    last = step(0.2, other=0.0)
    timeline.due(last)
    unplayed = timeline.unplayed(last)
    assert [(one.name.partition(" ")[0], one.reason) for one in unplayed.events] == [
        ("never", Reason.NEVER_HELD),
        ("without", Reason.NEVER_SEEN),
        ("left", Reason.LEFT),
        ("no_lane", Reason.NO_LANE),
        ("no_place", Reason.NO_PLACE),
    ]
    assert unplayed.vehicles == ("ego", "new")


def test_who_is_there_has_not_left_though_the_run_is_over() -> None:
    timeline = timeline_of(scenario("{when: time >= 0 s, delay: 0.2 s, do: {lead: {hazard_lights: on}}}"))
    timeline.due(step(0.0, lead=100.0))
    (one,) = timeline.unplayed(step(0.2, lead=104.0)).events
    assert one.reason is Reason.NOT_REACHED


def test_what_has_begun_at_another_time_is_not_reported() -> None:
    timeline = timeline_of(
        scenario("{when: lead.present, repeat: each, do: {lead: {change_lane: {lanes: 1}}}}"),
    )
    due = timeline.due(step(0.0, lead=100.0))
    assert timeline.begun(due, due.actions.traffic) == ()
    assert timeline.unplayed(step(0.0, lead=100.0)).events
    timeline.due(step(0.1, ego=0.0))
    assert timeline.begun(timeline.due(step(0.2, lead=110.0)), ())
    assert not timeline.unplayed(step(0.2, lead=110.0)).events


CUT_IN = (
    "{name: slow_down, when: {'gap(ego, lead)': '< 500 m'}, do: {"
    "lead: [{brake: {to: 36 km/h, deceleration: 6 m/s²}}, {lamps: {stop: failed, rear_fog: on}}],"
    "fog: {visibility: 60 m, over: 1 s}, light: {illuminance: 20000 lx, over: 1 s},"
    "sensors.camera: {fault: blackout, for: 0.5 s}}}",
    "{when: happened(slow_down), delay: 1 s, do: {lead: {hazard_lights: on}}}",
    "{when: time > 90 s, do: {lead: {hazard_lights: on}}}",
)


def test_a_run_plays_its_timeline_for_traffic_fog_light_and_sensors() -> None:
    """From clear air; and when it begins anew, all is as it was."""
    run = scenario(*CUT_IN, settings=("fog={visibility_m: inf}", "duration_s=2.5"))

    def steps(loop: ClosedLoop) -> list[Step]:
        found = [loop.start(1)]
        while found[-1].ending is None:
            found.append(loop.advance(Command()))
        return found

    with ClosedLoop(run) as loop:
        seen = steps(loop)
        again = steps(loop)
    assert [(b.name, b.time) for s in seen for b in s.begun if not b.is_over] == [
        ("slow_down", 0.0),
        ("timeline.1", pytest.approx(1.1)),
    ]
    assert seen[1].begun[0].why.startswith("gap(ego, lead) = ")
    visibility = [s.truth.visibility for s in seen]
    assert math.isinf(visibility[0])
    assert visibility[5] == pytest.approx(120.0)
    assert visibility[12] == pytest.approx(60.0)
    ratio = np.array(seen[12].truth.fog.airlight) / np.array(seen[0].truth.fog.airlight)
    assert ratio == pytest.approx(2.0)
    assert [s.index for s in seen if s.truth.faults] == [1, 2, 3, 4, 5]
    rows = [s.traffic.ids.index("lead") for s in seen]
    speeds = [float(s.traffic.speed[row]) for s, row in zip(seen, rows, strict=True)]
    assert np.diff(speeds[:20]) == pytest.approx(-0.6, abs=0.01)
    lamps = [Lamp(int(s.traffic.lamps[row])) for s, row in zip(seen, rows, strict=True)]
    assert not any(lit & Lamp.STOP for lit in lamps[1:])
    assert all(lit & Lamp.REAR_FOG for lit in lamps[1:])
    assert [bool(lit & Lamp.INDICATOR_LEFT) for lit in lamps] == [False] * 12 + [True] * 14
    assert [e.name.partition(" ")[0] for e in seen[-1].unplayed.events] == ["timeline.2"]
    assert [s.traffic.position.tobytes() for s in again] == [s.traffic.position.tobytes() for s in seen]
    assert [s.truth.visibility for s in again] == visibility


def test_drivers_meet_the_fog_that_a_timeline_brings() -> None:
    settings = ("fog={visibility_m: inf}", "traffic.ego=none", "lighting=low_beam", "traffic.warm_up_s=15")
    fast = ("clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "duration_s=12")
    run = scenario("{when: time >= 1 s, do: {fog: {visibility: 40 m}}}", settings=(*settings, *fast))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnplayedWarning)  # its script is about an ego
        first, *_, last = fogsim.run_traffic(run, 1)
    assert (first.truth.visibility, last.truth.visibility) == (math.inf, pytest.approx(40.0))
    before = dict(zip(first.traffic.ids, first.traffic.speed, strict=True))
    slower = [before[v] - s for v, s in zip(last.traffic.ids, last.traffic.speed, strict=True) if v in before]
    assert np.median(slower) > 5.0


def test_speeds_and_lanes_as_others_have_them() -> None:
    timeline = timeline_of(
        scenario(
            "{when: time >= 0 s, do: {lead: {speed: {like: ego, factor: 1.5, plus: 3.6 km/h, rate: 2 m/s²}}}}",
            "{when: time >= 0 s, do: {lead: {change_lane: {to_lane_of: ego, lanes: 1}}}}",
        )
    )
    # Nobody is called ego in traffic alone: what refers to it waits.
    assert names(timeline, step(0.0, speed=20.0, lead=100.0)) == [[]]
    due = timeline.due(step(0.1, speed=20.0, lead=100.0, ego=0.0))
    assert due.actions.traffic == (ChangeSpeed("lead", 31.0, pytest.approx(5.5)), ChangeLane("lead", 1, 60.0))


def test_an_entry_that_does_nothing_remembers_and_a_condition_ends_the_run() -> None:
    timeline = timeline_of(
        scenario("{name: past, when: time > 0.1 s, delay: 0.1 s, do: {}}", settings=("end_when=happened(past)",))
    )
    steps, endings = [step(0.1 * i, lead=100.0) for i in range(6)], []
    for one in steps:
        due = timeline.due(one)
        begun = timeline.begun(due, ())
        endings.append(timeline.ended(dataclasses.replace(one, begun=begun)))
    assert endings == [None] * 3 + [Ending.END_CONDITION] * 3
