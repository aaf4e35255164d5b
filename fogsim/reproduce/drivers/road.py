"""A straight, level road with loops in it, traffic that is let drive over them, and what studies measure of it.

SUMO's instantaneous loops write every passage into a file, which is read.
"""

import math
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import FieldAccess
from fogsim.core.files.xml_reader import read_tree
from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.scenario import build, load_scenario
from fogsim.traffic import AfterCollision, BrakeEvent, Event, TrafficSetup, Trigger, libsumo_traffic
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import Command, Display, FogField, Stretch, StretchAdvice

_FREE_ABOVE = 5.0
"""Time headway above which a vehicle is free, and below which it follows [s]."""

THINKING_TIME, BRAKING = 0.67, 6.57
"""Reaction time [s] and deceleration [m/s²] of the Highway Code's stopping distances (50 mph: 15 + 38 m).

By these the Transport and Road Research Laboratory judged what it saw on the M4 (Commercial Motor, 10 December 1976).
"""


class Passages(NamedTuple):
    """Vehicles (n,) at a cross-section in the order in which they came, but for each lane's first."""

    speed: NDArray[np.float64]  # [m/s]
    leader_speed: NDArray[np.float64]  # [m/s]
    headway: NDArray[np.float64]  # between their fronts [s]
    gap: NDArray[np.float64]  # [m]


def passages(events: Iterable[Mapping[str, str]], since: float) -> Passages:
    """Vehicles by the events of SUMO's instantaneous loops from a time on [s]."""
    rows: list[tuple[float, float, float, float]] = []
    before: dict[str, tuple[float, float]] = {}
    left: dict[str, float] = {}
    for event in events:
        lane, time, speed = event["id"], float(event["time"]), float(event["speed"])
        if event["state"] == "leave":
            left[lane] = time
        elif event["state"] == "enter":
            if lane in before and lane in left and time > since:
                entered, leader_speed = before[lane]
                rows.append((speed, leader_speed, time - entered, speed * (time - left[lane])))
            before[lane] = (time, speed)
            left.pop(lane, None)
    return Passages(*np.array(rows, np.float64).reshape(-1, 4).T)


class Measures(NamedTuple):
    """What is measured at one cross-section in one run; NaN where nothing was there to be measured."""

    flow: float  # on both lanes [1/h]
    free_speed: float  # [km/h]
    free_speed_sd: float  # [km/h]
    mean_speed: float  # [km/h]
    speed_sd: float  # [km/h]
    overdriving: float  # share that cannot stop within V_met, by the Highway Code [-]
    overdriving_aashto: float  # by 2.5 s and 3.4 m/s² (AASHTO) [-]
    headway_15: float  # percentile [s]
    headway_below_1: float  # share [-]
    headway_below_2: float  # share [-]
    following_headway: float  # mean [s]
    following_distance: float  # mean [m]
    speed_difference: float  # mean absolute, of those who follow [m/s]
    ttc_15: float  # percentile of those who follow and come closer [s]
    ttc_50: float  # [s]
    ttc_below_10: float  # share of those who follow [-]


def measured(seen: Passages, visibility: float, seconds: float) -> Measures:
    """Measures of the vehicles that passed in fog of a visibility [m] within some seconds."""
    follows = seen.headway < _FREE_ABOVE
    free, closing = seen.speed[~follows], (seen.speed - seen.leader_speed)[follows]
    gap = seen.gap[follows]
    ttc = gap[closing > 0.0] / closing[closing > 0.0]
    return Measures(
        flow=len(seen.speed) / seconds * 3600.0,
        free_speed=_mean(free) * KMH_PER_MPS,
        free_speed_sd=_deviation(free) * KMH_PER_MPS,
        mean_speed=_mean(seen.speed) * KMH_PER_MPS,
        speed_sd=_deviation(seen.speed) * KMH_PER_MPS,
        overdriving=_mean(seen.speed > safe_speed(visibility, THINKING_TIME, BRAKING)),
        overdriving_aashto=_mean(seen.speed > safe_speed(visibility, REACTION_TIME, DECELERATION)),
        headway_15=_percentile(seen.headway, 15.0),
        headway_below_1=_mean(seen.headway < 1.0),
        headway_below_2=_mean(seen.headway < 2.0),
        following_headway=_mean(seen.headway[follows]),
        following_distance=_mean(gap),
        speed_difference=_mean(np.abs(closing)),
        ttc_15=_percentile(ttc, 15.0),
        ttc_50=_percentile(ttc, 50.0),
        ttc_below_10=float(np.sum(ttc < 10.0) / len(gap)) if len(gap) else np.nan,
    )


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else np.nan


def _deviation(values: NDArray[np.float64]) -> float:
    return float(np.std(values, ddof=1)) if values.size > 1 else np.nan


def _percentile(values: NDArray[np.float64], share: float) -> float:
    return float(np.percentile(values, share)) if values.size else np.nan


_EDGE, EGO = "road", "first"
"""Ids of the road's edge, and of the ego, which drives ahead of all others and meets no one."""

_WIDTH = 3.75
"""Width of a lane [m]."""

LENGTH, _LOOPS_AT = 2700.0, 2500.0
"""Length of the road and place of the loops on it [m]."""

LIMIT = 31.3
"""Speed limit, 70 mph [m/s]."""

STEP = 0.2
"""SUMO's step [s]."""

_FIRST_VEHICLE = (
    '<vType id="fast" vClass="passenger" speedFactor="1.3"/>'
    f'<route id="r" edges="{_EDGE}"/><vehicle id="{EGO}" type="fast" route="r" depart="0" departSpeed="max"/>'
)
"""The ego and the route of all, as the beginning of a demand."""


def passed(
    overrides: tuple[str, ...],
    lanes: int,
    demand: str,
    visibility: float,
    seed: int,
    seconds: float,
    command: Command | None = None,
    events: tuple[Event, ...] = (),
) -> list[dict[str, str]]:
    """Events that the loops record in fog of a visibility [m], by the attributes of SUMO's ``instantOut``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        setup = replace(_setup(folder, overrides, lanes, demand), events=events)
        traffic = libsumo_traffic(setup, folder / "outputs")
        extinction = extinction_from_visibility(visibility) if math.isfinite(visibility) else 0.0
        traffic.enter_fog(FieldAccess(FogField(extinction, (0.0, 0.0, 0.0))))
        command = command or Command()
        try:
            traffic.start(seed)
            for _ in range(round(seconds / STEP)):
                traffic.advance(command)
        finally:
            # SUMO writes the loops' file to its end only now.
            traffic.close()
        return [dict(one.attrib) for one in read_tree(folder / "outputs" / "loops.xml").iter("instantOut")]


def _setup(folder: Path, overrides: tuple[str, ...], lanes: int, demand: str) -> TrafficSetup:
    """The simulation, its drivers as a scenario has them."""
    net, routes, loops = (folder / name for name in ("road.net.xml", "road.rou.xml", "road.add.xml"))
    net.write_text(_net(lanes), encoding="utf-8")
    routes.write_text(f"<routes>{_FIRST_VEHICLE}{demand}</routes>", encoding="utf-8")
    rows = (
        f'<instantInductionLoop id="{i}" lane="{_EDGE}_{i}" pos="{_LOOPS_AT}" file="loops.xml"/>' for i in range(lanes)
    )
    loops.write_text(f"<additional>{''.join(rows)}</additional>", encoding="utf-8")
    return replace(
        build.traffic_setup(load_scenario("motorway_fog_bank", list(overrides))),
        net=net,
        routes=(routes,),
        additional=(loops,),
        ego=EGO,
        keep_lane=(),
        step_length=STEP,
        # Whoever collides vanishes: a pile would be all that is counted behind it.
        after_collision=AfterCollision.REMOVE,
    )


def _net(lanes: int) -> str:
    y = [-(lanes - 0.5 - lane) * _WIDTH for lane in range(lanes)]
    rows = "".join(
        f'<lane id="{_EDGE}_{i}" index="{i}" speed="{LIMIT}" length="{LENGTH}" shape="0,{y[i]} {LENGTH},{y[i]}"/>'
        for i in range(lanes)
    )
    incoming = " ".join(f"{_EDGE}_{i}" for i in range(lanes))
    return (
        f'<net version="1.20"><edge id="{_EDGE}" from="a" to="b" priority="1">{rows}</edge>'
        '<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-8"/>'
        f'<junction id="b" type="dead_end" x="{LENGTH}" y="0" incLanes="{incoming}" intLanes="" '
        f'shape="{LENGTH},-8 {LENGTH},0"/></net>'
    )


_APART, _BEHIND = 120.0, 3.0
"""Time from one leader to the next, and from a leader to its follower, as they enter [s]."""


class PairMeasures(NamedTuple):
    """What is measured of followers; NaN where nothing was there to be measured."""

    out_of_sight: float  # share with a gap longer than V_met [-]
    headway: float  # median [s]
    headway_in_sight: float  # mean where the gap is at most V_met [s]


def follow(overrides: tuple[str, ...], leader_speed: float, visibility: float, seed: int, count: int) -> PairMeasures:
    """Measure drivers behind leaders of a given speed [m/s] after 2.5 km in fog of a visibility [m]."""
    rows = "".join(
        f'<vehicle id="leader{i}" type="car" route="r" depart="{_APART * (i + 1)}" departSpeed="{leader_speed}"/>'
        f'<vehicle id="behind{i}" type="car" route="r" depart="{_APART * (i + 1) + _BEHIND}" departSpeed="max"/>'
        for i in range(count)
    )
    demand = f'<vType id="car" vClass="passenger" tau="1.2" speedFactor="normc(1,0.1,0.7,1.3)"/>{rows}'
    events = tuple(BrakeEvent(f"leader{i}", Trigger(at_position=0.0), to_speed=leader_speed) for i in range(count))
    seen = passed(overrides, 1, demand, visibility, seed, _APART * (count + 4), events=events)
    return measured_pairs(seen, visibility)


def measured_pairs(events: Iterable[Mapping[str, str]], visibility: float) -> PairMeasures:
    """Measure followers (``behind…``) and leaders (``leader…``) by the events of loops."""
    left: dict[str, float] = {}
    rows: list[tuple[float, float]] = []
    for event in events:
        name, time = event["vehID"], float(event["time"])
        if event["state"] == "leave":
            left[name] = time
        leader = name.replace("behind", "leader")
        if event["state"] == "enter" and leader != name and leader in left:
            rows.append((time - left[leader], (time - left[leader]) * float(event["speed"])))
    headway, gap = np.array(rows, np.float64).reshape(-1, 2).T
    in_sight: NDArray[np.bool_] = gap <= visibility
    return PairMeasures(
        out_of_sight=float(np.mean(~in_sight)) if len(gap) else math.nan,
        headway=float(np.median(headway)) if len(gap) else math.nan,
        headway_in_sight=float(np.mean(headway[in_sight])) if in_sight.any() else math.nan,
    )


_WARM_UP = 300.0
"""Before this time nothing counts: the road fills [s]."""

_HEADWAYS = (0.5, 0.8, 1.1, 1.5, 2.0)
"""Gaps that drivers of cars keep in clear air, of equal shares [s]: field headways spread about as much."""

_LORRIES = 0.12
"""Share of lorries, which drive at most 90 km/h."""


def drive(
    overrides: tuple[str, ...], demand: float, visibility: float, seed: int, seconds: float, advised: float = math.inf
) -> Passages:
    """Vehicles that pass the loops, by demand on both lanes [1/h], visibility [m], seconds and advised speed [m/s]."""
    signs = StretchAdvice(advised, Stretch(edges=(_EDGE,)), Display.MESSAGE_SIGN)
    command = Command(stretches=(signs,)) if math.isfinite(advised) else Command()
    seen = passed(overrides, 2, _demand(demand), visibility, seed, _WARM_UP + seconds, command)
    return passages(seen, since=_WARM_UP)


def _demand(demand: float) -> str:
    cars = "".join(
        f'<vType id="car{i}" vClass="passenger" tau="{headway}" speedFactor="normc(1,0.1,0.7,1.3)" '
        f'probability="{(1.0 - _LORRIES) / len(_HEADWAYS)}"/>'
        for i, headway in enumerate(_HEADWAYS)
    )
    return (
        f'<vTypeDistribution id="mixed">{cars}<vType id="lorry" vClass="truck" length="12" maxSpeed="25" '
        f'tau="1.8" speedFactor="normc(1,0.05,0.8,1.2)" probability="{_LORRIES}"/></vTypeDistribution>'
        f'<flow id="f" type="mixed" route="r" begin="0" end="1000000" period="exp({demand / 3600.0})" '
        'departLane="random" departSpeed="max" departPos="base"/>'
    )
