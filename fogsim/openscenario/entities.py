"""Entities of a file: vehicles with SUMO's class, size and performance."""

import re
from dataclasses import dataclass

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.elements import HARMLESS
from fogsim.openscenario.xml_tree import Node

CLASSES = {
    "car": "passenger",
    "van": "delivery",
    "truck": "truck",
    "bus": "bus",
    "motorbike": "motorcycle",
    "bicycle": "bicycle",
    "train": "rail",
    "tram": "tram",
}
"""SUMO's class of each vehicle category that is read."""

_NAME = re.compile(r"[\w.:#@\-]+")
_ASIDE = 0.1  # Distance between the middles of axle and body that is none [m]
_TAKEN = ("fog", "light")
_EGO_NAMES = ("ego", "hero", "ego_vehicle", "egovehicle")


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle: its size [m] and limits [m/s, m/s²].

    `front` is the distance from its reference point, the middle of the rear axle, to the front bumper [m].
    """

    name: str
    node: Node
    category: str
    length: float
    width: float
    height: float
    front: float
    top_speed: float
    acceleration: float
    deceleration: float

    @property
    def rear(self) -> float:
        """From the rear bumper to the reference point [m]."""
        return self.length - self.front


def read_vehicles(entities: Node, catalogs: Catalogs) -> dict[str, Vehicle]:
    """Vehicles by name; other entities become findings."""
    found: dict[str, Vehicle] = {}
    for entity in entities.all("ScenarioObject"):
        name = entity.get("name")
        if not _NAME.fullmatch(name) or name in _TAKEN or name in found:
            told = f"expected a name of its own of letters, digits and _ . : # @ -, which is not {' or '.join(_TAKEN)}"
            catalogs.findings.refuse(entity, f"{told}; got {name!r}")
            continue
        for controller in entity.all("ObjectController"):
            if controller.children or controller.attributes:
                catalogs.findings.leave_out(controller, HARMLESS["ObjectController"])
        reference = entity.one("CatalogReference")
        node = catalogs.entry(reference) if reference else entity.one("Vehicle", "Pedestrian", "MiscObject")
        if node is None:
            if reference is None:
                catalogs.findings.refuse(entity, "expected a Vehicle or a CatalogReference to one")
            continue
        if node.tag != "Vehicle":
            catalogs.findings.refuse(entity, f"{name} is a {node.tag}; vehicles are read, and nothing else")
            continue
        found[name] = _vehicle(name, node, catalogs)
        if reference:
            catalogs.findings.look_for_unread(node)
    return found


def _vehicle(name: str, node: Node, catalogs: Catalogs) -> Vehicle:
    findings = catalogs.findings
    category = findings.word(node, "vehicleCategory", tuple(CLASSES), "car")
    for trailer in node.all("Trailer"):
        if any(one.tag != "TrailerRef" or one.get("entityRef") for one in trailer.all()):
            findings.refuse(trailer, "vehicles have no trailers; describe the whole as one vehicle")
    box, performance = node.one("BoundingBox"), node.one("Performance")
    centre, size = (box.one("Center"), box.one("Dimensions")) if box else (None, None)
    if performance is None or centre is None or size is None:
        findings.refuse(node, "a vehicle needs a BoundingBox with Center and Dimensions, and a Performance")
        return Vehicle(name, node, category, 4.6, 1.85, 1.5, 3.7, 55.0, 3.0, 9.0)
    length, width, height = (findings.number(size, key) for key in ("length", "width", "height"))
    centre.get("z")  # A vehicle stands on the road.
    if abs(findings.number(centre, "y")) > _ASIDE:
        findings.refuse(centre, "y: a body lies about its reference point to the left and right alike; write 0")
    speed, up, down = (findings.number(performance, f"max{key}") for key in ("Speed", "Acceleration", "Deceleration"))
    return Vehicle(
        name,
        node,
        category,
        max(length, 0.2),
        max(width, 0.2),
        max(height, 0.2),
        findings.number(centre, "x") + 0.5 * length,
        min(max(speed, 0.1), 138.0),
        min(max(up, 0.1), 50.0),
        min(max(down, 0.1), 50.0),
    )


def ego_of(vehicles: dict[str, Vehicle]) -> str:
    """Name of the ego: a vehicle with a usual name (``Ego``, ``hero``), otherwise the first."""
    return next((name for name in vehicles if name.lower() in _EGO_NAMES), next(iter(vehicles), "ego"))
