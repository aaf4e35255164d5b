"""How far daytime methods are off on roads like photographs, on which exact even fog is laid.

Photographs of clear air are drawn (`photograph_pictures.py`): asphalt that brightens towards the horizon by up to 2.5
times (CIE's standard surfaces: 1.35 to 2.1 at 1°), tyre tracks, joints, repairs, stains, sun and shade, verge and
woods, taken through a tone curve of gamma 1.8 to 2.6 with an s-curve on it, gains that differ by channel, noise and
JPEG of quality 60 to 95. Even fog is laid on them by the functions of `fogsim fog --road-plane` with the camera that
took them; methods get a pitch that is off by 0.1° (standard deviation) and a response of sRGB, as users do.
Constants are to be chosen on pool 0; pool 1, other roads and other cameras, is what is reported.

Errors are |V_est − V| / V of valid estimates in %; an infinite estimate is an error of 999 %. `bias` is the median of
ln(V_est / V) in %, `coverage` the share of 90 % intervals of k that hold the truth, `valid` the share of pictures with
an estimate.
"""

import math
import statistics
from collections.abc import Iterator

from harness import Row, lines_of, mean, median, parse_options, progress, publish, quantile
from photograph_pictures import photograph

from fogsim.estimators import make
from fogsim.units import extinction_from_visibility
from fogsim.values import Observation
from fogsim.values.estimate import NORMAL_90_PERCENT

VISIBILITIES = (60.0, 80.0, 100.0, 150.0, 200.0, 300.0, 500.0)
ENDLESS = 999.0  # error [%] of clear air that is seen where there is fog


def measure(pool: int, images: int, methods: list[str]) -> list[Row]:
    """An estimate a row."""
    rows = []
    for number in progress(range(images), "photographs"):
        taken = photograph(pool, number)
        for visibility, image in zip(VISIBILITIES, taken.fogged(VISIBILITIES), strict=True):
            truth = extinction_from_visibility(visibility)
            for method in methods:
                found = make(method, taken.told).update(Observation(image))
                row: Row = {"number": number, "method": method, "visibility_m": visibility, "valid": found.valid}
                row["light"] = "sun" if taken.is_sunny else "overcast"
                if found.valid:
                    off = math.log(truth / found.extinction) if found.extinction > 0 else math.inf
                    row["off"] = off
                    row["covered"] = abs(found.extinction - truth) <= NORMAL_90_PERCENT * found.standard_deviation
                rows.append(row)
    return rows


def records(rows: list[Row], pool: int) -> Iterator[Row]:
    """A record for each method and visibility, and for all to 300 m, also by the light of the photograph."""
    for method in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == method]
        cells = {f"{one:.0f}": [row for row in own if row["visibility_m"] == one] for one in VISIBILITIES}
        cells["60-300"] = [row for row in own if row["visibility_m"] <= 300.0]
        for light in ("overcast", "sun"):
            cells[f"60-300, {light}"] = [row for row in cells["60-300"] if row["light"] == light]
        for cell, some in cells.items():
            if not some:
                continue
            valid = [row for row in some if row["valid"]]
            record: Row = {"pool": pool, "method": method, "visibility_m": cell, "pictures": len(some)}
            record |= {"valid_share": len(valid) / len(some)}
            if valid:
                errors = [min(100.0 * abs(math.expm1(row["off"])), ENDLESS) for row in valid]
                record |= {"median_pct": median(errors), "p95_pct": quantile(errors, 0.95)}
                record["bias_pct"] = min(100.0 * statistics.median(row["off"] for row in valid), ENDLESS)
                record["coverage"] = mean([row["covered"] for row in valid])
            yield record


def docs_table(found: list[Row]) -> list[str]:
    """Lines of the table of docs/explanation/estimators.md, of one method."""
    rows = []
    for one in found:
        errors = (f"{one[key]:.1f}" if one[key] < 9.95 else f"{one[key]:.0f}" for key in ("median_pct", "p95_pct"))
        bias, place = f"{one['bias_pct']:.1f}".replace("-", "−"), one["visibility_m"].replace("-", "–")
        rows.append((place, "/".join(errors), bias, f"{one['coverage']:.2f}", f"{one['valid_share']:.2f}"))
    return lines_of(("V_met, m", "median/p95, %", "bias, %", "90 % intervals hold", "valid"), rows)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/estimators.md", "photographs"),
        pool=1,
        images=(60, "photographs"),
        methods=(["joint_road"], "names of estimators"),
    )
    found = list(records(measure(given.pool, given.images, given.methods), given.pool))
    publish(given, found, docs=docs_table)


if __name__ == "__main__":
    main()
