"""Where signs that the map says lie ahead are looked for in a picture."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from fogsim.values.camera import Camera
from fogsim.values.observation import SignSighting, sign_coordinates, sign_place
from fogsim.vision.symmetry.detection import SearchRegion

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
