"""The road network and its signs as plain geometry."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class LaneMarking(StrEnum):
    """The line painted along one side of a lane."""

    NONE = "none"
    SOLID = "solid"
    DASHED = "dashed"
    DOUBLE = "double"
    """Solid, one of the pair between the two directions of a road: it lies inside the lane, its twin in the other."""


class LaneKind(StrEnum):
    """What a lane is for."""

    CARRIAGEWAY = "carriageway"
    JUNCTION = "junction"
    """The way of vehicles across a junction."""
    FOOTWAY = "footway"
    CROSSING = "crossing"
    """The way of pedestrians across a carriageway."""


class LaneEnd(StrEnum):
    """The line painted across a lane where it ends."""

    OPEN = "open"
    STOP = "stop"
    YIELD = "yield"


@dataclass(frozen=True, slots=True)
class Lane:
    """One lane.

    Attributes
    ----------
    lane_id, edge_id : str
        Ids in the net.
    centreline : (n, 3) float64
        Polyline along the lane's middle in the direction of travel [m].
    width : float
        Width [m].
    speed_limit : float
        Speed limit [m/s].
    left, right : LaneMarking
        Lines along its sides.
    outermost : bool
        True if no other lane of the carriageway lies to its right.
    kind : LaneKind
        What it is for.
    end : LaneEnd
        Line across its end.
    """

    lane_id: str
    edge_id: str
    centreline: NDArray[np.float64]
    width: float
    speed_limit: float
    left: LaneMarking
    right: LaneMarking
    outermost: bool
    kind: LaneKind = LaneKind.CARRIAGEWAY
    end: LaneEnd = LaneEnd.OPEN


@dataclass(frozen=True, slots=True)
class PavedArea:
    """A paved area that is no strip: where roads meet, or where footways meet next to them.

    Attributes
    ----------
    area_id : str
        Its id in the net.
    outline : (n, 3) float64
        Corners in order around it [m], at least three; it may be concave.
    kind : LaneKind
        JUNCTION or FOOTWAY.
    """

    area_id: str
    outline: NDArray[np.float64]
    kind: LaneKind = LaneKind.JUNCTION


@dataclass(frozen=True, slots=True)
class Sign:
    """A traffic sign.

    Attributes
    ----------
    sign_id : str
        Its id.
    kind : str
        Sign code ("speed_limit", …).
    value : float
        What it says, for a speed limit the speed [m/s].
    position : tuple of float
        (x, y, z) of the middle of its face [m].
    heading : float
        Direction of travel of those it speaks to, counterclockwise from east [rad].
    diameter : float
        Size of its face [m].
    """

    sign_id: str
    kind: str
    value: float
    position: tuple[float, float, float]
    heading: float
    diameter: float


@dataclass(frozen=True, slots=True)
class SignMap:
    """Every sign that the map knows."""

    signs: tuple[Sign, ...] = ()


class StructureKind(StrEnum):
    """What a structure is made like."""

    WALL = "wall"
    HEDGE = "hedge"
    BUILDING = "building"
    TRUCK = "truck"
    TUNNEL = "tunnel"


@dataclass(frozen=True, slots=True)
class Structure:
    """What stands next to a road or over it and hides what is behind: a box, swept along a line.

    Attributes
    ----------
    structure_id : str
        Its id.
    kind : StructureKind
        What it is made like.
    line : (n, 3) float64
        Its middle, at the height of the road [m].
    width : float
        Its width across that line [m].
    bottom, top : float
        Heights above the line between which it is [m].
    """

    structure_id: str
    kind: StructureKind
    line: NDArray[np.float64]
    width: float
    bottom: float
    top: float


@dataclass(frozen=True, slots=True)
class SignalHead:
    """Three lenses one above the other that signal stop or go to the drivers on a lane; or two for pedestrians.

    Attributes
    ----------
    signal_id : str
        The traffic light that it belongs to, as a rule named after its junction.
    lane_id : str
        The lane; for those who walk over a crossing against its direction, the crossing's edge.
    links : tuple of int
        Numbers of the lane's ways across the junction in the state of the traffic light.
    position : tuple of float
        (x, y, z) of the middle lens [m].
    heading : float
        Direction of travel of those it speaks to, counterclockwise from east [rad].
    diameter : float
        Diameter of a lens [m].
    post : tuple of float
        (x, y, z) of the foot of the post that carries it, perhaps by an arm over the road [m].
    on_foot : bool
        Whether it speaks to persons who cross, with a red figure above a green one.
    """

    signal_id: str
    lane_id: str
    links: tuple[int, ...]
    position: tuple[float, float, float]
    heading: float
    diameter: float
    post: tuple[float, float, float]
    on_foot: bool = False


@dataclass(frozen=True, slots=True)
class RoadNetwork:
    """Every lane that is drawn, and the axis of the ego's route.

    Attributes
    ----------
    lanes : tuple of Lane
        The lanes.
    route : (n, 3) float64
        Polyline along the route that the ego drives [m].
    areas : tuple of PavedArea
        Where roads and footways meet.
    route_limits : (n,) float64
        Highest speed limit of the road that leads to each point of the route [m/s]. Empty where it is not known.
    structures : tuple of Structure
        What stands next to the roads and over them.
    signal_heads : tuple of SignalHead
        Heads of the traffic lights.
    """

    lanes: tuple[Lane, ...]
    route: NDArray[np.float64]
    areas: tuple[PavedArea, ...] = ()
    route_limits: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    structures: tuple[Structure, ...] = ()
    signal_heads: tuple[SignalHead, ...] = ()
