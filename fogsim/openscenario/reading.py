"""An OpenSCENARIO file as the plain data of a scenario file, with its SUMO files."""

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fogsim.core.files.readers import find_map
from fogsim.core.files.user_cache import write_generated
from fogsim.errors import InputError
from fogsim.openscenario.actions import Actions
from fogsim.openscenario.environment import CLASSES, HABITS, Vehicle, fog_block, read_vehicles
from fogsim.openscenario.initial import Beginning
from fogsim.openscenario.lateral import MOTION
from fogsim.openscenario.parameters import Catalogs, put_parameters, to_standard
from fogsim.openscenario.positions import Positions
from fogsim.openscenario.states import free_name
from fogsim.openscenario.storyboard import Storyboard
from fogsim.openscenario.triggers import NEAR_THE_END, Trigger, Triggers, timeline_entry
from fogsim.openscenario.xml_tree import Node, read_xml
from fogsim.traffic.appearance import BODY_PARAMETER
from fogsim.traffic.road.netconvert import map_net
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.traffic.road.opendrive_lanes import read_opendrive_lanes
from fogsim.traffic.templates.xml_text import element, opening
from fogsim.units import KMH_PER_MPS

_USUAL_DURATION = 120.0  # Longest simulated time of a file without a stop trigger [s]
_LONGEST = 3600.0  # The same of one whose stop trigger is more than a time [s]
_FOREVER = 1e6  # Later times are meant never to come [s].
_STANDS = 0.1  # Speed below which a vehicle has no desired speed to keep [m/s]
_CONTROLLERS = ("ObjectController", "AssignControllerAction", "ActivateControllerAction")
_FOR_THE_ROUTE_ALONE = {"lcSpeedGain": 0, "lcKeepRight": 0, "lcCooperative": 0, "lcOpposite": 0}
"""Attributes of drivers who change lane where their route needs it, and for nothing else."""


@dataclass(frozen=True, slots=True)
class ScenarioData:
    """Plain data of a scenario, as a YAML file would hold it, and the lines of the elements behind its keys."""

    data: dict[str, Any]
    lines: Mapping[tuple[str | int, ...], int] = field(default_factory=dict)


def is_openscenario(path: Path) -> bool:
    """Whether a file is OpenSCENARIO XML, by its name."""
    return path.suffix.lower() == ".xosc"


def read_openscenario(
    path: Path, values: Mapping[str, str] = MappingProxyType({}), *, with_oncoming: bool = False
) -> ScenarioData:
    """Read an OpenSCENARIO XML 1.x file as the data of a scenario file; `values` replace those of its parameters.

    InputError has a line for each element that FogSim cannot do; MissingDependencyError if netconvert is missing.
    """
    root = read_xml(path)
    if root.tag != "OpenSCENARIO":
        raise InputError(f"{path}:{root.line}: expected <OpenSCENARIO> at its top, got <{root.tag}>")
    header = root.one("FileHeader")
    major = header.get("revMajor") if header else ""
    if major != "1":
        hint = "; ASAM's package of 1.0 has a stylesheet that migrates files of 0.9" if major == "0" else ""
        message = f"expected OpenSCENARIO XML 1.x (FileHeader's revMajor), got {major or 'none'!r}{hint}"
        raise InputError(f"{path}:{root.line}: {message}")
    for one in (one for block in root.all("ParameterDeclarations") for one in block.children):
        one.attributes["value"] = values.get(one.name, one.attributes.get("value", ""))
    put_parameters(root, {})
    to_standard(root)
    catalogs = Catalogs(root)
    entities, storyboard = root.one("Entities"), root.one("Storyboard")
    if entities is None or storyboard is None:
        raise InputError(f"{path}: expected Entities and a Storyboard; catalogs and parameter files cannot be run")
    opendrive = _opendrive(root)
    net = map_net(opendrive, with_oncoming=with_oncoming)
    lanes = read_opendrive_lanes(net, opendrive)
    positions = Positions(lanes, catalogs, read_vehicles(entities, catalogs))
    story = Storyboard(Actions(positions), root)
    begin = _begin(storyboard, story)
    if positions.with_oncoming and not with_oncoming:
        # Vehicles drive on the oncoming lane, which this network does not lead to.
        return read_openscenario(path, values, with_oncoming=True)
    read = _scenario(storyboard, story, begin)
    ego = positions.vehicles.ego
    ordered = (begin.effect, *(one.effect for one in story.entries.values()))
    driven = "" if any(MOTION & one.do.get(ego, {}).keys() for one in ordered) else ego
    files = write_generated("openscenario", {"road.net.xml": net, "road.rou.xml": _vehicles_text(begin, driven)})
    read.data["traffic"] |= {
        "net": str(files / "road.net.xml"),
        "routes": [str(files / "road.rou.xml")],
        "additional": [str(opendrive.resolve())] if is_opendrive(opendrive) else [],
    }
    return read


def _opendrive(root: Node) -> Path:
    root.within("RoadNetwork", "TrafficSignals")
    file = root.within("RoadNetwork", "LogicFile")
    if file is None:
        message = "a LogicFile (OpenDRIVE, .xodr) is needed, for vehicles drive on roads"
        raise InputError(f"{root.file}: RoadNetwork: {message}")
    try:
        return find_map(file.get("filepath"), root.file.parent)
    except InputError as error:
        raise InputError(f"{file.where}: {error}") from error


def _begin(storyboard: Node, story: Storyboard) -> Beginning:
    """Initial state, and the events; InputError without an ego on the road, along whose route positions count."""
    root, positions = story.root, story.actions.positions
    begin, vehicles = Beginning(story.actions), positions.vehicles
    begin.read(storyboard.one("Init"), story.places_at_once(storyboard))
    if vehicles.ego not in positions.spots:
        root.refuse(f"no vehicle that could be the ego has a place; there are {len(vehicles)}")
        root.findings.close(root.file)
    groups = [one for one in storyboard.walk() if one.tag == "Actors"]
    actors = {name for group in groups for name in vehicles.selected(group.all("EntityRef"))}
    positions.moving |= {vehicles.ego, *actors, *(name for name in vehicles if begin.moves(name))}
    story.beginning = begin.effect
    story.find_events(storyboard)
    return begin


def _scenario(storyboard: Node, story: Storyboard, begin: Beginning) -> ScenarioData:
    root, positions = story.root, begin.positions
    ego, lanes, routed = positions.vehicles.ego, positions.lanes, {*begin.effect.routes, *positions.rerouted}
    route = positions.ways[ego]
    story.triggers = Triggers(positions, story.state, story.value)
    entries = story.timeline()
    stop = story.triggers.trigger(storyboard.one("StopTrigger"))
    way = [one for edge in route for one in lanes.lanes if one.edge == edge and one.index == 0]
    fog = fog_block(
        begin.environment, np.concatenate([one.shape for one in way]), min(float(one.heights.min()) for one in way)
    )
    if begin.environment.box and not fog["banks"]:
        root.remark("the BoundingBox of the fog lies next to the ego's route: the air is clear there")
    if ego not in {*begin.orders, *begin.aims} and any(one.tag in _CONTROLLERS for one in root.walk()):
        positions.vehicles[ego].node.remark(
            f"{ego} has no SpeedAction in Init: it stands until the storyboard orders a speed"
        )
    description = root.need("FileHeader").get("description")
    root.check_read()
    root.findings.close(root.file)
    for _, block in entries:
        # What is ordered for the very beginning is the initial speed.
        is_at_once = block["when"] == "time >= 0 s" and "delay_s" not in block
        for vehicle, done in block["do"].items() if is_at_once else ():
            if isinstance(done, dict) and done.get("speed", {}).get("shape") == "step":
                begin.orders.setdefault(vehicle, done["speed"])
    for name, vehicle in positions.vehicles.items():
        if vehicle.body:
            begin.effect.add(name, **vehicle.lamps)
    entries += story.triggers.marks
    first, light = _initial(begin, {block["name"] for _, block in entries}), begin.environment.illuminance
    timeline = [*first, *(block for _, block in entries)]
    data = {
        "description": description,
        "name": re.sub(r"[^A-Za-z0-9_.-]", "_", root.file.stem)[:100],
        "traffic": {
            "ego": ego,
            "keep_lane": [name for name in positions.vehicles if name not in routed],
            "stop_before_end_m": NEAR_THE_END,
        },
        "fog": fog,
        **({} if light is None else {"light": {"illuminance_lx": float(f"{light:.4g}")}}),
        "timeline": timeline,
        **_ending(stop, timeline, storyboard),
        "expect": {name: {"happened": name} for name in story.expected(stop)},
    }
    return ScenarioData(data, {("timeline", i): node.line for i, (node, _) in enumerate(entries, start=len(first))})


def _initial(begin: Beginning, taken: set[str]) -> list[dict[str, Any]]:
    """Entries of the timeline for the initial state: speeds of all but the ego, lamps, and who comes off the lanes."""
    off_lanes = begin.positions.off_lanes
    for name in begin.positions.spots:
        speed = begin.speed(name)
        moves = begin.effect.do.get(name, {}).keys() & {"speed", "follow"}
        if not moves and (name != begin.positions.vehicles.ego or speed <= _STANDS):
            begin.effect.add(name, speed={"to_kmh": speed * KMH_PER_MPS, "shape": "step"})
    there = {name: done for name, done in begin.effect.do.items() if name in begin.positions.spots}
    comes = {name: {"path": begin.effect.do[name].pop("path")} for name in off_lanes}
    later = {name: done for name in off_lanes if (done := begin.effect.do[name])}
    parts = {"Init": there, "Init_off_the_lanes": comes, "Init_once_there": later}
    return [{"name": free_name(name, taken), "when": "time >= 0 s", "do": do} for name, do in parts.items() if do]


def _ending(stop: Trigger | None, timeline: list[dict[str, Any]], node: Node) -> dict[str, Any]:
    if stop is None or not stop.condition:
        return {"duration_s": _USUAL_DURATION}
    if stop.at is not None:
        return {"duration_s": min(max(stop.at, 0.1), _FOREVER)}
    if not stop.delay:
        return {"duration_s": _LONGEST, "end_when": stop.condition}
    name = free_name("stop", {one["name"] for one in timeline})
    timeline.append(timeline_entry(node, name, stop, {})[1])
    return {"duration_s": _LONGEST, "end_when": f"happened({name})"}


def _vehicles_text(begin: Beginning, driven: str) -> str:
    """Text of the route file: vehicles present from the start; the `driven` one keeps its driver throughout."""
    routed = {*begin.effect.routes, *begin.positions.rerouted}
    lines, ways = ['<?xml version="1.0" encoding="UTF-8"?>', "<routes>"], begin.positions.ways
    for name, vehicle in begin.positions.vehicles.items():
        front, speed = begin.fronts.get(name), begin.speed(name)
        # Who begins off the lanes comes when its path begins.
        place: dict[str, object] = {"depart": "triggered", "departSpeed": f"{speed:.4f}"}
        if front is not None:
            place = {
                "depart": "0",
                "departLane": front.lane.index,
                "departPos": f"{front.position:.3f}",
                "departPosLat": f"{front.offset:.3f}",
                "departSpeed": f"{speed:.4f}",
                # Exactly where the file has it, however near to the next vehicle.
                "insertionChecks": "none",
            }
        # What a vehicle can do is no habit of its driver.
        habit = HABITS[vehicle.category] if name == driven else (math.inf, math.inf)
        limits = {front.lane.limit} if front else {math.inf}
        if name == driven:
            limits = {one.limit for one in begin.lanes.lanes if one.edge in ways[name]}
        aim = begin.aims.get(name, speed)
        own = _type(vehicle, max(aim, speed) if aim > _STANDS else aim, limits, *habit)
        own |= _FOR_THE_ROUTE_ALONE if name in routed else {}
        body = f'    <param key="{BODY_PARAMETER}" value="{vehicle.body}"/>'
        lines += [
            "  " + element("vType", id=f"type.{name}", **own),
            "  " + element("route", id=f"route.{name}", edges=" ".join(ways.get(name) or next(iter(ways.values())))),
            "  " + opening("vehicle", id=name, type=f"type.{name}", route=f"route.{name}", **place),
            *([body] if vehicle.body else ()),
            "  </vehicle>",
        ]
    return "\n".join([*lines, "</routes>", ""])


def _type(vehicle: Vehicle, speed: float, limits: Collection[float], most: float, hardest: float) -> dict[str, object]:
    """Attributes of a separate type, whose driver's desired speed is the initial one, whatever the limits on its way.

    Its driver speeds up and brakes by `most` and `hardest` at most [m/s²].
    """
    limit, drives = min(limits), speed > _STANDS
    return {
        # Persons and obstacles are on lanes of vehicles as well as on footways.
        "vClass": "ignoring" if vehicle.body else CLASSES[vehicle.category],
        "length": f"{vehicle.length:g}",
        "width": f"{vehicle.width:g}",
        "height": f"{vehicle.height:g}",
        "maxSpeed": f"{vehicle.top_speed:g}",
        **({"desiredMaxSpeed": f"{limit:g}"} if drives and len(limits) > 1 else {}),
        "accel": f"{min(vehicle.acceleration, most):g}",
        "decel": f"{min(vehicle.deceleration, hardest):g}",
        "emergencyDecel": f"{vehicle.deceleration:g}",
        "speedFactor": f"{speed / limit if drives and math.isfinite(limit) else 1.0:.6f}",
        "speedDev": "0",
        "sigma": "0",
    }
