"""Accuracy of the estimators of the night that go by the own head lamps, on a road without other lamps.

Pictures of a straight road with marks, signs and trees, 640×480 pixels, at visibilities drawn from 15 to 500 m evenly
in ln V and a fifth in clear air, at exposures of 0.6 to 1.6 of the automatic one, with noise. In each variant one thing
is not as the methods take it to be: the pavement returns half as much again, the droplets are others, the pitch is off
by 0.1° (one standard deviation). Errors are |V_est − V| / V of valid estimates of fog; `bands` is the share within the
errors that gallen2014 reports (10 m below 50 m, 20 below 100, 40 below 200, 100 above), `coverage` that of 90 %
intervals that hold the truth, `clear` that of clear nights that are estimated as clear, or with more than 300 m.
Constants were chosen on `--pool 0`; what is reported is of `--pool 1`.

    python benchmarks/night_estimators.py [--json] [--docs] [--pool 1] [--pictures 40]
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from docs_table import lines_of, write_table

from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.calibration.staged_night import SETBACK, NightRoad, NightScene
from fogsim.estimators import make
from fogsim.estimators.night.gallen2014_veil import BANDS
from fogsim.values import Camera, Estimate, Lamp, Observation
from fogsim.values.camera import Response

TOLD = Camera(640, 480, 577.3, (319.5, 239.5), 1.38, pitch=0.035, response=Response.SRGB)
METHODS: dict[str, tuple[str, dict[str, bool]]] = {
    "night_road": ("night_road", {}),
    "gallen2014_veil": ("gallen2014_veil", {}),
    "gallen2014_veil, published": ("gallen2014_veil", {"as_published": True}),
}
CLEAR_SHARE = 0.2


@dataclass(frozen=True)
class Variant:
    """What is not as the methods take it to be."""

    pavement: float = 1.0
    droplets: Droplets = Droplets.MODERATE_RADIATION
    pitch: float = 0.0
    black_level: float = 0.0


VARIANTS = {
    "matched": Variant(),
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
            picture = road.photograph(radiance, float(exposure), rng)
        yield visibility, assumed, Observation(picture, lamps=Lamp.LOW_BEAM, camera_setback=SETBACK)


def estimates(name: str, assumed: Camera, seen: Observation) -> Estimate:
    """What a method says of one picture alone."""
    method, options = METHODS[name]
    return make(method, assumed, **options).update(seen)


def record(name: str, variant: str, found: list[tuple[float, Estimate]]) -> dict[str, Any]:
    """Errors of a method in a variant."""
    foggy = [(v, one) for v, one in found if np.isfinite(v)]
    valid = [(v, one) for v, one in foggy if one.valid]
    error = np.array([abs(min(one.visibility, 1e5) - v) / v for v, one in valid])
    within = [abs(one.visibility - v) < next(most for below, most in BANDS if v < below) for v, one in valid]
    held = [one.visibility_interval[0] <= v <= one.visibility_interval[1] for v, one in valid]
    clear = [one.visibility > 300.0 for v, one in found if np.isinf(v) and one.valid]

    def share(values: list[Any]) -> float | None:
        return round(float(np.mean(values)), 3) if values else None

    return {
        "method": name,
        "variant": variant,
        "pictures": len(found),
        "valid": share([one.valid for _, one in foggy]),
        "median_pct": round(100 * float(np.median(error)), 1) if len(error) else None,
        "p95_pct": round(100 * float(np.quantile(error, 0.95)), 1) if len(error) else None,
        "bands": share(within),
        "coverage": share(held),
        "clear": share(clear),
    }


def milliseconds() -> dict[str, float]:
    """Time of a picture of 1280×800 pixels, least of many [ms]."""
    camera = replace(TOLD, width=1280, height=800, focal_length=1154.0, principal_point=(639.5, 399.5))
    with NightRoad(camera) as road:
        (radiance,) = road.radiances(NightScene(), [80.0])
        picture = road.photograph(radiance, 1.0, np.random.default_rng(0))
    seen, spent = Observation(picture, lamps=Lamp.LOW_BEAM, camera_setback=SETBACK), {}
    for name in ("night_road", "gallen2014_veil"):
        estimator = make(name, camera)
        estimator.update(seen)
        times = []
        for _ in range(20):
            started = time.perf_counter()
            estimator.update(seen)
            times.append(time.perf_counter() - started)
        spent[name] = round(1e3 * min(times), 1)
    return spent


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print records as JSON")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/explanation/night.md")
    parser.add_argument("--pool", type=int, default=1)
    parser.add_argument("--pictures", type=int, default=40, help="of each variant")
    asked = parser.parse_args()
    records = []
    for label, variant in VARIANTS.items():
        seen = list(looks(variant, asked.pool, asked.pictures))
        for name in METHODS:
            records.append(record(name, label, [(v, estimates(name, assumed, one)) for v, assumed, one in seen]))
            if not asked.json:
                print(*records[-1].values(), flush=True)
    times = milliseconds()
    if asked.json:
        print(json.dumps([*records, {"ms_1280x800": times}], indent=2))
    if asked.docs:
        write_docs(records, times)


def write_docs(records: list[dict[str, Any]], times: dict[str, float]) -> None:
    """Write the table of docs/explanation/night.md."""
    columns = {"method": "method", "variant": "not as taken", "median_pct": "median error [%]", "p95_pct": "p95 [%]"}
    columns |= {"bands": "in bands", "coverage": "coverage", "clear": "clear is clear", "valid": "valid"}
    rows = [["–" if one[key] is None else str(one[key]) for key in columns] for one in records]
    cost = f"A picture of 1280×800 pixels takes {times['night_road']} and {times['gallen2014_veil']} ms."
    write_table("explanation/night.md", "night-estimators", [*lines_of([*columns.values()], rows), "", cost])


if __name__ == "__main__":
    main()
