"""An OpenSCENARIO file as the plain data of a scenario file, with its SUMO files."""

import math
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fogsim.errors import InputError, LeftOutWarning
from fogsim.files.generated_files import write_generated
from fogsim.files.maps import find_map
from fogsim.openscenario.actions import Actions
from fogsim.openscenario.carla import to_standard
from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.entities import Vehicle, ego_of, read_vehicles
from fogsim.openscenario.environment import fog_block
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.initial import Beginning, along_route, read_beginning
from fogsim.openscenario.parameters import put_parameters
from fogsim.openscenario.positions import Positions
from fogsim.openscenario.storyboard import Storyboard
from fogsim.openscenario.triggers import Trigger, Triggers
from fogsim.openscenario.vehicles_file import STANDS, vehicles_text
from fogsim.openscenario.xml_tree import Node, read_xml, sumo_name
from fogsim.traffic.road.netconvert import map_net
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, read_opendrive_lanes
from fogsim.units import KMH_PER_MPS

USUAL_DURATION = 120.0
"""Longest simulated time of a file whose stop trigger has no time [s]."""

NEAR_THE_END = 10.0
"""Distance to the end of its route at which the ego has arrived [m]."""

Key = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class ScenarioData:
    """Plain data of a scenario, as a YAML file would hold it, and the lines of the elements behind its keys."""

    data: dict[str, Any]
    lines: Mapping[Key, int] = field(default_factory=dict)


def is_openscenario(path: Path) -> bool:
    """Whether a file is OpenSCENARIO XML, by its name."""
    return path.suffix.lower() == ".xosc"


def read_openscenario(
    path: Path, values: Mapping[str, str] = MappingProxyType({}), *, with_oncoming: bool = False
) -> ScenarioData:
    """Read an OpenSCENARIO XML 1.x file as the data of a scenario file; `values` replace those of its parameters.

    A file whose vehicles drive on the oncoming lane is read again on a network `with_oncoming` lanes.
    The network and the route file go to the user's cache directory. InputError has a line for each element that FogSim
    cannot do; MissingDependencyError if netconvert is missing.
    """
    root, findings = read_xml(path), Findings()
    if root.tag != "OpenSCENARIO":
        raise InputError(f"{path}:{root.line}: expected <OpenSCENARIO> at its top, got <{root.tag}>")
    _check_version(root)
    for block in root.all("ParameterDeclarations"):
        for one in block.children:
            one.attributes["value"] = values.get(one.attributes.get("name", ""), one.attributes.get("value", ""))
    put_parameters(root, {}, findings)
    to_standard(root, findings)
    catalogs = Catalogs(path.parent, root.one("CatalogLocations"), findings)
    entities, storyboard = root.one("Entities"), root.one("Storyboard")
    if entities is None or storyboard is None:
        raise InputError(f"{path}: expected Entities and a Storyboard; catalogs and parameter files cannot be run")
    opendrive = _opendrive(root, path)
    net = map_net(opendrive, with_oncoming=with_oncoming)
    lanes = read_opendrive_lanes(net, opendrive)
    vehicles = read_vehicles(entities, catalogs)
    reader = _Reader(path, root, findings, lanes, vehicles, storyboard, with_oncoming)
    return reader.scenario(catalogs, net, opendrive) or read_openscenario(path, values, with_oncoming=True)


def _check_version(root: Node) -> None:
    header = root.one("FileHeader")
    major = header.get("revMajor") if header else ""
    if major != "1":
        hint = "; ASAM's package of 1.0 has a stylesheet that migrates files of 0.9" if major == "0" else ""
        message = f"expected OpenSCENARIO XML 1.x (FileHeader's revMajor), got {major or 'none'!r}{hint}"
        raise InputError(f"{root.file}:{root.line}: {message}")


def _opendrive(root: Node, path: Path) -> Path:
    for network in root.all("RoadNetwork"):
        network.all("TrafficSignals")
    file = root.within("RoadNetwork", "LogicFile")
    if file is None:
        raise InputError(f"{path}: RoadNetwork: a LogicFile (OpenDRIVE, .xodr) is needed, for vehicles drive on roads")
    try:
        return find_map(file.get("filepath"), path.parent)
    except InputError as error:
        raise InputError(f"{file.where}: {error}") from error


@dataclass
class _Reader:
    path: Path
    root: Node
    findings: Findings
    lanes: OpenDriveLanes
    vehicles: Mapping[str, Vehicle]
    storyboard: Node
    with_oncoming: bool

    def scenario(self, catalogs: Catalogs, net: str, opendrive: Path) -> ScenarioData | None:
        """None if vehicles drive on the oncoming lane, and the network has no way to it."""
        ego = ego_of(dict(self.vehicles))
        positions = Positions(self.lanes, catalogs)
        story = Storyboard(
            catalogs, Actions(self.vehicles, catalogs, positions, lambda name: _called(name, ego)), self.root
        )
        actions = story.actions
        begin = read_beginning(self.storyboard.one("Init"), self.vehicles, actions)
        if ego not in begin.spots:
            # Without a route, no position along it can be measured.
            self.findings.refuse(
                self.root, f"no vehicle that could be the ego has a place; there are {len(self.vehicles)}"
            )
            self.findings.close(self.path)
        groups = [one for one in self.storyboard.walk() if one.tag == "Actors"]
        actors = {sumo_name(one.attributes.get("entityRef", "")) for group in groups for one in group.children}
        positions.moving |= {ego, *actors, *(name for name in self.vehicles if begin.speed(name))}
        story.find_events(self.storyboard)
        if positions.with_oncoming and not self.with_oncoming:
            return None
        route = begin.ways[ego]
        along = along_route(route, begin, self.vehicles, actions)
        end = math.inf if self.lanes.followers.get(route[-1]) else self.lanes.starts(route)[-1] - NEAR_THE_END
        story.triggers = triggers = Triggers(self.vehicles, ego, positions, along, story.state, story.value, end)
        entries = story.timeline()
        stop = triggers.trigger(self.storyboard.one("StopTrigger"))
        header = self.root.one("FileHeader")
        description = header.get("description") if header else ""
        self.findings.look_for_unread(self.root)
        self.findings.close(self.path)
        begin_at_once(entries, begin)
        for name, vehicle in self.vehicles.items():
            if vehicle.body:
                begin.effect.add(name, lamps={"all": "off"})
        data = {"description": description, **self._data(ego, begin, route)}
        if begin.environment.box is not None and not data["fog"]["banks"]:
            message = f"{self.path}: the BoundingBox of the fog lies beside the ego's way: the air is clear there"
            warnings.warn(message, LeftOutWarning, stacklevel=2)
        lines: dict[Key, int] = {}
        first = _initial(begin, ego)
        timeline = [*first, *(block for _, block in entries)]
        for place, (node, _) in enumerate(entries, start=len(first)):
            lines["timeline", place] = node.line
        for mark in triggers.marks:
            lines["timeline", len(timeline)] = mark.node.line
            timeline.append(_mark(mark.name, mark.trigger))
        data["timeline"] = timeline
        data |= _ending(stop, data["timeline"])
        data["expect"] = {entry.names[0]: {"happened": entry.names[0]} for entry in story.entries.values()}
        files = write_generated(
            "openscenario", {"road.net.xml": net, "road.rou.xml": vehicles_text(self.vehicles, begin)}
        )
        data["traffic"] |= {
            "net": str(files / "road.net.xml"),
            "routes": [str(files / "road.rou.xml")],
            "additional": [str(opendrive.resolve())] if is_opendrive(opendrive) else [],
        }
        return ScenarioData(data, lines)

    def _data(self, ego: str, begin: Beginning, route: tuple[str, ...]) -> dict[str, Any]:
        way = [one for edge in route for one in self.lanes.lanes if one.edge == edge and one.index == 0]
        light = begin.environment.illuminance
        return {
            "name": re.sub(r"[^A-Za-z0-9_.-]", "_", self.path.stem)[:100],
            "traffic": {
                "ego": ego,
                "keep_lane": [name for name in self.vehicles if name not in begin.routed],
                "stop_before_end_m": NEAR_THE_END,
            },
            "fog": fog_block(
                begin.environment, np.concatenate([one.shape for one in way]), min(one.lowest for one in way)
            ),
            **({} if light is None else {"light": {"illuminance_lx": float(f"{light:.4g}")}}),
        }


def _called(name: str, ego: str) -> str:
    return "ego" if name == ego else name


def begin_at_once(entries: list[tuple[Node, dict[str, Any]]], begin: Beginning) -> None:
    """Move speeds that are ordered for the very beginning from the timeline to the initial state."""
    for _, block in entries:
        for vehicle, done in block["do"].items() if block["when"] == "time >= 0 s" and "delay_s" not in block else ():
            speed = done.get("speed") if isinstance(done, dict) else None
            if speed is not None and speed.get("shape") == "step":
                begin.orders.setdefault(vehicle, speed)


def _initial(begin: Beginning, ego: str) -> list[dict[str, Any]]:
    """Entries of the timeline for the initial state: speeds of all but the ego, lamps, and who comes off the lanes."""
    for name in begin.spots:
        speed = begin.speed(name)
        moves = begin.effect.do.get(name, {}).keys() & {"speed", "follow"}
        if not moves and (name != ego or speed <= STANDS):
            begin.effect.add(name, speed={"to_kmh": speed * KMH_PER_MPS, "shape": "step"})
    there = {name: done for name, done in begin.effect.do.items() if name not in begin.off_lanes}
    comes = {name: {"path": begin.effect.do[name].pop("path")} for name in begin.off_lanes}
    later = {name: done for name in begin.off_lanes if (done := begin.effect.do[name])}
    parts = {"Init": there, "Init_off_the_lanes": comes, "Init_once_there": later}
    return [{"name": name, "when": "time >= 0 s", "do": done} for name, done in parts.items() if done]


def _mark(name: str, trigger: Trigger) -> dict[str, Any]:
    return {"name": name, "when": trigger.condition, **({"delay_s": trigger.delay} if trigger.delay else {}), "do": {}}


def _ending(stop: Trigger | None, timeline: list[dict[str, Any]]) -> dict[str, Any]:
    """When the run is over."""
    if stop is None or not stop.condition:
        return {"duration_s": USUAL_DURATION}
    if stop.at is not None:
        return {"duration_s": max(stop.at, 0.1)}
    if not stop.delay:
        return {"duration_s": USUAL_DURATION, "end_when": stop.condition}
    timeline.append(_mark("stop", stop))
    return {"duration_s": USUAL_DURATION, "end_when": "happened(stop)"}
