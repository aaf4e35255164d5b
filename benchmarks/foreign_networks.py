"""Networks that FogSim did not write, each with traffic on it, as SUMO configurations.

They come with eclipse-sumo, which the tests need: netgenerate, and networks of SUMO's own games and examples.
"""

import itertools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
import sumo
import sumolib

HOME = Path(sumo.SUMO_HOME)
GAMES = HOME / "tools" / "game"
RILSA = HOME / "tools" / "sumolib" / "scenario" / "scenarios" / "RiLSA1"

CLASSES = {
    "car": "passenger",
    "van": "delivery",
    "truck": "truck",
    "bus": "bus",
    "motorcycle": "motorcycle",
    "bicycle": "bicycle",
    "tram": "tram",
}
ROAD_USERS = (*["car"] * 10, *["van"] * 2, *["truck"] * 2, "bus", "motorcycle", *["bicycle"] * 2)
"""Who is on the road, in turn."""


class Files(NamedTuple):
    """A simulation: network, traffic, what stands next to the road, and when it begins [s]."""

    net: Path
    routes: tuple[Path, ...]
    additional: tuple[Path, ...] = ()
    begin: float = 0.0


Make = Callable[[Path, float, float], Files]
"""Gives the files of a simulation, some of them written into a folder, for vehicles an hour and a time [s]."""


def generated(*options: str, pedestrians: bool = False) -> Make:
    """A network by netgenerate, with mixed traffic from anywhere to anywhere."""

    def make(folder: Path, per_hour: float, seconds: float) -> Files:
        walking = ["--sidewalks.guess", "--crossings.guess"] if pedestrians else []
        _run("netgenerate", *options, *walking, "--seed", "1", "-o", net := folder / "town.net.xml")
        return Files(net, (trips(folder, net, per_hour, seconds, pedestrians=pedestrians),))

    return make


def mixed(net: Path, *, roundabout: bool = False) -> Make:
    """A network with mixed traffic of ours, all of it through its first roundabout if asked."""
    return lambda folder, *demand: Files(net, (trips(folder, net, *demand, roundabout=roundabout),))


def game(folder: str, net: str, routes: str, additional: str = "", begin: float = 0.0) -> Make:
    """One of SUMO's games, with its own traffic."""
    home = GAMES / folder
    files = (tuple(home / name for name in names.split()) for names in (routes, additional))
    found = Files(home / net, *files, begin)
    return lambda *_: found


_TOWN = ("--default.lanenumber", "2", "--default-junction-type", "traffic_light", "--default.speed", "13.89")
_SLOW = ("--default.speed", "8.33", "--default-junction-type", "right_before_left")

NETWORKS: dict[str, Make] = {
    "grid": generated("--grid", "--grid.number", "5", "--grid.length", "150", *_TOWN, pedestrians=True),
    "spider": generated("--spider", "--spider.arm-number", "7", "--spider.circle-number", "4", *_TOWN),
    "random": generated("--rand", "--rand.iterations", "80", "--tls.guess", "--tls.guess.threshold", "40"),
    "left_hand": generated("--grid", "--grid.number", "4", "--lefthand", "--default.lanenumber", "2"),
    "right_before_left": generated("--grid", "--grid.number", "5", *_SLOW),
    "roundabout": mixed(GAMES / "A10KW" / "osm.net.xml", roundabout=True),
    # The crossing of the German guidelines.
    "rilsa": mixed(RILSA / "rilsa1.net.xml"),
    # Three trains, sixteen rail signals, stops.
    "rail": game("rail_demo", "net.net.xml", "input_routes.rou.xml", "stops.add.xml"),
    "motorway_junction": game(
        "A10KW", "osm.net.xml", "osm.passenger.rou.xml osm.truck.rou.xml osm.passenger_mw.rou.xml osm.truck_mw.rou.xml"
    ),
    # A measured crossing with cars, trucks, bicycles and pedestrians.
    "crossing": game(
        "fokr_bs_demo",
        "fokr_bs.net.xml.gz",
        "15_16_bicycle.trips.xml 15_16_ped.trips.xml 15_16_veh.trips.xml.gz",
        "vtypes_default.add.xml signalPlan.add.xml",
        begin=54_000.0,
    ),
    # Three junctions with lights in a row.
    "corridor": game("corridor", "corridor.net.xml", "corridor.rou.xml"),
}


def trips(
    folder: Path, net: Path, per_hour: float, seconds: float, *, pedestrians: bool = False, roundabout: bool = False
) -> Path:
    """Write traffic from anywhere to anywhere, and a person on foot for three vehicles; SUMO looks for the ways."""
    rng, roads = np.random.default_rng(1), sumolib.net.readNet(str(net))
    usable = {name: [edge for edge in roads.getEdges() if edge.allows(kind)] for name, kind in CLASSES.items()}
    ring = roads.getRoundabouts()[0].getEdges() if roundabout else []
    rows = [f'<vType id="{name}" vClass="{kind}"/>' for name, kind in CLASSES.items()]
    users = [user for user in ROAD_USERS if usable[user]]
    for number, user in zip(range(int(per_hour * seconds / 3600.0)), itertools.cycle(users), strict=False):
        depart, edges = number * 3600.0 / per_hour, usable[user]
        first, last = (edges[place] for place in rng.choice(len(edges), 2, replace=len(edges) < 2))
        start, end = quoteattr(first.getID()), quoteattr(last.getID())
        # A bus halts for a while wherever its way ends.
        stops = [lane.getID() for lane in last.getLanes() if lane.allows("bus")] if user == "bus" else []
        inner = f'<stop lane={quoteattr(stops[0])} duration="20"/>' if stops else ""
        via = f" via={quoteattr(ring[number % len(ring)])}" if ring else ""
        rows.append(
            f'<trip id="{user}{number}" type="{user}" depart="{depart:.1f}" from={start} to={end}{via}'
            f' departLane="best" departSpeed="max">{inner}</trip>'
        )
        if pedestrians and number % 3 == 0:
            rows.append(f'<person id="walker{number}" depart="{depart:.1f}"><walk from={start} to={end}/></person>')
    path = folder / "town.rou.xml"
    path.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    return path


def write_configuration(folder: Path, files: Files, fcd: str) -> Path:
    """A configuration that also writes where everyone is in each second, in full precision, to a file of a name."""
    options = {
        "net-file": files.net,
        "route-files": ",".join(map(str, files.routes)),
        "additional-files": ",".join(map(str, files.additional)),
        "begin": files.begin,
        "fcd-output": fcd,
        "fcd-output.acceleration": "true",
        "device.fcd.period": 1,
        "precision": 12,
        "ignore-route-errors": "true",
        "xml-validation": "never",
    }
    rows = "".join(f"<{key} value={quoteattr(str(value))}/>" for key, value in options.items() if str(value))
    path = folder / "town.sumocfg"
    path.write_text(f"<configuration><input>{rows}</input></configuration>", encoding="utf-8")
    return path


def _run(program: str, *arguments: object) -> None:
    command = [str(HOME / "bin" / program), *map(str, arguments)]
    done = subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{program} failed: {done.stderr}")
