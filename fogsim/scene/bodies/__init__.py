"""Bodies of vehicles, each filling a unit box, and which vehicle has which."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial

from fogsim.scene.bodies.car import ESTATE, HATCHBACK, SALOON, SUV, CarForm, car, car_size
from fogsim.scene.bodies.large import bus, van
from fogsim.scene.bodies.motorcycle import motorcycle
from fogsim.scene.bodies.seen import Size
from fogsim.scene.bodies.simple import Detail, stand_ins
from fogsim.scene.bodies.truck import flatbed, rigid, semitrailer
from fogsim.scene.solids import PAINT, Material
from fogsim.scene.trees import FAR, SPECK, TINY
from fogsim.values.scene import Mesh


@dataclass(frozen=True, slots=True)
class Body:
    """A shape of vehicles.

    Attributes
    ----------
    near : callable
        Makes the shape in full.
    size : tuple of float
        Its length, width and height [m].
    shadow : float
        Half the breadth of the darkness under it, in widths.
    """

    near: Callable[[], Mesh]
    size: Size
    shadow: float = 0.5


def _car(form: CarForm) -> Body:
    return Body(partial(car, form), car_size(form))


_WHITE_BOX = Material((0.58, 0.585, 0.58))

BODIES: Mapping[str, Body] = {
    "hatchback": _car(HATCHBACK),
    "saloon": _car(SALOON),
    "estate": _car(ESTATE),
    "suv": _car(SUV),
    "van": Body(van, (5.92, 2.0, 2.59)),
    "semitrailer": Body(partial(semitrailer, _WHITE_BOX), (16.5, 2.55, 4.0)),
    "semitrailer_curtain": Body(partial(semitrailer, PAINT), (16.5, 2.55, 4.0)),
    "rigid_truck": Body(rigid, (8.5, 2.5, 3.6)),
    "flatbed_truck": Body(flatbed, (7.1, 2.4, 2.4)),
    "bus": Body(bus, (12.0, 2.55, 3.38)),
    "motorcycle": Body(motorcycle, (2.17, 0.8, 1.6), shadow=0.25),
}
"""Bodies by the name of their shape."""


_DETAILS = {
    FAR: Detail({"rear": 6, "front": 6, "left": 5}, 0.06),
    TINY: Detail({"rear": 5, "front": 4, "left": 3}, 0.03),
    SPECK: Detail({"rear": 4, "front": 2, "left": 1}, 0.1),
}


def body_shapes() -> dict[str, Mesh]:
    """Shapes of all bodies, each with its simple stand-ins for the distance."""
    return dict(_shapes())


@lru_cache(maxsize=1)
def _shapes() -> Mapping[str, Mesh]:
    shapes: dict[str, Mesh] = {}
    for name, body in BODIES.items():
        near = body.near()
        simpler = stand_ins(near, body.size, tuple(_DETAILS.values()), body.shadow)
        shapes[name] = near
        shapes |= {name + ending: one for ending, one in zip(_DETAILS, simpler, strict=True)}
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
