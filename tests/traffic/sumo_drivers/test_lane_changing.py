"""Drivers change lanes by what they see: in a real SUMO, with eyes that see so far and no farther."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.lane_changing import LaneChanging
from fogsim.traffic.sumo_drivers.perception import Perception
from fogsim.traffic.sumo_drivers.vehicle_sight import VehicleSight
from tests.traffic.sumo_drivers.test_perception import NET, Fog, SeesFrom

FREE, IN_LANE = 1621, 0
CLEAR = 1000.0


class SeesSoFar(SeesFrom):
    """Eyes that see every side of every vehicle from a fixed distance on."""

    def depth_limit(self, distance: float, *_: float) -> float:
        return self.body_limit(distance, 0.0)


@dataclass
class Road:
    """A road with vehicles whose drivers see so far."""

    link: LibsumoLink
    folder: Path
    api: Api = None
    parts: list[Perception | LaneChanging] = field(default_factory=list)

    def enter(self, vehicles: str, reach: float, free: Sequence[str] = ("ego",), options: Sequence[str] = ()) -> Api:
        """Put vehicles on the motorway; all but those that are free keep their lanes."""
        routes = self.folder / "lanes.rou.xml"
        routes.write_text(
            '<routes><route id="r" edges="approach bank exit"/><vType id="c" sigma="0" speedDev="0" length="4.6" '
            f'collisionMinGapFactor="0"/>{vehicles}</routes>',
            encoding="utf-8",
        )
        files = ["--net-file", str(NET), "--route-files", str(routes), "--step-length", "0.1"]
        quiet = ["--no-step-log", "true", "--no-warnings", "true", "--collision.action", "warn"]
        self.api = api = self.link.begin([*files, *quiet, "--collision.stoptime", "1000", *options])
        self.link.step()
        for vehicle in api.vehicle.getIDList():
            api.vehicle.setLaneChangeMode(vehicle, FREE if vehicle in free else IN_LANE)
        roster, sight, fog = Roster(api), SeesSoFar(reach), Fog(0.05)
        leaders = Perception(api, fog, sight, roster)

        eyes = VehicleSight(api, fog, sight)
        self.parts = [leaders, LaneChanging(api, fog, sight, roster, leaders, eyes, False, "1")]
        return api

    def step(self) -> None:
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

    def collided(self) -> bool:
        return bool(self.api.simulation.getCollisions())


@pytest.fixture
def road(tmp_path: Path) -> Iterator[Road]:
    link = LibsumoLink()
    yield Road(link, tmp_path)
    link.end()


def vehicle(name: str, place: float, speed: float, lane: int, top: float | None = None, inside: str = "") -> str:
    top = max(speed, 0.1) if top is None else top
    return (
        f'<vType id="{name}s" sigma="0" speedDev="0" length="4.6" maxSpeed="{top}" collisionMinGapFactor="0"/>'
        f'<vehicle id="{name}" type="{name}s" route="r" depart="0" departPos="{place}" departSpeed="{speed}" '
        f'departLane="{lane}">{inside}</vehicle>'
    )


OVERTAKER = vehicle("ego", 200, 20, 0, top=33) + vehicle("slow", 225, 15, 0)


def test_an_overtaker_meets_who_comes_from_behind_unseen(road: Road) -> None:
    """Clear air: it waits until the fast one is past. Fog: it pulls out, and the other brakes as hard as it can."""
    fast = vehicle("fast", 150, 33, 1)
    api = road.enter(OVERTAKER + fast, CLEAR)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 1)
    assert api.vehicle.getLanePosition("fast") > api.vehicle.getLanePosition("ego")
    api = road.enter(OVERTAKER + fast, 25.0)
    assert road.until(lambda: api.vehicle.getLaneIndex("ego") == 1, 20)
    gap = api.vehicle.getLanePosition("ego") - api.vehicle.getLanePosition("fast")
    assert 25.0 < gap < 50.0
    hardest = 0.0
    for _ in range(60):
        road.step()
        hardest = min(hardest, api.vehicle.getAcceleration("fast"))
    assert hardest < -4.0 or road.collided()
