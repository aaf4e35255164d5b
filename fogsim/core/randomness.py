"""Random numbers: one seed, spawned into named streams, so that one part's draws never shift another's."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fogsim.core.parameters import Range

Seed = Annotated[int, Range(0, math.inf)]
"""Seed of a run: any whole number that is not negative."""


@dataclass(frozen=True, slots=True)
class Streams:
    """Independent random generators, one for each part of a run."""

    traffic_seed: int  # Seed of the traffic simulation, in 0 … 2³¹ − 1
    patch_seed: int  # Seed of the patches of fog, unless the scenario has one; the same for every vehicle of a run
    # camera, sensors, driver, faults, gps, reports, scatterometer: generators for camera noise, the vehicle's other
    # sensors, drivers, sensor faults, satellite positioning, other vehicles' reports of the fog, and the scatterometer
    # on board
    camera: np.random.Generator
    sensors: np.random.Generator
    driver: np.random.Generator
    faults: np.random.Generator
    gps: np.random.Generator
    reports: np.random.Generator
    scatterometer: np.random.Generator


def spawn_streams(seed: int, vehicle: str = "") -> Streams:
    """Spawn the named streams of one run from its seed, those of an equipped `vehicle` other than the ego by its id."""
    root = np.random.SeedSequence([seed, *vehicle.encode()] if vehicle else seed)
    traffic, _, camera, sensors, driver, faults, gps, reports, scatterometer = root.spawn(9)
    patches = np.random.SeedSequence(seed).spawn(2)[1]
    return Streams(
        traffic_seed=int(traffic.generate_state(1, np.uint32)[0] >> 1),
        patch_seed=int(patches.generate_state(1, np.uint32)[0]),
        camera=np.random.default_rng(camera),
        sensors=np.random.default_rng(sensors),
        driver=np.random.default_rng(driver),
        faults=np.random.default_rng(faults),
        gps=np.random.default_rng(gps),
        reports=np.random.default_rng(reports),
        scatterometer=np.random.default_rng(scatterometer),
    )


def named_generator(seed: int, name: str) -> np.random.Generator:
    """Generator for what is drawn under a name before a run, apart from all streams of the run."""
    return np.random.default_rng([seed, *name.encode()])
