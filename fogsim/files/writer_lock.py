"""One directory, one writer."""

import fcntl
import json
import os
from pathlib import Path
from types import TracebackType
from typing import Self

from fogsim.errors import InputError
from fogsim.files.atomic import naming
from fogsim.files.writing_process import WritingProcess

LOCK_NAME = ".fogsim.lock"
"""Name of the lock file, which is there while something is written."""


class WriterLock:
    """A directory's lock; the operating system frees it when its process ends, however it ends.

    Parameters
    ----------
    folder : Path
        The directory.

    Raises
    ------
    InputError
        If another writer holds it; the message names its process.
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
        """Let others write; twice does nothing."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            self._path.unlink(missing_ok=True)
            os.close(descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def _locked(folder: Path, path: Path) -> int:
    """Descriptor of the lock file, locked."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The writer before may have taken its lock file away since this one was opened: it would lock nothing.
            if _is(path, descriptor):
                return descriptor
        except BlockingIOError:
            holder = os.pread(descriptor, 4096, 0)
            os.close(descriptor)
            raise InputError(
                f"{folder}: {_told(holder)} is writing there; wait for its end, or choose another directory with --out"
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


def _told(content: bytes) -> str:
    """Name the process that a lock file tells of."""
    try:
        process = WritingProcess.from_json(json.loads(content))
    except ValueError:
        process = None
    return "another process" if process is None else f"process {process.id} on {process.host}"
