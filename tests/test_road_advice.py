"""Advice to sections of road, on plain values: no simulation runs."""

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import fogsim
from fogsim.atmosphere import extinction
from fogsim.errors import InputError
from fogsim.scenario import Scenario, build
from fogsim.simulation import chosen_methods
from fogsim.simulation.ego.fog_reports import FogReports
from fogsim.simulation.ego.road_meters import RoadMeters
from fogsim.simulation.road_advice import RoadAdvice
from fogsim.simulation.road_sections import road_sections, section_limits
from fogsim.units import extinction_from_visibility
from fogsim.values import Display, FogField, RoadSection, SpeedAdvice, Step, Stretch
from fogsim.values.belief import certain_belief

LIMIT = 130.0 / 3.6
ROUTE = np.array([[0.0, 0.0, 0.0], [3000.0, 0.0, 0.0]])
EDGE = 2.0 / (1.0 / 60.0 + 1.0 / 2000.0)  # halfway between the extinction coefficients in and outside the bank
A16 = "advice={method: netherlands_a16, informed_by: truth}"


def scenario(*settings: str) -> Scenario:
    return fogsim.load_scenario("motorway_fog_bank", settings)


def road_advice(described: Scenario) -> RoadAdvice:
    return RoadAdvice(build.advice_config(described))


def step(
    visibilities: list[float],
    position: float = 0.0,
    index: int = 0,
    believed: float = 1000.0,
    limits: Sequence[float] = (),
) -> Step:
    """An ego on a road with a meter each 500 m; it is where the limit is 130 km/h, as it is elsewhere if not given."""
    meters = [
        RoadSection(Stretch(500.0 * i, 500.0 * (i + 1)), extinction_from_visibility(v), limit)
        for i, (v, limit) in enumerate(zip(visibilities, limits or [LIMIT] * len(visibilities), strict=True))
    ]
    truth = SimpleNamespace(sections=tuple(meters))
    belief = certain_belief(extinction_from_visibility(believed))
    values = SimpleNamespace(index=index, time=float(index), truth=truth, route_position=position, belief=belief)
    values.speed_limit = LIMIT
    return cast("Step", values)


def kmh(advice: RoadAdvice, at: Step) -> tuple[float, dict[float, int]]:
    """What the ego hears, and what each section that has advice is told, by its beginning [km/h]."""
    ego, told = advice.advise(at)
    return ego.speed * 3.6, {a.stretch.start: round(a.speed * 3.6) for a in told}


def test_each_sign_goes_by_the_visibility_at_its_own_place_and_the_ego_reads_it_in_passing() -> None:
    signs = road_advice(scenario("drivers.advised=signs", A16))
    road = [1000.0, 100.0, 60.0, 1000.0]
    assert kmh(signs, step(road)) == (math.inf, {500.0: 80, 1000.0: 60})
    assert kmh(signs, step(road, 510.0, 1))[0] == pytest.approx(80.0)
    # It thickens behind a sign that has been passed: later drivers read it, the ego does not.
    assert kmh(signs, step([1000.0, 50.0, 50.0, 1000.0], 700.0, 2)) == (pytest.approx(80.0), {500.0: 60, 1000.0: 60})
    assert kmh(signs, step([1000.0] * 4, 1010.0, 3))[0] == pytest.approx(60.0)  # which is held for a minute
    assert kmh(signs, step([1000.0] * 4, 2500.0, 4))[0] == math.inf
    # A new run knows nothing of the last.
    assert kmh(signs, step([1000.0] * 4)) == (math.inf, {})


def test_signs_step_down_towards_fog_where_they_are_harmonised() -> None:
    signs = road_advice(scenario("drivers.advised=signs", "drivers.harmonisation={}", A16))
    assert kmh(signs, step([1000.0] * 4 + [60.0])) == (math.inf, {500.0: 120, 1000.0: 100, 1500.0: 80, 2000.0: 60})
    gentle = "drivers.harmonisation={largest_step_kmh: 30, deceleration_mps2: 0.1}"
    told = kmh(road_advice(scenario("drivers.advised=signs", gentle, A16)), step([1000.0, 60.0]))[1]
    assert told == {0.0: round(3.6 * math.hypot(60.0 / 3.6, math.sqrt(2 * 0.1 * 500.0))), 500.0: 60}


def test_each_section_goes_by_the_limit_of_its_own_road() -> None:
    signs, town = scenario("drivers.advised=signs", A16), 50.0 / 3.6
    road = step([100.0, 100.0, 60.0, 60.0], limits=[LIMIT, town, town, LIMIT])
    assert kmh(road_advice(signs), road)[1] == {0.0: 80, 1500.0: 60}
    assert {a.stretch.start for a in road_advice(signs).advise_traffic(road)} == {0.0, 1500.0}
    # A step down towards fog is not needed where the limit is lower already.
    harmonised = scenario("drivers.advised=signs", "drivers.harmonisation={}", A16)
    road = step([1000.0, 1000.0, 1000.0, 60.0], limits=[LIMIT, LIMIT, town, LIMIT])
    assert kmh(road_advice(harmonised), road)[1] == {0.0: 120, 500.0: 100, 1500.0: 60}


def test_the_limit_of_a_section_is_that_where_it_begins() -> None:
    route = np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0], [800.0, 0.0, 0.0], [3000.0, 0.0, 0.0]])
    sections = tuple(Stretch(start, start + 400.0) for start in (0.0, 400.0, 500.0, 799.0, 3000.0))
    limits = section_limits(sections, route, np.array([30.0, 30.0, 20.0, 10.0]))
    assert limits == (30.0, 30.0, 20.0, 20.0, 10.0)
    assert section_limits(sections[:2], route, np.zeros(0)) == (math.inf, math.inf)


def test_in_cars_and_by_law_advice_holds_as_long_as_it_is_in_force() -> None:
    for advised, display in (("equipped", Display.IN_CAR), ("law", Display.LAW)):
        advice = road_advice(scenario(f"drivers.advised={advised}", A16))
        assert kmh(advice, step([60.0, 100.0], 100.0))[0] == pytest.approx(60.0)
        assert {told.display for told in advice.advise(step([60.0], 100.0, 1))[1]} == {display}
        assert kmh(advice, step([60.0, 100.0], 600.0, 1))[0] == pytest.approx(80.0)
        assert kmh(advice, step([60.0, 100.0], 9000.0, 2))[0] == math.inf


def test_an_ego_that_goes_by_its_belief_tells_the_section_on_which_it_is() -> None:
    signs = road_advice(scenario("drivers.advised=signs", "advice=netherlands_a16"))
    clear = [1000.0] * 3
    assert kmh(signs, step(clear, 100.0, believed=300.0)) == (math.inf, {})
    assert kmh(signs, step(clear, 600.0, 1, believed=60.0)) == (pytest.approx(60.0), {500.0: 60})
    # What was told of a section that it has left stays.
    assert kmh(signs, step(clear, 1200.0, 70, believed=100.0))[1] == {500.0: 60, 1000.0: 60}
    assert kmh(signs, step(clear, 1300.0, 140, believed=100.0)) == (pytest.approx(80.0), {500.0: 60, 1000.0: 80})


def test_sections_lie_where_the_scenario_puts_signs() -> None:
    assert road_sections(build.sections_config(scenario("drivers.advised=all")), 3000.0) == ()
    signs = scenario("drivers.advised=signs", "drivers.signs={from_m: 400, spacing_m: 1000, to_m: 2000}")
    assert road_sections(build.sections_config(signs), 3000.0) == (Stretch(400.0, 1400.0), Stretch(1400.0, 2000.0))
    placed = scenario("drivers.advised=signs", "drivers.signs.at_m=[100, 900]")
    assert road_sections(build.sections_config(placed), 3000.0) == (Stretch(100.0, 900.0), Stretch(900.0, math.inf))
    cars = road_sections(build.sections_config(scenario("drivers.advised=equipped")), 250.0)
    assert cars == (Stretch(0.0, 100.0), Stretch(100.0, 200.0), Stretch(200.0, math.inf))


def test_what_is_beyond_the_route_is_refused() -> None:
    for signs in ("{at_m: [100, 5000]}", "{from_m: 5000}"):
        beyond = scenario("drivers.advised=signs", f"drivers.signs={signs}")
        with pytest.raises(InputError, match=r"drivers\.signs: 5000 m is beyond the route, which is 3000 m long"):
            road_sections(build.sections_config(beyond), 3000.0)
    with_meter = scenario("sensors.reports.roadside={first_m: 3000, every_m: 100}")
    with pytest.raises(InputError, match="first_m: 3000 m is beyond the route, which is 3000 m long"):
        FogReports(build.reports_config(with_meter), ROUTE)


def test_meters_measure_at_the_signs_and_in_the_middle_of_other_sections() -> None:
    for advised, expected in (("signs", [2000.0, 2000.0, 2000.0, 60.0, 60.0, EDGE]), ("law", [2000.0])):
        bank = scenario(f"drivers.advised={advised}")
        fog = build.world_config(bank).fog.along(ROUTE)
        measured = RoadMeters(build.sections_config(bank), ROUTE, np.full(2, LIMIT)).measure(fog)
        visibilities = [math.log(20.0) / section.extinction for section in measured]
        assert visibilities[: len(expected)] == pytest.approx(expected, rel=0.001)
    # The last one was that of drivers who apply a law.
    by_place = {section.stretch.start: math.log(20.0) / section.extinction for section in measured}
    assert by_place[1400.0] == pytest.approx(math.log(20.0) / float(fog_at(fog, 1450.0)))


def fog_at(fog: FogField, position: float) -> float:
    return float(extinction(fog, [position, 0.0, 1.2]))


def test_keys_that_do_not_fit_are_refused_with_what_is_allowed() -> None:
    for settings, told in (
        (["drivers.advised=sings"], "sings"),
        (["drivers.signs={at_m: [500, 400]}"], "at_m must ascend"),
        (["drivers.signs={at_m: [500], spacing_m: 100}"], "give at_m, or from_m with spacing_m"),
        (["drivers.signs={from_m: 900, to_m: 800}"], "to_m must be more"),
        (["drivers.compliance_by_display={in_cars: {rate: 1}}"], "in_car"),
        (["drivers.compliance_by_display={in_car: {rate: 2}}"], "rate"),
        (["drivers.harmonisation={deceleration_mps2: -1}"], "deceleration_mps2"),
        (["drivers.signs.from_m=90000", "drivers.advised=signs"], "beyond the ego's route"),
    ):
        with pytest.raises(InputError, match=told):
            scenario(*settings)


def test_compliance_by_display_begins_with_that_of_all() -> None:
    setup = build.traffic_setup(
        scenario(
            "drivers.compliance={rate: 0.6, delay_s: 5}",
            "drivers.compliance_by_display={message_sign: {rate: 0.3}, in_car: {like: in_car}}",
            "drivers.advised=equipped",
            "drivers.equipped_share=0.2",
        )
    ).drivers
    sign, in_car = setup.compliance_with(Display.MESSAGE_SIGN), setup.compliance_with(Display.IN_CAR)
    assert (sign.rate, sign.delay, setup.compliance_with(Display.LAW)) == (0.3, 5.0, setup.compliance)
    assert (in_car.rate, in_car.strength, in_car.reached_share) == (1.0, 0.55, 0.2)


@pytest.mark.parametrize("speed", [math.nan, -1.0])
def test_an_adviser_that_returns_no_speed_is_named(speed: float, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = SimpleNamespace(advise=lambda *_: SpeedAdvice(speed))
    monkeypatch.setattr(chosen_methods, "adviser", lambda _: broken)
    with pytest.raises(InputError, match=rf"adviser 'netherlands_a16': advise\(\).*speed.*{speed:g}"):
        road_advice(scenario("drivers.advised=signs", A16)).advise(step([60.0]))
