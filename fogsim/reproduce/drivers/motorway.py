"""A motorway with a cross-section at which vehicles are counted, as loops in the road count them.

Two lanes, straight and level, limit 70 mph as on the M4; vehicles come at random (Poisson), 12 % of them are lorries.
Nothing stands in the way. SUMO's instantaneous loops write every passage into a file, which is read.
"""

import math
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

from fogsim.atmosphere import FieldAccess
from fogsim.reproduce.drivers.passages import Passages, passages
from fogsim.scenario import build, load_scenario
from fogsim.traffic import AfterCollision, TrafficSetup, libsumo_traffic
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import Command, FogField

LANES, WIDTH = 2, 3.75
LENGTH, LOOPS_AT = 2700.0, 2500.0
"""Length of the road and place of the loops on it [m]."""

LIMIT = 31.3
"""Speed limit, 70 mph [m/s]."""

STEP = 0.2
"""SUMO's step [s]."""

WARM_UP = 300.0
"""Before this time nothing counts: the road fills [s]."""

HEADWAYS = (0.5, 0.8, 1.1, 1.5, 2.0)
"""Gaps that drivers of cars keep in clear air, of equal shares [s]: field headways spread about as much."""

LORRIES = 0.12
"""Share of lorries, which drive at most 90 km/h."""


def drive(
    overrides: tuple[str, ...], demand: float, visibility: float, seed: int, seconds: float, advised: float = math.inf
) -> Passages:
    """Let traffic drive, and tell who passed the loops.

    Parameters
    ----------
    overrides : tuple of str
        What is set in the drivers' scenario.
    demand : float
        Vehicles that want to enter, on both lanes [vehicles/h].
    visibility : float
        V_met [m]; ``inf`` in clear air.
    seed : int
        Seed of the run.
    seconds : float
        For how long the loops are watched, once the road has filled [s].
    advised : float
        Speed that signs advise to everyone [m/s]; ``inf`` for none.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        traffic = libsumo_traffic(_setup(folder, overrides, demand))
        extinction = extinction_from_visibility(visibility) if math.isfinite(visibility) else 0.0
        traffic.enter_fog(FieldAccess(FogField(extinction, (0.0, 0.0, 0.0))))
        command = _signs(demand, seconds, advised)
        try:
            traffic.start(seed)
            for _ in range(round((WARM_UP + seconds) / STEP)):
                traffic.advance(command)
        finally:
            # SUMO writes the loops' file to its end only now.
            traffic.close()
        return passages(_events(folder / "loops.xml"), since=WARM_UP)


def _setup(folder: Path, overrides: tuple[str, ...], demand: float) -> TrafficSetup:
    """The simulation, its drivers as a scenario has them."""
    scenario = load_scenario("motorway_fog_bank", list(overrides))
    return replace(
        build.traffic_setup(scenario),
        net=_net(folder / "motorway.net.xml"),
        routes=(_demand(folder / "motorway.rou.xml", demand),),
        additional=(_loops(folder / "motorway.add.xml"),),
        ego="first",
        events=(),
        keep_lane=(),
        step_length=STEP,
        # Whoever collides vanishes: a pile would be all that is counted behind it.
        after_collision=AfterCollision.REMOVE,
    )


def _net(path: Path) -> Path:
    y = [-(LANES - 0.5 - lane) * WIDTH for lane in range(LANES)]
    lanes = "".join(
        f'<lane id="road_{i}" index="{i}" speed="{LIMIT}" length="{LENGTH}" shape="0,{y[i]} {LENGTH},{y[i]}"/>'
        for i in range(LANES)
    )
    incoming = " ".join(f"road_{i}" for i in range(LANES))
    path.write_text(
        f'<net version="1.20"><edge id="road" from="a" to="b" priority="1">{lanes}</edge>'
        '<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-8"/>'
        f'<junction id="b" type="dead_end" x="{LENGTH}" y="0" incLanes="{incoming}" intLanes="" '
        f'shape="{LENGTH},-8 {LENGTH},0"/></net>',
        encoding="utf-8",
    )
    return path


def _demand(path: Path, demand: float) -> Path:
    """Vehicles at random; the ego drives ahead of them all, faster than they, and nobody meets it."""
    cars = "".join(
        f'<vType id="car{i}" vClass="passenger" tau="{headway}" speedFactor="normc(1,0.1,0.7,1.3)" '
        f'probability="{(1.0 - LORRIES) / len(HEADWAYS)}"/>'
        for i, headway in enumerate(HEADWAYS)
    )
    path.write_text(
        f'<routes><vTypeDistribution id="mixed">{cars}<vType id="lorry" vClass="truck" length="12" maxSpeed="25" '
        f'tau="1.8" speedFactor="normc(1,0.05,0.8,1.2)" probability="{LORRIES}"/></vTypeDistribution>'
        '<vType id="fast" vClass="passenger" speedFactor="1.3"/><route id="r" edges="road"/>'
        f'<vehicle id="first" type="fast" route="r" depart="0" departLane="{LANES - 1}" departSpeed="max"/>'
        f'<flow id="f" type="mixed" route="r" begin="0" end="1000000" period="exp({demand / 3600.0})" '
        'departLane="random" departSpeed="max" departPos="base"/></routes>',
        encoding="utf-8",
    )
    return path


def _loops(path: Path) -> Path:
    loops = "".join(
        f'<instantInductionLoop id="{i}" lane="road_{i}" pos="{LOOPS_AT}" file="loops.xml"/>' for i in range(LANES)
    )
    path.write_text(f"<additional>{loops}</additional>", encoding="utf-8")
    return path


def _signs(demand: float, seconds: float, advised: float) -> Command:
    """What a sign at the road's beginning tells whoever comes."""
    if math.isinf(advised):
        return Command()
    # SUMO numbers the vehicles of a flow; so many more than are expected do not come.
    expected = demand / 3600.0 * (WARM_UP + seconds)
    return Command(advised_speeds={f"f.{i}": advised for i in range(round(expected + 6.0 * math.sqrt(expected) + 10))})


def advised_speed(kmh: float) -> float:
    """Advised speed [m/s] of a sign's number [km/h].

    Parameters
    ----------
    kmh : float
        The number.
    """
    return kmh / KMH_PER_MPS


def _events(path: Path) -> Iterator[dict[str, str]]:
    for _, element in ET.iterparse(path):  # noqa: S314 - SUMO has just written it
        if element.tag == "instantOut":
            yield element.attrib
            element.clear()
