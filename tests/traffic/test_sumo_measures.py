"""What SUMO's own outputs say of a run is what FogSim's metrics of everybody say: SSM device, trips, collisions."""

import contextlib
import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.metrics.crossing import TrafficEncroachment
from fogsim.metrics.metric import JsonValue
from fogsim.metrics.surrogate import CRITICAL_DECELERATION, QUEUE_SPEED
from fogsim.metrics.traffic_conflicts import TrafficCollisions, TrafficConflicts
from fogsim.metrics.traffic_flow import TrafficEmissions, TrafficFlow
from fogsim.metrics.traffic_span import TrafficGathering, TrafficMetric
from fogsim.metrics.traffic_throughput import SPACING, TrafficThroughput
from fogsim.traffic import DriverSetup
from fogsim.traffic.drivers.speed_choice import unaffected
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.values import Collision, Command, TrafficState
from tests.recorders.synthetic import make_step, make_traffic_step
from tests.traffic.common import DATA, SETUP, seen

STEP = 0.1
STEPS = 400
LENGTH = 3000.0
BRAKES_AT = 250
"""Step in which the first vehicle begins to brake."""
CROSSING = DATA / "crossing" / "priority.net.xml"
CROSSING_STEPS = 260
NET = (
    f'<net version="1.20"><edge id="road" from="a" to="b" priority="1"><lane id="road_0" index="0" speed="30" '
    f'length="{LENGTH}" shape="0,0 {LENGTH},0"/></edge>'
    '<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-3"/>'
    f'<junction id="b" type="dead_end" x="{LENGTH}" y="0" incLanes="road_0" intLanes="" shape="{LENGTH},0 {LENGTH},-3"'
    "/>"
    "</net>"
)
SPEEDS = (1.1, 0.9, 1.2, 0.6, 1.05, 1.15, 0.8)
"""Wanted speeds over the limit, from the last vehicle to the first."""
CLASSES = ("passenger", "delivery", "truck", "passenger", "motorcycle", "bus", "passenger")
"""SUMO's classes of the same vehicles."""


@dataclasses.dataclass(frozen=True)
class Run:
    """States of one run, its collisions, and the folder of SUMO's outputs."""

    states: Sequence[TrafficState]
    collisions: Sequence[Collision]
    emitted: Sequence[NDArray[np.float64]]
    folder: Path

    def watched(self, metric: TrafficMetric, route: NDArray[np.float64] | None = None) -> Mapping[str, JsonValue]:
        """What a metric says of the run; without an ego on a route, if one is given."""
        gathering = TrafficGathering()
        for number, state in enumerate(self.states):
            hits = tuple(hit for hit in self.collisions if hit.time == state.time)
            step = make_step(number, collisions=hits) if route is None else make_traffic_step(number)
            truth = step.truth if route is None else replace(step.truth, route=route)
            gathering.add(replace(step, traffic=state, truth=truth), STEP if number else 0.0)
        span = gathering.take()
        assert span is not None
        metric.add(span)
        return metric.result()


class WithOutputs(LibsumoLink):
    """SUMO in this process with its outputs, and a hand on the simulation."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self.api: Api = None

    def begin(self, arguments: Sequence[str]) -> Api:
        device = {"probability": "1", "measures": "TTC DRAC MDRAC PET", "thresholds": "1e9 0 0 1e9", "range": "200"}
        device |= {"trajectories": "true", "extratime": "0", "mdrac.prt": "1", "file": str(self._folder / "ssm.xml")}
        options = [part for key, value in device.items() for part in (f"--device.ssm.{key}", value)]
        outputs = ["--tripinfo-output", str(self._folder / "trips.xml"), "--tripinfo-output.write-unfinished", "true"]
        collisions = ["--collision-output", str(self._folder / "collisions.xml"), "--precision", "9"]
        self.api = super().begin([*arguments, *options, *outputs, *collisions])
        return self.api


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The second sees late that the first brakes, but not too late."""
    return drive(tmp_path_factory.mktemp("near"), wakes_at=BRAKES_AT + 25)


def drive(folder: Path, wakes_at: int) -> Run:
    """Seven vehicles close up to one another; the first brakes, and the second does not see it until some step."""
    (folder / "road.net.xml").write_text(NET, encoding="utf-8")
    vehicles = "".join(
        f'<vehicle id="{name}" type="{kind}" route="r" depart="0" departPos="{10 + 60 * i}" departSpeed="18" '
        f'speedFactor="{factor}"/>'
        for i, (name, factor, kind) in enumerate(zip(["ego", *"bcdefg"], SPEEDS, CLASSES, strict=True))
    )
    alike = 'sigma="0" accel="2.6" decel="4.5" emergencyDecel="9" maxSpeed="50" length="5" minGap="2.5" speedDev="0"'
    types = "".join(f'<vType id="{kind}" vClass="{kind}" {alike}/>' for kind in sorted({*CLASSES}))
    demand = f'<routes>{types}<route id="r" edges="road"/>{vehicles}</routes>'
    (folder / "road.rou.xml").write_text(demand, encoding="utf-8")

    def disturb(api: Api, number: int) -> None:
        if number == BRAKES_AT:
            api.vehicle.slowDown("g", 6.0, 3.0)
            api.vehicle.setSpeedMode("f", 0)
            api.vehicle.setSpeed("f", api.vehicle.getSpeed("f"))
        if number == wakes_at:
            api.vehicle.setSpeedMode("f", 31)
            api.vehicle.setSpeed("f", -1.0)

    loops = "".join(
        f'<inductionLoop id="{place:g}" lane="road_0" pos="{place}" period="1000" file="loops.xml"/>'
        for place in np.arange(0.5 * SPACING, LENGTH, SPACING)
    )
    (folder / "loops.add.xml").write_text(f"<additional>{loops}</additional>", encoding="utf-8")
    return play(folder, folder / "road.net.xml", STEPS, disturb, (folder / "loops.add.xml",))


def play(
    folder: Path, net: Path, steps: int, disturb: Callable[[Api, int], None], additional: tuple[Path, ...] = ()
) -> Run:
    """The vehicles of ``road.rou.xml`` on a network, for so many steps before each of which something may happen."""
    drivers = DriverSetup(unaffected)
    changes = {"routes": (folder / "road.rou.xml",), "additional": additional, "keep_lane": (), "drivers": drivers}
    setup = replace(SETUP, net=net, reading_radius=LENGTH, **changes)
    link = WithOutputs(folder)
    with contextlib.closing(SumoTraffic(setup, link)) as traffic:
        states, collisions, emitted = [], [], []
        traffic.start(1)
        for number in range(steps):
            disturb(link.api, number)
            if number:
                traffic.advance(Command())
            snapshot = seen(traffic)
            states.append(snapshot.state)
            collisions += snapshot.collisions
            emitted.append(emissions(link.api, snapshot.state))
    return Run(states, collisions, emitted, folder)


def emissions(api: Api, state: TrafficState) -> NDArray[np.float64]:
    """What all vehicles emit and burn by SUMO's own reckoning: CO2, NOx, fuel [mg/s]."""
    getters = (api.vehicle.getCO2Emission, api.vehicle.getNOxEmission, api.vehicle.getFuelConsumption)
    return np.array([sum(get(vehicle) for vehicle in state.ids) for get in getters])


def written_conflicts(run: Run) -> dict[tuple[float, str, str], tuple[float, ...]]:
    """What the device wrote, TTC [s], DRAC and MDRAC [m/s²], by time, follower and leader."""
    found = {}
    for conflict in ET.parse(run.folder / "ssm.xml").getroot().iter("conflict"):  # noqa: S314 - the test's own run
        spans = [
            span.get("values", "").split()
            for name in ("timeSpan", "typeSpan", "TTCSpan", "DRACSpan", "MDRACSpan")
            for span in [conflict.find(name)]
            if span is not None
        ]
        for time, kind, ttc, drac, mdrac in zip(*spans, strict=True):
            if kind == "2":
                # The device names a step by its beginning, the simulation's clock after it by its end.
                key = (round(float(time) + STEP, 1), conflict.get("ego", ""), conflict.get("foe", ""))
                found[key] = tuple(
                    float(x) if x != "NA" else y for x, y in ((ttc, math.inf), (drac, 0.0), (mdrac, 0.0))
                )
    return found


def test_conflicts_are_those_of_the_ssm_device(run: Run) -> None:
    """Sums over the same steps; the device writes nine digits; speeds are the run's own."""
    found, told, rows = run.watched(TrafficConflicts(threshold=3.0)), written_conflicts(run), []
    for state in run.states[1:]:
        order = np.argsort(state.position[:, 0])
        for follower, leader in itertools.pairwise(order.tolist()):
            key = (round(state.time, 1), state.ids[follower], state.ids[leader])
            if key in told and state.speed[follower] >= QUEUE_SPEED:
                rows.append((*told[key], state.speed[leader]))
    ttc, drac, mdrac, ahead = np.array(rows).T
    moving, vehicle_time = ahead >= QUEUE_SPEED, len(SPEEDS) * (STEPS - 1) * STEP
    for name, chosen in (("", ttc >= 0.0), ("moving_", moving), ("queue_", ~moving)):
        exposed = (ttc[chosen] <= 3.0).sum() * STEP / vehicle_time
        assert found[f"traffic_{name}exposed_time_share"] == pytest.approx(exposed)
    assert found["traffic_minimum_time_to_collision_s"] == pytest.approx(ttc.min(), rel=1e-6)
    assert found["traffic_max_drac_mps2"] == pytest.approx(drac.max(), rel=1e-6)
    serious = (drac > CRITICAL_DECELERATION).sum() * STEP / vehicle_time
    assert found["traffic_serious_conflict_time_share"] == pytest.approx(serious)
    # The device leaves MDRAC out once the reaction takes all the time to collision; FogSim says that nothing is enough.
    late = ((mdrac > CRITICAL_DECELERATION) | (ttc <= 1.0)).sum() * STEP / vehicle_time
    assert found["traffic_serious_mdrac_time_share"] == pytest.approx(late)
    assert (ttc <= 3.0).sum() > 10
    assert serious > 0.0


def test_way_and_delay_are_those_of_the_trips(run: Run) -> None:
    """SUMO counts time loss in each step as FogSim does, in whole milliseconds for each vehicle."""
    found = run.watched(TrafficFlow())
    trips = [trip.attrib for trip in ET.parse(run.folder / "trips.xml").getroot()]  # noqa: S314 - the test's own run
    assert len(trips) == len(SPEEDS)
    way, lost, time = (sum(float(t[k]) for t in trips) for k in ("routeLength", "timeLoss", "duration"))
    assert found["traffic_vehicle_distance_m"] == pytest.approx(way, rel=1e-6)
    # The first step was over when they were first seen, before they moved.
    assert found["traffic_vehicle_time_s"] == pytest.approx(time - len(SPEEDS) * STEP, rel=1e-6)
    delay = found["traffic_delay_s_per_vehicle_km"]
    assert isinstance(delay, float)
    assert delay * way / 1000.0 == pytest.approx(lost, abs=0.5e-3 * len(SPEEDS))


def test_flow_is_that_of_induction_loops(run: Run) -> None:
    """Of all vehicles, as without an ego."""
    road = np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]])
    loops = [loop.attrib for loop in ET.parse(run.folder / "loops.xml").getroot()]  # noqa: S314 - the test's own run
    passed = sum(int(loop["nVehEntered"]) for loop in loops)
    assert passed > len(SPEEDS)
    hours = len(loops) * (STEPS - 1) * STEP / 3600.0
    assert run.watched(TrafficThroughput(), road)["traffic_flow_vehicles_per_h"] == pytest.approx(passed / hours)


def test_collisions_are_those_of_sumos_output(tmp_path: Path) -> None:
    run = drive(tmp_path, wakes_at=STEPS)
    hits = list(ET.parse(run.folder / "collisions.xml").getroot())  # noqa: S314 - the test's own run
    first = {}
    for hit in hits:
        first.setdefault(frozenset((hit.get("collider"), hit.get("victim"))), hit)
    found = run.watched(TrafficCollisions())
    assert found["traffic_collisions"] == len(first) > 0
    speeds = [abs(float(hit.get("colliderSpeed", "")) - float(hit.get("victimSpeed", ""))) for hit in first.values()]
    assert found["traffic_mean_impact_speed_mps"] == pytest.approx(np.mean(speeds), abs=1e-6)
    assert found["traffic_max_impact_speed_mps"] == pytest.approx(max(speeds), abs=1e-6)


def test_emissions_are_those_of_sumo(run: Run) -> None:
    """Of a vehicle of each kind; where SUMO cuts an engine off is known to 0.01 m/s²."""
    found = run.watched(TrafficEmissions())
    kilometres = sum(state.speed.sum() * STEP for state in run.states[1:]) / 1000.0
    dioxide, nitrogen, fuel = np.sum(run.emitted[1:], axis=0) * STEP / kilometres
    assert found["traffic_co2_g_per_vehicle_km"] == pytest.approx(1e-3 * dioxide, rel=0.005)
    assert found["traffic_nox_mg_per_vehicle_km"] == pytest.approx(nitrogen, rel=0.005)
    assert found["traffic_fuel_g_per_vehicle_km"] == pytest.approx(1e-3 * fuel, rel=0.005)
    assert {kind for state in run.states for kind in state.types} == {"car", "van", "truck", "bus", "motorcycle"}


def test_post_encroachment_times_are_those_of_the_ssm_device(tmp_path: Path) -> None:
    """Of both pairs of three who cross squarely; the metric interpolates over 0.3 s: 3 cm at 3 m/s², 6 ms at 5 m/s."""
    starts = (("ego", "NC CS", 190.0), ("b", "SC CN", 150.0), ("c", "WC CE", 100.0))
    vehicles = "".join(
        f'<vehicle id="{name}" type="t" depart="0" departPos="{place}" departSpeed="9"><route edges="{edges}"/>'
        "</vehicle>"
        for name, edges, place in starts
    )
    (tmp_path / "road.rou.xml").write_text(
        f'<routes><vType id="t" sigma="0" speedDev="0" length="5" width="1.8"/>{vehicles}</routes>', encoding="utf-8"
    )
    run = play(tmp_path, CROSSING, CROSSING_STEPS, lambda *_: None)
    root = ET.parse(tmp_path / "ssm.xml").getroot()  # noqa: S314 - the test's own run
    told = [float(pet.get("value", "")) for pet in root.iter("PET") if pet.get("value") != "NA"]
    assert len(told) == 2
    found = run.watched(TrafficEncroachment())
    assert found["traffic_minimum_post_encroachment_time_s"] == pytest.approx(min(told), abs=0.01)
    kilometres = sum(state.speed.sum() * STEP for state in run.states[1:]) / 1000.0
    for limit in (5, 1):
        short = sum(time <= limit for time in told) / kilometres
        assert found[f"traffic_post_encroachments_below_{limit}_s_per_vehicle_km"] == pytest.approx(short)
    assert max(told) < 5.0
