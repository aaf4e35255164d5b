"""Cameras on masts next to the ego's route, and what an estimator reads in their images."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fogsim.camera import Pixels, mounted_pose
from fogsim.core.randomness import named_generator
from fogsim.estimators import Estimator
from fogsim.simulation.chosen_methods import estimators
from fogsim.simulation.ego.fog_reports import SENSOR, Beats, place_seen, sensor_places
from fogsim.simulation.road_sections import stations
from fogsim.simulation.run_config import MastCamera, RoadsideSender
from fogsim.values import Camera, CameraPose, Estimate, FogReport, Frame, LightMeasurement, Observation
from fogsim.values.result_checks import checked_estimate

AHEAD = 10.0
"""How far ahead of a mast the road's direction is taken [m]."""

_LEAST_DEVIATION = 1e-6
"""Relative deviation that a report has at least [-]: less is rounding."""

Draw = Callable[[CameraPose, Camera], NDArray[np.float32] | None]
"""Radiance that reaches a camera [cd/m²]; None where nothing is drawn."""


class RoadsideCameras:
    """The cameras of one run along a route (n, 3) [m]. What they report comes from their images alone."""

    def __init__(
        self,
        sensors: RoadsideSender,
        mast: MastCamera,
        period: float,
        route: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> None:
        self._estimator_config, self._sensors = mast.estimator, sensors
        self._camera, self._assumed = mast.camera.on(), mast.camera.assumed_on()
        self._sensor, self._aside = mast.camera.make_sensor(period), mast.right_of_route
        self._route, self._stations = route, stations(route)
        self._places = sensor_places(sensors, float(self._stations[-1])).tolist()
        self._draw = int(rng.integers(2**32))
        self._beats = Beats(self._draw)
        self._estimators: dict[str, Estimator] = {}
        self._has_begun = False

    def look(self, time: float, illuminance: float, draw: Draw) -> tuple[FogReport, ...]:
        """Take and read the images that are due at a time [s], by a measured illuminance [lx]; report what is valid."""
        due = [
            (f"{SENSOR} {i}", place)
            for i, place in enumerate(self._places)
            if self._beats.is_due(f"{SENSOR} {i}", self._sensors.period, time)
        ]
        # A run begins with what cameras have reported before of the fog as it is then.
        taken = time if self._has_begun else time - self._sensors.delay
        self._has_begun = self._has_begun or bool(due)
        found = (self._read(name, place, taken, illuminance, draw) for name, place in due)
        return tuple(report for report in found if report is not None)

    def _read(self, name: str, place: float, time: float, illuminance: float, draw: Draw) -> FogReport | None:
        radiance, number = draw(self._pose(place), self._camera), self._beats.number(name)
        if radiance is None:
            return None
        # It runs all the time, so that its exposure has settled when an image is read.
        self._sensor.reset()
        image = self._sensor.take(radiance, named_generator(self._draw, f"{name} {number}"))
        frame = Frame(time, over_road(image, self._assumed, self._aside), self._assumed)
        estimate = checked_estimate(
            self._estimator_config.name,
            self._estimator(name).update(Observation(frame, light=LightMeasurement(illuminance))),
        )
        if not (estimate.valid and estimate.standard_deviation > 0.0):
            return None
        extinction, deviation = as_log_normal(estimate)
        return FogReport(name, number, place_seen(place, estimate), time, extinction, deviation)

    def _estimator(self, name: str) -> Estimator:
        if name not in self._estimators:
            (self._estimators[name],) = estimators([self._estimator_config], self._assumed)
        return self._estimators[name]

    def _pose(self, place: float) -> CameraPose:
        """Pose of the camera next to a place along the route [m]."""
        here, there = (self._at(station) for station in (place, min(place + AHEAD, float(self._stations[-1]))))
        ahead = there - here
        heading, grade = math.atan2(ahead[1], ahead[0]), math.atan2(ahead[2], math.hypot(ahead[0], ahead[1]))
        aside = self._aside * np.array((math.sin(heading), -math.cos(heading), 0.0))
        return mounted_pose(self._camera, here + aside, heading, 0.0, grade)

    def _at(self, station: float) -> NDArray[np.float64]:
        return np.array([np.interp(station, self._stations, axis) for axis in self._route.T])


def over_road(image: Pixels, camera: Camera, aside: float) -> Pixels:
    """Shift the rows of an image so that the road lies as a camera above it would see it.

    The camera stands to the right of it [m]. A point of the road v rows below the horizon shows its lateral offset x at
    α x / ζ = x cos θ v / H columns from the axis (negru2013 eq. 11), so each row is shifted by one number. What lies
    next to the image repeats its border, which is as far away as the row.
    """
    rows, columns = np.arange(camera.height), np.arange(camera.width)
    below = np.maximum(rows - camera.horizon_row, 0.0)
    shift = np.rint(aside * math.cos(camera.pitch) / camera.mount_height * below).astype(np.int64)
    source = np.clip(columns - shift[:, None], 0, camera.width - 1)
    return np.ascontiguousarray(image[rows[:, None], source])


def as_log_normal(estimate: Estimate) -> tuple[float, float]:
    """Extinction [1/m] and relative deviation of the log-normal distribution that a valid estimate stands for.

    It has the mean and the variance of the estimate's normal distribution where that is positive. In clear air, where
    the extinction is 0 with some deviation, that still limits it from above.
    """
    deviation = max(estimate.standard_deviation, _LEAST_DEVIATION * estimate.extinction)
    ratio = estimate.extinction / deviation
    hazard = math.exp(-0.5 * ratio**2) / math.sqrt(2.0 * math.pi) / (0.5 * math.erfc(-ratio / math.sqrt(2.0)))
    mean, variance = ratio + hazard, 1.0 - hazard * (ratio + hazard)
    spread = math.log1p(variance / mean**2)
    return float(deviation * mean * math.exp(-0.5 * spread)), math.sqrt(spread)
