"""Road networks that other people's files name: next to the file, or in the user's own folder of maps."""

import os
from pathlib import Path

from fogsim.errors import InputError, shown, suggest

MAPS = "FOGSIM_MAPS"
"""Environment variable with the user's folder of maps."""

_OPENDRIVE, SUMO = ".xodr", ".net.xml"
"""How names of maps end."""


def find_map(written: str, folder: Path) -> Path:
    """File of a map; InputError if there is none.

    It is `written` relative to a folder, or its name with one of the endings in the user's folder of maps.
    """
    if _is_map(folder / written):
        return folder / written
    name = Path(written.replace("\\", "/")).name
    for ending in (_OPENDRIVE, SUMO):
        name = name.removesuffix(ending)
    maps = os.environ.get(MAPS, "")
    if not maps:
        expected = f"expected an OpenDRIVE file ({_OPENDRIVE}) that is there"
        raise InputError(f"{expected}, or a map in a folder that --maps names; got {shown(written)}")
    for ending in (_OPENDRIVE, SUMO):
        if name and _is_map(Path(maps) / f"{name}{ending}"):
            return Path(maps) / f"{name}{ending}"
    there = sorted(one.name for one in Path(maps).glob("*") if _is_map(one))
    what = suggest(f"{name}{_OPENDRIVE}", there) if there else f"it contains no {_OPENDRIVE} or {SUMO} file"
    raise InputError(f"there is no map {shown(name)} in {maps}; {what}")


def _is_map(path: Path) -> bool:
    """Whether a file is there and is a map, by its name."""
    return path.name.lower().endswith((_OPENDRIVE, SUMO)) and path.is_file()
