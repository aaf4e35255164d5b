"""Signals read from steps made by hand."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fogsim.conditions import SIGNALS, Watch, parse_condition
from fogsim.conditions.signal import Kind, LanePlace
from fogsim.values import (
    Begun,
    Collision,
    Command,
    DriverWarning,
    Estimate,
    Fault,
    FogBank,
    FogField,
    Lamp,
    Leader,
    PersonState,
    SignalAhead,
    SignalColour,
    SignSighting,
    SpeedAdvice,
    Step,
    StretchAdvice,
    TrafficStep,
)
from fogsim.values.fault import Outage
from tests.helpers.vehicles import vehicles
from tests.recorders.synthetic import estimate, make_step

ROUTE = np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0], [500.0, 1000.0, 0.0]])
CARRIAGEWAYS = {"motorway": ("motorway_1", "motorway_2"), "wide": ("wide_0", "wide_1", "wide_2")}


def read(signal: str, step: TrafficStep) -> object:
    """Value of a signal, by a condition that asks for it."""
    watch = Watch(parse_condition(f"{signal} changes"))
    watch.update(step)
    (value,) = watch.values.values()
    return value


def placed(step: Step, *places: tuple[float, float], heading: tuple[float, ...] = (), **further: Any) -> Step:
    """A step on `ROUTE`: the other vehicle, then the ego."""
    state = replace(step.traffic, position=np.array([[*place, 0.0] for place in places]), **further)
    state = replace(state, heading=np.array(heading)) if heading else state
    truth = replace(step.truth, route=ROUTE, carriageways=CARRIAGEWAYS)
    return replace(step, traffic=state, truth=truth)


def test_the_ego_is_known_by_its_name_and_by_its_id() -> None:
    step = make_step(speed=25.0, acceleration=-1.5, route_position=100.0)
    renamed = replace(step, traffic=replace(step.traffic, ids=("other", "car 7")))
    for ego in ("ego", '"car 7"'):
        assert read(f"{ego}.speed", renamed) == 25.0
        assert read(f"{ego}.acceleration", renamed) == -1.5
        assert read(f"{ego}.position", renamed) == 100.0
    assert read("other.speed", renamed) == 20.0


def test_who_is_not_on_the_road_has_no_value() -> None:
    step = make_step()
    for signal, found in SIGNALS.items():
        name = signal.replace("X", "ghost").replace("Y", "ghost").replace("METHOD", "ghost").replace("ID", "ghost")
        name = name.replace("LENGTH", "2 m")
        if "ghost" in name and name not in {"ghost.present", "ghost.collision", "collision(ghost, ghost)"}:
            assert read(name.replace("N", "0"), step) is None
        elif found.kind is Kind.NUMBER:
            assert isinstance(read(name, step), float | None), signal
    assert read("ghost.present", step) is False
    assert read("other.present", step) is True


def test_gaps_and_times_along_the_route() -> None:
    for other, heading, gap, ttc, headway in [
        # The ego is at 200 m with 25 m/s, vehicles are 4.6 m long, and the other drives 20 m/s.
        ((260.0, -3.5), 0.0, 55.4, 55.4 / 5.0, 55.4 / 25.0),
        ((150.0, 0.0), 0.0, -45.4, math.inf, 45.4 / 20.0),
        ((202.0, -3.5), 0.0, 0.0, 0.0, 0.0),
        # An oncoming one, whose front is nearer than its rear.
        ((260.0, 7.0), math.pi, 60.0, 60.0 / 45.0, 60.0 / 25.0),
        # Round the corner.
        ((500.0, 300.0), math.pi / 2, 595.4, 595.4 / 5.0, 595.4 / 25.0),
        ((260.0, 40.0), 0.0, None, None, None),
    ]:
        step = placed(make_step(speed=25.0, route_position=200.0), other, (200.0, 0.0), heading=(heading, 0.0))
        for signal, expected in (("gap", gap), ("ttc", ttc), ("headway", headway)):
            found = read(f"{signal}(ego, other)", step)
            assert found == (None if expected is None else pytest.approx(expected)), signal


def test_persons_are_asked_for_as_vehicles_are() -> None:
    step = placed(make_step(speed=25.0, route_position=200.0), (260.0, -3.5), (200.0, 0.0))
    crossing = {"heading": np.array([0.5 * math.pi]), "speed": np.array([1.4]), "lane": (":cut1_c0_0",)}
    persons = PersonState(("child",), np.array([[230.0, -2.0, 0.0]]), raised=np.zeros(1, np.bool_), **crossing)
    step = replace(step, traffic=replace(step.traffic, persons=persons))
    assert read("child.speed", step) == pytest.approx(1.4)
    assert read("child.position", step) == pytest.approx(230.0)
    assert read("gap(ego, child)", step) == pytest.approx(30.0)
    assert read("ttc(ego, child)", step) == pytest.approx(30.0 / 25.0)
    assert read("distance(ego, child)", step) == pytest.approx(math.hypot(30.0, 2.0))
    assert read("child.present", step) is True
    # What persons do not have they are not said to have.
    for signal in ("child.acceleration", "child.visibility"):
        assert read(signal, step) is None
    assert read("other.speed", step) == 20.0


def test_the_gap_the_other_way_has_the_other_sign() -> None:
    step = placed(make_step(speed=25.0, route_position=200.0), (260.0, 0.0), (200.0, 0.0))
    assert read("gap(other, ego)", step) == pytest.approx(-55.4)
    assert read("ttc(other, ego)", step) == pytest.approx(55.4 / 5.0)
    assert read("distance(other, ego)", step) == pytest.approx(60.0)


def test_places_count_as_the_egos_own_does() -> None:
    """SUMO's way of the ego and the polyline may differ; the ego's own place is where SUMO has it."""
    step = placed(make_step(route_position=230.0), (260.0, 0.0), (200.0, 0.0))
    assert (read("ego.position", step), read("other.position", step)) == (230.0, pytest.approx(290.0))


def test_without_an_ego_places_are_along_the_named_road() -> None:
    step = placed(make_step(), (260.0, 0.0), (500.0, 300.0), heading=(0.0, math.pi / 2))
    alone = TrafficStep(
        index=0, time=0.0, traffic=step.traffic, collisions=(), truth=step.truth, command=step.command, ending=None
    )
    assert read("other.position", alone) == pytest.approx(260.0)
    assert read("gap(other, ego)", alone) == pytest.approx(800.0 - 4.6 - 260.0)
    assert read("fog.bank(0)", alone) is None
    assert read("ego.ttc", alone) is None


def test_on_a_lap_a_place_is_near_to_the_ego() -> None:
    lap = np.array([[0.0, 0.0, 0.0], [400.0, 0.0, 0.0], [400.0, 10.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 0.0]])
    twice = np.concatenate((lap, lap[1:]))
    step = placed(make_step(route_position=1020.0), (260.0, 0.0), (200.0, 0.0))
    step = replace(step, truth=replace(step.truth, route=twice))
    assert read("other.position", step) == pytest.approx(1080.0)
    seam = placed(make_step(route_position=815.0), (30.0, 0.0), (0.0, 5.0))
    seam = replace(seam, truth=replace(seam.truth, route=twice))
    assert read("other.position", seam) == pytest.approx(850.0)


def test_lanes() -> None:
    for lane, value, right, left in [
        ("motorway_1", LanePlace(0, 2), True, False),
        ("wide_2", LanePlace(2, 3), False, True),
        (":junction_0_1", LanePlace(1, None), None, None),
        (":junction_0_0", LanePlace(0, None), True, False),
        ("", None, None, None),
    ]:
        step = placed(make_step(), (60.0, 0.0), (0.0, 0.0), lane=(lane, "motorway_2"))
        assert read("other.lane", step) == value
        assert Watch(parse_condition("other.lane == right")).update(step) is right
        assert Watch(parse_condition("other.lane == left")).update(step) is left
        assert Watch(parse_condition("other.lane != left")).update(step) is (None if left is None else not left)
        if value is not None:
            assert Watch(parse_condition(f"other.lane == {value.number}")).update(step) is True


def test_a_wider_road_is_no_change_of_lane() -> None:
    watch = Watch(parse_condition("other.lane changes"))
    lanes = ("motorway_1", "wide_0", "wide_1", "wide_1")
    steps = [placed(make_step(i), (60.0, 0.0), (0.0, 0.0), lane=(lane, "motorway_1")) for i, lane in enumerate(lanes)]
    assert [watch.update(step) for step in steps] == [False, False, True, False]


def test_lamps() -> None:
    step = make_step(lamps=Lamp.LOW_BEAM | Lamp.REAR_FOG)
    assert read("ego.lamps", step) == read("lamps", step) == {"low_beam", "rear_fog"}
    watch = Watch(parse_condition("lamps include rear_fog and not lamps include stop"))
    assert watch.update(step) is True
    assert watch.readings() == "lamps = low_beam rear_fog"


def test_warning() -> None:
    step = make_step()
    assert read("warning", step) == "none"
    warned = replace(step, command=replace(step.command, warning=DriverWarning.FOG_AHEAD))
    watch = Watch(parse_condition("warning is fog_ahead and warning is not cannot_see"))
    assert watch.update(warned) is True
    assert watch.readings() == "warning = fog_ahead"


def test_advice() -> None:
    step = make_step(advised=20.0)
    heard = replace(step.traffic, advised_speed=np.array([math.inf, 20.0]))
    assert read("advice", step) == 20.0
    assert read("ego.advice", step) == math.inf
    assert read("ego.advice", replace(step, traffic=heard)) == 20.0
    alone = TrafficStep(
        index=0, time=0.0, traffic=step.traffic, collisions=(), truth=step.truth, ending=None,
        command=Command(SpeedAdvice(30.0), advised_speeds={"a": 25.0}, stretches=(StretchAdvice(22.0),)),
    )  # fmt: skip
    assert read("advice", alone) == 22.0
    assert read("limit", alone) is None


def test_the_leader() -> None:
    near = make_step(speed=25.0, leader=Leader("other", 50.0, 20.0))
    assert (read("ego.gap", near), read("ego.ttc", near), read("ego.headway", near)) == (50.0, 10.0, 2.0)
    assert read("ego.leader", near) == "other"
    alone = make_step()
    assert (read("ego.gap", alone), read("ego.ttc", alone), read("ego.headway", alone)) == (math.inf,) * 3
    assert Watch(parse_condition("ego.leader == none")).update(alone) is True
    opening = make_step(speed=15.0, leader=Leader("other", 50.0, 20.0))
    assert read("ego.ttc", opening) == math.inf


def test_sight_and_stopping() -> None:
    step = make_step(speed=20.0, visibility=150.0, visibility_ahead=90.0)
    assert read("fog.visibility_at_camera", step) == pytest.approx(150.0)
    assert read("fog.visibility_ahead", step) == pytest.approx(90.0)
    assert read("ego.stopping_sight_distance", step) == pytest.approx(20.0 * 2.5 + 20.0**2 / 6.8)
    assert Watch(parse_condition("ego.stopping_sight_distance <= fog.visibility_ahead")).update(step) is False
    assert read("other.visibility", step) is None
    eyes = replace(step.truth, vehicle_extinctions=np.array([0.03, 0.0]))
    assert read("other.visibility", replace(step, truth=eyes)) == pytest.approx(math.log(20.0) / 0.03)
    assert read("ego.visibility", replace(step, truth=eyes)) == math.inf


def test_what_the_map_tells_of_signs() -> None:
    step = make_step()
    assert (read("ego.signs", step), read("ego.sign_distance", step)) == (0, math.inf)
    signs = tuple(SignSighting(f"{far}", "yield", math.nan, far, -5.0, 0.9) for far in (90.0, 40.0))
    seen = replace(step, observation=replace(step.observation, signs=signs))
    assert (read("ego.signs", seen), read("ego.sign_distance", seen)) == (2, 40.0)


def test_banks() -> None:
    banks = tuple(FogBank((at, 0.0), (1.0, 0.0), 0.0, 100.0, 10.0, 0.02) for at in (0.0, 300.0))
    fog = FogField(0.001, (1.0, 1.0, 1.0), banks)
    step = placed(make_step(), (350.0, 0.0), (150.0, 0.0))
    step = replace(step, truth=replace(step.truth, fog=fog))
    assert [read(f"fog.bank({n})", step) for n in (0, 1, 2)] == [False, False, None]
    assert [read(f"fog.bank({n}, other)", step) for n in (0, 1)] == [False, True]
    assert read("fog.in_bank", step) is False
    assert read("fog.in_bank", placed(step, (150.0, 0.0), (350.0, 0.0))) is True


def test_estimates_and_belief() -> None:
    estimates = (estimate("joint_road", 80.0), Estimate.invalid("negru2013", "no band"))
    step = make_step(visibility=100.0, estimates=estimates)
    assert read("estimate(joint_road).visibility", step) == pytest.approx(80.0)
    assert read("estimate(mine.py:joint_road).error", step) == pytest.approx(0.2)
    assert read("estimate(negru2013).visibility", step) is None
    assert read("estimate(negru2013).valid", step) is False
    low, middle, high = (read(f"belief.{name}", step) for name in ("low", "visibility", "high"))
    assert isinstance(middle, float)
    assert low < middle < high  # type: ignore[operator]  # numbers, as the one between them is
    assert read("belief.error", step) == pytest.approx(abs(middle / 100.0 - 1.0))
    assert read("belief.error", make_step(visibility=math.inf, estimates=estimates)) is None
    assert read("belief.visibility", make_step()) is None


def test_what_has_happened_stays_so() -> None:
    watch = Watch(parse_condition("other.collision and collisions == 1 and happened(timeline.0) and happened(cut)"))
    hit = {"collisions": (Collision(0.0, "ego", "other", 2.0),)}
    first: Mapping[str, Any] = {"begun": (Begun("cut", 0.0, key="timeline.0"), Begun("end", 0.0, is_over=True))}
    steps = [make_step(0), replace(make_step(1), **first), make_step(2, **hit), make_step(3, **hit)]
    assert [watch.update(step) for step in steps] == [False, False, True, True]
    over = Watch(parse_condition("happened(end)"))
    assert [over.update(step) for step in steps] == [False] * 4


def test_two_that_hit_others_have_not_hit_each_other() -> None:
    pairs = ("ego", "other"), ("third", "fourth"), ("third", "ego")
    step = make_step(collisions=tuple(Collision(0.0, *pair, 2.0) for pair in pairs))
    for condition, holds in (("collision(ego, third)", True), ("collision(third, other)", False)):
        assert Watch(parse_condition(condition)).update(step) is holds


def test_the_light_ahead() -> None:
    ahead = SignalAhead("C", SignalColour.RED, 40.0)
    step = replace(make_step(), signal_ahead=ahead)
    assert Watch(parse_condition("signal(C).state == red")).update(step) is True
    assert Watch(parse_condition("signal(D).state == red")).update(step) is None
    assert read("signal(C).distance", step) == 40.0


def test_signals_of_a_run() -> None:
    step = make_step(time=3.0)
    assert read("time", step) == 3.0
    assert read("ending", step) is None
    assert read("limit", step) == pytest.approx(130 / 3.6)
    step = make_step()
    assert read("light", step) is None
    assert read("ego.sensor_fault", step) is False
    faulty = replace(step.truth, illuminance=0.05, faults=(Fault(Outage()),))
    dark = replace(step, truth=faulty)
    assert read("light", dark) == 0.05
    assert read("ego.sensor_fault", dark) is True


def test_times_to_who_is_ahead_count_from_other_points() -> None:
    ahead = placed(make_step(speed=25.0, route_position=200.0), (260.0, 0.0), (200.0, 0.0))
    # 55.4 m between the bumpers, and 4.6 m more.
    assert read("headway(ego, other, 4.6 m)", ahead) == pytest.approx(60.0 / 25.0)
    assert read("ttc(ego, other, 4.6 m)", ahead) == pytest.approx(60.0 / 5.0)
    assert read("speed_difference(ego, other)", ahead) == pytest.approx(5.0)
    for signal in ("headway(other, ego, 0 m)", "ttc(other, ego, 0 m)"):
        assert read(signal, ahead) is None
    with pytest.raises(ValueError, match="expected a number and a unit such as '10 m'"):
        parse_condition("headway(ego, other, far) < 2 s")


def test_curvature_is_that_of_the_circle_through_the_road() -> None:
    angles = np.arange(65) / 64.0
    # 400 m straight, then a curve to the left with a radius of 800 m and corners 12.5 m apart.
    arc = np.stack([400.0 + 800.0 * np.sin(angles), 800.0 * (1.0 - np.cos(angles)), np.zeros(65)], axis=1)
    step = make_step(route_position=600.0)
    route = np.vstack([[[0.0, 0.0, 0.0]], arc])

    def at(x: float, y: float, heading: float) -> object:
        state = replace(step.traffic, position=np.array([[0.0, 0.0, 0.0], [x, y, 0.0]]), heading=np.array([0, heading]))
        return read("ego.curvature", replace(step, traffic=state, truth=replace(step.truth, route=route)))

    assert at(200.0, 0.0, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert at(10.0, 0.0, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert at(*arc[40, :2], angles[40]) == pytest.approx(1.0 / 800.0, rel=1e-3)
    # Between corners a road of straight pieces lies up to 2.4 cm inside the circle.
    assert at(*arc[40:42, :2].mean(axis=0), angles[40]) == pytest.approx(1.0 / 800.0, rel=0.01)
    assert at(*arc[-1, :2], 1.0) == pytest.approx(1.0 / 800.0, rel=1e-3)
    assert read("ego.curvature", replace(step, truth=replace(step.truth, route=route[:1]))) is None
    assert Watch(parse_condition("ego.curvature < 1 km^-1")).update(placed(step, (0.0, 0.0), (100.0, 0.0))) is True


def test_traffic_density_counts_the_ego_s_direction_within_250_m() -> None:
    step = make_step()
    # 100 m ahead, 240 m behind, beyond, and one that comes towards it; the ego is last.
    x = [100.0, -240.0, 300.0, 50.0, 0.0]
    state = vehicles(x, ids=("a", "b", "c", "d", "ego"), heading=[0.0, 0.0, 0.0, math.pi, 0.0])
    step = replace(step, traffic=state, ego=4)
    assert read("ego.traffic_density", step) == pytest.approx(2.0 / 500.0)
    assert read("ego.traffic_density", replace(step, reading_radius=150.0)) == pytest.approx(1.0 / 300.0)
    assert Watch(parse_condition("ego.traffic_density > 3.9 veh/km")).update(step) is True
    assert read("ego.has_leader", replace(step, leader=None)) is False
    assert read("ego.has_leader", replace(step, leader=Leader("a", 100.0, 20.0))) is True
