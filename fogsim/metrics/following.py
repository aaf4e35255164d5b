"""Who follows whom, from the positions of all vehicles at one instant."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values import TrafficState

_MOST_EMPTY = 8
"""Lanes for each vehicle up to which to count through the empty ones, too, costs less than to sort them out."""


class Following(NamedTuple):
    """Followers and the vehicles ahead of them in the same lane.

    Attributes
    ----------
    follower, leader : (n,) intp
        Rows of the two in the traffic.
    gap : (n,) float64
        Distance from the follower's front bumper to the leader's rear bumper [m], at least 0.
    speed, leader_speed : (n,) float64
        Speeds of the two [m/s].
    """

    follower: NDArray[np.intp]
    leader: NDArray[np.intp]
    gap: NDArray[np.float64]
    speed: NDArray[np.float64]
    leader_speed: NDArray[np.float64]


def find_following(traffic: TrafficState) -> Following:
    """Pair each vehicle with the nearest one ahead of it in its lane; see `pair_in_lanes`."""
    known: dict[str, int] = {}
    lane = np.array([known.setdefault(lane, len(known)) for lane in traffic.lane], dtype=np.intp)
    return pair_in_lanes(traffic.position, traffic.heading, traffic.length, traffic.speed, lane)


def pair_in_lanes(
    position: NDArray[np.float64],
    heading: NDArray[np.float64],
    length: NDArray[np.float64],
    speed: NDArray[np.float64],
    lane: NDArray[np.intp],
) -> Following:
    """Pair each vehicle with the nearest one ahead of it in its lane; lanes end where SUMO's edges end.

    Vehicles of a lane are in the order of their places along the mean of their headings, so a lane may turn by up to
    180° from its first vehicle to its last. Gaps are straight lines: in a curve of radius R they are too short by about
    gap³ / 24 R².

    Parameters
    ----------
    position : (n, 3) float64
        Middle of the front bumper [m].
    heading, length, speed : (n,) float64
        Headings [rad], lengths [m] and speeds [m/s].
    lane : (n,) intp
        Numbers of lanes, from 0; one number for each lane at each instant.
    """
    lane = lane - lane.min(initial=0)
    if lane.max(initial=0) > _MOST_EMPTY * len(lane):
        _, lane = np.unique(lane, return_inverse=True)
    cosine, sine = np.cos(heading), np.sin(heading)
    # The sum of the headings' unit vectors need not have the length 1 to give the order.
    along = position[:, 0] * np.bincount(lane, cosine)[lane] + position[:, 1] * np.bincount(lane, sine)[lane]
    # numpy sorts numbers of 16 bits and less by counting.
    order = np.argsort(along, kind="stable")
    short = lane[order].astype(np.min_scalar_type(lane.max(initial=0)))
    order = order[np.argsort(short, kind="stable")]
    same = lane[order[1:]] == lane[order[:-1]]
    follower, leader = order[:-1][same], order[1:][same]
    way = position[leader] - position[follower]
    distance = np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2 + way[:, 2] ** 2)
    return Following(follower, leader, np.maximum(distance - length[leader], 0.0), speed[follower], speed[leader])
