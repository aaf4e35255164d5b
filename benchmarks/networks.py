"""Ten minutes of networks that FogSim did not write: alone, in clear air and in fog.

For each network (`benchmarks/foreign_networks.py`) SUMO runs alone first. Then FogSim's drivers, as they are by
default, run the same simulation with the same seed in homogeneous fog by day; who drives longest is the ego, around
which the traffic is read in each step. In clear air (V_met infinite) every vehicle and every person must be where they
are in SUMO alone: ``same`` compares the files of floating car data (place, speed, acceleration, lane, angle; in each
second, with 12 digits after the point).

    python benchmarks/networks.py [--json] [--seconds 600] [--visibilities inf 100 30] [--networks grid rail …]
        [--step 0.2] [--per-hour 1500] [--one-process]

``collisions`` are pairs of vehicles, ``teleports`` those that SUMO takes out of jams and blockades, ``cpu_s`` the time
of the run. The exit code is 1 if a run fails, or if one in clear air is not the same. Traffic of the netgenerate
networks: ``--per-hour`` vehicles.
"""

import hashlib
import itertools
import math
import multiprocessing
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import NamedTuple

from foreign_networks import NETWORKS, write_configuration
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
