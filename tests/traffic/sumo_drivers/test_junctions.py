"""Drivers at junctions in a real SUMO: they yield to whom they see, and obey the lights that they see."""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from fogsim.traffic import (
    AttachedTraffic,
    BrakeEvent,
    DriverSight,
    TraciLink,
    Traffic,
    TrafficSetup,
    Trigger,
    libsumo_traffic,
    traci_traffic,
)
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_traffic import command_line
from fogsim.units import extinction_from_visibility
from fogsim.values import Collision, Command
from tests.traffic.common import DATA, even, setup_of

Cars = Callable[..., TrafficSetup]
CROSSING = DATA / "crossing"
DAY = DriverSight(illuminance=10_000.0)
CLEAR = math.inf
EMERGENCY_DECELERATION = 9.0  # SUMO's default of a passenger car
TYPE = '<vType id="c" sigma="0" speedDev="0" collisionMinGapFactor="0"/>'
IGNORED = "junctionModel.ignoreIDs"
UNTOUCHED = (31, "")
"""Speed mode of SUMO's vehicles, and whom they ignore."""


def vehicle(name: str, edges: str, place: float, speed: float = 13.0) -> str:
    return (
        f'<vehicle id="{name}" type="c" depart="0" departPos="{place}" departSpeed="{speed}" color="0,0,0">'
        f'<route edges="{edges}"/></vehicle>'
    )


@pytest.fixture
def cars(tmp_path: Path) -> Cars:
    """A simulation of these vehicles on one of the nets; the first one is the ego."""

    def setup(net: str, *vehicles: str) -> TrafficSetup:
        setup = setup_of(tmp_path, f"<routes>{TYPE}{''.join(vehicles)}</routes>")
        return replace(setup, net=CROSSING / net, ego=vehicles[0].split('"')[1], sight=DAY)

    return setup


class Drive:
    """A run: collisions, and when and at which speed each vehicle entered the junction [s, m/s]."""

    def __init__(self, traffic: Traffic, visibility: float, steps: int = 250, *, each: Callable | None = None) -> None:
        self.entered: dict[str, tuple[float, float]] = {}
        self.hits: list[Collision] = []
        traffic.enter_fog(even(visibility))
        try:
            traffic.start(1)
            for step in range(steps):
                if each is not None:
                    each(step)
                traffic.advance(Command())
                snapshot = traffic.observe()
                if snapshot is None:
                    break
                self.hits += snapshot.collisions
                state = snapshot.state
                for name, lane, speed in zip(state.ids, state.lane, state.speed.tolist(), strict=True):
                    if lane.startswith(":"):
                        self.entered.setdefault(name, (0.1 * step, speed))
        finally:
            traffic.close()


def beside(setup: TrafficSetup, shape: str, **sizes: float) -> TrafficSetup:
    """The simulation with a wall along a line."""
    file = setup.routes[0].with_name("beside.add.xml")
    parameters = "".join(f'<param key="{key}" value="{size}"/>' for key, size in sizes.items())
    wall = f'<poly id="w" type="fogsim.structure.wall" shape="{shape}">{parameters}</poly>'
    file.write_text(f"<additional>{wall}</additional>", encoding="utf-8")
    return replace(setup, additional=(file,))


def drive(setup: TrafficSetup, visibility: float, **more: object) -> Drive:
    return Drive(libsumo_traffic(setup), visibility, **more)


def crossing(cars: Cars, place: float) -> TrafficSetup:
    return cars("priority.net.xml", vehicle("minor", "SC CN", 150.0), vehicle("major", "WC CE", place))


def test_in_fog_drivers_accept_gaps_that_they_refuse_in_clear_air(cars: Cars) -> None:
    setup = crossing(cars, 125.0)
    clear, dense = drive(setup, CLEAR), drive(setup, 20.0)
    assert clear.entered["minor"][0] > clear.entered["major"][0]
    assert dense.entered["minor"][0] < dense.entered["major"][0]
    assert clear.hits == []


def test_drivers_who_see_too_late_meet_on_the_crossing(cars: Cars) -> None:
    (hit,) = drive(crossing(cars, 140.0), 12.0).hits
    assert {hit.collider, hit.victim} == {"minor", "major"}
    # The one crosses the way of the other: what counts is the difference of their velocities.
    assert hit.impact_speed > 13.0
    assert drive(crossing(cars, 140.0), CLEAR).hits == []


@pytest.mark.parametrize("visibility", [17.0, 22.0])
def test_a_driver_with_priority_hits_who_stands_on_the_crossing_as_physics_says(cars: Cars, visibility: float) -> None:
    """v² = v₀² − 2 a (d − v₀ t), with the distance d at which a black side is seen, and SUMO's emergency braking."""
    stand = BrakeEvent("stuck", Trigger(at_position=143.2), to_speed=0.0, deceleration=9.0)
    setup = cars("priority.net.xml", vehicle("major", "WC CE", 20.0), vehicle("stuck", "SC CN", 150.0))
    (hit,) = drive(replace(setup, events=(stand,)), visibility).hits
    expected = math.sqrt(13.89**2 - 2 * EMERGENCY_DECELERATION * (visibility - 13.89 * DAY.reaction_time))
    assert hit.impact_speed == pytest.approx(expected, abs=1.0)


def at_red(cars: Cars) -> TrafficSetup:
    # Its road has red for the first 45 s, at the end of which it would come to the line.
    return cars("lights.net.xml", vehicle("ego", "WC CE", 20.0))


def show_red(step: int) -> None:
    if step == 0:
        lights = load_libsumo().trafficlight
        lights.setRedYellowGreenState("C", "r" * len(lights.getRedYellowGreenState("C")))


@pytest.mark.parametrize(("visibility", "overruns"), [(8.0, True), (12.0, True), (20.0, False)])
def test_a_red_light_is_overrun_in_dense_fog_as_physics_says_and_obeyed_in_thin(
    cars: Cars, visibility: float, overruns: bool
) -> None:
    """A signal of 200 cd is seen by day at d with 200 e^(−k d) / d² = 10⁻³ lx; then v² = v₀² − 2 a (d − v₀ t)."""
    speeds: list[float] = []

    def watch(step: int) -> None:
        show_red(step)
        if "ego" in load_libsumo().vehicle.getIDList():
            speeds.append(load_libsumo().vehicle.getSpeed("ego"))

    entered = drive(at_red(cars), visibility, each=watch).entered
    assert bool(entered) == overruns
    if overruns:
        k = extinction_from_visibility(visibility)
        seen = max(d for d in (0.1 * n for n in range(1, 1000)) if 200.0 * math.exp(-k * d) / d**2 >= 1e-3)
        left = math.sqrt(13.89**2 - 2 * EMERGENCY_DECELERATION * max(seen - 13.89 * DAY.reaction_time, 0.0))
        assert entered["ego"][1] == pytest.approx(left, abs=1.2)
        # Nobody stops at a line in one step.
        hardest = min(after - before for before, after in itertools.pairwise(speeds))
        assert hardest == pytest.approx(-0.1 * EMERGENCY_DECELERATION, abs=1e-6)


def test_vehicles_on_rails_obey_signals_that_their_drivers_do_not_see(cars: Cars) -> None:
    setup = at_red(cars)
    routes = setup.routes[0]
    routes.write_text(routes.read_text().replace('<vType id="c"', '<vType id="c" vClass="tram"'), encoding="utf-8")
    assert drive(setup, 8.0, each=show_red).entered == {}


def trajectories(api: Api, steps: int, step: Callable[[], None]) -> list[tuple]:
    seen = []
    for _ in range(steps):
        step()
        get = api.vehicle
        seen.append(sorted((v, get.getPosition(v), get.getSpeed(v), get.getLaneID(v)) for v in get.getIDList()))
    return seen


def busy(cars: Cars) -> TrafficSetup:
    ways = ("WC CE", "SC CN", "EC CS", "NC CW", "SC CW", "WC CS", "EC CW", "NC CS")
    crowd = [vehicle(f"v{n}", ways[n % 8], 40.0 + 90.0 * (n // 8) + 11.0 * (n % 4), 10.0) for n in range(24)]
    return cars("lights.net.xml", vehicle("ego", "WC CE", 5.0), *crowd)


def test_in_clear_air_every_step_is_that_of_sumo_alone(cars: Cars) -> None:
    setup = busy(cars)
    api = load_libsumo()
    traffic = libsumo_traffic(setup)
    traffic.enter_fog(even(CLEAR))
    traffic.start(1)
    ours = trajectories(api, 200, lambda: traffic.advance(Command()))
    traffic.close()
    api.start(["sumo", *command_line(setup, 1)])
    api.simulationStep()
    alone = trajectories(api, 200, api.simulationStep)
    api.close()
    assert ours == alone


@pytest.fixture
def started(cars: Cars) -> Iterator[tuple[Api, TrafficSetup]]:
    """A simulation that somebody else has started."""
    setup = busy(cars)
    api = load_libsumo()
    api.start(["sumo", *command_line(setup, 1)])
    api.simulationStep()
    yield api, setup
    api.close()


def attach(api: Api, setup: TrafficSetup, visibility: float) -> AttachedTraffic:
    traffic = AttachedTraffic(setup, api)
    traffic.enter_fog(even(visibility))
    traffic.start(1)
    return traffic


def settings(api: Api) -> dict[str, tuple[int, str]]:
    get = api.vehicle
    return {v: (get.getSpeedMode(v), get.getParameter(v, IGNORED)) for v in get.getIDList()}


def test_two_sessions_end_and_every_driver_yields_and_stops_as_before(started: tuple[Api, TrafficSetup]) -> None:
    api, setup = started
    api.vehicle.setParameter("v1", IGNORED, "v2")
    api.vehicle.setSpeedMode("v3", 30)
    before = settings(api)
    dense, denser = attach(api, setup, 30.0), attach(api, setup, 10.0)
    changed: set[str] = set()
    for _ in range(60):
        for traffic in (dense, denser):
            traffic.obey(Command())
        api.simulationStep()
        for traffic in (dense, denser):
            traffic.look()
        now = settings(api)
        changed |= {v for v in now if now[v] != before.get(v, UNTOUCHED)}
        assert "v2" in now["v1"][1].split()
    assert len(changed) > 10
    denser.release()
    dense.release()
    after = settings(api)
    assert after == {v: before.get(v, UNTOUCHED) for v in after}


def test_over_a_connection_drivers_see_what_they_see_in_process(cars: Cars, sumo_process: Callable) -> None:
    setup = busy(cars)
    here = drive(setup, 15.0, steps=100)
    with sumo_process(command_line(setup, 1)) as (port, _):
        link = TraciLink("127.0.0.1", port)
        there = Drive(traci_traffic(setup, link), 15.0, steps=100)
        link.end()
    assert here.entered
    assert (there.entered, there.hits) == (here.entered, here.hits)


def test_a_pedestrian_out_of_sight_is_not_yielded_to(cars: Cars) -> None:
    """A car turns right, across the way of somebody who has green, too."""
    setup = cars("lights.net.xml", vehicle("ego", "SC CE", 150.0))
    routes = setup.routes[0]
    person = '<person id="p" depart="0" departPos="284"><walk edges="SC CN" arrivalPos="10"/></person>'
    routes.write_text(routes.read_text().replace("</routes>", person + "</routes>"), encoding="utf-8")
    speeds: list[float] = []

    def watch(_: int) -> None:
        api = load_libsumo()
        api.trafficlight.setRedYellowGreenState("C", "gGgrrrgGgrrrrGrG")
        speeds.append(api.vehicle.getSpeed("ego"))

    (hit,) = drive(setup, 4.0, each=watch).hits
    assert {hit.collider, hit.victim} == {"ego", "p"}
    assert hit.impact_speed > 5.0
    assert min(speeds) > 5.0
    speeds.clear()
    assert drive(setup, CLEAR, each=watch).hits == []
    assert min(speeds) == pytest.approx(0.0, abs=0.1)
    speeds.clear()
    assert drive(setup, 60.0, each=watch).hits == []
    # Nor is one whom a low bridge before the crossing hides from the driver in clear air.
    hiding = beside(setup, "295,290,0 325,290,0", width=0.5, bottom=0.3, top=6.0)
    assert drive(hiding, CLEAR, each=watch).hits


def test_a_wall_at_the_corner_hides_who_has_priority(cars: Cars) -> None:
    setup = crossing(cars, 125.0)
    walled = drive(beside(setup, "150,294.5,0 296,294.5,0", width=1.0, top=4.0), CLEAR)
    elsewhere = drive(beside(setup, "150,270,0 296,270,0", width=1.0, top=0.5), CLEAR)
    assert walled.entered["minor"][0] < walled.entered["major"][0]
    # What is low hides nobody: every step is that without it.
    assert elsewhere.entered == drive(setup, CLEAR).entered
    blind = replace(setup, sight=None)
    through = drive(beside(blind, "150,294.5,0 296,294.5,0", width=1.0, top=4.0), CLEAR)
    assert through.entered == drive(blind, CLEAR).entered


def test_a_light_behind_a_low_bridge_is_seen_too_late(cars: Cars) -> None:
    # From 20 m before the line on, it is before the driver; until then the beam hides what hangs lower than 6 m.
    setup = beside(at_red(cars), "273,290,0 273,306,0", width=1.0, bottom=1.0, top=6.0)
    late = drive(setup, CLEAR, each=show_red).entered
    assert late["ego"][1] > 3.0
    assert drive(at_red(cars), CLEAR, each=show_red).entered == {}
