"""A disk with little room, played: what is written in one folder is refused when it is full."""

import errno
import io
import os
from pathlib import Path
from typing import IO, Any

import pytest


class SmallDisk:
    """Refuses to write more into a folder than fits into its `room` [bytes]."""

    def __init__(self, folder: Path, room: int, patch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.room = room
        self._open = Path.open
        disk = self

        def opened(path: Path, mode: str = "r", buffering: int = -1, *rest: Any, **options: Any) -> IO[Any]:
            if "b" not in mode or mode == "rb" or folder not in path.parents:
                return disk._open(path, mode, buffering, *rest, **options)
            raw = _File(disk, path, mode.replace("b", ""))
            return raw if buffering == 0 else io.BufferedWriter(raw)  # type: ignore[return-value]  # as open gives it

        patch.setattr(Path, "open", opened)

    def free(self) -> int:
        """Room that is left [bytes]."""
        used = sum(os.stat(os.path.join(at, name)).st_size for at, _, names in os.walk(self.folder) for name in names)  # noqa: PTH116, PTH118 - Path.open is played here
        return max(0, self.room - used)


class _File(io.FileIO):
    def __init__(self, disk: SmallDisk, path: Path, mode: str) -> None:
        super().__init__(path, mode)
        self._disk = disk

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        # What is written over takes no more room.
        over = max(0, os.fstat(self.fileno()).st_size - self.tell()) if "a" not in self.mode else 0
        room = self._disk.free() + over
        if view and not room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(view[:room])
