"""Templates of roads by name."""

import dataclasses
from collections.abc import Sequence
from typing import Protocol

from fogsim.registry import Registry
from fogsim.traffic.templates.along_roads import Curve, Grade, Motorway, Rural, Straight
from fogsim.traffic.templates.net_plan import Layout


class RoadTemplate(Protocol):
    """A kind of road; its attributes are its measures, in SI units."""

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road.

        Parameters
        ----------
        cuts : sequence of float
            Stations at which the ego's way is cut into edges [m].
        """
        ...

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""
        ...


ROAD_TEMPLATES: Registry[type[RoadTemplate]] = Registry(
    "road template",
    {"motorway": Motorway, "straight": Straight, "curve": Curve, "grade": Grade, "rural": Rural},
)
"""Templates by name."""


def measures(template: str) -> tuple[str, ...]:
    """Names of the measures that a template has.

    Parameters
    ----------
    template : str
        Its name.
    """
    return tuple(field.name for field in dataclasses.fields(ROAD_TEMPLATES[template]))  # type: ignore[arg-type]
