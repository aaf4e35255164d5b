"""A straight, level road with loops in it, and traffic that is let drive over them.

SUMO's instantaneous loops write every passage into a file, which is read.
"""

import math
import tempfile
from dataclasses import replace
from pathlib import Path

from fogsim.atmosphere import FieldAccess
from fogsim.core.files.xml_reader import read_tree
from fogsim.scenario import build, load_scenario
from fogsim.traffic import AfterCollision, Event, TrafficSetup, libsumo_traffic
from fogsim.units import extinction_from_visibility
from fogsim.values import Command, FogField

EDGE, EGO = "road", "first"
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
    f'<route id="r" edges="{EDGE}"/><vehicle id="{EGO}" type="fast" route="r" depart="0" departSpeed="max"/>'
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
        f'<instantInductionLoop id="{i}" lane="{EDGE}_{i}" pos="{_LOOPS_AT}" file="loops.xml"/>' for i in range(lanes)
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
        f'<lane id="{EDGE}_{i}" index="{i}" speed="{LIMIT}" length="{LENGTH}" shape="0,{y[i]} {LENGTH},{y[i]}"/>'
        for i in range(lanes)
    )
    incoming = " ".join(f"{EDGE}_{i}" for i in range(lanes))
    return (
        f'<net version="1.20"><edge id="{EDGE}" from="a" to="b" priority="1">{rows}</edge>'
        '<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-8"/>'
        f'<junction id="b" type="dead_end" x="{LENGTH}" y="0" incLanes="{incoming}" intLanes="" '
        f'shape="{LENGTH},-8 {LENGTH},0"/></net>'
    )
