"""Where an image is searched for the map's signs ahead, and which sign a detection belongs to."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from fogsim.values.camera import Camera
from fogsim.values.observation import SignSighting, sign_coordinates, sign_place
from fogsim.vision.symmetry.detection import LARGER, SMALLER, SearchRegion, SignDetection

GATE = 3.3
"""Standard deviations that a sign's column and row may be off: 0.2 % of signs are farther off [-]."""

_NEAREST = 3.0
"""Signs nearer to the camera than this are not looked for: they leave the picture [m]."""

_SMALLEST = 3.0
"""Least radius of a sign that is looked for [px]."""


@dataclass(frozen=True, slots=True)
class PoseDeviation:
    """How well the place of a sign relative to the camera is known, as standard deviations."""

    position: float = 0.5  # Of the sign by the map about the vehicle by its fix, along and across [m]
    height: float = 0.15  # Of the sign above the road [m]
    # heading, pitch: of the camera's direction [rad]
    heading: float = math.radians(0.2)
    pitch: float = math.radians(0.1)


@dataclass(frozen=True, slots=True)
class ProjectedSign:
    """A sign of the map as the assumed camera should see it."""

    sighting: SignSighting  # What the map says
    distance: float  # From the camera to the sign along the line of sight [m]
    # u, v: column and row of the middle of its face [px]
    u: float
    v: float
    radius: float  # Half of its diameter [px]
    # deviation_u, deviation_v: standard deviations of column and row [px]
    deviation_u: float
    deviation_v: float
    expected: bool  # Whether the picture should show all of it: if not, that it is not found says nothing

    @property
    def region(self) -> SearchRegion:
        """Where it is looked for."""
        return SearchRegion(self.u, self.v, GATE * self.deviation_u, GATE * self.deviation_v, self.radius)


def project_sightings(
    sightings: Iterable[SignSighting], camera: Camera, setback: float, deviation: PoseDeviation | None = None
) -> tuple[ProjectedSign, ...]:
    """Project what the map says through the assumed camera.

    Returns signs that the image may show, in the order of the sightings: none that is behind the
    camera, outside the picture by more than it can be off its place, or too small. Takes `setback` [m].
    """
    known = PoseDeviation() if deviation is None else deviation
    projected = (_projected(sighting, camera, setback, known) for sighting in sightings)
    return tuple(sign for sign in projected if sign is not None)


def _projected(sighting: SignSighting, camera: Camera, setback: float, known: PoseDeviation) -> ProjectedSign | None:
    right, down, depth = sign_coordinates(sighting, camera, setback)
    if not all(map(math.isfinite, (right, down, depth, sighting.diameter))) or sighting.diameter <= 0.0:
        return None
    place = None if depth < _NEAREST else sign_place(sighting, camera, setback)
    if place is None or place[3] < _SMALLEST:
        return None
    (u, v, _, radius), scale = place, camera.focal_length / depth
    x, y = scale * right, scale * down
    level = y + camera.focal_length * math.tan(camera.pitch)
    off_x = math.hypot(scale * known.position, x / depth * known.position, camera.focal_length * known.heading)
    off_y = math.hypot(scale * known.height, level / depth * known.position, camera.focal_length * known.pitch)
    cosine, sine = math.cos(camera.roll), math.sin(camera.roll)
    off_u, off_v = math.hypot(off_x * cosine, off_y * sine), math.hypot(off_x * sine, off_y * cosine)
    beside = max(-u, u - (camera.width - 1))
    above = max(-v, v - (camera.height - 1))
    if beside > GATE * off_u or above > GATE * off_v:
        return None
    expected = beside < -radius - off_u and above < -radius - off_v
    distance = math.hypot(right, down, depth)
    return ProjectedSign(sighting, distance, u, v, radius, off_u, off_v, expected)


LIMIT = 4.0
"""Standard deviations that column, row and size of a detection may be off together: 0.1 % are farther off [-]."""

_SIZE_DEVIATION, _BLUR = 0.15, 0.4
"""Standard deviation of a detected radius about the map's: relative to it, and by what blurs small signs [px]."""

_FALSE_ALARMS = 0.05
"""Detections in a region that are no sign of the map [-]."""

_DETECTED = 0.9
"""Share of signs that are detected, for the confidence in a pair [-]."""


@dataclass(frozen=True, slots=True)
class Registration:
    """A detection taken for a sign of the map."""

    sign: ProjectedSign  # The sign
    detection: SignDetection  # The detection
    confidence: float  # p(c): probability that the detection is this sign and no false alarm [-]


def register_signs(signs: Sequence[ProjectedSign], detections: Sequence[SignDetection]) -> tuple[Registration, ...]:
    """Pair detections with signs of the map, each with one at most, so that the pairs are likeliest together.

    A pair is possible within `LIMIT` standard deviations of column, row and size together. Its likelihood q is that of
    the offsets over that of a false alarm anywhere in the sign's region: p(c) = P q / (P q + λ) with the share P of
    signs that are detected and the false alarms λ in a region, as in probabilistic data association with one target.

    Returns In the order of the signs; signs without a detection are left out.
    """
    ratios = np.array([[_likelihood_ratio(sign, one) for one in detections] for sign in signs])
    if ratios.size == 0:
        return ()
    gain = np.log1p(ratios)
    pairs = zip(*(found.tolist() for found in linear_sum_assignment(gain, maximize=True)), strict=True)
    return tuple(
        Registration(signs[i], detections[j], float(ratios[i, j] / (1.0 + ratios[i, j])))
        for i, j in pairs
        if ratios[i, j] > 0.0
    )


def _likelihood_ratio(sign: ProjectedSign, detection: SignDetection) -> float:
    """Likelihood of a detection as this sign over that as a false alarm [-]; 0 outside the gate."""
    a, b = (detection.u - sign.u) / sign.deviation_u, (detection.v - sign.v) / sign.deviation_v
    size_deviation = math.hypot(_SIZE_DEVIATION, _BLUR / sign.radius)
    c = math.log(detection.radius / sign.radius) / size_deviation
    square = a * a + b * b + c * c
    if square > LIMIT * LIMIT:
        return 0.0
    density = math.exp(-0.5 * square) / (2.0 * math.pi) ** 1.5
    density /= sign.deviation_u * sign.deviation_v * size_deviation
    area: float = 4.0 * GATE * GATE * sign.deviation_u * sign.deviation_v * math.log(LARGER / SMALLER)
    return float(_DETECTED * density * area / _FALSE_ALARMS)
