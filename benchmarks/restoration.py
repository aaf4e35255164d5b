"""What contrast restoration is worth: likeness to the clear picture, blind indicators, detection range, time.

FogSim draws a straight road with a vehicle ahead without air; the clear picture and the foggy ones (Koschmieder's law,
photon and read noise, 8 bits, sRGB, the airlight at 200 of 255 levels of light) are of the same scene.

``psnr_db``, ``ssim``   against the clear picture, at 640 × 480, the vehicle at half the visibility; `psnr_seen_db` of
                        what is nearer than V_met alone, which the fog has not hidden
``e``, ``r``, ``s_pct`` blind indicators of Hautière et al. 2008: rate of new visible edges, mean ratio of gradients,
                        saturated pixels
``range_m``             farthest range at which a blob detector of OpenCV with its default parameters finds a vehicle
                        that comes nearer, in this picture and the next (10 % nearer), in the grey picture of
                        1280 × 960 and about 40°; median of vehicles; one never found counts as the nearest range
``false_alarms``        blobs of a vehicle's size on the road elsewhere, a picture
``ms``                  least time of a picture of 640 × 480 on one core

Methods: ``foggy``, the picture as it is; ``planar`` with the extinction that joint_road estimates in the same picture;
``planar, k known``; ``dark_channel``; ``tarel2009``. Constants were chosen on pool 0 (other visibilities, vehicles,
camera, places); pool 1 is what is reported. Run it with OMP_NUM_THREADS=1, for the times of one core.
"""

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from harness import Row, lines_of, parse_options, progress, publish
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from restoration_measures import DETECTORS, Found, blind_indicators, detect, psnr, ssim, vehicle_box

from fogsim.calibration.staged_road import StagedVehicle, road_renderer
from fogsim.estimators import Estimator, make
from fogsim.recorders.style import font
from fogsim.render import Renderer
from fogsim.reproduce.huang2015_chase import Scene, drawn, fogged
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Frame, Observation, Response
from fogsim.vision.restoration import restore_contrast

Pixels = NDArray[np.uint8]
Restore = Callable[[Pixels], Pixels]

METHODS = ("foggy", "planar", "planar, k known", "dark_channel", "tarel2009")
LEVELS = 200.0
FARTHEST, NEAREST = 1.3, 0.2  # of ranges, over the visibility [-]
VISIBILITIES = ((70.0, 120.0, 220.0), (60.0, 80.0, 100.0, 150.0, 200.0, 300.0))
VEHICLES = (
    (
        StagedVehicle("car", 4.75, 1.80, 1.44, (0.20, 0.20, 0.20)),
        StagedVehicle("car", 4.30, 1.80, 1.50, (0.45, 0.05, 0.04)),
        StagedVehicle("van", 5.30, 1.95, 2.00, (0.06, 0.06, 0.08)),
    ),
    (
        StagedVehicle("car", 4.80, 1.83, 1.50, (0.30, 0.30, 0.31), name="followed 3"),
        StagedVehicle("car", 4.05, 1.78, 1.47, (0.05, 0.05, 0.06)),
        StagedVehicle("car", 4.60, 1.90, 1.70, (0.70, 0.70, 0.70)),
    ),
)
MOUNTS = ((1.3, 1.0, 42.0), (1.4, 1.5, 40.0))
"""Height [m], pitch and horizontal field of view [deg]."""

CROP = (300, 130, 200)
"""What detectors look at: columns to either side of the principal point, rows above and below the horizon [px]."""


def camera(pool: int, width: int, height: int, field_of_view: float | None = None) -> Camera:
    """Camera of a pool in some size."""
    mount, pitch, usual = MOUNTS[pool]
    focal = 0.5 * width / math.tan(math.radians(0.5 * (field_of_view or usual)))
    middle = (0.5 * (width - 1), 0.5 * (height - 1))
    return Camera(width, height, focal, middle, mount, math.radians(pitch), response=Response.SRGB)


def restorers(seen_by: Camera, visibility: float, estimator: Estimator) -> dict[str, Restore]:
    """The methods; each makes a picture of a foggy one."""
    k = extinction_from_visibility(visibility)

    def estimated(image: Pixels) -> Pixels:
        estimator.reset()
        estimate = estimator.update(Observation(Frame(0.0, image, seen_by)))
        return restored(image, estimate.extinction if estimate.valid else 0.0)

    def restored(image: Pixels, extinction: float | None = None, method: str = "planar") -> Pixels:
        return np.asarray(restore_contrast(image, seen_by, extinction, method=method).image, np.uint8)

    return {
        "foggy": lambda image: image,
        "planar": estimated,
        "planar, k known": lambda image: restored(image, k),
        "dark_channel": lambda image: restored(image, method="dark_channel"),
        "tarel2009": lambda image: restored(image, method="tarel2009"),
    }


def likeness(renderer: Renderer, pool: int, visibility: float, vehicles: int) -> dict[str, Row]:
    """How like the clear picture the methods' are, and their time."""
    seen_by, rng = camera(pool, 640, 480, 58.0), np.random.default_rng([pool, round(visibility), 1])
    methods = restorers(seen_by, visibility, make("joint_road", seen_by))
    found: dict[str, list[list[float]]] = {name: [] for name in METHODS}
    for vehicle in VEHICLES[pool][:vehicles]:
        scene = drawn(renderer, seen_by, vehicle, 0.5 * visibility, float(rng.uniform(0.0, 400.0)))
        clear, foggy = (fogged(scene, value, LEVELS, rng) for value in (math.inf, visibility))
        near = scene.view.distance < visibility
        for name, restore in methods.items():
            image, spent = timed(restore, foggy)
            told = [psnr(image, clear), psnr(image, clear, near), ssim(image, clear), *blind_indicators(foggy, image)]
            found[name].append([*told, spent])
    keys = ("psnr_db", "psnr_seen_db", "ssim", "e", "r", "s_pct", "ms")
    scales = (1.0, 1.0, 1.0, 1.0, 1.0, 100.0, 1e3)
    out = {}
    for name, rows in found.items():
        values = [*np.mean(rows, axis=0)[:-1], np.min(rows, axis=0)[-1]]
        out[name] = {key: round(float(s * v), 3) for key, s, v in zip(keys, scales, values, strict=True)}
    return out


def timed(restore: Restore, foggy: Pixels) -> tuple[Pixels, float]:
    """A method's picture, and its least time of five [s]."""
    least = math.inf
    for _ in range(5):
        started = time.perf_counter()
        image = restore(foggy)
        least = min(least, time.perf_counter() - started)
    return image, least


def approaches(
    renderer: Renderer, pool: int, visibility: float, vehicles: int, step: float
) -> dict[tuple[str, str], Row]:
    """Ranges at which the detectors find a vehicle that comes nearer, and their false alarms."""
    seen_by, rng = camera(pool, 1280, 960), np.random.default_rng([pool, round(visibility), 2])
    methods = restorers(seen_by, visibility, make("joint_road", seen_by))
    ranges = visibility * np.exp(np.arange(math.log(FARTHEST), math.log(NEAREST), -step))
    looks: dict[tuple[str, str], list[list[Found]]] = {(name, kind): [] for name in METHODS for kind in DETECTORS}
    for vehicle in VEHICLES[pool][:vehicles]:
        driven = float(rng.uniform(0.0, 400.0))
        for found in looks.values():
            found.append([])
        for ahead in ranges.tolist():
            foggy = fogged(drawn(renderer, seen_by, vehicle, ahead, driven), visibility, LEVELS, rng)
            box = vehicle_box(seen_by, vehicle, ahead)
            for name, restore in methods.items():
                for kind, one in detect(restore(foggy), seen_by, box, crop(seen_by)).items():
                    looks[name, kind][-1].append(one)
    return {
        key: {
            "range_m": round(float(np.median([first(one, ranges) for one in found])), 1),
            "false_alarms": round(float(np.mean([one.others for looked in found for one in looked])), 3),
        }
        for key, found in looks.items()
    }


def first(looked: list[Found], ranges: NDArray[np.float64]) -> float:
    """Range of the first of two pictures in a row that show the vehicle."""
    for i in range(len(looked) - 1):
        if looked[i].vehicle and looked[i + 1].vehicle:
            return float(ranges[i])
    return float(ranges[-1])


def crop(seen_by: Camera) -> tuple[int, int, int, int]:
    """What detectors look at."""
    aside, above, below = CROP
    u0, v_h = round(seen_by.principal_point[0]), round(seen_by.horizon_row)
    return u0 - aside, v_h - above, u0 + aside, v_h + below


def measure(arguments: argparse.Namespace) -> list[Row]:
    """All records."""
    pool, rows = arguments.pool, []
    visibilities = VISIBILITIES[pool] if arguments.visibilities == list(VISIBILITIES[1]) else arguments.visibilities
    with road_renderer() as renderer:
        for visibility in progress(visibilities, "visibilities"):
            like = likeness(renderer, pool, visibility, arguments.vehicles)
            seen = approaches(renderer, pool, visibility, arguments.vehicles, arguments.step)
            for name in METHODS:
                row: Row = {"pool": pool, "visibility_m": visibility, "method": name, **like[name]}
                for kind in DETECTORS:
                    row |= {f"{kind.lower()}_{key}": value for key, value in seen[name, kind].items()}
                row["range_ratio"] = round(row["sift_range_m"] / seen["foggy", "SIFT"]["range_m"], 2)
                rows.append(row)
    return rows


COLUMNS = {
    "V_met [m]": lambda r: f"{r['visibility_m']:.0f}",
    "method": lambda r: r["method"],
    "PSNR [dB]": lambda r: f"{r['psnr_db']:.1f}",
    "nearer than V_met": lambda r: f"{r['psnr_seen_db']:.1f}",
    "SSIM": lambda r: f"{r['ssim']:.2f}",
    "e": lambda r: f"{r['e']:.1f}",
    "r": lambda r: f"{r['r']:.1f}",
    "s [%]": lambda r: f"{r['s_pct']:.1f}",
    "SIFT: range [m] (ratio)": lambda r: f"{r['sift_range_m']:.0f} ({r['range_ratio']:.1f})",
    "false alarms": lambda r: f"{r['sift_false_alarms']:.2f}",
    "MSER: range [m]": lambda r: f"{r['mser_range_m']:.0f}",
    "its false alarms": lambda r: f"{r['mser_false_alarms']:.2f}",
    "SimpleBlobDetector": lambda r: f"{r['simpleblobdetector_range_m']:.0f}",
    "ms": lambda r: f"{r['ms']:.1f}" if r["method"] != "foggy" else "",
}


def table(rows: list[Row]) -> list[str]:
    """Lines of the table."""
    return lines_of(list(COLUMNS), [[cell(row) for cell in COLUMNS.values()] for row in rows])


def draw(path: Path) -> None:
    """Draw the picture of the docs: clear, foggy and restored, at V_met 80 and 150 m."""
    seen_by, rng = camera(1, 640, 480, 58.0), np.random.default_rng(1)
    rows = []
    with road_renderer() as renderer:
        for visibility in (80.0, 150.0):
            scene = drawn(renderer, seen_by, VEHICLES[1][0], 0.45 * visibility, 60.0)
            rows.append(strip(scene, visibility, rng))
    cv2.imwrite(str(path), cv2.cvtColor(np.concatenate(rows, axis=0), cv2.COLOR_RGB2BGR))


def strip(scene: Scene, visibility: float, rng: np.random.Generator) -> Pixels:
    """One scene in clear air, in fog and restored, with titles."""
    clear, foggy = (fogged(scene, value, LEVELS, rng) for value in (math.inf, visibility))
    methods = restorers(scene.camera, visibility, make("joint_road", scene.camera))
    shown = {"clear": clear, f"V_met {visibility:.0f} m": foggy}
    shown |= {name: methods[name](foggy) for name in ("planar", "dark_channel", "tarel2009")}
    tiles = []
    for title, image in shown.items():
        tile = Image.fromarray(image[60:420, 60:580])
        ImageDraw.Draw(tile).text((10, 8), title, font=font(22), fill=(20, 20, 20))
        tiles.append(np.asarray(tile))
    return np.concatenate(tiles, axis=1)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("how_to/restoration.md", "restoration"),
        pool=1,
        step=(0.1, "of the logarithm of the range, from picture to picture"),
        vehicles=(3, "how many of the vehicles"),
        visibilities=(list(VISIBILITIES[1]), "V_met [m], in place of the pool's"),
        picture=(Path, "draw the picture of the docs there, and stop"),
    )
    cv2.setNumThreads(1)
    if given.picture is not None:
        draw(given.picture)
        return
    rows = measure(given)
    publish(given, rows, table)


if __name__ == "__main__":
    main()
