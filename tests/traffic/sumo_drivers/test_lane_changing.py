"""Drivers change lanes by what they see: in a real SUMO, with eyes that see so far and no farther."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import pytest

from fogsim.traffic import DriverSight
from fogsim.traffic.drivers.playing import Lamps
from fogsim.traffic.sumo.claims import STRATEGIC
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.drivers_perception import DriversPerception
from fogsim.traffic.sumo_drivers.lane_changing import LaneChanging, _RequestedChanges
from fogsim.traffic.sumo_drivers.neighbour_sight import Neighbours, NeighbourSight
from fogsim.traffic.sumo_drivers.perception import Perception
from fogsim.traffic.sumo_drivers.unseen import LaneChangeSwitch
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps, VehicleSight
from fogsim.values import Lamp
from tests.traffic.common import CROWD, NET, QUIET
from tests.traffic.sumo_drivers.test_perception import SeesFrom, fog_of

FREE, IN_LANE = 1621, 0
CLEAR = 1000.0


class NeverSure(SeesFrom):
    """Eyes for which nothing is near enough to be seen for certain, as at night."""

    def sure_distance(self, *_: float) -> float:
        return 0.0


class SeesNobody(VehicleSight):
    """What drivers see, but for some who see nobody."""

    def __init__(self, view: DriversView, blind: Sequence[str]) -> None:
        super().__init__(view)
        self._blind = blind

    def sees(self, pairs: Sequence[tuple[str, str]], own_lamps: OwnLamps) -> list[bool]:
        seen = super().sees(pairs, own_lamps)
        return [is_seen and pair[0] not in self._blind for pair, is_seen in zip(pairs, seen, strict=True)]


@dataclass
class Road:
    """A road with vehicles whose drivers see so far."""

    link: LibsumoLink
    folder: Path
    options: Sequence[str] = ()
    api: Api = None
    roster: Roster = field(init=False)
    parts: list[Perception | LaneChanging] = field(default_factory=list)

    def enter(self, vehicles: str, reach: float, free: Sequence[str] = ("ego",), blind: Sequence[str] = ()) -> Api:
        """Put vehicles on the motorway; all but those that are free keep their lanes."""
        routes = self.folder / "lanes.rou.xml"
        routes.write_text(
            '<routes><route id="r" edges="approach bank exit"/><vType id="c" sigma="0" speedDev="0" length="4.6" '
            f'collisionMinGapFactor="0"/>{vehicles}</routes>',
            encoding="utf-8",
        )
        files = ["--net-file", str(NET), "--route-files", str(routes), "--step-length", "0.1"]
        warn = ["--collision.action", "warn", "--collision.stoptime", "1000"]
        self.api = api = self.link.begin([*files, *QUIET, *warn, *self.options])
        self.link.step()
        for vehicle in api.vehicle.getIDList():
            api.vehicle.setLaneChangeMode(vehicle, FREE if vehicle in free else IN_LANE)
        self.roster = Roster(api)
        view = DriversView(api, fog_of(0.05), (NeverSure if blind else SeesFrom)(distance=reach), self.roster)
        leaders = Perception(view)
        self.parts = [leaders, LaneChanging(view, leaders, SeesNobody(view, blind))]
        return api

    def step(self) -> None:
        self.roster.update()
        for part in self.parts:
            part.update({})
        self.link.step()

    def until(self, happens: Callable[[], bool], steps: int = 300) -> bool:
        """Whether something happens within so many steps."""
        for _ in range(steps):
            self.step()
            if happens():
                return True
        return False

    def is_within(self, distance: float, follower: str, leader: str) -> bool:
        """Whether one has come so near to another that is ahead."""
        place = self.api.vehicle.getLanePosition
        return bool(place(leader) - place(follower) < distance)

    def is_in_lane(self, name: str, lane: int) -> bool:
        return bool(self.api.vehicle.getLaneIndex(name) == lane)

    def collided(self) -> bool:
        return bool(self.api.simulation.getCollisions())


@pytest.fixture
def road(link: LibsumoLink, tmp_path: Path) -> Road:
    return Road(link, tmp_path)


def vehicle(name: str, place: float, speed: float, lane: int, top: float | None = None, inside: str = "") -> str:
    top = max(speed, 0.1) if top is None else top
    return (
        f'<vType id="{name}s" sigma="0" speedDev="0" length="4.6" maxSpeed="{top}" collisionMinGapFactor="0"/>'
        f'<vehicle id="{name}" type="{name}s" route="r" depart="0" departPos="{place}" departSpeed="{speed}" '
        f'departLane="{lane}" insertionChecks="none">{inside}</vehicle>'
    )


OVERTAKER = vehicle("ego", 200, 20, 0, top=33) + vehicle("slow", 225, 15, 0)
STOP = '<stop lane="approach_{lane}" endPos="{place}" startPos="0" duration="10000"/>'


def standing(name: str, place: float, lane: int) -> str:
    return vehicle(name, place, 0, lane, top=20, inside=STOP.format(lane=lane, place=place))


def test_an_overtaker_pulls_out_before_who_comes_unseen_from_behind(road: Road) -> None:
    """In clear air it waits until the fast one is past; in fog the fast one brakes for it, from where it sees it."""
    fast = vehicle("fast", 150, 33, 1)
    api = road.enter(OVERTAKER + fast, CLEAR)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 1)
    assert api.vehicle.getLanePosition("fast") > api.vehicle.getLanePosition("ego")
    api = road.enter(OVERTAKER + fast, 30.0)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 1)
    assert 30.0 < api.vehicle.getLanePosition("ego") - api.vehicle.getLanePosition("fast") < 50.0
    # What it does from now on belongs to a driver who was not asked to let anybody in.
    assert api.vehicle.getSpeed("fast") == pytest.approx(33.0)
    assert road.until(lambda: api.vehicle.getAcceleration("fast") < -4.0)


def test_so_does_an_overtaker_of_the_sublane_model(road: Road) -> None:
    road.options = ("--lateral-resolution", "0.8")
    vehicles = (OVERTAKER + vehicle("fast", 130, 33, 1)).replace("<vType ", '<vType laneChangeModel="SL2015" ')
    is_ahead = []
    for reach in (CLEAR, 30.0):
        api = road.enter(vehicles, reach)
        assert road.until(functools.partial(road.is_in_lane, "ego", 1))
        is_ahead.append(road.is_within(500.0, "fast", "ego") and not road.is_within(0.0, "fast", "ego"))
        assert not road.until(road.collided, 50)
        assert api.vehicle.getLaneChangeMode("ego") == FREE
    assert is_ahead == [False, True]


def test_an_overtaker_meets_who_stands_unseen_in_the_other_lane(road: Road) -> None:
    """Ahead is a slower vehicle in sight, and out of sight in the other lanes somebody stands."""
    leader, place = vehicle("ego", 200, 30, 0, top=33) + vehicle("slow", 230, 24, 0), 320.0
    vehicles = leader + standing("wreck", place, 1) + standing("wreck2", place, 2)
    api = road.enter(vehicles, CLEAR)
    assert road.until(lambda: api.vehicle.getLanePosition("ego") > place)
    assert api.vehicle.getLaneIndex("ego") == 0
    api = road.enter(vehicles, 30.0)
    assert road.until(road.collided)
    (hit,) = api.simulation.getCollisions()
    assert (hit.collider, hit.victim) == ("ego", "wreck")
    assert hit.colliderSpeed > 15.0


def test_who_is_seen_holds_an_overtaker_back_though_another_is_not(road: Road) -> None:
    """In the lane to the left somebody stands out of sight; somebody else there comes from behind, in sight."""
    vehicles = OVERTAKER + standing("wreck", 300, 1) + vehicle("fast", 178, 33, 1)
    api = road.enter(vehicles, 30.0)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 1 or road.is_within(-5.0, "fast", "ego"))
    assert api.vehicle.getLaneIndex("ego") == 0


def test_nobody_pulls_out_into_another_in_any_fog(road: Road) -> None:
    api = road.enter(OVERTAKER + vehicle("beside", 201, 20, 1), 0.5)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 1)
    assert abs(api.vehicle.getLanePosition("beside") - api.vehicle.getLanePosition("ego")) > 4.6
    assert not road.collided()


def test_nobody_leaves_the_lane_for_a_leader_that_stands_out_of_sight(road: Road) -> None:
    """SUMO's drivers do at 100 m; here it is seen at 30 m, and then the lane is left."""
    gaps = []
    for reach in (CLEAR, 30.0):
        api = road.enter(vehicle("ego", 200, 20, 1) + standing("wreck", 400, 1), reach)
        while api.vehicle.getLaneIndex("ego") == 1:
            road.step()
        gaps.append(400.0 - 4.6 - api.vehicle.getLanePosition("ego"))
    assert gaps[0] == pytest.approx(100.0, abs=5.0)
    assert 20.0 < gaps[1] < 30.0


def test_who_must_leave_the_lane_for_the_route_does_so_whoever_stands_unseen(road: Road) -> None:
    api = road.enter(vehicle("ego", 200, 20, 1) + standing("wreck", 400, 1), 30.0)
    api.vehicle.setStop("ego", "approach", pos=395.0, laneIndex=0, duration=5.0)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 0)
    assert 400.0 - api.vehicle.getLanePosition("ego") > 40.0


def test_nobody_falls_back_behind_whom_they_do_not_see_in_the_lane_to_the_left(road: Road) -> None:
    """As overtaking on the right is forbidden, SUMO's drivers do."""
    speeds = []
    for reach in (CLEAR, 30.0):
        api = road.enter(vehicle("ego", 200, 30, 0) + vehicle("tractor", 400, 5, 1), reach, free=())
        assert road.until(functools.partial(road.is_within, 35.0, "ego", "tractor"))
        speeds.append(api.vehicle.getSpeed("ego"))
    assert speeds[0] < 20.0
    assert speeds[1] == pytest.approx(30.0)


def test_nobody_makes_room_for_whom_they_do_not_see(road: Road) -> None:
    """Who must get to the left for the stop there sees who comes from behind in that lane."""
    stop = '<stop lane="approach_1" endPos="600" duration="100"/>'
    vehicles = vehicle("asker", 400, 15, 0, inside=stop) + vehicle("helper", 340, 30, 1)
    speeds = []
    for blind in ((), ("helper",)):
        api = road.enter(vehicles, 80.0, free=("asker",), blind=blind)
        assert not road.until(road.collided, 15)
        speeds.append(api.vehicle.getSpeed("helper"))
    # It was asked before its first look, too.
    assert speeds[0] < 25.0
    assert speeds[1] > 28.0


def test_who_keeps_the_lane_keeps_it(road: Road) -> None:
    api = road.enter(OVERTAKER + standing("wreck", 300, 1) + vehicle("fast", 150, 33, 1), 30.0, free=())
    assert not road.until(lambda: api.vehicle.getLaneIndex("ego") != 0, 100)


def test_in_clear_air_traffic_is_that_of_sumo_alone(road: Road) -> None:
    """To the last bit, by night too, when nothing is sure to be seen before it is looked at."""

    def drive(illuminance: float | None) -> list[tuple[str, str, float]]:
        api = road.link.begin(CROWD)
        for _ in range(300):
            road.link.step()
        perception = None
        if illuminance is not None:
            perception = DriversPerception(DriversView(api, fog_of(0.0), DriverSight(illuminance), Roster(api)))
        for _ in range(200):
            if perception is not None:
                perception.update({"ego": Lamp.POSITION | Lamp.LOW_BEAM}, Lamps())
            road.link.step()
        get = api.vehicle
        return [(v, get.getLaneID(v), get.getLanePosition(v)) for v in get.getIDList()]

    assert drive(0.1) == drive(10_000.0) == drive(None)


def test_everything_is_given_back(road: Road) -> None:
    parameters = [f"laneChangeModel.lc{name}" for name in ("Strategic", "OvertakeRight", "Cooperative", "SpeedGain")]
    vehicles = vehicle("ego", 200, 20, 1) + standing("wreck", 300, 1) + standing("wreck2", 320, 2)
    api = road.enter(vehicles, 20.0)

    def state() -> list[str]:
        return [api.vehicle.getParameter("ego", p) for p in parameters] + [str(api.vehicle.getLaneChangeMode("ego"))]

    own = state()
    assert not road.until(road.collided, 10)
    assert [state()[n] != own[n] for n in range(5)] == [True, True, False, True, False]
    for part in road.parts:
        part.release()
    assert state() == own


def test_who_has_come_into_view_is_reacted_to_after_the_reaction_time() -> None:
    class Eyes:
        seen = False

        def sees(self, pairs: Sequence[tuple[str, str]], _: OwnLamps) -> list[bool]:
            return [self.seen] * len(pairs)

    eyes, pair = Eyes(), ("driver", "other")
    sight = NeighbourSight(cast("VehicleSight", eyes), reaction_time=1.0)
    assert not sight.perceive([pair], {}, 0.0)[pair]
    eyes.seen = True
    assert [sight.perceive([pair], {}, time)[pair] for time in (0.5, 0.9, 1.0, 1.5)] == [False, False, True, True]


def test_a_hidden_leader_may_have_left_since_the_last_look_ahead(road: Road) -> None:
    api = road.enter(vehicle("ego", 200, 20, 1) + standing("wreck", 300, 1), 30.0)
    leaders, lanes = road.parts
    road.step()
    api.vehicle.remove("wreck")
    for _ in range(6):
        road.link.step()
        road.roster.update()
        lanes.update({})
    assert isinstance(leaders, Perception)
    assert leaders.hidden == {"ego": "wreck"}
    assert road.until(lambda: leaders.hidden == {}, 8)


def test_who_comes_back_from_a_teleport_changes_lanes_as_before(link: LibsumoLink) -> None:
    """After a collision, as SUMO has it by default: of drivers who have not seen the other one."""
    api = link.begin(CROWD)
    while len(api.vehicle.getIDList()) < 3:
        link.step()
    driver = min(api.vehicle.getIDList())

    def changing() -> tuple[float, int]:
        return STRATEGIC.read(api.vehicle, driver), api.vehicle.getLaneChangeMode(driver)

    usual, lanes = changing(), 1 if api.vehicle.getLaneIndex(driver) == 0 else -1
    switch, requests = LaneChangeSwitch(api, STRATEGIC, -1.0, "1"), _RequestedChanges(api, "1")
    switch.turn_on(driver)
    assert requests.ask(driver, lanes, 1.0)
    requests.end(set(), 2.0)
    for part in (switch, requests):
        part.restart([driver], set())
    assert changing() == (-1.0, usual[1] & ~0x300 | 0x100)
    for part in (switch, requests):
        part.restart([driver], {driver})
    assert changing() == usual


@pytest.mark.parametrize("options", [(), ("--lateral-resolution", "0.8")])
def test_who_is_near_in_the_lane_to_the_left_need_not_be_looked_for(road: Road, options: Sequence[str]) -> None:
    """SUMO names that vehicle, or a nearer one, in a lane of either edge and next to who changes lanes."""
    road.options = options
    names = [f"v{number}" for number in range(45)]
    crowd = "".join(
        vehicle(name, 900.0 - 7.0 * number, 15.0 + number % 7, number % 3, top=33.0)
        for number, name in enumerate(names)
    )
    api = road.enter(crowd, CLEAR, free=names)
    neighbours, reach, found = (
        Neighbours(DriversView(api, fog_of(0.05), SeesFrom(distance=CLEAR), road.roster)),
        40.0,
        0,
    )
    for _ in range(150):
        road.link.step()
        present = api.vehicle.getIDList()
        left = dict(zip(present, neighbours.left_leaders(present), strict=True))
        near = [v for v in present for o in present if neighbours.is_ahead_on_the_left(v, o, reach)]
        assert all(left[v][1] <= reach for v in near)
        found += len(near)
    assert found > 1000
