"""What every estimator is to the loop."""

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation

if TYPE_CHECKING:
    from fogsim.estimators.night.halos import HaloThreshold
    from fogsim.estimators.night.own_light import OwnLight
    from fogsim.estimators.night.veil_correlation import VeilReferences
    from fogsim.estimators.signs.operating_range import OperatingRange


class Estimator(Protocol):
    """Turns what a vehicle has at one instant into an estimate of the extinction coefficient.

    An estimator is built from the camera that the vehicle assumes and from keyword parameters of its own.
    """

    @property
    def method(self) -> str:
        """Name in the registry."""
        ...

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one observation.

        Parameters
        ----------
        observation : Observation
            What the vehicle has at this instant.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        ...

    def reset(self) -> None:
        """Forget all earlier observations; their time may begin again."""
        ...


class Calibrations(Protocol):
    """Calibrations of a camera, each made when it is first needed; InputError if the camera cannot be calibrated."""

    def veil_references(self, camera: Camera, lamps: Lamp, setback: float) -> "VeilReferences":
        """References of the lit head lamps' veil; `setback` is from the front bumper back to the camera [m]."""
        ...

    def own_light(self, camera: Camera, lamps: Lamp, setback: float, head_lamps: str) -> "OwnLight":
        """What a camera sees of the lit head lamps in any fog; see `NightRoad` for `head_lamps`."""
        ...

    def halo_threshold(self, camera: Camera) -> "HaloThreshold":
        """Sharpness of halos below which there is fog."""
        ...

    def operating_range(self, camera: Camera, diameter: float) -> "OperatingRange":
        """Distances at which signs of a diameter [m] are detected in fog."""
        ...


@runtime_checkable
class TakesCalibrations(Protocol):
    """An estimator that needs calibrations where its parameters name no file of them."""

    def take_calibrations(self, source: Calibrations) -> None:
        """Take calibrations from a source when they are first needed."""
        ...
