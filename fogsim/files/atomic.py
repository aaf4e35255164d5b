"""Writing files so that none is ever half written under its final name.

A link is followed, so that its target is written and the link stays. Pipes and devices are never replaced: they get the
content as it comes.
"""

import contextlib
import errno
import json
import os
import stat
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from fogsim.errors import InputError

PARTIAL_SUFFIX = ".part"
"""What the name of a file ends in until it is whole."""

_LEAST_RESERVE = 2**18
"""Room that a reserve keeps in any case [bytes]."""

_MOST_LINKS = 40
"""Links that Linux follows in one path."""


def final_path(path: Path) -> Path:
    """The file that a path stands for: links are followed, also to a file that does not exist yet.

    Raises
    ------
    OSError
        If the links lead to one another.
    """
    if not path.is_symlink():
        return path
    final = Path(os.path.realpath(path))
    if final.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    return final


def partial_path(path: Path) -> Path:
    """Where a file is written until it is whole: its name, or that of its link's target, with ``.part`` behind it."""
    final = final_path(path)
    return final.with_name(final.name + PARTIAL_SUFFIX)


def publish(path: Path) -> None:
    """Give a file that is whole its final name; a file that it replaces passes on its permissions.

    Raises
    ------
    InputError
        If a pipe, a device or a folder has that name.
    """
    part, final = partial_path(path), final_path(path)
    with contextlib.suppress(FileNotFoundError):
        replaced = final.stat()
        if not stat.S_ISREG(replaced.st_mode):
            raise InputError(f"{path} is not a regular file, and is not replaced")
        # Who may not give files away keeps the new one.
        with contextlib.suppress(PermissionError):
            os.chown(part, replaced.st_uid, replaced.st_gid)
        part.chmod(stat.S_IMODE(replaced.st_mode))
    part.replace(final)


def open_descriptor(path: Path) -> int | None:
    """Number of the file, open in this process, that a path stands for, as /dev/stdout does; None for other paths."""
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
    """Whether what is written to a path goes through it: a pipe, a terminal, another device, /dev/stdout."""
    if open_descriptor(path) is not None:
        return True
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A file open for writing; it gets its name when the block ends, and leaves nothing if an error ends it.

    Raises
    ------
    OSError
        If it cannot be written; the message names the file.
    """
    if is_stream(path):
        with naming(path), _opened_stream(path) as file:
            yield file
        return
    part = partial_path(path)
    try:
        with naming(part):
            # It may be a link.
            part.unlink(missing_ok=True)
            with part.open("wb") as file:
                yield file
            publish(path)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


def _opened_stream(path: Path) -> BinaryIO:
    descriptor = open_descriptor(path)
    if descriptor is None:
        return path.open("wb")
    # The file that stdout is redirected to would be cut off if it were opened by its name.
    for printed in (sys.stdout, sys.stderr):
        if printed is not None:
            printed.flush()
    return os.fdopen(os.dup(descriptor), "wb")


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an error of the operating system (a full disk) name the file.

    Parameters
    ----------
    path : Path
        The file that is worked on.

    Raises
    ------
    OSError
        The same error, with the file's name.
    """
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    data : bytes
        Its content.

    Raises
    ------
    OSError
        If it cannot be written; the message names the file.
    """
    with whole_file(path) as file:
        file.write(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; what is no Unicode of file names is escaped, in JSON as JSON has it.

    Parameters
    ----------
    path : Path
        The file.
    text : str
        Its content.
    """
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_json(path: Path, values: Mapping[str, object]) -> None:
    """Write a JSON file, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    values : mapping
        Its content; JSON values only.

    Raises
    ------
    InputError
        If a value is not finite or nothing that JSON can hold.
    """
    try:
        text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path.name} holds only text, finite numbers, true, false, null, lists and mappings: {error}"
        ) from error
    write_text(path, text + "\n")


class Reserve:
    """Room on the disk that is given back when it is needed, so that files can be closed on a disk that is full.

    Parameters
    ----------
    path : Path
        The file that takes the room.

    Raises
    ------
    OSError
        If there is not as much room; the message names the file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.grow(_LEAST_RESERVE)

    def grow(self, size: int) -> None:
        """Keep more room [bytes]; written, since a file with holes takes none.

        Parameters
        ----------
        size : int
            How much more [bytes].
        """
        with naming(self._path), self._path.open("ab") as file:
            file.write(bytes(size))

    def release(self) -> None:
        """Give the room back; twice does nothing."""
        self._path.unlink(missing_ok=True)
