"""Files that FogSim writes for SUMO, in folders named after their content in the user's cache directory."""

import hashlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from fogsim.core.files.readers import read_bytes
from fogsim.core.files.user_cache import VARIABLE, cache_directory, keep_newest, read_entry, replace_file, write_entry
from fogsim.errors import InputError

_MOST_KEPT = 200  # of each type; the oldest are removed
_LARGEST_SOURCE = 2**29  # [bytes]


def write_generated(kind: str, texts: Mapping[str, str]) -> Path:
    """Folder in the cache directory that holds these texts by file name; written unless it holds them already."""
    digest = hashlib.sha256("\0".join(texts.values()).encode()).hexdigest()[:24]
    folder = cache_directory() / kind / digest
    try:
        if folder.is_file():
            folder.unlink()
        missing = {name: text for name, text in texts.items() if not _holds(folder / name, text.encode())}
        for name, text in missing.items():
            replace_file(folder / name, text.encode())
        os.utime(folder)
    except OSError as error:
        raise InputError(
            f"the files of a road cannot be written into {folder}: {error.strerror}; name another folder "
            f"in the environment variable {VARIABLE}"
        ) from error
    if missing:
        keep_newest(folder.parent, _MOST_KEPT, folder)
    return folder


def _holds(path: Path, content: bytes) -> bool:
    try:
        return read_bytes(path, len(content)) == content
    except InputError:
        return False


def kept_text(kind: str, source: Path, recipe: bytes, make: Callable[[], str]) -> str:
    """Text that `make` derives from a file, cached by the file's content and `recipe`, which identifies the method."""
    try:
        digest = hashlib.sha256(b"\0".join([recipe, read_bytes(source, _LARGEST_SOURCE)])).hexdigest()[:24]
        path = cache_directory() / kind / digest
        kept = read_entry(path)
        if kept is not None:
            return kept.decode()
        text = make()
        write_entry(path, text.encode())
    except OSError as error:
        raise InputError(f"{source}: what is made of it cannot be kept: {error.strerror}") from error
    keep_newest(path.parent, _MOST_KEPT)
    return text
