"""Bodies of vehicles, each filling a unit box, and which vehicle has which."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial

from fogsim.scene.bodies.car import ESTATE, HATCHBACK, SALOON, SUV, CarForm, car, simple_car
from fogsim.scene.bodies.large import BUS, VAN, bus, van
from fogsim.scene.bodies.motorcycle import MOTORCYCLE, motorcycle
from fogsim.scene.bodies.simple import Simple, far, tiny
from fogsim.scene.bodies.truck import FLATBED, RIGID, flatbed, rigid, semitrailer, simple_semitrailer
from fogsim.scene.solids import PAINT, Material
from fogsim.scene.trees import FAR, TINY
from fogsim.values.scene import Mesh


@dataclass(frozen=True, slots=True)
class Body:
    """A shape of vehicles.

    Attributes
    ----------
    near : callable
        Makes the shape in full.
    simple : Simple
        What is left of it at a distance.
    """

    near: Callable[[], Mesh]
    simple: Simple


def _car(form: CarForm) -> Body:
    return Body(partial(car, form), simple_car(form))


_WHITE_BOX = Material((0.58, 0.585, 0.58))

BODIES: Mapping[str, Body] = {
    "hatchback": _car(HATCHBACK),
    "saloon": _car(SALOON),
    "estate": _car(ESTATE),
    "suv": _car(SUV),
    "van": Body(van, VAN),
    "semitrailer": Body(partial(semitrailer, _WHITE_BOX), simple_semitrailer(_WHITE_BOX)),
    "semitrailer_curtain": Body(partial(semitrailer, PAINT), simple_semitrailer(PAINT)),
    "rigid_truck": Body(rigid, RIGID),
    "flatbed_truck": Body(flatbed, FLATBED),
    "bus": Body(bus, BUS),
    "motorcycle": Body(motorcycle, MOTORCYCLE),
}
"""Bodies by the name of their shape."""


def body_shapes() -> dict[str, Mesh]:
    """Shapes of all bodies, each with its simple stand-ins for the distance."""
    shapes: dict[str, Mesh] = {}
    for name, body in BODIES.items():
        near = body.near()
        shapes |= {name: near, name + FAR: far(body.simple, near), name + TINY: tiny(body.simple, near)}
    return shapes


@lru_cache(maxsize=65536)
def body_of(vehicle_id: str, kind: str, length: float, height: float) -> str:
    """Name of the shape of a vehicle, the same whenever it is asked.

    Parameters
    ----------
    vehicle_id : str
        Its id, by which vehicles of a kind and size are told apart.
    kind : str
        "car", "van", "truck", "bus" or "motorcycle"; any other is a car.
    length, height : float
        Its size [m]: trucks from 11 m are semitrailers, those below 2.9 m high flatbeds; cars shorter than 4.2 m are
        hatchbacks, those higher than 1.6 m sport utility vehicles, and none longer than 4.6 m is a hatchback.
    """
    chance = zlib.crc32(vehicle_id.encode()) / 2**32
    if kind == "truck":
        if length >= 11.0:
            return "semitrailer" if chance < 0.5 else "semitrailer_curtain"
        return "rigid_truck" if height >= 2.9 else "flatbed_truck"
    if kind in {"van", "bus", "motorcycle"}:
        return kind
    if height > 1.6:
        return "suv"
    if length < 4.2:
        return "hatchback"
    return _LONG[int(chance * len(_LONG))] if length > 4.6 else _ANY[int(chance * len(_ANY))]


_ANY = ("hatchback", "hatchback", "hatchback", "saloon", "saloon", "estate", "estate", "suv", "suv")
_LONG = ("saloon", "saloon", "saloon", "estate", "estate", "suv")
