"""Names and looks of highway-env's vehicles, which have neither ids nor lamps."""

from collections.abc import Mapping
from typing import Any

from fogsim.traffic.appearance import OTHERS_LAMPS, SUMO_DEFAULT_COLOUR, paint
from fogsim.values import Command, Lamp

EGO = "ego"
"""Id of the ego."""

LEAD = "lead"
"""Id of the vehicle that is ahead of the ego in its lane when the run begins, if there is one."""

_BRAKING = 0.5
"""Stop lamps are lit from this deceleration [m/s²]."""


class Fleet:
    """Vehicles of one run of one environment.

    Parameters
    ----------
    environment : highway_env.envs.common.abstract.AbstractEnv
        The environment, after its reset.
    ego : highway_env.vehicle.kinematics.Vehicle
        The ego.
    """

    def __init__(self, environment: Any, ego: Any) -> None:
        self.environment = environment
        self.ego = ego
        self.ego_lamps = Command().lamps
        self.lamps_of: Mapping[str, Lamp] = {}
        self.dark: frozenset[str] = frozenset()
        # Vehicles are equal only to themselves, so they serve as keys.
        self._names: dict[Any, str] = {ego: EGO}
        lead = ahead(environment.road, ego)
        for vehicle in environment.road.vehicles:
            if vehicle is lead:
                self._names[vehicle] = LEAD
            self.name(vehicle)

    @property
    def time(self) -> float:
        """Simulated time since the reset [s]."""
        return float(self.environment.steps / self.environment.config["simulation_frequency"])

    @property
    def step_length(self) -> float:
        """Length of a simulation step [s]."""
        return float(1.0 / self.environment.config["simulation_frequency"])

    def name(self, vehicle: Any) -> str:
        """Id of a vehicle or an obstacle, for as long as the run lasts: its kind and its place in the order of naming.

        Those on the road at the beginning are named first, in the environment's own order.

        Parameters
        ----------
        vehicle : highway_env.vehicle.kinematics.Vehicle
            The vehicle.
        """
        return self._names.setdefault(vehicle, f"{type(vehicle).__name__} {len(self._names)}")

    def known(self) -> frozenset[str]:
        """Ids of all vehicles that have been on the road."""
        return frozenset(self._names.values())

    def present(self) -> dict[str, Any]:
        """Vehicles on the road by their ids."""
        return {self.name(vehicle): vehicle for vehicle in self.environment.road.vehicles}

    def paint(self, vehicle: Any) -> tuple[float, float, float]:
        """Linear reflectance of a vehicle's paint, 0 … 1; highway-env's colours mark roles, not paints.

        Parameters
        ----------
        vehicle : highway_env.vehicle.kinematics.Vehicle
            The vehicle.
        """
        return paint(self.name(vehicle), SUMO_DEFAULT_COLOUR)

    def lamps(self, vehicle: Any) -> Lamp:
        """Lit lamps; an obstacle has none, and neither has a vehicle whose lamps have failed.

        Parameters
        ----------
        vehicle : highway_env.vehicle.kinematics.Vehicle
            The vehicle.
        """
        if not hasattr(vehicle, "action") or self.name(vehicle) in self.dark:
            return Lamp.NONE
        steady = self.ego_lamps if vehicle is self.ego else self.lamps_of.get(self.name(vehicle), OTHERS_LAMPS)
        return steady | Lamp.STOP if acceleration(vehicle) < -_BRAKING else steady


def acceleration(vehicle: Any) -> float:
    """Acceleration along the heading [m/s²]."""
    return float(vehicle.action["acceleration"])


def ahead(road: Any, vehicle: Any) -> Any:
    """What is ahead of a vehicle in its lane, seen or not; None if there is nothing."""
    # The class's own way, as the instance's may be that of drivers in fog.
    return type(road).neighbour_vehicles(road, vehicle, vehicle.lane_index)[0]
