"""SUMO's route file for the vehicles of a file."""

import math
from collections.abc import Mapping

from fogsim.openscenario.entities import CLASSES, Vehicle
from fogsim.openscenario.initial import Beginning
from fogsim.traffic.appearance import BODY_PARAMETER
from fogsim.traffic.road.opendrive_lanes import Spot
from fogsim.traffic.templates.xml_text import element, opening

STANDS = 0.1
"""Speed below which a vehicle has no desired speed to keep [m/s]."""


_FOR_THE_ROUTE_ALONE = {"lcSpeedGain": 0, "lcKeepRight": 0, "lcCooperative": 0, "lcOpposite": 0}
"""Attributes of drivers who change lane where their route needs it, and for nothing else."""


def vehicles_text(vehicles: Mapping[str, Vehicle], begin: Beginning) -> str:
    """Text of the route file: every vehicle is present from the start, with its initial position and speed."""
    lines = []
    for name, vehicle in vehicles.items():
        front, speed, way = begin.fronts.get(name), begin.speed(name), begin.ways.get(name)
        # Who begins off the lanes comes when its path begins.
        place = {"depart": "triggered", "departSpeed": f"{speed:.4f}"} if front is None else _departure(front, speed)
        own = _FOR_THE_ROUTE_ALONE if name in begin.routed else {}
        lines += [
            "  "
            + element(
                "vType", id=f"type.{name}", **_type(vehicle, speed, front.lane.limit if front else math.inf), **own
            ),
            "  " + element("route", id=f"route.{name}", edges=" ".join(way or next(iter(begin.ways.values())))),
            "  " + opening("vehicle", id=name, type=f"type.{name}", route=f"route.{name}", **place),
            *([f'    <param key="{BODY_PARAMETER}" value="{vehicle.body}"/>'] if vehicle.body else ()),
            "  </vehicle>",
        ]
    return '<?xml version="1.0" encoding="UTF-8"?>\n<routes>\n' + "\n".join(lines) + "\n</routes>\n"


def _departure(front: Spot, speed: float) -> dict[str, object]:
    return {
        "depart": "0",
        "departLane": front.lane.index,
        "departPos": f"{front.position:.3f}",
        "departPosLat": f"{front.offset:.3f}",
        "departSpeed": f"{speed:.4f}",
        # Exactly where the file has it, however near to the next vehicle.
        "insertionChecks": "none",
    }


def _type(vehicle: Vehicle, speed: float, limit: float) -> dict[str, object]:
    """Attributes of a separate type; its driver's desired speed is the initial one."""
    return {
        # Persons and obstacles are on lanes of vehicles as well as on footways.
        "vClass": "ignoring" if vehicle.body else CLASSES[vehicle.category],
        "length": f"{vehicle.length:g}",
        "width": f"{vehicle.width:g}",
        "height": f"{vehicle.height:g}",
        "maxSpeed": f"{vehicle.top_speed:g}",
        "accel": f"{vehicle.acceleration:g}",
        "decel": f"{vehicle.deceleration:g}",
        "emergencyDecel": f"{vehicle.deceleration:g}",
        "speedFactor": f"{speed / limit if speed > STANDS and math.isfinite(limit) else 1.0:.6f}",
        "speedDev": "0",
        "sigma": "0",
    }
