"""How drivers follow in fog; no simulation runs."""

import math

import numpy as np
import pytest

from fogsim.traffic import DriverSetup, DriverSight
from fogsim.traffic.drivers.following import (
    FOLLOWING_MODELS,
    OBSERVED_MIXTURE,
    InSight,
    OutOfSight,
    Surroundings,
    misjudged_headway,
)
from fogsim.traffic.drivers.sight import CLEAR, LeaderReach, drivers_visibility, leader_reach
from fogsim.traffic.drivers.speed_choice import driver_traits, too_fast

DAY = DriverSight(10_000.0)
NIGHT = DriverSight(0.1)
GAP = 2.5
SLOW, FAST = 13.4, 22.4


def around(visibility: float, speed: float, sight: DriverSight = DAY) -> Surroundings:
    return Surroundings(visibility, leader_reach(sight, visibility), speed, GAP)


def test_in_clear_air_everybody_follows_as_before() -> None:
    for name in sorted(FOLLOWING_MODELS):
        model = FOLLOWING_MODELS[name]
        for surroundings in (around(math.inf, 40.0), around(5000.0, 40.0)):
            assert model.headway(1.3, surroundings) == 1.3
            assert model.top_speed(surroundings.reach) >= 40.0
        assert misjudged_headway(1.3, around(math.inf, 40.0, NIGHT), 0.6) == 1.3


def test_fog_parts_drivers_above_some_speed() -> None:
    """Broughton, Switzer & Scott 2007: at 22.4 m/s and not at 13.4 m/s; here at a visibility of 40 m."""
    in_sight, out_of_sight = InSight(), OutOfSight()
    slow, fast = around(40.0, SLOW), around(40.0, FAST)
    assert slow.reach.farthest == pytest.approx(40.0, rel=0.1)
    assert SLOW < out_of_sight.top_speed(slow.reach) < FAST
    # Those who keep the leader in sight do so at less than the recommended 2 s.
    kept = in_sight.headway(2.0, fast)
    assert kept * FAST + GAP == pytest.approx(0.7 * fast.reach.farthest)
    assert kept < 2.0
    assert in_sight.headway(2.0, slow) == pytest.approx(2.0, rel=0.01)
    assert in_sight.headway(1.0, fast) == 1.0  # who is near by himself sees the leader
    assert in_sight.headway(2.0, around(5.0, FAST)) == in_sight.shortest


def test_the_careful_lengthen_their_headway() -> None:
    """Van der Hulst et al. 1998: without time pressure headways grow in fog."""
    careful = FOLLOWING_MODELS["careful"]
    headways = [careful.headway(1.0, around(visibility, FAST)) for visibility in (200.0, 125.0, 50.0, 20.0)]
    assert headways == pytest.approx([1.0, 1.5, 2.0, 2.0])
    assert careful.headway(2.5, around(20.0, FAST)) == 2.5


def test_distances_are_misjudged_where_only_lamps_are_seen() -> None:
    """Cavallo, Colomb & Doré 2001: 30 to 60 % too long; by the outline they are judged rightly."""
    only_lamps = Surroundings(30.0, LeaderReach(by_body=10.0, farthest=60.0), 20.0, GAP)
    assert misjudged_headway(2.0, only_lamps, 0.6) == pytest.approx(((2.0 * 20.0 + GAP) / 1.6 - GAP) / 20.0)
    nearly = Surroundings(30.0, LeaderReach(by_body=35.0, farthest=60.0), 20.0, GAP)
    assert misjudged_headway(2.0, nearly, 0.6) == pytest.approx((35.0 - GAP) / 20.0)
    by_outline = Surroundings(30.0, LeaderReach(by_body=45.0, farthest=60.0), 20.0, GAP)
    assert misjudged_headway(2.0, by_outline, 0.6) == 2.0
    assert misjudged_headway(2.0, only_lamps, 0.0) == 2.0


def test_reach_is_the_distance_at_which_something_is_just_seen() -> None:
    reach = leader_reach(DAY, 100.0)
    # A contrast of 0.9 falls to 5 % at the optical depth ln 18, where 100 m have ln 20.
    assert reach.by_body == pytest.approx(100.0 * math.log(18.0) / math.log(20.0), rel=0.01)
    assert leader_reach(None, 30.0) == leader_reach(DAY, math.inf) == CLEAR
    at_night = leader_reach(NIGHT, 60.0)
    assert at_night.farthest > at_night.by_body


def test_by_night_drivers_go_by_the_range_of_a_rear_lamp() -> None:
    """White & Jeffery 1980: one of 2 cd."""
    assert drivers_visibility(DAY, 300.0) == drivers_visibility(None, 300.0) == 300.0
    seen = drivers_visibility(NIGHT, 300.0)
    assert seen < 300.0
    assert NIGHT.depth_limit(seen, 1.0, 2.0, head_lamps=0.0) == pytest.approx(seen * math.log(20.0) / 300.0, rel=0.03)
    assert drivers_visibility(NIGHT, math.inf) == math.inf
    assert drivers_visibility(NIGHT, 20.0) == 20.0


def test_a_population_is_a_mixture_with_the_shares_that_are_asked_for() -> None:
    shares = {"in_sight": 0.5, "careful": 0.3, "out_of_sight": 0.2}
    setup = DriverSetup(following=shares)
    drawn = [driver_traits(setup, f"vehicle {i}", 1).following for i in range(4000)]
    for name, share in shares.items():
        assert np.mean([kind == name for kind in drawn]) == pytest.approx(share, abs=0.025)
    assert driver_traits(setup, "vehicle 7", 1).following == drawn[7]
    assert sum(OBSERVED_MIXTURE.values()) == pytest.approx(1.0)
    assert DriverSetup().following_shares == OBSERVED_MIXTURE
    assert DriverSetup(too_fast).following_shares == {"unaffected": 1.0}
    thirds = DriverSetup(following=dict.fromkeys(("in_sight", "careful", "out_of_sight"), 1 / 3))
    assert {driver_traits(thirds, str(i), 3).following for i in range(100)} == set(thirds.following_shares)
