"""Fog by the halos about lamps of others, distinguished from clear nights.

For docs/explanation/night.md: a threshold is calibrated on one pool of scenes and fog counted on another, also at
exposures and strengths of lamps that the calibration did not see. Constants were chosen on ``--pool 1`` and 2; what is
reported is of 7.

    python benchmarks/night_sources.py [--json] [--pool 7] [--count 80] [--small]
"""

import math

import numpy as np
from harness import Row, parse_options, publish

from fogsim.calibration.halo_calibration import measure_halo_threshold, random_scene
from fogsim.calibration.staged_night import NightRoad
from fogsim.estimators.night.halos import largest_sharpness, mean_steepness
from fogsim.values import Camera, Response
from fogsim.vision.sources.halo_profile import halos_of, source_tree

PAPERS_CAMERA = Camera(1280, 800, 1150.0, (639.5, 399.5), 1.38, pitch=0.035, response=Response.SRGB)
SMALL_CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, pitch=0.035, response=Response.SRGB)
VISIBILITIES = (math.inf, 300.0, 200.0, 150.0, 100.0, 70.0, 50.0)
UNSEEN = ((0.4, 0.6), (1.6, 2.2))
"""Exposures, and strengths of lamps, outside what the calibration draws."""


def halo_records(camera: Camera, pool: int, scenes: int) -> list[Row]:
    """How often fog is seen, picture by picture, in clear air and in fog."""
    measured = measure_halo_threshold(camera, seed=0)
    counts: dict[tuple[str, float], list[int]] = {}
    with NightRoad(camera, seed=pool) as road:
        for number in range(scenes):
            rng = np.random.default_rng((pool, number))
            for name in ("like the calibration's", "unseen"):
                scene, exposure = (random_scene(rng), rng.uniform(0.6, 1.6))
                if name == "unseen":
                    scene, exposure = random_scene(rng, UNSEEN[rng.integers(2)]), rng.uniform(*UNSEEN[rng.integers(2)])
                for visibility, light in zip(VISIBILITIES, road.radiances(scene, VISIBILITIES), strict=True):
                    halos = halos_of(source_tree(road.photograph(light, exposure, rng)))
                    mean, largest = mean_steepness(halos), largest_sharpness(halos)
                    counted = counts.setdefault((name, visibility), [0, 0, 0, 0])
                    counted[0] += 1
                    if mean is not None and largest is not None:
                        counted[1] += 1
                        counted[2] += mean < measured.steepness
                        counted[3] += largest < measured.sharpness
    return [
        {
            "exposures and lamps": name,
            "V_met [m]": visibility if math.isfinite(visibility) else "clear",
            "pictures": pictures,
            "with halos": seen,
            f"taken for fog by mean Br50 < {measured.steepness:g} [%]": round(100.0 * by_mean / max(seen, 1), 2),
            f"by sharpness < {measured.sharpness:g} [%]": round(100.0 * by_largest / max(seen, 1), 2),
        }
        for (name, visibility), (pictures, seen, by_mean, by_largest) in counts.items()
    ]


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        pool=(7, "which scenes"),
        count=(80, "scenes"),
        small=(False, "pictures of 640×480 in place of 1280×800"),
    )
    publish(given, halo_records(SMALL_CAMERA if given.small else PAPERS_CAMERA, given.pool, given.count))


if __name__ == "__main__":
    main()
