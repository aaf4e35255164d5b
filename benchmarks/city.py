"""How fast a run in a large city begins, and how much memory it takes.

The city is a grid of streets with two lanes a direction, 100 m apart, by netgenerate (eclipse-sumo brings it); the ego
drives straight through its middle, among a few others, in fog with V_met 200 m by day. Each start is made in a process
of its own, twice for each size: with an empty cache, and with what the first has left in it.

    python benchmarks/city.py [--json] [--streets 23 36] [--seconds 5] [--size 640x480] [--folder DIRECTORY]

``lanes`` counts those of junctions too (``<lane`` in the file), ``roads`` those between junctions only. ``start_s`` is
the time from a scenario to the first finished step, `import` not included, and ``cpu_s`` the processor time of that;
``sumo_s`` is what SUMO alone takes to load the same files; ``step_ms`` is the mean of the following steps, ``worst_ms``
the longest of them; ``rss_mb`` the most memory that the process ever held, and ``sumo_mb`` the same of SUMO alone.
Networks are kept in a folder of the system's temporary ones, unless ``--folder`` names another.
"""

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

EGO = "ego"
BLOCK = 100.0  # between streets [m]


def name_of(column: int, streets: int) -> str:
    """Name that netgenerate gives a column of crossings: A … Z, or AA … AZ, BA … where there are more than 26."""
    last = chr(ord("A") + column % 26)
    return last if streets <= 26 else chr(ord("A") + column // 26) + last


def write_city(folder: Path, streets: int) -> Path:
    """Write a city's network, traffic and configuration, unless they are there."""
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / f"city{streets}.sumocfg"
    if config.exists():
        return config
    net, routes = folder / f"city{streets}.net.xml", folder / f"city{streets}.rou.xml"
    import sumo  # noqa: PLC0415 - not what is measured

    grid = ["--grid", "--grid.number", str(streets), "--grid.length", str(BLOCK), "--default.lanenumber", "2"]
    program = Path(sumo.SUMO_HOME) / "bin" / "netgenerate"
    subprocess.run([program, *grid, "--seed", "1", "-o", net], check=True, capture_output=True)
    rows = ['<vType id="car"/>']
    for number, row in enumerate((streets // 2, streets // 2 - 1, streets // 2 + 1)):
        names = [f"{name_of(column, streets)}{row}" for column in range(streets)]
        edges = " ".join(a + b for a, b in itertools.pairwise(names))
        rows.append(f'<route id="row{number}" edges="{edges}"/>')
    rows.append(f'<vehicle id="{EGO}" type="car" route="row0" depart="1" departSpeed="10"/>')
    rows += [
        f'<vehicle id="other{number}" type="car" route="row{number % 3}" depart="{1 + number // 3}" departLane="best"/>'
        for number in range(1, 12)
    ]
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    options = f'<net-file value="{net.name}"/><route-files value="{routes.name}"/>'
    config.write_text(f"<configuration><input>{options}</input></configuration>", encoding="utf-8")
    return config


def peak_mb() -> float:
    """Most memory that this process has held [MB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1e6 if sys.platform == "darwin" else 1e6 / 1024), 0)


def run_fogsim(config: Path, seconds: float, size: str) -> dict[str, Any]:
    """Start a run, continue it for some time, and measure what it took."""
    from fogsim.loop import ClosedLoop  # noqa: PLC0415 - each process imports only what it measures
    from fogsim.scenario import scenario_from_config  # noqa: PLC0415
    from fogsim.values import Command  # noqa: PLC0415

    width, height = size.split("x")
    overrides = ["fog.visibility_m=200", f"camera.width={width}", f"camera.height={height}"]
    began, busy = time.perf_counter(), time.process_time()
    scenario = scenario_from_config(config, EGO, overrides)
    with ClosedLoop(scenario) as loop:
        step = loop.start(1)
        started, used = time.perf_counter() - began, time.process_time() - busy
        spent = []
        while step.time < seconds and step.ending is None:
            before = time.perf_counter()
            step = loop.advance(Command())
            spent.append(time.perf_counter() - before)
    return {
        "start_s": round(started, 2),
        "cpu_s": round(used, 2),
        "step_ms": round(1e3 * sum(spent) / max(len(spent), 1), 1),
        "worst_ms": round(1e3 * max(spent, default=0.0), 1),
        "rss_mb": peak_mb(),
    }


def run_sumo(config: Path) -> dict[str, Any]:
    """Load a simulation without FogSim."""
    import libsumo  # noqa: PLC0415

    began = time.perf_counter()
    libsumo.start(["sumo", "-c", str(config), "--no-step-log", "true"])
    took = time.perf_counter() - began
    libsumo.close()
    return {"sumo_s": round(took, 2), "sumo_mb": peak_mb()}


def in_new_process(task: str, arguments: argparse.Namespace, config: Path, cache: str) -> dict[str, Any]:
    """What one task takes, with a folder as the user's cache."""
    options = ["--task", task, "--config", str(config), "--seconds", str(arguments.seconds), "--size", arguments.size]
    environment = {**os.environ, "FOGSIM_CACHE_DIR": cache}
    done = subprocess.run(
        [sys.executable, __file__, *options], check=True, stdout=subprocess.PIPE, text=True, env=environment
    )
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def measure(arguments: argparse.Namespace, streets: int) -> list[dict[str, Any]]:
    """Records of one city: with an empty cache, and once more."""
    config = write_city(arguments.folder, streets)
    net = config.with_name(f"city{streets}.net.xml").read_text(encoding="utf-8")
    lanes = net.count("<lane ")
    sizes = {"streets": streets, "lanes": lanes, "roads": lanes - net.count('<lane id=":')}
    with tempfile.TemporaryDirectory() as cache:
        alone = in_new_process("sumo", arguments, config, cache)
        return [
            {**sizes, "cache": kind, **in_new_process("fogsim", arguments, config, cache), **alone}
            for kind in ("empty", "filled")
        ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--streets", type=int, nargs="+", default=[23, 36], help="streets in each direction")
    parser.add_argument("--seconds", type=float, default=5.0, help="simulated time after the start")
    parser.add_argument("--size", default="640x480", help="of the picture [px]")
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "fogsim_city")
    parser.add_argument("--task", choices=["fogsim", "sumo"], help=argparse.SUPPRESS)
    parser.add_argument("--config", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.task is not None:
        config = arguments.config
        done = run_sumo(config) if arguments.task == "sumo" else run_fogsim(config, arguments.seconds, arguments.size)
        print(json.dumps(done))
        return
    records = []
    for streets in arguments.streets:
        for record in measure(arguments, streets):
            records.append(record)
            if not arguments.json:
                print("  ".join(f"{key} {value}" for key, value in record.items()), flush=True)
    if arguments.json:
        print(json.dumps(records, indent=2))


if __name__ == "__main__":
    main()
