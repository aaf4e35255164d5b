"""Entities of a file: vehicles with SUMO's class, size and performance."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from fogsim.openscenario.elements import HARMLESS
from fogsim.openscenario.parameters import Catalogs
from fogsim.openscenario.xml_tree import Node, NodeError, sumo_name
from fogsim.values.traffic import BOX, PEDESTRIAN

# SUMO's class of each vehicle category that is read
CLASSES = {"car": "passenger", "van": "delivery", "truck": "truck", "bus": "bus"}
CLASSES |= {"motorbike": "motorcycle", "bicycle": "bicycle", "train": "rail", "tram": "tram"}
_ASIDE = 0.1  # Distance between the middles of axle and body that is none [m]
_RUNNER = 10.0  # Top speed of persons and obstacles, and their acceleration [m/s, m/s²]
_THINGS: tuple[str, ...] = ("none", "obstacle", "barrier", "railing", "soundBarrier", "trafficIsland")
_THINGS += ("pole", "streetLamp", "tree", "vegetation", "building")
_CATEGORIES = {  # Attribute, its words, and the usual one
    "Vehicle": ("vehicleCategory", tuple(CLASSES), "car"),
    "Pedestrian": ("pedestrianCategory", ("pedestrian", "wheelchair", "animal"), ""),
    "MiscObject": ("miscObjectCategory", _THINGS, ""),
}
_TAKEN = ("fog", "light")
_EGO_NAMES = ("ego", "hero", "ego_vehicle", "egovehicle")
_WORD = re.compile(r"[A-Za-z_][\w:#@\-]*")


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle: its size [m] and limits [m/s, m/s²]; persons and obstacles have a `body`, and no lamps."""

    name: str
    node: Node
    category: str
    length: float
    width: float
    height: float
    front: float  # From its reference point, the middle of the rear axle, to the front bumper [m]
    top_speed: float = _RUNNER
    acceleration: float = _RUNNER
    deceleration: float = _RUNNER
    body: str = ""
    named: str = ""  # In timelines

    @property
    def called(self) -> str:
        """Its name in conditions."""
        return self.named if _WORD.fullmatch(self.named) else f'"{self.named}"'

    @property
    def rear(self) -> float:
        """From the rear bumper to the reference point [m]."""
        return self.length - self.front


class Vehicles(dict[str, Vehicle]):
    """Vehicles by name."""

    @property
    def ego(self) -> str:
        """Name of the ego: a vehicle with a usual name (``Ego``, ``hero``), otherwise the first."""
        driven = [name for name, vehicle in self.items() if not vehicle.body]
        return next((name for name in driven if name.lower() in _EGO_NAMES), next(iter(driven), "ego"))

    def of(self, node: Node, key: str = "entityRef") -> Vehicle:
        """The vehicle to which an element refers; ValueError if there is none."""
        if (name := node.get(key)) not in self:
            raise NodeError(node, f"there is no vehicle {name!r}")
        return self[name]

    def known(self, nodes: Iterable[Node]) -> list[Node]:
        """Those of some elements that refer to a vehicle; all others are refused."""
        found = []
        for one in nodes:
            with one.refusing():
                self.of(one)
                found.append(one)
        return found


def read_vehicles(entities: Node, catalogs: Catalogs) -> Vehicles:
    """Vehicles of a file; what is none becomes a finding."""
    found = Vehicles()
    for entity in entities.all("ScenarioObject"):
        name = sumo_name(entity.get("name"))
        if not name or name in _TAKEN or name in found:
            entity.refuse(f"expected a unique name other than {' or '.join(_TAKEN)}; got {name!r}")
            continue
        for controller in entity.all("ObjectController"):
            if controller.children or controller.attributes:
                controller.remark(HARMLESS["ObjectController"], is_whole=True)
        found[name] = Vehicle(name, entity, "car", 4.6, 1.85, 1.5, 3.7)
        with entity.refusing():
            found[name] = _vehicle(name, catalogs.need(entity, *_CATEGORIES))
    for name, vehicle in found.items():
        found[name] = replace(vehicle, named="ego" if name == found.ego else name)
    return found


def _vehicle(name: str, node: Node) -> Vehicle:
    """A vehicle, a person, or an obstacle, which FogSim draws as a box; both are no faster than a runner."""
    category = node.word(*_CATEGORIES.get(node.tag, _CATEGORIES["MiscObject"]))
    if node.tag != "Vehicle":
        # Wheelchairs and animals have no figure.
        return Vehicle(name, node, category, *_size(node), body=PEDESTRIAN if category == "pedestrian" else BOX)
    for trailer in node.all("Trailer"):
        if any(one.tag != "TrailerRef" or one.get("entityRef") for one in trailer.all()):
            trailer.refuse("vehicles have no trailers; describe the whole as one vehicle")
    performance, size = node.need("Performance"), _size(node)
    limits = {"Speed": 138.0, "Acceleration": 50.0, "Deceleration": 50.0}
    top, up, down = (min(max(performance.number(f"max{key}"), 0.1), most) for key, most in limits.items())
    return Vehicle(name, node, category, *size, top, up, down)


def _size(node: Node) -> tuple[float, float, float, float]:
    """Length, width, height, and from the reference point to the front [m]."""
    box = node.need("BoundingBox")
    centre, size = box.need("Center"), box.need("Dimensions")
    length, width, height = (size.number(key) for key in ("length", "width", "height"))
    centre.get("z")  # All stand on the road.
    if abs(centre.number("y")) > _ASIDE:
        centre.refuse("y: a body lies about its reference point to the left and right alike; write 0")
    return max(length, 0.2), max(width, 0.2), max(height, 0.2), centre.number("x") + 0.5 * length
