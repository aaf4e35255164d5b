"""Fog by a forward-scatter sensor on board, which measures the air at the vehicle."""

import math
from collections import deque
from typing import Annotated

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import Observation

REACH = 10.0
"""How far its estimates speak of the fog [m]: a tenth of a litre of air at the bumper, and what is like it."""

_LEAST_DEVIATION = extinction_from_visibility(20_000.0)
"""Standard deviation of k in clear air [1/m]: the end of a PWD22's range."""


@checked_parameters
class Scatterometer:
    """Extinction coefficient by a forward-scatter sensor on board (`sensors.scatterometer`), by day and night.

    It measures the fog at the vehicle and not that of the road ahead, so its `reach` is short. Its deviation is that of
    the sensor, and by how much its values have changed in about the time over which it averages: so long it lags behind
    where fog begins. An error of the calibration is the same in all values of a drive, and does not average out.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    relative_deviation : float
        Standard deviation of a value relative to k [-].
    calibration_deviation : float
        Standard deviation of the sensor's calibration relative to k [-].
    averaging_time : float
        Time constant of the sensor's average [s].
    """

    method = "scatterometer"

    def __init__(
        self,
        camera: Camera,
        *,
        relative_deviation: Annotated[float, Range(0.0, 2.0)] = 0.05,
        calibration_deviation: Annotated[float, Range(0.0, 2.0)] = 0.1,
        averaging_time: Annotated[float, Range(0.0, 1e6, "s")] = 5.0,
    ) -> None:
        self._check = ObservationCheck(camera)
        self._deviation = math.hypot(relative_deviation, calibration_deviation)
        self._common = calibration_deviation
        self._averaging_time = averaging_time
        self.reset()

    def reset(self) -> None:
        """Forget all earlier values."""
        self._check.reset()
        self._values: deque[tuple[float, float]] = deque()

    def update(self, observation: Observation) -> Estimate:
        """Use the sensor's value as it is.

        Parameters
        ----------
        observation : Observation
            Its time and scattering are used; its image must be one of the camera.

        Returns
        -------
        Estimate
            Diagnostics: ``change`` of the values in about the averaging time [1/m]; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`), or the scattering is no finite
            number from 0 on.
        """
        self._check.image_of(observation)
        scattering = observation.scattering
        if scattering is None:
            why = "no forward-scatter sensor measures the fog here: sensors.scatterometer adds one to the vehicle"
            return Estimate.invalid(self.method, why)
        if not 0.0 <= scattering < math.inf:
            raise InputError(
                f"Observation.scattering must be a finite extinction coefficient ≥ 0 [1/m], got {scattering!r}"
            )
        change = self._change(observation.time, scattering)
        deviation = math.hypot(self._deviation * scattering, change, _LEAST_DEVIATION)
        found = {"change": change}
        return Estimate(
            self.method, scattering, deviation, diagnostics=found, reach=REACH, common_deviation=self._common
        )

    def _change(self, time: float, scattering: float) -> float:
        """By how much the value has changed since one averaging time ago, at the least since the first [1/m]."""
        self._values.append((time, scattering))
        while len(self._values) > 1 and self._values[1][0] <= time - self._averaging_time:
            self._values.popleft()
        return abs(scattering - self._values[0][1])
