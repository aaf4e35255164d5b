"""Cost of reading, perceiving and obeying, as a ratio to the bare SUMO step of the same run.

A straight road with three lanes of 12 km carries a fixed number of vehicles on its first 10 km, the ego in their
middle; step 0.1 s, homogeneous fog with a visibility of 100 m by day. Blocks of bare SUMO steps alternate with blocks
of whole traffic steps: drivers look (perception) and choose their speed, SUMO steps, collisions are watched, and all
vehicles within 1000 m of the ego are read. Figures are medians over blocks, the ratio
that of neighbouring blocks; ``ms_state`` is the share of the reading.

The simulation is a .sumocfg with SUMO's own defaults, which FogSim's own scenarios share.

    python benchmarks/traffic.py [--json] [--vehicles 20 --vehicles 100 …] [--blocks 40] [--blind]

``--blind`` leaves perception and speed choice out.
"""

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from fogsim.atmosphere import FieldAccess
from fogsim.traffic import DriverSetup, DriverSight, TrafficSetup
from fogsim.traffic.sumo_library import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, FogField

LENGTH, OCCUPIED, LANES, WIDTH = 12_000.0, 10_000.0, 3, 3.75
LIMIT = 36.0
STEP = 0.1
BLOCK = 10
"""Steps in a block."""


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
    """Milliseconds that a call takes."""
    started = time.perf_counter()
    call()
    return 1e3 * (time.perf_counter() - started)


def measure(vehicles: int, blocks: int, blind: bool) -> dict[str, float]:
    """One record."""
    link = LibsumoLink()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        setup = TrafficSetup(
            net=None,
            config=configuration(folder, vehicles),
            routes=(),
            additional=(),
            ego="ego",
            step_length=STEP,
            keep_lane=(),
            warm_up_limit=60.0,
            advice_deceleration=2.0,
            reading_radius=1000.0,
            sight=None if blind else DriverSight(illuminance=10_000.0),
            drivers=DriverSetup(speed_choice="unaffected" if blind else "too_fast"),
        )
        traffic = SumoTraffic(setup, link)
        traffic.start(1)
    if not blind:
        traffic.enter_fog(FieldAccess(FogField(extinction_from_visibility(100.0), (3000.0, 3000.0, 3000.0))))
    record = alternate(traffic, link, blocks)
    traffic.close()
    return record


def alternate(traffic: SumoTraffic, link: LibsumoLink, blocks: int) -> dict[str, float]:
    """Blocks of bare and of whole steps in turn."""
    command = Command()
    for _ in range(100):
        traffic.advance(command)
        traffic.observe()
    bare, moving, reading = [], [], []
    for _ in range(blocks):
        bare.append(sum(timed(link.step) for _ in range(BLOCK)) / BLOCK)
        moved = read = 0.0
        for _ in range(BLOCK):
            moved += timed(lambda: traffic.advance(command))
            read += timed(traffic.observe)
        moving.append(moved / BLOCK)
        reading.append(read / BLOCK)
    snapshot = traffic.observe()
    present = 0 if snapshot is None else len(snapshot.state.ids)
    whole = [moved + read for moved, read in zip(moving, reading, strict=True)]
    return {
        "ms_sumo": round(statistics.median(bare), 4),
        "ms_state": round(statistics.median(reading), 4),
        "ms_total": round(statistics.median(whole), 4),
        "ratio": round(statistics.median(a / b for a, b in zip(whole, bare, strict=True)), 3),
        "vehicles_read": present,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--vehicles", action="append", type=int, help="vehicles (default 20, 100, 500 and 2000)")
    parser.add_argument("--blocks", type=int, default=40, help=f"blocks of {BLOCK} steps of each kind")
    parser.add_argument("--blind", action="store_true", help="leave perception and speed choice out")
    arguments = parser.parse_args()
    counts = arguments.vehicles or [20, 100, 500, 2000]
    records = [{"vehicles": n, **measure(n, arguments.blocks, arguments.blind)} for n in counts]
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print("  ".join(f"{key:>13}" for key in records[0]))
    for record in records:
        print("  ".join(f"{value:>13}" for value in record.values()))


if __name__ == "__main__":
    main()
