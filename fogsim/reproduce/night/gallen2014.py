"""Gallen et al. (2014), section IV: halos on clear and foggy drives, and the veil while fog dissipates."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fogsim.atmosphere.visibility.night_visibility import FogKind, high_beam_veil, visibility_distance
from fogsim.calibration.cached import supply
from fogsim.calibration.halo_calibration import measure_halo_threshold
from fogsim.calibration.staged_night import SETBACK, NightRoad, NightScene, NightVehicle
from fogsim.estimators.night.gallen2014 import fog_class
from fogsim.estimators.night.gallen2014_veil import BANDS, Gallen2014Veil
from fogsim.estimators.night.halos import PUBLISHED, HaloThreshold, HaloWatch, largest_sharpness, mean_steepness
from fogsim.estimators.night.night_road import NightRoad as NightRoadEstimator
from fogsim.lighting.beams import high_beam, low_beam, scaled_beam
from fogsim.reproduce.night.gallen2014_picture import picture
from fogsim.reproduce.night.limits import clear_low_sight, equal_sight, veil_luminance
from fogsim.reproduce.result import Cell, Reproduction, Rows, Steps, TitledTable, Watch, unwatched
from fogsim.values import Camera, Estimate, Frame, Lamp, Observation, Response

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, pitch=0.035, response=Response.SRGB)
"""Half the paper's 1280×800 px; it tells no more of its camera."""

DRIVES = (("clear 1", math.inf, 1), ("clear 2", math.inf, 2), ("fog 1", 150.0, 1), ("fog 2", 80.0, 2))
"""Name, visibility [m] and seed of the drives past lamps; those with one seed go past the same."""

PICTURES, FRAME_STEP = 130, 0.6
"""Pictures of each, 520 in all to the paper's 2130, and the way from one to the next [m]: 25 a second at 54 km/h."""

DISSIPATING = tuple(np.geomspace(15.0, 500.0, 18).tolist())
"""Visibilities while fog dissipates [m]."""

COMPOSED = 8
"""Pictures that are composed."""

THIRD = 0.3
"""Low beams over those measured in the US in 2004 with which equations 11 and 12 come out [-]."""

NOTES = (
    "Halos: drives past about ten lamps (street lamps, a vehicle ahead, oncoming ones) in clear air, and in fog of 150"
    " and 80 m. The calibrated threshold comes from other scenes (`fogsim calibrate halos`); 9 is the paper's, of its"
    " camera.",
    "Veil: references are simulated, not frames of the same fog chamber's video as the paper's; a straight road with"
    " marks and signs is driven along while the fog dissipates. 'as published' is exp(aV² + bV + c) through five"
    " references.",
    "Figure 2 and equations 11 and 12: docs/explanation/night.md says with which beams and veils they come out.",
)

_LOW = Lamp.POSITION | Lamp.LOW_BEAM
_KINDS = ("published", "mean", "largest")
_METHODS = ("as_published", "log_spaced", "night_road")


@dataclass(frozen=True, slots=True)
class Size:
    """How much is run.

    Attributes
    ----------
    pictures : int
        Of each drive.
    scenes : int
        Of the calibration of halos.
    visibilities : tuple of float
        While fog dissipates [m].
    composed : int
        Pictures that are composed at each.
    """

    pictures: int = PICTURES
    scenes: int = 60
    visibilities: tuple[float, ...] = DISSIPATING
    composed: int = COMPOSED


_WHOLE = Size()


def reproduce(camera: Camera = CAMERA, size: Size = _WHOLE, *, watch: Watch = unwatched) -> Reproduction:
    """Run the evaluation again.

    Parameters
    ----------
    camera : Camera
        The camera.
    size : Size
        How much is run.
    watch : Watch
        Is told of every scene, picture and visibility.
    """
    steps = Steps(size.scenes + len(DRIVES) * size.pictures + len(size.visibilities), watch)
    threshold = measure_halo_threshold(camera, size.scenes, watch=_Advancing(steps))
    records = [_drive(camera, *drive, threshold, size.pictures, steps) for drive in DRIVES]
    veil = list(_veils(camera, size, steps))
    limits = _limits()
    tables = (
        TitledTable("Halos: pictures taken for fog [%], alone and of 25", _halo_rows(records, threshold)),
        TitledTable("Veil: visibility while fog dissipates (figures 11, 13 and 14)", _veil_rows(veil)),
        TitledTable("Accuracy: within the paper's bands (10, 20, 40, 100 m)", _band_rows(veil)),
        TitledTable("Veil of high beams toward the road 40 m ahead (figure 2) [cd/m²]", _figure_two()),
        TitledTable("Fogs from which on high beams show less (equations 11 and 12)", limits),
    )
    return Reproduction(
        "gallen2014", (*records, *veil), tables[0].rows, NOTES, picture(records, veil, threshold.steepness), tables
    )


class _Advancing:
    """Passes the steps of a part on, as steps of the whole."""

    def __init__(self, steps: Steps) -> None:
        self._steps = steps

    def __call__(self, done: int, _: int) -> None:
        if done:
            self._steps.advance()


def _drive(
    camera: Camera, name: str, visibility: float, seed: int, threshold: HaloThreshold, pictures: int, steps: Steps
) -> dict[str, Cell]:
    """Drive past lamps, and count pictures that are taken for fog."""
    rng = np.random.default_rng((20, seed, round(min(visibility, 1e6))))
    least = {"published": PUBLISHED, "mean": threshold.steepness, "largest": threshold.sharpness}
    values_of = {"published": mean_steepness, "mean": mean_steepness, "largest": largest_sharpness}
    watches = {kind: HaloWatch(least[kind], values_of[kind]) for kind in least}
    alone, smooth, seen, sources = dict.fromkeys(watches, 0), dict.fromkeys(watches, 0), 0, 0
    values = list[float]()
    with NightRoad(camera, seed=seed) as road:
        for number in range(pictures):
            light = road.radiances(_scene(number * FRAME_STEP, seed), [visibility])[0]
            image = road.photograph(light, 1.0, rng)
            readings = {kind: watch.look(image, camera.bits) for kind, watch in watches.items()}
            for kind, reading in readings.items():
                if reading.value is not None:
                    alone[kind] += reading.value < least[kind]
                    smooth[kind] += bool(reading.is_fog)
            mean = readings["mean"]
            if mean.value is not None:
                seen, sources = seen + 1, sources + len(mean.halos)
                values.append(mean.value)
            steps.advance()
    found: dict[str, Cell] = {"drive": name, "visibility_m": visibility if math.isfinite(visibility) else None}
    found |= {"pictures": pictures, "with_halos": seen, "halos_a_picture": round(sources / max(seen, 1), 1)}
    for kind in watches:
        found[f"{kind}_alone_percent"] = round(100.0 * alone[kind] / max(seen, 1), 2)
        found[f"{kind}_25_percent"] = round(100.0 * smooth[kind] / max(seen, 1), 2)
    found["median_br50"] = round(float(np.median(values)), 2) if values else None
    return found


def _scene(way: float, seed: int) -> NightScene:
    """Street lamps, a vehicle ahead at about the own speed, and oncoming ones."""
    oncoming = [(55.0 * number + 30.0 * seed - 2.0 * way) % 220.0 + 12.0 for number in range(4)]
    ahead = NightVehicle(35.0 + 8.0 * math.sin(way / 20.0 + seed), 0.1, _LOW)
    others = (NightVehicle(distance, 3.5, _LOW, oncoming=True) for distance in oncoming)
    return NightScene(way, (ahead, *others), street_lamps=True)


def _veils(camera: Camera, size: Size, steps: Steps) -> Iterator[dict[str, Cell]]:
    """Estimates by the veil on a road without lamps, in fog of each visibility."""
    with NightRoad(camera, seed=5) as road:
        scenes = [NightScene(6.0 * number) for number in range(size.composed)]
        lights = [road.radiances(scene, size.visibilities) for scene in scenes]
        for at, visibility in enumerate(size.visibilities):
            rng = np.random.default_rng((21, at))
            methods = (
                Gallen2014Veil(camera, as_published=True, frames=size.composed),
                Gallen2014Veil(camera, frames=size.composed),
                NightRoadEstimator(camera, frames=size.composed),
            )
            told: list[Estimate] = []
            for number, light in enumerate(lights):
                image = road.photograph(light[at], 1.0, rng)
                seen = Observation(Frame(0.3 * number, image, camera), 20.0, camera_setback=SETBACK, lamps=_LOW)
                told = [method.update(seen) for method in _told(methods)]
            steps.advance()
            yield _veil_record(visibility, told)


def _told(
    methods: tuple[Gallen2014Veil, Gallen2014Veil, NightRoadEstimator],
) -> tuple[Gallen2014Veil, Gallen2014Veil, NightRoadEstimator]:
    for method in methods:
        supply(method)
    return methods


def _veil_record(visibility: float, told: Sequence[Estimate]) -> dict[str, Cell]:
    published = told[0].diagnostics
    scores = published.get("scores", ())
    record: dict[str, Cell] = {"visibility_m": round(visibility, 1), "fog_class": fog_class(visibility)}
    record["score"] = round(float(str(published["score"])), 3) if "score" in published else None
    record["scores"] = " ".join(f"{float(one):.3f}" for one in scores) if isinstance(scores, tuple) else None
    for name, one in zip(_METHODS, told, strict=True):
        fog = one.valid and one.extinction > 0.0
        record[f"{name}_m"] = round(one.visibility, 1) if fog else None
        record[f"{name}_class"] = fog_class(one.visibility) if fog else None
    low = scaled_beam(low_beam(), THIRD)
    record["sight_by_low_beams_m"] = round(visibility_distance(low, visibility, veil_share=0.1), 1)
    return record


def _halo_rows(records: Sequence[dict[str, Cell]], threshold: HaloThreshold) -> Rows:
    heading = ("drive", "V_met [m]", "pictures", "halos each", "median Br50")
    names = "mean Br50 < 9", f"< {threshold.steepness:g}", f"ours, sharpest < {threshold.sharpness:g}"
    rows: list[tuple[str, ...]] = [(*heading, *names)]
    for one in records:
        visibility = "clear" if one["visibility_m"] is None else f"{float(str(one['visibility_m'])):.0f}"
        told = tuple(str(one[key]) for key in ("drive", "with_halos", "halos_a_picture", "median_br50"))
        shares = (f"{one[f'{kind}_alone_percent']}, {one[f'{kind}_25_percent']}" for kind in _KINDS)
        rows.append((told[0], visibility, *told[1:], *shares))
    rows.append(("the paper, right", "", "2130", "10", "", "98.4, 99.86", "", ""))
    return tuple(rows)


def _veil_rows(records: Sequence[dict[str, Cell]]) -> Rows:
    heading = ("V_met [m]", "class", "best score", "as published [m]", "ln-spaced [m]", "night_road [m]", "sight [m]")
    keys = ("visibility_m", "fog_class", "score", *(f"{name}_m" for name in _METHODS), "sight_by_low_beams_m")
    return (heading, *(tuple("–" if one[key] is None else str(one[key]) for key in keys) for one in records))


def _band_rows(records: Sequence[dict[str, Cell]]) -> Rows:
    """Of the estimates of each method in each band, how many are within, and how many there are."""
    rows: list[tuple[str, ...]] = [("V_met [m]", "published error [m]", *(name.replace("_", " ") for name in _METHODS))]
    least = 0.0
    for most, error in BANDS:
        here = [one for one in records if least <= float(str(one["visibility_m"])) < most]
        cells = []
        for name in _METHODS:
            off = [
                abs(float(str(one[f"{name}_m"])) - float(str(one["visibility_m"])))
                for one in here
                if one[f"{name}_m"] is not None
            ]
            cells.append(f"{sum(one <= error for one in off)} of {len(here)}, {len(here) - len(off)} not told")
        rows.append((f"{least:.0f} … {most:.0f}" if math.isfinite(most) else f"{least:.0f} …", f"{error:.0f}", *cells))
        least = most
    return tuple(rows)


def _figure_two() -> Rows:
    visibilities = (30.0, 50.0, 100.0, 200.0, 300.0, 500.0)
    columns = []
    for kind in FogKind:
        columns.append([f"{high_beam_veil(one, kind):.3f}" for one in visibilities])
        columns.append([f"{one:.3f}" for one in veil_luminance(high_beam(), visibilities, kind)])
    heading = ("V_met [m]", *(f"{kind}, {what}" for kind in FogKind for what in ("eq. 9", "ours")))
    return (heading, *((f"{one:.0f}", *cells) for one, *cells in zip(visibilities, *columns, strict=True)))


def _limits() -> Rows:
    low = scaled_beam(low_beam(), THIRD)
    equal = [f"{equal_sight(low, kind, 0.1):.0f} m" for kind in FogKind]
    clear = [f"{clear_low_sight(low, kind):.0f} m" for kind in FogKind]
    return (
        ("", *(str(kind) for kind in FogKind), "paper"),
        ("eq. 11: high beams show as far as low beams in the same fog", *equal, "100 m"),
        ("eq. 12: high beams show as far as low beams in clear air", *clear, "300 m"),
    )
