"""Fog by the halos about lamps of others, distinguished from clear nights.

For docs/explanation/night.md: a threshold is calibrated on one pool of scenes and fog counted on another, also at
exposures and strengths of lamps that the calibration did not see. Constants were chosen on ``--pool 1`` and 2; what is
reported is of 7.
"""

import math
from collections.abc import Sequence

import numpy as np
from harness import Row, lines_of, parse_options, progress, publish

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
KINDS = ("as the calibration's scenes", "unseen")


def halo_records(camera: Camera, pool: int, scenes: int) -> list[Row]:
    """How often fog is seen, picture by picture, in clear air and in fog."""
    measured = measure_halo_threshold(camera, seed=0)
    counts: dict[tuple[str, float], list[int]] = {}
    with NightRoad(camera, seed=pool) as road:
        for number in progress(range(scenes), "scenes"):
            rng = np.random.default_rng((pool, number))
            for name in KINDS:
                scene, exposure = (random_scene(rng), rng.uniform(0.6, 1.6))
                if name == KINDS[1]:
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
            "scenes": name,
            "visibility": f"{visibility:g} m" if math.isfinite(visibility) else "clear",
            "images": images,
            "with_halos": seen,
            "mean_br50_limit": measured.steepness,
            "fog_by_mean_br50_pct": 100.0 * by_mean / max(seen, 1),
            "sharpness_limit": measured.sharpness,
            "fog_by_sharpness_pct": 100.0 * by_largest / max(seen, 1),
        }
        for (name, visibility), (images, seen, by_mean, by_largest) in counts.items()
    ]


def table(records: Sequence[Row]) -> list[str]:
    """Shares taken for fog, a column for each visibility."""
    lines = [
        (f"{label}, {kind}", *(f"{row[key]:.1f}" for row in records if row["scenes"] == kind))
        for label, key in (("sharpness", "fog_by_sharpness_pct"), ("mean Br50", "fog_by_mean_br50_pct"))
        for kind in KINDS
    ]
    return lines_of(("", *dict.fromkeys(row["visibility"] for row in records)), lines)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/night.md", "halos"),
        pool=(7, "which scenes"),
        count=(120, "scenes"),
        small=(False, "pictures of 640×480 in place of 1280×800"),
    )
    publish(given, halo_records(SMALL_CAMERA if given.small else PAPERS_CAMERA, given.pool, given.count), table)


if __name__ == "__main__":
    main()
