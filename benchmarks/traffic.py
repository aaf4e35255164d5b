"""Cost of reading, perceiving and obeying, as a ratio to the bare SUMO step of the same run.

On ``motorway`` a straight road with three lanes carries a number of vehicles on 10 km, the ego in their middle; in
``town`` they wander through a grid of junctions with lights, as large as they need, the ego from its middle on. Step
0.1 s, homogeneous fog with a visibility of 100 m by day, drivers as they are by default. Blocks of bare SUMO steps
alternate with blocks of whole traffic steps: drivers look (perception) and choose their speed, SUMO steps, collisions
are watched, and all vehicles within 1000 m of the ego are read. After 50 s the traffic starts again, before any vehicle
arrives.

Times are the processor's, medians over blocks [ms]. ``ratio`` is the median of the ratios of neighbouring blocks; a
quarter of them lie below ``ratio_low``, a quarter above ``ratio_high``. ``ratio_quiet`` is that of the least times of
either kind, which other work on the machine disturbs least. ``ms_state`` is the share of the reading.

The simulation is a .sumocfg with SUMO's own defaults, which FogSim's own scenarios share. The town needs SUMO's
netgenerate and netconvert (eclipse-sumo); without them only the motorway is measured.
"""

import dataclasses
import importlib.util
import math
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from harness import parse_options, publish

from fogsim.atmosphere import FieldAccess
from fogsim.scenario import build
from fogsim.scenario.loading import clock_settings, scenario_from_config
from fogsim.traffic import TrafficSetup
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, FogField

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


LENGTH, OCCUPIED, LANES, WIDTH = 15_000.0, 10_000.0, 3, 3.75
LIMIT = 36.0
VISIBILITY = 100.0
STEP = 0.1
STEPS = 20
"""Steps in a block: two seconds, in which drivers choose a speed twice."""
BLOCKS = 10
"""Blocks of each kind before the traffic starts again."""
ROUNDS = 40
"""At most so many times."""


def net(folder: Path) -> Path:
    """The road, as a SUMO network."""
    y = [-(LANES - 0.5 - lane) * WIDTH for lane in range(LANES)]
    lanes = "\n".join(
        f'<lane id="road_{i}" index="{i}" speed="{LIMIT}" length="{LENGTH}" shape="0,{y[i]} {LENGTH},{y[i]}"/>'
        for i in range(LANES)
    )
    incoming = " ".join(f"road_{i}" for i in range(LANES))
    path = folder / "road.net.xml"
    path.write_text(
        f'<net version="1.20"><edge id="road" from="a" to="b" priority="1">{lanes}</edge>'
        '<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-12"/>'
        f'<junction id="b" type="dead_end" x="{LENGTH}" y="0" incLanes="{incoming}" intLanes="" '
        f'shape="{LENGTH},-12 {LENGTH},0"/></net>',
        encoding="utf-8",
    )
    return path


def routes(folder: Path, vehicles: int) -> Path:
    """Vehicles at equal distances, at a speed at which the gaps are safe."""
    spacing = OCCUPIED * LANES / vehicles
    speed = min(30.0, 0.8 * (spacing - 7.5))
    rows = []
    for i in range(vehicles):
        name = "ego" if i == vehicles // 2 else f"v{i}"
        place = 10.0 + (i // LANES + 0.3 * (i % LANES)) * spacing
        rows.append(
            f'<vehicle id="{name}" type="car" route="r" depart="0" departLane="{i % LANES}" '
            f'departPos="{place:.1f}" departSpeed="{speed:.1f}"/>'
        )
    path = folder / "road.rou.xml"
    path.write_text(
        '<routes><vType id="car" vClass="passenger" speedFactor="normc(1,0.1,0.8,1.2)"/>'
        f'<route id="r" edges="road"/>{"".join(rows)}</routes>',
        encoding="utf-8",
    )
    return path


def configuration(folder: Path, vehicles: int) -> Path:
    """Road and vehicles as a configuration of SUMO's, whose other options stay SUMO's defaults."""
    path = folder / "road.sumocfg"
    path.write_text(
        f'<configuration><input><net-file value="{net(folder).name}"/>'
        f'<route-files value="{routes(folder, vehicles).name}"/></input></configuration>',
        encoding="utf-8",
    )
    return path


def timed(call: Callable[[], object]) -> float:
    """Milliseconds of the processor that a call takes."""
    started = time.thread_time_ns()
    call()
    return 1e-6 * (time.thread_time_ns() - started)


CONFIGURATIONS = {"motorway": configuration, "town": town_configuration}


def measure(network: str, vehicles: int, seconds: float) -> dict[str, float]:
    """One record, measured for a time [s]."""
    link = LibsumoLink()
    blocks: list[Block] = []
    until = time.perf_counter() + seconds
    fog = FogField(extinction_from_visibility(VISIBILITY), (3000.0, 3000.0, 3000.0))
    with tempfile.TemporaryDirectory() as name:
        config = CONFIGURATIONS[network](Path(name), vehicles)
        traffic = SumoTraffic(setup(config), link)
        traffic.enter_fog(FieldAccess(fog))
        for number in range(ROUNDS):
            if number and time.perf_counter() > until:
                break
            traffic.start(1)
            for _ in range(100):
                traffic.advance(Command())
                traffic.observe()
            blocks += [block(traffic, link) for _ in range(BLOCKS)]
        snapshot = traffic.observe()
        traffic.close()
    return {**summary(blocks), "vehicles_read": 0 if snapshot is None else len(snapshot.state.ids)}


def setup(config: Path) -> TrafficSetup:
    """The simulation."""
    clocks = clock_settings(STEP, STEP, STEP)
    usual = build.traffic_setup(scenario_from_config(config, "ego", [*clocks, f"fog.visibility_m={VISIBILITY}"]))
    return dataclasses.replace(usual, reading_radius=1000.0)


Block = tuple[float, float, float]
"""Milliseconds that a bare SUMO step, a whole step, and the reading in it take on average."""


def block(traffic: SumoTraffic, link: LibsumoLink) -> Block:
    """A block of bare and one of whole steps."""
    command = Command()
    bare = sum(timed(link.step) for _ in range(STEPS))
    # What has changed in the steps that no one has seen is taken up first.
    traffic.advance(command)
    traffic.observe()
    moving = reading = 0.0
    for _ in range(STEPS):
        moving += timed(lambda: traffic.advance(command))
        reading += timed(traffic.observe)
    return bare / STEPS, (moving + reading) / STEPS, reading / STEPS


def summary(blocks: Sequence[Block]) -> dict[str, float]:
    """Medians, spread and least of many blocks."""
    bare, whole, reading = zip(*blocks, strict=True)
    low, middle, high = statistics.quantiles([b / a for a, b in zip(bare, whole, strict=True)], n=4)
    return {
        "ms_sumo": round(statistics.median(bare), 4),
        "ms_state": round(statistics.median(reading), 4),
        "ms_total": round(statistics.median(whole), 4),
        "ratio": round(middle, 3),
        "ratio_low": round(low, 3),
        "ratio_high": round(high, 3),
        "ratio_quiet": round(min(whole) / min(bare), 3),
        "blocks": len(blocks),
    }


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        vehicles=([20, 100, 500, 2000], "vehicles"),
        network=(list(CONFIGURATIONS) if has_programs() else ["motorway"], "which", CONFIGURATIONS),
        seconds=(10.0, "time to measure for each number"),
    )
    if "town" in given.network and not has_programs():
        given.error("--network town needs SUMO's netgenerate and netconvert: pip install eclipse-sumo")
    cases = [(network, vehicles) for network in given.network for vehicles in given.vehicles]
    publish(given, [{"network": one, "vehicles": n, **measure(one, n, given.seconds)} for one, n in cases])


if __name__ == "__main__":
    main()
