"""Ten minutes of networks that FogSim did not write: alone, in clear air and in fog.

For each network (netgenerate, and SUMO's own games) SUMO runs alone first. Then FogSim's drivers, as they are by
default, run the same simulation with the same seed in homogeneous fog by day; who drives longest is the ego, around
which the traffic is read in each step. In clear air (V_met infinite) every vehicle and every person must be where they
are in SUMO alone: ``same`` compares the files of floating car data (place, speed, acceleration, lane, angle; in each
second, with 12 digits after the point).

``collisions`` are pairs of vehicles, ``teleports`` those that SUMO takes out of jams and blockades, ``cpu_s`` the time
of the run. The exit code is 1 if a run fails, or if one in clear air is not the same. Traffic of the netgenerate
networks: ``--per-hour`` vehicles.
"""

import hashlib
import itertools
import math
import multiprocessing
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
import sumo
import sumolib
from harness import Row, parse_options, publish

from fogsim.atmosphere import FieldAccess
from fogsim.scenario import build
from fogsim.scenario.loading import clock_settings, scenario_from_config
from fogsim.traffic import TrafficSetup
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_traffic import SumoTraffic, command_line
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, FogField

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


SEED = 1
AIRLIGHT = (3000.0, 3000.0, 3000.0)
FCD = "fcd.xml"
CLEAR = "inf m"


class Task(NamedTuple):
    """What is run on each network."""

    seconds: float
    step: float
    per_hour: float
    visibilities: tuple[float, ...]


class CountingLink(LibsumoLink):
    """SUMO in this process, whose steps are watched."""

    def __init__(self) -> None:
        super().__init__()
        self._collided: set[tuple[str, str]] = set()
        self._since: dict[str, float] = {}
        self.stay: dict[str, float] = {}
        self.teleports = self.steps = self.vehicles = 0

    def begin(self, arguments: Sequence[str]) -> Api:
        """Start SUMO."""
        self._simulation = (api := super().begin(arguments)).simulation
        return api

    def step(self) -> None:
        """Step, and look at what has happened."""
        super().step()
        simulation = self._simulation
        self._collided.update((c.collider, c.victim) for c in simulation.getCollisions())
        self.teleports += int(simulation.getStartingTeleportNumber())
        now = float(simulation.getTime())
        departed = simulation.getDepartedIDList()
        self.steps += 1
        self.vehicles += len(departed)
        self._since.update(dict.fromkeys(departed, now))
        for vehicle in simulation.getArrivedIDList():
            self.stay[vehicle] = now - self._since.pop(vehicle)

    @property
    def collisions(self) -> int:
        """Pairs that have collided."""
        return len(self._collided)

    def stays(self) -> dict[str, float]:
        """Time that everyone has been on the road [s]."""
        now = float(self._simulation.getTime())
        return self.stay | {vehicle: now - since for vehicle, since in self._since.items()}


def setup(config: Path, ego: str, task: Task) -> TrafficSetup:
    """The simulation as FogSim runs it by default."""
    overrides = [*clock_settings(task.step, task.step, task.step), "fog.visibility_m=100"]
    return build.traffic_setup(scenario_from_config(config, ego, overrides, others_add_vehicles=True))


def run_alone(config: Path, task: Task) -> tuple[CountingLink, str]:
    """Run SUMO alone, with the options that FogSim gives it; gives who drives longest, too."""
    link = CountingLink()
    link.begin(command_line(setup(config, "nobody", task), SEED))
    try:
        for _ in range(round(task.seconds / task.step)):
            link.step()
        stays = link.stays()
    finally:
        link.end()
    return link, max(stays, key=lambda vehicle: (stays[vehicle], vehicle))


def run_in_fog(config: Path, task: Task, ego: str, visibility: float) -> CountingLink:
    """Run the same with FogSim's drivers in fog."""
    link = CountingLink()
    traffic = SumoTraffic(setup(config, ego, task), link)
    traffic.enter_fog(FieldAccess(FogField(extinction_from_visibility(visibility), AIRLIGHT)))
    traffic.start(SEED)
    try:
        while link.steps < round(task.seconds / task.step):
            traffic.advance(Command())
            traffic.observe()
    finally:
        traffic.close()
    return link


def digest(path: Path) -> str:
    """Hash of a file of floating car data, without the comment on when it was written; the file is removed."""
    with path.open("rb") as file:
        rows = itertools.dropwhile(lambda row: b"<fcd-export" not in row, file)
        total = hashlib.sha256()
        for row in rows:
            total.update(row)
    path.unlink()
    return total.hexdigest()


def measure(network: str, task: Task) -> list[Row]:
    """Records of one network."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = NETWORKS[network](folder, task.per_hour, task.seconds)
        config = write_configuration(folder, files, FCD)
        began = time.process_time()
        link, ego = run_alone(config, task)
        rows = [record(network, "SUMO alone", link, began)]
        alone = digest(folder / FCD)
        for visibility in task.visibilities:
            began = time.process_time()
            told = f"{visibility:g} m"
            try:
                link = run_in_fog(config, task, ego, visibility)
            except Exception:  # noqa: BLE001 - whatever goes wrong is what is looked for
                rows.append({"network": network, "run": told, "error": traceback.format_exc()})
                continue
            rows.append({**record(network, told, link, began), "same": digest(folder / FCD) == alone})
    return rows


def record(network: str, run: str, link: CountingLink, began: float) -> Row:
    """What a run has brought."""
    return {
        "network": network,
        "run": run,
        "vehicles": link.vehicles,
        "collisions": link.collisions,
        "teleports": link.teleports,
        "cpu_s": round(time.process_time() - began, 1),
    }


def measure_apart(network: str, task: Task) -> list[Row]:
    """Records of a network, measured in a process of its own, so that what ends one ends no other."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        try:
            return pool.submit(measure, network, task).result()
        except BrokenProcessPool as end:
            return [{"network": network, "error": f"{network}: {end!r}"}]


def failed(record: Row) -> bool:
    """Whether a run has failed, or was not the same in clear air."""
    return "error" in record or (record.get("run") == CLEAR and not record["same"])


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        seconds=(600.0, "simulated time of each run"),
        step=(0.2, "SUMO's step [s]"),
        per_hour=(1500.0, "vehicles an hour where the traffic is ours"),
        visibilities=([math.inf, 100.0, 30.0], "V_met [m]"),
        networks=(list(NETWORKS), "which", NETWORKS),
        one_process=(False, "all in this process: quicker, and a crash ends all"),
    )
    task = Task(given.seconds, given.step, given.per_hour, tuple(given.visibilities))
    measured = measure if given.one_process else measure_apart
    records = [record for network in given.networks for record in measured(network, task)]
    publish(given, records)
    sys.exit(any(map(failed, records)))


if __name__ == "__main__":
    main()
