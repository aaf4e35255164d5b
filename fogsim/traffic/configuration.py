"""What a SUMO configuration file names, without starting SUMO."""

from pathlib import Path
from xml.etree import ElementTree as ET

from fogsim.errors import InputError

_NET = ("net-file", "net", "n")
_ADDITIONAL = ("additional-files", "additional", "a")
_FURTHER = ("route-files", "routes", "r", "weight-files", "weights", "w", "lane-weight-files", "load-state")


def configured_files(config: Path) -> tuple[Path, tuple[Path, ...]]:
    """Network and additional files of a SUMO configuration.

    Parameters
    ----------
    config : Path
        The ``.sumocfg`` file; names in it are relative to its folder.

    Raises
    ------
    InputError
        If it is no SUMO configuration or names no network.
    """
    root = _root(config)
    nets = _named(config, root, _NET)
    if not nets:
        raise InputError(f'{config}: the SUMO configuration names no network (<net-file value="…"/>)')
    return nets[0], _named(config, root, _ADDITIONAL)


def input_files(config: Path) -> tuple[Path, ...]:
    """Every file that a SUMO configuration has the simulation read: network, routes, additional, weights, state.

    Parameters
    ----------
    config : Path
        The ``.sumocfg`` file; names in it are relative to its folder.

    Raises
    ------
    InputError
        If it is no SUMO configuration.
    """
    return _named(config, _root(config), (*_NET, *_ADDITIONAL, *_FURTHER))


def _root(config: Path) -> ET.Element:
    try:
        return ET.parse(config).getroot()  # noqa: S314 - the user's own file; expat fetches nothing
    except (OSError, ET.ParseError) as error:
        raise InputError(f"{config}: not a SUMO configuration: {error}") from error


def _named(config: Path, root: ET.Element, options: tuple[str, ...]) -> tuple[Path, ...]:
    values = [element.get("value", "") for element in root.iter() if element.tag in options]
    names = [name.strip() for value in values for name in value.split(",")]
    return tuple(config.parent / name for name in names if name)
