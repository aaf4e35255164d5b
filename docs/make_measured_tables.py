"""Write those tables of the docs that are measured: ``python docs/make_measured_tables.py [--check] [NAME …]``.

Without names it writes all of them (minutes, for zhu2015 and drivers). ``--check`` writes nothing and lists those that
are out of date; the last digit may differ by one, as rounding on another processor may.
"""

import argparse
import functools
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from page_tables import ROOT, block, filled, lines_of, same, write_table

sys.path.insert(0, str(ROOT / "benchmarks"))

import night_deviations

if TYPE_CHECKING:
    from fogsim.reproduce import Reproduction

Rows = list[tuple[str, ...]]

EXCERPT = {
    "joint_road": "joint_road",
    "negru2013": "negru2013, corrected",
    "negru2013, as published": "negru2013, as published",
}
"""Methods of the excerpt, by what the page on estimators calls them."""


def excerpt() -> Rows:
    """Errors of some methods before a vehicle of unmeasured range, as the page on accuracy has them, to two digits."""
    page = (ROOT / "docs" / "benchmarks" / "estimators.md").read_text(encoding="utf-8")
    table = page.split("<!-- table: accuracy -->", 1)[1].split("\n\n")[2].splitlines()
    heading, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    found = {row[0]: row[2:] for row in rows if row[1] == "unmeasured"}
    ranges = [cell.partition(" ")[0].replace("-", "–") for cell in heading[2:]]
    return [
        ("V_met [m]", *ranges),
        *(
            (name, *(" / ".join(map(_short, cell.split(" / "))) for cell in found[form]))
            for form, name in EXCERPT.items()
        ),
    ]


def _short(number: str) -> str:
    return f"{float(number):.1f}" if float(number) < 9.95 else f"{float(number):.0f}"


PAPERS = ("negru2013", "zhu2015", "huang2015", "belaroussi2015", "gallen2014")
"""Papers whose published figures are compared cell by cell."""


@functools.cache
def reproduced(name: str) -> "Reproduction":
    """What `fogsim reproduce NAME` finds; minutes."""
    from fogsim.reproduce import REPRODUCTIONS  # noqa: PLC0415 - heavy, and the other tables do not need it

    return REPRODUCTIONS[name]()


def paper_cells(name: str) -> Rows:
    """Every published figure of a paper next to ours, misses in bold, and how many are reached."""
    from fogsim.reproduce.result import CELL_HEADING, reached_counts  # noqa: PLC0415 - as above

    cells = reproduced(name).cells
    reached = map(str, reached_counts(cells))
    return [CELL_HEADING, *(cell.shown() for cell in cells), ("reached", "", "", f"of {len(cells)}", *reached)]


def zhu2015() -> Rows:
    """Classes and errors of zhu2015, on free roads and behind a car."""
    return list(reproduced("zhu2015").table)


@functools.cache
def reproduced_drivers() -> "Reproduction":
    """Traffic in fog with half of the seeds that `fogsim reproduce drivers` reports; minutes."""
    from fogsim.reproduce.drivers import REPORT_SEEDS, Plan, reproduce  # noqa: PLC0415 - as above

    return reproduce(Plan(seeds=REPORT_SEEDS[:5]))


def drivers() -> Rows:
    """Published findings of traffic in fog, and ours."""
    return list(reproduced_drivers().table)


def drivers_traffic() -> Rows:
    """The default drivers' traffic by demand and visibility."""
    return list(reproduced_drivers().tables[1].rows)


TABLES: dict[str, tuple[str, Callable[[], Rows]]] = {
    "excerpt": ("docs/benchmarks/performance.md", excerpt),
    "night-veils": ("docs/explanation/night.md", night_deviations.veils),
    "night-gallen2014": ("docs/explanation/night.md", night_deviations.veils_of_gallen),
    "night-glows": ("docs/explanation/night.md", night_deviations.glows),
    "night-lobes": ("docs/explanation/night.md", night_deviations.lobes),
    "night-lamps": ("docs/explanation/night.md", night_deviations.lamp_fluxes),
    "night-limits": ("docs/explanation/night.md", night_deviations.fog_limits),
    "night-directions": ("docs/explanation/night.md", night_deviations.directions),
    **{f"paper-{name}": ("docs/benchmarks/papers.md", functools.partial(paper_cells, name)) for name in PAPERS},
    "zhu2015": ("docs/benchmarks/papers.md", zhu2015),
    "drivers-published": ("docs/explanation/drivers.md", drivers),
    "drivers-traffic": ("docs/explanation/drivers.md", drivers_traffic),
}
"""Page and rows of each table, by its name and marker."""


def chosen(names: list[str]) -> list[str]:
    """Names of tables, where a name stands for all that begin with it."""
    for name in names:
        if not any(known.startswith(name) for known in TABLES):
            sys.exit(f"no table is called {name}; there are {', '.join(TABLES)}")
    return [known for known in TABLES if not names or any(known.startswith(name) for name in names)]


def main() -> int:
    """Write the tables, or say which are not up to date."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(TABLES))
    parser.add_argument("--check", action="store_true", help="write nothing, say which are not up to date")
    arguments = parser.parse_args()
    stale = []
    for name in chosen(arguments.names):
        page, measured = TABLES[name]
        path = ROOT / page
        heading, *rows = measured()
        lines, text = lines_of(heading, rows), path.read_text(encoding="utf-8")
        if not same(block(text, name), block(filled(text, name, lines), name)):
            stale.append(f"{page}: the table {name} is not up to date: run python docs/make_measured_tables.py {name}")
            if not arguments.check:
                write_table(path, name, lines)
    if arguments.check and stale:
        print("\n".join(stale))  # noqa: T201 - the lines are the result
    return int(bool(arguments.check and stale))


if __name__ == "__main__":
    sys.exit(main())
