"""What an event does, and what all that read it share."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.entities import Vehicle
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.positions import Positions
from fogsim.openscenario.xml_tree import Node

SHAPES = {"step": "step", "linear": "linear", "sinusoidal": "sinusoidal", "cubic": "sinusoidal"}
"""Shapes of dynamics, and the nearest one in FogSim."""


@dataclass
class Effect:
    """What an event does: timeline blocks by subject, their known duration [s], and conditions that end the rest.

    `routes` are edges through the waypoints of a vehicle's route, and `sets` values of parameters and variables. It
    `ends_itself` if only the run shows its duration, `is_endless` if something else must end it, and `has_unknown_end`
    if nothing shows it. `is_at_start` in ``Init``. Vehicles that it brings onto the road do what `once_there` has.
    """

    do: dict[str, dict[str, Any]] = field(default_factory=dict)
    lasts: float = 0.0
    ends: list[str] = field(default_factory=list)
    routes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    ends_itself: bool = False
    is_endless: bool = False
    has_unknown_end: bool = False
    sets: dict[str, str] = field(default_factory=dict)
    once_there: dict[str, dict[str, Any]] = field(default_factory=dict)
    is_at_start: bool = False

    def add(self, subject: str, **blocks: Any) -> None:
        """Add an action of a subject."""
        mine = self.do.setdefault(subject, {})
        for key, block in blocks.items():
            mine[key] = {**mine.get(key, {}), **block} if key == "lamps" else block

    def changes_speed(self, subject: str) -> bool:
        """Whether a subject's speed changes, or goes by another vehicle's, for some time."""
        speed = self.do.get(subject, {}).get("speed", {})
        is_gradual = "continuous" in speed or "profile" in speed or speed.get("shape", "step") != "step"
        return "follow" in self.do.get(subject, {}) or is_gradual


@dataclass
class ActionReader:
    """What all readers of actions share; `called` gives a vehicle's name in conditions.

    `offsets` are where vehicles are in their lanes after the actions so far, in the file's order.
    """

    vehicles: Mapping[str, Vehicle]
    catalogs: Catalogs
    positions: Positions
    called: Callable[[str], str]
    offsets: dict[str, float] = field(default_factory=dict)

    @property
    def findings(self) -> Findings:
        """Receives what cannot be done."""
        return self.catalogs.findings

    def other(self, node: Node) -> str:
        """The vehicle that an element refers to, as the timeline names it."""
        name = node.get("entityRef")
        if name not in self.vehicles:
            self.findings.refuse(node, f"there is no vehicle {name!r}")
        return self.called(name).strip('"')

    def dynamics(self, node: Node) -> tuple[str, str, float] | None:
        """Shape, dimension and value of a change; None if it happens at once, whatever its dimension."""
        shape, by = self.findings.word(node, "dynamicsShape", tuple(SHAPES)), node.get("dynamicsDimension")
        value = self.findings.number(node, "value", 0.0 if shape == "step" else None, is_finite=by != "rate")
        if shape != "step":
            by = self.findings.word(node, "dynamicsDimension", ("time", "rate", "distance"))
        is_at_once = shape == "step" or math.isinf(value) or (value == 0.0 and by != "rate")
        return None if is_at_once else (shape, by, abs(value))
