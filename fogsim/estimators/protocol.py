"""What every estimator is to the loop."""

from typing import Protocol

from fogsim.values.estimate import Estimate
from fogsim.values.observation import Observation


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
        """Forget all earlier observations; their time may begin anew."""
        ...
