"""Templates of roads by name."""

import dataclasses
from collections.abc import Sequence
from typing import Protocol

from fogsim.core.registry import Registry
from fogsim.traffic.templates.along_roads import Curve, Grade, Motorway, Rural, Straight, Tunnel
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.ramp import Ramp
from fogsim.traffic.templates.town_roads import Crossing, Roundabout, Streets
from fogsim.traffic.templates.vehicle_types import TOWN_MIX, USUAL_MIX


class RoadTemplate(Protocol):
    """A kind of road; its attributes are its measures, in SI units."""

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road (`cuts` [m])."""
        ...

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""
        ...


ROAD_TEMPLATES: Registry[type[RoadTemplate]] = Registry(
    "road template",
    {
        "motorway": Motorway,
        "ramp": Ramp,
        "straight": Straight,
        "curve": Curve,
        "grade": Grade,
        "rural": Rural,
        "tunnel": Tunnel,
        "crossing": Crossing,
        "roundabout": Roundabout,
    },
)
"""Templates by name."""


def usual_mix(template: str) -> tuple[tuple[str, float], ...]:
    """Default shares of types of vehicles on a template's roads."""
    return TOWN_MIX if issubclass(ROAD_TEMPLATES[template], Streets) else USUAL_MIX


def measures(template: str) -> tuple[str, ...]:
    """Names of the measures that a template has."""
    return tuple(field.name for field in dataclasses.fields(ROAD_TEMPLATES[template]))  # type: ignore[arg-type]
