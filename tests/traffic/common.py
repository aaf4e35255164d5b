"""What tests of the traffic share: the motorway, even fog, and what is seen of a simulation."""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from early_motorway import ROUTES

from fogsim.atmosphere import FieldAccess
from fogsim.traffic import FogAccess, Traffic, TrafficSetup, libsumo_traffic
from fogsim.traffic.road import network
from fogsim.units import extinction_from_visibility
from fogsim.values import Collision, Command, FogField, TrafficSnapshot, TrafficState

DATA = Path(__file__).resolve().parents[1] / "data"
MOTORWAY = DATA.parents[1] / "scenarios" / "motorway_fog_bank"
NET = MOTORWAY / "motorway.net.xml"
QUIET = ("--no-step-log", "true", "--no-warnings", "true")
CROWD = (*("--net-file", str(NET), "--route-files", str(ROUTES)), *("--step-length", "0.1", "--seed", "5", *QUIET))
"""SUMO's command line for the motorway's own traffic."""

SETUP = TrafficSetup(
    net=NET,
    routes=(ROUTES,),
    additional=(MOTORWAY / "signs.add.xml",),
    ego="ego",
    step_length=0.1,
    keep_lane=("ego", "lead"),
    warm_up_limit=600.0,
    advice_deceleration=2.0,
    reading_radius=800.0,
)
"""The motorway with an ego that enters early."""


def setup_of(folder: Path, routes: str, keep_lane: Sequence[str] = (), step: float = 0.1) -> TrafficSetup:
    """The motorway with other vehicles, all of which are read."""
    file = folder / "demand.rou.xml"
    file.write_text(routes, encoding="utf-8")
    return TrafficSetup(
        net=NET,
        routes=(file,),
        additional=(),
        ego="ego",
        step_length=step,
        keep_lane=tuple(keep_lane),
        warm_up_limit=60.0,
        advice_deceleration=2.0,
        reading_radius=6000.0,
    )


def configured(folder: Path, net: Path, routes: str | Path, *options: str, additional: str | Path = "") -> Path:
    """A SUMO configuration of a network and the text of a demand, or its file, with further elements."""
    if isinstance(routes, str):
        (folder / "mine.rou.xml").write_text(routes, encoding="utf-8")
        routes = Path("mine.rou.xml")
    files = f'<net-file value="{net}"/><route-files value="{routes}"/>'
    more = f'<additional-files value="{additional}"/>' if additional else ""
    config = folder / "mine.sumocfg"
    config.write_text(f"<configuration>{files}{more}{''.join(options)}</configuration>", encoding="utf-8")
    return config


def networks_parsed(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Networks that are parsed from now on, to which each is added."""
    paths, parse = list[Path](), network._parsed
    monkeypatch.setattr(network, "_parsed", lambda path: paths.append(path) or parse(path))
    return paths


@contextlib.contextmanager
def running(setup: TrafficSetup, fog: FogAccess | None = None, seed: int = 1) -> Iterator[Any]:
    """Traffic in this process that has been started, in a fog if one is given."""
    with contextlib.closing(libsumo_traffic(setup)) as traffic:
        if fog is not None:
            traffic.enter_fog(fog)
        traffic.start(seed)
        yield traffic


def even(visibility: float) -> FieldAccess:
    return FieldAccess(FogField(extinction_from_visibility(visibility), (3000.0,) * 3))


def seen(traffic: Traffic) -> TrafficSnapshot:
    snapshot = traffic.observe()
    assert snapshot is not None
    return snapshot


def driven(traffic: Traffic, steps: int, command: Command | None = None) -> list[TrafficSnapshot]:
    """What is seen after each step."""
    snapshots = []
    for _ in range(steps):
        traffic.advance(command or Command())
        snapshots.append(seen(traffic))
    return snapshots


def hits_of(snapshots: Sequence[TrafficSnapshot]) -> list[Collision]:
    return [hit for snapshot in snapshots for hit in snapshot.collisions]


def speeds_of(snapshots: Sequence[TrafficSnapshot]) -> dict[str, list[float]]:
    """Speeds of all vehicles, from the snapshot on in which they are first seen."""
    speeds: dict[str, list[float]] = {}
    for snapshot in snapshots:
        for vehicle, speed in zip(snapshot.state.ids, snapshot.state.speed.tolist(), strict=True):
            speeds.setdefault(vehicle, []).append(speed)
    return speeds


def heard(state: TrafficState) -> Mapping[str, float]:
    """What those have heard advised who have heard anything."""
    return {v: s for v, s in zip(state.ids, state.advised_speed.tolist(), strict=False) if s < math.inf}
