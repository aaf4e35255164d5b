"""Writing files so that none is ever half written under its final name, and none is replaced unasked."""

import contextlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from fogsim.errors import InputError

PARTIAL_SUFFIX = ".part"
"""What the name of a file ends in until it is whole."""

_LEAST_RESERVE = 2**18
"""Room that a reserve keeps in any case [bytes]."""


def partial_path(path: Path) -> Path:
    """Where a file is written until it is whole: its name with ``.part`` behind it.

    Parameters
    ----------
    path : Path
        The final name.
    """
    return path.with_name(path.name + PARTIAL_SUFFIX)


def publish(path: Path) -> None:
    """Give a file that is whole its final name, in place of one that is there, in one move.

    Parameters
    ----------
    path : Path
        The final name.
    """
    partial_path(path).replace(path)


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
    part = partial_path(path)
    try:
        with naming(part):
            part.write_bytes(data)
            publish(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


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


def refuse_existing(path: Path, overwrite: bool, option: str = "--out") -> None:
    """Refuse to write a file that is there already, or whose name is a folder's.

    Parameters
    ----------
    path : Path
        The file.
    overwrite : bool
        True where a file may be replaced.
    option : str
        The option that names it.

    Raises
    ------
    InputError
        If it is there and must not be replaced, or is a folder.
    """
    if path.is_dir():
        raise InputError(f"{option} {path} is a folder; give the name of a file")
    if path.exists() and not overwrite:
        raise InputError(f"{option} {path} is there already; give another name, or replace it with --overwrite")


def refuse_missing_folder(path: Path, option: str = "") -> None:
    """Refuse to write a file into a folder that is not there.

    Parameters
    ----------
    path : Path
        The file.
    option : str
        The option that names it, if one does.

    Raises
    ------
    InputError
        If there is no such folder.
    """
    if not path.parent.is_dir():
        raise InputError(f"{option} {path}: there is no folder {path.parent}".lstrip())
