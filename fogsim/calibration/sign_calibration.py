"""How far the detector of signs sees in fog with a camera: its operating range, measured on drives up to signs."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.staged_road import AIRLIGHT, ILLUMINANCE, foggy_radiance, straight_road
from fogsim.camera import Sensor, expose
from fogsim.errors import InputError
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.watch import SignWatch
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

Watch = Callable[[int, int], None]
"""Called with the number of finished approaches or scenes and of all."""

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


VISIBILITIES = (50.0, 75.0, 100.0, 130.0, 170.0, 220.0, 280.0, 350.0, 430.0, 550.0, 800.0)
"""Visibilities at which the range is measured by default [m]."""

_KINDS = ("speed_limit", "stop", "pedestrian_crossing", "no_overtaking", "no_entry", "priority_road")
"""Kinds of the signs, one after the other; none is a triangle, which the detector's authors exclude."""

SHARE = 0.8
"""Share of looks that find a sign within the operating range (Belaroussi & Gruyer 2015, section 3.2)."""

_NEAREST = 8.0  # place of the last look before the sign [m]
_LEVELS = (140.0, 170.0, 200.0, 230.0, 250.0)  # of the airlight, 0 … 255
_QUARTILES = 1.349  # between the quartiles of a normal distribution [standard deviations]


def measure_operating_range(
    camera: Camera,
    diameter: float,
    visibilities: Sequence[float] = VISIBILITIES,
    *,
    approaches: int = 24,
    step: float = 5.0,
    seed: int = 0,
    watch: Watch = lambda *_: None,
) -> OperatingRange:
    """Drive up to signs of a `diameter` [m] in fog of each visibility [m], and see from how far they are detected."""
    for name, value, least in (("approaches", approaches, 4), ("step", step, 0.5), ("diameter", diameter, 0.1)):
        if not value >= least:
            raise InputError(f"{name}: expected at least {least}, got {value}")
    fogs = tuple(float(v) for v in visibilities)
    found: dict[float, list[_Approach]] = {v: [] for v in fogs}
    part, noise = cropped(camera), PoseNoise()
    reach = min(max(80.0, 1.3 * fogs[-1]), 0.25 * camera.focal_length * diameter)
    if reach - _NEAREST < step:
        raise InputError(
            f"a camera with a focal length of {camera.focal_length:g} px shows a sign of {diameter:g} m on too few "
            "pixels to detect it: expected a longer focal length or a larger sign"
        )
    watch(0, approaches)
    for number in range(approaches):
        rng = np.random.default_rng((seed, number))
        sign = sign_beside("s", _KINDS[number % len(_KINDS)], reach, diameter, rng)
        places = np.arange(rng.uniform(0.0, step), reach - _NEAREST, step)
        drive = SignDrive(part, (sign,), tuple(places.tolist()), noise, float(rng.choice(_LEVELS)), reach + 5.0)
        known = PoseDeviation(noise.position, heading=noise.heading, pitch=noise.pitch)
        looks = {v: _Approach(SignWatch(part, SETBACK, known)) for v in fogs}
        for seen in observed(drive, fogs, rng):
            for visibility, observation in seen.items():
                looks[visibility].look(observation)
        for visibility, approach in looks.items():
            found[visibility].append(approach)
        watch(number + 1, approaches)
    return _summary(camera, diameter, found)


class _Approach:
    """Looks at one sign while it is driven up to."""

    def __init__(self, watch: SignWatch) -> None:
        self._watch = watch
        self.looks: list[tuple[float, bool]] = []
        self.first: float | None = None

    def look(self, observation: Observation) -> None:
        watched = self._watch.look(observation)
        self.looks += [(sign.distance, bool(watched.found)) for sign in watched.signs if sign.expected]
        for track in self._watch.tracks:
            if track.confirmed:
                self.first = track.first_seen


def _summary(camera: Camera, diameter: float, found: dict[float, list[_Approach]]) -> OperatingRange:
    firsts = {v: np.array([one.first for one in each if one.first is not None]) for v, each in found.items()}
    detected = [v for v, first in firsts.items() if len(first) >= 0.5 * len(found[v])]
    if len(detected) < 3:
        raise InputError(
            f"signs of {diameter:g} m are detected in fewer than three of the visibilities with a focal length of "
            f"{camera.focal_length:g} px: larger signs, a longer focal length, or thinner fog"
        )
    low, middle, high = np.array([np.quantile(firsts[v], (0.25, 0.5, 0.75)) for v in detected]).T
    return OperatingRange(
        camera.focal_length,
        diameter,
        tuple(detected),
        tuple(_range_of([look for one in found[v] for look in one.looks]) for v in detected),
        tuple(middle.tolist()),
        tuple(np.maximum((high - low) / _QUARTILES, 1.0).tolist()),
    )


def _range_of(looks: Sequence[tuple[float, bool]]) -> float:
    """Largest distance within which each class of distances has its share of hits [m]; 0 where none has."""
    distance, hit = np.array([d for d, _ in looks]), np.array([h for _, h in looks], dtype=np.float64)
    edges: NDArray[np.float64] = np.arange(0.0, distance.max() + 10.0, 10.0)
    farthest = 0.0
    for near, far in itertools.pairwise(edges.tolist()):
        inside = (distance >= near) & (distance < far)
        if inside.any() and hit[inside].mean() < SHARE:
            break
        farthest = far if inside.any() else farthest
    return farthest


def cropped(camera: Camera) -> Camera:
    """Camera of the part of an image that signs on the right of the road pass through."""
    (u0, _), f, horizon = camera.principal_point, camera.focal_length, camera.horizon_row
    left, right = max(round(u0 - 0.1 * f), 0), min(round(u0 + 0.8 * f), camera.width)
    top, bottom = max(round(horizon - 0.25 * f), 0), min(round(horizon + 0.1 * f), camera.height)
    point = (camera.principal_point[0] - left, camera.principal_point[1] - top)
    return replace(camera, width=right - left, height=bottom - top, principal_point=point)
