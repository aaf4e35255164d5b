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

    python benchmarks/traffic.py [--json] [--network town] [--vehicles 20 --vehicles 100 …] [--seconds 10]
"""

import dataclasses
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from harness import parse_options, publish
from traffic_town import has_programs, town_configuration

from fogsim.atmosphere import FieldAccess
from fogsim.scenario import build
from fogsim.scenario.loading import clock_settings, scenario_from_config
from fogsim.traffic import TrafficSetup
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, FogField

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
