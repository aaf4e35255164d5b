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

import argparse
import json
import sys
from pathlib import Path

from docs_table import write_table
from rich.console import Console
from rich.progress import track
from target_pictures import KINDS, Row, measure_unit
from target_tables import records, table

Unit = tuple[str, int]
"""Kind of a drawing, and its number."""


def measure(images: int, seed: int, keep: Path | None) -> list[Row]:
    """Rows of all drawings: what is kept already, and the rest."""
    known = kept(keep, seed)
    units = [(kind, number) for kind in KINDS for number in range(images)]
    missing = [unit for unit in units if unit not in known]
    for unit in track(missing, "drawings", console=Console(stderr=True)):
        known[unit] = measure_unit(*unit, seed)
        if keep:
            with keep.open("a", encoding="utf-8") as file:
                file.write(json.dumps([unit, known[unit]]) + "\n")
    return [row for unit in units for row in known[unit]]


def kept(path: Path | None, seed: int) -> dict[Unit, list[Row]]:
    """What an earlier call with the same seed has measured; begins the file if there is none."""
    if path is None:
        return {}
    if not path.exists():
        path.write_text(json.dumps({"seed": seed}) + "\n", encoding="utf-8")
    # What an interrupted call has written in part does not count.
    whole = path.read_text(encoding="utf-8").rpartition("\n")[0] + "\n"
    path.write_text(whole, encoding="utf-8")
    first, *lines = whole.splitlines()
    if json.loads(first) != {"seed": seed}:
        sys.exit(f"--keep {path}: it was measured with another seed: {first}")
    return {(kind, number): rows for (kind, number), rows in map(json.loads, lines)}


def some(text: str) -> int:
    """A whole number of at least 1."""
    if (number := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"at least 1 is needed, got {text}")
    return number


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/benchmarks/estimators.md")
    parser.add_argument("--images", type=some, default=24, help="drawings of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="file in which to keep what is measured, and from which to go on")
    arguments = parser.parse_args()
    rows = measure(arguments.images, arguments.seed, arguments.keep)
    found = list(records(rows, ["--images", str(arguments.images), "--seed", str(arguments.seed)]))
    if arguments.docs:
        write_table("benchmarks/estimators.md", "targets", [table(found)])
    print(json.dumps(found, indent=2) if arguments.json else table(found))


if __name__ == "__main__":
    main()
