"""Every target of the daytime estimators, and how far it is met, on pictures that FogSim's renderer did not make.

A flat road of blocky texture (3 % albedo patches) with lane marks is drawn for one of four cameras (320×240 to 800×400,
focal lengths of 288 to 1400 px, linear, gamma and sRGB) whose stated pitch is off by a normal error of 0.1°, at
an airlight of 120, 200 or 255 levels; so is the same road with albedo that drifts by ±15 % within 40 m, with a vehicle
at 25 m, dark or bright, and with a verge. Each drawing is fogged with visibilities from 30 to 1000 m. Behind a
windscreen another renderer draws scenes at random (bends, yaw, woods, vehicles, bonnet, wiper, compression, up to 6 %
of texture) and a plain scene with one thing in the way: more than the targets speak of, held against those of the road
fit.

Errors are |V_est − V| / V of valid estimates in %, or rows of the horizon in pixels where two lines are found; `valid`
is the share of estimates that count, `coverage` the share of their 90 % intervals that hold the truth, of k or of the
row. The worst group is that of a cell's cameras, airlights, visibilities, paints or changes with the largest 95th
percentile. Several fogs are laid on one drawing: a cell of 120 images at `--images 24` has 24 drawings.

    python benchmarks/estimator_targets.py [--json] [--docs] [--images 24] [--seed 0] [--keep FILE]

`--keep FILE` writes what is measured to a file as it comes; a later call with the same seed goes on from there, also
with more images.
"""

from pathlib import Path

from harness import Kept, Row, parse_options, progress, publish
from target_pictures import KINDS, measure_unit
from target_tables import records, table


def measure(images: int, seed: int, keep: Path | None) -> list[Row]:
    """Rows of all drawings: what is kept already, and the rest."""
    kept, units = Kept(keep, {"seed": seed}), [(kind, number) for kind in KINDS for number in range(images)]
    for unit in progress([unit for unit in units if unit not in kept.results], "drawings"):
        kept.add(unit, measure_unit(*unit, seed))
    return [row for unit in units for row in kept.results[unit]]


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/estimators.md", "targets"),
        images=(24, "drawings of each kind"),
        seed=(0, "of the drawings"),
        keep=(Path, "file in which to keep what is measured, and from which to go on"),
    )
    if given.images < 1:
        given.error(f"--images: at least 1 is needed, got {given.images}")
    rows = measure(given.images, given.seed, given.keep)
    found = list(records(rows, ["--images", str(given.images), "--seed", str(given.seed)]))
    publish(given, found, table)


if __name__ == "__main__":
    main()
