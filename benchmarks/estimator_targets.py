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

`--keep FILE` writes what is measured to a file as it comes; a later call with the same seed goes on from there, also
with more images.
"""

import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from harness import Kept, Row, lines_of, mean, parse_options, progress, publish, quantile
from target_pictures import KINDS, measure_unit

FEWEST = 3
"""Fewest estimates that make a group eligible as the worst."""


@dataclass(frozen=True, slots=True)
class Target:
    """What is asked for: errors at most, or a share of right answers at least."""

    text: str
    unit: str = "%"
    median: float | None = None
    p95: float | None = None
    right_share: float | None = None


TARGETS = {
    "road to 300": Target("joint road fit, single frame, horizon sd 0.1°, 30–300 m", "%", 3.0, 8.0),
    "road to 1000": Target("joint road fit, single frame, horizon sd 0.1°, to 1000 m", "%", 5.0, 12.0),
    "drift": Target("same with ±15 % albedo drift", "%", 10.0, 20.0),
    "lead": Target("same with a vehicle at 25 m, to 400 m", "%", 5.0, 15.0),
    "horizon": Target("vanishing-point horizon, where two lines are found", "px", 0.3, 2.0),
    "classes": Target("four classes, more than 5 % off an edge", "right", right_share=0.95),
}
ELSEWHERE = (
    (Target("four classes, more than 5 % off an edge", "right", right_share=0.95), "in traffic, four cameras",
     "python benchmarks/estimator_accuracy.py"),
    (Target("tracked vehicle, 25 → 90 m", "%", 2.0, 5.0), "V 50–300 m", "python benchmarks/lead_accuracy.py"),
    (Target("tracked vehicle, 25 → 90 m", "%", 4.0, 10.0), "V 500 m", "python benchmarks/lead_accuracy.py"),
    (Target("signs, photometric", "%", 5.0, 10.0), "V 100–300 m", "no such estimator in this version"),
)  # fmt: skip
"""Targets that other commands measure, or none yet."""


def is_met(one: Row) -> bool:
    """Whether what a record says is as good as its target asks for; of nothing found nothing is met."""
    if one["target_right_share"] is not None:
        return one["right_share"] is not None and one["right_share"] >= one["target_right_share"]
    found = (one["median"], one["target_median"]), (one["p95"], one["target_p95"])
    return all(value is not None and value <= target for value, target in found)


def worst(rows: list[Row], as_share: bool) -> str | None:
    """The group of rows, by anything in which they differ, that is furthest off, and how far."""
    groups: dict[str, list[float]] = {}
    for row in rows:
        for name, value in row["within"].items() if row["valid"] else ():
            groups.setdefault(f"{name} {value}", []).append(row["error"])
    # A group that is the whole cell says nothing of where it is weak.
    whole = sum(row["valid"] for row in rows)
    known = {name: errors for name, errors in groups.items() if FEWEST <= len(errors) < whole}
    if not known:
        return None
    name = max(known, key=lambda one: np.mean(known[one]) if as_share else np.percentile(known[one], 95))
    errors = known[name]
    figures = f"{1 - np.mean(errors):.2f}" if as_share else f"{quantile(errors, 0.5, 2)} / {quantile(errors, 0.95, 2)}"
    return f"{name}: {figures} (n = {len(errors)})"


def blank(target: Target, cell: str, command: str) -> Row:
    """Flat record in which nothing is measured."""
    return {
        "target": target.text,
        "cell": cell,
        "images": None,
        "valid_share": None,
        "unit": target.unit,
        "median": None,
        "p95": None,
        "right_share": None,
        "target_median": target.median,
        "target_p95": target.p95,
        "target_right_share": target.right_share,
        "met": None,
        "coverage": None,
        "worst_cell": None,
        "command": command,
    }


def record(target: Target, cell: str, rows: list[Row], command: str) -> Row:
    """Flat record of the rows of a cell."""
    errors = [row["error"] for row in rows if row["valid"]]
    as_share = target.right_share is not None
    found = blank(target, cell, command) | {
        "images": len(rows),
        "valid_share": mean([row["valid"] for row in rows], 3),
        "median": None if as_share else quantile(errors, 0.5, 2),
        "p95": None if as_share else quantile(errors, 0.95, 2),
        "right_share": mean([error == 0.0 for error in errors], 3) if as_share else None,
        "coverage": mean([row["covered"] for row in rows if row["covered"] is not None], 3),
        "worst_cell": worst(rows, as_share),
    }
    return found | {"met": is_met(found)}


def records(rows: list[Row], arguments: list[str]) -> Iterator[Row]:
    """Every cell of every target, and what is measured elsewhere."""
    command = shlex.join(["python", "benchmarks/estimator_targets.py", *arguments])
    for name, target in TARGETS.items():
        own = [row for row in rows if row["target"] == name]
        for cell in dict.fromkeys(row["cell"] for row in own):
            yield record(target, cell, [row for row in own if row["cell"] == cell], command)
    for target, cell, elsewhere in ELSEWHERE:
        yield blank(target, cell, elsewhere)


def written(one: Row) -> tuple[str, ...]:
    """One row of the table."""
    if one["target_right_share"] is not None:
        asked, found = f"≥ {one['target_right_share']:g} {one['unit']}", str(one["right_share"])
    else:
        asked = f"≤ {one['target_median']:g} / {one['target_p95']:g} {one['unit']}"
        found = f"{one['median']} / {one['p95']}" if one["median"] is not None else "–"
    head = (one["target"], one["cell"], asked)
    if one["met"] is None:
        where = f"`{one['command']}`" if one["command"].startswith("python") else one["command"]
        return (*head, where, *[""] * 5)
    tail = (one["images"], one["valid_share"], one["coverage"], one["worst_cell"])
    return (*head, found, "yes" if one["met"] else "**no**", *("–" if value is None else str(value) for value in tail))


def table(all_records: list[Row]) -> list[str]:
    """Records as the table that is printed and that the docs hold."""
    heads = ("target", "cell", "asked", "median / p95", "met", "images", "valid", "coverage", "worst group")
    return lines_of(heads, map(written, all_records))


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
