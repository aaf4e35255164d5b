"""Models of the bodies of vehicles, from which ``tools/make_bodies.py`` makes the data of ``fogsim.scene.vehicles``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from fogsim.scene.solids import Material
from fogsim.values.scene import FAR, SPECK, TINY, Mesh
from vehicle_bodies.car import ESTATE, HATCHBACK, SALOON, SUV, CarForm, car, car_size
from vehicle_bodies.large import bus, carriage, van
from vehicle_bodies.levels import Detail, levels_of_detail
from vehicle_bodies.motorcycle import motorcycle
from vehicle_bodies.projection import Size
from vehicle_bodies.solids import PAINT
from vehicle_bodies.truck import flatbed, rigid, semitrailer, tractor, trailer


@dataclass(frozen=True, slots=True)
class Model:
    """A model of a body."""

    near: Callable[[], Mesh]  # makes the shape in full
    size: Size  # its length, width and height [m]
    shadow: float = 0.5  # half the breadth of the darkness under it, in widths


def _car(form: CarForm) -> Model:
    return Model(partial(car, form), car_size(form))


_WHITE_BOX = Material((0.58, 0.585, 0.58))

MODELS: Mapping[str, Model] = {
    "hatchback": _car(HATCHBACK),
    "saloon": _car(SALOON),
    "estate": _car(ESTATE),
    "suv": _car(SUV),
    "van": Model(van, (5.92, 2.0, 2.59)),
    "semitrailer": Model(partial(semitrailer, _WHITE_BOX), (16.5, 2.55, 4.0)),
    "semitrailer_curtain": Model(partial(semitrailer, PAINT), (16.5, 2.55, 4.0)),
    "tractor": Model(tractor, (6.2, 2.55, 3.93)),
    "trailer": Model(partial(trailer, _WHITE_BOX), (13.65, 2.55, 4.0)),
    "trailer_curtain": Model(partial(trailer, PAINT), (13.65, 2.55, 4.0)),
    "rigid_truck": Model(rigid, (8.5, 2.5, 3.6)),
    "flatbed_truck": Model(flatbed, (7.1, 2.4, 2.4)),
    "bus": Model(bus, (12.0, 2.55, 3.38)),
    "carriage": Model(carriage, (12.0, 2.55, 3.38)),
    "motorcycle": Model(motorcycle, (2.17, 0.8, 1.6), shadow=0.25),
}
"""Bodies by the name of their shape."""


_DETAILS = {
    FAR: Detail({"rear": 9, "front": 6, "left": 5}, 0.03),
    TINY: Detail({"rear": 9, "front": 5, "left": 3}, 0.03),
    SPECK: Detail({"rear": 8, "front": 3, "left": 1}, 0.05),
}


def body_meshes() -> dict[str, Mesh]:
    """Shapes of all bodies by name, each in a unit box and followed by its levels of detail."""
    shapes: dict[str, Mesh] = {}
    for name, model in MODELS.items():
        near = model.near()
        simpler = levels_of_detail(near, model.size, tuple(_DETAILS.values()), model.shadow)
        shapes[name] = near
        shapes |= {name + ending: one for ending, one in zip(_DETAILS, simpler, strict=True)}
    return shapes
