"""The evaluation of drivers in fog, in a part that is quick, and its parts."""

import math

import numpy as np
import pytest

from fogsim.core.kinematics import safe_speed
from fogsim.reproduce import REPRODUCTIONS, Reproduction
from fogsim.reproduce.drivers import reproduce
from fogsim.reproduce.drivers.findings import FINDINGS, SIX, Bound, Look, Sign, Size, Verdict
from fogsim.reproduce.drivers.plan import (
    CALIBRATION_SEEDS,
    CLEAR,
    DEFAULT,
    SEEING,
    SIGNED,
    SLOW,
    SPARSE,
    Case,
    Plan,
    Results,
    interval,
)
from fogsim.reproduce.drivers.road import (
    BRAKING,
    THINKING_TIME,
    Measures,
    Passages,
    drive,
    follow,
    measured,
    measured_pairs,
    passages,
)

PART = Plan(
    seeds=(1,), demands=(SPARSE,), visibilities=(CLEAR, 100.0), seconds=60.0, leader_speeds=(SLOW,), followers=2
)


@pytest.fixture(scope="module")
def done() -> Reproduction:
    told = []
    done = reproduce(PART, watch=lambda step, total: told.append((step, total)))
    assert told == [(step, 13) for step in range(14)]
    return done


def test_all_is_run_with_seeds_that_nothing_was_calibrated_with() -> None:
    plan = Plan()
    assert "drivers" in REPRODUCTIONS
    assert not set(plan.seeds) & set(CALIBRATION_SEEDS)
    assert set(plan.populations) == {DEFAULT, SEEING}
    assert {case.visibility for case in plan.cases if case.population == SIGNED} == {100.0, 50.0, 30.0}


def test_records_are_flat_and_tables_show_every_finding(done) -> None:
    assert done.paper == "drivers"
    assert {type(value) for record in done.records for value in record.values()} <= {str, float, bool, int, type(None)}
    assert [row[0].removeprefix("* ") for row in done.table[1:]] == [finding.text for finding in FINDINGS]
    assert len(done.all_tables) == 3
    assert done.picture.shape == (860, 1280, 3)
    assert done.picture.std() > 10.0


def test_what_was_not_run_is_not_compared(done) -> None:
    verdicts = {r["measure"]: r["verdict"] for r in done.records if "verdict" in r and r["population"] == DEFAULT}
    assert verdicts["signs_at_100m"] == Verdict.UNKNOWN
    assert verdicts["speed_in_near_fog"] != Verdict.UNKNOWN
    assert verdicts["headway_of_careful"] == verdicts["headway_of_misjudging"] == Verdict.RIGHT


def test_drivers_slow_down_in_fog_and_pass_as_often_as_they_come(done) -> None:
    found = {
        (r["visibility_m"], r["measure"]): r["mean"]
        for r in done.records
        if "verdict" not in r and r["population"] == DEFAULT
    }
    assert found[100.0, "free_speed"] < found[None, "free_speed"] - 3.0
    assert found[None, "flow"] == pytest.approx(600.0, rel=0.5)


def test_the_same_seed_gives_the_same_traffic() -> None:
    one, other = (drive((), SPARSE, 50.0, 3, 30.0) for _ in range(2))
    assert len(one.speed) > 0
    assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_followers_are_measured_behind_their_own_leaders() -> None:
    def at(vehicle: str, time: float, state: str) -> dict[str, str]:
        return {"vehID": vehicle, "time": str(time), "state": state, "speed": "20"}

    seen = [at("leader0", 1.0, "enter"), at("leader0", 2.0, "leave"), at("leader1", 4.0, "enter")]
    seen += [at("leader1", 5.0, "leave"), at("behind0", 6.0, "enter"), at("behind1", 6.5, "enter")]
    found = measured_pairs(seen, 50.0)
    assert (found.out_of_sight, found.headway, found.headway_in_sight) == (0.5, 2.75, 1.5)
    assert math.isnan(measured_pairs(seen[:2], 50.0).out_of_sight)


def test_a_follower_in_clear_air_keeps_the_headway_of_clear_air() -> None:
    found = follow((), SLOW, CLEAR, 1, 2)
    # The wanted 1.2 s and the gap of 2.5 m that is kept at a standstill.
    assert found.headway == pytest.approx(1.2 + 2.5 / SLOW, abs=0.1)


def event(lane: str, time: float, state: str, speed: float) -> dict[str, str]:
    return {"id": lane, "time": str(time), "state": state, "speed": str(speed)}


def test_headways_and_gaps_are_those_of_a_lane() -> None:
    seen = passages(
        [
            event("0", 1.0, "enter", 20.0),
            event("1", 1.5, "enter", 30.0),
            event("0", 1.25, "leave", 20.0),
            event("0", 3.0, "stay", 25.0),
            event("0", 3.25, "enter", 25.0),
            event("1", 1.7, "leave", 30.0),
            event("0", 3.5, "leave", 25.0),
            event("0", 9.0, "enter", 22.0),
        ],
        since=2.0,
    )
    assert seen.speed.tolist() == [25.0, 22.0]
    assert seen.leader_speed.tolist() == [20.0, 25.0]
    assert seen.headway.tolist() == [2.25, 5.75]
    assert seen.gap.tolist() == [50.0, 121.0]
    none = passages([], since=0.0)
    assert measured(none, 50.0, 60.0).flow == 0.0
    assert math.isnan(measured(none, 50.0, 60.0).free_speed)


def test_measures_of_three_vehicles() -> None:
    seen = Passages(
        *(np.array(row) for row in ([30.0, 20.0, 10.0], [25.0, 20.0, 10.0], [0.5, 1.5, 8.0], [10.0, 25.0, 75.0]))
    )
    found = measured(seen, 50.0, 360.0)
    assert (found.flow, found.free_speed) == (30.0, 36.0)
    assert found.overdriving == pytest.approx(1 / 3)
    assert found.overdriving_aashto == pytest.approx(2 / 3)
    assert (found.headway_below_1, found.headway_below_2) == (pytest.approx(1 / 3), pytest.approx(2 / 3))
    assert (found.following_headway, found.following_distance, found.speed_difference) == (1.0, 17.5, 2.5)
    assert (found.ttc_15, found.ttc_50, found.ttc_below_10) == (2.0, 2.0, 0.5)


def test_stopping_distances_are_the_highway_codes() -> None:
    for mph, metres in [(20, 12), (30, 23), (40, 36), (50, 53), (60, 73), (70, 96)]:
        assert safe_speed(metres, THINKING_TIME, BRAKING) / 0.44704 == pytest.approx(mph, rel=0.02)


def test_verdicts() -> None:
    for published, value, verdict in [
        (Size(29.0, 29.0, "km/h"), 37.0, Verdict.INSIDE),
        (Size(29.0, 29.0, "km/h"), 21.0, Verdict.INSIDE),
        (Size(29.0, 29.0, "km/h"), 57.0, Verdict.FACTOR_OF_TWO),
        (Size(29.0, 29.0, "km/h"), 59.0, Verdict.OUTSIDE),
        (Size(-10.0, -8.0, "km/h"), -9.0, Verdict.INSIDE),
        (Size(-10.0, -8.0, "km/h"), -12.5, Verdict.INSIDE),
        (Size(-10.0, -8.0, "km/h"), -4.5, Verdict.FACTOR_OF_TWO),
        (Size(-10.0, -8.0, "km/h"), 9.0, Verdict.OUTSIDE),
        (Bound(50.0, 100.0, "%"), 49.0, Verdict.OUTSIDE),
        (Bound(50.0, 100.0, "%"), 51.0, Verdict.INSIDE),
        (Sign(rises=True, unit="s"), 0.1, Verdict.RIGHT),
        (Sign(rises=True, unit="s"), 0.0, Verdict.WRONG),
        (Sign(rises=False, unit="s", origin=1.0), 0.9, Verdict.RIGHT),
        (Sign(rises=False, unit="s", origin=1.0), 1.0, Verdict.WRONG),
    ]:
        assert published.verdict(value) is verdict


def made_up(**changed: float) -> Measures:
    return Measures(**(dict.fromkeys(Measures._fields, 1.0) | changed))


def test_findings_take_each_seed_with_itself() -> None:
    runs = {
        Case(DEFAULT, SPARSE, CLEAR): (made_up(free_speed=100.0), made_up(free_speed=120.0)),
        Case(DEFAULT, SPARSE, 100.0): (made_up(free_speed=90.0), made_up(free_speed=108.0)),
    }
    near_fog = next(finding for finding in SIX if finding.name == "speed_in_near_fog")
    values = near_fog.values(Look(Results(runs), DEFAULT))
    assert values == pytest.approx([-10.0, -10.0])
    assert near_fog.values(Look(Results(runs), SEEING)).size == 0
    assert len(SIX) == 6
    assert len({finding.name for finding in FINDINGS}) == len(FINDINGS)


def test_an_interval_holds_the_mean_and_leaves_out_what_is_not_there() -> None:
    rng = np.random.default_rng(5)
    values = np.append(rng.normal(3.0, 1.0, 50), np.nan)
    found = interval(values)
    assert found.mean == pytest.approx(np.nanmean(values))
    half = 1.96 * np.nanstd(values) / math.sqrt(50)
    assert (found.low, found.high) == (
        pytest.approx(found.mean - half, abs=0.1),
        pytest.approx(found.mean + half, abs=0.1),
    )
    assert math.isnan(interval(np.array([np.nan])).mean)
