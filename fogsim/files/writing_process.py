"""Which process writes, and whether it still lives."""

import dataclasses
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self


@dataclasses.dataclass(frozen=True, slots=True)
class WritingProcess:
    """A process, told from a later one with the same number.

    Attributes
    ----------
    id : int
        Its number.
    host : str
        Name of its machine.
    boot : str
        When that machine was started, as the system tells it; empty where it does not.
    start_time : int or None
        When the process was started, in clock ticks since then; None where the system does not tell it.
    """

    id: int
    host: str
    boot: str
    start_time: int | None

    @classmethod
    def this(cls) -> Self:
        """Process that asks."""
        return cls(os.getpid(), platform.node(), _boot(), _start_time(os.getpid()))

    @classmethod
    def from_json(cls, values: object) -> Self | None:
        """Process that a file tells of; None if it tells of none."""
        if not isinstance(values, Mapping) or not isinstance(values.get("id"), int):
            return None
        told: dict[str, Any] = {field.name: values.get(field.name) for field in dataclasses.fields(cls)}
        return cls(**told)

    def to_json(self) -> dict[str, object]:
        """What a file tells of it."""
        return dataclasses.asdict(self)

    def lives(self) -> bool:
        """Tell whether it is known to run still, on this machine."""
        there = (platform.node(), _boot(), _start_time(self.id))
        return self.start_time is not None and there == (self.host, self.boot, self.start_time)


def _start_time(number: int) -> int | None:
    try:
        # The second field is a program's name in brackets, which may hold brackets and blanks itself.
        fields = Path(f"/proc/{number}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    # A zombie has ended; only its parent has not asked how.
    return None if fields[0] in "ZX" else int(fields[19])


def _boot() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""
