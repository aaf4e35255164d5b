"""What highway-env's drivers do next to following their leader.

Its environments let their road decide for everyone (``act``) in each simulation step; here the road decides after the
drivers have chosen their speeds, and before the script has its way. IDM and MOBIL stay as they are.
"""

import math
from collections.abc import Mapping, Sequence

from highway_env.vehicle.behavior import IDMVehicle

from fogsim.traffic.drivers.events import Event
from fogsim.traffic.drivers.sight import DriverSight, FogAccess
from fogsim.traffic.drivers.speed_choice import DriverSetup
from fogsim.traffic.highway.desired_speeds import HighwayDesiredSpeeds
from fogsim.traffic.highway.fleet import Fleet, acceleration
from fogsim.traffic.highway.manoeuvres import Manoeuvres
from fogsim.traffic.highway.perception import limit_sight
from fogsim.values import Command, Unplayed
from fogsim.values.script import TrafficAction


class DriverControl:
    """Stands in for the method ``act`` of one road (`advice_deceleration` [m/s²])."""

    def __init__(
        self,
        fleet: Fleet,
        setup: DriverSetup,
        events: Sequence[Event],
        seed: int,
        advice_deceleration: float,
        sight: DriverSight | None = None,
    ) -> None:
        self.command = Command()
        self._fleet = fleet
        self._sight = sight
        self._desired_speeds = HighwayDesiredSpeeds(fleet, setup, seed, advice_deceleration, sight)
        self._manoeuvres = Manoeuvres(fleet, events)

    def enter_fog(self, fog: FogAccess) -> None:
        """Let the drivers choose their speeds in a fog, and see only what it lets them see."""
        self._desired_speeds.fog = fog
        if self._sight is not None:
            limit_sight(fog, self._fleet, self._sight)

    def heard(self) -> Mapping[str, float]:
        """What everyone has heard advised, the ego its own [m/s]."""
        own, ego = self.command.advice.speed, self._fleet.name(self._fleet.ego)
        return self._desired_speeds.heard if math.isinf(own) else {**self._desired_speeds.heard, ego: own}

    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin what a script asks for; see `Manoeuvres.begin`."""
        return self._manoeuvres.begin(actions)

    def unplayed(self, keep_lane: Sequence[str]) -> Unplayed:
        """List what has not been played so far; see `Manoeuvres.unplayed`."""
        return self._manoeuvres.unplayed(keep_lane)

    def __call__(self) -> None:
        """Decide for everyone on the road."""
        road = self._fleet.environment.road
        self._desired_speeds.update(self.command)
        orders = self._manoeuvres.plan()
        type(road).act(road)
        self._manoeuvres.apply(orders)


def hold_at_standstill(fleet: Fleet) -> None:
    """Let no one who drives by IDM back away: its acceleration has no end at standstill."""
    for vehicle in fleet.environment.road.vehicles:
        if isinstance(vehicle, IDMVehicle):
            stopping = -vehicle.speed / fleet.step_length
            vehicle.action["acceleration"] = max(acceleration(vehicle), stopping)


def control_drivers(
    fleet: Fleet,
    setup: DriverSetup,
    events: Sequence[Event],
    seed: int,
    advice_deceleration: float,
    sight: DriverSight | None = None,
) -> DriverControl:
    """Let the drivers of an environment choose speeds and play a script, until its next reset; see `DriverControl`.

    Parameters
    ----------
    fleet, setup, events, seed, advice_deceleration, sight
        See `DriverControl`.
    """
    control = DriverControl(fleet, setup, events, seed, advice_deceleration, sight)
    # On this one road, not in the library: other environments of the process go on as they are.
    fleet.environment.road.act = control
    return control
