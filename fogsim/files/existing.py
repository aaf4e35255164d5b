"""Files that a user names for results."""

from pathlib import Path

from fogsim.errors import InputError


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Refuse to write a file that is there already.

    Parameters
    ----------
    path : Path
        What was given as ``--out``.
    overwrite : bool
        True where a file may be replaced.

    Raises
    ------
    InputError
        If it is there and must not be replaced, or is a folder.
    """
    if path.is_dir():
        raise InputError(f"--out {path} is a folder; give the name of a file")
    if path.exists() and not overwrite:
        raise InputError(f"--out {path} is there already; give another name, or replace it with --overwrite")
