"""What rides in one equipped vehicle, from the traffic around it to what it is advised and lights."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from fogsim.core.randomness import spawn_streams
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.run_config import RunConfig
from fogsim.values import (
    Command,
    EquippedVehicle,
    FogReport,
    Leader,
    RoadNetwork,
    SignMap,
    SpeedAdvice,
    TrafficSnapshot,
    TrafficState,
)
from fogsim.values.script import Actions


@dataclass(frozen=True, slots=True)
class Lookout:
    """Where an equipped vehicle is at one instant."""

    vehicle_id: str  # Its id
    place: float  # How far along the ego's route it is [m]
    speed_limit: float  # Of its road [m/s]
    leader: Leader | None  # The vehicle ahead in its lane


@dataclass(frozen=True, slots=True)
class Instant:
    """What all equipped vehicles have in common."""

    index: int  # Number of the camera period
    time: float  # Simulated time since the run began [s]
    traffic: TrafficState  # Every vehicle
    route_length: float  # Of the ego's route [m]
    # Ids of vehicles and names of sensors next to the road, and what their cameras saw in their last pictures
    sent: tuple[tuple[str, FogReport], ...]


class OnBoardUnit:
    """Camera, sensors, estimators, belief, adviser and lighting policy of an equipped vehicle.

    Faults of sensors are the ego's alone. Where drivers are advised by signs, in every car or
    by law, it hears what all hear there, and has no advice of its own.
    """

    def __init__(self, config: RunConfig) -> None:
        self._config = replace(config, sensors=replace(config.sensors, faults=()))
        self._equipment = EgoEquipment(self._config)
        self._hears_all = config.advice.sections is not None
        self._policy = self._new_policy()
        self._command = Command()

    def _new_policy(self) -> AdvisedDriving:
        return AdvisedDriving(self._config.advice, self._config.periods.decision_frames)

    def start(self, seed: int, vehicle: str, body: str, network: Callable[[], tuple[RoadNetwork, SignMap]]) -> None:
        """Begin to ride in a vehicle."""
        self._policy, self._command = self._new_policy(), Command()
        self._equipment.start_run(spawn_streams(seed, vehicle), network, body)

    def begin(self, actions: Actions, time: float, first_time: float) -> None:
        """Let begin what a script asks of fog and light; see `EgoEquipment.begin` (`time`, `first_time` [s])."""
        self._equipment.begin(replace(actions, faults=()), time, first_time)

    def look(self, lookout: Lookout, now: Instant) -> EquippedVehicle:
        """See, measure, estimate, believe and decide."""
        row = now.traffic.ids.index(lookout.vehicle_id)
        snapshot = TrafficSnapshot(
            now.traffic, row, lookout.place, now.route_length, lookout.speed_limit, lookout.leader, ()
        )
        step = self._equipment.complete_step(now.index, now.time, snapshot, self._command, None, now.sent)
        self._command = self._policy.decide(step, self._command)
        return EquippedVehicle(
            lookout.vehicle_id,
            lookout.place,
            step.truth.extinction,
            step.truth.extinction_ahead,
            step.estimates,
            step.belief,
            SpeedAdvice() if self._hears_all else self._command.advice,
            self._command.lamps,
        )

    def close(self) -> None:
        """Free the renderer; closing twice is allowed."""
        self._equipment.close()


class UnitPool:
    """On-board units of several vehicles in one process; one that is free again rides in the next vehicle."""

    def __init__(self, config: RunConfig) -> None:
        self._config = config
        self._riding: dict[str, OnBoardUnit] = {}
        self._free: list[OnBoardUnit] = []
        self._seed = 0
        self._network: tuple[RoadNetwork, SignMap] | None = None
        self._begun: list[tuple[Actions, float, float]] = []
        self._asked: tuple[Sequence[Lookout], Instant] | None = None

    def start_run(self, seed: int, network: tuple[RoadNetwork, SignMap]) -> None:
        """Begin a run in which no one is equipped yet."""
        if self._network is not None and self._network[0] is not network[0]:
            self.close()
        self._seed, self._network, self._begun, self._asked = seed, network, [], None
        self._release(self._riding)

    def begin(self, actions: Actions, time: float, first_time: float) -> None:
        """Let begin what a script asks of fog and light, for those who come later too."""
        self._begun.append((actions, time, first_time))
        for unit in self._riding.values():
            unit.begin(actions, time, first_time)

    def ask(self, lookouts: Sequence[Lookout], now: Instant) -> None:
        """Say who is to look; `answer` lets them."""
        self._asked = lookouts, now

    def answer(self) -> list[EquippedVehicle]:
        """What those who were asked see."""
        return [] if self._asked is None else self.look(*self._asked)

    def look(self, lookouts: Sequence[Lookout], now: Instant) -> list[EquippedVehicle]:
        """Let all look; who is not among them any more has left."""
        self._release([one for one in self._riding if one not in {lookout.vehicle_id for lookout in lookouts}])
        return [self._unit(lookout.vehicle_id, now.traffic).look(lookout, now) for lookout in lookouts]

    def _unit(self, vehicle: str, traffic: TrafficState) -> OnBoardUnit:
        if vehicle not in self._riding:
            network = self._network
            if network is None:
                raise RuntimeError("start_run comes before look")
            unit = self._free.pop() if self._free else OnBoardUnit(self._config)
            unit.start(self._seed, vehicle, traffic.types[traffic.ids.index(vehicle)], lambda: network)
            for begun in self._begun:
                unit.begin(*begun)
            self._riding[vehicle] = unit
        return self._riding[vehicle]

    def _release(self, vehicles: Iterable[str]) -> None:
        self._free += [self._riding.pop(vehicle) for vehicle in list(vehicles)]

    def close(self) -> None:
        """Free all renderers; closing twice is allowed."""
        self._release(self._riding)
        for unit in self._free:
            unit.close()
        self._free = []
