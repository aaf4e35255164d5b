"""Measure the tables of the docs again and report which figures moved: ``make tables``.

    python docs/rerun_tables.py               # the tables whose code or data has changed since they were measured
    python docs/rerun_tables.py --studies     # the same for the policy studies
    python docs/rerun_tables.py NAME …        # these tables, changed or not
    python docs/rerun_tables.py --all         # every table but the studies, changed or not

Names are those of docs/measured_tables.py. The other options do not measure. Run the same command again to resume:
finished measurements are stamped, and long commands keep their own results. A command that fails leaves its tables as
they were and does not stop the others. Logs are runs/tables/NAME.log; what moved is in runs/tables/moved.md and
moved.json.
"""

import argparse
import signal
import sys
from pathlib import Path

from measured_tables import MEASUREMENTS, Measurement
from page_tables import ROOT
from rich.console import Console
from table_round import CORES, Round, cores, forecast
from table_stamps import Stamps


def listed(stamps: Stamps, chosen: list[Measurement], *, with_files: bool) -> str:
    """What would be measured, how long it takes and, if requested, which files have changed."""
    changed, minutes = stamps.changed(), {one: stamps.minutes(one) for one in chosen}
    lines = []
    for one in chosen:
        files, stamp = changed[one.name], stamps.read(one)
        state = f"{stamp.label}, {len(files)} files changed since" if files is not None and stamp else "never measured"
        lines.append(f"{one.name}: {minutes[one]:.0f} min on {cores(one)} of {CORES} cores; {state}")
        lines += [f"    {line}" for line in (files or () if with_files else one.commands)]
    return "\n".join([*lines, f"{len(chosen)} to measure, about {forecast(minutes):.0f} min"])


def say(text: str) -> None:
    """Print a result."""
    print(text, flush=True)  # noqa: T201 - it is what the command is for


def interrupted(*_: object) -> None:
    """End as on Ctrl-C."""
    raise KeyboardInterrupt


def main(root: Path = ROOT, measurements: tuple[Measurement, ...] = MEASUREMENTS) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = {one.name: one for one in measurements}
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(names))
    for option, meaning in (
        ("--studies", "the policy studies instead of the other tables"),
        ("--all", "also tables whose code has not changed"),
        ("--dry-run", "print the commands and how long they would take"),
        ("--list", "print which files have changed since the tables were measured"),
        ("--check", "exit code 1 if a page does not state what was measured and what has changed since"),
        ("--current", "exit code 1 if code that a table depends on has changed since it was measured"),
        ("--page", "write that into the pages"),
        ("--stamp", "record tables as measured by the code as it is now"),
    ):
        parser.add_argument(option, action="store_true", help=meaning)
    given = parser.parse_args()
    if unknown := [name for name in given.names if name not in names]:
        parser.error(f"no tables are called {', '.join(unknown)}; there are {', '.join(names)}")
    if given.stamp and not given.names:
        parser.error("--stamp needs names")
    stamps = Stamps(root, measurements)
    if given.check:
        complaints = stamps.complaints()
        say("\n".join(complaints) or "every table is as measured, and the page lists what has changed since")
        return int(bool(complaints))
    if given.current:
        outdated = [name for name, files in stamps.changed().items() if files != []]
        say(f"code has changed since these were measured: {', '.join(outdated) or 'none'}")
        return int(bool(outdated))
    chosen = [names[name] for name in given.names] or [one for one in measurements if one.is_study == given.studies]
    if not (given.names or given.all):
        changed = stamps.changed()
        chosen = [one for one in chosen if changed[one.name] != []]
    if given.list or given.dry_run:
        say(listed(stamps, chosen, with_files=given.list))
    elif given.page or given.stamp:
        for one in chosen if given.stamp else ():
            stamps.write(one, stamps.checkout().files(one.rests_on), None)
        stamps.write_pages()
    else:
        return rerun(stamps, chosen)
    return 0


def rerun(stamps: Stamps, chosen: list[Measurement]) -> int:
    """Measure, and print what moved; the exit code."""
    failed = []
    if not chosen:
        say("no table's code has changed since it was measured; --all measures them all the same")
    else:
        work = Round(stamps, Console(stderr=True))
        for signum in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(signum, interrupted)
        try:
            failed = work.run(chosen)
        except KeyboardInterrupt:
            say("interrupted: run the same command again to resume")
            return 130
        say(work.report())
    stamps.carry_forward()
    stamps.write_pages()
    if failed:
        say(f"failed: {', '.join(failed)}; the same command tries these again")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
