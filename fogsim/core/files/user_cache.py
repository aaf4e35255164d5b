"""The cache directory of the user, and generated files in it."""

import contextlib
import hashlib
import os
import shutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from fogsim.core.files.readers import read_bytes
from fogsim.errors import InputError

_CHECKSUM_SIZE = 32
_MOST_BYTES = 2**30


def read_entry(path: Path) -> bytes | None:
    """Content of an entry; None if it is missing, damaged or unreadable."""
    try:
        stored = memoryview(read_bytes(path, _MOST_BYTES))
    except InputError:
        return None
    content, checksum = stored[:-_CHECKSUM_SIZE], stored[-_CHECKSUM_SIZE:]
    return bytes(content) if hashlib.sha256(content).digest() == checksum else None


def write_entry(path: Path, content: bytes) -> None:
    """Write an entry; raises OSError if it cannot be written."""
    # The checksum is at the end, where pickle and zip ignore it: other readers of such files still work.
    replace_file(path, content + hashlib.sha256(content).digest())


def replace_file(path: Path, content: bytes) -> None:
    """Write a file of the cache, replacing an existing one; several processes may do so at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.{os.urandom(8).hex()}.part")
    try:
        part.write_bytes(content)
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def keep_newest(folder: Path, most: int, written: Path | None = None) -> None:
    """Remove all but the `most` newest entries of a cache folder and `written`, which a reset clock may make oldest."""
    with contextlib.suppress(OSError):
        for old in sorted(folder.iterdir(), key=lambda path: path.lstat().st_mtime)[:-most]:
            if old == written:
                continue
            if old.is_dir() and not old.is_symlink():
                shutil.rmtree(old, ignore_errors=True)
            else:
                old.unlink(missing_ok=True)


VARIABLE = "FOGSIM_CACHE_DIR"
"""Environment variable with another directory."""


def cache_directory() -> Path:
    """FogSim's folder in the user's cache directory, which may not exist yet.

    ``FOGSIM_CACHE_DIR`` if set; otherwise ``fogsim`` in ``XDG_CACHE_HOME`` or in the system's cache folder:
    ``~/.cache``, ``~/Library/Caches`` (macOS), ``%LOCALAPPDATA%`` (Windows).
    """
    named = os.environ.get(VARIABLE)
    if named:
        return Path(named)
    home = os.path.expanduser("~")  # noqa: PTH111 - without a home, Path.home() raises
    system = {"darwin": f"{home}/Library/Caches", "win32": os.environ.get("LOCALAPPDATA", f"{home}/AppData/Local")}
    return Path(os.environ.get("XDG_CACHE_HOME") or system.get(sys.platform, f"{home}/.cache")) / "fogsim"


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
