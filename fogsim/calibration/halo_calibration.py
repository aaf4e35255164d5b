"""Which halos part fog from clear nights with a camera: many staged scenes, exposures and strengths of lamps."""

import math
from collections.abc import Sequence

import numpy as np

from fogsim.calibration.sign_calibration import Watch
from fogsim.calibration.staged_night import GLARE, NightRoad, NightScene, NightVehicle
from fogsim.errors import InputError
from fogsim.estimators.night.halos import NEAREST, HaloThreshold, largest_sharpness, mean_steepness
from fogsim.values import Camera, Lamp
from fogsim.vision.sources.halo_profile import halos_of, source_tree

_FOGS = (200.0, 100.0, 50.0)
"""Visibilities of the fogs that must be distinguished from clear nights [m]."""

_EXPOSURES, _STRENGTHS = (0.6, 1.6), (0.6, 1.6)
"""Range of exposures over the automatic one, and of lamps' intensities over the usual ones [-]."""

_LIT = Lamp.POSITION | Lamp.LOW_BEAM

_Values = tuple[float, float]  # mean Br50 and largest sharpness of a picture


def random_scene(rng: np.random.Generator, strengths: tuple[float, float] = _STRENGTHS) -> NightScene:
    """A night road on which at least one lamp is seen; `strengths` is the range of factors on intensities [-]."""
    vehicles = []
    if rng.random() < 0.6:
        lamps = _LIT | Lamp.STOP if rng.random() < 0.3 else _LIT
        vehicles.append(NightVehicle(_between(rng, NEAREST, 90.0), 0.1, lamps))
    street = bool(rng.random() < 0.5)
    least = 0 if street or vehicles else 1
    oncoming = range(max(int(rng.integers(0, 3)), least))
    vehicles += [NightVehicle(_between(rng, 15.0, 200.0), 3.5, _LIT, oncoming=True) for _ in oncoming]
    return NightScene(float(rng.uniform(0.0, 150.0)), tuple(vehicles), street, strength=_between(rng, *strengths))


def measure_halo_threshold(
    camera: Camera, scenes: int = 80, *, glare: float = GLARE, seed: int = 0, watch: Watch = lambda *_: None
) -> HaloThreshold:
    """Draw scenes in clear air and in fog, and choose the thresholds that err as seldom in either."""
    if scenes < 4:
        raise InputError(f"scenes: expected at least 4, got {scenes}")
    watch(0, scenes)
    clear, fog = list[_Values](), list[_Values]()
    with NightRoad(camera, glare=glare, seed=seed) as road:
        for number in range(scenes):
            rng = np.random.default_rng((seed, number))
            scene, exposure = random_scene(rng), _between(rng, *_EXPOSURES)
            for visibility, radiance in zip((math.inf, *_FOGS), road.radiances(scene, (math.inf, *_FOGS)), strict=True):
                picture = road.photograph(radiance, exposure, rng)
                halos = halos_of(source_tree(picture, camera.bits))
                mean, largest = mean_steepness(halos), largest_sharpness(halos)
                if mean is not None and largest is not None:
                    (clear if visibility == math.inf else fog).append((mean, largest))
            watch(number + 1, scenes)
    if not clear or not fog:
        raise InputError(f"no lamp makes a halo in pictures of {camera.width}x{camera.height} px: a larger picture")
    by_mean, by_largest = (parting([one[at] for one in clear], [one[at] for one in fog]) for at in range(2))
    traits = camera.width, camera.height, camera.focal_length, camera.response.value, camera.black_level
    chosen = round(by_mean[0], 2), round(by_largest[0], 2), max(by_mean[1:]), max(by_largest[1:])
    return HaloThreshold(*traits, *chosen, len(clear) + len(fog))


def parting(clear: Sequence[float], fog: Sequence[float]) -> tuple[float, float, float]:
    """Value that best separates small values (fog) from large ones (clear nights), and the shares on the wrong side."""
    high, low = np.sort(clear), np.sort(fog)
    candidates = np.unique(np.concatenate((high, low)))
    candidates = np.concatenate((candidates, 0.5 * (candidates[1:] + candidates[:-1])))
    candidates.sort()
    wrong = np.searchsorted(high, candidates, side="left") / len(high)
    missed = 1.0 - np.searchsorted(low, candidates, side="left") / len(low)
    worst = np.maximum(wrong, missed)
    best = np.flatnonzero(worst == worst.min())
    # In the middle of what is as good.
    chosen = int(best[len(best) // 2])
    return float(candidates[chosen]), float(wrong[chosen]), float(missed[chosen])


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is even between two."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))
