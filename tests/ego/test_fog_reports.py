"""What others tell of the fog: who, where, how often, how wrong, and what arrives."""

import math

import numpy as np
import pytest

import fogsim
from fogsim.scenario import build
from fogsim.simulation.ego.fog_reports import FogReports
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import FogBank, FogField, FogReport, TrafficState
from tests.data.early_motorway import EARLY
from tests.helpers import vehicles as states

ROUTE = np.array([[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0], [1000.0, 2000.0, 0.0]])
EVEN = FogField(0.03, (1.0,) * 3)


def senders(**reports: object) -> FogReports:
    written = [f"sensors.reports.{kind}={value}" for kind, value in reports.items()]
    made = FogReports(build.reports_config(fogsim.load_scenario("motorway_fog_bank", written)), ROUTE)
    made.reset(np.random.default_rng(1))
    return made


def vehicles(places: list[tuple[float, float, float]], ego: tuple[float, float] = (100.0, 0.0)) -> TrafficState:
    """The ego, which goes east, and others: x, y, heading."""
    return states.vehicles(
        [(*ego, 0.0), *((x, y, 0.0) for x, y, _ in places)],
        ids=("ego", *(f"car{i}" for i in range(len(places)))),
        heading=[0.0, *(heading for _, _, heading in places)],
        speed=20.0,
        lane="motorway_1",
    )


def heard(made: FogReports, state: TrafficState, seconds: float = 10.0, fog: FogField = EVEN) -> list[FogReport]:
    return [one for i in range(round(seconds / 0.1)) for one in made.heard(0.1 * i, state, 0, fog)]


def test_sensors_stand_every_half_mile_and_tell_what_is_there():
    bank = FogBank(origin=(1000.0, 0.0), axis=(0.0, 1.0), start=100.0, end=5000.0, edge=1.0, extra_extinction=0.05)
    fog = FogField(0.002, (1.0,) * 3, banks=(bank,))
    made = senders(roadside="{period_s: 2, delay_s: 1, deviation: 0.0001}")
    told = heard(made, vehicles([]), 10.0, fog)
    assert sorted({one.place for one in told}) == pytest.approx([804.672 * i for i in range(4)])
    for one in told:
        expected = 0.002 if one.place < 1000.0 else 0.052
        assert one.extinction == pytest.approx(expected, rel=1e-3)
        assert one.relative_deviation == 0.0001
    by_sensor = [one.time for one in told if one.source == "sensor 0"]
    # Each has a beat of its own; what it told before the run has come in when that begins.
    assert by_sensor[0] == -1.0
    assert np.diff(by_sensor)[1:] == pytest.approx(2.0, abs=0.11)


def test_reports_arrive_as_late_as_is_said():
    made = senders(roadside="{period_s: 100, delay_s: 3}")
    arrivals = [(0.1 * i, one.time) for i in range(60) for one in made.heard(0.1 * i, vehicles([]), 0, EVEN)]
    assert arrivals
    assert all(arrived - sent == pytest.approx(3.0, abs=0.11) for arrived, sent in arrivals)


def test_vehicles_in_range_that_go_the_same_way_on_the_same_road_tell_where_they_are():
    state = vehicles(
        [(300.0, 3.0, 0.0), (900.0, 0.0, 0.0), (250.0, 60.0, 0.0), (250.0, 4.0, math.pi), (50.0, 0.0, 0.0)]
    )
    told = heard(senders(vehicles="{equipped: 1, loss: 0, range_m: 400}"), state)
    assert {one.source for one in told} == {"car0", "car4"}
    assert {round(one.place) for one in told} == {300, 50}
    assert len(told) == pytest.approx(20, abs=2)
    assert len({(one.source, one.number) for one in told}) == len(told)


def test_places_round_a_corner_are_counted_along_the_route():
    told = heard(senders(vehicles="{equipped: 1, loss: 0}"), vehicles([(1000.0, 150.0, 1.5)], ego=(900.0, 0.0)))
    assert {round(one.place) for one in told} == {1150}


def test_a_share_of_the_vehicles_is_equipped_and_stays_so():
    state = vehicles([(100.0 + i, 0.0, 0.0) for i in range(400)])
    made = senders(vehicles="{equipped: 20 %, loss: 0}")
    once, again = ({one.source for one in heard(made, state, 1.2)} for _ in range(2))
    assert len(once) == pytest.approx(80, abs=25)
    assert again <= once
    made.reset(np.random.default_rng(2))
    assert {one.source for one in heard(made, state, 1.2)} != once


def test_noise_loss_and_wrong_measurements_are_as_frequent_as_is_said():
    state = vehicles([(100.0 + i, 0.0, 0.0) for i in range(300)])
    told = heard(senders(vehicles="{equipped: 1, loss: 0.25, deviation: 0.2}"), state)
    assert len(told) == pytest.approx(0.75 * 3000, rel=0.1)
    logs = np.log([one.extinction / 0.03 for one in told])
    assert (logs.mean(), logs.std()) == (pytest.approx(0.0, abs=0.02), pytest.approx(0.2, rel=0.1))
    wrong = heard(senders(vehicles="{equipped: 1, loss: 0, deviation: 0.01, wrong: 20 %}"), state)
    far_off = [abs(math.log(one.extinction / 0.03)) > 0.1 for one in wrong]
    assert np.mean(far_off) == pytest.approx(0.19, abs=0.03)
    visibilities = [OPTICAL_DEPTH_AT_VISIBILITY / one.extinction for one in wrong]
    assert 20.0 <= min(visibilities) < max(visibilities) <= 5000.0


def test_the_same_seed_has_the_same_reports():
    state = vehicles([(200.0, 0.0, 0.0), (300.0, 0.0, 0.0)])
    assert heard(senders(vehicles="{equipped: 1}"), state) == heard(senders(vehicles="{equipped: 1}"), state)


def test_in_a_run_the_belief_ahead_goes_by_what_is_reported():
    bank = "fog={outside_visibility_m: 3000, banks: [{start_m: 500, end_m: 2500, edge_m: 50, visibility_m: 80}]}"
    settings = (EARLY, bank, "fusion=field_filter", "estimators=[]", "renderer=none", "duration_s=4")
    sensors = "sensors.reports.roadside={every_m: 50, period_s: 1, delay_s: 0}"
    believed = []
    for more in ((), (sensors,)):
        scenario = fogsim.load_scenario("motorway_fog_bank", [*settings, *more])
        *_, last = fogsim.run(scenario, seed=1)
        profile, true = last.belief.profile, last.truth.profile
        distance = 650.0 - last.route_position
        believed.append(profile.visibility_quantile(distance, 0.5))
        assert true.visibility_quantile(distance, 0.5) == pytest.approx(80.0, rel=0.1)
        assert bool(last.observation.reports) == bool(more)
    assert believed[1] == pytest.approx(80.0, rel=0.2)
    assert believed[0] > 200.0
