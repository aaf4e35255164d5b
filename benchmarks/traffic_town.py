"""The town of `traffic.py`: a grid by netgenerate, half of its junctions with lights, where everyone keeps driving."""

import importlib.util
import math
import subprocess
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

BLOCK = 150.0
"""Distance of neighbouring junctions [m]."""

PER_BLOCK = 2.5
"""Vehicles a street between two junctions, both ways together: as many as flow."""

WAY = 25
"""Streets on a vehicle's way, more than it comes through in the time of a round."""

STRAIGHT_ON = 0.7
"""Share of junctions that vehicles cross straight on [-]."""

TYPES = ("passenger", "passenger", "passenger", "passenger", "delivery", "truck", "bus", "motorcycle")
"""Classes of vehicles, in turn."""


def town_configuration(folder: Path, vehicles: int) -> Path:
    """Town and vehicles as a configuration of SUMO's, whose other options stay SUMO's defaults."""
    # n × n junctions have 2 n (n − 1) streets.
    side = max(3, math.ceil(0.5 + math.sqrt(0.25 + vehicles / (2.0 * PER_BLOCK))))
    net = _make_net(folder, side)
    _write_routes(folder / "town.rou.xml", net, vehicles)
    path = folder / "town.sumocfg"
    path.write_text(
        '<configuration><input><net-file value="town.net.xml"/><route-files value="town.rou.xml"/></input>'
        "</configuration>",
        encoding="utf-8",
    )
    return path


def _make_net(folder: Path, side: int) -> Path:
    """A grid in which every second junction has lights, and at the others vehicles give way."""
    bare, net = folder / "bare.net.xml", folder / "town.net.xml"
    grid = ["--grid", "--grid.number", str(side), "--grid.length", str(BLOCK), "--seed", "1"]
    streets = ["--default-junction-type", "priority", "--default.lanenumber", "2", "--default.speed", "13.89"]
    _run("netgenerate", *grid, *streets, "-o", bare)
    junctions = [j.get("id", "") for j in _root(bare).iterfind("junction") if j.get("type") != "internal"]
    _run("netconvert", "-s", bare, "--tls.set", ",".join(junctions[::2]), "--tls.green.time", "20", "-o", net)
    return net


def has_programs() -> bool:
    """Whether SUMO's netgenerate and netconvert are installed: eclipse-sumo brings them, libsumo does not."""
    return importlib.util.find_spec("sumo") is not None


def _run(program: str, *arguments: object) -> None:
    import sumo  # noqa: PLC0415 - FogSim needs libsumo alone

    command = [Path(sumo.SUMO_HOME, "bin", program), *map(str, arguments)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def _root(net: Path) -> ET.Element:
    return ET.parse(net).getroot()  # noqa: S314 - made here


def _write_routes(path: Path, net: Path, vehicles: int) -> None:
    """Each vehicle wanders through the town from a street of its own on; the ego begins in the middle."""
    rng, following = np.random.default_rng(1), _following(net)
    streets = sorted(following)
    starts = [streets[n] for n in rng.permutation(len(streets))]
    rows = [f'<vType id="{name}" vClass="{name}" speedFactor="normc(1,0.1,0.8,1.2)"/>' for name in sorted(set(TYPES))]
    for number in range(vehicles):
        way = [_middle(streets) if number == 0 else starts[number % len(starts)]]
        while len(way) < WAY:
            ahead, *turns = following[way[-1]]
            way.append(ahead if not turns or rng.random() < STRAIGHT_ON else str(rng.choice(turns)))
        name = "ego" if number == 0 else f"v{number}"
        rows.append(
            f'<vehicle id="{name}" type="{TYPES[number % len(TYPES)]}" depart="0" departPos="random_free" '
            f'departLane="random" departSpeed="max"><route edges="{" ".join(way)}"/></vehicle>'
        )
    path.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")


def _middle(streets: list[str]) -> str:
    return streets[len(streets) // 2]


def _following(net: Path) -> dict[str, list[str]]:
    """Streets that follow each, the one straight on first; no one turns round."""
    root = _root(net)
    ends = {e.get("id", ""): (e.get("from"), e.get("to")) for e in root.iterfind("edge") if not e.get("function")}
    following: dict[str, list[str]] = {name: [] for name in ends}
    for joint in root.iterfind("connection"):
        here, there = joint.get("from", ""), joint.get("to", "")
        if here in ends and ends[here] != ends[there][::-1] and there not in following[here]:
            following[here].insert(0 if joint.get("dir") == "s" else len(following[here]), there)
    return following
