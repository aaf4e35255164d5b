"""The road network and its signs as plain geometry."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class LaneMarking(StrEnum):
    """The line painted along one side of a lane."""

    NONE = "none"
    SOLID = "solid"
    DASHED = "dashed"


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
    """

    lane_id: str
    edge_id: str
    centreline: NDArray[np.float64]
    width: float
    speed_limit: float
    left: LaneMarking
    right: LaneMarking
    outermost: bool


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


@dataclass(frozen=True, slots=True)
class RoadNetwork:
    """Every lane that is drawn, and the axis of the ego's route.

    Attributes
    ----------
    lanes : tuple of Lane
        The lanes.
    route : (n, 3) float64
        Polyline along the route that the ego drives [m].
    """

    lanes: tuple[Lane, ...]
    route: NDArray[np.float64]
