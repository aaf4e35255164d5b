"""The manifest: what was run, with which versions, and how it ended."""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from importlib import metadata
from pathlib import Path

from fogsim.recorders.files import write_json
from fogsim.values import Ending

_DISTRIBUTIONS = ("fogsim", "numpy", "libsumo", "pyrender", "opencv-python-headless", "gymnasium")


class Status(StrEnum):
    """How far a run has come."""

    RUNNING = "running"
    COMPLETE = "complete"
    INTERRUPTED = "interrupted"
    FAILED = "failed"


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
    command_line : sequence of str
        How it was started, empty if not from the command line.
    files : sequence of str
        Names of the files beside the manifest.
    message : str
        What went wrong, if anything.
    """

    status: Status
    seed: int
    scenario: Mapping[str, object]
    started: datetime
    ended: datetime | None = None
    ending: Ending | None = None
    command_line: Sequence[str] = ()
    files: Sequence[str] = ()
    message: str = ""


def versions() -> dict[str, str | None]:
    """Versions of FogSim, Python, the libraries that decide results, and the platform; None where not installed."""
    found: dict[str, str | None] = {name: _version(name) for name in _DISTRIBUTIONS}
    return {**found, "python": platform.python_version(), "platform": platform.platform()}


def _version(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def write_manifest(path: Path, manifest: Manifest) -> None:
    """Write a manifest, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    manifest : Manifest
        What it says.

    Raises
    ------
    InputError
        If the scenario holds what JSON cannot.
    """
    write_json(
        path,
        {
            "status": manifest.status.value,
            "message": manifest.message,
            "ending": None if manifest.ending is None else manifest.ending.value,
            "seed": manifest.seed,
            "started": _utc(manifest.started),
            "ended": None if manifest.ended is None else _utc(manifest.ended),
            "command_line": list(manifest.command_line),
            "files": list(manifest.files),
            "versions": versions(),
            "scenario": manifest.scenario,
        },
    )


def _utc(instant: datetime) -> str:
    return instant.astimezone(UTC).isoformat(timespec="seconds")
