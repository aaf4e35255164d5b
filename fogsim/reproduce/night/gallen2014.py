"""Gallen et al. (2014): limits of its classes of fog, halos on four drives, and the veil while fog dissipates."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil
from fogsim.calibration.halo_calibration import measure_halo_threshold
from fogsim.calibration.staged_night import SETBACK, NightRoad, NightScene, NightVehicle
from fogsim.calibration.veil_references import PUBLISHED_VISIBILITIES, compute_references
from fogsim.estimators import make
from fogsim.estimators.night.gallen2014 import DENSE, LIGHT
from fogsim.estimators.night.gallen2014_veil import BANDS
from fogsim.estimators.night.halos import PUBLISHED, HaloThreshold, HaloWatch, largest_sharpness, mean_steepness
from fogsim.estimators.night.veil_correlation import (
    VeilReferences,
    VeilTemplates,
    cell_means,
    cell_size,
    visibility_by_parabola,
)
from fogsim.lighting.beams import high_beam, low_beam
from fogsim.reproduce.night.limits import limits, veil_luminance
from fogsim.reproduce.result import (
    PaperCell,
    Reproduction,
    Rows,
    Steps,
    TitledTable,
    Watch,
    chosen_tables,
    figure_image,
    found_visibility,
    unwatched,
)
from fogsim.values import Camera, Lamp, Observation, Response
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import Pixels

Record = Mapping[str, Any]


def _picture(drives: Sequence[Record], fogs: Sequence[Record], threshold: float) -> NDArray[np.uint8]:
    """Draw the veil's luminance, scores by reference, estimated over true visibility, and the drives' halos, if run."""
    figure = Figure(figsize=(13.0, 9.0), dpi=90, layout="constrained")
    (two, eleven), (fourteen, halos) = figure.subplots(2, 2)
    _draw_veil(two)
    if fogs:
        _draw_scores(eleven, fogs)
        _draw_estimates(fourteen, fogs)
    if drives:
        _draw_halos(halos, drives, threshold)
    for axes in (eleven, fourteen, halos):
        axes.set_visible(axes.has_data())
    return figure_image(figure)


def _draw_veil(axes: Axes) -> None:
    visibilities = np.geomspace(30.0, 1000.0, 40).tolist()
    for kind, colour in zip(FogKind, ("C0", "C1"), strict=True):
        published = [high_beam_veil(one, kind) for one in visibilities]
        axes.plot(visibilities, published, f"{colour}--", label=f"{kind}, eq. 9")
        axes.plot(visibilities, veil_luminance(high_beam(), visibilities, kind), colour, label=f"{kind}, FogSim")
    axes.set(xscale="log", xlabel="V_met [m]", ylabel="veil of high beams [cd/m²]", title="Figure 2")
    axes.legend(fontsize=8)


def _draw_scores(axes: Axes, fogs: Sequence[Record]) -> None:
    truth = _column(fogs, "visibility_m")
    for key in (key for key in fogs[0] if key.startswith("score_")):
        axes.plot(truth, _column(fogs, key), label=f"{key.removeprefix('score_')} m")
    axes.set(xscale="log", xlabel="true V_met [m]", ylabel="ZNCC", title="Figure 11: scores of six reference frames")
    axes.legend(fontsize=8, title="V_met of the reference", loc="center right")


def _draw_estimates(axes: Axes, fogs: Sequence[Record]) -> None:
    truth = _column(fogs, "visibility_m")
    axes.plot(truth, truth, color="0.6", lw=1)
    error = np.select([truth < 50.0, truth < 100.0, truth < 200.0], [10.0, 20.0, 40.0], 100.0)
    axes.fill_between(truth, np.maximum(truth - error, 1.0), truth + error, color="0.9", label="published accuracy")
    for name, mark in (("as_published", "x"), ("corrected", "s")):
        axes.plot(truth, _column(fogs, f"{name}_m"), mark, ms=4, label=name.replace("_", " "))
    axes.set(xscale="log", yscale="log", xlabel="true V_met [m]", ylabel="estimated V_met [m]", title="Figure 14")
    axes.set_ylim(8.0, 3000.0)
    axes.legend(fontsize=8)


def _draw_halos(axes: Axes, drives: Sequence[Record], threshold: float) -> None:
    names = [str(record["drive"]) for record in drives]
    axes.bar(names, _column(drives, "median_br50"), color=["C0", "C0", "0.6", "0.6"])
    axes.axhline(threshold, color="C3", label="calibrated threshold")
    axes.axhline(9.0, color="C3", ls=":", label="the paper's threshold")
    axes.set(ylabel="median of mean Br50 [levels/px]", title="Halos on four drives")
    axes.legend(fontsize=8)


CAMERA = Camera(1280, 800, 1154.0, (639.5, 399.5), 1.38, pitch=0.035, response=Response.SRGB)
"""The size of the paper's images; nothing else is known of its camera."""

_TABLES = ("I", "figure 8", "figure 11", "figure 12", "figure 14")
"""Parts of the paper that can be chosen: table I with equations 11 and 12, and figures with the text about them."""

_DRIVES = (("clear 1", math.inf, 1), ("clear 2", math.inf, 2), ("fog 1", 150.0, 1), ("fog 2", 80.0, 2))
"""Name, visibility [m] and seed of the drives past lamps; those with one seed go past the same."""

_FRAME_STEP = 0.6
"""Distance from one frame to the next [m]: 25 frames a second at 54 km/h."""

REFERENCES = (12.6, 51.4, 91.8, 167.8, 415.6, 2000.0)
"""Visibilities of the six frames that are references for all frames of the dissipating fog [m] (section IV-C)."""

LIDAR = 368.0
"""Visibility by LIDAR on the open road of figure 12 [m]."""

_COMPOSED, _COMPOSED_STEP = 10, 6.0
"""Frames whose mean is compared, and the distance between two [m]; the paper does not say how many."""

_NOTES = (
    "Halos: street lamps, a vehicle ahead and oncoming ones in clear air and in fog of 150 and 80 m. The paper states"
    " neither how dense its fog was nor whether its rate counts clear frames; ours does. 'As published' has the mean"
    " Br50 and the threshold 9, 'corrected' the largest sharpness and a threshold from other scenes.",
    "Veil: a straight road with marks and signs, not a fog chamber. 'As published' compares with six frames of the same"
    " drive and takes the top of exp(aV² + bV + c); 'corrected' is the model of night_road.",
    "Equations 11 and 12: 'as published' has one L_v (eq. 9) for both beams, 'corrected' each beam's own veil by"
    " FogSim's model. The beams are median US ones; the paper does not print its European ones.",
    "Not compared: Br50 in the photographs of figure 10, whose visibility is unknown, and figures without values.",
)

_LOW = Lamp.POSITION | Lamp.LOW_BEAM
_HALOS = {"published": mean_steepness, "mean": mean_steepness, "largest": largest_sharpness}
_METHODS = ("as_published", "corrected")
_CLASSES: tuple[tuple[str, float, float, float, Literal["at_least", "equal", "at_most"]], ...] = (
    ("dense fog (3), < 100 m", 0.0, DENSE, 0.6, "at_least"),
    ("fog (2), 100 to 300 m", DENSE, LIGHT, 0.4, "equal"),
    ("light fog (1), > 300 m", LIGHT, math.inf, 0.2, "at_most"),
)  # limits of V_met [m] (table I), and score with references of dense fog (section IV-B)
_BANDS = tuple(zip(("< 50 m", "50 to 100 m", "100 to 200 m", "> 200 m"), (0.0, 50.0, 100.0, 200.0), BANDS, strict=True))


@dataclass(frozen=True, slots=True)
class Size:
    """How much is run: frames of each drive (2132 in all), scenes of the halos' calibration, fogs of figure 14."""

    frames: int = 533
    scenes: int = 60
    fogs: int = 50


_QUICK = Size(frames=60)


def reproduce(
    camera: Camera = CAMERA,
    size: Size | None = None,
    *,
    quick: bool = False,
    table: str | None = None,
    watch: Watch = unwatched,
) -> Reproduction:
    """Take pictures of lamps and of the own beams' veil by night; `quick` takes a ninth of the drives' frames."""
    wanted = chosen_tables(_TABLES, table)
    size = size or (_QUICK if quick else Size())
    has_drives, has_fogs = "figure 8" in wanted, bool({"I", "figure 11", "figure 14"}.intersection(wanted))
    frames_driven = has_drives * (size.scenes + len(_DRIVES) * size.frames)
    steps = Steps(frames_driven + has_fogs * (len(REFERENCES) + size.fogs) + 1, watch)
    tables, cells, drives, fogs, road, least = list[TitledTable](), list[PaperCell](), [], [], [], PUBLISHED
    if has_drives:
        threshold = measure_halo_threshold(camera, size.scenes, watch=lambda done, _: steps.advance() if done else None)
        least = threshold.steepness
        drives = [_drive(camera, *drive, threshold, size.frames, steps) for drive in _DRIVES]
        tables.append(TitledTable("Halos: frames taken for fog, each and by the mean of 25 [%]", _drive_rows(drives)))
        cells += drive_cells(drives, least)
    if has_fogs:
        fogs = list(_dissipating(camera, size.fogs, steps))
        tables.append(TitledTable("Estimates of the right class and within the published accuracy", _right_rows(fogs)))
        tables.append(TitledTable("Veil while fog dissipates: scores by reference and estimates [m]", _fog_rows(fogs)))
        cells += fog_cells(fogs, wanted)
    if "figure 12" in wanted:
        road = [_open_road(camera)]
        tables.append(TitledTable(f"Scores in fog of {LIDAR:g} m on an open road, by reference", _road_rows(road[0])))
        cells.append(road_cell(road[0]))
    if "I" in wanted:
        cells += limit_cells()
    steps.advance()
    records = (*drives, *fogs, *road)
    drawn = _picture(drives, fogs, least)
    return Reproduction("gallen2014", records, tables[0].rows, _NOTES, drawn, tuple(tables), cells=tuple(cells))


def _drive(
    camera: Camera, name: str, visibility: float, seed: int, threshold: HaloThreshold, frames: int, steps: Steps
) -> dict[str, Any]:
    """Drive past lamps, and count frames that are taken for fog."""
    rng = np.random.default_rng((20, seed, round(min(visibility, 1e6))))
    least = {"published": PUBLISHED, "mean": threshold.steepness, "largest": threshold.sharpness}
    watches = {name: HaloWatch(least[name], value_of) for name, value_of in _HALOS.items()}
    counts = dict.fromkeys([f"{name}_{span}" for name in _HALOS for span in ("each", "of_25")], 0)
    sources, values = 0, list[float]()
    with NightRoad(camera, seed=seed) as road:
        for number in range(frames):
            light = road.radiances(_scene(number * _FRAME_STEP, seed), [visibility])[0]
            image = road.photograph(light, 1.0, rng)
            steps.advance()
            readings = {name: watch.look(image, camera.bits) for name, watch in watches.items()}
            if (mean := readings["mean"].value) is None:
                continue
            values.append(mean)
            sources += len(readings["mean"].halos)
            for kind, reading in readings.items():
                counts[f"{kind}_each"] += (reading.value or 0.0) < least[kind]
                counts[f"{kind}_of_25"] += bool(reading.is_fog)
    return {
        "drive": name,
        "visibility_m": visibility if math.isfinite(visibility) else None,
        "frames": frames,
        "with_halos": len(values),
        "halos_a_frame": round(sources / max(len(values), 1), 1),
        "median_br50": round(float(np.median(values)), 2) if values else None,
        **counts,
    }


def _scene(way: float, seed: int) -> NightScene:
    """Street lamps, a vehicle ahead at about the own speed, and oncoming ones."""
    oncoming = [(55.0 * number + 30.0 * seed - 2.0 * way) % 220.0 + 12.0 for number in range(4)]
    ahead = NightVehicle(35.0 + 8.0 * math.sin(way / 20.0 + seed), 0.1, _LOW)
    others = (NightVehicle(distance, 3.5, _LOW, oncoming=True) for distance in oncoming)
    return NightScene(way, (ahead, *others), street_lamps=True)


def _dissipating(camera: Camera, fogs: int, steps: Steps) -> Iterator[dict[str, Any]]:
    """Estimates in each fog, by the paper's six references from the same drive, and by the model of `night_road`."""
    with NightRoad(camera, seed=5) as road:

        def drive(visibility: float, *seed: int) -> list[Pixels]:
            steps.advance()
            return _driven(road, visibility, (21, *seed))

        cells = np.array([_mean_cells(drive(one, 0, number), camera) for number, one in enumerate(REFERENCES)])
        of_images = replace(camera, response=Response.LINEAR)
        references = VeilReferences(of_images, np.array(REFERENCES), cells, np.zeros_like(cells))
        templates = VeilTemplates(references)
        for number, visibility in enumerate(np.geomspace(REFERENCES[0], REFERENCES[-1], fogs).tolist()):
            images = drive(visibility, 1, number)
            scores = templates.scores(_mean_cells(images, camera))
            corrected = make("gallen2014_veil", camera, frames=_COMPOSED)
            for image in images:
                veil = corrected.update(Observation(image, camera_setback=SETBACK, lamps=_LOW))
            found = visibility_by_parabola(scores), found_visibility(veil)
            record: dict[str, Any] = {"visibility_m": round(visibility, 1)}
            for one, score in zip(REFERENCES, scores.score.tolist(), strict=True):
                record[f"score_{one:g}"] = round(score, 3)
            record |= {f"{name}_m": one and round(one, 1) for name, one in zip(_METHODS, found, strict=True)}
            low, high = veil.visibility_interval
            yield record | {"corrected_low_m": round(low, 1), "corrected_high_m": round(min(high, 1e6), 1)}


def _driven(road: NightRoad, visibility: float, seed: tuple[int, ...]) -> list[Pixels]:
    """Frames of a drive in fog on a road without other lamps."""
    lights = (road.radiances(NightScene(_COMPOSED_STEP * number), [visibility])[0] for number in range(_COMPOSED))
    return [road.photograph(light, 1.0, np.random.default_rng((*seed, at))) for at, light in enumerate(lights)]


def _mean_cells(images: Sequence[Pixels], camera: Camera) -> NDArray[np.float64]:
    """Mean pixel values of the images by cells."""
    values, size = replace(camera, response=Response.LINEAR), cell_size(camera)
    cells = [cell_means(linear_pixels(image, values), size).luminance for image in images]
    return np.asarray(np.mean(cells, axis=0))


def _open_road(camera: Camera) -> dict[str, Any]:
    """Scores of the paper's six simulated references with the mean of successive frames."""
    visibilities, lit = PUBLISHED_VISIBILITIES, Lamp.LOW_BEAM
    made = compute_references(camera, lit, SETBACK, visibilities)
    with NightRoad(camera, seed=6) as road:
        cells = _mean_cells(_driven(road, LIDAR, (22,)), camera)
    record: dict[str, Any] = {"visibility_m": LIDAR}
    for name in _METHODS:
        found = VeilTemplates(made, common_mask=name == "corrected").scores(cells)
        for one, score in zip(visibilities, (*found.score.tolist(), found.clear), strict=True):
            record[f"{name}_score_{one:g}"] = round(score, 3)
    return record


def _drive_rows(records: Sequence[Record]) -> Rows:
    heading = ("drive", "V_met [m]", "frames", "halos each", "median Br50")
    rows: list[tuple[str, ...]] = [(*heading, "mean Br50 < 9", "mean, calibrated", "sharpest, calibrated")]
    for one in records:
        visibility = "clear" if one["visibility_m"] is None else f"{one['visibility_m']:.0f}"
        cells = [str(one[key]) for key in ("drive", "with_halos", "halos_a_frame", "median_br50")]
        count = 0.01 * max(one["with_halos"], 1.0)
        shares = (", ".join(f"{one[f'{name}_{span}'] / count:.1f}" for span in ("each", "of_25")) for name in _HALOS)
        rows.append((cells[0], visibility, *cells[1:], *shares))
    return tuple(rows)


def drive_cells(records: Sequence[Record], threshold: float) -> list[PaperCell]:
    """Frames of all drives that are classified right, and the threshold between clear and foggy frames."""

    def right(key: str) -> float:
        wrong = sum(one[key] if one["visibility_m"] is None else one["with_halos"] - one[key] for one in records)
        return float(round(100.0 * (1.0 - wrong / max(sum(one["with_halos"] for one in records), 1)), 2))

    cells = [PaperCell("section III-B", "threshold", "mean Br50 [levels/px]", PUBLISHED, threshold, threshold)]
    for span, row, paper in (("each", "each frame", 98.4), ("of_25", "mean of 25 frames", 99.86)):
        found = right(f"published_{span}"), right(f"largest_{span}")
        cells.append(PaperCell("section IV-B", f"halos, {row}", "frames right [%]", paper, *found, "at_least"))
    return cells


def _right_rows(records: Sequence[Record]) -> Rows:
    """How many estimates are right, of all frames."""
    truth, rows = _column(records, "visibility_m"), [("what is right", "V_met", "frames", *map(_words, _METHODS))]
    estimates = [_column(records, f"{name}_m") for name in _METHODS]
    for name, least, most, *_ in _CLASSES:
        here = (least <= truth) & (truth < most)
        right = [np.count_nonzero(here & (least <= some) & (some < most)) for some in estimates]
        rows.append(("class (table I)", name, str(np.count_nonzero(here)), *map(str, right)))
    for name, least, (most, error) in _BANDS:
        here = (least <= truth) & (truth < most)
        right = [np.count_nonzero(here & (np.abs(some - truth) <= error)) for some in estimates]
        rows.append((f"estimate within {error:g} m", name, str(np.count_nonzero(here)), *map(str, right)))
    return tuple(rows)


def _fog_rows(records: Sequence[Record]) -> Rows:
    keys = ("visibility_m", *(f"score_{one:g}" for one in REFERENCES), *(f"{name}_m" for name in _METHODS))
    heading = ("V_met [m]", *(f"{one:g} m" for one in REFERENCES), *map(_words, _METHODS))
    return (heading, *(tuple("—" if one[key] is None else str(one[key]) for key in keys) for one in records))


def _class_cells(records: Sequence[Record]) -> list[PaperCell]:
    """True visibilities at which the estimated class changes."""
    truth = _column(records, "visibility_m")

    def change(method: str, limit: float) -> float | None:
        estimates = _column(records, f"{method}_m")
        below, above = truth[estimates < limit], truth[estimates >= limit]
        return round(math.sqrt(below.max() * above.min()), 1) if len(below) and len(above) else None

    column = "V_met at which estimates change class [m]"
    return [
        PaperCell("table I", row, column, limit, change("as_published", limit), change("corrected", limit))
        for row, limit in (("dense fog (3) to fog (2)", DENSE), ("fog (2) to light fog (1)", LIGHT))
    ]


def _score_cells(records: Sequence[Record]) -> list[PaperCell]:
    """Scores with the reference frames of dense fog, which are the same in both forms."""
    scores = np.mean([_column(records, f"score_{one:g}") for one in REFERENCES if one < DENSE], axis=0)
    truth, cells = _column(records, "visibility_m"), []
    for name, least, most, paper, claim in _CLASSES:
        found = round(float(np.median(scores[(least <= truth) & (truth < most)])), 2)
        cells.append(PaperCell("section IV-B", name, "score with dense fog, median", paper, found, found, claim))
    return cells


def _accuracy_cells(records: Sequence[Record]) -> list[PaperCell]:
    """Largest errors of the estimates that there are."""
    truth = _column(records, "visibility_m")

    def largest(method: str, least: float, most: float) -> float | None:
        errors = np.abs(_column(records, f"{method}_m") - truth)[(least <= truth) & (truth < most)]
        return None if np.isnan(errors).all() else round(float(np.nanmax(errors)), 1)

    cells = []
    for name, least, (most, error) in _BANDS:
        published, corrected = largest("as_published", least, most), largest("corrected", least, most)
        cells.append(
            PaperCell("section IV-C", f"V_met {name}", "largest error [m]", error, published, corrected, "at_most")
        )
    return cells


def fog_cells(records: Sequence[Record], wanted: Sequence[str] = _TABLES) -> list[PaperCell]:
    """Classes, scores and errors while fog dissipates."""
    parts = {"I": _class_cells, "figure 11": _score_cells, "figure 14": _accuracy_cells}
    return [cell for name, part in parts.items() if name in wanted for cell in part(records)]


def _road_rows(record: Record) -> Rows:
    names = ("clear" if math.isinf(one) else f"{one:g} m" for one in PUBLISHED_VISIBILITIES)
    scores = {name: [record[f"{name}_score_{one:g}"] for one in PUBLISHED_VISIBILITIES] for name in _METHODS}
    return (("reference", *names), *((_words(name), *map(str, scores[name])) for name in scores))


def road_cell(record: Record) -> PaperCell:
    """The reference that is most like the open road."""

    def best(method: str) -> float:
        return max(PUBLISHED_VISIBILITIES, key=lambda one: float(record[f"{method}_score_{one:g}"]))

    column = "reference with the best score [m]"
    return PaperCell("figure 12", f"V_met {LIDAR:g} m by LIDAR", column, 500.0, best("as_published"), best("corrected"))


def limit_cells() -> list[PaperCell]:
    """Equations 11 and 12 in both types of fog."""
    cells, column = [], "V_met where both beams show equally far [m]"
    for kind in FogKind:
        (eleven, twelve), (own_eleven, own_twelve) = limits(low_beam(), kind), limits(low_beam(), kind, None)
        row = f"{kind} fog, low beams in"
        cells.append(PaperCell("equation 11", f"{row} the same fog", column, 100.0, eleven, own_eleven))
        cells.append(PaperCell("equation 12", f"{row} clear air", column, 300.0, twelve, own_twelve))
    return cells


def _column(records: Sequence[Record], key: str) -> NDArray[np.float64]:
    """Values of the records, NaN where there is none."""
    return np.array([one[key] for one in records], np.float64)


def _words(name: str) -> str:
    return name.replace("_", " ")
