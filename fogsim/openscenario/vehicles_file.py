"""SUMO's route file for the vehicles of a file."""

from collections.abc import Mapping

from fogsim.openscenario.entities import CLASSES, Vehicle
from fogsim.openscenario.initial import Beginning
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, Spot
from fogsim.traffic.templates.xml_text import element

STANDS = 0.1
"""Speed below which a vehicle has no desired speed to keep [m/s]."""


def front_spot(vehicle: Vehicle, spot: Spot, lanes: OpenDriveLanes) -> Spot:
    """Place of a vehicle's front bumper from its reference point; ValueError if the road ends before it."""
    return lanes.along(spot, vehicle.front)


def vehicles_text(vehicles: Mapping[str, Vehicle], begin: Beginning, lanes: OpenDriveLanes) -> str:
    """Text of the route file: every vehicle is present from the start, with its initial position and speed."""
    lines = []
    for name, vehicle in vehicles.items():
        front = front_spot(vehicle, begin.spots[name], lanes)
        speed = begin.speed(name)
        lines += [
            "  " + element("vType", id=f"type.{name}", **_type(vehicle, speed, front.lane.limit)),
            "  " + element("route", id=f"route.{name}", edges=" ".join(lanes.route(front.lane.edge))),
            "  "
            + element(
                "vehicle",
                id=name,
                type=f"type.{name}",
                route=f"route.{name}",
                depart="0",
                departLane=front.lane.index,
                departPos=f"{front.position:.3f}",
                departSpeed=f"{speed:.4f}",
                # Exactly where the file has it, however near to the next vehicle.
                insertionChecks="collision",
            ),
        ]
    return '<?xml version="1.0" encoding="UTF-8"?>\n<routes>\n' + "\n".join(lines) + "\n</routes>\n"


def _type(vehicle: Vehicle, speed: float, limit: float) -> dict[str, object]:
    """Attributes of a separate type; its driver's desired speed is the initial one."""
    return {
        "vClass": CLASSES[vehicle.category],
        "length": f"{vehicle.length:g}",
        "width": f"{vehicle.width:g}",
        "height": f"{vehicle.height:g}",
        "maxSpeed": f"{vehicle.top_speed:g}",
        "accel": f"{vehicle.acceleration:g}",
        "decel": f"{vehicle.deceleration:g}",
        "emergencyDecel": f"{vehicle.deceleration:g}",
        "speedFactor": f"{speed / limit if speed > STANDS else 1.0:.6f}",
        "speedDev": "0",
        "sigma": "0",
    }
