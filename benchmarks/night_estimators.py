"""Accuracy of the estimators of the night that go by the own head lamps, on a road without other lamps.

`--part drawn`: FogSim's own images of a straight road with marks, signs and trees, at visibilities from 15 to 500 m,
even in ln V, and a fifth in clear air, at exposures of 0.6 to 1.6 of the automatic one, with noise; in each variant
one thing is not as usual. `--part photons`: images by photons (`photon_nights.py`) of other lamps, droplets,
pavements, pitches, aims and cameras than the model's, with light scattered more than once, by night and at dusk, and
with the beam's pattern known or not. All are 640×480 pixels. Errors are |V_est − V| / V of valid estimates of fog;
`bounded` answers have a bound in place of a value; `holds`: share of 90 % intervals and bounds that hold the truth;
`lower`, `upper`: medians of their ends. Constants were chosen on `--pool 0`; what is reported is of `--pool 1`, where
one beam is not among those of pool 0.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from harness import Row, lines_of, parse_options, progress, publish, timed
from photon_nights import SETBACK as PHOTON_SETBACK
from photon_nights import Night, beam_named, drawn_nights

from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.calibration.lit_fog import lit_fog
from fogsim.calibration.staged_night import DARK, SETBACK, NightRoad, NightScene
from fogsim.estimators import make
from fogsim.estimators.night.own_light import OwnLight
from fogsim.lighting import LampMount
from fogsim.values import Camera, Estimate, Lamp, Observation
from fogsim.values.camera import Response
from fogsim.values.observation import LightMeasurement

TOLD = Camera(640, 480, 577.3, (319.5, 239.5), 1.38, pitch=0.035, response=Response.SRGB)
METHODS: dict[str, tuple[str, dict[str, bool]]] = {
    "night_road": ("night_road", {}),
    "gallen2014_veil, published": ("gallen2014_veil", {"as_published": True}),
}
CLEAR_SHARE = 0.2
VISIBILITIES = (40.0, 80.0, 150.0, 300.0, np.inf)
LUX = (0.0, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0)
TOGETHER = (((0.0, 0.0), (40.0, 300.0)), ((0.1, 100.0), (40.0, 150.0)))
"""Light and visibilities of images that are also counted together."""

COLUMNS = {"images": "images", "valid": "valid", "bounded": "bounded", "median_pct": "median error [%]"}
COLUMNS |= {"p95_pct": "p95 [%]", "holds": "holds", "lower": "lower [m]", "upper": "upper [m]"}


@dataclass(frozen=True)
class Variant:
    """What is not as usual."""

    pavement: float = 1.0
    droplets: Droplets = Droplets.MODERATE_RADIATION
    pitch: float = 0.0
    black_level: float = 0.0


VARIANTS = {
    "usual": Variant(),
    "black level of 4 %": Variant(black_level=0.04),
    "pavement × 1.5": Variant(pavement=1.5),
    "heavy radiation": Variant(droplets=Droplets.HEAVY_RADIATION),
    "heavy advection": Variant(droplets=Droplets.HEAVY_ADVECTION),
    "pitch ± 0.1°": Variant(pitch=np.radians(0.1)),
}


def looks(variant: Variant, pool: int, count: int) -> Iterator[tuple[float, Camera, Observation]]:
    """True visibility, assumed camera and observation."""
    rng = np.random.default_rng((pool, 19))
    assumed = replace(TOLD, black_level=variant.black_level)
    for _ in range(count):
        visibility = float(np.exp(rng.uniform(np.log(15.0), np.log(500.0))))
        clear, place, exposure = rng.random() < CLEAR_SHARE, rng.uniform(0.0, 400.0), np.exp(rng.uniform(-0.5, 0.5))
        visibility = np.inf if clear else visibility
        camera = replace(assumed, pitch=assumed.pitch + variant.pitch * rng.standard_normal())
        with NightRoad(camera, variant.droplets, seed=int(rng.integers(1000))) as road:
            (radiance,) = road.radiances(NightScene(place, pavement=variant.pavement), [visibility])
            image = road.photograph(radiance, float(exposure), rng)
        light = LightMeasurement(DARK)
        yield visibility, assumed, Observation(image, lamps=Lamp.LOW_BEAM, camera_setback=SETBACK, light=light)


@functools.cache
def light_of(camera: Camera, beam: str | None) -> OwnLight:
    """What a camera sees of a beam, or of any low beam."""
    if beam is None:
        return lit_fog(camera, Lamp.LOW_BEAM, PHOTON_SETBACK, known=False)
    mount = LampMount(behind_bumper=0.0, beams={Lamp.LOW_BEAM: beam_named(beam)})
    return lit_fog(camera, Lamp.LOW_BEAM, PHOTON_SETBACK, mount=mount)


class _Lamps:
    """Calibrations of a night's lamps."""

    def __init__(self, night: Night, known: bool) -> None:
        self._night, self._known = night, known

    def own_light(self, *_: object) -> OwnLight:
        """What the camera sees of the beam."""
        return light_of(self._night.camera, self._night.beam if self._known else None)


def estimate_of(night: Night, known: bool) -> Estimate:
    """What night_road makes of an image by photons."""
    estimator: Any = make("night_road", night.camera, head_lamps="usual" if known else "unknown")
    estimator.take_calibrations(_Lamps(night, known))
    light = LightMeasurement(night.illuminance)
    seen = Observation(night.image, lamps=Lamp.LOW_BEAM, camera_setback=PHOTON_SETBACK, light=light)
    found: Estimate = estimator.update(seen)
    return found


def record(label: dict[str, Any], found: list[tuple[float, Estimate]]) -> dict[str, Any]:
    """Errors of estimates, each with the true visibility."""
    valid = [(v, one) for v, one in found if one.valid]
    answers = [(v, one.visibility_interval) for v, one in found if one.valid or one.bounds is not None]
    error = np.array([abs(one.visibility - v) / v for v, one in valid if np.isfinite(v)])

    def rounded(values: Any, kind: Any, digits: int = 0) -> float | None:
        if len(values) == 0:
            return None
        found = float(kind(values))
        return round(found, digits) if np.isfinite(found) else found

    return label | {
        "images": len(found),
        "valid": len(valid),
        "bounded": len(answers) - len(valid),
        "median_pct": rounded(100 * error, np.median),
        "p95_pct": rounded(100 * error, lambda all_of_it: np.quantile(all_of_it, 0.95)),
        "holds": rounded([low <= min(v, 1e5) <= high for v, (low, high) in answers], np.mean, 2),
        "lower": rounded([low for _, (low, _) in answers], np.median),
        "upper": rounded([high for _, (_, high) in answers], np.median),
    }


def drawn_records(pool: int, count: int) -> list[dict[str, Any]]:
    """Errors in FogSim's own images, in fog and in clear air apart."""
    records = []
    for label, variant in progress(VARIANTS.items(), "drawn"):
        seen = list(looks(variant, pool, count))
        for name, (method, options) in METHODS.items():
            found = [(v, make(method, assumed, **options).update(one)) for v, assumed, one in seen]
            for air, chosen in (("fog", np.isfinite), ("clear", np.isinf)):
                labels = {"method": name, "not as usual": label, "air": air}
                records.append(record(labels, [(v, one) for v, one in found if chosen(v)]))
    return records


def photon_records(pool: int, count: int) -> list[dict[str, Any]]:
    """Errors in images by photons."""
    nights = list(drawn_nights(pool, count, VISIBILITIES, LUX))
    found = {known: [(one, estimate_of(one, known)) for one in nights] for known in (True, False)}
    cells = [((lux, lux), (visibility, visibility)) for lux in LUX for visibility in VISIBILITIES]
    records = []
    for known, (lux, fog) in ((known, cell) for known in found for cell in (*TOGETHER, *cells)):
        labels = {"beam": "known" if known else "unknown", "light [lx]": _span(*lux), "V_met [m]": _span(*fog)}
        chosen = [
            (one.visibility, estimate)
            for one, estimate in found[known]
            if lux[0] <= one.illuminance <= lux[1] and fog[0] <= one.visibility <= fog[1]
        ]
        records.append(record(labels, chosen))
    return records


def _span(first: float, last: float) -> str:
    return f"{first:g}" if first == last else f"{first:g} … {last:g}"


def milliseconds() -> dict[str, float]:
    """Median time of an image of 640×480 pixels by night and at dusk [ms]."""
    with NightRoad(TOLD) as road:
        (radiance,) = road.radiances(NightScene(), [80.0])
        image = road.photograph(radiance, 1.0, np.random.default_rng(0))
    spent = {}
    for name, lux in (("night", DARK), ("dusk", 1.0)):
        seen = Observation(image, lamps=Lamp.LOW_BEAM, camera_setback=SETBACK, light=LightMeasurement(lux))
        update = functools.partial(make("night_road", TOLD).update, seen)
        times = [timed(update)[1] for _ in range(21)]
        spent[name] = round(float(np.median(times[1:])), 1)
    return spent


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/night.md", "night-estimators"),
        pool=1,
        images=(40, "of each variant; 0.4 times that by photons"),
        part=("all", "which images", ("all", "drawn", "photons")),
    )
    drawn = [] if given.part == "photons" else drawn_records(given.pool, given.images)
    photons = [] if given.part == "drawn" else photon_records(given.pool, round(0.4 * given.images))
    times = milliseconds()
    publish(given, [*photons, *drawn, {"ms_640x480": times}], lambda _: tables(photons, drawn, times))


def tables(photons: list[Row], drawn: list[Row], times: dict[str, float]) -> list[str]:
    """Lines of the tables of docs/explanation/night.md."""
    parts: list[str] = []
    for records, heads in ((photons, ("beam", "light [lx]", "V_met [m]")), (drawn, ("method", "not as usual", "air"))):
        keys = [*heads, *COLUMNS]
        rows = [["–" if one[key] is None else f"{one[key]}" for key in keys] for one in records]
        parts += [*lines_of([*heads, *COLUMNS.values()], rows), ""]
    return [*parts, f"An image of 640×480 pixels takes {times['night']} ms by night and {times['dusk']} ms at dusk."]


if __name__ == "__main__":
    main()
