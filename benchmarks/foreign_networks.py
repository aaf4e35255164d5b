"""Networks that FogSim did not write, each with traffic on it, as SUMO configurations; and a large one, timed.

They come with packages: netgenerate and networks of SUMO's own games and examples with eclipse-sumo (which the tests
need), and, where it is installed, those of sumo-rl. Nothing of them is copied into this repository.

    python benchmarks/foreign_networks.py [--json] [--blocks 30] [--per-hour 3000] [--seconds 3600]
        [--sumocfg FILE --ego any] [--step 0.5] [--visibility 100] [--renderer cpu] [--sublane 0.3]

runs a large scenario: a town by netgenerate (``--blocks`` 30: 10,000 lanes for cars and people) with routes by
duarouter, parked cars, taxis and their passengers, people on foot and a railway in SUMO's sublane model; or one of your
own (``--sumocfg``). First SUMO alone, then FogSim with an ego and its camera of 160 × 120 px once a second. Printed are
the simulated time, seconds of the clock and of the processor, and the memory that each process had at most.
"""

import argparse
import gzip
import importlib.util
import itertools
import json
import multiprocessing
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

import numpy as np
import sumo

import fogsim
from fogsim.scenario import scenario_from_config
from fogsim.scenario.loading import clock_settings

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
        Traffic, and what stands next to the road.
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
    name, description : str
        Its name, and what it is.
    make : callable
        Gives the files; writes what there is to write into a folder, for a number of vehicles an hour and a time [s].
    """

    name: str
    description: str
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
    rows = [f'<vType id="{name}" {attributes}/>' for name, attributes in TYPES.items()]
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
    classes = {name: attributes.split('"')[1] for name, attributes in TYPES.items()}
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
    """A configuration that also writes where everyone is in each second, in full precision.

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


class Size(NamedTuple):
    """Size of the large scenario: blocks along a side of the town, vehicles an hour, seconds, sublane width [m]."""

    blocks: int
    per_hour: float
    seconds: float
    sublane: float


_TRIP = '<trip id="{id}" type="{kind}" depart="{depart:.1f}" from="{start}" to="{end}"{more}>{inner}</trip>'
_TYPES = """<vType id="car"/><vType id="truck" vClass="truck"/><vType id="motorcycle" vClass="motorcycle"/>
<vType id="taxi" vClass="taxi"><param key="has.taxi.device" value="true"/></vType>"""
_TOUR = 60  # places to which the vehicle drives that stays for the whole time


def large_town(folder: Path, size: Size) -> Path:
    """Build the large scenario in a folder; gives its configuration."""
    net, side = folder / "town.net.xml", 120.0 * size.blocks
    grid = ("--grid", "--grid.number", str(size.blocks), "--grid.length", "120", *_TOWN)
    _run("netgenerate", *grid, "--sidewalks.guess", "--crossings.guess", "--seed", "1", "-o", folder / "roads.net.xml")
    _write(
        folder / "rail.nod.xml", "nodes", (f'<node id="rail{n}" x="{n * 0.5 * side:.1f}" y="-200"/>' for n in (0, 1, 2))
    )
    rails = (f'<edge id="track{n}" from="rail{n}" to="rail{n + 1}" speed="40" allow="rail"/>' for n in (0, 1))
    _write(folder / "rail.edg.xml", "edges", rails)
    plain = ("-n", folder / "rail.nod.xml", "-e", folder / "rail.edg.xml")
    _run("netconvert", "-s", folder / "roads.net.xml", *plain, "-o", net)
    edges = sorted(_edges(_root(net))[0]["car"])
    areas = edges[:: max(1, len(edges) // 200)]
    area = '<parkingArea id="{0}" lane="{0}_1" startPos="30" endPos="80" roadsideCapacity="8"/>'
    _write(folder / "parking.add.xml", "additional", (area.format(edge) for edge in areas))
    rng = np.random.default_rng(1)
    trips = [_TYPES, *_trips(rng, edges, areas, size)]
    _write(folder / "town.trips.xml", "routes", trips)
    found = ("-a", folder / "parking.add.xml", "-r", folder / "town.trips.xml", "-o", folder / "town.rou.xml")
    _run("duarouter", "-n", net, *found, "--ignore-errors", "--seed", "1")
    _write(folder / "street.rou.xml", "routes", _people_and_trains(rng, edges, size))
    values = {
        "net-file": net.name,
        "route-files": "town.rou.xml,street.rou.xml",
        "additional-files": "parking.add.xml",
        "end": size.seconds,
        "lateral-resolution": size.sublane,
        "ignore-route-errors": "true",
        "device.taxi.dispatch-period": 10,
    }
    _write(folder / "town.sumocfg", "configuration", (f'<{key} value="{value}"/>' for key, value in values.items()))
    return folder / "town.sumocfg"


def _trips(rng: np.random.Generator, edges: Sequence[str], areas: Sequence[str], size: Size) -> list[str]:
    """Vehicles in the order of their departures: one that stays, taxis, and the others; some of these park."""
    some = rng.choice(edges, _TOUR + 2)
    rows = [
        _TRIP.format(
            id="tour", kind="car", depart=0, start=some[0], end=some[1], more=f' via="{" ".join(some[2:])}"', inner=""
        )
    ]
    kinds = itertools.cycle(("car", "car", "motorcycle", "car", "truck", "taxi"))
    for number, kind in zip(range(int(size.per_hour * size.seconds / 3600.0)), kinds, strict=False):
        depart, (start, end) = number * 3600.0 / size.per_hour, rng.choice(edges, 2, replace=False)
        parks = f'<stop parkingArea="{rng.choice(areas)}" duration="600"/>' if number % 12 == 1 else ""
        taxi = kind == "taxi"
        rows.append(
            _TRIP.format(
                id=f"{kind}{number}",
                kind="car" if taxi and number > 60 else kind,  # ten taxis
                depart=depart,
                start=start,
                end=end,
                more="",
                inner=parks,
            )
        )
    return rows


def _people_and_trains(rng: np.random.Generator, edges: Sequence[str], size: Size) -> list[str]:
    """People who walk, people who call a taxi, and trains, in the order of their departures."""
    rows: list[tuple[float, str]] = []
    for number in range(int(size.seconds / 6.0)):
        depart, (start, end) = 6.0 * number, rng.choice(edges, 2, replace=False)
        way = f'<walk from="{start}" to="{end}"/>' if number % 10 else f'<ride from="{start}" to="{end}" lines="taxi"/>'
        rows.append((depart, f'<person id="person{number}" depart="{depart:.1f}">{way}</person>'))
    for number in range(int(size.seconds / 300.0) + 1):
        route = '<route edges="track0 track1"/>'
        rows.append(
            (300.0 * number, f'<vehicle id="train{number}" type="train" depart="{300 * number}">{route}</vehicle>')
        )
    return ['<vType id="train" vClass="rail"/>', *(row for _, row in sorted(rows))]


def _write(path: Path, root: str, rows: Iterable[str]) -> None:
    path.write_text(f"<{root}>{''.join(rows)}</{root}>", encoding="utf-8")


def _run(program: str, *arguments: object) -> None:
    command = [str(HOME / "bin" / program), *map(str, arguments)]
    done = subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{program} failed: {done.stderr}")


def sumo_alone(config: Path, step: float) -> dict[str, object]:
    """Seconds and memory of SUMO itself."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    _run("sumo", "-c", config, "--step-length", step, "--no-step-log", "--no-warnings")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "run": "SUMO alone",
        "seconds": round(time.perf_counter() - began, 1),
        "cpu_s": round(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, 1),
        "memory_mb": round(after.ru_maxrss / 1024),  # of it, or of the program that has built the town
    }


def with_ego(config: Path, ego: str, overrides: Sequence[str]) -> dict[str, object]:
    """Seconds, memory and what was seen of a run with an ego."""
    warnings.simplefilter("ignore")
    began = time.perf_counter()
    steps = fogsim.run(scenario_from_config(config, ego, overrides, others_add_vehicles=True))
    step = next(steps)
    started, begun = time.perf_counter() - began, step.traffic.time
    seen, parked, count = set(step.traffic.ids), 0, 1
    for step in steps:
        seen.update(step.traffic.ids)
        parked, count = max(parked, int(step.traffic.off_lanes.sum())), count + 1
    return {
        "run": "FogSim",
        "ego": step.traffic.ids[step.ego],
        "simulated_s": round(step.traffic.time, 1),
        "from_s": round(begun, 1),
        "ending": None if step.ending is None else step.ending.value,
        "seconds": round(time.perf_counter() - began, 1),
        "cpu_s": round(time.process_time(), 1),
        "start_seconds": round(started, 1),
        "frames": count,
        "vehicles_near": len(seen),
        "most_off_lanes": parked,
        "memory_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }


def main() -> None:
    """Build or take the large scenario, run it, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--sumocfg", type=Path, help="a configuration of your own, in place of the town")
    parser.add_argument("--ego", default="any", help="id of the ego, or any")
    parser.add_argument("--blocks", type=int, default=30, help="junctions along each side of the town")
    parser.add_argument("--per-hour", type=float, default=3000.0, help="vehicles an hour in the town")
    parser.add_argument("--seconds", type=float, default=3600.0, help="simulated time")
    parser.add_argument(
        "--sublane", type=float, default=0.3, help="SUMO's lateral resolution in the town [m]; 0 for none"
    )
    parser.add_argument("--step", type=float, default=0.5, help="SUMO's step [s]")
    parser.add_argument("--visibility", type=float, default=100.0, help="V_met [m]")
    parser.add_argument("--renderer", default="cpu", help="what draws; none for no frames")
    arguments = parser.parse_args()
    size = Size(arguments.blocks, arguments.per_hour, arguments.seconds, arguments.sublane)
    sees = ["camera.width=160", "camera.height=120", "estimators=[joint_road]"]
    overrides = [
        *clock_settings(arguments.step, 1.0, 1.0),
        f"fog.visibility_m={arguments.visibility}",
        f"duration_s={arguments.seconds}",
        f"renderer={arguments.renderer}",
        *(["estimators=[]"] if arguments.renderer == "none" else sees),
    ]
    with tempfile.TemporaryDirectory() as folder, multiprocessing.get_context("spawn").Pool(1) as process:
        config = arguments.sumocfg or large_town(Path(folder), size)
        records = [{"run": "files", **sizes(config.parent)}] if arguments.sumocfg is None else []
        records.append(sumo_alone(config, arguments.step))
        records.append(process.apply(with_ego, (config, arguments.ego, overrides)))
    if arguments.json:
        print(json.dumps(records, indent=2))
    for record in [] if arguments.json else records:
        print("  ".join(f"{key} {value}" for key, value in record.items()))


def sizes(folder: Path) -> dict[str, object]:
    """Lanes of the town but for those inside junctions, and megabytes of its routes."""
    edges = _root(folder / "town.net.xml").iterfind("edge")
    lanes = sum(len(edge.findall("lane")) for edge in edges if not edge.get("function"))
    routes = sum((folder / name).stat().st_size for name in ("town.rou.xml", "street.rou.xml"))
    return {"lanes": lanes, "routes_mb": round(routes / 1e6, 1)}


if __name__ == "__main__":
    main()
