"""Contents of a SUMO configuration file, read without SUMO, and its options that FogSim overrides."""

import functools
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from fogsim.core.files.xml_reader import read_elements, read_tree, root_tag
from fogsim.errors import InputError
from fogsim.traffic.road.unsafe_outputs import check_outputs, expanded, read_name, unsafe_option

_FIRST_ELEMENTS: Mapping[str, tuple[str, ...]] = {
    "config": ("configuration", "sumoConfiguration"),
    "net": ("net",),
    "routes": ("routes", "additional", "trips"),
    "additional": ("additional", "routes", "OpenDRIVE"),
}
"""Usual first elements of SUMO's files by their use; SUMO also reads files with others, except for networks."""

_OTHER_FILES = {*itertools.chain(*_FIRST_ELEMENTS.values()), "OpenSCENARIO", "gpx", "kml", "osm", "html", "svg"}
"""First elements of files of other types."""

NO_LANES = "vehicles of a mesoscopic simulation have no positions in lanes, so no camera can see them; leave it out"
"""Why a mesoscopic simulation is refused."""

_TRUE = ("true", "1", "yes", "on", "x", "t")  # SUMO's words
_FALSE = ("false", "0", "no", "off", "-", "f")
_NET = ("net-file", "net", "n")
_ADDITIONAL = ("additional-files", "additional", "a")
_ROUTES = ("route-files", "routes", "r")
_FURTHER = (
    *(*_ROUTES, "weight-files", "weights", "w", "lane-weight-files", "load-state"),
    *("device.fcd-replay.files", "device.fcd-replay.file", "astar.all-distances", "astar.landmark-distances"),
)
_SELDOM = (
    *("gui-settings-file", "g", "alternative-net-file", "N", "edgedata-files", "data-files", "m", "selection-file"),
    "device.ssm.filter-edges.input-file",
)
"""Files that do not decide a run; SUMO does not start if some of them are missing."""
_MOST_BYTES = 50_000_000  # of a file that may name others
_OPENING = ("load-state", "scale")
_REROUTING = "device.rerouting"
_SEPARATORS = re.compile(r"[,;\s]+")


@dataclass(frozen=True, slots=True)
class _UnsupportedOption:
    """An option that FogSim fixes: its names, value, equivalent values, and the reason."""

    names: tuple[str, ...]
    value: str
    equivalents: tuple[str, ...]
    reason: str


_UNSUPPORTED = (
    _UnsupportedOption(
        ("remote-port",), "0", ("",), "SUMO would listen on that port of all interfaces, and wait for a client for ever"
    ),
    _UnsupportedOption(("random", "abs-rand"), "false", ("", *_FALSE), "a run must depend on its seed alone"),
    *(
        _UnsupportedOption(names, "never", ("",), "SUMO would fetch schemas from the addresses that files name")
        for names in (("xml-validation", "X"), ("xml-validation.net",), ("xml-validation.routes",))
    ),
)

OVERRIDES = tuple(argument for option in _UNSUPPORTED for argument in (f"--{option.names[0]}", option.value))
"""SUMO arguments that override unsupported options of a configuration."""


def is_true(text: str) -> bool:
    """Whether a SUMO boolean is true."""
    return text.lower() in _TRUE


def check_sumo_file(kind: str, path: Path) -> None:
    """Raise InputError unless a file's first element fits "config", "net", "routes" or "additional"."""
    tag, usual = root_tag(path), _FIRST_ELEMENTS[kind]
    if tag not in usual and (kind == "net" or tag in _OTHER_FILES):
        raise InputError(f"{path}: expected <{usual[0]}> at its top, got <{tag[:40]}>")


def check_configured_files(config: Path) -> None:
    """Check the network, route and additional files of a SUMO configuration with `check_sumo_file`.

    A mesoscopic simulation and outputs outside the run's folder are refused. The first elements of files whose names
    have variables, or separators that only SUMO knows, are not checked.
    """
    configured_files(config)
    root = _root(config)
    if any(is_true(value) for value in _values(root, ("mesosim",))):
        raise InputError(f"{config}: mesosim: {NO_LANES}")
    for option, value in ((element.tag, value) for element in root.iter() for value in _written(element)):
        reason = unsafe_option(option, value)
        if reason is not None:
            raise InputError(f"{config}: {option}: {reason}; leave it out")
    for kind, options in (("net", _NET), ("routes", _ROUTES), ("additional", _ADDITIONAL)):
        for path in _named(config, root, options):
            if not set(str(path).removeprefix(str(config.parent))).intersection("$; "):
                check_sumo_file(kind, path)
    texts = [expanded(value) for value in _values(root, (*_NET, *_ADDITIONAL, *_FURTHER))]
    check_outputs(config.parent / name for text in texts for name in (*text.split(","), *_SEPARATORS.split(text)))


def configured_files(config: Path) -> tuple[Path, tuple[Path, ...]]:
    """Network and additional files of a ``.sumocfg`` file; names in it are relative to its folder."""
    root = _root(config)
    nets = _named(config, root, _NET)
    if not nets:
        raise InputError(f'{config}: the SUMO configuration names no network (<net-file value="…"/>)')
    return nets[0], _named(config, root, _ADDITIONAL)


@dataclass(frozen=True, slots=True)
class _ConfiguredDemand:
    """Sources of a SUMO configuration's vehicles: additional and route files, in SUMO's order.

    `is_open` if other vehicles may come, from a saved state or a scaled demand; `reroutes` if vehicles may leave their
    written routes.
    """

    files: tuple[Path, ...]
    is_open: bool
    reroutes: bool


def configured_demand(config: Path) -> _ConfiguredDemand:
    """Sources of a SUMO configuration's vehicles."""
    root = _root(config)
    return _ConfiguredDemand(
        files=(*_named(config, root, _ADDITIONAL), *_named(config, root, _ROUTES)),
        is_open=any(_values(root, _OPENING)),
        reroutes=any(element.tag.startswith(_REROUTING) for element in root.iter()),
    )


def ignored_options(config: Path, step_length: float) -> tuple[str, ...]:
    """Options of a SUMO configuration that a run of a step length [s] overrides, each with the reason."""
    root = _root(config)
    lengths = [
        value for value in _values(root, ("step-length",)) if value not in (repr(step_length), f"{step_length:g}")
    ]
    return (
        *(f"step-length={value} is left out: clocks.traffic_step_s is {step_length:g}" for value in lengths),
        *_unsupported(root),
    )


def _unsupported(root: Element) -> Iterator[str]:
    return (
        f"{option.names[0]}={value} is left out: {option.reason}"
        for option in _UNSUPPORTED
        for value in _values(root, option.names)
        if value.lower() not in (option.value, *option.equivalents)
    )


def configured_prefix(config: Path) -> str:
    """Prefix of the names of a SUMO configuration's outputs."""
    return next(_values(_root(config), ("output-prefix",)), "")


def is_configured(config: Path, option: str) -> bool:
    """Whether a SUMO configuration sets an option."""
    return any(_values(_root(config), (option,)))


def configured_inputs(config: Path) -> tuple[Path, ...]:
    """Every file that a SUMO configuration makes SUMO read: network, routes, additional, weights, state."""
    return _named(config, _root(config), (*_NET, *_ADDITIONAL, *_FURTHER))


def seldom_files(config: Path) -> tuple[Path, ...]:
    """Further files that a SUMO configuration names, such as settings of its window, as far as they are there."""
    return tuple(path for path in _named(config, _root(config), _SELDOM) if path.is_file())


def included_files(files: Iterable[Path]) -> tuple[Path, ...]:
    """Files that route and additional files name for SUMO to read, and those that these name in turn."""
    found = list(files)
    given = len(found)
    for path in found:
        if path.is_file():
            found += [name for name in _names_in(path, path.stat().st_mtime_ns) if name not in found]
    return tuple(found[given:])


@functools.lru_cache
def _names_in(path: Path, _: int) -> tuple[Path, ...]:
    """Files that a file names for SUMO to read, read again after the file has changed."""
    reader = _FileNames(path.parent)
    read_elements(path, reader, _MOST_BYTES)
    return tuple(dict.fromkeys(reader.found))


class _FileNames:
    is_done = False

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.found: list[Path] = []

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        name = read_name(tag, attributes)
        if name:
            self.found.append(self._folder / name)

    def end(self, tag: str) -> None:
        pass


def _root(config: Path) -> Element:
    check_sumo_file("config", config)
    return read_tree(config)


def _values(root: Element, options: tuple[str, ...]) -> Iterator[str]:
    """Values of an option."""
    return (value for element in root.iter() if element.tag in options for value in _written(element))


def _written(element: Element) -> Iterator[str]:
    """Values of an option's element: SUMO reads two attributes and the text."""
    values = ((text or "").strip() for text in (element.get("value"), element.get("v"), element.text))
    return (value for value in values if value)


def _named(config: Path, root: Element, options: tuple[str, ...]) -> tuple[Path, ...]:
    names = [name.strip() for value in _values(root, options) for name in value.split(",")]
    return tuple(config.parent / name for name in names if name)
