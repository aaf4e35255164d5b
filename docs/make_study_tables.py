"""Write the tables of studies into their pages: ``python docs/make_study_tables.py STUDY_FOLDER …``.

A folder is what ``fogsim study scenarios/studies/NAME.yaml`` has written, ``runs/NAME`` by default; its ``study.csv``
and ``comparison.csv`` are read. Each cell of a table has a mean and, in brackets, the interval of its difference to
the baseline; a star says that 0 is not in it and that the paired test has p ≤ 0.05.
"""

import argparse
import csv
import math
import shutil
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from page_tables import ROOT, lines_of, write_table

DOCS = ROOT / "docs"
PAGE = DOCS / "benchmarks" / "policies.md"
PAGES = {"lighting_policies": ROOT / "scenarios" / "rural_night_fog" / "README.md"}
"""Pages of studies whose tables are not in docs/benchmarks/policies.md."""

Cells = tuple[str, ...]

P_SHOWN = 0.05
"""Largest p of the paired permutation test with which a difference counts as shown, as in the report."""

Column = tuple[str, str, float, int]

SPEED: Column = ("traffic_mean_speed_mps", "mean speed [km/h]", 3.6, 1)
DEVIATION: Column = ("traffic_speed_standard_deviation_mps", "its sd [km/h]", 3.6, 1)
OVERDRIVEN: Column = ("traffic_overdriven_m_per_vehicle_km_in_fog", "overdriven in fog [m per vehicle-km]", 1.0, 0)
MARGIN: Column = ("traffic_sight_margin_by_distance_m", "sight margin in fog, by distance [m]", 1.0, 0)
CONFLICTS: Column = ("traffic_conflicts_per_cohort_vehicle", "conflicts per 100 vehicles", 100.0, 1)
COLLISIONS: Column = ("traffic_collisions_per_cohort_vehicle", "collisions per 100 vehicles", 100.0, 1)
DELAY: Column = ("traffic_delay_s_per_cohort_vehicle", "delay [s per vehicle]", 1.0, 0)
SIGNS = (SPEED, DELAY, OVERDRIVEN, MARGIN, CONFLICTS, COLLISIONS)
EGO: Column = ("overdriven_m_per_km_in_fog", "overdriven by the ego [m per km in fog]", 1.0, 0)
CLOSEST: Column = ("minimum_time_to_collision_s", "least time to collision of the ego [s]", 1.0, 1)
ADVISED: Column = ("advised_time_share", "advised [% of time]", 100.0, 0)
HIGH_BEAMS: Column = ("high_beam_time_share", "high beams [% of time]", 100.0, 0)
BANK_KNOWN: Column = ("dense_fog_known_before_m", "bank known before it [m]", 1.0, 0)
ADVICE: Sequence[Column] = (
    ("belief_median_error_percent", "error of the belief [%]", 1.0, 1),
    ("mean_advised_speed_mps", "speed advised [km/h]", 3.6, 1),
    ADVISED,
)
DRIVING: Sequence[Column] = (EGO, OVERDRIVEN, ("collisions", "collisions a run", 1.0, 2))

COLUMNS: Mapping[str, Sequence[Column]] = {
    "message_sign": SIGNS,
    "motorway_policies": (OVERDRIVEN, CONFLICTS, DELAY),
    "highway_99": (
        ("traffic_collisions", "collisions a run", 1.0, 2),
        ("ego_collisions", "of the ego", 1.0, 2),
        ("traffic_conflicts_per_vehicle_h", "conflicts per vehicle-hour", 1.0, 1),
        OVERDRIVEN,
        EGO,
        CLOSEST,
    ),
    "estimators_in_the_loop": (*ADVICE, *DRIVING),
    "night_estimators_in_the_loop": (*ADVICE, HIGH_BEAMS, *DRIVING),
    "who_tells_of_the_bank": (
        ("equipped_vehicles_mean", "other cameras near", 1.0, 1),
        BANK_KNOWN,
        ("belief_200_m_ahead_median_error_percent", "belief 200 m ahead: error [%]", 1.0, 0),
        ("belief_200_m_ahead_coverage_share", "held [%]", 100.0, 0),
        EGO,
        OVERDRIVEN,
        CLOSEST,
    ),
    "which_sensor": (
        BANK_KNOWN,
        ADVISED,
        ("mean_speed_mps", "speed of the ego [km/h]", 3.6, 0),
        EGO,
        CLOSEST,
        ("ego_collisions", "collisions of the ego a run", 1.0, 2),
    ),
    "lighting_policies": (
        ("mean_own_sight_m", "own sight [m]", 1.0, 1),
        HIGH_BEAMS,
        ("glare_dealt_time_share", "glare dealt [% of time]", 100.0, 1),
        ("glare_dealt_s", "glare dealt [driver-s]", 1.0, 1),
        ("max_glare_dealt_cdpm2", "largest veil dealt [cd/m²]", 1.0, 2),
        ("ego_collisions", "hits the dark car [% of runs]", 100.0, 0),
        ("ego_max_impact_speed_mps", "impact [km/h]", 3.6, 0),
    ),
    "field_sizes": (SPEED, DEVIATION, OVERDRIVEN, MARGIN, ("traffic_collisions", "collisions a run", 1.0, 2)),
}
"""Of each study: metrics, what the column is called, the factor to its unit, and digits after the point."""

SPREAD: Mapping[str, str] = {"motorway_policies": "visibility"}
"""Studies with a table for each metric, and the factor whose levels are its columns."""

FIGURES: Mapping[str, Sequence[str]] = {
    "message_sign": ("trade_off_traffic_conflicts_per_cohort_vehicle", "speed_over_road")
}
"""Figures of a study's report that the page shows."""


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def table(folder: Path, columns: Sequence[Column]) -> list[Cells]:
    """Heading and rows of a study's table: a row a cell of its grid."""
    runs, compared = read(folder / "study.csv"), read(folder / "comparison.csv")
    factors = list(runs[0])[1 : list(runs[0]).index("seed")]
    cells = dict.fromkeys(tuple(run[name] for name in factors) for run in runs)
    differences = {(*(row[name] for name in factors), row["metric"]): row for row in compared}
    rows = []
    for cell in cells:
        inside = [run for run in runs if tuple(run[name] for name in factors) == cell and run["status"] == "complete"]
        rows.append((*cell, *(_cell(inside, differences.get((*cell, c[0])), c) for c in columns)))
    return [(*factors, *(name for _, name, _, _ in columns)), *rows]


def spread(rows: Sequence[Cells], factor: str, factors: int) -> list[Cells]:
    """A table of one metric with a column for each level of a factor (`factors`: how many columns are factors)."""
    heading, *cells = rows
    at = heading.index(factor)
    levels = list(dict.fromkeys(cell[at] for cell in cells))
    found: dict[Cells, dict[str, str]] = {}
    for cell in cells:
        others = (*cell[:at], *cell[at + 1 : factors])
        found.setdefault(others, {})[cell[at]] = cell[factors]
    names = (*heading[:at], *heading[at + 1 : factors])
    return [(*names, *levels), *((*others, *(one[level] for level in levels)) for others, one in found.items())]


def _cell(runs: Sequence[Mapping[str, str]], difference: Mapping[str, str] | None, column: Column) -> str:
    metric, _, factor, digits = column
    values = [factor * float(run[metric]) for run in runs if run.get(metric)]
    if not values:
        return "–"
    told = f"{statistics.fmean(values):.{digits}f}"
    if difference is None or not difference["low"]:
        return told
    low, high = (factor * float(difference[end]) for end in ("low", "high"))
    star = "*" if (low > 0 or high < 0) and float(difference["p_value"] or 1.0) <= P_SHOWN else ""
    return f"{told} [{low:+.{digits}f}, {high:+.{digits}f}]{star}"


def charts(folder: Path, columns: Sequence[Column]) -> None:
    """Draw the metrics of every policy by visibility, by day and by night."""
    runs = read(folder / "study.csv")
    levels = {name: list(dict.fromkeys(run[name] for run in runs)) for name in ("policy", "visibility", "light")}
    figure = Figure(figsize=(8.0, 2.6 * len(columns)), layout="constrained")
    axes = figure.subplots(len(columns), 2, sharex=True, sharey="row")
    for row, (metric, name, factor, _) in zip(axes, columns, strict=True):
        for axis, light in zip(row, levels["light"], strict=True):
            for number, policy in enumerate(levels["policy"]):
                places = [i + 0.08 * (number - 3.5) for i in range(len(levels["visibility"]))]
                means, errors = zip(
                    *(_mean(runs, metric, factor, policy, v, light) for v in levels["visibility"]), strict=True
                )
                axis.errorbar(places, means, errors, fmt="o", ms=3.5, lw=1.0, color=f"C{number}", label=policy)
            axis.set_xticks(range(len(levels["visibility"])), levels["visibility"])
            axis.set_title(f"{name[0].upper()}{name[1:]}, by {light}", fontsize=8.5)
            axis.set_ylim(bottom=0.0)
            axis.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    with mpl.rc_context({"svg.hashsalt": folder.name}):
        figure.savefig(DOCS / "pictures" / f"{folder.name}.svg", metadata={"Date": None})


def _mean(runs: Sequence[Mapping[str, str]], metric: str, factor: float, *cell: str) -> tuple[float, float]:
    """Mean over the seeds of a cell, and half its 95 % interval."""
    inside = [factor * float(run[metric]) for run in runs if (run["policy"], run["visibility"], run["light"]) == cell]
    half = 1.96 * statistics.stdev(inside) / math.sqrt(len(inside)) if len(inside) > 1 else 0.0
    return statistics.fmean(inside), half


def main() -> None:
    """Write the tables and copy the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="STUDY_FOLDER", help=", ".join(COLUMNS))
    for folder in parser.parse_args().folders:
        if folder.name not in COLUMNS:
            parser.error(f"no study of the docs is called {folder.name!r}; there are {', '.join(COLUMNS)}")
        page = PAGES.get(folder.name, PAGE)
        if folder.name not in SPREAD:
            heading, *rows = table(folder, COLUMNS[folder.name])
            write_table(page, folder.name, lines_of(heading, rows))
        for column in COLUMNS[folder.name] if folder.name in SPREAD else ():
            one = table(folder, (column,))
            heading, *rows = spread(one, SPREAD[folder.name], len(one[0]) - 1)
            write_table(page, f"{folder.name}: {column[1]}", lines_of(heading, rows))
        if folder.name in SPREAD:
            charts(folder, COLUMNS[folder.name])
        for name in FIGURES.get(folder.name, ()):
            shutil.copy(folder / "figures" / f"{name}.svg", DOCS / "pictures" / f"{folder.name}_{name}.svg")


if __name__ == "__main__":
    main()
