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

import gzip
import importlib.util
import itertools
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
from harness import parse_options, publish

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


def mixed(net: Path, through: str = "") -> Make:
    """A network with mixed traffic of ours, all of it through its first roundabout if asked."""
    return lambda folder, per_hour, seconds: Files(net, (trips(folder, net, per_hour, seconds, through=through),))


def game(folder: str, net: str, routes: str, additional: str = "", begin: float = 0.0) -> Make:
    """One of SUMO's games, with its own traffic."""
    home = GAMES / folder
    files = (tuple(home / name for name in names.split()) for names in (routes, additional))
    found = Files(home / net, *files, begin)
    return lambda *_: found


def sumo_rl(name: str, routes: str, begin: float = 0.0) -> Make:
    """One of sumo-rl's networks, with its own traffic."""

    def make(*_: object) -> Files:
        found = importlib.util.find_spec("sumo_rl")
        if found is None or not found.submodule_search_locations:
            raise ModuleNotFoundError("sumo_rl is not installed: pip install sumo-rl")
        home = Path(found.submodule_search_locations[0], "nets")
        return Files(home / f"{name}.net.xml", (home / f"{routes}.rou.xml",), begin=begin)

    return make


_TOWN = ("--default.lanenumber", "2", "--default-junction-type", "traffic_light", "--default.speed", "13.89")
_SLOW = ("--default.speed", "8.33", "--default-junction-type", "right_before_left")
_SINGLE = "2way-single-intersection/single-intersection"

NETWORKS: dict[str, Make] = {
    "grid": generated("--grid", "--grid.number", "5", "--grid.length", "150", *_TOWN, pedestrians=True),
    "spider": generated("--spider", "--spider.arm-number", "7", "--spider.circle-number", "4", *_TOWN),
    "random": generated("--rand", "--rand.iterations", "80", "--tls.guess", "--tls.guess.threshold", "40"),
    "left_hand": generated("--grid", "--grid.number", "4", "--lefthand", "--default.lanenumber", "2"),
    "right_before_left": generated("--grid", "--grid.number", "5", *_SLOW),
    "roundabout": mixed(GAMES / "A10KW" / "osm.net.xml", through="roundabout"),
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
    # A junction of Cologne at 7 o'clock.
    "cologne": sumo_rl("RESCO/cologne1/cologne1", "RESCO/cologne1/cologne1", begin=25_200.0),
    "two_way": sumo_rl(_SINGLE, f"{_SINGLE}-gen"),
}


def trips(
    folder: Path, net: Path, per_hour: float, seconds: float, *, pedestrians: bool = False, through: str = ""
) -> Path:
    """Write traffic from anywhere to anywhere, and a person on foot for three vehicles; SUMO looks for the ways."""
    rng, root = np.random.default_rng(1), _root(net)
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
    _write(path := folder / "town.rou.xml", "routes", rows)
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
    _write(path := folder / "town.sumocfg", "configuration", [f"<input>{rows}</input>"])
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
    given = parse_options(
        __doc__,
        sumocfg=(Path, "a configuration of your own, in place of the town"),
        ego=("any", "id of the ego, or any"),
        blocks=(30, "junctions along each side of the town"),
        per_hour=(3000.0, "vehicles an hour in the town"),
        seconds=(3600.0, "simulated time"),
        sublane=(0.3, "SUMO's lateral resolution in the town [m]; 0 for none"),
        step=(0.5, "SUMO's step [s]"),
        visibility=(100.0, "V_met [m]"),
        renderer=("cpu", "what draws; none for no frames"),
    )
    size = Size(given.blocks, given.per_hour, given.seconds, given.sublane)
    sees = ["camera.width=160", "camera.height=120", "estimators=[joint_road]"]
    overrides = [
        *clock_settings(given.step, 1.0, 1.0),
        f"fog.visibility_m={given.visibility}",
        f"duration_s={given.seconds}",
        f"renderer={given.renderer}",
        *(["estimators=[]"] if given.renderer == "none" else sees),
    ]
    with tempfile.TemporaryDirectory() as folder, multiprocessing.get_context("spawn").Pool(1) as process:
        config = given.sumocfg or large_town(Path(folder), size)
        records = [{"run": "files", **sizes(config.parent)}] if given.sumocfg is None else []
        records.append(sumo_alone(config, given.step))
        records.append(process.apply(with_ego, (config, given.ego, overrides)))
    publish(given, records)


def sizes(folder: Path) -> dict[str, object]:
    """Lanes of the town but for those inside junctions, and megabytes of its routes."""
    edges = _root(folder / "town.net.xml").iterfind("edge")
    lanes = sum(len(edge.findall("lane")) for edge in edges if not edge.get("function"))
    routes = sum((folder / name).stat().st_size for name in ("town.rou.xml", "street.rou.xml"))
    return {"lanes": lanes, "routes_mb": round(routes / 1e6, 1)}


if __name__ == "__main__":
    main()
