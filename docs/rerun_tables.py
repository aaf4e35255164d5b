"""Measure the tables of the docs anew, and say which figures moved: ``make tables``.

    python docs/rerun_tables.py [NAME …] [--stale] [--dry-run]   # all, some, or those whose code has changed since
    python docs/rerun_tables.py --list [NAME …]                  # what rests on which changed files
    python docs/rerun_tables.py --check                          # exit code 1 if a page says what is not so
    python docs/rerun_tables.py --page                           # lets the pages say what is so
    python docs/rerun_tables.py --stamp NAME … [--commit C]      # for tables that their command wrote by itself

Names are those of docs/measured_tables.py. Interrupted or killed, the same command goes on: what is finished is noted
in runs/tables/progress.json, and long commands go on where they were. A command that fails leaves its tables as they
were and does not stop the others; logs are runs/tables/NAME.log. What moved is in runs/tables/moved.md and moved.json.
"""

import argparse
import signal
import sys
from pathlib import Path

from measured_tables import MEASUREMENTS, Measurement
from rich.console import Console
from table_round import Round
from table_stamps import Stamps

ROOT = Path(__file__).resolve().parents[1]


def listed(stamps: Stamps, chosen: list[Measurement]) -> str:
    """What is measured, and which files have changed since."""
    changed, lines = stamps.changed(), []
    for one in chosen:
        files, stamp = changed[one.name], stamps.read(one)
        told = "no stamp" if files is None or stamp is None else f"{stamp.told}, {len(files)} files changed since"
        lines += [
            f"{one.name}: {', '.join(one.tables)}; {one.minutes:.0f} min; {told}",
            *(f"    {file}" for file in files or ()),
        ]
    return "\n".join(lines)


def say(text: str) -> None:
    """Print a result."""
    print(text, flush=True)  # noqa: T201 - it is what the command is for


def interrupted(*_: object) -> None:
    """End as by Ctrl-C."""
    raise KeyboardInterrupt


def main(root: Path = ROOT, measurements: tuple[Measurement, ...] = MEASUREMENTS) -> int:
    """Do what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = {one.name: one for one in measurements}
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(names))
    parser.add_argument("--stale", action="store_true", help="only those whose code has changed since")
    for option, told in (
        ("--list", "say what has changed since"),
        ("--check", "exit code 1 if a page says what is not so"),
        ("--page", "let the pages say what is so"),
        ("--stamp", "take tables as measured by the code of today"),
        ("--dry-run", "print the commands"),
    ):
        parser.add_argument(option, action="store_true", help=told)
    parser.add_argument("--commit", help="with --stamp: by the code of this commit")
    asked = parser.parse_args()
    if unknown := [name for name in asked.names if name not in names]:
        parser.error(f"no tables are called {', '.join(unknown)}; there are {', '.join(names)}")
    if asked.stamp and not asked.names:
        parser.error("--stamp needs names")
    stamps, console = Stamps(root, measurements), Console(stderr=True)
    changed = stamps.changed() if asked.stale else {}
    chosen = [names[name] for name in asked.names or names if not asked.stale or changed[name] != []]
    if asked.check:
        complaints = stamps.complaints()
        say("\n".join(complaints) or "every table is what was measured, and the page says what has changed since")
        return int(bool(complaints))
    if asked.list:
        say(listed(stamps, chosen))
    elif asked.dry_run:
        say("\n".join(f"{command}  # {one.name}" for one in chosen for command in one.commands))
    elif asked.page or asked.stamp:
        for one in chosen if asked.stamp else ():
            if asked.commit:
                stamps.write_as_of(one, asked.commit)
            else:
                stamps.write(one, stamps.checkout().files(one.rests_on), None)
        stamps.write_pages()
    else:
        return rerun(Round(stamps, [*asked.names, *(["--stale"] if asked.stale else [])], console), chosen)
    return 0


def rerun(work: Round, chosen: list[Measurement]) -> int:
    """Measure, and print what moved; the exit code."""
    for signum in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, interrupted)
    try:
        failed = work.run(chosen)
    except KeyboardInterrupt:
        say("interrupted: the same command goes on from here")
        return 130
    say(work.report())
    if failed:
        say(f"failed: {', '.join(failed)}; the same command tries these again")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
