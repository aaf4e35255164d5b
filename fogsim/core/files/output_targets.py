"""Checks of output options: a target that cannot be written is refused before the work begins."""

import contextlib
import errno
import fcntl
import itertools
import os
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from fogsim.core.files.atomic import final_path, is_stream, open_descriptor, partial_path
from fogsim.errors import InputError, shown


def refuse_unwritable(
    path: Path,
    option: str = "",
    *,
    overwrite: bool = True,
    read: Iterable[Path] = (),
    makes_folder: bool = False,
    seeks: bool = False,
) -> None:
    """Raise InputError if a file cannot or must not be written; the message names `option`.

    `read` are input files, which must not be replaced; `makes_folder` allows a missing folder; `seeks` refuses pipes
    and devices.
    """
    named = f"{option} {path}".lstrip()
    with _one_error(named):
        if is_stream(path):
            _refuse_unwritable_stream(path, named, seeks)
            return
        final = final_path(path)
        if final.is_dir():
            raise InputError(f"{named} is a folder; give the name of a file")
        if final.exists():
            if any(given.exists() and given.samefile(final) for given in read):
                raise InputError(f"{named} would replace what is read; give another name")
            if not overwrite:
                raise InputError(f"{named} already exists; give another name, or replace it with --overwrite")
            if not os.access(final, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        _refuse_unmakeable(partial_path(path), named, makes_folder)


def refuse_unwritable_folder(path: Path, option: str = "--out") -> None:
    """Raise InputError if a folder cannot be written, or be created with its parents."""
    named = f"{option} {path}"
    with _one_error(named):
        if os.path.lexists(path) and not path.is_dir():
            raise InputError(f"{named} is not a folder; give the name of a folder")
        _refuse_unmakeable(path / "file", named, makes_folder=True)


def refuse_clashes(files: Mapping[str, Path], folders: Mapping[str, Path]) -> None:
    """Raise InputError if two outputs are the same, or one is a file where another needs a folder."""
    named = {option: path for option, path in files.items() if not is_stream(path)}
    for (option, file), (other, path) in itertools.permutations({**named, **folders}.items(), 2):
        place = Path(os.path.realpath(path))
        if option in named and Path(os.path.realpath(file)) in (place, *place.parents):
            raise InputError(f"{option} {file} is in the way of {other} {path}; give another name")


@contextlib.contextmanager
def _one_error(named: str) -> Iterator[None]:
    """Raise what the operating system refuses as an InputError."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{named}: cannot be written: {error.strerror}") from error
    except ValueError as error:  # a NUL in the name
        raise InputError(f"{shown(named)}: {error}") from None


def _refuse_unwritable_stream(path: Path, named: str, seeks: bool) -> None:
    if seeks:
        raise InputError(f"{named} is a pipe or a device; give the name of a file")
    descriptor = open_descriptor(path)
    if descriptor is not None:
        if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
            raise OSError(errno.EBADF, "not open for writing")
        return
    mode = path.stat().st_mode
    if not (stat.S_ISCHR(mode) or stat.S_ISFIFO(mode)):
        raise InputError(f"{named} is a disk or a socket; give the name of a file")
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _refuse_unmakeable(target: Path, named: str, makes_folder: bool) -> None:
    """Refuse a file whose folder cannot be created or written, or whose name is too long."""
    there = next((one for one in target.parents if os.path.lexists(one)), Path())
    if not there.is_dir():
        raise InputError(f"{named}: {there} is not a folder")
    if there != target.parent and not makes_folder:
        raise InputError(f"{named}: there is no folder {target.parent}")
    longest = os.pathconf(there, "PC_NAME_MAX")
    if any(len(os.fsencode(name)) > longest for name in target.relative_to(there).parts):
        raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG))
    with contextlib.suppress(FileNotFoundError):
        target.lstat()  # fails for a path that is too long
    # Permissions do not show a read-only file system, and for root they show nothing.
    with tempfile.TemporaryFile(dir=there):
        pass
