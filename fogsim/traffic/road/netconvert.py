"""SUMO's netconvert, which converts OpenDRIVE files to networks: a program of the package eclipse-sumo."""

import contextlib
import importlib.util
import itertools
import math
import os
import re
import resource
import shutil
import subprocess
import tempfile
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree

from fogsim.core.files.readers import number_in_text, read_text
from fogsim.core.files.user_cache import kept_text
from fogsim.errors import InputError, MissingDependencyError, shown
from fogsim.traffic.road.opendrive import is_opendrive, read_opendrive

_USUAL_LIMIT = 130.0 / 3.6
"""Speed limit of lanes for which the OpenDRIVE file has none [m/s]."""

_TYPES = ("driving", "entry", "exit", "onRamp", "offRamp", "mwyEntry", "mwyExit", "connectingRamp", "slipLane")
"""Types of OpenDRIVE lanes for vehicles; other lanes are not in the network."""

_SIGNAL = {"id": "none", "type": "none", "orientation": "none", "dynamic": "no"}
"""Attributes without which netconvert reads no signal, and what they are when they say nothing."""

_NEAR = 0.1  # Distance from a section's ends at which limits begin there [m]
_SAME_ARC = 1e-3  # Change of curvature times a spiral's length squared; 0.1 mm at most off an arc [m]
_LONGEST_RUN = 300.0  # [s]
_MOST_MEMORY, _MOST_BYTES = 4 * 2**30, 2**28  # of the program; of its network [bytes]
_MOST_SHOWN = 1000  # of its last messages [bytes]
_COMMENT = re.compile(r"<!--.*?-->\s*", re.DOTALL)


def _netconvert_program() -> str:
    """Path of netconvert; MissingDependencyError if it is missing."""
    package = importlib.util.find_spec("sumo")
    folders = [Path(place) / "bin" for place in (package.submodule_search_locations or ())] if package else []
    found = shutil.which("netconvert") or next(
        (path for folder in folders if (path := shutil.which("netconvert", path=str(folder)))), None
    )
    if found is None:
        raise MissingDependencyError(
            "roads of OpenDRIVE files need SUMO's netconvert, which is not there; pip install 'fogsim[xodr]' brings it"
        )
    return found


def _netconvert_recipe(*, with_oncoming: bool = False) -> bytes:
    """What a network depends on in addition to its OpenDRIVE file: the program and its arguments."""
    program = Path(_netconvert_program())
    return f"{program}\0{program.stat().st_mtime_ns}\0{with_oncoming}\0".encode() + Path(__file__).read_bytes()


def map_net(path: Path, *, with_oncoming: bool) -> str:
    """Text of the SUMO network of a map; see `opendrive_net`."""
    if not is_opendrive(path):
        return read_text(path, _MOST_BYTES)
    recipe = _netconvert_recipe(with_oncoming=with_oncoming)
    return kept_text("opendrive", path, recipe, lambda: opendrive_net(path, with_oncoming=with_oncoming))


def opendrive_net(path: Path, *, with_oncoming: bool = False) -> str:
    """Text of the SUMO network of an OpenDRIVE file, in the file's coordinates.

    Its lanes have the parameter ``origId``, OpenDRIVE's road and lane. In a network `with_oncoming` lanes to overtake
    on, both directions of a road count its length alike, also in bends.
    """
    program = _netconvert_program()
    source = read_opendrive(path)
    for road in source.iter("road"):
        if road.get("rule") == "LHT":
            where = f"{path}: road {shown(road.get('id', '?'))}"
            raise InputError(f'{where}: rule="LHT": expected right-hand traffic (RHT); lanes on the left are not read')
    with tempfile.TemporaryDirectory() as folder:
        types, net = Path(folder) / "types.typ.xml", Path(folder) / "road.net.xml"
        roads = Path(folder) / "road.xodr"
        ElementTree(_readable(source, path)).write(roads, encoding="utf-8")
        lines = [f'<type id="{name}" priority="1" speed="{_USUAL_LIMIT:.3f}" width="3.65"/>' for name in _TYPES]
        types.write_text(f"<types>{''.join(lines)}</types>", encoding="utf-8")
        command = [program, "--opendrive-files", str(roads), "-o", str(net), "-t", str(types)]
        command += ["--output.original-names", "--offset.disable-normalization", "--opendrive.curve-resolution", "1"]
        command += ["--no-turnarounds", "--precision", "3", "--xml-validation", "never"]
        # Speeds in bends are the file's.
        command += ["--junctions.limit-turn-speed", "-1"]
        command += ["--opposites.guess", "true"] if with_oncoming else []
        reported = _run(command, path, Path(folder))
        if reported or not net.is_file():
            raise InputError(
                f"{path}: no OpenDRIVE road network that SUMO's netconvert can read: {reported or 'no output'}"
            )
        # A comment at the top has the time of the conversion.
        return _COMMENT.sub("", read_text(net, _MOST_BYTES))


def _readable(source: Element, path: Path) -> Element:
    """The file without attributes and limits that say nothing, which stop netconvert, and with limits on all lanes."""
    for element in source.iter():
        for key in [key for key, text in element.attrib.items() if not text.strip()]:
            del element.attrib[key]
        for key, text in _SIGNAL.items() if element.tag == "signal" else ():
            element.attrib.setdefault(key, text)
        for speed in element.findall("speed") if element.tag == "lane" else ():
            if not _limit(speed):
                element.remove(speed)
    for road in source.iter("road"):
        _limit_lanes(road, f"{path}: road {shown(road.get('id', '?'))}")
    for geometry in source.iter("geometry"):
        for spiral in geometry.findall("spiral"):
            _straighten(spiral, geometry)
    return source


def _straighten(spiral: Element, geometry: Element) -> None:
    """Make a spiral whose curvature hardly changes an arc: netconvert loses its way on it, and may never end."""
    # What is no number is netconvert's to report.
    with contextlib.suppress(KeyError, ValueError):
        begin, end = (float(spiral.attrib[key]) for key in ("curvStart", "curvEnd"))
        if abs(end - begin) * float(geometry.attrib["length"]) ** 2 < _SAME_ARC:
            spiral.tag, spiral.attrib = "arc", {"curvature": repr(0.5 * (begin + end))}


def _limit_lanes(road: Element, where: str) -> None:
    """Give a road's speed limits to its lanes without limits of their own; netconvert reads no others."""

    def begin(one: Element) -> float:
        return number_in_text(f"{where}: <{one.tag}>", "s", one.get("s", "0"))

    limits = [(begin(one), _limit(one.find("speed"))) for one in road.iterfind("type")]
    limits = [next(same) for _, same in itertools.groupby(limits, key=lambda one: one[1])]
    sections = list(road.iterfind("lanes/laneSection"))
    for section, (first, end) in zip(sections, itertools.pairwise((*map(begin, sections), math.inf)), strict=True):
        before = [limit for s, limit in limits if s <= first + _NEAR]
        inside = ((s - first, limit) for s, limit in limits if first + _NEAR < s < end - _NEAR)
        here = [(0.0, before[-1] if before else {}), *inside]
        for lane in section.iterfind("*/lane") if any(limit for _, limit in here) else ():
            if lane.find("speed") is None:
                usual = {"max": f"{_USUAL_LIMIT:.3f}", "unit": "m/s"}
                lane.extend(Element("speed", {"sOffset": f"{s:g}", **(limit or usual)}) for s, limit in here)


def _limit(speed: Element | None) -> dict[str, str]:
    """Attributes of a speed limit; none without one, as in ``no limit``."""
    with contextlib.suppress(ValueError):
        if speed is not None and 0.0 < float(speed.get("max", "")) < math.inf:
            return {key: speed.attrib[key] for key in ("max", "unit") if key in speed.attrib}
    return {}


def _run(command: list[str], path: Path, folder: Path) -> str:
    """Run netconvert with limited time, memory and output; return its report if it failed."""
    messages = folder / "messages.txt"
    # Its OpenBLAS would otherwise reserve address space for each processor.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    with (
        messages.open("wb") as sink,
        subprocess.Popen(command, stdout=sink, stderr=sink, env=environment) as process,  # noqa: S603
    ):
        limits = ((resource.RLIMIT_AS, _MOST_MEMORY), (resource.RLIMIT_FSIZE, _MOST_BYTES), (resource.RLIMIT_CORE, 0))
        for limit, most in limits:
            resource.prlimit(process.pid, limit, (most, most))
        try:
            code = process.wait(_LONGEST_RUN)
        except subprocess.TimeoutExpired as error:
            raise InputError(f"{path}: netconvert has not read it within {_LONGEST_RUN:g} s") from error
        finally:
            process.kill()
    if not code:
        return ""
    with messages.open("rb") as file:
        file.seek(max(file.seek(0, 2) - _MOST_SHOWN, 0))
        reported = " ".join(file.read().decode(errors="replace").split())
    allowed = f"at most {_MOST_MEMORY >> 30} GiB of memory and {_MOST_BYTES >> 20} MiB of output"
    return f"{reported} (it ended with {code}; {allowed})".strip()
