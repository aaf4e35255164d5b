"""Traffic by SUMO in this process, through libsumo."""

import math
from types import ModuleType

import numpy as np

from fogsim.errors import SimulationError
from fogsim.traffic.appearance import body_kind, lamps_from_signals, paint
from fogsim.traffic.events import Script
from fogsim.traffic.governor import governed_speed
from fogsim.traffic.network import read_net, road_network, sign_map
from fogsim.traffic.setup import TrafficSetup
from fogsim.traffic.sumo_library import load_libsumo, start_simulation
from fogsim.values import (
    Collision,
    Command,
    Lamp,
    Leader,
    RoadNetwork,
    SignMap,
    TrafficSnapshot,
    TrafficState,
)

LEADER_RANGE = 500.0
"""How far ahead a leader is looked for [m]."""

OTHERS_LAMPS = Lamp.POSITION | Lamp.LOW_BEAM
"""Lamps that other drivers light in fog, as the law of most countries asks by day."""

_NO_LANE_CHANGES = 0
_SUMO_DRIVES = -1.0


class LibsumoTraffic:
    """SUMO inside this process; one at a time.

    Parameters
    ----------
    setup : TrafficSetup
        The simulation and its ego.
    """

    def __init__(self, setup: TrafficSetup) -> None:
        self._setup = setup
        self._sumo: ModuleType | None = None
        self._static: dict[str, _Static] = {}
        self._governed: set[str] = set()
        self._collided: set[tuple[str, str]] = set()
        self._script = Script(())
        self._ego_lamps = Lamp.NONE
        self._route_offset = 0.0
        self._route_length = 0.0

    @property
    def _library(self) -> ModuleType:
        if self._sumo is None:
            raise SimulationError("the traffic simulation has not been started, or is closed")
        return self._sumo

    def start(self, seed: int) -> None:
        """Begin, or begin anew, and run until the ego is on the road; see `Traffic.start`."""
        sumo = load_libsumo()
        start_simulation(sumo, self._arguments(seed), running_here=self._sumo is not None)
        self._sumo = sumo
        self._static, self._governed, self._collided = {}, set(), set()
        self._script = Script(self._setup.events)
        self._ego_lamps = Lamp.NONE
        try:
            self._warm_up()
        except SimulationError:
            self.close()
            raise

    def _arguments(self, seed: int) -> list[str]:
        setup = self._setup
        arguments = [
            "--net-file",
            str(setup.net),
            "--step-length",
            repr(setup.step_length),
            "--seed",
            str(seed),
        ]
        for option, paths in (("--route-files", setup.routes), ("--additional-files", setup.additional)):
            if paths:
                arguments += [option, ",".join(map(str, paths))]
        quiet = ["--no-step-log", "true", "--duration-log.disable", "true", "--no-warnings", "true"]
        # Nobody is beamed away: collisions stay where they happen and are counted.
        physical = ["--time-to-teleport", "-1", "--collision.action", "warn"]
        return arguments + quiet + physical

    def _warm_up(self) -> None:
        sumo, ego = self._library, self._setup.ego
        while ego not in sumo.vehicle.getIDList():
            if sumo.simulation.getTime() > self._setup.warm_up_limit or sumo.simulation.getMinExpectedNumber() == 0:
                raise SimulationError(
                    f"the ego {ego!r} did not appear within {sumo.simulation.getTime():g} s of simulated time "
                    f"(traffic.warm_up_limit_s is {self._setup.warm_up_limit:g}); "
                    "is there a vehicle of that id in the route files?"
                )
            self._step()
        self._route_offset = sumo.vehicle.getLanePosition(ego) - sumo.vehicle.getDistance(ego)
        self._route_length = sum(sumo.lane.getLength(f"{edge}_0") for edge in sumo.vehicle.getRoute(ego))

    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Roads and signs; see `Traffic.network`."""
        net = read_net(self._setup.net)
        route = self._library.vehicle.getRoute(self._setup.ego)
        return road_network(net, route), sign_map(net, self._setup.additional)

    def advance(self, command: Command) -> None:
        """Move by one traffic step; see `Traffic.advance`."""
        sumo = self._library
        present = set(sumo.vehicle.getIDList())
        self._ego_lamps = command.lamps
        targets = dict(command.advised_speeds)
        targets[self._setup.ego] = command.advice.speed
        braking = self._setup.advice_deceleration
        orders = {vehicle: (target, braking) for vehicle, target in targets.items() if vehicle in present}
        # What is scripted comes last, so that it overrides advice.
        orders |= self._script.orders(sumo.simulation.getTime(), present, sumo.vehicle.getDistance)
        self._govern(orders)
        self._governed &= present
        self._step()

    def _step(self) -> None:
        sumo = self._library
        sumo.simulationStep()
        for vehicle in set(self._setup.keep_lane).intersection(sumo.simulation.getDepartedIDList()):
            sumo.vehicle.setLaneChangeMode(vehicle, _NO_LANE_CHANGES)

    def _govern(self, orders: dict[str, tuple[float, float]]) -> None:
        vehicles, step_length = self._library.vehicle, self._setup.step_length
        for vehicle, (target, deceleration) in orders.items():
            allowed = min(target, vehicles.getAllowedSpeed(vehicle)) if math.isfinite(target) else target
            asked = governed_speed(vehicles.getSpeed(vehicle), allowed, deceleration, step_length)
            if math.isfinite(asked):
                vehicles.setSpeed(vehicle, asked)
                self._governed.add(vehicle)
            elif vehicle in self._governed:
                vehicles.setSpeed(vehicle, _SUMO_DRIVES)
                self._governed.discard(vehicle)

    def observe(self) -> TrafficSnapshot | None:
        """Tell where everybody near the ego is; see `Traffic.observe`."""
        sumo, ego = self._library, self._setup.ego
        collisions = self._new_collisions()
        if ego not in sumo.vehicle.getIDList():
            return None
        state = self._state()
        return TrafficSnapshot(
            state=state,
            ego=state.ids.index(ego),
            route_position=self._route_offset + sumo.vehicle.getDistance(ego),
            route_length=self._route_length,
            speed_limit=sumo.lane.getMaxSpeed(sumo.vehicle.getLaneID(ego)),
            leader=self._leader(),
            collisions=collisions,
        )

    def _state(self) -> TrafficState:
        vehicles, ego = self._library.vehicle, self._setup.ego
        ids = tuple(vehicles.getIDList())
        everybody = np.array([vehicles.getPosition3D(v) for v in ids])
        near = np.hypot(*(everybody - everybody[ids.index(ego)]).T[:2]) <= self._setup.reading_radius
        ids = tuple(v for v, is_near in zip(ids, near, strict=True) if is_near)
        static = [self._static_of(v) for v in ids]
        lamps = [int(OTHERS_LAMPS) | lamps_from_signals(vehicles.getSignals(v)) for v in ids]
        stop = int(Lamp.STOP) & lamps[ids.index(ego)]
        lamps[ids.index(ego)] = int(self._ego_lamps) | stop
        return TrafficState(
            time=self._library.simulation.getTime(),
            ids=ids,
            types=tuple(s.kind for s in static),
            position=everybody[near],
            heading=np.radians(90.0 - np.array([vehicles.getAngle(v) for v in ids])),
            speed=np.array([vehicles.getSpeed(v) for v in ids]),
            acceleration=np.array([vehicles.getAcceleration(v) for v in ids]),
            length=np.array([s.size[0] for s in static]),
            width=np.array([s.size[1] for s in static]),
            height=np.array([s.size[2] for s in static]),
            lane=tuple(vehicles.getLaneID(v) for v in ids),
            lamps=np.array(lamps, dtype=np.int32),
            paint=np.array([s.paint for s in static]),
        )

    def _static_of(self, vehicle: str) -> "_Static":
        """Read what never changes once, when a vehicle is first near."""
        known = self._static.get(vehicle)
        if known is None:
            get = self._library.vehicle
            known = self._static[vehicle] = _Static(
                body_kind(get.getVehicleClass(vehicle)),
                (get.getLength(vehicle), get.getWidth(vehicle), get.getHeight(vehicle)),
                paint(vehicle, get.getColor(vehicle)),
            )
        return known

    def _leader(self) -> Leader | None:
        vehicles, ego = self._library.vehicle, self._setup.ego
        found = vehicles.getLeader(ego, LEADER_RANGE)
        if found is None or not found[0]:
            return None
        # SUMO's gap leaves out the follower's minimum gap.
        return Leader(found[0], found[1] + vehicles.getMinGap(ego), vehicles.getSpeed(found[0]))

    def _new_collisions(self) -> tuple[Collision, ...]:
        """Collisions not told before: SUMO repeats one in every step while the vehicles overlap."""
        sumo = self._library
        new = []
        for c in sumo.simulation.getCollisions():
            pair = (min(c.collider, c.victim), max(c.collider, c.victim))
            if pair not in self._collided:
                self._collided.add(pair)
                impact = abs(c.colliderSpeed - c.victimSpeed)
                new.append(Collision(sumo.simulation.getTime(), c.collider, c.victim, impact))
        return tuple(new)

    def close(self) -> None:
        """End the simulation; see `Traffic.close`."""
        if self._sumo is not None:
            self._sumo.close()
            self._sumo = None


class _Static:
    """What never changes about a vehicle: body kind, size (length, width, height) [m] and paint."""

    __slots__ = ("kind", "paint", "size")

    def __init__(self, kind: str, size: tuple[float, float, float], paint: tuple[float, float, float]) -> None:
        self.kind = kind
        self.size = size
        self.paint = paint
