"""Fog by the halos about lamps of others, distinguished from clear nights.

For docs/explanation/night.md:

``python benchmarks/night_sources.py --part halos`` calibrates a threshold on one pool of scenes and counts on another,
at exposures and strengths of lamps that the calibration did not see; ``--part speed`` takes the time.
Constants were chosen on ``--pool 1`` and 2; what is reported is of 7.
"""

import argparse
import json
import math
import time
from collections.abc import Callable

import numpy as np

from fogsim.calibration.halo_calibration import measure_halo_threshold, random_scene
from fogsim.calibration.staged_night import NightRoad, NightScene, NightVehicle
from fogsim.estimators.night.halos import HaloWatch, largest_sharpness, mean_steepness
from fogsim.values import Camera, Lamp, Response
from fogsim.vision.sources.halo_profile import halos_of
from fogsim.vision.sources.source_tree import source_tree

PAPERS_CAMERA = Camera(1280, 800, 1150.0, (639.5, 399.5), 1.38, pitch=0.035, response=Response.SRGB)
SMALL_CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, pitch=0.035, response=Response.SRGB)
VISIBILITIES = (math.inf, 300.0, 200.0, 150.0, 100.0, 70.0, 50.0)
UNSEEN = ((0.4, 0.6), (1.6, 2.2))
"""Exposures, and strengths of lamps, outside what the calibration draws."""

LOW = Lamp.POSITION | Lamp.LOW_BEAM
Record = dict[str, object]


def halo_records(camera: Camera, pool: int, scenes: int) -> list[Record]:
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


def speed_records() -> list[Record]:
    """Processor time of a picture of 1280×800, the median of many on the worst of some scenes."""
    out: list[Record] = []
    with NightRoad(PAPERS_CAMERA) as road:
        for name, scene in (
            ("street lamps and traffic", NightScene(10.0, _traffic(), street_lamps=True)),
            ("traffic", NightScene(10.0, _traffic())),
            ("nobody", NightScene(10.0)),
        ):
            for visibility, light in zip(
                (math.inf, 200.0, 50.0), road.radiances(scene, (math.inf, 200.0, 50.0)), strict=True
            ):
                image = road.photograph(light, 1.0, np.random.default_rng(0))
                watch = HaloWatch()
                out.append(
                    {
                        "scene": name,
                        "V_met [m]": visibility if math.isfinite(visibility) else "clear",
                        "halos [ms]": _milliseconds(lambda watch=watch, image=image: watch.look(image)),
                    }
                )
    return out


def _traffic() -> tuple[NightVehicle, ...]:
    return NightVehicle(40.0, 0.1, LOW | Lamp.REAR_FOG), NightVehicle(60.0, 3.5, LOW, oncoming=True)


def _milliseconds(call: Callable[[], object], times: int = 30) -> float:
    call()
    spent = []
    for _ in range(times):
        started = time.process_time()
        call()
        spent.append(time.process_time() - started)
    return round(1e3 * float(np.median(spent)), 2)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=("halos", "speed"), default="halos", help="what is measured")
    parser.add_argument("--pool", type=int, default=7, help="which scenes")
    parser.add_argument("--count", type=int, default=80, help="scenes")
    parser.add_argument("--small", action="store_true", help="pictures of 640×480 in place of 1280×800")
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    arguments = parser.parse_args()
    camera = SMALL_CAMERA if arguments.small else PAPERS_CAMERA
    match arguments.part:
        case "halos":
            found = halo_records(camera, arguments.pool, arguments.count)
        case _:
            found = speed_records()
    if arguments.json:
        print(json.dumps(found, indent=2))
        return
    print("| " + " | ".join(found[0]) + " |\n" + "|---" * len(found[0]) + "|")
    for one in found:
        print("| " + " | ".join("–" if value is None else str(value) for value in one.values()) + " |")


if __name__ == "__main__":
    main()
