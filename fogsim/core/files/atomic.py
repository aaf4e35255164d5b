"""Write files so that no half-written file ever has its final name.

Links are followed: the target is written and the link stays. Pipes and devices receive the content and are never
replaced.
"""

import contextlib
import errno
import fcntl
import json
import os
import stat
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from fogsim.errors import InputError

_PARTIAL_SUFFIX = ".part"
"""Suffix of a file's name until it is complete."""

_LEAST_RESERVE = 2**18
"""Minimum size of a reserve [bytes]."""

_MOST_LINKS = 40
"""Links that Linux follows in one path."""

_WITHOUT_LOCKS = errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL
"""Errors of file systems without locks."""


def final_path(path: Path) -> Path:
    """The file that a path stands for, with links followed even to a file that does not exist yet."""
    if not path.is_symlink():
        return path
    final = Path(os.path.realpath(path))
    if final.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    return final


def partial_path(path: Path) -> Path:
    """Temporary path of an incomplete file: its name, or that of its link's target, with ``.part`` appended."""
    final = final_path(path)
    return final.with_name(final.name + _PARTIAL_SUFFIX)


def publish(path: Path) -> None:
    """Give a complete file its final name and the permissions of the file that it replaces."""
    part, final = partial_path(path), final_path(path)
    with contextlib.suppress(FileNotFoundError):
        replaced = final.stat()
        if not stat.S_ISREG(replaced.st_mode):
            raise InputError(f"{path} is not a regular file, and is not replaced")
        # Without the right to change the owner, the new owner stays.
        with contextlib.suppress(PermissionError):
            os.chown(part, replaced.st_uid, replaced.st_gid)
        part.chmod(stat.S_IMODE(replaced.st_mode))
    part.replace(final)


def open_descriptor(path: Path) -> int | None:
    """Descriptor of this process that a path names, as /dev/stdout does; None for other paths."""
    for _ in range(_MOST_LINKS):
        # On Linux /dev/fd is a link to the former.
        folders = (os.path.realpath("/proc/self/fd"), "/dev/fd")
        if path.name.isdecimal() and os.path.realpath(path.parent) in folders:
            return int(path.name)
        if not path.is_symlink():
            break
        path = path.parent / path.readlink()
    return None


def is_stream(path: Path) -> bool:
    """Whether a path is written to directly: a pipe, a terminal, another device, /dev/stdout."""
    if open_descriptor(path) is not None:
        return True
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A file open for writing that gets its name when the block ends; an error in the block leaves no file."""
    if is_stream(path):
        with naming(path), _opened_stream(path) as file:
            yield file
        return
    part = partial_path(path)
    with naming(part), opened_alone(part) as file:
        try:
            yield file
            file.flush()
            # A network's file system reports a full disk when a descriptor is closed, and the lock stays until then.
            os.close(os.dup(file.fileno()))
            publish(path)
        except BaseException:
            with contextlib.suppress(OSError):
                part.unlink()
            raise


@contextlib.contextmanager
def opened_alone(part: Path) -> Iterator[BinaryIO]:
    """An empty file that no other process is writing; InputError if one is."""
    # What an earlier process left: a link would be followed, and a file can be write-protected.
    if part.is_symlink() or not (part.is_file() and os.access(part, os.W_OK)):
        part.unlink(missing_ok=True)
    part.touch()
    with part.open("r+b") as file:
        try:
            lock(file.fileno())
        except BlockingIOError:
            raise _other_writer(part) from None
        # Its writer may have published it since it was opened.
        if not (part.exists() and os.path.samestat(part.stat(), os.fstat(file.fileno()))):
            raise _other_writer(part)
        file.truncate()
        yield file


def lock(descriptor: int) -> None:
    """Lock an open file, unless its file system has no locks; BlockingIOError if another process holds the lock."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError as error:
        if error.errno not in _WITHOUT_LOCKS:
            raise


def _other_writer(part: Path) -> InputError:
    return InputError(f"{part}: another process is writing it; wait for its end, or give another name")


def _opened_stream(path: Path) -> BinaryIO:
    descriptor = open_descriptor(path)
    if descriptor is None:
        return path.open("wb")
    # Opening the file behind stdout by its name would truncate it.
    for printed in (sys.stdout, sys.stderr):
        if printed is not None:
            printed.flush()
    return os.fdopen(os.dup(descriptor), "wb")


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the file's name to the operating system's errors, such as a full disk."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file, whole or not at all."""
    with whole_file(path) as file:
        file.write(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; surrogates, as in undecodable names, become escapes."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_json(path: Path, values: Mapping[str, object]) -> None:
    """Write a JSON file, whole or not at all; NaN, infinity and other values that JSON lacks raise InputError."""
    try:
        text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path.name} holds only text, finite numbers, true, false, null, lists and mappings: {error}"
        ) from error
    write_text(path, text + "\n")


class Reserve:
    """Disk space that is held by a file and released when files must be closed on a full disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.grow(_LEAST_RESERVE)

    def grow(self, size: int) -> None:
        """Hold `size` more bytes; they are written, since a sparse file holds no space."""
        with naming(self._path), self._path.open("ab") as file:
            file.write(bytes(size))

    def release(self) -> None:
        """Release the space; may be called twice."""
        self._path.unlink(missing_ok=True)
