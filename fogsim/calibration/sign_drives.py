"""Staged drives past signs in fog of any density: what the ego's camera sees, and what its map says."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogsim.calibration.staged_road import AIRLIGHT, ILLUMINANCE, foggy_radiance, straight_road
from fogsim.camera import Sensor, expose
from fogsim.render import make_renderer
from fogsim.scene import build_scene
from fogsim.sensors import signs_ahead
from fogsim.units import extinction_from_visibility
from fogsim.values import (
    Camera,
    CameraPose,
    Frame,
    Observation,
    Sign,
    SignMap,
)

SETBACK = 1.7
"""Distance of the camera behind the front bumper [m]."""

_SPEED = 20.0
"""Speed of the vehicle [m/s]."""


@dataclass(frozen=True, slots=True)
class PoseNoise:
    """How far off map and own pose are, as standard deviations."""

    position: float = 0.5  # Of signs in the map, along and across [m]
    # heading, pitch: of the believed heading and of the assumed pitch [rad]
    heading: float = math.radians(0.2)
    pitch: float = math.radians(0.1)
    fix: float = 0.0  # Of the own position along and across, from frame to frame [m]


@dataclass(frozen=True, slots=True)
class SignDrive:
    """A drive past signs along a straight road."""

    camera: Camera  # The stated calibration
    signs: tuple[Sign, ...]  # Signs as they stand, along x
    places: tuple[float, ...]  # Where the front bumper is at each frame [m]
    noise: PoseNoise = PoseNoise()  # How far off map and own pose are
    grey: float = 200.0  # Pixel value of the airlight, 0 … 255
    reach: float = 400.0  # How far ahead the map is read [m]
    # Signs as the map has them; None for those that stand there, each as far off as `noise` says
    known: tuple[Sign, ...] | None = None


def observed(
    drive: SignDrive, visibilities: Sequence[float], rng: np.random.Generator
) -> Iterator[dict[float, Observation]]:
    """Observations of a drive, frame by frame, in homogeneous fog of each visibility [m]."""
    noise, stated = drive.noise, drive.camera
    known = SignMap(drive.known or tuple(_misplaced(sign, noise.position, rng) for sign in drive.signs))
    length = max(drive.places) + 2.0 * drive.reach
    scene = build_scene(straight_road(length), SignMap(drive.signs), np.random.default_rng(rng.integers(2**31)))
    true = replace(stated, pitch=stated.pitch + rng.normal(0.0, noise.pitch))
    sensor = Sensor(AIRLIGHT * 255.0 / drive.grey)
    # Not OpenGL: a run may use the only context of this process, and results would depend on the machine.
    renderer = make_renderer("cpu", scene, illuminance=ILLUMINANCE)
    try:
        for x in drive.places:
            pose = CameraPose((x - SETBACK, 0.0, true.mount_height), heading=0.0)
            view = renderer.render((), true, pose)
            along, across = rng.normal(0.0, noise.fix, 2) if noise.fix else (0.0, 0.0)
            place = np.array([x + along, across, 0.0])
            signs = signs_ahead(known, place, rng.normal(0.0, noise.heading), drive.reach)
            seen = {}
            for visibility in visibilities:
                light = foggy_radiance(view, pose, true, extinction_from_visibility(visibility))
                image = expose(light, sensor, stated.response, rng).astype(np.uint8)
                seen[visibility] = Observation(Frame(x / _SPEED, image, stated), _SPEED, None, signs, SETBACK)
            yield seen
    finally:
        renderer.close()


def sign_beside(name: str, kind: str, place: float, diameter: float, rng: np.random.Generator) -> Sign:
    """A sign of a diameter [m] on the right of the road at `place` [m], its offset and height drawn at random."""
    position = (place, -float(rng.uniform(4.0, 6.5)), float(rng.uniform(1.9, 2.5)))
    return Sign(name, kind, float(rng.choice((50, 70, 80, 100))) / 3.6, position, 0.0, diameter)


def _misplaced(sign: Sign, deviation: float, rng: np.random.Generator) -> Sign:
    x, y, z = sign.position
    return replace(sign, position=(x + rng.normal(0.0, deviation), y + rng.normal(0.0, deviation), z))
