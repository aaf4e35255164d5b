"""When and at which code the measured tables were measured: docs/measured_at/NAME.json, and what of it pages show."""

import hashlib
import io
import json
import os
import subprocess
import tarfile
import tempfile
import tomllib
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

from code_digests import SOURCES, Checkout
from measured_tables import MEASUREMENTS, UNWRITTEN, Measurement
from page_tables import block, digest, link, places, with_block, with_line

PAGE = "docs/benchmarks/reproducibility.md"
COMMAND = "python docs/rerun_tables.py"
MEASURED, BY_HAND = "measured tables", "tables by hand"


@dataclass(frozen=True, slots=True)
class Stamp:
    """When tables were measured, and at which code.

    Attributes
    ----------
    version, commit, date : str
        Of FogSim: the last with " with changes" if files differed from the commit.
    machine : str
        Its processor, where that is known.
    minutes : float or None
        How long it took [min], where that is known.
    tables : dict
        Digests of what the tables said, by name.
    files : dict
        Digests of the files that they rest on, by path.
    """

    version: str
    commit: str
    date: str
    machine: str
    minutes: float | None
    tables: dict[str, str]
    files: dict[str, str]

    @property
    def told(self) -> str:
        """Version, commit and date in words."""
        return f"{self.version} ({self.commit}, {self.date})"


class Stamps:
    """Stamps of the tables of a checkout.

    Parameters
    ----------
    root : Path
        Of the checkout.
    measurements : tuple of Measurement, optional
        The checkout's.
    """

    def __init__(self, root: Path, measurements: tuple[Measurement, ...] = MEASUREMENTS) -> None:
        self.root, self.measurements = root, measurements

    def checkout(self) -> Checkout:
        """Digests of the files as they are now."""
        return Checkout(self.root, self.root / "runs" / "tables" / "digests.json")

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
        commit = self._git("rev-parse", "--short=7", "HEAD").decode().strip()
        if self._git("status", "--porcelain", "--", *files):
            commit += " with changes"
        now = datetime.now(UTC).strftime("%Y-%m-%d")
        self._write(one, files, (commit, now, machine()), minutes, (self.root / "pyproject.toml").read_text())

    def write_as_of(self, one: Measurement, commit: str) -> None:
        """Stamp tables as measured at an earlier commit, by whatever machine."""
        told = self._git("show", "-s", "--format=%h %cs", "--abbrev=7", commit).decode().split()
        tops = [*(folder for folder, _ in SOURCES), "scenarios", "pyproject.toml"]
        there = self._git("ls-tree", "--name-only", commit, "--", *tops).decode().split()
        with tempfile.TemporaryDirectory() as folder:
            with tarfile.open(fileobj=io.BytesIO(self._git("archive", commit, "--", *there))) as archive:
                archive.extractall(folder, filter="data")
            then = Path(folder)
            self._write(
                one,
                Checkout(then).files(one.rests_on),
                (*told, ""),
                None,
                (then / "pyproject.toml").read_text(encoding="utf-8"),
            )

    def _write(
        self, one: Measurement, files: dict[str, str], at: Iterable[str], minutes: float | None, project: str
    ) -> None:
        where = places(self.root)
        said = {name: digest(block(where[name].read_text(encoding="utf-8"), name)) for name in one.tables}
        version = tomllib.loads(project)["project"]["version"]
        kept = asdict(Stamp(version, *at, minutes, said, files))
        by_folder: dict[str, list[str]] = {}
        for path, value in files.items():
            by_folder.setdefault(str(PurePosixPath(path).parent), []).append(f"{PurePosixPath(path).name}:{value}")
        kept["files"] = {folder: " ".join(found) for folder, found in by_folder.items()}
        self._file(one).parent.mkdir(parents=True, exist_ok=True)
        self._file(one).write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    def _file(self, one: Measurement) -> Path:
        return self.root / "docs" / "measured_at" / f"{one.name}.json"

    def _git(self, *arguments: str) -> bytes:
        return subprocess.run(["git", "-C", str(self.root), *arguments], check=True, capture_output=True).stdout  # noqa: S603, S607 - git of the developer's

    def changed(self) -> dict[str, list[str] | None]:
        """Files of each measurement that are others than when it was measured; None if it was not stamped."""
        checkout, found = self.checkout(), {}
        for one in self.measurements:
            stamp = self.read(one)
            found[one.name] = None if stamp is None else checkout.changed(stamp.files)
        return found

    def documented(self) -> dict[Path, str]:
        """Texts of the pages as they should be: with lines below the tables, and the page's own tables."""
        where, changed = places(self.root), self.changed()
        page = self.root / PAGE
        texts = {path: path.read_text(encoding="utf-8") for path in {*where.values(), page}}
        rows = ["| tables | command | min | as of FogSim | code changed since |", "| --- | --- | --- | --- | --- |"]
        for one in self.measurements:
            rows.append(self._row(one, where, changed[one.name]))
            stamp = self.read(one)
            for name in one.tables if stamp else ():
                path = where[name]
                on = f" on {stamp.machine}" if stamp.machine else ""
                told = f"FogSim {stamp.told}{on}: [what changed since]({link(path, page)}).*"
                texts[path] = with_line(texts[path], name, told)
        texts[page] = with_block(texts[page], MEASURED, "\n" + "\n".join(rows) + "\n\n")
        by_hand = ["| page | table | figures |", "| --- | --- | --- |"]
        for table in UNWRITTEN:
            to = link(page, self.root / table.page)
            by_hand.append(f"| [{Path(table.page).stem}]({to}) | {table.about} | {table.figures} |")
        texts[page] = with_block(texts[page], BY_HAND, "\n" + "\n".join(by_hand) + "\n\n")
        return texts

    def _row(self, one: Measurement, where: dict[str, Path], changed: list[str] | None) -> str:
        stamp, page = self.read(one), self.root / PAGE
        named = ", ".join(f"[{name}]({link(page, where[name])})" for name in one.tables)
        named += f" (times: {one.times})" if one.times else ""
        minutes = stamp.minutes if stamp and stamp.minutes is not None else one.minutes
        commands = ", then ".join(f"`{command}`" for command in one.commands)
        since = "never measured by its command" if changed is None else rooms(changed) or "none"
        return f"| {named} | {commands} | {minutes:.0f} | {stamp.told if stamp else '–'} | {since} |"

    def complaints(self) -> list[str]:
        """What of the tables and of the page about them is not so, with the command that mends it."""
        where, changed, told = places(self.root), self.changed(), []
        page = (self.root / PAGE).read_text(encoding="utf-8")
        for one in self.measurements:
            if missing := [name for name in one.tables if name not in where]:
                told.append(f"{one.name}: no page has the table {', '.join(missing)}")
                continue
            told += [
                f"{where[name].name}: the table {name} is not what was measured: {COMMAND} {one.name} measures it; "
                f"{COMMAND} --stamp {one.name}, if its command wrote it just now"
                for name in self._edited(one, where)
            ]
            if self._row(one, where, changed[one.name]) not in page:
                files = ", ".join(changed[one.name] or ["no file"])
                told.append(
                    f"{PAGE} is not up to date on {one.name}: of what it rests on, there has changed since it was "
                    f"measured: {files}. {COMMAND} {one.name} measures it anew, {COMMAND} --page lets the page say so"
                )
        stale = [] if told else [path for path, text in self.documented().items() if path.read_text("utf-8") != text]
        return told + [f"{path.name} is not up to date: {COMMAND} --page" for path in stale]

    def _edited(self, one: Measurement, where: dict[str, Path]) -> list[str]:
        stamp = self.read(one)
        texts = {name: where[name].read_text(encoding="utf-8") for name in (one.tables if stamp else ())}
        return [name for name, text in texts.items() if stamp and digest(block(text, name)) != stamp.tables.get(name)]

    def write_pages(self) -> None:
        """Let pages say when their tables were measured, and what has changed since."""
        for path, text in self.documented().items():
            if path.read_text(encoding="utf-8") != text:
                path.write_text(text, encoding="utf-8")


def rooms(files: Iterable[str]) -> str:
    """The parts of the repository that files are in, by folders at its top."""
    parts: dict[str, set[str]] = {}
    for folder, name, *_ in (PurePosixPath(file).parts for file in files):
        parts.setdefault(folder, set()).add(name)
    return "; ".join(f"{folder}: {', '.join(sorted(names))}" for folder, names in parts.items())


def machine() -> str:
    """Cores that this process has, and their name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "a processor")
    return f"{os.cpu_count()} cores of {' '.join(name.replace('(R)', '').replace('(TM)', '').split())}"


def code_digest(one: Measurement, files: dict[str, str]) -> str:
    """One digest of commands and of all files."""
    return hashlib.sha256(repr((one.commands, files)).encode()).hexdigest()[:12]
