"""When and with which code tables were measured: docs/measured_at/NAME.json, and what pages show of it."""

import hashlib
import json
import math
import os
import subprocess
import tomllib
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

import yaml
from code_digests import Checkout
from measured_tables import MEASUREMENTS, UNWRITTEN, Measurement
from page_tables import block, digest, filled, link, locked, places, replace, with_line

PAGE = "docs/benchmarks/reproducibility.md"
COMMAND = "python docs/rerun_tables.py"
NEVER_RUN = ("fogsim/openscenario/",)  # no table is measured from a file in that language
MEASURED, BY_HAND = "measured tables", "tables by hand"


@dataclass(frozen=True, slots=True)
class Stamp:
    """When tables were measured, and with which code."""

    version: str  # of FogSim
    commit: str  # the latest known to have that code; ends in " with changes" if files differed from it
    date: str
    machine: str  # its processor, if known
    minutes: float | None  # how long it took [min], if known
    tables: dict[str, str]  # digests of the tables, by name
    files: dict[str, str]  # digests of the files that they depend on, by path

    @property
    def label(self) -> str:
        """Version, commit and date in words."""
        return f"{self.version} ({self.commit}, {self.date})"


class Stamps:
    """Stamps of the tables of a checkout."""

    def __init__(self, root: Path, measurements: tuple[Measurement, ...] = MEASUREMENTS) -> None:
        self.root, self.measurements = root, measurements

    def checkout(self) -> Checkout:
        """Digests of the files as they are now."""
        return Checkout(self.root, NEVER_RUN)

    def read(self, one: Measurement) -> Stamp | None:
        """The stamp of a measurement."""
        file = self._file(one)
        if not file.exists():
            return None
        kept = json.loads(file.read_text(encoding="utf-8"))
        folders = kept.pop("files").items()
        found = ((folder, *entry.split(":")) for folder, entries in folders for entry in entries.split())
        return Stamp(**kept, files={f"{folder}/{name}": value for folder, name, value in found})

    def write(self, one: Measurement, files: dict[str, str], minutes: float | None) -> None:
        """Stamp tables as measured now, with the code as it is in the checkout."""
        commit = self._commit()
        if self._git("status", "--porcelain", "--", *files):
            commit += " with changes"
        now = datetime.now(UTC).strftime("%Y-%m-%d")
        where = places(self.root)
        tables = {name: digest(block(where[name].read_text(encoding="utf-8"), name)) for name in one.tables}
        version = tomllib.loads((self.root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
        kept = asdict(Stamp(version, commit, now, machine(), minutes, tables, files))
        by_folder: dict[str, list[str]] = {}
        for path, value in files.items():
            by_folder.setdefault(str(PurePosixPath(path).parent), []).append(f"{PurePosixPath(path).name}:{value}")
        kept["files"] = {folder: " ".join(found) for folder, found in by_folder.items()}
        self._file(one).parent.mkdir(parents=True, exist_ok=True)
        self._file(one).write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    def carry_forward(self) -> None:
        """Stamp tables that nothing would change with this commit: measured again, they would be the same."""
        for one in self.measurements:
            stamp = self.read(one)
            if (
                stamp
                and self.checkout().changed(stamp.files) == []
                and not self._git("status", "-s", "--", *stamp.files)
            ):
                text = self._file(one).read_text(encoding="utf-8")
                self._file(one).write_text(
                    text.replace(f'"{stamp.commit}"', f'"{self._commit()}"', 1), encoding="utf-8"
                )

    def _commit(self) -> str:
        return self._git("rev-parse", "--short=7", "HEAD").decode().strip()

    def minutes(self, one: Measurement) -> float:
        """How long a measurement took last time, or about how long it takes [min]."""
        stamp = self.read(one)
        return one.minutes if stamp is None or stamp.minutes is None else stamp.minutes

    def _file(self, one: Measurement) -> Path:
        return self.root / "docs" / "measured_at" / f"{one.name}.json"

    def _git(self, *arguments: str) -> bytes:
        return subprocess.run(["git", "-C", str(self.root), *arguments], check=True, capture_output=True).stdout  # noqa: S603, S607 - git of the developer's

    def changed(self) -> dict[str, list[str] | None]:
        """Files of each measurement that have changed since it was measured; None if it has no stamp."""
        checkout, found = self.checkout(), {}
        for one in self.measurements:
            stamp = self.read(one)
            found[one.name] = None if stamp is None else checkout.changed(stamp.files)
        return found

    def documented(self) -> dict[Path, str]:
        """Texts of the pages as they should be: with a line below each table, and the overview of all."""
        where, changed = places(self.root), self.changed()
        page = self.root / PAGE
        texts = {path: path.read_text(encoding="utf-8") for path in {*where.values(), page}}
        rows = ["| tables | command | min | measured with FogSim | changed since |", "| --- | --- | --- | --- | --- |"]
        for one in self.measurements:
            rows.append(self._row(one, where, changed[one.name]))
            stamp = self.read(one)
            for name in one.tables if stamp else ():
                path = where[name]
                on = f" on {stamp.machine}" if stamp.machine else ""
                line = f"FogSim {stamp.label}{on}: [what changed since]({link(path, page)}).*"
                texts[path] = with_line(texts[path], name, line)
        texts[page] = filled(texts[page], MEASURED, rows)
        by_hand = ["| page | table | figures |", "| --- | --- | --- |"]
        for table in UNWRITTEN:
            to = link(page, self.root / table.page)
            by_hand.append(f"| [{Path(table.page).stem}]({to}) | {table.about} | {table.figures} |")
        texts[page] = filled(texts[page], BY_HAND, by_hand)
        return texts

    def _row(self, one: Measurement, where: dict[str, Path], changed: list[str] | None) -> str:
        stamp, page = self.read(one), self.root / PAGE
        named = ", ".join(f"[{name}]({link(page, where[name])})" for name in one.tables)
        named += f" (times: {one.times})" if one.times else ""
        budget = f"{self.minutes(one):.0f}" + (f", {runs(self.root / one.rests_on[0])} runs" if one.is_study else "")
        commands = ", then ".join(f"`{command}`" for command in one.commands)
        since = "never measured by its command" if changed is None else parts(changed) or "nothing"
        return f"| {named} | {commands} | {budget} | {stamp.label if stamp else '–'} | {since} |"

    def complaints(self) -> list[str]:
        """What tables and pages state wrongly, with the command that mends each."""
        where, changed, found = places(self.root), self.changed(), []
        page = (self.root / PAGE).read_text(encoding="utf-8")
        for one in self.measurements:
            if missing := [name for name in one.tables if name not in where]:
                found.append(f"{one.name}: no page has the table {', '.join(missing)}")
                continue
            found += [
                f"{where[name].name}: the table {name} is not what was measured: {COMMAND} {one.name} measures it; "
                f"{COMMAND} --stamp {one.name} records it, if its command has just written it"
                for name in self._edited(one, where)
            ]
            if self._row(one, where, changed[one.name]) not in page:
                many = changed[one.name] or ["no file"]
                files = ", ".join(many[:9]) + (f" and {len(many) - 9} more" if len(many) > 9 else "")
                found.append(
                    f"{PAGE} is not up to date on {one.name}: since it was measured, these have changed: {files}. "
                    f"{COMMAND} {one.name} measures it again, {COMMAND} --page lists the change in the page"
                )
        stale = [] if found else [path for path, text in self.documented().items() if path.read_text("utf-8") != text]
        return found + [f"{path.name} is not up to date: {COMMAND} --page" for path in stale]

    def _edited(self, one: Measurement, where: dict[str, Path]) -> list[str]:
        stamp = self.read(one)
        texts = {name: where[name].read_text(encoding="utf-8") for name in (one.tables if stamp else ())}
        return [name for name, text in texts.items() if stamp and digest(block(text, name)) != stamp.tables.get(name)]

    def write_pages(self) -> None:
        """Write into pages when their tables were measured and what has changed since."""
        with locked(self.root):
            for path, text in self.documented().items():
                if path.read_text(encoding="utf-8") != text:
                    replace(path, text)


def runs(study: Path) -> int:
    """How many runs a study file asks for."""
    written = yaml.safe_load(study.read_text(encoding="utf-8"))
    seeds = written["seeds"]
    return math.prod(map(len, written["factors"].values())) * (seeds if isinstance(seeds, int) else len(seeds))


def parts(files: Iterable[str]) -> str:
    """The parts of the repository that files are in, by folders at its top."""
    found: dict[str, set[str]] = {}
    for folder, name, *_ in (PurePosixPath(file).parts for file in files):
        found.setdefault(folder, set()).add(name)
    return "; ".join(f"{folder}: {', '.join(sorted(names))}" for folder, names in found.items())


def machine() -> str:
    """Number and name of this machine's cores."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "a processor")
    return f"{os.cpu_count()} cores of {' '.join(name.replace('(R)', '').replace('(TM)', '').split())}"


def code_digest(one: Measurement, files: dict[str, str]) -> str:
    """One digest of commands and of all files."""
    return hashlib.sha256(repr((one.commands, files)).encode()).hexdigest()[:12]
