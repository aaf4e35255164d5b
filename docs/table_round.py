"""A round through the measured tables: two commands at once where each needs one core, resumable, and what moved."""

import contextlib
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from measured_tables import Measurement
from page_tables import Moved, block, locked, moved, places, replace, with_block
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from table_stamps import Stamps, code_digest

CORES = os.cpu_count() or 1
PATIENCE = 20.0
"""How long an interrupted command may take to end [s]."""

ONE_CORE = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "LP")}
"""Environment of a command that shares the machine with another."""


@dataclass(slots=True)
class Job:
    """A measurement that is running."""

    one: Measurement
    files: dict[str, str]
    old: dict[str, str]
    resumed: bool
    began: float
    process: "subprocess.Popen[bytes]"

    @property
    def spent(self) -> float:
        """Time since it began [min]."""
        return (time.monotonic() - self.began) / 60.0


class Round:
    """One round through the tables; with another request on the command line, another round begins."""

    def __init__(self, stamps: Stamps, requested: list[str], console: Console) -> None:
        self._stamps, self._console = stamps, console
        self._folder = stamps.root / "runs" / "tables"
        self._file = self._folder / "progress.json"
        kept = json.loads(self._file.read_text(encoding="utf-8")) if self._file.exists() else {}
        fresh: dict[str, Any] = {"requested": requested, "started": {}, "finished": {}}
        self._kept = kept if kept.get("requested") == requested else fresh

    def run(self, chosen: list[Measurement]) -> list[str]:
        """Measure, the longest first, and return the names of those that failed."""
        minutes = {one: self._stamps.minutes(one) for one in chosen if not self._is_finished(one)}
        left = sorted(minutes, key=minutes.__getitem__, reverse=True)
        self._console.print(f"{len(left)} of {len(chosen)} to measure, about {forecast(minutes):.0f} min")
        columns = (TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn())
        failed: list[str] = []
        running: list[Job] = []
        text = ""
        with Progress(*columns, console=self._console) as progress:
            task, total = progress.add_task("", total=len(left)), len(left)
            try:
                while left or running:
                    for job in [job for job in running if job.process.poll() is not None]:
                        running.remove(job)
                        if self._finish(job):
                            progress.console.print(f"{job.one.name}: {job.spent:.1f} min; {text}")
                        else:
                            failed.append(job.one.name)
                            progress.console.print(f"{job.one.name} failed: {self._folder / job.one.name}.log")
                    while one := next((one for one in left if cores(one) <= free(running)), None):
                        left.remove(one)
                        running.append(self._start(one))
                    rest = {job.one: max(minutes[job.one] - job.spent, 0.0) for job in running}
                    text = f"about {forecast(rest | {one: minutes[one] for one in left}):.0f} min left"
                    names = ", ".join(job.one.name for job in running)
                    done = total - len(left) - len(running)
                    progress.update(task, completed=done, description=f"{names}; {done} of {total}, {text}")
                    time.sleep(0.1)
            except BaseException:
                end([job.process for job in running])
                for job in running:
                    self._restore(job)
                raise
        if not failed:
            self._file.unlink(missing_ok=True)
        return failed

    def _is_finished(self, one: Measurement) -> bool:
        """Whether this round has measured it, with the code as it is now."""
        found = self._kept["finished"].get(one.name)
        return bool(found and found["code"] == code_digest(one, self._stamps.checkout().files(one.rests_on)))

    def _start(self, one: Measurement) -> Job:
        files = self._stamps.checkout().files(one.rests_on)
        code = code_digest(one, files)
        resumed = self._kept["started"].get(one.name) == code
        if not resumed:
            shutil.rmtree(self._folder / one.name, ignore_errors=True)
            (self._folder / f"{one.name}.kept").unlink(missing_ok=True)
        self._kept["started"][one.name] = code
        self._keep()
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
        command, old = " && ".join(one.commands), self._tables(one)
        with (self._folder / f"{one.name}.log").open("ab") as log:
            try:
                fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)  # The command inherits the lock.
            except BlockingIOError:
                raise SystemExit(f"{one.name} is being measured by another command: see {log.name}") from None
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
        return Job(one, files, old, resumed, time.monotonic(), process)

    def _tables(self, one: Measurement) -> dict[str, str]:
        where = places(self._stamps.root)
        return {name: block(where[name].read_text(encoding="utf-8"), name) for name in one.tables}

    def _finish(self, job: Job) -> bool:
        """Note what moved, or put the tables back; whether its command succeeded."""
        one = job.one
        if job.process.returncode != 0:
            self._restore(job)
            return False
        now = self._tables(one)
        cells = [cell for name in one.tables for cell in moved(name, job.old[name], now[name])]
        # What a resumed command took is not all of the time.
        self._stamps.write(one, job.files, None if job.resumed else round(job.spent, 1))
        self._kept["finished"][one.name] = {
            "code": self._kept["started"].pop(one.name),
            "moved": [asdict(cell) for cell in cells],
        }
        self._keep()
        self._stamps.write_pages()
        return True

    def _restore(self, job: Job) -> None:
        """Put its tables back as they were."""
        where = places(self._stamps.root)
        with locked(self._stamps.root):
            for name, table in job.old.items():
                replace(where[name], with_block(where[name].read_text(encoding="utf-8"), name, table))

    def _keep(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        replace(self._file, json.dumps(self._kept, indent=1, ensure_ascii=False))

    def report(self) -> str:
        """What moved in this round, written to runs/tables/moved.md and moved.json as well."""
        finished = self._kept["finished"]
        cells = [Moved(**cell) for found in finished.values() for cell in found["moved"]]
        lines = [f"# Figures that moved in the tables of {', '.join(finished) or 'none'}: {len(cells)}", ""]
        if cells:
            lines += ["| table | row | column | was | is |", "| --- | --- | --- | --- | --- |"]
        rows = [[text.replace("|", "·") for text in asdict(cell).values()] for cell in cells]
        lines += [f"| {' | '.join(row)} |" for row in rows]
        self._folder.mkdir(parents=True, exist_ok=True)
        (self._folder / "moved.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        records = json.dumps([asdict(cell) for cell in cells], indent=1, ensure_ascii=False)
        (self._folder / "moved.json").write_text(records + "\n", encoding="utf-8")
        return "\n".join(lines)


def cores(one: Measurement) -> int:
    """Cores that a measurement occupies: all of them where its tables hold times on the clock."""
    return CORES if one.times else min(one.cores, CORES)


def free(running: Sequence[Job]) -> int:
    """Cores that no running measurement occupies."""
    return CORES - sum(cores(job.one) for job in running)


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
