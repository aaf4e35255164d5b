"""Bodies of vehicles, each filling a unit box, by the kind of body."""

from collections.abc import Mapping
from typing import Protocol

from fogsim.scene.bodies.car import car
from fogsim.scene.bodies.large import bus, truck, van
from fogsim.scene.bodies.motorcycle import motorcycle
from fogsim.scene.bodies.speck import speck
from fogsim.scene.trees import FAR, TINY
from fogsim.values.scene import Mesh


class _Body(Protocol):
    def __call__(self, *, detail: bool = True) -> Mesh: ...


BODIES: Mapping[str, _Body] = {"car": car, "van": van, "truck": truck, "bus": bus, "motorcycle": motorcycle}
"""Builders of the shapes by kind of body."""


def body_shapes() -> dict[str, Mesh]:
    """Shapes of all bodies, each with its simple stand-ins for the distance."""
    near = {kind: build() for kind, build in BODIES.items()}
    far = {kind + FAR: build(detail=False) for kind, build in BODIES.items()}
    return near | far | {kind + TINY: speck(kind) for kind in BODIES}
