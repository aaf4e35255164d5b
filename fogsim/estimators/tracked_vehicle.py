"""A vehicle ahead as methods follow it: its pictures at smoothed ranges, each compared with the one that shows most."""

import math
from abc import ABC, abstractmethod
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.observation import LeadMeasurement

Floats = NDArray[np.float64]

_KEPT = 512
"""Measurements that are smoothed together; older ones are taken as they were measured."""

_SPEED_DEVIATION, _UNEVEN = 0.15, 0.3
"""Standard deviation of a relative speed [m/s], and of what the mean of two leaves out of the change of range between
them over the square of the time between [m/s²]."""

LONGEST = 2.0
"""Time between two measurements beyond which speeds say nothing of the way between [s]."""

_SURPRISING = 4.0
"""Standard deviations by which a change of range contradicts the speeds [-]: the sensor has jumped."""

_LATEST, _CONTRADICTED = 8, 1.8
"""Of how many of the last measurements, and of all, the root mean square change by smoothing may be, in deviations of a
range [-]: more, and the speeds are not those of these ranges."""

LOST = 5
"""Frames in a row without the vehicle after which it is another one."""


class Detection(Protocol):
    """One picture of a vehicle, compared with the reference.

    Attributes
    ----------
    number : int
        Number of the measured range.
    distance : float
        That range [m].
    picture : object
        The picture; the same object as long as it is of the same pixels at the same place.
    """

    @property
    def number(self) -> int: ...  # noqa: D102 - see above

    @property
    def distance(self) -> float: ...  # noqa: D102

    @property
    def picture(self) -> Any: ...  # noqa: D102


D = TypeVar("D", bound=Detection)


class TrackedVehicle(ABC, Generic[D]):
    """Pictures of one vehicle at different ranges.

    A method says how a picture is compared with the reference, and which of them becomes the reference.

    Parameters
    ----------
    ranges : SmoothedRanges
        The vehicle's measured ranges.
    most : int
        How many detections are kept.
    offset : float
        By how much the detections' distances exceed measured ranges [m].
    keeps_reference : bool
        Whether the reference stays even if it is the oldest.

    Attributes
    ----------
    detections : list
        What is kept, oldest first.
    reference : Detection or None
        That which all are compared with; None before the first.
    """

    def __init__(
        self, ranges: "SmoothedRanges", most: int, *, offset: float = 0.0, keeps_reference: bool = False
    ) -> None:
        self.detections: list[D] = []
        self.reference: D | None = None
        self._ranges, self._most = ranges, most
        self._offset_of_ranges, self._keeps_reference = offset, keeps_reference
        self._missed = 0

    @abstractmethod
    def _compare(self, reference: D, detection: D) -> D | None:
        """The detection compared with another reference; None if it cannot be."""

    def likely_distances(self) -> Floats:
        """Distances of the detections by all measurements so far [m]."""
        measured = np.array([one.distance for one in self.detections]) - self._offset_of_ranges
        return self._ranges.smoothed([one.number for one in self.detections], measured) + self._offset_of_ranges

    def miss(self) -> bool:
        """Count a frame without the vehicle; whether it may be another one from now on."""
        self._missed += 1
        return self._missed >= LOST

    def _nearest(self, distance: float) -> D:
        return min(self.detections, key=lambda one: abs(one.distance - distance))

    def _is_reference(self, detection: D) -> bool:
        return self.reference is not None and detection.picture is self.reference.picture

    def _keep(self, detection: D) -> None:
        self.detections.append(detection)
        if len(self.detections) > self._most:
            oldest = int(self._keeps_reference and self._is_reference(self.detections[0]))
            del self.detections[oldest]

    def _compare_all(self, reference: D) -> None:
        """Take another reference; none if nothing can be compared with it, not even itself."""
        compared = [self._compare(reference, one) for one in self.detections]
        self.detections = [one for one in compared if one is not None]
        self.reference = reference if self.detections else None


class SmoothedRanges:
    """Ranges as measured, and as they are likely with those before and after and the speeds between.

    Takes `deviation` [m].
    """

    def __init__(self, deviation: float) -> None:
        self._deviation = deviation
        # Time, distance and speed of each; those in use are the last ones.
        self._measured = np.empty((3, 2 * _KEPT))
        self._likely: Floats | None = None
        self._count = self._used = 0

    def add(self, time: float, measured: LeadMeasurement) -> int:
        """Take a measurement.

        Returns Its number, by which it is asked for. Takes `time` [s].
        """
        speed = measured.relative_speed if math.isfinite(measured.relative_speed) else 0.0
        if self._used == 2 * _KEPT:
            self._measured[:, : _KEPT - 1] = self._measured[:, -_KEPT + 1 :]
            self._used = _KEPT - 1
        self._measured[:, self._used] = time, measured.distance, speed
        self._used += 1
        self._likely = None
        self._count += 1
        return self._count - 1

    def smoothed(self, numbers: list[int], measured: Floats) -> Floats:
        """Likely ranges of measurements.

        Returns [m] (n,). Takes `measured` (n,) [m].
        """
        if self._deviation <= 0.0 or self._used < 3:
            return measured
        if self._likely is None:
            time, distance, speed = self._measured[:, max(self._used - _KEPT, 0) : self._used]
            likely = _smoothed(time, distance, speed, self._deviation)
            is_contradicted = _is_contradicted((likely - distance) / self._deviation)
            self._likely = likely[:0] if is_contradicted else likely
        likely = self._likely
        if not likely.size:
            return measured
        at = np.array(numbers, np.int64) - (self._count - likely.size)
        return np.asarray(np.where(at >= 0, likely[np.maximum(at, 0)], measured))


@kernel
def _is_contradicted(change: Floats) -> bool:
    """Whether smoothing changes all ranges, or the last ones, by too many of their deviations."""
    for count in (change.size, min(_LATEST, change.size)):
        square = 0.0
        for i in range(change.size - count, change.size):
            square += change[i] ** 2
        if math.sqrt(square / count) > _CONTRADICTED:
            return True
    return False


@kernel
def _smoothed(time: Floats, distance: Floats, speed: Floats, deviation: float) -> Floats:
    """Ranges of greatest likelihood (a Kalman filter of one state from either end, joined at each measurement)."""
    forward, certain = _filtered(time, distance, speed, deviation, 1)
    backward, known = _filtered(time, distance, speed, deviation, -1)
    own = 1.0 / deviation**2
    # Either has the measurement itself in it, which counts once.
    return (forward * certain + backward * known - distance * own) / (certain + known - own)


@kernel
def _filtered(time: Floats, distance: Floats, speed: Floats, deviation: float, way: int) -> tuple[Floats, Floats]:
    """Ranges by the measurements on one side, and their information [1/m²]."""
    likely, information = distance.copy(), np.full(distance.size, 1.0 / deviation**2)
    last = 0 if way > 0 else distance.size - 1
    for _ in range(1, distance.size):
        i = last + way
        apart = time[i] - time[last]
        if 0.0 < way * apart < LONGEST:
            moved = 0.5 * (speed[i] + speed[last]) * apart
            unsure = (_SPEED_DEVIATION * apart) ** 2 / 2.0 + (_UNEVEN * apart**2) ** 2
            surprise = distance[i] - distance[last] - moved
            if surprise**2 < _SURPRISING**2 * (2.0 * deviation**2 + unsure):
                weight = 1.0 / (1.0 / information[last] + unsure)
                likely[i] = (likely[last] + moved) * weight + distance[i] / deviation**2
                information[i] = weight + 1.0 / deviation**2
                likely[i] /= information[i]
        last = i
    return likely, information
