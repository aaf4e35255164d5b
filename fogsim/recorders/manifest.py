"""The manifest: what was run, with which versions, and how it ended."""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from importlib import metadata

from fogsim.core.files.writer_lock import WritingProcess
from fogsim.values import NOTHING_UNPLAYED, Ending, Unplayed

_DISTRIBUTIONS = ("fogsim", "numpy", "libsumo", "pyrender", "opencv-python-headless", "gymnasium")


class Status(StrEnum):
    """Status of a run."""

    RUNNING = "running"
    COMPLETE = "complete"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    DEAD = "dead"


@dataclass(frozen=True, slots=True)
class Manifest:
    """Content of a run's manifest.

    `scenario` is the scenario as it was run, with every default, as JSON data; `started` has its time zone; `ending` is
    None and `unplayed` empty if the run was cut short; `command_line` is empty for runs from Python; `own_methods` are
    the users' methods and their versions.
    """

    status: Status
    seed: int
    scenario: Mapping[str, object]
    started: datetime
    ended: datetime | None = None
    ending: Ending | None = None
    unplayed: Unplayed = NOTHING_UNPLAYED
    command_line: Sequence[str] = ()
    process: WritingProcess = field(default_factory=WritingProcess.this)
    message: str = ""
    failed_recorders: Mapping[str, str] = field(default_factory=dict)
    own_methods: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, object]:
        """Contents of ``manifest.json``, without the names of files."""
        return {
            "status": self.status.value,
            "message": self.message,
            "failed_recorders": dict(self.failed_recorders),
            "ending": None if self.ending is None else self.ending.value,
            "events_not_fired": [str(event) for event in self.unplayed.events],
            "vehicles_never_seen": list(self.unplayed.vehicles),
            "seed": self.seed,
            "started": _utc(self.started),
            "ended": None if self.ended is None else _utc(self.ended),
            "process": self.process.to_json(),
            "command_line": list(self.command_line),
            "versions": {**versions(), **self.own_methods},
            "scenario": self.scenario,
        }


def versions() -> dict[str, str | None]:
    """Versions of FogSim, Python, the libraries that affect results, and the platform; None if not installed."""
    found: dict[str, str | None] = {name: _version(name) for name in _DISTRIBUTIONS}
    return {**found, "python": platform.python_version(), "platform": platform.platform()}


def _version(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def _utc(instant: datetime) -> str:
    return instant.astimezone(UTC).isoformat(timespec="seconds")
