"""Networks that FogSim did not write, each with traffic on it, as SUMO configurations.

They come with packages: netgenerate and networks of SUMO's own games and examples with eclipse-sumo (which the tests
need), and, where it is installed, those of sumo-rl. Nothing of them is copied into this repository.
"""

import gzip
import importlib.util
import itertools
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

import numpy as np
import sumo

HOME = Path(sumo.SUMO_HOME)
GAMES = HOME / "tools" / "game"
RILSA = HOME / "tools" / "sumolib" / "scenario" / "scenarios" / "RiLSA1"

TYPES = {
    "car": 'vClass="passenger"',
    "van": 'vClass="delivery"',
    "truck": 'vClass="truck"',
    "bus": 'vClass="bus"',
    "motorcycle": 'vClass="motorcycle"',
    "bicycle": 'vClass="bicycle"',
    "tram": 'vClass="tram"',
}
ROAD_USERS = (*["car"] * 10, *["van"] * 2, *["truck"] * 2, "bus", "motorcycle", *["bicycle"] * 2)
"""Who is on the road, in turn."""


class Files(NamedTuple):
    """What a simulation is made of.

    Attributes
    ----------
    net : Path
        Network.
    routes, additional : tuple of Path
        Traffic, and what stands beside the road.
    begin : float
        When it begins [s].
    """

    net: Path
    routes: tuple[Path, ...]
    additional: tuple[Path, ...] = ()
    begin: float = 0.0


class Network(NamedTuple):
    """A network with traffic.

    Attributes
    ----------
    name, told : str
        Its name, and what it is.
    make : callable
        Gives the files; writes what there is to write into a folder, for a number of vehicles an hour and a time [s].
    """

    name: str
    told: str
    make: Callable[[Path, float, float], Files]


def generated(*options: str, pedestrians: bool = False) -> Callable[[Path, float, float], Files]:
    """A network by netgenerate, with mixed traffic from anywhere to anywhere."""

    def make(folder: Path, per_hour: float, seconds: float) -> Files:
        net = folder / "town.net.xml"
        walking = ["--sidewalks.guess", "--crossings.guess"] if pedestrians else []
        program = HOME / "bin" / "netgenerate"
        subprocess.run([program, *options, *walking, "--seed", "1", "-o", net], check=True, capture_output=True)
        return Files(net, (trips(folder, net, per_hour, seconds, pedestrians=pedestrians),))

    return make


def game(net: str, *routes: str, additional: Sequence[str] = (), begin: float = 0.0) -> Callable[..., Files]:
    """One of SUMO's games, with its own traffic."""

    def make(_folder: Path, _per_hour: float, _seconds: float) -> Files:
        return Files(
            GAMES / net, tuple(GAMES / name for name in routes), tuple(GAMES / name for name in additional), begin
        )

    return make


def mixed(net: Path, through: str = "") -> Callable[[Path, float, float], Files]:
    """A network with mixed traffic of ours, all of it through an edge if one is named."""

    def make(folder: Path, per_hour: float, seconds: float) -> Files:
        return Files(net, (trips(folder, net, per_hour, seconds, through=through),))

    return make


def sumo_rl(net: str, routes: str, begin: float = 0.0) -> Callable[..., Files]:
    """One of sumo-rl's networks, with its own traffic."""

    def make(_folder: Path, _per_hour: float, _seconds: float) -> Files:
        found = importlib.util.find_spec("sumo_rl")
        if found is None or not found.submodule_search_locations:
            raise ModuleNotFoundError("sumo_rl is not installed: pip install sumo-rl")
        home = Path(found.submodule_search_locations[0], "nets")
        return Files(home / net, (home / routes,), begin=begin)

    return make


_TOWN = ("--default.lanenumber", "2", "--default-junction-type", "traffic_light", "--default.speed", "13.89")
_A10 = [f"A10KW/osm.{kind}.rou.xml" for kind in ("passenger", "truck", "passenger_mw", "truck_mw")]

NETWORKS = (
    Network(
        "grid",
        "netgenerate: 5 × 5 junctions with lights, two lanes, pedestrians and their crossings",
        generated("--grid", "--grid.number", "5", "--grid.length", "150", *_TOWN, pedestrians=True),
    ),
    Network(
        "spider",
        "netgenerate: seven arms and four rings, lights",
        generated("--spider", "--spider.arm-number", "7", "--spider.circle-number", "4", *_TOWN),
    ),
    Network(
        "random",
        "netgenerate: random, some junctions with lights, the others by priority",
        generated("--rand", "--rand.iterations", "80", "--tls.guess", "--tls.guess.threshold", "40"),
    ),
    Network(
        "left_hand",
        "netgenerate: left-hand traffic, right-of-way by priority, two lanes",
        generated("--grid", "--grid.number", "4", "--lefthand", "--default.lanenumber", "2"),
    ),
    Network(
        "right_before_left",
        "netgenerate: a town where who comes from the right goes first",
        generated(
            "--grid", "--grid.number", "5", "--default.speed", "8.33", "--default-junction-type", "right_before_left"
        ),
    ),
    Network(
        "roundabout",
        "eclipse-sumo, A10KW: all traffic through the roundabout beside the motorway",
        mixed(GAMES / "A10KW" / "osm.net.xml", through="roundabout"),
    ),
    Network("rilsa", "eclipse-sumo, RiLSA1: the crossing of the German guidelines", mixed(RILSA / "rilsa1.net.xml")),
    Network(
        "rail",
        "eclipse-sumo, rail_demo: three trains, sixteen rail signals, stops",
        game("rail_demo/net.net.xml", "rail_demo/input_routes.rou.xml", additional=["rail_demo/stops.add.xml"]),
    ),
    Network(
        "motorway_junction",
        "eclipse-sumo, A10KW: motorway junction with trucks, from OpenStreetMap",
        game("A10KW/osm.net.xml", *_A10),
    ),
    Network(
        "crossing",
        "eclipse-sumo, fokr_bs_demo: a measured crossing with cars, trucks, bicycles and pedestrians",
        game(
            "fokr_bs_demo/fokr_bs.net.xml.gz",
            *[f"fokr_bs_demo/15_16_{who}" for who in ("bicycle.trips.xml", "ped.trips.xml", "veh.trips.xml.gz")],
            additional=["fokr_bs_demo/vtypes_default.add.xml", "fokr_bs_demo/signalPlan.add.xml"],
            begin=54_000.0,
        ),
    ),
    Network(
        "corridor",
        "eclipse-sumo, corridor: three junctions with lights in a row",
        game("corridor/corridor.net.xml", "corridor/corridor.rou.xml"),
    ),
    Network(
        "cologne",
        "sumo-rl, RESCO cologne1: a junction of Cologne at 7 o'clock",
        sumo_rl("RESCO/cologne1/cologne1.net.xml", "RESCO/cologne1/cologne1.rou.xml", begin=25_200.0),
    ),
    Network(
        "two_way",
        "sumo-rl: a single junction with lights",
        sumo_rl(
            "2way-single-intersection/single-intersection.net.xml",
            "2way-single-intersection/single-intersection-gen.rou.xml",
        ),
    ),
)


def trips(
    folder: Path, net: Path, per_hour: float, seconds: float, *, pedestrians: bool = False, through: str = ""
) -> Path:
    """Write traffic that drives from anywhere to anywhere; SUMO looks for the ways.

    Parameters
    ----------
    folder : Path
        Where to.
    net : Path
        The network.
    per_hour : float
        Vehicles an hour.
    seconds : float
        As long as they depart [s].
    pedestrians : bool
        Whether there are people on foot, too: one for each three vehicles.
    through : str
        ``roundabout`` for traffic that drives through the network's first one.
    """
    rng = np.random.default_rng(1)
    root = _root(net)
    usable, ring = _edges(root)
    rows = [f'<vType id="{name}" {told}/>' for name, told in TYPES.items()]
    users = [user for user in ROAD_USERS if usable[user]]
    for number, user in zip(range(int(per_hour * seconds / 3600.0)), itertools.cycle(users), strict=False):
        depart, edges = number * 3600.0 / per_hour, usable[user]
        start, end = (quoteattr(edges[place]) for place in rng.choice(len(edges), 2, replace=len(edges) < 2))
        # A bus halts for a while wherever its way ends.
        inner = f'<stop lane={quoteattr(_lane(root, end[1:-1]))} duration="20"/>' if user == "bus" else ""
        via = f" via={quoteattr(ring[number % len(ring)])}" if through else ""
        rows.append(
            f'<trip id="{user}{number}" type="{user}" depart="{depart:.1f}" from={start} to={end}{via}'
            f' departLane="best" departSpeed="max">{inner}</trip>'
        )
        if pedestrians and number % 3 == 0:
            rows.append(f'<person id="walker{number}" depart="{depart:.1f}"><walk from={start} to={end}/></person>')
    path = folder / "town.rou.xml"
    path.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    return path


def _root(net: Path) -> ET.Element:
    with gzip.open(net) if net.suffix == ".gz" else net.open("rb") as file:
        return ET.parse(file).getroot()  # noqa: S314 - a file of an installed package, or made here


def _edges(root: ET.Element) -> tuple[dict[str, list[str]], list[str]]:
    """Edges on which each type may drive, and those of the first roundabout."""
    usable: dict[str, list[str]] = {name: [] for name in TYPES}
    classes = {name: told.split('"')[1] for name, told in TYPES.items()}
    for edge in root.iterfind("edge"):
        if edge.get("function"):
            continue
        for name, vehicle_class in classes.items():
            if any(_admits(lane, vehicle_class) for lane in edge.iterfind("lane")):
                usable[name].append(edge.get("id", ""))
    ring = root.find("roundabout")
    return usable, [] if ring is None else ring.get("edges", "").split()


def _admits(lane: ET.Element, vehicle_class: str) -> bool:
    allowed, barred = lane.get("allow"), lane.get("disallow", "")
    return vehicle_class in allowed.split() if allowed else vehicle_class not in barred.split() and barred != "all"


def _lane(root: ET.Element, edge: str) -> str:
    """A lane of an edge on which a bus may stop."""
    found = next(found for found in root.iterfind("edge") if found.get("id") == edge)
    return next(lane.get("id", "") for lane in found.iterfind("lane") if _admits(lane, "bus"))


def write_configuration(folder: Path, files: Files, fcd: str) -> Path:
    """A configuration that also writes where everybody is in each second, in full precision.

    Parameters
    ----------
    folder : Path
        Where to.
    files : Files
        What the simulation is made of.
    fcd : str
        Name of that file.
    """
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
