"""How far the detector of signs sees in fog with a camera: its operating range, measured on drives up to signs."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.halo_calibration import Watch
from fogsim.calibration.sign_drives import SETBACK, PoseNoise, SignDrive, observed, sign_beside
from fogsim.errors import InputError
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.watch import SignWatch
from fogsim.values import Camera, Observation

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
    """Drive up to signs in fog of each visibility, and see from how far they are detected.

    Takes `diameter` [m], `visibilities` [m], `step` [m].
    """
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
