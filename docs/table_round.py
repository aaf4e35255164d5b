"""Running the commands that measure tables: one after the other, interruptible, and what moved by them."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from measured_tables import Measurement
from page_tables import Moved, block, moved, places, with_block
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from table_stamps import Stamps, code_digest

PATIENCE = 20.0
"""How long an interrupted command may take to end [s]."""


class Round:
    """One round through the tables, which can be interrupted.

    Parameters
    ----------
    stamps : Stamps
        Of the checkout.
    asked : list of str
        What the command line asked for: with anything else, another round begins.
    console : Console
        Where progress is drawn.
    """

    def __init__(self, stamps: Stamps, asked: list[str], console: Console) -> None:
        self._stamps, self._console = stamps, console
        self._folder = stamps.root / "runs" / "tables"
        self._file = self._folder / "progress.json"
        kept = json.loads(self._file.read_text(encoding="utf-8")) if self._file.exists() else {}
        fresh: dict[str, Any] = {"asked": asked, "started": {}, "finished": {}}
        self._kept = kept if kept.get("asked") == asked else fresh

    def finished(self, one: Measurement) -> bool:
        """Whether this round has measured it, with the code as it is now."""
        found = self._kept["finished"].get(one.name)
        return bool(found and found["code"] == code_digest(one, self._stamps.checkout().files(one.rests_on)))

    def run(self, chosen: list[Measurement]) -> list[str]:
        """Measure, and give the names of what failed."""
        failed, left = [], [one for one in chosen if not self.finished(one)]
        if len(left) < len(chosen):
            self._console.print(f"{len(chosen) - len(left)} of {len(chosen)} are finished already; going on")
        columns = (TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn())
        with Progress(*columns, console=self._console) as progress:
            task = progress.add_task("", total=sum(one.minutes for one in left) or 1)
            done = 0.0
            for number, one in enumerate(left, start=1):

                def show(minutes: float, one: Measurement = one, number: int = number, done: float = done) -> None:
                    come = done + min(minutes, one.minutes)
                    rest = sum(other.minutes for other in left) - come
                    told = f"{one.name} ({number} of {len(left)}), about {rest:.0f} min left"
                    progress.update(task, completed=come, description=told)

                if not self.measure(one, show):
                    failed.append(one.name)
                    progress.console.print(f"{one.name} failed: {self._folder / one.name}.log")
                done += one.minutes
        if not failed:
            self._file.unlink(missing_ok=True)
        return failed

    def measure(self, one: Measurement, show: Callable[[float], None]) -> bool:
        """Run the commands of one measurement; whether they wrote its tables."""
        files = self._stamps.checkout().files(one.rests_on)
        code = code_digest(one, files)
        if self._kept["started"].get(one.name) != code:
            shutil.rmtree(self._folder / one.name, ignore_errors=True)
            (self._folder / f"{one.name}.kept").unlink(missing_ok=True)
        self._kept["started"][one.name] = code
        self._keep()
        where = places(self._stamps.root)
        before = {where[name]: where[name].read_text(encoding="utf-8") for name in one.tables}
        old = {name: block(before[where[name]], name) for name in one.tables}
        began = time.monotonic()
        try:
            whole = self._commands(one, lambda: show((time.monotonic() - began) / 60.0))
        except BaseException:
            restore(before, old, where)
            raise
        if not whole:
            restore(before, old, where)
            return False
        minutes = round((time.monotonic() - began) / 60.0, 1)
        now = {name: block(where[name].read_text(encoding="utf-8"), name) for name in one.tables}
        cells = [cell for name in one.tables for cell in moved(name, old[name], now[name])]
        self._stamps.write(one, files, minutes)
        self._kept["started"].pop(one.name)
        self._kept["finished"][one.name] = {"code": code, "moved": [asdict(cell) for cell in cells]}
        self._keep()
        self._stamps.write_pages()
        return True

    def _commands(self, one: Measurement, tick: Callable[[], None]) -> bool:
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
        with (self._folder / f"{one.name}.log").open("ab") as log:
            for command in one.commands:
                log.write(f"$ {command}\n".encode())
                log.flush()
                with subprocess.Popen(  # noqa: S602 - command lines of this repository
                    command,
                    shell=True,
                    cwd=self._stamps.root,
                    env={**os.environ, "PATH": path},
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                ) as process:
                    if wait(process, tick) != 0:
                        return False
        return True

    def _keep(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        new = self._file.with_suffix(".new")
        new.write_text(json.dumps(self._kept, indent=1, ensure_ascii=False), encoding="utf-8")
        new.replace(self._file)

    def report(self) -> str:
        """What moved in this round, written to runs/tables/moved.md and moved.json as well."""
        finished = self._kept["finished"]
        cells = [Moved(**cell) for found in finished.values() for cell in found["moved"]]
        lines = [f"# Figures that moved in the tables of {', '.join(finished) or 'none'}: {len(cells)}", ""]
        if cells:
            lines += ["| table | row | column | was | is |", "| --- | --- | --- | --- | --- |"]
        told = [[text.replace("|", "·") for text in asdict(cell).values()] for cell in cells]
        lines += [f"| {' | '.join(cell)} |" for cell in told]
        self._folder.mkdir(parents=True, exist_ok=True)
        (self._folder / "moved.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        rows = json.dumps([asdict(cell) for cell in cells], indent=1, ensure_ascii=False)
        (self._folder / "moved.json").write_text(rows + "\n", encoding="utf-8")
        return "\n".join(lines)


def wait(process: "subprocess.Popen[bytes]", tick: Callable[[], None]) -> int:
    """Wait for a command; its exit code. What interrupts the waiting first ends the command and all it started."""
    try:
        while True:
            try:
                return process.wait(timeout=0.5)
            except subprocess.TimeoutExpired:
                tick()
    except BaseException:
        end(process)
        raise


def end(process: "subprocess.Popen[bytes]") -> None:
    """End a command and all that it started: it may take some time to put its results in order, and no longer."""
    until = time.monotonic() + PATIENCE
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
        while time.monotonic() < until:
            process.poll()
            time.sleep(0.1)
            os.killpg(process.pid, 0)
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def restore(before: dict[Path, str], old: dict[str, str], where: dict[str, Path]) -> None:
    """Put tables back as they were; of what else has changed in a page meanwhile nothing is lost, unless marks are."""
    for name, table in old.items():
        page = where[name]
        try:
            text = with_block(page.read_text(encoding="utf-8"), name, table)
        except ValueError:
            text = before[page]
        page.write_text(text, encoding="utf-8")
