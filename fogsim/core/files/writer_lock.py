"""One directory, one writer: the lock and the process that holds it."""

import dataclasses
import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from fogsim.core.files.atomic import lock, naming
from fogsim.errors import InputError


@dataclasses.dataclass(frozen=True, slots=True)
class WritingProcess:
    """A process, distinguished from a later one with the same id by its start.

    `boot` identifies the start of its machine ("" if unknown) and `start_time` is in clock ticks since then.
    """

    id: int
    host: str
    boot: str
    start_time: int | None

    @classmethod
    def this(cls) -> Self:
        """The current process."""
        return cls(os.getpid(), platform.node(), _boot(), _start_time(os.getpid()))

    @classmethod
    def from_json(cls, values: object) -> Self | None:
        """The process that a file names; None if the file names none."""
        if not isinstance(values, Mapping) or not isinstance(values.get("id"), int):
            return None
        fields: dict[str, Any] = {field.name: values.get(field.name) for field in dataclasses.fields(cls)}
        return cls(**fields)

    def to_json(self) -> dict[str, object]:
        """The process as JSON data."""
        return dataclasses.asdict(self)

    def lives(self) -> bool:
        """Whether it is known to be running on this machine."""
        there = (platform.node(), _boot(), _start_time(self.id))
        return self.start_time is not None and there == (self.host, self.boot, self.start_time)


def _start_time(number: int) -> int | None:
    try:
        # The second field is a program's name in brackets, which may itself contain brackets and blanks.
        fields = Path(f"/proc/{number}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    # A zombie has ended; only its parent has not collected its exit code.
    return None if fields[0] in "ZX" else int(fields[19])


def _boot() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""


LOCK_NAME = ".fogsim.lock"
"""Name of the lock file, which exists while a directory is written."""


class WriterLock:
    """A directory's lock, which the operating system releases when its process ends.

    InputError names the process that holds it. A file system without locks keeps no second writer away.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOCK_NAME
        self._descriptor = _locked(folder, self._path)
        try:
            with naming(self._path):
                os.truncate(self._descriptor, 0)
                os.write(self._descriptor, json.dumps(WritingProcess.this().to_json()).encode())
        except BaseException:
            self.release()
            raise

    def release(self) -> None:
        """Release the lock; may be called twice."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            self._path.unlink(missing_ok=True)
            os.close(descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _locked(folder: Path, path: Path) -> int:
    """Descriptor of the locked file."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            lock(descriptor)
            # The previous writer may have removed its lock file after this one was opened: it would lock nothing.
            if _is(path, descriptor):
                return descriptor
        except BlockingIOError:
            holder = os.pread(descriptor, 4096, 0)
            os.close(descriptor)
            raise InputError(
                f"{folder}: {_holder_name(holder)} is writing there; wait for its end, or choose another "
                "directory with --out"
            ) from None
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _is(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _holder_name(content: bytes) -> str:
    """Name the process in a lock file."""
    try:
        process = WritingProcess.from_json(json.loads(content))
    except ValueError:
        process = None
    return "another process" if process is None else f"process {process.id} on {process.host}"
