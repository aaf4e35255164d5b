"""Entities of a file: vehicles with SUMO's class, size and performance."""

from dataclasses import dataclass

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.elements import HARMLESS
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node, sumo_name
from fogsim.values.traffic import BOX, PEDESTRIAN

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

_ASIDE = 0.1  # Distance between the middles of axle and body that is none [m]
_RUNNER = 10.0  # Top speed of persons and obstacles, and their acceleration [m/s, m/s²]
_ON_FOOT = ("pedestrian", "wheelchair", "animal")
_UPRIGHT = (
    *("none", "obstacle", "barrier", "railing", "soundBarrier", "trafficIsland"),
    *("pole", "streetLamp", "tree", "vegetation", "building"),
)
_TAKEN = ("fog", "light")
_EGO_NAMES = ("ego", "hero", "ego_vehicle", "egovehicle")


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle: its size [m] and limits [m/s, m/s²].

    `front` is the distance from its reference point, the middle of the rear axle, to the front bumper [m]. Persons and
    obstacles have a `body`, and no lamps.
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
    body: str = ""

    @property
    def rear(self) -> float:
        """From the rear bumper to the reference point [m]."""
        return self.length - self.front


def read_vehicles(entities: Node, catalogs: Catalogs) -> dict[str, Vehicle]:
    """Vehicles by name; other entities become findings."""
    found: dict[str, Vehicle] = {}
    for entity in entities.all("ScenarioObject"):
        name = sumo_name(entity.get("name"))
        if not name or name in _TAKEN or name in found:
            message = f"expected a name of its own, which is not {' or '.join(_TAKEN)}"
            catalogs.findings.refuse(entity, f"{message}; got {name!r}")
            continue
        for controller in entity.all("ObjectController"):
            if controller.children or controller.attributes:
                catalogs.findings.leave_out(controller, HARMLESS["ObjectController"])
        reference = entity.one("CatalogReference")
        node = catalogs.entry(reference) if reference else entity.one("Vehicle", "Pedestrian", "MiscObject")
        if node is None:
            if reference is None:
                catalogs.findings.refuse(entity, "expected a Vehicle, Pedestrian, MiscObject or reference to one")
            continue
        found[name] = (_vehicle if node.tag == "Vehicle" else _other)(name, node, catalogs)
        if reference:
            catalogs.findings.look_for_unread(node)
    return found


def _vehicle(name: str, node: Node, catalogs: Catalogs) -> Vehicle:
    findings = catalogs.findings
    category = findings.word(node, "vehicleCategory", tuple(CLASSES), "car")
    for trailer in node.all("Trailer"):
        if any(one.tag != "TrailerRef" or one.get("entityRef") for one in trailer.all()):
            findings.refuse(trailer, "vehicles have no trailers; describe the whole as one vehicle")
    performance, size = node.one("Performance"), _size(node, findings)
    if performance is None:
        findings.refuse(node, "a vehicle needs a Performance")
        return Vehicle(name, node, category, *size, 55.0, 3.0, 9.0)
    speed, up, down = (findings.number(performance, f"max{key}") for key in ("Speed", "Acceleration", "Deceleration"))
    limits = min(max(speed, 0.1), 138.0), min(max(up, 0.1), 50.0), min(max(down, 0.1), 50.0)
    return Vehicle(name, node, category, *size, *limits)


def _size(node: Node, findings: Findings) -> tuple[float, float, float, float]:
    """Length, width, height, and from the reference point to the front [m]."""
    box = node.one("BoundingBox")
    centre, size = (box.one("Center"), box.one("Dimensions")) if box else (None, None)
    if centre is None or size is None:
        findings.refuse(node, f"a {node.tag} needs a BoundingBox with Center and Dimensions")
        return 4.6, 1.85, 1.5, 3.7
    length, width, height = (findings.number(size, key) for key in ("length", "width", "height"))
    centre.get("z")  # All stand on the road.
    if abs(findings.number(centre, "y")) > _ASIDE:
        findings.refuse(centre, "y: a body lies about its reference point to the left and right alike; write 0")
    return max(length, 0.2), max(width, 0.2), max(height, 0.2), findings.number(centre, "x") + 0.5 * length


def _other(name: str, node: Node, catalogs: Catalogs) -> Vehicle:
    """A person, or an obstacle, which FogSim draws as a box; either is on a lane and no faster than a runner."""
    key, known = ("pedestrianCategory", _ON_FOOT) if node.tag == "Pedestrian" else ("miscObjectCategory", _UPRIGHT)
    kind = catalogs.findings.word(node, key, known)
    # Wheelchairs and animals have no figure.
    body = PEDESTRIAN if kind == "pedestrian" else BOX
    return Vehicle(name, node, kind, *_size(node, catalogs.findings), _RUNNER, _RUNNER, _RUNNER, body)


def ego_of(vehicles: dict[str, Vehicle]) -> str:
    """Name of the ego: a vehicle with a usual name (``Ego``, ``hero``), otherwise the first."""
    driven = [name for name, vehicle in vehicles.items() if not vehicle.body]
    return next((name for name in driven if name.lower() in _EGO_NAMES), next(iter(driven), "ego"))
