"""Negru & Nedevschi (ICCP 2013), section V: k = 0.01 … 0.15 /m on an empty road, with trees, with vehicles."""

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.calibration.staged_road import foggy_image, road_renderer, views
from fogsim.estimators import make
from fogsim.estimators.negru2013 import Negru2013Repair
from fogsim.recorders.style import font
from fogsim.reproduce.result import (
    Cell,
    PaperCell,
    Reproduction,
    Steps,
    TitledTable,
    Watch,
    chosen_tables,
    found_visibility,
    unwatched,
)
from fogsim.reproduce.road_sweeps import DRIVES, over_growths, steps_of, swept
from fogsim.units import visibility_from_extinction
from fogsim.values import Camera, Estimate, Observation, fog_category

CAMERA = Camera(688, 515, 700.0, (343.5, 257.0), mount_height=1.3, pitch=0.02)
"""The paper's size of image; it does not say the rest."""

EXTINCTIONS = tuple(round(0.01 * step, 2) for step in range(1, 16))
"""Extinction coefficients [1/m]: the paper gives the ends."""

SCENES: Mapping[str, tuple[bool, tuple[tuple[float, float], ...]]] = {
    "empty road": (False, ()),
    "trees": (True, ()),
    "trees and vehicles": (True, ((30.0, 0.0), (22.0, 3.5))),
}
"""Whether things stand next to the road, and cars by distance ahead and to the left [m]."""

_TABLES = ("figure 4",)
"""Parts of the evaluation that can be run alone."""

VARIANTS: Mapping[str, Mapping[str, bool]] = {
    "printed": {"as_published": True, "printed_signs": True},
    "published": {"as_published": True},
    "corrected": {},
}
"""Options of the estimator: with eqs. 17 and 18 as printed, with their signs mended alone, and with all repairs."""

_TITLES: Mapping[str, str] = {
    "printed": "eqs. 17, 18 as printed",
    "published": "signs mended",
    "corrected": "corrected",
}
"""Variants as the table calls them."""

_PICTURED = 0.03
"""Extinction coefficient of the picture [1/m]."""

_PAPER_MS: Mapping[tuple[int, int], float] = {(688, 515): 21.0, (512, 383): 12.0}
"""Average time of a frame in section V [ms], by width and height [px]: of synthetic and of real images."""

_BLUE, _PINK, _BLACK = (40, 70, 255), (255, 60, 200), (0, 0, 0)

_NOTES = (
    "The paper prints no errors: it shows images with the visibility written on them, so only times can be compared. Of"
    " its real images (319 m to less than 30 m) the true visibility is not known.",
    "It does not say focal length, mount height or pitch; assumed 700 px, 1.3 m and 0.02 rad.",
    "Eqs. 17 and 18 as printed have the wrong sign for rows that count downward, so 'as published' has them mended and"
    " nothing else. Region growing is Hautière's (2006), whose limits the paper does not print: G_max is 8 levels, of"
    " least mean error in the last table, whose drives are other ones than these scenes.",
    "Airlight 255 as in the paper, so the sky is saturated and the upper end of the curve is clipped.",
    "Times are processor times of this machine, the least of ten; the paper's are averages of an i7 of 2013.",
)


def reproduce(
    drives: int | None = None, *, quick: bool = False, table: str | None = None, watch: Watch = unwatched
) -> Reproduction:
    """Estimate on each scene at each extinction, and sweep what the paper leaves open over some drives."""
    chosen_tables(_TABLES, table)
    drives = drives or (1 if quick else DRIVES)
    records: list[Mapping[str, Cell]] = []
    pictures = []
    steps = Steps(len(SCENES) * len(EXTINCTIONS) + (steps_of(drives) if table is None else 0), watch)
    for scene, (trees, cars) in SCENES.items():
        with views(CAMERA, cars, trees=trees) as (view, pose):
            for extinction in EXTINCTIONS:
                image = foggy_image(view, pose, CAMERA, extinction)
                estimates = {name: _estimate(image, options) for name, options in VARIANTS.items()}
                records.append(_record(scene, extinction, estimates))
                if extinction == _PICTURED:
                    pictures.append(_picture(image, estimates["corrected"]))
                steps.advance()
    shown = [TitledTable("V_met by scene and k: true, and as found (error)", _table(records))]
    sweeps: list[dict[str, Cell]] = []
    if table is None:
        with road_renderer() as renderer:
            left_open = over_growths("published", VARIANTS["published"])
            sweeps, tables = swept("negru2013", Negru2013Repair, renderer, steps, drives, left_open)
        shown += tables
    cells = paper_cells()
    return Reproduction(
        "negru2013", tuple(records), shown[0].rows, _NOTES, np.hstack(pictures), tuple(shown), tuple(sweeps), cells
    )


def paper_cells() -> tuple[PaperCell, ...]:
    """Times of a frame at both sizes of the paper."""
    cells = []
    for (width, height), printed in _PAPER_MS.items():
        scale = width / CAMERA.width
        point = (0.5 * (width - 1), 0.5 * (height - 1))
        camera = replace(CAMERA, width=width, height=height, focal_length=scale * 700.0, principal_point=point)
        with views(camera, (), trees=False) as (view, pose):
            image = foggy_image(view, pose, camera, _PICTURED)
        published, corrected = (_milliseconds(image, camera, VARIANTS[name]) for name in ("published", "corrected"))
        row = f"frame of {width}×{height} px"
        cells.append(PaperCell("section V", row, "time [ms]", printed, published, corrected, "at_most"))
    return tuple(cells)


def _estimate(image: NDArray[np.uint8], options: Mapping[str, bool]) -> Estimate:
    # A new estimator for each image: they are no sequence.
    return make("negru2013", CAMERA, **options).update(Observation(image))


def _milliseconds(
    image: NDArray[np.uint8], camera: Camera, options: Mapping[str, bool], repetitions: int = 10
) -> float:
    estimator, took = make("negru2013", camera, **options), []
    for _ in range(repetitions):
        begin = time.process_time()
        estimator.update(Observation(image))
        took.append(1000.0 * (time.process_time() - begin))
    return min(took)


def _record(scene: str, extinction: float, estimates: Mapping[str, Estimate]) -> dict[str, Cell]:
    true = visibility_from_extinction(extinction)
    record: dict[str, Cell] = {
        "paper": "negru2013",
        "scene": scene,
        "extinction_per_m": extinction,
        "visibility_m": true,
        "category": fog_category(true).value,
    }
    for name, estimate in estimates.items():
        record[f"{name}_visibility_m"] = found_visibility(estimate)
        record[f"{name}_category"] = estimate.category.value if estimate.valid else None
    return record


def _table(records: list[Mapping[str, Cell]]) -> tuple[tuple[str, ...], ...]:
    heading = ("scene", "k [1/m]", "V_met [m]", *(f"{_TITLES[name]} [m]" for name in VARIANTS), "category", "found")
    rows = [heading]
    for record in records:
        found = [_metres(record[f"{name}_visibility_m"], float(str(record["visibility_m"]))) for name in VARIANTS]
        true, category = str(record["category"]), record["corrected_category"]
        start = (str(record["scene"]), f"{record['extinction_per_m']:.2f}", f"{record['visibility_m']:.0f}")
        rows.append((*start, *found, true, "no estimate" if category is None else str(category)))
    return tuple(rows)


def _metres(found: Cell, true: float) -> str:
    return f"{found:.1f} ({100.0 * (found / true - 1.0):+.0f} %)" if isinstance(found, float) else "—"


def _picture(image: NDArray[np.uint8], estimate: Estimate) -> NDArray[np.uint8]:
    """The paper's figure 4: horizon and band in blue, inflection in pink, curve in black, visibility in words."""
    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    found = estimate.diagnostics
    for key, colour in (("horizon_row", _BLUE), ("inflection_row", _PINK)):
        row = found.get(key)
        if isinstance(row, int | float):
            draw.line([(0, row), (image.shape[1], row)], fill=colour, width=2)
    band, profile = found.get("band"), found.get("profile")
    if isinstance(band, tuple) and isinstance(profile, np.ndarray):
        left, right, top, bottom = band
        for side in (left, right):
            draw.line([(side, top), (side, bottom)], fill=_BLUE, width=2)
        draw.line([(float(value), top + i) for i, value in enumerate(profile)], fill=_BLACK, width=2)
    text = f"V = {estimate.visibility:.1f} m" if estimate.valid else "no estimate"
    draw.text((12, 12), text, fill=_BLACK, font=font(22, bold=True))
    return np.asarray(picture)
