"""Drives past signs for `sign_estimators.py`, drawn by FogSim's renderer in a frame that holds the signs alone."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fogsim.calibration.sign_drives import PoseNoise, SignDrive, observed
from fogsim.values import Camera, Observation, Response, Sign

CAMERA = Camera(560, 260, 1400.0, (90.0, 190.0), 1.38, math.radians(0.5), response=Response.SRGB)
"""The right part of a picture of 1400 × 600 pixels about the horizon."""

NOISE = PoseNoise(fix=0.2)
KINDS = ("speed_limit", "stop", "warning", "no_entry", "no_overtaking", "priority_road")
FIRST, APART, REACH = 160.0, 120.0, 150.0  # [m]
WRONG = ("missing", "moved", "turned", "another kind")


class Post(NamedTuple):
    """A sign as it stands (None if it is missing), and as the map has it."""

    true: Sign | None
    told: Sign


@dataclass(frozen=True, slots=True)
class Drive:
    """What is driven."""

    signs: int = 3  # how many signs are driven past
    step: float = 3.0  # way between two frames [m]
    wrong_share: float = 0.0  # share of signs that are not what the map says [-]
    kinds: tuple[str, ...] = KINDS  # their kinds


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
    standing, known = tuple(p.true for p in along if p.true is not None), tuple(p.told for p in along)
    places = tuple(float(x) for x in np.arange(0.0, known[-1].position[0] - 5.0, drive.step))
    grey = float(rng.choice((120.0, 200.0, 255.0)))
    return observed(SignDrive(CAMERA, standing, places, NOISE, grey, REACH, known), visibilities, rng)
