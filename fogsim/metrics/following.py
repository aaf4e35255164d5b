"""Who follows whom, from the positions of all vehicles at one instant."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values import TrafficState


class Following(NamedTuple):
    """Followers and the vehicles ahead of them in the same lane.

    Attributes
    ----------
    follower, leader : (n,) intp
        Rows of the two in the traffic.
    gap : (n,) float64
        Distance from the follower's front bumper to the leader's rear bumper [m], at least 0.
    """

    follower: NDArray[np.intp]
    leader: NDArray[np.intp]
    gap: NDArray[np.float64]


def find_following(traffic: TrafficState) -> Following:
    """Pair each vehicle with the nearest one ahead of it in its lane; lanes end where SUMO's edges end.

    Parameters
    ----------
    traffic : TrafficState
        Every vehicle.
    """
    _, lane = np.unique(traffic.lane, return_inverse=True)
    order = np.argsort(lane, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(lane[order])) + 1)
    pairs = [_pair_in_lane(traffic, rows) for rows in groups if len(rows) > 1]
    if not pairs:
        return Following(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros(0))
    follower, leader = np.concatenate(pairs, axis=1)
    distance = np.linalg.norm(traffic.position[leader] - traffic.position[follower], axis=1)
    return Following(follower, leader, np.maximum(distance - traffic.length[leader], 0.0))


def _pair_in_lane(traffic: TrafficState, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Rows of followers and of their leaders (2, m) among the vehicles of one lane."""
    place, heading = traffic.position[rows, :2], traffic.heading[rows]
    way = place[None, :, :] - place[:, None, :]
    ahead = way[..., 0] * np.cos(heading)[:, None] + way[..., 1] * np.sin(heading)[:, None]
    distance = np.where(ahead > 0.0, np.hypot(way[..., 0], way[..., 1]), np.inf)
    nearest = np.argmin(distance, axis=1)
    follows = np.flatnonzero(np.isfinite(distance[np.arange(len(rows)), nearest]))
    return np.stack((rows[follows], rows[nearest[follows]]))
