"""Looking only when sight could have changed decides in every step as looking in every step does."""

from typing import Any

import pytest

from fogsim.atmosphere import FieldAccess
from fogsim.traffic import DriverSight
from fogsim.traffic.appearance import OTHERS_LAMPS, eye_height, lamps_from_signals, paint
from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.sight import inherent_contrast
from fogsim.traffic.drivers.sight_kernels import BODY_MIDDLE
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.perception import MAX_PAUSE, REACH, Perception
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView
from fogsim.values import FogBank, FogField, Lamp
from tests.traffic.common import CROWD

STEP = 0.1
EVEN = FogField(0.04, (3000.0, 3000.0, 3000.0))
BANKS = FogField(
    0.01,
    (3000.0, 3000.0, 3000.0),
    banks=tuple(FogBank((0.0, 0.0), (1.0, 0.0), x, x + 150.0, 60.0, 0.05) for x in range(200, 3000, 300)),
)


def is_seen(api: Any, fog: FieldAccess, sight: DriverSight, pair: tuple[str, str, float], lamps: Lamp) -> bool:
    """One driver's sight, straight from the laws."""
    follower, leader, gap = pair
    height = eye_height(api.vehicle.getVehicleClass(follower), "", api.vehicle.getLength(follower))
    places = map(api.vehicle.getPosition3D, (follower, leader))
    eyes, rear = ([x, y, z + up] for (x, y, z), up in zip(places, (height, min(height, BODY_MIDDLE)), strict=True))
    distance = max(gap + api.vehicle.getMinGap(follower), 0.1)
    length = sum((b - a) ** 2 for a, b in zip(eyes, rear, strict=True)) ** 0.5
    end = [a + (b - a) * distance / length for a, b in zip(eyes, rear, strict=True)]
    (depth,) = fog.optical_depth([eyes], [end])
    lit = int(lamps if leader == "ego" else OTHERS_LAMPS) | lamps_from_signals(api.vehicle.getSignals(leader))
    contrast = inherent_contrast(paint(leader, api.vehicle.getColor(leader)))
    head_lamps = 0.0 if follower == "ego" else 1.0
    return bool(depth <= sight.depth_limit(distance, contrast, rear_intensity(lit), head_lamps))


@pytest.mark.parametrize(
    ("field", "illuminance"), [(EVEN, 10_000.0), (BANKS, 0.1), pytest.param(BANKS, 3.0, marks=pytest.mark.nightly)]
)
def test_scheduled_looks_decide_as_looks_in_every_step(link: LibsumoLink, field: FogField, illuminance: float) -> None:
    """For every leader that has been the leader for as long as a look may wait."""
    api, fog = link.begin(CROWD), FieldAccess(field)
    for _ in range(600):
        link.step()
    sight = DriverSight(illuminance, reaction_time=0.0)
    roster = Roster(api)
    perception = Perception(DriversView(api, fog, sight, roster))
    steady: dict[str, tuple[str, int]] = {}
    compared, changes, before = 0, 0, dict(perception.hidden)
    for step in range(400):
        link.step()
        lamps = Lamp.REAR_FOG if step % 100 > 50 else Lamp.NONE
        roster.update()
        perception.update({"ego": int(lamps)})
        ignored = dict(perception.hidden)
        changes += len(ignored.items() ^ before.items())
        before = ignored
        for follower in api.vehicle.getIDList():
            leader, gap = api.vehicle.getLeader(follower, REACH) or ("", 0.0)
            known, since = steady.get(follower, ("", step))
            steady[follower] = (leader, since if known == leader else step)
            if leader and (step - steady[follower][1]) * STEP > MAX_PAUSE:
                compared += 1
                seen = is_seen(api, fog, sight, (follower, leader, gap), lamps)
                assert seen == (ignored.get(follower) != leader), (step, follower, leader, gap)
    assert compared > 5000
    assert changes > 20


def test_a_look_costs_only_those_who_are_due(link: LibsumoLink) -> None:
    api = link.begin(CROWD)
    for _ in range(600):
        link.step()
    roster = Roster(api)
    perception = Perception(DriversView(api, FieldAccess(EVEN), DriverSight(10_000.0), roster))
    asked, leader = list[str](), perception.leader
    perception.leader = lambda vehicle, reach: asked.append(vehicle) or leader(vehicle, reach)
    present = 0
    for _ in range(100):
        link.step()
        roster.update()
        perception.update({"ego": 0})
        present += api.vehicle.getIDCount()
    assert set(api.vehicle.getIDList()) <= set(asked)
    assert len(asked) < 0.5 * present
