"""Names and looks of highway-env's vehicles, which have neither ids nor lamps."""

from typing import Any

from fogsim.traffic.appearance import SUMO_DEFAULT_COLOUR, paint
from fogsim.traffic.reading import OTHERS_LAMPS
from fogsim.values import Lamp

EGO = "ego"
"""Id of the ego."""

BRAKING = 0.5
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
        self.ego_lamps = Lamp.NONE
        # Vehicles are equal only to themselves, so they serve as keys.
        self._names: dict[Any, str] = {ego: EGO}

    @property
    def time(self) -> float:
        """Simulated time since the reset [s]."""
        return float(self.environment.steps / self.environment.config["simulation_frequency"])

    def name(self, vehicle: Any) -> str:
        """Id of a vehicle or an obstacle, for as long as the run lasts."""
        return self._names.setdefault(vehicle, f"{type(vehicle).__name__} {len(self._names)}")

    def paint(self, vehicle: Any) -> tuple[float, float, float]:
        """Linear reflectance of a vehicle's paint, 0 … 1; highway-env's colours tell roles, not paints."""
        return paint(self.name(vehicle), SUMO_DEFAULT_COLOUR)

    def lamps(self, vehicle: Any) -> Lamp:
        """Lit lamps; an obstacle has none."""
        if not hasattr(vehicle, "action"):
            return Lamp.NONE
        steady = self.ego_lamps if vehicle is self.ego else OTHERS_LAMPS
        return steady | Lamp.STOP if acceleration(vehicle) < -BRAKING else steady


def acceleration(vehicle: Any) -> float:
    """Acceleration along the heading [m/s²]."""
    return float(vehicle.action["acceleration"])
