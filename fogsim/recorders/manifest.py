"""The manifest: what was run, with which versions, and how it ended."""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from importlib import metadata

from fogsim.files.writer_lock import WritingProcess
from fogsim.values import NOTHING_UNPLAYED, Ending, Unplayed

_DISTRIBUTIONS = ("fogsim", "numpy", "libsumo", "pyrender", "opencv-python-headless", "gymnasium")


class Status(StrEnum):
    """How far a run has come."""

    RUNNING = "running"
    COMPLETE = "complete"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    DEAD = "dead"


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a manifest says.

    Attributes
    ----------
    status : Status
        How far the run has come.
    seed : int
        Its seed.
    scenario : mapping
        The scenario as it was run, every default filled in; JSON values only.
    started : datetime
        Wall-clock time at the start, with its time zone.
    ended : datetime or None
        Wall-clock time at the end.
    ending : Ending or None
        Why the simulated run was over, None if it was cut short.
    unplayed : Unplayed
        What of the script was not played, empty if it was cut short.
    command_line : sequence of str
        How it was started, empty if not from the command line.
    process : WritingProcess
        Who writes.
    message : str
        What went wrong, if anything.
    failed_recorders : mapping from str to str
        Recorders that failed, and why.
    own_methods : mapping from str to str
        Methods of the user's own, and their versions.
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
        """What ``manifest.json`` says, without the names of files."""
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
    """Versions of FogSim, Python, the libraries that decide results, and the platform; None where not installed."""
    found: dict[str, str | None] = {name: _version(name) for name in _DISTRIBUTIONS}
    return {**found, "python": platform.python_version(), "platform": platform.platform()}


def _version(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def _utc(instant: datetime) -> str:
    return instant.astimezone(UTC).isoformat(timespec="seconds")
