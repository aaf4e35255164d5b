"""Fill the tables of docs/explanation/airlight.md: ``python docs/make_airlight_tables.py [RECORDS]``.

RECORDS is what ``fogsim reproduce airlight --json --out docs/pictures`` prints. Without it only the table of photon
counts between trees and under clouds is written, from the counts that ``benchmarks/monte_carlo.py surroundings`` wrote.
"""

import csv
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from page_tables import lines_of, write_table

PAGE = Path(__file__).parent / "explanation" / "airlight.md"
COUNTS = Path(__file__).parents[1] / "tests" / "data" / "monte_carlo_surroundings.csv"
SHOWN = "100"
"""V_met of the counts that are shown [m]."""

Record = dict[str, Any]


def by_elevation(records: list[Record], *, lands: bool) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Airlight by elevation for albedos, or for other conditions."""
    here = [one for one in records if "condition" in one and one["condition"].startswith("albedo") == lands]
    elevations = list(dict.fromkeys(one["elevation_deg"] for one in here))
    rows = []
    for name in dict.fromkeys(one["condition"] for one in here):
        found = {one["elevation_deg"]: one["airlight"] for one in here if one["condition"] == name}
        rows.append((name, *(f"{found[elevation]:.2f}" for elevation in elevations)))
    return ("", *(f"{elevation:g}°" for elevation in elevations)), rows


def surroundings() -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Airlight by elevation between trees and under clouds."""
    lines = COUNTS.read_text(encoding="utf-8").splitlines()
    counts = [row for row in csv.DictReader(line for line in lines if line[0] != "#") if row["visibility"] == SHOWN]
    headings = ("", *dict.fromkeys(f"{row['elevation']}°" for row in counts), "E")
    rows = []
    for name in dict.fromkeys(row["surroundings"] for row in counts):
        here = [row for row in counts if row["surroundings"] == name]
        rows.append((name, *(f"{float(row['airlight']):.2f}" for row in here), f"{float(here[0]['illuminance']):.2f}"))
    return headings, rows


def read(records: list[Record], height: float) -> Iterator[tuple[str, ...]]:
    """What each method reads, by fog."""
    here = [one for one in records if one.get("mount_height_m") == height]
    for method in dict.fromkeys(one["method"] for one in here):
        for albedo in dict.fromkeys(one["ground_albedo"] for one in here):
            fog = "Koschmieder" if albedo is None else f"ρ = {albedo:g}"
            cells = [one for one in here if (one["method"], one["ground_albedo"]) == (method, albedo)]
            yield (method, fog, *map(cell, cells))


def cell(record: Record) -> str:
    """What is read, over the truth."""
    if record["read_m"] is None:
        return "—"
    share = "" if record["told_share"] == 1.0 else f" ({100 * record['told_share']:.0f} %)"
    return f"{record['read_m']:.0f}, × {record['read_m'] / record['visibility_m']:.2f}{share}"


def main() -> None:
    """Write the tables."""
    if len(sys.argv) < 2:
        write_table(PAGE, "surroundings", lines_of(*surroundings()))
        return
    lines = Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()
    records = [json.loads(line) for line in lines]
    for marker, lands in (("lands", True), ("conditions", False)):
        write_table(PAGE, marker, lines_of(*by_elevation(records, lands=lands)))
    for marker, height in (("car", 1.3), ("lorry", 2.5)):
        visibilities = dict.fromkeys(one["visibility_m"] for one in records if "visibility_m" in one)
        headings = ("method", "fog", *(f"{visibility:.0f} m" for visibility in visibilities))
        write_table(PAGE, marker, lines_of(headings, read(records, height)))


if __name__ == "__main__":
    main()
