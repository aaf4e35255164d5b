"""Drives past signs for `sign_estimators.py`, drawn by FogSim's renderer in a frame that holds the signs alone."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fogsim.camera import Sensor, expose
from fogsim.render import make_renderer
from fogsim.reproduce.scenes import AIRLIGHT, ILLUMINANCE, foggy_radiance, straight_road
from fogsim.scene import build_scene
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, Frame, Observation, Response, Sign, SignMap, SignSighting

CAMERA = Camera(560, 260, 1400.0, (90.0, 190.0), 1.38, math.radians(0.5), response=Response.SRGB)
"""The right part of a picture of 1400 × 600 pixels about the horizon."""

SETBACK, SPEED = 1.7, 20.0
KINDS = ("speed_limit", "stop", "warning", "no_entry", "no_overtaking", "priority_road")
FIRST, APART, REACH = 160.0, 120.0, 150.0  # [m]
WRONG = ("missing", "moved", "turned", "another kind")


class Post(NamedTuple):
    """A sign as it stands (None if it is missing), and as the map has it."""

    true: Sign | None
    told: Sign


@dataclass(frozen=True, slots=True)
class Drive:
    """What is driven.

    Attributes
    ----------
    signs : int
        How many signs are driven past.
    step : float
        Way between two frames [m].
    wrong_share : float
        Share of signs that are not what the map says [-].
    kinds : tuple of str
        Their kinds.
    """

    signs: int = 3
    step: float = 3.0
    wrong_share: float = 0.0
    kinds: tuple[str, ...] = KINDS


def posts(drive: Drive, rng: np.random.Generator) -> list[Post]:
    """Signs along the road; the map errs by 0.5 m along and across."""
    found = []
    for i in range(drive.signs):
        kind = str(rng.choice(drive.kinds))
        place = (FIRST + APART * i + rng.uniform(-10, 10), rng.uniform(-6.5, -4.5), rng.uniform(2.0, 2.6))
        standing = Sign(f"s{i}", kind, float(rng.choice([50, 80, 100])) / 3.6, place, 0.0, 0.9)
        x, y, z = place
        told = replace(standing, position=(x + rng.normal(0, 0.5), y + rng.normal(0, 0.5), z + rng.normal(0, 0.1)))
        # Drawn always, so that drives with and without wrong signs are the same otherwise.
        is_wrong, how, by = rng.uniform() < drive.wrong_share, str(rng.choice(WRONG)), float(rng.choice([-1.0, 1.0]))
        found.append(Post(wronged(standing, how, by) if is_wrong else standing, told))
    return found


def wronged(sign: Sign, how: str, by: float) -> Sign | None:
    """A sign that is not what the map says."""
    x, y, z = sign.position
    if how == "missing":
        return None
    if how == "moved":
        return replace(sign, position=(x + 15.0 * by, y, z))
    if how == "turned":
        return replace(sign, heading=math.radians(40.0) * by)
    return replace(sign, kind=KINDS[(KINDS.index(sign.kind) + (2 if by > 0 else 3)) % len(KINDS)])


def drives(drive: Drive, visibilities: tuple[float, ...], seed: tuple[int, ...]) -> Iterator[dict[float, Observation]]:
    """Observations of one drive, frame by frame, in every fog."""
    rng = np.random.default_rng(seed)
    along = posts(drive, rng)
    scene = build_scene(
        straight_road(), SignMap(tuple(p.true for p in along if p.true is not None)), np.random.default_rng(seed)
    )
    levels = {v: float(rng.choice((120.0, 200.0, 255.0))) for v in visibilities}
    tilted, turned = rng.normal(0.0, math.radians(0.1)), rng.normal(0.0, math.radians(0.1))
    renderer = make_renderer("auto", scene, illuminance=ILLUMINANCE)
    try:
        for x in np.arange(0.0, along[-1].told.position[0] - 5.0, drive.step):
            true = replace(CAMERA, pitch=CAMERA.pitch + tilted + rng.normal(0.0, math.radians(0.05)))
            pose = CameraPose((float(x) - SETBACK, 0.0, CAMERA.mount_height), heading=0.0)
            view = renderer.render((), true, pose)
            heading = turned + rng.normal(0.0, math.radians(0.17))
            fix = x + rng.normal(0.0, 0.2), rng.normal(0.0, 0.2)
            signs = sightings([p.told for p in along], fix, heading)
            time, seen = float(x) / SPEED, {}
            for v in visibilities:
                radiance = foggy_radiance(view, pose, true, extinction_from_visibility(v))
                image = expose(radiance, Sensor(AIRLIGHT * 255.0 / levels[v]), CAMERA.response, rng).astype(np.uint8)
                seen[v] = Observation(Frame(time, image, CAMERA), SPEED, None, signs)
            yield seen
    finally:
        renderer.close()


def sightings(signs: list[Sign], fix: tuple[float, float], heading: float) -> tuple[SignSighting, ...]:
    """What the map says from where the vehicle takes itself to be."""
    found = []
    for sign in signs:
        dx, dy = sign.position[0] - fix[0], sign.position[1] - fix[1]
        ahead, left = dx * math.cos(heading) + dy * math.sin(heading), dy * math.cos(heading) - dx * math.sin(heading)
        if 0.0 < ahead <= REACH:
            found.append(
                SignSighting(
                    sign.sign_id, sign.kind, sign.value, ahead, left, sign.diameter, sign.position[2], -heading
                )
            )
    return tuple(sorted(found, key=lambda one: one.distance))
