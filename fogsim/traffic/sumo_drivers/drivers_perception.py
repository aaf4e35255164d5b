"""All that SUMO's drivers perceive only as far as it can be seen, through fog and past what stands next to roads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from fogsim.traffic.appearance import OTHERS_LAMPS
from fogsim.traffic.drivers.playing import Lamps
from fogsim.traffic.sumo_drivers.junction_sight import JunctionFoes, JunctionSight
from fogsim.traffic.sumo_drivers.lane_changing import LaneChanging
from fogsim.traffic.sumo_drivers.pedestrian_sight import PedestrianSight
from fogsim.traffic.sumo_drivers.perception import Perception
from fogsim.traffic.sumo_drivers.signal_sight import SignalSight
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps, VehicleSight
from fogsim.values import Lamp


class _PerceivedPart(Protocol):
    """What drivers perceive of one kind of thing; it does nothing where everything is certainly seen."""

    def update(self, own_lamps: OwnLamps) -> None:
        """Pass to SUMO's drivers, before a step, what they do not see."""

    def release(self) -> None:
        """Let everyone on the road see everything again, as SUMO's own drivers do."""


class DriversPerception:
    """Updates and releases the parts in turn."""

    def __init__(self, view: DriversView, net: Path | None = None) -> None:
        self._roster = view.roster
        leaders, sight = Perception(view), VehicleSight(view)
        self._parts: tuple[_PerceivedPart, ...] = (
            leaders,
            LaneChanging(view, leaders, sight),
            JunctionSight(view, JunctionFoes(view.api, net), sight),
            SignalSight(view),
            PedestrianSight(view),
        )

    def update(self, lamps_of: Mapping[str, Lamp], lamps: Lamps) -> None:
        """Pass to SUMO's drivers, before a step, what they do not see."""
        self._roster.update()
        own_lamps: OwnLamps = {vehicle: int(lit) for vehicle, lit in lamps_of.items()}
        for vehicle in lamps.vehicles:
            own_lamps[vehicle] = lamps.switched(vehicle, own_lamps.get(vehicle, int(OTHERS_LAMPS)))
        for part in self._parts:
            part.update(own_lamps)

    def release(self) -> None:
        """Let everyone on the road see everything again."""
        for part in self._parts:
            part.release()
