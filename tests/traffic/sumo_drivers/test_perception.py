"""Drivers in a real SUMO: who sees late hits, who sees early stops."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import early_motorway
import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.atmosphere import FieldAccess
from fogsim.traffic import Compliance, DriverSetup, DriverSight, LampFailureEvent, TrafficSetup, Trigger
from fogsim.traffic.drivers.sight_kernels import DEPTH, DISTANCE, HIDDEN, JUDGED, LINE, SEEN
from fogsim.traffic.drivers.speed_choice import unaffected, within_sight
from fogsim.traffic.sumo.libsumo_link import LibsumoLink, load_libsumo
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.perception import LeaderSight
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView
from fogsim.values import Collision, Command, FogBank, FogField
from tests.traffic.common import NET, driven, hits_of, running, seen, setup_of

EMERGENCY_DECELERATION = 9.0  # SUMO's default of a passenger car
ROUTES = """<routes>
  <vType id="c" vClass="passenger" sigma="0" speedDev="0" length="4.6" maxSpeed="33.8" collisionMinGapFactor="0"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="wreck" type="c" route="r" depart="0" departPos="800" departSpeed="0" departLane="1" color="0,0,0">
    <stop lane="approach_1" startPos="790" endPos="801" duration="10000"/>
  </vehicle>
  <vehicle id="ego" type="c" route="r" depart="0" departPos="100" departSpeed="33.8" departLane="1"/>
</routes>"""


SLOW_LEADER = """<routes>
  <vType id="c" vClass="passenger" sigma="0" speedDev="0"/>
  <vType id="s" vClass="passenger" sigma="0" speedDev="0" maxSpeed="8"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="slow" type="s" route="r" depart="0" departPos="300" departSpeed="8" departLane="0"/>
  <vehicle id="ego" type="c" route="r" depart="0" departPos="60" departSpeed="30" departLane="0"/>
</routes>"""


def fog_of(k: float) -> FieldAccess:
    """Even fog (`k` [1/m])."""
    return FieldAccess(FogField(k, (3000.0,) * 3))


@dataclass(frozen=True)
class SeesFrom(DriverSight):
    """Eyes that see everything from a fixed distance on, whatever the fog."""

    illuminance: float = 0.0
    reaction_time: float = 0.0
    distance: float = 50.0

    def sure_distance(self, *_: float) -> float:
        return self.distance - 10.0

    def hidden_distance(self, *_: float) -> float:
        return self.distance + 10.0

    def seen_distance(self, *_: float, **__: float) -> float:
        return self.distance

    def depth_limit(self, distance: float, *_: float) -> float:
        return math.inf if distance <= self.distance else -math.inf

    def depth_limits(self, looks: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(looks[0] <= self.distance, math.inf, -math.inf)

    def judge_leaders(self, facing: NDArray[np.float64], *_: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """To be looked at again in the next step."""
        return np.where(facing[DISTANCE] <= self.distance, SEEN, HIDDEN), np.zeros(facing.shape[1])

    def judge_lines(self, lines: NDArray[np.float64], *_: float) -> None:
        lines[:, JUDGED] = np.where(lines[:, LINE] <= self.distance, SEEN, HIDDEN)


@pytest.fixture
def setup(tmp_path: Path) -> TrafficSetup:
    return setup_of(tmp_path, ROUTES, ("ego", "wreck"), step=0.05)


def collisions(setup: TrafficSetup) -> tuple[list[Collision], float]:
    """Collisions of a drive towards the wreck, and the ego's speed at the end [m/s]."""
    with running(setup, fog_of(0.05)) as traffic:
        snapshots = driven(traffic, 800)
    last = snapshots[-1]
    return hits_of(snapshots), float(last.state.speed[last.ego])


@pytest.mark.parametrize(("sight", "reaction"), [(50.0, 0.0), (80.0, 1.0)])
def test_who_sees_too_late_hits_at_the_speed_that_physics_gives(
    setup: TrafficSetup, sight: float, reaction: float
) -> None:
    """v² = v₀² − 2 a (d − v₀ t), with SUMO's emergency deceleration."""
    ((hit,), last_speed) = collisions(replace(setup, sight=SeesFrom(distance=sight, reaction_time=reaction)))
    assert last_speed == pytest.approx(0.0, abs=0.01)
    expected = np.sqrt(33.8**2 - 2 * EMERGENCY_DECELERATION * (sight - 33.8 * reaction))
    assert hit.impact_speed == pytest.approx(expected, abs=1.0)
    assert {hit.collider, hit.victim} == {"ego", "wreck"}


def first_braking(setup: TrafficSetup, illuminance: float) -> float:
    """Gap to the wreck when the ego first brakes in fog of 60 m [m]."""
    changed = replace(setup, sight=DriverSight(illuminance, reaction_time=0.0), step_length=0.02)
    with running(changed, fog_of(3.0 / 60.0)) as traffic:
        speed = 0.0
        while True:
            (snapshot,) = driven(traffic, 1)
            before, speed = speed, float(snapshot.state.speed[snapshot.ego])
            if snapshot.leader is not None and speed < before - 0.05:
                return snapshot.leader.gap


def test_in_dusk_a_driver_first_brakes_for_an_unlit_wreck_where_the_laws_say_without_a_jump(
    setup: TrafficSetup,
) -> None:
    setup = replace(setup, events=(LampFailureEvent("wreck", Trigger(at_time=0.0)),))
    gaps = [first_braking(setup, lux) for lux in (10.0, 9.9, 0.3)]
    # From one step to the next the ego drives 0.7 m.
    assert gaps[0] == pytest.approx(gaps[1], abs=0.75)
    for gap, lux in zip(gaps, (10.0, 9.9, 0.3), strict=True):
        assert 3.0 / 60.0 * gap == pytest.approx(DriverSight(lux).depth_limit(gap, 1.0, 0.0), abs=0.2)


@pytest.mark.parametrize("bank", [False, True])
def test_on_a_grade_sight_is_the_closed_form_over_the_way_along_the_road(
    link: LibsumoLink, bank: bool, tmp_path: Path
) -> None:
    """τ = k d, as far uphill as on the level; in uneven fog along the line between both vehicles' places."""
    far_off = FogBank((0.0, 1e6), (1.0, 0.0), 0.0, 100.0, 10.0, 0.01)
    fog = FieldAccess(FogField(0.03, (1000.0,) * 3, (far_off,) if bank else ()))
    routes = tmp_path / "two.rou.xml"
    routes.write_text(
        """<routes><vType id="c" length="5" minGap="2.5"/><route id="r" edges="road"/>
        <vehicle id="lead" type="c" route="r" depart="0" departPos="1370" departSpeed="20"/>
        <vehicle id="ego" type="c" route="r" depart="0" departPos="1300" departSpeed="20"/></routes>""",
        encoding="utf-8",
    )
    net = NET.parents[1] / "graded_motorway" / "graded.net.xml"
    api = link.begin(["--net-file", str(net), "--route-files", str(routes), "--no-step-log", "true"])
    while len(api.vehicle.getIDList()) < 2:
        link.step()
    leader, gap = api.vehicle.getLeader("ego", 200.0)
    front, ahead = (np.array(api.vehicle.getPosition3D(v)) for v in ("ego", leader))
    way = float(np.linalg.norm(ahead - front)) - 5.0
    assert gap + 2.5 == pytest.approx(way, abs=1e-3)
    assert abs(front[2] - ahead[2]) > 2.5
    view = DriversView(api, fog, DriverSight(illuminance=10_000.0), Roster(api))
    pairs = LeaderSight(view, api.vehicle.getSpeed, 0.5)
    assert pairs._facing([("ego", leader, gap)])[DEPTH] == pytest.approx([0.03 * way], rel=1e-4)


def leaves_its_lane(setup: TrafficSetup, sight: DriverSight | SeesFrom | None, model: str = "LC2013") -> bool:
    """Whether the ego, free to overtake, leaves the rightmost lane before it is 45 m from a slow vehicle there."""
    setup.routes[0].write_text(SLOW_LEADER.replace("<vType", f'<vType laneChangeModel="{model}"'), encoding="utf-8")
    with running(replace(setup, sight=sight, keep_lane=("slow",)), fog_of(0.05)) as traffic:
        while True:
            (snapshot,) = driven(traffic, 1)
            if not snapshot.state.lane[snapshot.ego].endswith("_0"):
                return True
            if snapshot.leader is not None and snapshot.leader.gap < 45.0:
                return False


def test_who_does_not_see_a_leader_does_not_overtake_it(setup: TrafficSetup) -> None:
    """SUMO's lane changing sees a slow leader through fog by itself."""
    assert leaves_its_lane(setup, None)
    assert leaves_its_lane(setup, SeesFrom(distance=400.0))
    assert not leaves_its_lane(setup, SeesFrom(distance=40.0))
    assert leaves_its_lane(setup, SeesFrom(distance=40.0), model="DK2008")  # which takes no such orders


def test_drivers_choose_a_speed_in_fog_and_only_those_who_comply_follow_advice(setup: TrafficSetup) -> None:
    """The motorway's own traffic in fog of 60 m."""
    drivers = DriverSetup(within_sight, spread=0.0, compliance=Compliance(rate=0.5))
    busy = replace(setup, routes=(early_motorway.ROUTES,), warm_up_limit=600.0, drivers=drivers)
    with running(busy, fog_of(3.0 / 60.0)) as crowd:
        state = seen(crowd).state
        others = [v for v in state.ids if v != "ego"]
        speeds = state.speed[[state.row(v) for v in others]]
        assert np.median(speeds) == pytest.approx(within_sight(60.0), abs=1.0)
        for _ in range(600):  # and the table of drivers grows
            crowd.advance(Command(advised_speeds=dict.fromkeys(others, 7.0)))
        after = seen(crowd).state
    rows = [row for v in others if (row := after.row(v)) is not None]
    slow = float(np.mean(after.speed[rows] < 8.0))
    assert 0.25 < slow < 0.95  # half comply, and some of the others are held up behind them


def mean_headway(setup: TrafficSetup, misjudgement: float) -> float:
    """Mean time headway that drivers want in fog of 30 m by night, when they see a leader's lamps [s]."""
    drivers = DriverSetup(unaffected, spread=0.0, misjudgement=misjudgement)
    changes = {"routes": (early_motorway.ROUTES,), "warm_up_limit": 600.0, "step_length": 0.1}
    changed = replace(setup, drivers=drivers, sight=DriverSight(0.1), **changes)
    with running(changed, fog_of(0.1)) as traffic:
        vehicles = load_libsumo().vehicle
        return float(np.mean([vehicles.getTau(v) for v in seen(traffic).state.ids if v != "ego"]))


def test_who_misjudges_distances_follows_closer(setup: TrafficSetup) -> None:
    # The minimum gap counts to the distance that is misjudged.
    assert mean_headway(setup, 0.6) == pytest.approx(mean_headway(setup, 0.0) / 1.6 - 0.03, rel=0.03)
