"""A round through the measured tables: several commands at once where each needs one core, and what moved."""

import contextlib
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from measured_tables import Measurement
from page_tables import Moved, block, lines_of, locked, moved, places, replace, with_block
from rich.console import Console
from table_stamps import Stamps, code_digest

CORES = os.cpu_count() or 1
PATIENCE = 20.0
"""How long an interrupted command may take to end [s]."""

ONE_CORE = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "LP")}
"""Environment of a command that shares the machine with another."""


class Round:
    """One round through the tables, with a report of what moved in it."""

    def __init__(self, stamps: Stamps, console: Console) -> None:
        self._stamps, self._console = stamps, console
        self._folder = stamps.root / "runs" / "tables"
        self._running: list[subprocess.Popen[bytes]] = []
        self._moved: dict[str, list[Moved]] = {}
        self._lock = threading.Lock()

    def run(self, chosen: list[Measurement]) -> list[str]:
        """Measure, first what needs all cores, the longest first, and return the names of those that failed."""
        minutes = {one: self._stamps.minutes(one) for one in chosen}
        ordered = sorted(minutes, key=minutes.__getitem__, reverse=True)
        batches = [[one] for one in ordered if cores(one) == CORES]
        batches.append([one for one in ordered if cores(one) < CORES])
        self._console.print(f"{len(chosen)} to measure, about {forecast(minutes):.0f} min")
        failed = []
        with ThreadPoolExecutor(CORES) as pool:
            try:
                for batch in batches:
                    for one, succeeded in zip(batch, pool.map(self._measure, batch), strict=True):
                        del minutes[one]
                        failed += [] if succeeded else [one.name]
                        told = "measured" if succeeded else f"failed: {self._folder / one.name}.log"
                        self._console.print(f"{one.name}: {told}; about {forecast(minutes):.0f} min left")
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                end(list(self._running))
                raise
        return failed

    def _measure(self, one: Measurement) -> bool:
        """Run its command and note what moved, or put the tables back; whether the command succeeded."""
        with self._lock:
            files, old, began = self._stamps.checkout().files(one.rests_on), self._tables(one), time.monotonic()
        code, started = code_digest(one, files), self._folder / f"{one.name}.code"
        resumed = started.exists() and started.read_text(encoding="utf-8") == code
        if not resumed:
            shutil.rmtree(self._folder / one.name, ignore_errors=True)
            (self._folder / f"{one.name}.kept").unlink(missing_ok=True)
        self._folder.mkdir(parents=True, exist_ok=True)
        if self._call(one, lambda: started.write_text(code, encoding="utf-8")) != 0:
            with locked(self._stamps.root):
                for name, table in old.items():
                    page = places(self._stamps.root)[name]
                    replace(page, with_block(page.read_text(encoding="utf-8"), name, table))
            return False
        started.unlink()
        now = self._tables(one)
        self._moved[one.name] = [cell for name in one.tables for cell in moved(name, old[name], now[name])]
        # What a resumed command took is not all of the time.
        with self._lock:
            self._stamps.write(one, files, None if resumed else round((time.monotonic() - began) / 60.0, 1))
            self._stamps.write_pages()
        return True

    def _call(self, one: Measurement, begin: Callable[[], object]) -> int:
        """Run its command line with a log; its exit code."""
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
        command = " && ".join(one.commands)
        with (self._folder / f"{one.name}.log").open("ab") as log:
            try:
                fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)  # The command inherits the lock.
            except BlockingIOError:
                raise SystemExit(f"{one.name} is being measured by another command: see {log.name}") from None
            begin()
            log.write(f"$ {command}\n".encode())
            log.flush()
            process = subprocess.Popen(  # noqa: S602 - command lines of this repository
                command,
                shell=True,
                cwd=self._stamps.root,
                env={**os.environ, "PATH": path, **(ONE_CORE if cores(one) < CORES else {})},
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._running.append(process)
        try:
            return process.wait()
        finally:
            self._running.remove(process)

    def _tables(self, one: Measurement) -> dict[str, str]:
        where = places(self._stamps.root)
        return {name: block(where[name].read_text(encoding="utf-8"), name) for name in one.tables}

    def report(self) -> str:
        """What moved in this round, written to runs/tables/moved.md and moved.json as well."""
        cells = [asdict(cell) for found in self._moved.values() for cell in found]
        lines = [f"# Figures that moved in the tables of {', '.join(self._moved) or 'none'}: {len(cells)}", ""]
        if cells:
            rows = [[text.replace("|", "·") for text in cell.values()] for cell in cells]
            lines += lines_of(("table", "row", "column", "was", "is"), rows)
        (self._folder / "moved.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        records = json.dumps(cells, indent=1, ensure_ascii=False)
        (self._folder / "moved.json").write_text(records + "\n", encoding="utf-8")
        return "\n".join(lines)


def cores(one: Measurement) -> int:
    """Cores that a measurement occupies: all of them where its tables hold times on the clock."""
    return CORES if one.times else min(one.cores, CORES)


def forecast(minutes: Mapping[Measurement, float]) -> float:
    """Time until all are measured [min]: as if they filled the cores, and no less than the longest takes."""
    return max([sum(one * cores(which) for which, one in minutes.items()) / CORES, *minutes.values()])


def end(processes: Sequence["subprocess.Popen[bytes]"]) -> None:
    """End commands and all that they started; they have a limited time to put their results in order."""
    for signum, patience in ((signal.SIGTERM, PATIENCE), (signal.SIGKILL, PATIENCE)):
        until = time.monotonic() + patience
        for process in processes:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signum)
        while time.monotonic() < until and any(map(is_alive, processes)):
            time.sleep(0.1)


def is_alive(process: "subprocess.Popen[bytes]") -> bool:
    """Whether anything of a command's process group is left."""
    process.poll()
    try:
        os.killpg(process.pid, 0)
    except ProcessLookupError:
        return False
    return True
