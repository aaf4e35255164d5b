"""Files that FogSim writes for SUMO, in folders named after their content in the user's cache directory."""

import contextlib
import hashlib
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from fogsim.errors import InputError
from fogsim.files.readers import read_bytes
from fogsim.files.user_cache import VARIABLE, cache_directory

_MOST_FOLDERS = 200  # of generated files; the oldest go


def write_generated(kind: str, texts: Mapping[str, str]) -> Path:
    """Write files, unless the same ones are there already.

    Parameters
    ----------
    kind : str
        Name of the folder in the cache directory in which their folder lies.
    texts : mapping from str to str
        Their names and texts.

    Returns
    -------
    Path
        Their folder.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    digest = hashlib.sha256("\0".join(texts.values()).encode()).hexdigest()[:24]
    folder = cache_directory() / kind / digest
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            place = folder / name
            if place.is_file():
                os.utime(folder)
                continue
            # Several processes may do so at once.
            part = place.with_name(f"{name}.{os.getpid()}.part")
            part.write_text(text, encoding="utf-8")
            part.replace(place)
    except OSError as error:
        raise InputError(
            f"the files of a road cannot be written into {folder}: {error.strerror}; name another folder "
            f"in the environment variable {VARIABLE}"
        ) from error
    _leave_out_old(folder.parent)
    return folder


def kept_text(kind: str, source: Path, recipe: bytes, make: Callable[[], str]) -> str:
    """Text that is made of a file, and kept for the next time that a file with the same content comes.

    Parameters
    ----------
    kind : str
        Name of the folder in the cache directory.
    source : Path
        The file.
    recipe : bytes
        What it is made by: another recipe makes another text.
    make : callable
        Makes the text.

    Raises
    ------
    InputError
        If the file cannot be read, or nothing can be written; what `make` raises.
    """
    try:
        digest = hashlib.sha256(b"\0".join([recipe, read_bytes(source)])).hexdigest()[:24]
        place = cache_directory() / kind / digest
        if place.is_file():
            return place.read_text(encoding="utf-8")
        text = make()
        place.parent.mkdir(parents=True, exist_ok=True)
        part = place.with_name(f"{place.name}.{os.getpid()}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(place)
    except OSError as error:
        raise InputError(f"{source}: what is made of it cannot be kept: {error.strerror}") from error
    return text


def _leave_out_old(parent: Path) -> None:
    with contextlib.suppress(OSError):
        for old in sorted(_folders(parent), key=lambda path: path.stat().st_mtime)[:-_MOST_FOLDERS]:
            shutil.rmtree(old, ignore_errors=True)


def _folders(parent: Path) -> Iterator[Path]:
    return (path for path in parent.iterdir() if path.is_dir())
